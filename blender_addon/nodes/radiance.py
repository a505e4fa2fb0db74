"""Shader nodes of worlds and lights: emission as one value."""

from __future__ import annotations

from dataclasses import replace

import bpy

from .evaluate import Evaluator
from .tree import Stack, resolve
from .values import Constant, ImageValue, Value, convert

_BLACK = Constant.color((0.0, 0.0, 0.0))


class Radiance:
    """Sums up the emission of one node tree, each node once however often it is used."""

    def __init__(self, evaluator: Evaluator) -> None:
        self.ev = evaluator
        self._memo: dict[tuple, Value] = {}

    def value(self, entry: bpy.types.NodeSocket, stack: Stack = ()) -> Value:
        """What is emitted by the shader that arrives at an input."""
        source = resolve(entry, stack)
        if source.node is None:
            return _BLACK
        if source.output.type != "SHADER":
            # A colour in the place of a shader is emission, as it is for materials.
            return convert(self.ev.value(entry, stack), "color")
        if source.key not in self._memo:
            self._memo[source.key] = self._node(source.node, source.stack)
        return self._memo[source.key]

    def _node(self, node: bpy.types.Node, stack: Stack) -> Value:
        ev = self.ev
        if node.bl_idname in {"ShaderNodeBackground", "ShaderNodeEmission"}:
            color, strength = ev.inputs(node, stack, "Color", "Strength")
            if isinstance(color, ImageValue) and isinstance(strength, Constant):
                return replace(color, gain=color.gain * strength.rgb[0])
            return ev.combine(node, "color", lambda c, s: c * s, color, strength)
        if node.bl_idname == "ShaderNodeAddShader":
            parts = [self.value(part, stack) for part in node.inputs]
            return ev.combine(node, "color", lambda a, b: a + b, *parts)
        if node.bl_idname == "ShaderNodeMixShader":
            return self._mix(node, stack)
        ev.warn(node, "this shader", "black is used")
        return _BLACK

    def _mix(self, node: bpy.types.Node, stack: Stack) -> Value:
        factor = self.ev.value(node.inputs[0], stack)
        if isinstance(factor, Constant) and factor.rgb[0] in {0.0, 1.0}:
            return self.value(node.inputs[1 + int(factor.rgb[0])], stack)
        a, b = (self.value(part, stack) for part in node.inputs[1:])
        return self.ev.combine(
            node, "color", lambda t, a, b: a + (b - a) * t.clip(0, 1), factor, a, b
        )
