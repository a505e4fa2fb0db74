"""What each value node computes: colours, maths, textures, attributes."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import bpy
import numpy as np

from . import operators
from .arithmetic import pick
from .coordinates import AS_IT_IS, equirectangular
from .curves import float_curve, rgb_curves
from .patterns import bricks, checker, gradient, noise, voronoi, wave
from .places import as_value, dot, given, length, looked_up, mapped
from .tree import Stack, is_linked
from .values import (
    KINDS,
    AttributeValue,
    Constant,
    Coordinates,
    ImageValue,
    Kind,
    Sampling,
    UnsupportedError,
    Value,
    component,
    convert,
)
from .views import fresnel, geometry, layer_weight

if TYPE_CHECKING:
    from .evaluate import Evaluator

_WRAP = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "black", "MIRROR": "mirror"}

_RAMP_SIZE = 1024


Handler = Callable[["Evaluator", bpy.types.Node, bpy.types.NodeSocket, Stack], Value]


def _rgb(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    return Constant.color(output.default_value)


def _number(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    return Constant.number(output.default_value)


def _light_path(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    if ev.camera is None or output.identifier != "Is Camera Ray":
        raise UnsupportedError(f"the output '{output.name}'")
    ev.tells_camera = True
    return Constant.number(float(ev.camera))


def _object_info(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    known = ev.info
    values = known and {
        "Random": Constant.number(known.random),
        "Color": Constant.color(known.color),
        "Alpha": Constant.number(known.alpha),
        "Object Index": Constant.number(known.index),
    }
    if not values or output.identifier not in values:
        raise UnsupportedError(f"the output '{output.name}'")
    ev.tells_object = True
    return values[output.identifier]


def _image(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Image Texture and Environment Texture."""
    environment = node.bl_idname == "ShaderNodeTexEnvironment"
    alpha = output.identifier == "Alpha"
    if node.image is None:
        ev.warn(node, "a node without an image", "magenta is used")
        return Constant.number(1.0) if alpha else Constant.color((1.0, 0.0, 1.0))
    if node.projection == "MIRROR_BALL":
        raise UnsupportedError("the mirror ball projection")
    place = looked_up(ev, node, stack, "uv")
    if environment != (isinstance(place, Coordinates) and place.space == "environment"):
        raise UnsupportedError("a texture of this kind in this place")
    if node.interpolation in {"Cubic", "Smart"}:
        ev.warn(node, f"{node.interpolation.lower()} interpolation", "linear is used")
    straight = not environment and is_linked(node.outputs["Alpha"])
    texture_filter = "closest" if node.interpolation == "Closest" else "linear"
    source = ev.textures.source(node.image, node.image_user, straight)
    if not environment:
        tiled = node.image.source == "TILED"
        wrap = "black" if tiled else _WRAP[node.extension]
        if node.projection != "FLAT":
            place = as_value(ev, place)
        uv, transform, at = "", AS_IT_IS, None
        if isinstance(place, Coordinates):
            uv, transform = ev.textures.place(place)
        else:
            at = place
        if tiled:
            across, up = source.pixels().tiles
            transform = (*(x / across for x in transform[:3]), *(y / up for y in transform[3:]))
        sampling = Sampling("uv", transform, uv, wrap, texture_filter, at, _projection(node))
    elif place.point() is not None:
        return pick(source, *equirectangular(place.point()), texture_filter)
    else:
        sampling = Sampling("environment", place.direction_matrix(), filter=texture_filter)
    return ImageValue(source, sampling, "float" if alpha else "color", "a" if alpha else "rgb")


def _projection(node: bpy.types.Node) -> str | dict[str, dict[str, float]]:
    """How the ABI calls an Image Texture's."""
    if node.projection == "BOX":
        return {"box": {"blend": node.projection_blend}}
    return node.projection.lower()


