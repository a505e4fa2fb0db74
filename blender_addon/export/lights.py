"""Lights: from Blender's power in watts to the radiance and intensity of the ABI."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from ..log import ExportLog
from ..nodes.material import Translator

# Cycles' default limit of a light's bounces, which is none in practice.
ALL_BOUNCES = 1024

# Above this radius the light of a sphere differs visibly from that of Cycles' disk: by 2 % three
# metres away.
_LARGE_RADIUS = 0.5

# Scales of a spot's axes that differ less are equal but for rounding.
_EQUAL_SCALES = 1e-3


def _color(light: bpy.types.Light, translator: Translator) -> np.ndarray:
    """Power (or irradiance, for suns) per channel."""
    color = np.array(light.color[:], np.float64) * light.energy
    # Blender 4.5 added exposure, temperature and normalisation.
    if hasattr(light, "exposure"):
        color *= 2.0**light.exposure
    if getattr(light, "use_temperature", False):
        color *= np.array(light.temperature_color[:])
    if light.use_nodes and light.node_tree is not None:
        color *= np.array(translator.light_color(light))
    return color


def _warn(name: str, light: bpy.types.Light, log: ExportLog) -> None:
    if not light.use_shadow:
        log.warn(f"Light '{name}': lights without shadows are not supported, it casts them")
    if getattr(getattr(light, "cycles", None), "max_bounces", ALL_BOUNCES) < ALL_BOUNCES:
        log.warn(
            f"Light '{name}': a limit of bounces of a light is not supported, all are followed"
        )
    soft = light.type in {"POINT", "SPOT"} and light.use_soft_falloff
    if soft and light.shadow_soft_size > _LARGE_RADIUS:
        log.warn(
            f"Light '{name}': soft falloff is not supported, its light falls off as that of a "
            "sphere, which is brighter near by"
        )


def _pose(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A matrix without its scale, and the scale of each axis."""
    scale = np.linalg.norm(matrix[:3, :3], axis=0)
    pose = matrix.copy()
    pose[:3, :3] /= np.where(scale > 0, scale, 1.0)
    return pose, scale


def _ball(light: bpy.types.Light, color: np.ndarray) -> dict[str, Any]:
    """Point and spot lights: a sphere, or a point where the radius is 0.

    Blender's power P means the radiance P / (4 pi^2 r^2). A point has the intensity of a sphere of
    cross-section 1: P / (4 pi). Without normalisation the area of the sphere is left out.
    """
    radius = light.shadow_soft_size
    area = 1.0
    if getattr(light, "normalize", True):
        area = 4.0 * (math.pi * radius * radius if radius > 0.0 else 1.0)
    emission = (color / (math.pi * area)).tolist()
    if radius > 0.0:
        return {"type": "sphere", "radius": radius, "radiance": emission}
    return {"type": "point", "intensity": emission}


def _sun(light: bpy.types.Light, color: np.ndarray) -> dict[str, Any]:
    """Suns: the energy is the irradiance on a plane that faces the light."""
    angle = light.angle
    if getattr(light, "normalize", True) or angle <= 0.0:
        return {"type": "distant", "angle": angle, "irradiance": color.tolist()}
    return {"type": "distant", "angle": angle, "radiance": color.tolist()}


def _area(
    light: bpy.types.Light, color: np.ndarray, scale: np.ndarray
) -> tuple[dict[str, Any], np.ndarray]:
    """Area lights, and the scale that their transform keeps (an ellipse is a stretched disk)."""
    width = light.size * scale[0]
    height = (light.size_y if light.shape in {"RECTANGLE", "ELLIPSE"} else light.size) * scale[1]
    round_shape = light.shape in {"DISK", "ELLIPSE"}
    area = width * height * (math.pi / 4.0 if round_shape else 1.0)
    normalized = getattr(light, "normalize", True) and area > 0.0
    radiance = color / (math.pi * (area if normalized else 1.0))
    result: dict[str, Any] = {"radiance": radiance.tolist()}
    stretch = np.ones(3)
    if round_shape:
        result |= {"type": "disk", "radius": 0.5}
        stretch = np.array([width, height, 1.0])
    else:
        result |= {"type": "rect", "width": width, "height": height}
    if light.spread < math.pi:
        result["shaping"] = {"spread": light.spread}
    return result, stretch


def light_json(
    name: str,
    light: bpy.types.Light,
    matrix: np.ndarray,
    camera_visible: bool,
    translator: Translator,
    log: ExportLog,
) -> dict[str, Any] | None:
    """The light object of the ABI; None for a light that emits nothing."""
    if light.type == "AREA" and getattr(getattr(light, "cycles", None), "is_portal", False):
        return None
    _warn(name, light, log)
    color = _color(light, translator)
    if not np.isfinite(color).all():
        log.warn(f"Light '{name}': its power is not finite, it is left out")
        return None
    if (color < 0.0).any():
        log.warn(f"Light '{name}': negative light is not supported, that part is left out")
        color = np.maximum(color, 0.0)
    pose, scale = _pose(matrix)
    if light.type == "SUN":
        result = _sun(light, color)
    elif light.type == "AREA":
        result, stretch = _area(light, color, scale)
        if result.get("width") == 0.0 or result.get("height") == 0.0 or not stretch.all():
            log.warn(f"Light '{name}': an area light without area emits nothing")
            return None
        pose = pose @ np.diag([*stretch, 1.0])
    else:
        result = _ball(light, color)
        if light.type == "SPOT":
            if scale.max() > scale.min() * (1.0 + _EQUAL_SCALES):
                log.warn(
                    f"Light '{name}': a spot of unequal scale is not supported, its cone is round"
                )
            result["shaping"] = {"spot_size": light.spot_size, "spot_blend": light.spot_blend}
    result["transform"] = pose.ravel().tolist()
    result["camera_visible"] = camera_visible
    return result
