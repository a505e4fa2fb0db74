"""Along which direction anisotropic surfaces are brushed."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from .evaluate import Evaluator
from .tree import Stack, resolve
from .values import Coordinates, PlaceValue

# Around an axis of the box that the generated coordinates fill: what they are multiplied by.
_AROUND = {
    "X": [[0.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.5], [0.0, 1.0, 0.0, -0.5]],
    "Y": [[0.0, 0.0, -1.0, 0.5], [0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, -0.5]],
    "Z": [[0.0, -1.0, 0.0, 0.5], [1.0, 0.0, 0.0, -0.5], [0.0, 0.0, 0.0, 0.0]],
}


def tangent(
    ev: Evaluator, node: bpy.types.Node, entry: bpy.types.NodeSocket | None, stack: Stack
) -> dict[str, Any]:
    """The tangent at an input of a shader node: around the z axis where nothing arrives."""
    axis = "Z"
    source = resolve(entry, stack) if entry is not None else None
    if source is not None and source.node is not None:
        if source.node.bl_idname != "ShaderNodeTangent":
            ev.warn(node, "a computed tangent", "one around the z axis is used")
        elif source.node.direction_type == "UV_MAP":
            return {"uv": source.node.uv_map}
        else:
            axis = source.node.axis
    matrix = np.array([*_AROUND[axis], [0.0, 0.0, 0.0, 1.0]])
    place = PlaceValue(Coordinates("generated", "", matrix), 1.0)
    return {"along": ev.textures.json(place, "vector")}
