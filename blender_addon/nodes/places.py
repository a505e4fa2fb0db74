"""Texture coordinates as values: where they are computed with, and where textures are looked up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .coordinates import coordinates, mapping, origin
from .operators import VECTOR_TO_FLOAT
from .tree import Source, Stack, resolve
from .values import (
    FAR,
    NORMALS,
    Composed,
    Constant,
    Coordinates,
    PatternValue,
    PlaceValue,
    UnsupportedError,
    Value,
    bounds,
    component,
    lookups,
)

if TYPE_CHECKING:
    from .evaluate import Evaluator

# Textures that may be looked up for a place: turned, it looks up each component.
_MOST_LOOKUPS = 60


def given(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Texture Coordinate, UV Map and Geometry."""
    if ev.world:
        raise UnsupportedError(f"the output '{output.name}'")
    return as_value(ev, origin(Source(stack, node=node, output=output), world=False))


def mapped(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Mapping, of what is more than texture coordinates."""
    return turned(ev, node, ev.value(node.inputs["Vector"], stack), mapping(node, stack, ev.value))


def turned(ev: Evaluator, node: bpy.types.Node, vector: Value, matrix: np.ndarray) -> Value:
    """A vector by a 4x4 matrix."""
    if isinstance(vector, Constant):
        return Constant.vector(matrix[:3, :3] @ vector.rgb + matrix[:3, 3])
    if isinstance(vector, PlaceValue) and vector.channel == "rgb":
        return PlaceValue(vector.place.by(matrix), vector.extent)

    def apply(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return np.concatenate([x, y, z], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3]

    return ev.combine(node, "vector", apply, *(component(vector, index) for index in range(3)))


def as_value(ev: Evaluator, place: Coordinates | Value) -> Value:
    """Coordinates as numbers."""
    if not isinstance(place, Coordinates):
        return place
    extents = {"object": ev.textures.extent, "position": ev.textures.reach}
    extents |= dict.fromkeys(NORMALS, 1.0)
    return PlaceValue(place, extents.get(place.space, FAR))


def dot(ev: Evaluator, node: bpy.types.Node, a: Value, b: Value) -> Value:
    """The dot product of two vectors."""
    if isinstance(a, Constant):
        a, b = b, a
    if isinstance(b, Constant) and isinstance(a, PlaceValue) and a.channel == "rgb":
        row = [*b.rgb, 0.0]
        return component(turned(ev, node, a, np.array([row, row, row, [0.0, 0.0, 0.0, 1.0]])), 0)
    if any(isinstance(vector, PlaceValue | PatternValue | Composed) for vector in (a, b)):
        pairs = [(component(a, index), component(b, index)) for index in range(3)]
        products = [ev.combine(node, "float", lambda x, y: x * y, *pair) for pair in pairs]
        return ev.combine(node, "float", lambda x, y, z: x + y + z, *products)
    return ev.combine(node, "float", VECTOR_TO_FLOAT["DOT_PRODUCT"], a, b)


def length(vector: Value) -> Value:
    """The length of a vector."""
    if isinstance(vector, Constant):
        return Constant.number(float(np.linalg.norm(vector.rgb)))
    most = float(np.sqrt(3.0) * np.abs(bounds(vector)).max())
    data = {"type": "length"}
    return PatternValue("Length", data, {"of": vector}, (0.0, most), "float", "r")


def looked_up(
    ev: Evaluator, node: bpy.types.Node, stack: Stack, default: str
) -> Coordinates | Value:
    """Where a texture is looked up: at coordinates, or wherever a vector says.

    `default`: the coordinates where nothing arrives.
    """
    entry = node.inputs["Vector"]
    try:
        place = coordinates(entry, stack, ev.value, world=ev.world, default=default)
        return as_value(ev, place) if place.is_geometry else place
    except UnsupportedError as reason:
        if ev.world or not _is_computed(resolve(entry, stack)):
            raise
        vector = ev.value(entry, stack)
        if isinstance(vector, Constant) or lookups(vector) > _MOST_LOOKUPS:
            raise reason from None
        return vector


def _is_computed(source: Source) -> bool:
    """Whether a vector comes from a node that computes it from others."""
    return source.node is not None and any(entry.enabled for entry in source.node.inputs)
