"""One render of one view layer: export, run, show, and hand the passes to Blender."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from . import history, library, passes
from .export.camera import export_camera
from .export.depsgraph import Exporter
from .export.settings import film_exposure, film_size, render_settings
from .log import ExportLog

if TYPE_CHECKING:
    from collections.abc import Callable

    from .engine import SegueRenderEngine

# Showing the picture may take this share of the time of the render.
_DISPLAY_SHARE = 0.05
_FIRST_DISPLAY = 0.25


class Frame:
    """The pixels of one view layer on Blender's side; row 0 of its arrays is on top."""

    def __init__(self, engine: SegueRenderEngine, depsgraph: bpy.types.Depsgraph) -> None:
        view_layer = depsgraph.view_layer_eval
        self.engine = engine
        self.layer = view_layer.name
        self.passes = list(passes.enabled(view_layer))
        self.exposure = film_exposure(depsgraph.scene_eval)
        self.width = 0
        self.height = 0

    def clear(self) -> None:
        """Merge black pixels into every view, and learn the frame's size within the border."""
        for render_pass in self.passes:
            channels = render_pass.channels
            self.engine.add_pass(render_pass.name, len(channels), channels, layer=self.layer)
        for view in self.views():
            self.write({}, view=view)

    def views(self) -> list[str]:
        """Names of the views of a multi-view render; one empty name otherwise."""
        if not self.engine.render.use_multiview:
            return [""]
        return [view.name for view in self.engine.get_result().views]

    def write(
        self, pixels: dict[str, np.ndarray], *, view: str, origin: tuple[int, int] = (0, 0)
    ) -> None:
        """Merge passes by Blender's names, all of one size, with their top left corner at `origin`.

        The film's exposure, which the engine knows nothing of, brightens those that hold light.
        Passes that are not given become black; with no pass at all the whole frame does.
        """
        engine = self.engine
        if pixels:
            height, width = next(iter(pixels.values())).shape[:2]
            x, y = origin[0], self.height - origin[1] - height
        else:
            x, y, width, height = 0, 0, engine.resolution_x, engine.resolution_y
        result = engine.begin_result(x, y, width, height, layer=self.layer, view=view)
        width, height = result.resolution_x, result.resolution_y
        if not pixels:
            self.width, self.height = width, height
        for target in result.layers[0].passes:
            values = pixels.get(target.name)
            if values is None:
                values = np.zeros(width * height * target.channels, np.float32)
            elif target.name in passes.LIGHT and self.exposure != 1.0:
                values = values.copy()
                values[..., :3] *= np.float32(self.exposure)
            target.rect.foreach_set(np.ascontiguousarray(values[::-1], np.float32).ravel())
        engine.end_result(result)


class _Monitor:
    """Carries progress to Blender and the user's wish to stop back to the render."""

    def __init__(
        self,
        engine: SegueRenderEngine,
        frame: Frame,
        render: Any,
        view: str,
        span: tuple[int, int],
        error_text: Callable[[dict[str, Any]], str],
    ) -> None:
        self.engine = engine
        self.frame = frame
        self.render = render
        self.view = view
        self.index, self.count = span
        self.error_text = error_text
        self.dirty: tuple[int, int, int, int] | None = None
        # Nobody watches a render without a window.
        self.next_display = (
            float("inf") if bpy.app.background else time.monotonic() + _FIRST_DISPLAY
        )

    def progress(self, state: dict[str, Any]) -> bool:
        """Called by the render, at least ten times a second; true asks it to stop."""
        self.engine.update_progress((self.index + state["fraction"]) / self.count)
        self.engine.update_stats(self.frame.layer, _status_line(state, self.error_text(state)))
        self._display()
        return self.engine.stop_requested()

    def tile(self, x: int, y: int, width: int, height: int) -> None:
        """Called by the render when a rectangle has new content."""
        if self.dirty is None:
            self.dirty = (x, y, x + width, y + height)
        else:
            x0, y0, x1, y1 = self.dirty
            self.dirty = (min(x0, x), min(y0, y), max(x1, x + width), max(y1, y + height))
        self._display()

    def _display(self) -> None:
        """Show what is new, if it is time for it."""
        start = time.monotonic()
        if self.dirty is None or start < self.next_display:
            return
        x0, y0, x1, y1 = self.dirty
        pixels = self.render.read_pass("Combined", rect=(x0, y0, x1 - x0, y1 - y0))
        self.frame.write({"Combined": pixels}, view=self.view, origin=(x0, y0))
        self.dirty = None
        end = time.monotonic()
        self.next_display = end + max(0.1, (end - start) / _DISPLAY_SHARE)


