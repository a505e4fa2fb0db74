"""The world: a dome with a colour or an environment map."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from ..log import ExportLog
from ..nodes.material import Translator
from ..nodes.values import AttributeValue, Constant, ImageValue, Value, negative
from .lights import ALL_BOUNCES

# Columns: where the axes of the ABI's dome lie in Blender's world. Blender's map has +X in its
# centre column, +Y a quarter to the left and +Z on top.
_BLENDER_FROM_DOME = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

_RAY_FLAGS = {
    "diffuse": "diffuse",
    "glossy": "glossy",
    "transmission": "transmission",
    "scatter": "volume scatter",
}


def world_json(
    world: bpy.types.World | None, translator: Translator, log: ExportLog
) -> list[dict[str, Any]]:
    """The dome light of a world, and a second where the camera sees another; none is black."""
    if world is None:
        return []
    if not world.use_nodes or world.node_tree is None:
        values: list[Value] = [Constant.color(world.color)]
    else:
        values = translator.world_radiance(world)
    visible = getattr(getattr(world, "cycles_visibility", None), "camera", True)
    seen = [{"camera_visible": visible}]
    if len(values) > 1:
        seen = [{"camera_visible": False}, {"camera_only": True}]
    domes = [_dome(world, value, translator, log) for value in values[: 1 + int(visible)]]
    return [dome | by for dome, by in zip(domes, seen, strict=False) if dome]


def _dome(
    world: bpy.types.World, value: Value, translator: Translator, log: ExportLog
) -> dict[str, Any] | None:
    """A dome of this radiance."""
    name = f"World '{world.name}'"
    if negative(value):
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
    assert not isinstance(value, AttributeValue)
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


def _dome_transform(name: str, matrix: tuple[float, ...], log: ExportLog) -> list[float]:
    """Light to world for a map that is looked up at `matrix` times the direction."""
    lookup = np.array(matrix).reshape(3, 3)
    # The nearest rotation or mirror: a dome cannot be stretched.
    u, sizes, vt = np.linalg.svd(lookup)
    if sizes[-1] <= 1e-6 * sizes[0]:
        log.warn(f"World '{name}': the mapping of its image is flat, it is left out")
        u, vt = np.eye(3), np.eye(3)
    elif sizes[0] > sizes[-1] * (1.0 + 1e-4):
        log.warn(
            f"World '{name}': a mapping that stretches the image is not supported, "
            "only its rotation is used"
        )
    transform = np.eye(4)
    transform[:3, :3] = (u @ vt).T @ _BLENDER_FROM_DOME
    return transform.ravel().tolist()


def export_world(
    scene: Any, depsgraph: bpy.types.Depsgraph, translator: Translator, log: ExportLog
) -> None:
    """Add the world of the view layer, if it shines."""
    view_layer = depsgraph.view_layer_eval
    if not view_layer.use_sky:
        return
    world = getattr(view_layer, "world_override", None) or depsgraph.scene_eval.world
    domes = world_json(world, translator, log)
    for dome in domes:
        scene.add_light(world.name, dome)
    is_seen = any(dome.get("camera_visible", True) for dome in domes)
    if is_seen and not depsgraph.scene_eval.render.film_transparent and view_layer.use_pass_emit:
        log.warn(
            f"View layer '{view_layer.name}': the Emission pass holds the background of the world "
            "too, which Cycles keeps in the Environment pass"
        )
