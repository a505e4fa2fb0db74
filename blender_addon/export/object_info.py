"""What materials ask of the objects that they are on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy

# Instances get as many different random numbers, since each has materials of its own.
_RANDOM_STEPS = 64
_MASK = 0xFFFFFFFF


@dataclass(frozen=True)
class ObjectInfo:
    """Outputs of Object Info; those that no material asks for stay as they are here."""

    random: float = 0.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    index: int = 0


def _hash_of_name(name: str) -> int:
    """The number of 32 bits that Cycles makes of an object's name.

    A polynomial of its bytes, and the last mix of Jenkins 2006, "lookup3".
    """
    number = 0
    for byte in name.encode():
        # Cycles' bytes have a sign.
        number = (37 * number + byte - (byte >> 7 << 8)) & _MASK
    start = 0xDEADBEEF + (2 << 2) + 13
    a, b, c = (start + number) & _MASK, start, start

    def stir(x: int, y: int, turn: int) -> int:
        turned = (y << turn | y >> (32 - turn)) & _MASK
        return ((x ^ y) - turned) & _MASK

    c = stir(c, b, 14)
    a = stir(a, c, 11)
    b = stir(b, a, 25)
    c = stir(c, b, 16)
    a = stir(a, c, 4)
    b = stir(b, a, 14)
    return stir(c, b, 24)


def _info_nodes(tree: bpy.types.NodeTree, seen: set[int]) -> Iterator[bpy.types.Node]:
    if tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeObjectInfo":
            yield node
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree:
            yield from _info_nodes(node.node_tree, seen)


def asked(material: bpy.types.Material | None) -> frozenset[str]:
    """Identifiers of the outputs of Object Info that a material may use."""
    if material is None or not material.use_nodes or material.node_tree is None:
        return frozenset()
    nodes = _info_nodes(material.node_tree, set())
    return frozenset(o.identifier for node in nodes for o in node.outputs if o.is_linked)


def object_info(
    item: bpy.types.Object, instance: bpy.types.DepsgraphObjectInstance, outputs: frozenset[str]
) -> ObjectInfo | None:
    """What is asked of an object; None if that is nothing."""
    if not outputs:
        return None
    random = 0.0
    if "Random" in outputs and instance.is_instance:
        steps = _RANDOM_STEPS - 1
        random = round((instance.random_id & _MASK) / _MASK * steps) / steps
    elif "Random" in outputs:
        random = _hash_of_name(item.name) / _MASK
    plain = ObjectInfo()
    r, g, b, alpha = item.color
    return ObjectInfo(
        random,
        (r, g, b) if "Color" in outputs else plain.color,
        alpha if "Alpha" in outputs else plain.alpha,
        item.pass_index if "Object Index" in outputs else plain.index,
    )