def _status_line(state: dict[str, Any], error: str) -> str:
    """One line on what the render does now and how long it still takes."""
    parts = [str(state["stage"]).capitalize()]
    remaining = state.get("remaining")
    if remaining is not None and np.isfinite(remaining) and remaining >= 0:
        minutes, seconds = divmod(float(remaining), 60.0)
        parts.append(f"Remaining: {int(minutes):02d}:{seconds:05.2f}")
    parts.append(f"Sample {int(state['samples'])}")
    parts.append(error.capitalize())
    return " | ".join(parts)


def run(engine: SegueRenderEngine, depsgraph: bpy.types.Depsgraph, frame: Frame) -> None:
    """Export the scene, render every view of it, and write the passes into `frame`."""
    segue = library.load()
    log = ExportLog()
    view_layer = depsgraph.view_layer_eval
    names = passes.unsupported(view_layer)
    if names:
        log.warn(
            f"View layer '{view_layer.name}': no such passes in Segue, left out: {', '.join(names)}"
        )

    engine.update_stats(frame.layer, "Exporting the scene")
    exporter = Exporter(segue, depsgraph, log, engine.stop_requested, is_preview=engine.is_preview)
    if not exporter.run():
        return
    scene = exporter.scene
    views = frame.views()
    for index, view in enumerate(views):
        if view:
            engine.active_view_set(view)
        export_camera(scene, engine, depsgraph, log)
        settings = render_settings(depsgraph, frame, film_size(engine), preview=engine.is_preview)
        _report(engine, log, scene.info())
        engine.update_stats(frame.layer, "Building the acceleration structure")
        render = segue.Render(scene, settings)
        monitor = _Monitor(engine, frame, render, view, (index, len(views)), segue.error_text)
        finished = render.run(progress=monitor.progress, tile=monitor.tile)
        frame.write(_read_passes(render, frame), view=view)
        stats = render.stats()
        _report(engine, log, stats)
        error = segue.error_text(stats)
        _finish(engine, frame, stats, error)
        if not engine.is_preview:
            points = stats.get("curve", [])
            text = error.capitalize()
            run = history.Run(frame.layer, view, points, text, engine.is_animation, finished)
            history.keep(depsgraph.scene, run)
        if not finished:
            return


def _read_passes(render: Any, frame: Frame) -> dict[str, np.ndarray]:
    """Every pass of the frame, by Blender's names."""
    return {render_pass.name: render.read_pass(render_pass.source) for render_pass in frame.passes}


def _report(engine: SegueRenderEngine, log: ExportLog, info: dict[str, Any]) -> None:
    """Tell the user in Blender's info log what is new of what the export and the engine changed.

    The engine speaks of the scene in its info, and of what it found while building and rendering
    in its statistics.
    """
    for message in info.get("warnings", []):
        log.warn(message)
    news = log.news()
    if not engine.is_preview:
        for message in news:
            engine.report({"WARNING"}, f"Segue: {message}")


def _finish(engine: SegueRenderEngine, frame: Frame, stats: dict[str, Any], error: str) -> None:
    """Leave the final figures in the status line and speak of pixels that went wrong."""
    mebibytes = stats.get("peak_memory_bytes", 0) / 2**20
    engine.update_memory_stats(memory_used=mebibytes, memory_peak=mebibytes)
    minutes, seconds = divmod(round(stats.get("seconds", 0.0)), 60)
    engine.update_stats(
        frame.layer,
        f"{stats.get('samples', 0):.0f} samples, {error} after {minutes}:{seconds:02d}",
    )
    if stats.get("non_finite"):
        engine.report(
            {"WARNING"}, f"Segue: {stats['non_finite']} samples were not finite and were dropped"
        )
