"""Shader nodes as closures of the ABI, by one table."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy

from .evaluate import Evaluator
from .fresnel import fresnel_ior, glass
from .tangents import tangent
from .tree import Stack, resolve, socket
from .values import KINDS, Composed, Constant, ImageValue, Value, convert, is_negative

Closure = dict[str, Any]

BLACK: Closure = {"type": "diffuse", "color": [0.0, 0.0, 0.0]}


@dataclass(frozen=True)
class Shader:
    """How a node becomes a closure.

    `keys`: ABI key -> input identifier. `extra`: keys with a fixed value. `ignored`: inputs that
    Segue has no key for, and the value at which they do nothing. Inputs that a version of Blender
    does not have are skipped.
    """

    closure: str
    keys: dict[str, str]
    extra: dict[str, Any] = field(default_factory=dict)
    ignored: dict[str, float] = field(default_factory=dict)
    normals: dict[str, str] = field(default_factory=lambda: {"normal": "Normal"})


_THIN_FILM: dict[str, float] = {"Thin Film Thickness": 0.0}

SHADERS: dict[str, Shader] = {
    "ShaderNodeBsdfDiffuse": Shader("diffuse", {"color": "Color", "roughness": "Roughness"}),
    "ShaderNodeBsdfAnisotropic": Shader(
        "glossy",
        {
            "color": "Color",
            "roughness": "Roughness",
            "anisotropy": "Anisotropy",
            "rotation": "Rotation",
        },
    ),
    "ShaderNodeBsdfGlass": Shader(
        "glass", {"color": "Color", "roughness": "Roughness", "ior": "IOR"}, ignored=_THIN_FILM
    ),
    "ShaderNodeBsdfRefraction": Shader(
        "refraction", {"color": "Color", "roughness": "Roughness", "ior": "IOR"}
    ),
    "ShaderNodeBsdfTransparent": Shader("transparent", {"color": "Color"}, normals={}),
    "ShaderNodeBsdfTranslucent": Shader("translucent", {"color": "Color"}),
    "ShaderNodeBsdfSheen": Shader("sheen", {"color": "Color", "roughness": "Roughness"}),
    "ShaderNodeBsdfMetallic": Shader(
        "principled",
        {
            "base_color": "Base Color",
            "specular_tint": "Edge Tint",
            "roughness": "Roughness",
            "anisotropy": "Anisotropy",
            "rotation": "Rotation",
        },
        extra={"metallic": 1.0},
        ignored=_THIN_FILM,
    ),
    "ShaderNodeEmission": Shader(
        "emission", {"color": "Color", "strength": "Strength"}, normals={}
    ),
    "ShaderNodeBackground": Shader(
        "emission", {"color": "Color", "strength": "Strength"}, normals={}
    ),
    "ShaderNodeSubsurfaceScattering": Shader("diffuse", {"color": "Color"}),
    "ShaderNodeBsdfPrincipled": Shader(
        "principled",
        {
            "base_color": "Base Color",
            "diffuse_roughness": "Diffuse Roughness",
            "metallic": "Metallic",
            "roughness": "Roughness",
            "ior": "IOR",
            "specular_level": "Specular IOR Level",
            "specular_tint": "Specular Tint",
            "anisotropy": "Anisotropic",
            "rotation": "Anisotropic Rotation",
            "transmission": "Transmission Weight",
            "coat": "Coat Weight",
            "coat_roughness": "Coat Roughness",
            "coat_ior": "Coat IOR",
            "coat_tint": "Coat Tint",
            "sheen": "Sheen Weight",
            "sheen_roughness": "Sheen Roughness",
            "sheen_tint": "Sheen Tint",
            "emission_color": "Emission Color",
            "emission_strength": "Emission Strength",
        },
        ignored=_THIN_FILM | {"Thin Wall": 0.0},
        normals={"normal": "Normal", "coat_normal": "Coat Normal"},
    ),
}

# The ABI has no shared closures: a branch that is used twice counts twice, and a few dozen nodes
# that share what is below them would become billions. Surfaces that make sense stay far below.
_MOST_SHADERS = 256

# Closures whose microfacets may lose what they scatter more than once. Refraction always does.
_MICROFACETS = ("glossy", "glass", "principled")

# Shaders without a counterpart: the closure that comes nearest, and how that is said.
_NEAREST: dict[str, tuple[str, str]] = {
    "ShaderNodeBsdfToon": ("diffuse", "a diffuse surface is used"),
    "ShaderNodeBsdfHair": ("diffuse", "a diffuse surface is used"),
    "ShaderNodeBsdfHairPrincipled": ("diffuse", "a diffuse surface is used"),
    "ShaderNodeEeveeSpecular": ("diffuse", "a diffuse surface of its base colour is used"),
    "ShaderNodeBsdfRayPortal": ("transparent", "light passes straight through"),
    "ShaderNodeHoldout": ("black", "a black surface is used"),
}


class ClosureTranslator:
    """Translates the closures of one node tree, each once however often it is used.

    `raised`: the bump map under all that have no normal of their own.
    """

    def __init__(self, evaluator: Evaluator, raised: dict[str, Any] | None) -> None:
        self.ev = evaluator
        self.raised = raised
        self._memo: dict[tuple, Closure] = {}
        # Number of shaders in each closure, by identity.
        self._sizes: dict[int, int] = {}

    def closure(self, entry: bpy.types.NodeSocket, stack: Stack = ()) -> Closure:
        """The closure that arrives at a shader input; black where nothing does."""
        source = resolve(entry, stack)
        node = source.node
        if node is None:
            return BLACK
        if source.output.type != "SHADER":
            # Blender shows a colour that is plugged into a shader input as emission.
            value = convert(self.ev.value(entry, stack), "color")
            return {
                "type": "emission",
                "color": self.ev.textures.json(value, "color"),
                "strength": 1.0,
            }
        if source.key not in self._memo:
            closure = self._node(node, source.stack)
            self._sizes[id(closure)] = self._size(closure)
            self._memo[source.key] = closure
        return self._memo[source.key]

    def _node(self, node: bpy.types.Node, stack: Stack) -> Closure:
        if node.bl_idname == "ShaderNodeMixShader":
            return self._mix(node, stack)
        if node.bl_idname == "ShaderNodeAddShader":
            a, b = (self.closure(entry, stack) for entry in node.inputs)
            return self._limited(node, {"type": "add", "a": a, "b": b})
        shader = SHADERS.get(node.bl_idname)
        if shader is None:
            return self._nearest(node, stack)
        return self._shader(node, shader, stack)

    def _mix(self, node: bpy.types.Node, stack: Stack) -> Closure:
        ior = fresnel_ior(self.ev, resolve(node.inputs[0], stack))
        if ior is not None:
            parts = [self.closure(entry, stack) for entry in node.inputs[1:]]
            surface = glass(self.ev, node, ior, *parts)
            if surface is not None:
                return surface
        factor = self.ev.value(node.inputs[0], stack)
        if isinstance(factor, Constant):
            share = min(max(factor.rgb[0], 0.0), 1.0)
            # A branch that has no share is not translated, so that nothing is said about it.
            if share in {0.0, 1.0}:
                return self.closure(node.inputs[1 + int(share)], stack)
            factor = Constant.number(share)
        a, b = (self.closure(entry, stack) for entry in node.inputs[1:])
        if a == b:
            return a
        return self._limited(
            node,
            {"type": "mix", "factor": self.ev.textures.json(factor, "float"), "a": a, "b": b},
        )

    def _limited(self, node: bpy.types.Node, closure: Closure) -> Closure:
        """A pair of closures, or the first one where together they are too many."""
        if self._size(closure) <= _MOST_SHADERS:
            return closure
        self.ev.warn(node, f"a surface of more than {_MOST_SHADERS} shaders", "the first is used")
        return closure["a"]

    def _size(self, closure: Closure) -> int:
        if id(closure) in self._sizes:
            return self._sizes[id(closure)]
        if closure["type"] not in {"mix", "add"}:
            return 1
        return self._size(closure["a"]) + self._size(closure["b"])

    def _nearest(self, node: bpy.types.Node, stack: Stack) -> Closure:
        kind, text = _NEAREST.get(node.bl_idname, ("black", "black is used"))
        self.ev.warn(node, "this shader", text)
        if kind == "black":
            return BLACK
        colors = [entry for entry in node.inputs if entry.type == "RGBA"]
        return {
            "type": kind,
            "color": self.ev.textures.json(self.ev.value(colors[0], stack), "color"),
        }

    def _shader(self, node: bpy.types.Node, shader: Shader, stack: Stack) -> Closure:
        result: Closure = {"type": shader.closure, **shader.extra}
        values: dict[str, Value] = {}
        for key, identifier in shader.keys.items():
            entry = socket(node, identifier)
            if entry is not None:
                values[key] = self.ev.value(entry, stack)
                result[key] = self.ev.textures.json(values[key], KINDS[entry.type])
        if values.get("anisotropy", Constant.number(0.0)) != Constant.number(0.0):
            result["tangent"] = tangent(self.ev, node, socket(node, "Tangent"), stack)
        for key, identifier in shader.normals.items():
            normal = self._normal(socket(node, identifier), stack)
            if normal is not None:
                result[key] = normal
        if shader.closure in _MICROFACETS and getattr(node, "distribution", "") != "MULTI_GGX":
            result["multiscatter"] = False
        self._warn_ignored(node, shader, stack)
        for color, strength in (("color", "strength"), ("emission_color", "emission_strength")):
            if strength in values:
                self._warn_negative(node, values[color], values[strength])
        if node.bl_idname == "ShaderNodeBsdfPrincipled":
            return self._with_alpha(node, result, stack)
        return result

    def _with_alpha(self, node: bpy.types.Node, closure: Closure, stack: Stack) -> Closure:
        alpha = self.ev.value(socket(node, "Alpha"), stack)
        if isinstance(alpha, Constant) and alpha.rgb[0] >= 1.0:
            return closure
        return {
            "type": "mix",
            "factor": self.ev.textures.json(alpha, "float"),
            "a": {"type": "transparent", "color": [1.0, 1.0, 1.0]},
            "b": closure,
        }

    def _warn_ignored(self, node: bpy.types.Node, shader: Shader, stack: Stack) -> None:
        for identifier, neutral in shader.ignored.items():
            entry = socket(node, identifier)
            if entry is None:
                continue
            value = self.ev.value(entry, stack)
            if not isinstance(value, Constant) or value.rgb[0] != neutral:
                self.ev.warn(node, f"'{entry.name}'", "it is left out")
        self._warn_special(node, stack)

    def _warn_negative(self, node: bpy.types.Node, color: Value, strength: Value) -> None:
        if isinstance(color, Constant) and isinstance(strength, Constant):
            below = any(channel * strength.rgb[0] < 0.0 for channel in color.rgb)
        else:
            some = is_negative(color) or is_negative(strength)
            below = some and strength != Constant.number(0.0)
        if below:
            self.ev.warn(node, "negative emission", "that part is left out")

    def _warn_special(self, node: bpy.types.Node, stack: Stack) -> None:
        """Approximations that depend on more than one socket."""
        kind = node.bl_idname
        weight = socket(node, "Subsurface Weight")
        if kind == "ShaderNodeSubsurfaceScattering" or (
            weight is not None and self.ev.value(weight, stack) != Constant.number(0.0)
        ):
            self.ev.warn(
                node, "subsurface scattering", "diffuse reflection of the same colour is used"
            )
        if kind == "ShaderNodeBsdfMetallic" and node.fresnel_type != "F82":
            self.ev.warn(node, "a measured conductor", "Base Color and Edge Tint are used")
        if getattr(node, "distribution", "") in {"BECKMANN", "ASHIKHMIN_SHIRLEY"} and (
            self.ev.value(socket(node, "Roughness"), stack) != Constant.number(0.0)
        ):
            self.ev.warn(node, f"the {node.distribution.title()} distribution", "GGX is used")

    def _normal(self, entry: bpy.types.NodeSocket | None, stack: Stack) -> dict[str, Any] | None:
        """The normal or bump map at a Normal input; None for the surface's own normal."""
        source = resolve(entry, stack) if entry is not None else None
        if source is None or source.node is None:
            return self.raised
        node = source.node
        if node.bl_idname == "ShaderNodeBump":
            return self._bump_map(node, source.stack)
        if node.bl_idname == "ShaderNodeNewGeometry" and source.output.identifier == "Normal":
            return self.raised
        if node.bl_idname != "ShaderNodeNormalMap":
            self.ev.warn(node, "a computed normal", "the surface's own is used")
            return self.raised
        return self._normal_map(node, source.stack)

    def _bump_map(self, node: bpy.types.Node, stack: Stack) -> dict[str, Any] | None:
        below = self._normal(node.inputs["Normal"], stack)
        height = self.ev.value(node.inputs["Height"], stack)
        if isinstance(height, Constant):
            return below
        distance = self.ev.number(node.inputs["Distance"], stack)
        strength = self.ev.value(node.inputs["Strength"], stack)
        bump = {
            "height": self.ev.textures.json(height, "float"),
            "distance": -distance if node.invert else distance,
            "strength": self.ev.textures.json(strength, "float"),
        }
        return bump | ({"normal": below} if below else {})

    def _normal_map(self, node: bpy.types.Node, stack: Stack) -> dict[str, Any] | None:
        space = {"TANGENT": "tangent", "OBJECT": "object", "WORLD": "world"}.get(node.space)
        value = self.ev.value(node.inputs["Color"], stack)
        if isinstance(value, Constant):
            return None
        is_scaled = isinstance(value, ImageValue | Composed)
        if space is None or not is_scaled or value.channel != "rgb":
            self.ev.warn(node, "a normal map of this kind", "the surface's own normal is used")
            return None
        # DirectX's green points down; the choice is new in Blender 5.1.
        up = -1.0 if getattr(node, "convention", "OPENGL") == "DIRECTX" else 1.0
        return {
            "texture": self.ev.textures.texture(value, (2.0, 2.0 * up, 2.0), (-1.0, -up, -1.0)),
            "strength": self.ev.textures.json(
                self.ev.value(node.inputs["Strength"], stack), "float"
            ),
            "space": space,
            "uv": node.uv_map if space == "tangent" else "",
        }
