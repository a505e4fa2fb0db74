"""Small builders of Blender scenes for the cases."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix

OUTPUT = Path(os.environ.get("SEGUE_TEST_OUTPUT", "."))


def link(data: Any, name: str = "", matrix: Any = None) -> bpy.types.Object:
    """An object for `data` in the scene's collection."""
    item = bpy.data.objects.new(name or (data.name if data else "Empty"), data)
    bpy.context.scene.collection.objects.link(item)
    if matrix is not None:
        item.matrix_world = matrix
    return item


def mesh(name: str, points: Sequence, faces: Sequence) -> bpy.types.Mesh:
    """A mesh from points and polygons."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(points, [], faces)
    data.update()
    return data


def quad(name: str = "Quad", size: float = 1.0) -> bpy.types.Mesh:
    """A square of half width `size` in the XY plane with a UV map over all of it."""
    data = mesh(
        name,
        [(-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0)],
        [(0, 1, 2, 3)],
    )
    layer = data.uv_layers.new(name="UVMap")
    layer.uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    return data


def cube(name: str = "Cube", half: float = 1.0) -> bpy.types.Mesh:
    """A closed cube with outward normals."""
    points = [(x * half, y * half, z * half) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(name, points, faces)


def sphere(
    name: str = "Sphere", radius: float = 1.0, segments: int = 32, rings: int = 16
) -> bpy.types.Mesh:
    """A smooth UV sphere with a UV map."""
    import bmesh

    work = bmesh.new()
    work.loops.layers.uv.verify()
    bmesh.ops.create_uvsphere(
        work, u_segments=segments, v_segments=rings, radius=radius, calc_uvs=True
    )
    data = bpy.data.meshes.new(name)
    work.to_mesh(data)
    work.free()
    data.shade_smooth()
    return data


def camera(matrix: Any = None, **properties: Any) -> bpy.types.Object:
    """The scene's camera."""
    data = bpy.data.cameras.new("Camera")
    for name, value in properties.items():
        setattr(data, name, value)
    item = link(data, "Camera", matrix)
    bpy.context.scene.camera = item
    return item


def light(kind: str, matrix: Any = None, name: str = "", **properties: Any) -> bpy.types.Object:
    """A light with the given properties."""
    data = bpy.data.lights.new(name or kind.title(), kind)
    for key, value in properties.items():
        setattr(data, key, value)
    return link(data, name or kind.title(), matrix)


def material(
    name: str = "Material",
) -> tuple[bpy.types.Material, bpy.types.NodeTree, bpy.types.Node]:
    """A material with an empty node tree and its output node."""
    data = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        data.use_nodes = True
    tree = data.node_tree
    tree.nodes.clear()
    return data, tree, tree.nodes.new("ShaderNodeOutputMaterial")


def shader_material(kind: str, name: str = "Material", **inputs: Any) -> bpy.types.Material:
    """A material of one shader node; inputs by identifier, with underscores for spaces."""
    data, tree, output = material(name)
    node = tree.nodes.new(f"ShaderNode{kind}")
    for key, value in inputs.items():
        node.inputs[key.replace("_", " ")].default_value = value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return data


def world(name: str = "World") -> tuple[bpy.types.World, bpy.types.NodeTree, bpy.types.Node]:
    """The scene's world with a Background node, which is returned."""
    data = bpy.data.worlds.new(name)
    if bpy.app.version < (5, 0, 0):
        data.use_nodes = True
    tree = data.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputWorld")
    node = tree.nodes.new("ShaderNodeBackground")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    bpy.context.scene.world = data
    return data, tree, node


def settings(width: int = 64, height: int = 48, engine: str = "SEGUE") -> bpy.types.Scene:
    """The scene, set up for a small render."""
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    return scene


def image(
    name: str, pixels: np.ndarray, colorspace: str = "sRGB", *, is_float: bool = False
) -> bpy.types.Image:
    """An image of the file from (height, width, 4) values, row 0 on top."""
    height, width = pixels.shape[:2]
    data = bpy.data.images.new(name, width, height, alpha=True, float_buffer=is_float)
    data.colorspace_settings.name = colorspace
    data.pixels.foreach_set(np.ascontiguousarray(pixels[::-1], np.float32).ravel())
    data.update()
    return data


def patches(side: int, seed: int = 2) -> np.ndarray:
    """Opaque pixels of random colours, (side, side, 4)."""
    pixels = np.ones((side, side, 4), np.float32)
    pixels[..., :3] = np.random.default_rng(seed).random((side, side, 3))
    return pixels


class _Messages(logging.Handler):
    """Keeps what the add-on warns about."""

    def __init__(self) -> None:
        super().__init__()
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.texts.append(record.getMessage())


def export() -> tuple[Any, list[str]]:
    """Render with the recording package; what it recorded, and the warnings."""
    import fake_segue

    if bpy.context.scene.camera is None:
        camera(Matrix.Translation((0, 0, 5)))
    settings()
    warnings = warned(render)
    return fake_segue.SCENES[-1], warnings


def warned(function: Callable[[], None]) -> list[str]:
    """Call `function`; what the add-on warned about meanwhile."""
    messages = _Messages()
    logger = logging.getLogger("segue.blender")
    logger.addHandler(messages)
    function()
    logger.removeHandler(messages)
    return messages.texts


def render(**options: Any) -> None:
    """Press F12."""
    bpy.ops.render.render(**options)


def read(path: Path) -> np.ndarray:
    """A picture file as (height, width, 4) floats, row 0 on top."""
    data = bpy.data.images.load(str(path))
    width, height = data.size
    values = np.empty(4 * width * height, np.float32)
    data.pixels.foreach_get(values)
    bpy.data.images.remove(data)
    return values.reshape(height, width, 4)[::-1]


def exr_channels(path: Path) -> set[str]:
    """Names of all channels of an EXR file (OpenEXR file layout, section "Channel List")."""
    names: set[str] = set()
    data = path.read_bytes()
    version = int.from_bytes(data[4:8], "little")
    multipart = bool(version & 0x1000)
    position = 8
    while True:
        # A header is a list of attributes and ends with an empty name; a file of several parts
        # has several headers and ends with an empty one.
        if data[position] == 0:
            return names
        part, found = "", []
        while data[position] != 0:
            name, position = _text(data, position)
            kind, position = _text(data, position)
            size = int.from_bytes(data[position : position + 4], "little")
            position += 4
            if name == "name":
                part = data[position : position + size].decode()
            if kind == "chlist":
                at = position
                while data[at] != 0:
                    channel, at = _text(data, at)
                    found.append(channel)
                    at += 16
            position += size
        position += 1
        names |= {
            name if name.startswith(part + ".") or not part else f"{part}.{name}" for name in found
        }
        if not multipart:
            return names


def _text(data: bytes, position: int) -> tuple[str, int]:
    end = data.index(0, position)
    return data[position:end].decode(), end + 1
