"""Texture coordinates: chains of mapping nodes folded into one matrix."""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
from mathutils import Euler

from .tree import Source, Stack, resolve, socket
from .values import Constant, Coordinates, UnsupportedError, Value

#: The texture transform that changes nothing.
AS_IT_IS = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)

# Gives the value of an input socket.
Evaluate = Callable[[bpy.types.NodeSocket, Stack], Value]


def _constant(entry: bpy.types.NodeSocket, stack: Stack, evaluate: Evaluate) -> np.ndarray:
    value = evaluate(entry, stack)
    if not isinstance(value, Constant):
        raise UnsupportedError(f"a textured input '{entry.name}' of '{entry.node.name}'")
    return np.array(value.rgb)


def _linear(matrix: np.ndarray) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = matrix
    return result


def _shift(offset: np.ndarray) -> np.ndarray:
    result = np.eye(4)
    result[:3, 3] = offset
    return result


def mapping(node: bpy.types.Node, stack: Stack, evaluate: Evaluate) -> np.ndarray:
    """Matrix of a Mapping node."""
    rotation = _linear(
        np.array(Euler(_constant(node.inputs["Rotation"], stack, evaluate), "XYZ").to_matrix())
    )
    scale = _constant(node.inputs["Scale"], stack, evaluate)
    kind = node.vector_type
    if kind in {"VECTOR", "NORMAL"}:
        if kind == "NORMAL":
            scale = np.where(scale != 0, 1.0 / np.where(scale != 0, scale, 1.0), 0.0)
        return rotation @ _linear(np.diag(scale))
    location = _shift(_constant(node.inputs["Location"], stack, evaluate))
    if kind == "POINT":
        return location @ rotation @ _linear(np.diag(scale))
    inverse = np.where(scale != 0, 1.0 / np.where(scale != 0, scale, 1.0), 0.0)
    return _linear(np.diag(inverse)) @ np.linalg.inv(location @ rotation)


def _vector_math(
    node: bpy.types.Node, stack: Stack, evaluate: Evaluate
) -> tuple[np.ndarray, bpy.types.NodeSocket]:
    """Matrix of a Vector Math node that is linear in one input, and that input."""
    first, second = node.inputs[0], node.inputs[1]
    operation = node.operation
    if operation == "SCALE":
        return _linear(np.diag(_constant(socket(node, "Scale"), stack, evaluate))), first
    if operation in {"ADD", "MULTIPLY"} and isinstance(
        evaluate_quietly(first, stack, evaluate), Constant
    ):
        first, second = second, first
    if operation in {"ADD", "SUBTRACT"}:
        offset = _constant(second, stack, evaluate)
        return _shift(offset if operation == "ADD" else -offset), first
    if operation in {"MULTIPLY", "DIVIDE"}:
        factor = _constant(second, stack, evaluate)
        if operation == "DIVIDE":
            factor = np.where(factor != 0, 1.0 / np.where(factor != 0, factor, 1.0), 0.0)
        return _linear(np.diag(factor)), first
    raise UnsupportedError(f"the vector operation {operation.lower()} on texture coordinates")


def evaluate_quietly(entry: bpy.types.NodeSocket, stack: Stack, evaluate: Evaluate) -> Value | None:
    """The value of a socket if it is unlinked, None otherwise."""
    return None if resolve(entry, stack).node is not None else evaluate(entry, stack)


def equirectangular(direction: np.ndarray) -> tuple[float, float]:
    """Where Blender looks a direction up in a picture, from the bottom left; 0 has no direction."""
    length = np.linalg.norm(direction)
    if length == 0.0:
        return 0.0, 0.0
    x, y, z = direction / length
    return 0.5 - np.arctan2(y, x) / (2.0 * np.pi), 0.5 + np.arcsin(z) / np.pi


def coordinates(
    entry: bpy.types.NodeSocket,
    stack: Stack,
    evaluate: Evaluate,
    *,
    world: bool,
    default: str = "uv",
) -> Coordinates:
    """The coordinates that arrive at a texture's Vector input; `default`: where nothing does."""
    matrix = np.eye(4)
    own = entry
    while True:
        source = resolve(entry, stack)
        node = source.node
        if node is None:
            space = "environment" if world else default
            # Where nothing at all arrives at a texture it takes its default coordinates, and in a
            # world the direction; other nodes and groups take the constant of their own input.
            if entry == own and not _has_constant(source, own):
                return Coordinates(space, "", matrix)
            constant = np.array(evaluate(entry, stack).rgb)
            return Coordinates(space, "", _everywhere((matrix @ [*constant, 1.0])[:3]))
        stack = source.stack
        if node.bl_idname == "ShaderNodeMapping":
            matrix = matrix @ mapping(node, stack, evaluate)
            entry = node.inputs["Vector"]
        elif node.bl_idname == "ShaderNodeVectorMath":
            step, entry = _vector_math(node, stack, evaluate)
            matrix = matrix @ step
        else:
            return origin(source, world).by(matrix)


def _has_constant(source: Source, own: bpy.types.NodeSocket) -> bool:
    """Whether a node on the way to a texture's unlinked input gives it a constant."""
    last = source.socket
    return (
        last is not None
        and last != own
        and not last.node.mute
        and last.node.bl_idname != "NodeReroute"
    )


def _everywhere(point: np.ndarray) -> np.ndarray:
    """The matrix that maps everything to one point."""
    result = np.zeros((4, 4))
    result[:3, 3] = point
    result[3, 3] = 1.0
    return result


# What the outputs of Geometry and of Texture Coordinate are.
_OF_GEOMETRY = {"Position": "position", "Normal": "normal", "True Normal": "face normal"}
_OF_TEXTURES = {
    "UV": "uv",
    "Generated": "generated",
    "Object": "object",
    "Normal": "own normal",
}


def origin(source: Source, world: bool) -> Coordinates:
    """What a node provides at the start of a chain."""
    node, name = source.node, source.output.identifier
    kind, space, uv = node.bl_idname, None, ""
    matrix = np.eye(4)
    if world:
        if kind == "ShaderNodeTexCoord" and (
            name == "Generated" or (name == "Object" and node.object is None)
        ):
            space = "environment"
    elif kind == "ShaderNodeUVMap" and not node.from_instancer:
        space, uv = "uv", node.uv_map
    elif kind == "ShaderNodeTexCoord" and not node.from_instancer:
        space = _OF_TEXTURES.get(name)
        if name == "Object" and node.object is not None:
            space, matrix = "position", np.array(node.object.matrix_world.inverted_safe())
    elif kind == "ShaderNodeNewGeometry":
        space = _OF_GEOMETRY.get(name)
    elif kind == "ShaderNodeAttribute" and name == "Vector" and node.attribute_type == "GEOMETRY":
        space, uv = "uv", node.attribute_name
    if space is not None:
        return Coordinates(space, uv, matrix)
    raise UnsupportedError(f"coordinates from the output '{source.output.name}' of '{node.name}'")
