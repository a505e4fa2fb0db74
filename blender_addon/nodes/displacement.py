"""Displacement: what a material's surface is raised by."""

from __future__ import annotations

from typing import Any

import bpy

from .evaluate import Evaluator
from .tree import is_linked, resolve, socket
from .values import Constant


def raised(ev: Evaluator, output: bpy.types.Node) -> dict[str, Any] | None:
    """How high a material raises its surface, as the ABI writes it; None where it does not."""
    source = resolve(socket(output, "Displacement"), ())
    node = source.node
    if node is None:
        return None
    if node.bl_idname != "ShaderNodeDisplacement":
        ev.warn(node, "displacement by a vector", "the surface is left as it is")
        return None
    if is_linked(socket(node, "Normal")):
        ev.warn(node, "a direction of displacement", "the surface's normal is used")
    height = ev.combine(
        node,
        "float",
        lambda height, middle, scale: (height - middle) * scale,
        *ev.inputs(node, source.stack, "Height", "Midlevel", "Scale"),
    )
    if height == Constant.number(0.0):
        return None
    space = "object" if node.space == "OBJECT" else "world"
    return {"height": ev.textures.json(height, "float"), "space": space}
