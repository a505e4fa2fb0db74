"""Walking node trees: through reroutes, node groups and muted nodes, against the links."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

# The group nodes that enclose a socket, outermost first.
Stack = tuple[bpy.types.Node, ...]


@dataclass(frozen=True)
class Source:
    """Where a socket gets its value from.

    Either the `output` of a `node`, or, when that is None, the default value of the unlinked
    input `socket`; `socket` itself is None where nothing at all arrives. `kinds` lists the types of
    the sockets passed on the way, from the source to the asking socket.
    """

    stack: Stack
    node: bpy.types.Node | None = None
    output: bpy.types.NodeSocket | None = None
    socket: bpy.types.NodeSocket | None = None
    kinds: tuple[str, ...] = ()

    @property
    def key(self) -> tuple:
        """Tells the output of a node in its groups from all others."""
        assert self.node is not None and self.output is not None
        groups = tuple(group.as_pointer() for group in self.stack)
        return self.node.as_pointer(), self.output.identifier, groups


def _same(
    sockets: bpy.types.NodeInputs | bpy.types.NodeOutputs, identifier: str
) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)


def socket(node: bpy.types.Node, identifier: str) -> bpy.types.NodeSocket | None:
    """An input by its identifier: unlike names, these did not change between Blender's versions."""
    return _same(node.inputs, identifier)


def is_linked(entry: bpy.types.NodeSocket | None) -> bool:
    """Whether a value arrives through a working link."""
    return entry is not None and any(link.is_valid and not link.is_muted for link in entry.links)


def _group_output(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next(
        (node for node in outputs if node.is_active_output), outputs[0] if outputs else None
    )


def resolve(entry: bpy.types.NodeSocket, stack: Stack) -> Source:
    """Follow an input socket to the node, or the constant, that feeds it."""
    kinds: list[str] = [entry.type]
    while True:
        links = [link for link in entry.links if link.is_valid and not link.is_muted]
        if not links:
            return Source(stack, socket=entry, kinds=tuple(reversed(kinds)))
        node, output = links[0].from_node, links[0].from_socket
        inner: bpy.types.NodeSocket | None
        if node.bl_idname == "NodeReroute":
            inner = node.inputs[0]
        elif node.mute:
            inner = next(
                (link.from_socket for link in node.internal_links if link.to_socket == output), None
            )
        elif node.bl_idname == "ShaderNodeGroup":
            end = _group_output(node.node_tree) if node.node_tree else None
            inner = _same(end.inputs, output.identifier) if end else None
            stack = (*stack, node)
        elif node.bl_idname == "NodeGroupInput":
            inner = _same(stack[-1].inputs, output.identifier) if stack else None
            stack = stack[:-1]
        else:
            kinds.append(output.type)
            return Source(stack, node=node, output=output, kinds=tuple(reversed(kinds)))
        if inner is None:
            return Source(stack, kinds=tuple(reversed(kinds)))
        kinds.append(inner.type)
        entry = inner
