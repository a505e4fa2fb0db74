"""Materials, worlds and lights: the outputs of their node trees."""

from __future__ import annotations

from typing import Any

import bpy

from ..export.object_info import ObjectInfo
from ..log import ExportLog
from .arithmetic import average
from .closures import BLACK, Closure, ClosureTranslator
from .displacement import raised
from .evaluate import Evaluator
from .interior import absorption
from .radiance import Radiance
from .textures import TextureStore
from .tree import is_linked, socket
from .values import Constant, Value

# What Cycles gives to a surface without a material: since 5.0 what a new material looks like.
_DEFAULT_SURFACE: dict[str, Any] = (
    {"type": "principled", "base_color": [0.8, 0.8, 0.8], "roughness": 0.5, "ior": 1.5}
    if bpy.app.version >= (5, 0, 0)
    else {"type": "diffuse", "color": [0.8, 0.8, 0.8]}
)


class Translator:
    """Translates the node trees of one export into `scene`."""

    def __init__(self, scene: Any, log: ExportLog) -> None:
        self._scene = scene
        self._log = log
        self._materials: dict[tuple[int, ObjectInfo | None], int] = {}
        #: Names of the projections that each material looks up, by its id.
        self.projections: dict[int, frozenset[str]] = {}
        self.textures = TextureStore(scene, log)

    def material(self, material: bpy.types.Material | None, info: ObjectInfo | None = None) -> int:
        """Id of a material; None stands for an empty slot, which is grey.

        `info`: what the materials of the object ask of it; each that does is one of its own.
        """
        pointer = material.as_pointer() if material else 0
        known = self._materials.get((pointer, None), self._materials.get((pointer, info)))
        if known is not None:
            return known
        name = material.name if material else "Default"
        self.textures.asked.clear()
        data, tells_object = self._material_json(material, info)
        identifier = self._scene.add_material(name, data)
        self._materials[pointer, info if tells_object else None] = identifier
        self.projections[identifier] = frozenset(self.textures.asked)
        return identifier

    def _material_json(
        self, material: bpy.types.Material | None, info: ObjectInfo | None
    ) -> tuple[dict[str, Any], bool]:
        """A material, and whether it depends on the object."""
        if material is None:
            return {"surface": _DEFAULT_SURFACE}, False
        result: dict[str, Any] = {"pass_index": material.pass_index}
        if not material.use_nodes or material.node_tree is None:
            result["surface"] = {"type": "diffuse", "color": list(material.diffuse_color[:3])}
            return result, False
        output = material.node_tree.get_output_node("CYCLES")
        if output is None:
            result["surface"] = BLACK
            return result, False
        owner = f"Material '{material.name}'"
        evaluator = Evaluator(owner, self.textures, self._log, info=info)
        method = material.displacement_method
        height = raised(evaluator, output)
        has_bumps = bool(height and method != "DISPLACEMENT" and isinstance(height["height"], dict))
        if height and method != "BUMP":
            result["displacement"] = {**height, "keeps_normals": has_bumps}
        inside = absorption(evaluator, socket(output, "Volume"))
        if inside.any():
            result["absorption"] = inside.tolist()
        raising = set(self.textures.asked)
        self.textures.asked.clear()
        # What both look up is evaluated once, so of what moves the surface it is not asked.
        evaluator.view = True
        result["surface"] = self._surface(evaluator, output, height if has_bumps else None)
        spaces = {self.textures.projections[name].space for name in self.textures.asked}
        if "displacement" in result and "object" in spaces:
            self._log.warn(
                f"{owner}: coordinates of a displaced object are not supported, "
                "those before its displacement are used"
            )
        self.textures.asked |= raising
        # Blender 4.2 moved this switch from Cycles' settings.
        if not getattr(material, "use_transparent_shadow", True) and _lets_through(
            result["surface"]
        ):
            self._log.warn(
                f"{owner}: opaque shadows are not supported, its shadows are transparent"
            )
        return result, evaluator.tells_object

    def _surface(
        self, evaluator: Evaluator, output: bpy.types.Node, bumps: dict[str, Any] | None
    ) -> dict[str, Any]:
        surface = socket(output, "Surface")
        if is_linked(socket(output, "Volume")) and not is_linked(surface):
            return {"type": "transparent", "color": [1.0, 1.0, 1.0]}
        return ClosureTranslator(evaluator, bumps).closure(surface)

    def world_radiance(self, world: bpy.types.World) -> tuple[list[Value], list[str]]:
        """Radiance of a world with nodes: a colour, or an image looked up by direction.

        Where the camera sees another one, that is the second. With it, what is to be said if
        nothing better is found.
        """
        owner = f"World '{world.name}'"
        output = world.node_tree.get_output_node("CYCLES")
        if output is None:
            return [Constant.color((0.0, 0.0, 0.0))], []
        if is_linked(socket(output, "Volume")):
            self._log.warn(f"{owner}: volumes are not supported, the world is left empty")
        values, simplified = [], []
        for camera in (False, True):
            evaluator = Evaluator(owner, self.textures, self._log, world=True, camera=camera)
            values.append(Radiance(evaluator).value(socket(output, "Surface")))
            simplified += evaluator.simplified
            if not evaluator.tells_camera:
                break
        return values, simplified

    def light_color(self, light: bpy.types.Light) -> tuple[float, float, float]:
        """What the nodes of a light multiply its power by."""
        output = light.node_tree.get_output_node("CYCLES")
        if output is None:
            return (0.0, 0.0, 0.0)
        evaluator = Evaluator(f"Light '{light.name}'", self.textures, self._log)
        value = Radiance(evaluator).value(socket(output, "Surface"))
        if not isinstance(value, Constant):
            self._log.warn(
                f"Light '{light.name}': a textured light is not supported, its average is used"
            )
        return average(value).rgb


def _lets_through(closure: Closure) -> bool:
    """Whether a closure has a transparent part."""
    if closure["type"] in {"mix", "add"}:
        return _lets_through(closure["a"]) or _lets_through(closure["b"])
    return closure["type"] == "transparent"