def _attribute(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Attribute and Color Attribute."""
    if ev.world:
        raise UnsupportedError(f"the output '{output.name}'")
    if node.bl_idname == "ShaderNodeVertexColor":
        name = node.layer_name
        if not name:
            raise UnsupportedError("an unnamed colour attribute")
    else:
        name = node.attribute_name
        if node.attribute_type != "GEOMETRY" or not name:
            raise UnsupportedError(f"an attribute of type {node.attribute_type.lower()}")
    factor = output.identifier == "Fac"
    channel = "a" if output.identifier == "Alpha" else "r" if factor else "rgb"
    is_color = node.bl_idname == "ShaderNodeVertexColor"
    return AttributeValue(name, KINDS[output.type], channel, factor, is_color=is_color)


def _math(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    function = operators.MATH[node.operation]
    if node.use_clamp:
        result = ev.combine(
            node, "float", lambda a, b, c: np.clip(function(a, b, c), 0, 1), *_all(ev, node, stack)
        )
    else:
        result = ev.combine(node, "float", function, *_all(ev, node, stack))
    return result


def _all(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> list[Value]:
    return [ev.value(entry, stack) for entry in node.inputs]


def _vector_math(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    operation = node.operation
    values = _all(ev, node, stack)
    if operation in operators.VECTOR_BY_COMPONENT:
        return ev.combine(
            node, "vector", operators.MATH[operators.VECTOR_BY_COMPONENT[operation]], *values[:3]
        )
    if operation in {"LENGTH", "DISTANCE"}:
        subtract = operators.MATH["SUBTRACT"]
        vector = values[0]
        if operation == "DISTANCE":
            vector = ev.combine(node, "vector", subtract, *values[:2], Constant.number(0.0))
        if not isinstance(vector, ImageValue | AttributeValue):
            return length(vector)
    if operation == "DOT_PRODUCT":
        return dot(ev, node, *values[:2])
    if operation in operators.VECTOR_TO_FLOAT:
        return ev.combine(node, "float", operators.VECTOR_TO_FLOAT[operation], *values)
    if operation in operators.VECTOR:
        return ev.combine(node, "vector", operators.VECTOR[operation], *values)
    raise UnsupportedError(f"the vector operation {operation.lower()}")


def _mix(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Mix and the older MixRGB."""
    if node.bl_idname == "ShaderNodeMixRGB":
        names, kind, blend = ("Fac", "Color1", "Color2"), "color", node.blend_type
        clamp_factor, clamp_result = True, node.use_clamp
    else:
        suffix = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
        if suffix is None:
            raise UnsupportedError("mixing rotations")
        factor = (
            "Factor_Vector"
            if suffix == "Vector" and node.factor_mode == "NON_UNIFORM"
            else "Factor_Float"
        )
        names = (factor, f"A_{suffix}", f"B_{suffix}")
        kind = {"Float": "float", "Vector": "vector", "Color": "color"}[suffix]
        blend = node.blend_type if suffix == "Color" else "MIX"
        clamp_factor, clamp_result = node.clamp_factor, node.clamp_result and suffix == "Color"
    function = operators.MIX[blend]

    def apply(t: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        result = function(np.clip(t, 0, 1) if clamp_factor else t, a, b)
        return np.clip(result, 0, 1) if clamp_result else result

    return ev.combine(node, kind, apply, *ev.inputs(node, stack, *names))


def _invert(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    return ev.combine(
        node, "color", lambda t, c: c + (1 - 2 * c) * t, *ev.inputs(node, stack, "Fac", "Color")
    )


def _simple(function: Callable[..., np.ndarray], kind: Kind, *identifiers: str) -> Handler:
    """A node that is one function of its inputs."""

    def handler(
        ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
    ) -> Value:
        return ev.combine(node, kind, function, *ev.inputs(node, stack, *identifiers))

    return handler


def _map_range(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    names = ["Value", "From Min", "From Max", "To Min", "To Max", "Steps"]
    kind: Kind = "float"
    if node.data_type == "FLOAT_VECTOR":
        names = [
            "Vector",
            "From_Min_FLOAT3",
            "From_Max_FLOAT3",
            "To_Min_FLOAT3",
            "To_Max_FLOAT3",
            "Steps_FLOAT3",
        ]
        kind = "vector"
    function = operators.map_range(node.interpolation_type, node.clamp)
    return ev.combine(node, kind, function, *ev.inputs(node, stack, *names))


def _clamp(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    def apply(value: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        if node.clamp_type == "RANGE":
            low, high = np.minimum(low, high), np.maximum(low, high)
        return np.minimum(np.maximum(value, low), high)

    return ev.combine(node, "float", apply, *ev.inputs(node, stack, "Value", "Min", "Max"))


def _ramp(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Color Ramp, by a table."""
    positions = np.linspace(0.0, 1.0, _RAMP_SIZE)
    table = np.array([node.color_ramp.evaluate(position)[:] for position in positions], np.float32)
    table = table[:, 3:] if output.identifier == "Alpha" else table[:, :3]
    if node.color_ramp.interpolation == "CONSTANT":
        # A step must stay one, so the nearest entry is taken below.
        def apply(t: np.ndarray) -> np.ndarray:
            return table[np.clip(t[..., 0] * (_RAMP_SIZE - 1), 0, _RAMP_SIZE - 1).astype(int)]
    else:

        def apply(t: np.ndarray) -> np.ndarray:
            return np.stack(
                [np.interp(t[..., 0], positions, column) for column in table.T], axis=-1
            )

    return ev.combine(node, KINDS[output.type], apply, ev.value(node.inputs["Fac"], stack))


def _separate(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Separate Color and Separate XYZ."""
    index = {"Red": 0, "Green": 1, "Blue": 2, "X": 0, "Y": 1, "Z": 2}[output.identifier]
    value = ev.value(node.inputs[0], stack)
    mode = getattr(node, "mode", "RGB")
    if mode != "RGB":
        separate, _ = operators.COLOR_MODELS[mode]
        return ev.combine(node, "float", lambda c: separate(c)[..., [index]], value)
    if not isinstance(value, Constant) and value.channel == "rgb":
        # A channel of a texture costs nothing.
        return component(value, index)
    return ev.combine(node, "float", lambda c: c[..., [index]], value)


def _combine(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Combine Color and Combine XYZ."""
    mode = getattr(node, "mode", "RGB")

    def apply(*channels: np.ndarray) -> np.ndarray:
        result = np.concatenate(np.broadcast_arrays(*channels), axis=-1)
        return result if mode == "RGB" else operators.COLOR_MODELS[mode][1](result)

    return ev.combine(node, KINDS[output.type], apply, *_all(ev, node, stack))


def _blackbody(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    return Constant.color(operators.blackbody(ev.number(node.inputs["Temperature"], stack)))


def _falloff(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Light Falloff: only the physical, quadratic one without smoothing is."""
    if output.identifier != "Quadratic" or ev.number(node.inputs["Smooth"], stack) != 0.0:
        ev.warn(node, "a falloff that is not quadratic", "the strength is used as it is")
    return ev.value(node.inputs["Strength"], stack)


VALUE_NODES: dict[str, Handler] = {
    "ShaderNodeRGB": _rgb,
    "ShaderNodeValue": _number,
    "ShaderNodeTexImage": _image,
    "ShaderNodeTexEnvironment": _image,
    "ShaderNodeVertexColor": _attribute,
    "ShaderNodeTexBrick": bricks,
    "ShaderNodeTexChecker": checker,
    "ShaderNodeTexGradient": gradient,
    "ShaderNodeTexNoise": noise,
    "ShaderNodeTexVoronoi": voronoi,
    "ShaderNodeTexWave": wave,
    "ShaderNodeAttribute": _attribute,
    "ShaderNodeTexCoord": given,
    "ShaderNodeUVMap": given,
    "ShaderNodeMapping": mapped,
    "ShaderNodeMath": _math,
    "ShaderNodeVectorMath": _vector_math,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix,
    "ShaderNodeInvert": _invert,
    "ShaderNodeRGBCurve": rgb_curves,
    "ShaderNodeFloatCurve": float_curve,
    "ShaderNodeGamma": _simple(operators.gamma, "color", "Color", "Gamma"),
    "ShaderNodeBrightContrast": _simple(
        operators.bright_contrast, "color", "Color", "Bright", "Contrast"
    ),
    "ShaderNodeHueSaturation": _simple(
        operators.hue_saturation, "color", "Color", "Hue", "Saturation", "Value", "Fac"
    ),
    "ShaderNodeRGBToBW": lambda ev, node, output, stack: convert(
        ev.value(node.inputs["Color"], stack), "float"
    ),
    "ShaderNodeMapRange": _map_range,
    "ShaderNodeClamp": _clamp,
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeSeparateColor": _separate,
    "ShaderNodeSeparateXYZ": _separate,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineXYZ": _combine,
    "ShaderNodeBlackbody": _blackbody,
    "ShaderNodeLightFalloff": _falloff,
    "ShaderNodeLightPath": _light_path,
    "ShaderNodeObjectInfo": _object_info,
    "ShaderNodeFresnel": fresnel,
    "ShaderNodeLayerWeight": layer_weight,
    "ShaderNodeNewGeometry": geometry,
}
