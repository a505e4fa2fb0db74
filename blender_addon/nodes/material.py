"""Materials, worlds and lights: the outputs of their node trees."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy

from ..log import ExportLog
from .closures import BLACK, ClosureTranslator
from .evaluate import Evaluator
from .textures import TextureStore
from .tree import Stack, is_linked, resolve, socket
from .values import Constant, ImageValue, Value, average

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
        self._materials: dict[int, int] = {}
        self.textures = TextureStore(scene, log)

    @property
    def attributes(self) -> set[str]:
        """Names of the mesh attributes that the materials read, so far."""
        return self.textures.attributes

    def material(self, material: bpy.types.Material | None) -> int:
        """Id of a material; None stands for an empty slot, which is grey."""
        key = material.as_pointer() if material else 0
        if key not in self._materials:
            name = material.name if material else "Default"
            self._materials[key] = self._scene.add_material(name, self._material_json(material))
        return self._materials[key]

    def _material_json(self, material: bpy.types.Material | None) -> dict[str, Any]:
        if material is None:
            return {"surface": _DEFAULT_SURFACE}
        result: dict[str, Any] = {"pass_index": material.pass_index}
        if not material.use_nodes or material.node_tree is None:
            result["surface"] = {"type": "diffuse", "color": list(material.diffuse_color[:3])}
            return result
        output = material.node_tree.get_output_node("CYCLES")
        if output is None:
            result["surface"] = BLACK
            return result
        owner = f"Material '{material.name}'"
        result["surface"] = self._surface(owner, output)
        return result

    def _surface(self, owner: str, output: bpy.types.Node) -> dict[str, Any]:
        surface, volume = socket(output, "Surface"), socket(output, "Volume")
        if is_linked(socket(output, "Displacement")):
            self._log.warn(f"{owner}: displacement is not supported, the surface is left as it is")
        if is_linked(volume):
            self._log.warn(f"{owner}: volumes are not supported, the inside is left empty")
            if not is_linked(surface):
                return {"type": "transparent", "color": [1.0, 1.0, 1.0]}
        return ClosureTranslator(Evaluator(owner, self.textures, self._log)).closure(surface)

    def world_radiance(self, world: bpy.types.World) -> Value:
        """Radiance of a world with nodes: a colour, or an image looked up by direction."""
        owner = f"World '{world.name}'"
        output = world.node_tree.get_output_node("CYCLES")
        if output is None:
            return Constant.color((0.0, 0.0, 0.0))
        if is_linked(socket(output, "Volume")):
            self._log.warn(f"{owner}: volumes are not supported, the world is left empty")
        evaluator = Evaluator(owner, self.textures, self._log, world=True)
        return _radiance(evaluator, socket(output, "Surface"), ())

    def light_color(self, light: bpy.types.Light) -> tuple[float, float, float]:
        """What the nodes of a light multiply its power by."""
        output = light.node_tree.get_output_node("CYCLES")
        if output is None:
            return (0.0, 0.0, 0.0)
        evaluator = Evaluator(f"Light '{light.name}'", self.textures, self._log)
        value = _radiance(evaluator, socket(output, "Surface"), ())
        if not isinstance(value, Constant):
            self._log.warn(
                f"Light '{light.name}': a textured light is not supported, its average is used"
            )
        return average(value).rgb


def _radiance(ev: Evaluator, entry: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Emission that arrives at a shader input, as one value."""
    source = resolve(entry, stack)
    node = source.node
    if node is None:
        return Constant.color((0.0, 0.0, 0.0))
    stack = source.stack
    if node.bl_idname in {"ShaderNodeBackground", "ShaderNodeEmission"}:
        color, strength = ev.inputs(node, stack, "Color", "Strength")
        if isinstance(color, ImageValue) and isinstance(strength, Constant):
            return replace(color, gain=color.gain * strength.rgb[0])
        return ev.combine(node, "color", lambda c, s: c * s, color, strength)
    if node.bl_idname == "ShaderNodeAddShader":
        parts = [_radiance(ev, part, stack) for part in node.inputs]
        return ev.combine(node, "color", lambda a, b: a + b, *parts)
    if node.bl_idname == "ShaderNodeMixShader":
        factor = ev.value(node.inputs[0], stack)
        if isinstance(factor, Constant) and factor.rgb[0] in {0.0, 1.0}:
            return _radiance(ev, node.inputs[1 + int(factor.rgb[0])], stack)
        parts = [_radiance(ev, part, stack) for part in node.inputs[1:]]
        return ev.combine(node, "color", lambda t, a, b: a + (b - a) * t.clip(0, 1), factor, *parts)
    ev.warn(node, "this shader", "black is used")
    return Constant.color((0.0, 0.0, 0.0))
