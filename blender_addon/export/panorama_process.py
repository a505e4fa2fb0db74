"""A process of its own that renders a world with Cycles: Blender cannot render while it renders.

`python panorama_process.py WORLD.blend REQUEST.json OUTPUT`, within Blender or with its module.
Writes OUTPUT.npy, the world as an environment map (height, width, 3; linear, top row first), and
OUTPUT.json, the sun that was taken out of it, or null.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

_SIZE = (2048, 1024)
_SAMPLES = 4
# The sun is rendered alone, in a square that is this much wider than its disk.
_SUN_SIZE, _SUN_SAMPLES, _SUN_MARGIN = 128, 16, 4.0
# As large it is looked for, so that samples meet it; a larger one than the second stays in the map.
_LEAST_SUN = 0.02
_LARGEST_SUN = 0.3
# What a second sun may be of the first before both stay in the map.
_REST = 0.01


class Studio:
    """A scene with nothing but the world and a camera in its middle."""

    def __init__(self, file: str, request: dict[str, Any], picture: Path) -> None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.preferences.addon_enable(module="cycles")
        with bpy.data.libraries.load(file) as (_, wanted):
            wanted.worlds = [request["world"]]
        self.scene = bpy.context.scene
        self.world = self.scene.world = wanted.worlds[0]
        # The picture is made by rays from a camera, and of the surface alone.
        self.world.cycles_visibility.camera = True
        output = self.world.node_tree.get_output_node("CYCLES")
        for link in list(output.inputs["Volume"].links):
            self.world.node_tree.links.remove(link)
        _answer_light_paths(self.world.node_tree, request["is_camera"])
        self._place(request["objects"])
        self.scene.frame_set(request["frame"])
        render = self.scene.render
        render.engine = "CYCLES"
        render.resolution_percentage = 100
        render.image_settings.file_format = "OPEN_EXR"
        render.image_settings.color_depth = "32"
        render.filepath = str(picture)
        options = self.scene.cycles
        options.use_denoising = options.use_adaptive_sampling = False
        options.pixel_filter_type, options.filter_width = "BOX", 1.0
        data = bpy.data.cameras.new("Camera")
        self.camera = bpy.data.objects.new("Camera", data)
        self.scene.collection.objects.link(self.camera)
        self.scene.camera = self.camera

    def _place(self, matrices: dict[str, list[list[float]]]) -> None:
        """Replaces the objects that nodes ask where they are."""
        for tree in (self.world.node_tree, *bpy.data.node_groups):
            for node in tree.nodes:
                if getattr(node, "object", None) is not None and node.object.name in matrices:
                    stand_in = bpy.data.objects.new("Place", None)
                    stand_in.matrix_world = Matrix(matrices[node.object.name])
                    self.scene.collection.objects.link(stand_in)
                    node.object = stand_in

    def _render(self, size: tuple[int, int], samples: int) -> np.ndarray:
        render = self.scene.render
        render.resolution_x, render.resolution_y = size
        self.scene.cycles.samples = samples
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(render.filepath)
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(size[1], size[0], 4)[..., :3]

    def panorama(self) -> np.ndarray:
        """The whole world, as Blender looks up environment maps: +X in the middle, +Z on top."""
        data = self.camera.data
        data.type = "PANO"
        # Blender 5.0 made it a property of the camera itself.
        owner = data if hasattr(data, "panorama_type") else data.cycles
        owner.panorama_type = "EQUIRECTANGULAR"
        self.camera.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
        return self._render(_SIZE, _SAMPLES)

    def view(self, towards: Vector, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A square view; with it the directions of its pixels, and their solid angles."""
        data = self.camera.data
        data.type, data.angle = "PERSP", angle
        turn = towards.to_track_quat("-Z", "Y").to_matrix()
        self.camera.rotation_euler = turn.to_euler()
        pixels = self._render((_SUN_SIZE, _SUN_SIZE), _SUN_SAMPLES)
        edge = math.tan(angle / 2)
        at = (np.arange(_SUN_SIZE) + 0.5) / _SUN_SIZE * 2 * edge - edge
        x, y = np.meshgrid(at, at)
        directions = np.stack([x, y, -np.ones_like(x)], -1)
        length = np.linalg.norm(directions, axis=-1, keepdims=True)
        solid_angles = (2 * edge / _SUN_SIZE) ** 2 / length[..., 0] ** 3
        return pixels, directions / length @ np.array(turn).T, solid_angles

    def discs(self) -> list[bpy.types.Node]:
        """Nodes that show a sun."""
        nodes = _used(self.world.node_tree.get_output_node("CYCLES"))
        skies = [n for n in nodes if n.bl_idname == "ShaderNodeTexSky" and n.sun_disc]
        return [n for n in skies if n.sky_type not in {"PREETHAM", "HOSEK_WILKIE"}]


