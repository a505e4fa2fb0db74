"""The whole export: from an evaluated depsgraph to a filled `segue.Scene`."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import bpy

from ..log import ExportLog
from ..nodes.material import Translator
from .instances import Group, Survey, survey
from .lights import light_json
from .mesh import MeshArrays, add_mesh
from .world import export_world


class Exporter:
    """Fills `scene` with all but the camera."""

    def __init__(
        self,
        segue: ModuleType,
        depsgraph: bpy.types.Depsgraph,
        log: ExportLog,
        stop: Callable[[], bool],
        *,
        is_preview: bool = False,
    ) -> None:
        self.scene = segue.Scene()
        self._segue = segue
        self._depsgraph = depsgraph
        self._log = log
        self._stop = stop
        self._is_preview = is_preview
        self._translator = Translator(self.scene, log)
        # Mesh pointer -> id; None for a mesh without faces.
        self._meshes: dict[int, int | None] = {}
        # Mesh pointer -> names of the projections that its materials look up.
        self._asked: dict[int, set[str]] = {}

    def run(self) -> bool:
        """Export everything; false when the user wants to stop."""
        _warn_scene(self._depsgraph, self._log)
        found = survey(self._depsgraph, self._log, self._stop)
        if found is None:
            return False
        self._translator.textures.extent = found.extent
        self._translator.textures.reach = found.reach
        # Materials come first: they tell which attributes of the meshes are read.
        slots = [
            [
                self._translator.material(material, group.traits.info)
                for material in group.traits.materials
            ]
            for group in found.groups
        ]
        for group, materials in zip(found.groups, slots, strict=True):
            asked = self._asked.setdefault(group.mesh.as_pointer(), set())
            asked.update(*(self._translator.projections[material] for material in materials))
        for group, materials in zip(found.groups, slots, strict=True):
            if self._stop():
                return False
            self._add_group(group, materials, found)
        self._add_lights(found)
        export_world(
            self.scene,
            self._depsgraph,
            self._translator,
            self._log,
            self._stop,
            is_preview=self._is_preview,
        )
        return not self._stop()

    def _add_group(self, group: Group, materials: list[int], found: Survey) -> None:
        """Add the instances of a group, and its mesh when it is met for the first time."""
        pointer = group.mesh.as_pointer()
        if pointer not in self._meshes:
            arrays = MeshArrays(group.mesh)
            self._meshes[pointer] = None
            if arrays.triangle_count:
                textures = self._translator.textures
                self._meshes[pointer] = add_mesh(
                    self._segue,
                    self.scene,
                    arrays,
                    readings=textures.readings,
                    uvs=textures.uvs,
                    projections={
                        name: textures.projections[name] for name in sorted(self._asked[pointer])
                    },
                    log=self._log,
                )
        mesh = self._meshes[pointer]
        if mesh is None:
            return
        self.scene.add_instances(
            group.traits.name,
            mesh,
            found.matrices[group.members],
            materials=materials,
            camera_visible=group.traits.camera_visible,
            two_sided_emission=True,
            object_index=group.traits.pass_index,
        )

    def _add_lights(self, found: Survey) -> None:
        for entry in found.lights:
            data = light_json(
                entry.name,
                entry.light,
                found.matrices[entry.index],
                entry.camera_visible,
                self._translator,
                self._log,
            )
            if data is not None:
                self.scene.add_light(entry.name, data)


def _warn_scene(depsgraph: bpy.types.Depsgraph, log: ExportLog) -> None:
    """Name settings of the scene that Segue does not follow."""
    render = depsgraph.scene_eval.render
    if render.use_motion_blur:
        log.warn("Motion blur is not supported, the scene stands still while the shutter is open")
    if render.use_freestyle:
        log.warn("Freestyle lines are not rendered")
    cycles = getattr(depsgraph.scene_eval, "cycles", None)
    for kind in ("reflective", "refractive"):
        if not getattr(cycles, f"caustics_{kind}", True):
            log.warn(f"Leaving out {kind} caustics is not supported, they are rendered")
    if render.film_transparent and getattr(cycles, "film_transparent_glass", False):
        log.warn("Transparent glass is not supported, glass hides the transparent background")
    # Blender 5.0 made the working space a property of the file.
    space = getattr(bpy.data, "colorspace", None)
    if space is not None and space.working_space != "Linear Rec.709":
        name = space.working_space
        log.warn(f"The working colour space {name} is not supported, Linear Rec.709 is used")
