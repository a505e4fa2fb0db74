"""Nodes whose values depend on the direction that a surface is seen from."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .places import given
from .tree import Stack, is_linked
from .values import PatternValue, UnsupportedError, Value

if TYPE_CHECKING:
    from .evaluate import Evaluator


def fresnel(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Fresnel."""
    return ev.combine(
        node, "float", _reflectance, _facing(ev, node, output), ev.value(node.inputs["IOR"], stack)
    )


def layer_weight(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Layer Weight."""
    blend = ev.value(node.inputs["Blend"], stack)
    apply = _reflectance_of_blend if output.identifier == "Fresnel" else _edge
    return ev.combine(node, "float", apply, _facing(ev, node, output), blend)


def geometry(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Geometry: the side that is seen, places and normals."""
    if output.identifier != "Backfacing":
        return given(ev, node, output, stack)
    return ev.combine(node, "float", lambda facing: (facing < 0.0) * 1.0, _facing(ev, node, output))


def _facing(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket) -> Value:
    """The cosine to the surface's normal, negative on its back."""
    if not ev.view:
        raise UnsupportedError(f"the output '{output.name}'")
    if "Normal" in node.inputs and is_linked(node.inputs["Normal"]):
        ev.warn(node, "a normal of its own", "the surface's is used")
    return PatternValue("Facing", {"type": "facing"}, {}, (-1.0, 1.0), "float", "r")


def _reflectance(facing: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """Of a dielectric (Fresnel); from behind, that of its inside."""
    ior = np.maximum(ior, 1e-5)
    eta = np.where(facing < 0.0, 1.0 / ior, ior)
    c = np.abs(facing)
    g = np.sqrt(np.maximum(eta * eta - 1.0 + c * c, 0.0))
    across, along = (g - c) / (g + c), (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.where(g > 0.0, 0.5 * across**2 * (1.0 + along**2), 1.0)


def ior_of_blend(blend: np.ndarray | float) -> np.ndarray:
    """The refractive index that Layer Weight's reflectance is of."""
    return 1.0 / np.maximum(1.0 - blend, 1e-5)


def _reflectance_of_blend(facing: np.ndarray, blend: np.ndarray) -> np.ndarray:
    return _reflectance(facing, ior_of_blend(blend))


def _edge(facing: np.ndarray, blend: np.ndarray) -> np.ndarray:
    """One at the silhouette, zero where the surface is looked at straight on."""
    blend = np.clip(blend, 0.0, 1.0 - 1e-5)
    exponent = np.where(blend < 0.5, 2.0 * blend, 0.5 / (1.0 - blend))
    return 1.0 - np.abs(facing) ** exponent
