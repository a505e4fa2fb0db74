"""What a picture of a node tree is made of, so that it need not be made twice."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from typing import Any

import bpy

_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
# Where nodes are in the editor and how they look there.
_PLACES = {"location", "location_absolute", "width", "height", "dimensions"}
_LOOKS = _PLACES | {"select", "label", "color"}


def nodes(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    """All nodes, those of groups too."""
    for node in tree.nodes:
        yield node
        if getattr(node, "node_tree", None) is not None:
            yield from nodes(node.node_tree)


def fingerprint(world: bpy.types.World, frame: int) -> str:
    """Equal for worlds that look alike, at a frame if they change by themselves."""
    tree = world.node_tree
    moves = any(owner.animation_data is not None for owner in (world, tree))
    parts = [bpy.data.filepath, world.name, frame if moves else None, *_tree(tree)]
    return repr(parts)


def _tree(tree: bpy.types.NodeTree) -> Iterator[Any]:
    for node in tree.nodes:
        yield node.bl_idname, node.name, _values(node)
        yield [_values(entry) for entry in (*node.inputs, *node.outputs)]
        if getattr(node, "node_tree", None) is not None:
            yield list(_tree(node.node_tree))
        if getattr(node, "color_ramp", None) is not None:
            ramp = node.color_ramp
            yield _values(ramp), [_values(element) for element in ramp.elements]
        if isinstance(getattr(node, "mapping", None), bpy.types.CurveMapping):
            curves = node.mapping.curves
            yield _values(node.mapping), [[_values(p) for p in curve.points] for curve in curves]
        if getattr(node, "texture_mapping", None) is not None:
            yield _values(node.texture_mapping)
        if getattr(node, "image", None) is not None:
            yield _values(node.image_user), *_image(node.image)
        if getattr(node, "object", None) is not None:
            yield node.object.name, [row[:] for row in node.object.matrix_world]
    for link in tree.links:
        ends = (link.from_node.name, link.from_socket.identifier)
        yield *ends, link.to_node.name, link.to_socket.identifier, link.is_muted


def _image(image: bpy.types.Image) -> Iterator[Any]:
    yield image.name, image.source, image.size[:], image.alpha_mode
    yield image.colorspace_settings.name
    if image.packed_file is not None:
        yield zlib.crc32(image.packed_file.data)
        return
    path = bpy.path.abspath(image.filepath, library=image.library)
    yield path, os.path.getmtime(path) if os.path.exists(path) else None


def _values(item: Any) -> list:
    """The plain properties of something, by name."""
    found = []
    for prop in item.bl_rna.properties:
        if prop.type in _PLAIN and prop.identifier not in _LOOKS:
            value = getattr(item, prop.identifier)
            found.append((prop.identifier, value[:] if getattr(prop, "is_array", False) else value))
    return found
