"""Render settings: resolution, border, stopping rules, filter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

if TYPE_CHECKING:
    from ..job import Frame

# A material preview is small and should appear at once.
_PREVIEW_SAMPLES = 16


def render_settings(
    depsgraph: bpy.types.Depsgraph, frame: Frame, resolution: tuple[int, int], *, preview: bool
) -> dict[str, Any]:
    """The settings object of `segue.Render` for one view layer."""
    scene = depsgraph.scene_eval
    render = scene.render
    options = scene.segue
    samples = depsgraph.view_layer_eval.samples or options.samples
    if preview:
        samples = min(samples or _PREVIEW_SAMPLES, _PREVIEW_SAMPLES)
    if not (samples or options.time_limit or options.noise_threshold):
        raise ValueError(
            "no samples, time limit or noise threshold is set: the render would never end"
        )
    return {
        "integrator": options.integrator,
        "resolution": list(resolution),
        "crop": crop(render, resolution, (frame.width, frame.height)),
        "samples": samples,
        "time": options.time_limit,
        "noise_threshold": options.noise_threshold,
        "max_depth": options.max_bounces,
        "threads": render.threads if render.threads_mode == "FIXED" else 0,
        "seed": options.seed,
        "filter": options.pixel_filter,
        "filter_width": options.filter_width,
        "transparent_background": render.film_transparent,
        "passes": [render_pass.source for render_pass in frame.passes],
    }


def film_size(engine: bpy.types.RenderEngine) -> tuple[int, int]:
    """Size of the whole film in pixels, after the resolution percentage and before the border."""
    return engine.resolution_x, engine.resolution_y


def film_exposure(scene: bpy.types.Scene) -> float:
    """What Cycles multiplies a picture by; 1 where its settings are missing."""
    return float(getattr(getattr(scene, "cycles", None), "film_exposure", 1.0))


def crop(
    render: bpy.types.RenderSettings, resolution: tuple[int, int], size: tuple[int, int]
) -> list[int]:
    """The border as [x0, y0, x1, y1] from the top left; its size is what Blender allotted."""
    width, height = size
    if not render.use_border:
        return [0, 0, width, height]
    # Blender multiplies and truncates in single precision.
    x = int(np.float32(render.border_min_x) * np.float32(resolution[0]))
    bottom = int(np.float32(render.border_min_y) * np.float32(resolution[1]))
    y = resolution[1] - bottom - height
    return [x, y, x + width, y + height]
