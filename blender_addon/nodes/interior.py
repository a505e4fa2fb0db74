"""The volume output of a material: what its inside absorbs."""

from __future__ import annotations

import bpy
import numpy as np

from .evaluate import Evaluator
from .tree import Stack, resolve, socket

#: An absorption coefficient by channel, per metre.
Coefficient = np.ndarray
NONE: Coefficient = np.zeros(3)


def absorption(ev: Evaluator, entry: bpy.types.NodeSocket, stack: Stack = ()) -> Coefficient:
    """The absorption coefficient of what arrives at a volume input; the rest is named."""
    source = resolve(entry, stack)
    node, stack = source.node, source.stack
    if node is None:
        return NONE
    if node.bl_idname == "ShaderNodeAddShader":
        return sum((absorption(ev, part, stack) for part in node.inputs), NONE)
    if node.bl_idname == "ShaderNodeMixShader":
        share = min(max(ev.number(node.inputs[0], stack), 0.0), 1.0)
        a, b = (absorption(ev, part, stack) for part in node.inputs[1:])
        return (1.0 - share) * a + share * b
    translate = _SHADERS.get(node.bl_idname)
    if translate is None:
        ev.warn(node, "this volume", "nothing is absorbed")
        return NONE
    return np.maximum(translate(ev, node, stack), 0.0)


def _rgb(ev: Evaluator, node: bpy.types.Node, identifier: str, stack: Stack) -> np.ndarray:
    return np.array(ev.constant(socket(node, identifier), stack).rgb)


def _lost(ev: Evaluator, node: bpy.types.Node, what: str, amount: np.ndarray | float) -> None:
    if np.any(np.asarray(amount) > 0.0):
        ev.warn(node, f"{what} of volumes", "they only absorb")


def _absorber(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> Coefficient:
    density = ev.number(socket(node, "Density"), stack)
    return (1.0 - _rgb(ev, node, "Color", stack)) * density


def _principled(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> Coefficient:
    density = max(ev.number(socket(node, "Density"), stack), 0.0)
    color = np.maximum(_rgb(ev, node, "Color", stack), 0.0)
    _lost(ev, node, "scattering", color * density)
    for identifier in ("Emission Strength", "Blackbody Intensity"):
        _lost(ev, node, "emission", ev.number(socket(node, identifier), stack))
    through = np.sqrt(np.maximum(_rgb(ev, node, "Absorption Color", stack), 0.0))
    return np.maximum(1.0 - color, 0.0) * np.maximum(1.0 - through, 0.0) * density


def _coefficients(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> Coefficient:
    for what in ("Scatter", "Emission"):
        _lost(ev, node, what.lower(), _rgb(ev, node, f"{what} Coefficients", stack))
    return _rgb(ev, node, "Absorption Coefficients", stack)


def _scatterer(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> Coefficient:
    _lost(ev, node, "scattering", ev.number(socket(node, "Density"), stack))
    return NONE


_SHADERS = {
    "ShaderNodeVolumeAbsorption": _absorber,
    "ShaderNodeVolumePrincipled": _principled,
    "ShaderNodeVolumeCoefficients": _coefficients,
    "ShaderNodeVolumeScatter": _scatterer,
}
