"""The world: a dome with a colour or an environment map."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
from mathutils import Vector

from ..log import ExportLog
from ..nodes.material import Translator
from ..nodes.values import Constant, ImageValue, Sampling, Value, bounds
from .lights import ALL_BOUNCES
from .panorama import Panorama, panorama

# Columns: where the axes of the ABI's dome lie in Blender's world. Blender's map has +X in its
# centre column, +Y a quarter to the left and +Z on top.
_BLENDER_FROM_DOME = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

# How a map that shows the world around it is looked up.
_AS_IT_IS = Sampling("environment", (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))

# Sizes of a mapping along its axes that differ less are equal but for rounding.
_LARGEST_STRETCH = 1.0 + 1e-4

_RAY_FLAGS = {
    "diffuse": "diffuse",
    "glossy": "glossy",
    "transmission": "transmission",
    "scatter": "volume scatter",
}


def world_json(
    world: bpy.types.World | None,
    translator: Translator,
    log: ExportLog,
    picture: Callable[[bpy.types.World, bool], Panorama | None],
) -> list[dict[str, Any]]:
    """The lights of a world: a dome, and a second where the camera sees another; none is black.

    Skies with a sun have it as a light of its own. `picture` makes one of a world, as the camera
    sees it or as others do, or none.
    """
    if world is None:
        return []
    suns: list[dict[str, Any]] = []
    if not world.use_nodes or world.node_tree is None:
        values: list[Value] = [Constant.color(world.color)]
    else:
        values, simplified = translator.world_radiance(world)
        if simplified or any(_is_stretched(value) for value in values):
            made = [picture(world, k == len(values) - 1) for k in range(len(values))]
            if None in made:
                for text in simplified:
                    log.warn(text)
            else:
                values = [_shown(p) for p in made]
                suns = [p.sun for p in made]
    visible = getattr(getattr(world, "cycles_visibility", None), "camera", True)
    seen = [{"camera_visible": visible}]
    if len(values) > 1:
        seen = [{"camera_visible": False}, {"camera_only": True}]
    lights = []
    for value, sun, by in zip(values[: 1 + int(visible)], suns or [None, None], seen, strict=False):
        dome = _dome(world, value, translator, log)
        lights += [light | by for light in (dome, sun and _sun(sun)) if light]
    return lights


def _shown(world: Panorama) -> Value:
    if not world.pixels.any():
        return Constant.color((0.0, 0.0, 0.0))
    return ImageValue(world, _AS_IT_IS)


def _sun(sun: dict[str, Any]) -> dict[str, Any]:
    turn = Vector(sun["direction"]).to_track_quat("Z", "Y").to_matrix().to_4x4()
    return {
        "type": "distant",
        "irradiance": sun["irradiance"],
        "angle": sun["angle"],
        "transform": [number for row in turn for number in row],
    }


def _dome(
    world: bpy.types.World, value: Value, translator: Translator, log: ExportLog
) -> dict[str, Any] | None:
    """A dome of this radiance."""
    name = f"World '{world.name}'"
    if bounds(value)[0] < 0.0:
        log.warn(f"{name}: negative light is not supported, that part is left out")
    result: dict[str, Any] = {"type": "dome"}
    if isinstance(value, ImageValue):
        if value.gain <= 0.0:
            return None
        _warn_world(name, world, log)
        result["radiance"] = [value.gain] * 3
        result["image"] = translator.textures.image(value.source)
        result["transform"] = _dome_transform(world.name, value.sampling.matrix, log)
        return result
    assert isinstance(value, Constant)
    radiance = [max(channel, 0.0) for channel in value.rgb]
    if not any(radiance):
        return None
    _warn_world(name, world, log)
    result["radiance"] = radiance
    return result


def _warn_world(name: str, world: bpy.types.World, log: ExportLog) -> None:
    """Name what a world that shines asks for and Segue lacks."""
    flags = getattr(world, "cycles_visibility", None)
    hidden = [label for flag, label in _RAY_FLAGS.items() if not getattr(flags, flag, True)]
    if hidden:
        log.warn(
            f"{name}: only the camera can be kept from seeing a world, "
            f"it stays visible to {', '.join(hidden)} rays"
        )
    if getattr(getattr(world, "cycles", None), "max_bounces", ALL_BOUNCES) < ALL_BOUNCES:
        log.warn(f"{name}: a limit of bounces of a world is not supported, all are followed")


def _is_stretched(value: Value) -> bool:
    """Whether it is a map that no dome can be turned to."""
    if not isinstance(value, ImageValue):
        return False
    sizes = np.linalg.svd(np.array(value.sampling.matrix).reshape(3, 3), compute_uv=False)
    return bool(sizes[0] > sizes[-1] * _LARGEST_STRETCH)


def _dome_transform(name: str, matrix: tuple[float, ...], log: ExportLog) -> list[float]:
    """Light to world for a map that is looked up at `matrix` times the direction."""
    lookup = np.array(matrix).reshape(3, 3)
    # The nearest rotation or mirror: a dome cannot be stretched.
    u, sizes, vt = np.linalg.svd(lookup)
    if sizes[-1] <= 1e-6 * sizes[0]:
        log.warn(f"World '{name}': the mapping of its image is flat, it is left out")
        u, vt = np.eye(3), np.eye(3)
    elif sizes[0] > sizes[-1] * _LARGEST_STRETCH:
        log.warn(
            f"World '{name}': a mapping that stretches the image is not supported, "
            "only its rotation is used"
        )
    transform = np.eye(4)
    transform[:3, :3] = (u @ vt).T @ _BLENDER_FROM_DOME
    return transform.ravel().tolist()


def export_world(
    scene: Any,
    depsgraph: bpy.types.Depsgraph,
    translator: Translator,
    log: ExportLog,
    stop: Callable[[], bool],
    *,
    is_preview: bool,
) -> None:
    """Add the world of the view layer, if it shines. Previews do not wait for pictures of it."""
    view_layer = depsgraph.view_layer_eval
    if not view_layer.use_sky:
        return
    world = getattr(view_layer, "world_override", None) or depsgraph.scene_eval.world
    frame = depsgraph.scene_eval.frame_current

    def picture(world: bpy.types.World, is_camera: bool) -> Panorama | None:
        return None if is_preview else panorama(world, frame, is_camera, log, stop)

    lights = world_json(world, translator, log, picture)
    for light in lights:
        scene.add_light(world.name, light)
    is_seen = any(light.get("camera_visible", True) for light in lights)
    if is_seen and not depsgraph.scene_eval.render.film_transparent and view_layer.use_pass_emit:
        log.warn(
            f"View layer '{view_layer.name}': the Emission pass holds the background of the world "
            "too, which Cycles keeps in the Environment pass"
        )
