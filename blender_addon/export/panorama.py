"""Worlds whose nodes Segue does not know, as the environment maps that Cycles makes of them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..log import ExportLog

_PROCESS = Path(__file__).with_name("panorama_process.py")
#: Seconds after which the process is given up.
_PATIENCE = 120.0
_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
# Where nodes are in the editor and how they look there.
_PLACES = {"location", "location_absolute", "width", "height", "dimensions"}
_LOOKS = _PLACES | {"select", "label", "color"}


@dataclass(frozen=True)
class Panorama:
    """A world's radiance as an environment map of Blender's, and its sun."""

    name: str
    #: (height, width, 3), linear, top row first.
    pixels: np.ndarray
    #: `irradiance`, `direction` to it and `angle` of the whole disk; none where there is none.
    sun: dict[str, Any] | None

    def texels(self) -> np.ndarray:
        """See `ImageSource`."""
        return self.pixels

    def least(self) -> float:
        """See `ImageSource`."""
        return float(self.pixels.min())


#: The last ones, by what they were made of: frames and edits of anything else share them.
_made: dict[str, Panorama] = {}


def panorama(
    world: bpy.types.World, frame: int, is_camera: bool, log: ExportLog
) -> Panorama | None:
    """The world as it is at a frame, for rays from the camera or for others; none on failure."""
    unsaved = [image.name for image in _images(world.node_tree) if image.is_dirty]
    if unsaved:
        log.warn(f"World '{world.name}': its image '{unsaved[0]}' has changes that are not saved")
        return None
    key = repr((is_camera, _fingerprint(world, frame)))
    if key not in _made:
        try:
            made = _render(world, frame, is_camera)
        except (OSError, subprocess.SubprocessError, ValueError) as problem:
            log.warn(f"World '{world.name}': Cycles could not make a picture of it: {problem}")
            return None
        while len(_made) > 1:
            del _made[next(iter(_made))]
        _made[key] = made
    return _made[key]


def _render(world: bpy.types.World, frame: int, is_camera: bool) -> Panorama:
    with tempfile.TemporaryDirectory(prefix="segue-") as folder:
        file, request, output = (str(Path(folder) / n) for n in ("in.blend", "in.json", "out"))
        original = world.original
        bpy.data.libraries.write(file, {original}, path_remap="ABSOLUTE")
        wanted = {"world": original.name, "frame": frame, "is_camera": is_camera}
        Path(request).write_text(json.dumps(wanted))
        if bpy.app.binary_path:
            command = [bpy.app.binary_path, "--background", "--factory-startup"]
            command += ["--python-exit-code", "1", "--python", str(_PROCESS), "--"]
        else:
            command = [sys.executable, str(_PROCESS)]
        done = subprocess.run(
            [*command, file, request, output], capture_output=True, text=True, timeout=_PATIENCE
        )
        if done.returncode:
            lines = (done.stderr.strip() or done.stdout.strip()).splitlines()
            raise ValueError(lines[-1] if lines else f"exit status {done.returncode}")
        pixels = np.load(f"{output}.npy")
        if not np.isfinite(pixels).all():
            raise ValueError("it is not finite everywhere")
        sun = json.loads(Path(f"{output}.json").read_text())
        return Panorama(world.name, np.maximum(pixels, 0.0), sun)


def _images(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Image]:
    for node in tree.nodes:
        if getattr(node, "image", None) is not None:
            yield node.image
        if getattr(node, "node_tree", None) is not None:
            yield from _images(node.node_tree)


def _fingerprint(world: bpy.types.World, frame: int) -> list:
    """All that a picture of the world is made of."""
    tree = world.node_tree
    moves = any(owner.animation_data is not None for owner in (world, tree))
    return [world.name, frame if moves else None, *_tree_parts(tree)]


def _tree_parts(tree: bpy.types.NodeTree) -> Iterator[Any]:
    for node in tree.nodes:
        yield node.bl_idname, node.name, _values(node)
        yield [_values(entry) for entry in node.inputs]
        yield [_values(output) for output in node.outputs]
        if getattr(node, "node_tree", None) is not None:
            yield list(_tree_parts(node.node_tree))
        if getattr(node, "color_ramp", None) is not None:
            ramp = node.color_ramp
            yield _values(ramp), [_values(element) for element in ramp.elements]
        if getattr(node, "mapping", None) is not None:
            yield [[_values(p) for p in curve.points] for curve in node.mapping.curves]
        if getattr(node, "image", None) is not None:
            yield node.image.name, node.image.filepath, node.image.size[:], _values(node.image_user)
    for link in tree.links:
        ends = (link.from_node.name, link.from_socket.identifier)
        yield *ends, link.to_node.name, link.to_socket.identifier, link.is_muted


def _values(item: Any) -> list:
    """The plain properties of something, by name."""
    found = []
    for prop in item.bl_rna.properties:
        if prop.type in _PLAIN and prop.identifier not in _LOOKS:
            value = getattr(item, prop.identifier)
            found.append((prop.identifier, value[:] if getattr(prop, "is_array", False) else value))
    return found