def _used(*ends: bpy.types.Node) -> list[bpy.types.Node]:
    """The nodes whose values arrive at some, in groups as well."""
    found: dict[int, bpy.types.Node] = {}
    pending = list(ends)
    while pending:
        node = pending.pop()
        if node.as_pointer() in found or node.mute:
            continue
        found[node.as_pointer()] = node
        if getattr(node, "node_tree", None) is not None:
            pending += [n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput"]
        links = (link for entry in node.inputs for link in entry.links)
        pending += [link.from_node for link in links if link.is_valid and not link.is_muted]
    return list(found.values())


def _answer_light_paths(tree: bpy.types.NodeTree, is_camera: bool) -> None:
    """Camera rays look at the world here, whichever rays it is rendered for."""
    for owner in (tree, *bpy.data.node_groups):
        asked = [
            (link.from_socket.name, link.to_socket)
            for link in owner.links
            if link.from_node.bl_idname == "ShaderNodeLightPath"
            and link.is_valid
            and not link.is_muted
        ]
        for name, entry in asked:
            value = owner.nodes.new("ShaderNodeValue")
            value.outputs[0].default_value = float(name == "Is Camera Ray" and is_camera)
            owner.links.new(value.outputs[0], entry)


def _directions() -> np.ndarray:
    """The directions of a panorama's pixels."""
    width, height = _SIZE
    longitude = math.pi - (np.arange(width) + 0.5) / width * 2 * math.pi
    latitude = ((np.arange(height) + 0.5) / height - 0.5)[:, None] * math.pi
    level = np.cos(latitude)
    parts = level * np.cos(longitude), level * np.sin(longitude), np.sin(latitude)
    return np.stack(np.broadcast_arrays(*parts), -1)


def _take_out_sun(studio: Studio) -> tuple[np.ndarray, dict[str, Any] | None]:
    """The panorama without a sun, and that sun; or with it, and none."""
    discs = studio.discs()
    for node in discs:
        node.sun_disc = False
    sky = studio.panorama()
    if not discs:
        return sky, None
    sizes = [node.sun_size for node in discs]
    for node, size in zip(discs, sizes, strict=True):
        node.sun_disc, node.sun_size = True, max(size, _LEAST_SUN)
    whole = studio.panorama()
    for node, size in zip(discs, sizes, strict=True):
        node.sun_size = size
    directions = _directions()
    added = (whole - sky).sum(-1) * np.hypot(directions[..., 0], directions[..., 1])
    peak = directions[np.unravel_index(added.argmax(), added.shape)]
    if added.max() <= 0.0:
        return sky, None
    angle = max(sizes)
    reach = _SUN_MARGIN * max(angle, _LEAST_SUN)
    elsewhere = np.abs(added[directions @ peak < math.cos(reach)]).sum()
    if angle > _LARGEST_SUN or elsewhere > _REST * added.sum():
        return studio.panorama(), None
    for node in discs:
        node.sun_disc = False
    dark, directions, solid_angles = studio.view(Vector(peak), _SUN_MARGIN * angle)
    for node in discs:
        node.sun_disc = True
    bright, _, _ = studio.view(Vector(peak), _SUN_MARGIN * angle)
    share = (bright - dark) * solid_angles[..., None]
    centre = (directions * share.sum(-1, keepdims=True)).sum((0, 1))
    return sky, {
        "irradiance": np.maximum(share.sum((0, 1)), 0.0).tolist(),
        "direction": (centre / np.linalg.norm(centre)).tolist(),
        "angle": angle,
    }


def main(arguments: list[str]) -> None:
    """See the module."""
    file, request, output = arguments
    studio = Studio(file, json.loads(Path(request).read_text()), Path(f"{output}.exr"))
    sky, sun = _take_out_sun(studio)
    np.save(f"{output}.npy", sky[::-1])
    Path(f"{output}.json").write_text(json.dumps(sun))


if __name__ == "__main__":
    main(sys.argv[-3:])
