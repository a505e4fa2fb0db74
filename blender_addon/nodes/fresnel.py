"""Mixes by a Fresnel node, which the ABI's closures hold as one layered surface."""

from __future__ import annotations

from typing import Any

import bpy

from .evaluate import Evaluator
from .tree import Source
from .values import Constant, Value

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
        return Constant.number(1.0 / max(1.0 - blend, 1e-5))
    return None


def layered(
    ev: Evaluator, node: bpy.types.Node, ior: Value, a: Closure, b: Closure
) -> Closure | None:
    """`b` over `a`, mixed by the Fresnel reflectance of `ior`; None for other pairs of shaders.

    Refraction below glossy reflection is a pane of glass; diffuse below it a varnished surface.
    """
    if b["type"] != "glossy":
        return None
    index = ev.textures.json(ior, "float")
    normal = {"normal": a["normal"]} if "normal" in a else {}
    if a["type"] == "refraction":
        if (a["color"], a["roughness"]) != (b["color"], b["roughness"]) or a["ior"] != index:
            ev.warn(node, "a mix of unequal refraction and reflection", "the refraction's is used")
        keys = ("color", "roughness", "ior")
        return {"type": "glass", **{key: a[key] for key in keys}, **normal}
    if a["type"] == "diffuse":
        return {
            "type": "principled",
            "base_color": a["color"],
            "diffuse_roughness": a["roughness"],
            "roughness": b["roughness"],
            "anisotropy": b["anisotropy"],
            "rotation": b["rotation"],
            "specular_tint": b["color"],
            "ior": index,
            **normal,
        }
    return None
