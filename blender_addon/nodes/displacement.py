"""Displacement: what a material's surface is raised by, as a bump map."""

from __future__ import annotations

from typing import Any

import bpy

from .evaluate import Evaluator
from .tree import is_linked, resolve, socket
from .values import Constant

_NOT_MOVED = "displacement that moves the surface"


def raised(ev: Evaluator, output: bpy.types.Node, method: str) -> dict[str, Any] | None:
    """The bump map of a material's displacement; None where it has none that would show."""
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
    if isinstance(height, Constant):
        if height.rgb[0] != 0.0 and method != "BUMP":
            ev.warn(node, _NOT_MOVED, "the surface is left as it is")
        return None
    if method != "BUMP":
        ev.warn(node, _NOT_MOVED, "it is shown as bumps")
    space = "object" if node.space == "OBJECT" else "world"
    return {"height": ev.textures.json(height, "float"), "space": space}
