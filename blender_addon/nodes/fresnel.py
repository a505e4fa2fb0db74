"""Refraction and reflection mixed by a Fresnel node, which is glass."""

from __future__ import annotations

from typing import Any

import bpy

from .evaluate import Evaluator
from .tree import Source
from .values import Constant, Value
from .views import ior_of_blend

Closure = dict[str, Any]


def fresnel_ior(ev: Evaluator, source: Source) -> Value | None:
    """The refractive index behind a mix factor; None if the factor is not a Fresnel term."""
    node = source.node
    if node is None:
        return None
    if node.bl_idname == "ShaderNodeFresnel":
        return ev.value(node.inputs["IOR"], source.stack)
    if node.bl_idname == "ShaderNodeLayerWeight" and source.output.identifier == "Fresnel":
        blend = ev.number(node.inputs["Blend"], source.stack)
        return Constant.number(float(ior_of_blend(blend)))
    return None


def glass(
    ev: Evaluator, node: bpy.types.Node, ior: Value, a: Closure, b: Closure
) -> Closure | None:
    """Refraction mixed with glossy reflection by the Fresnel reflectance of `ior`: a pane of glass.

    None for other pairs of shaders.
    """
    if (a["type"], b["type"]) != ("refraction", "glossy"):
        return None
    index = ev.textures.json(ior, "float")
    normal = {"normal": a["normal"]} if "normal" in a else {}
    if (a["color"], a["roughness"]) != (b["color"], b["roughness"]) or a["ior"] != index:
        ev.warn(node, "a mix of unequal refraction and reflection", "the refraction's is used")
    keys = ("color", "roughness", "ior")
    return {"type": "glass", **{key: a[key] for key in keys}, **normal}
