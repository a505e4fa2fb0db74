"""The whole export: from an evaluated depsgraph to a filled `segue.Scene`."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import bpy

from ..log import ExportLog
from ..nodes.material import Translator
from .instances import Survey, survey
from .lights import light_json
from .mesh import export_mesh
from .world import export_world


def export_scene(
    segue: ModuleType, depsgraph: bpy.types.Depsgraph, log: ExportLog, stop: Callable[[], bool]
) -> Any | None:
    """A `segue.Scene` without its camera; None when the user wants to stop."""
    scene = segue.Scene()
    _warn_scene(depsgraph, log)
    found = survey(depsgraph, log, stop)
    if found is None:
        return None
    translator = Translator(scene, log)
    materials = [
        [translator.material(material) for material in group.traits.materials]
        for group in found.groups
    ]
    if not _export_meshes(segue, scene, found, materials, translator, stop):
        return None
    for entry in found.lights:
        data = light_json(
            entry.name,
            entry.light,
            found.matrices[entry.index],
            entry.camera_visible,
            translator,
            log,
        )
        if data is not None:
            scene.add_light(entry.name, data)
    export_world(scene, depsgraph, translator, log)
    return scene


def _export_meshes(
    segue: ModuleType,
    scene: Any,
    found: Survey,
    materials: list[list[int]],
    translator: Translator,
    stop: Callable[[], bool],
) -> bool:
    """Add every mesh once and all its instances; false when the user wants to stop."""
    meshes: dict[int, int | None] = {}
    for group, slots in zip(found.groups, materials, strict=True):
        if stop():
            return False
        pointer = group.mesh.as_pointer()
        if pointer not in meshes:
            meshes[pointer] = export_mesh(segue, scene, group.mesh, translator.attributes)
        mesh = meshes[pointer]
        if mesh is None:
            continue
        scene.add_instances(
            group.traits.name,
            mesh,
            found.matrices[group.members],
            materials=slots,
            camera_visible=group.traits.camera_visible,
            two_sided_emission=True,
            object_index=group.traits.pass_index,
        )
    return True


def _warn_scene(depsgraph: bpy.types.Depsgraph, log: ExportLog) -> None:
    """Name settings of the scene that Segue does not follow."""
    render = depsgraph.scene_eval.render
    if render.use_motion_blur:
        log.warn("Motion blur is not supported, the scene stands still while the shutter is open")
    if render.use_freestyle:
        log.warn("Freestyle lines are not rendered")
    # Blender 5.0 made the working space a property of the file.
    space = getattr(bpy.data, "colorspace", None)
    if space is not None and space.working_space != "Linear Rec.709":
        name = space.working_space
        log.warn(f"The working colour space {name} is not supported, Linear Rec.709 is used")
