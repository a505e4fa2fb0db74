"""The error curves of finished renders: kept by scene, shown, and written beside the outputs.

A render may run in a thread of its own, where Blender's data must not be written. There its curve
is only kept; what Blender shows is made in the main thread, by a timer where the render was
elsewhere.
"""

from __future__ import annotations

import functools
import os
import re
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import bpy.utils.previews
import numpy as np
from bpy.app.handlers import persistent

from . import curve, plot, preferences
from .log import logger

#: Name of the image datablock with the last curve.
IMAGE = "Segue Error Curve"
# Extensions that Blender gives to outputs.
_EXTENSIONS = frozenset(bpy.path.extensions_image | bpy.path.extensions_movie)
# A frame that no animation has.
_NO_FRAME = 987654321
# Seconds between two looks for curves to show.
_INTERVAL = 0.5


@dataclass(frozen=True)
class Run:
    """How the error of one render of one view layer fell.

    `text` tells the last figures, `animation` whether the render is a frame of one, and `finished`
    that nobody stopped it.
    """

    layer: str
    view: str
    points: Sequence[curve.Point]
    text: str
    animation: bool
    finished: bool

    @property
    def name(self) -> str:
        """Tells it from the other runs of its frame."""
        return " ".join(filter(None, (self.layer, self.view)))


@dataclass(frozen=True)
class Shown:
    """What the panel shows: Blender's number of the picture as an icon, and a line of text."""

    icon: int
    text: str


# By `session_uid` of the scene: the runs of its last frame, and what the panel shows of it.
_runs: dict[int, dict[str, Run]] = {}
_shown: dict[int, Shown] = {}
# Scenes whose render has ended and is not shown yet.
_ended: deque[int] = deque()
_previews: bpy.utils.previews.ImagePreviewCollection | None = None


def _harmless(function: Callable[..., None]) -> Callable[..., None]:
    """Log what goes wrong in `function`: no render fails for its curve."""

    @functools.wraps(function)
    def guarded(*arguments: Any) -> None:
        try:
            function(*arguments)
        except Exception as error:
            logger.warning("The error curve is left out: %s", str(error) or type(error).__name__)

    return guarded


@_harmless
def keep(scene: bpy.types.Scene, run: Run) -> None:
    """Remember a run until it is shown and written; may be called from any thread."""
    _runs.setdefault(scene.session_uid, {})[run.name] = run


def shown(scene: bpy.types.Scene) -> Shown | None:
    """The curve of the last render of `scene`, if there was one."""
    return _shown.get(scene.session_uid)


@persistent
@_harmless
def _on_frame_begin(scene: bpy.types.Scene, _depsgraph: Any = None) -> None:
    _runs.pop(scene.session_uid, None)


@persistent
@_harmless
def _on_write(scene: bpy.types.Scene, _depsgraph: Any = None) -> None:
    """Blender has written a frame; it says so too when it was stopped and has not."""
    runs = list(_runs.get(scene.session_uid, {}).values())
    if not runs or not preferences.current().write_error_curve:
        return
    if all(run.finished for run in runs):
        _write_files(output_stem(scene, animation=runs[0].animation), runs)


@persistent
@_harmless
def _on_end(scene: bpy.types.Scene, _depsgraph: Any = None) -> None:
    _ended.append(scene.session_uid)
    if threading.current_thread() is threading.main_thread():
        _show_ended()


@persistent
def _on_load(*_arguments: Any) -> None:
    """The scenes of the old file are gone."""
    _clear()


def _poll() -> float:
    """Called by Blender in the main thread."""
    if _ended and not bpy.app.is_job_running("RENDER"):
        _show_ended()
    return _INTERVAL


@_harmless
def _show_ended() -> None:
    while _ended:
        scene = _ended.popleft()
        runs = list(_runs.get(scene, {}).values())
        if runs:
            picture = plot.draw(runs[-1].points)
            text = f"{runs[-1].name}: {runs[-1].text}" if len(runs) > 1 else runs[-1].text
            _shown[scene] = Shown(_icon(str(scene), picture), text)
            _update_image(picture)
            _redraw()


def _icon(name: str, picture: np.ndarray) -> int:
    """The picture as an icon, which is no part of the file."""
    preview = _previews.get(name) or _previews.new(name)
    pixels = np.ones((plot.SIZE, plot.SIZE, 4), np.float32)
    pixels[:, :, :3] = picture[::-1] / np.float32(255.0)
    preview.image_size = (plot.SIZE, plot.SIZE)
    preview.image_pixels_float.foreach_set(pixels.ravel())
    return preview.icon_id


def _update_image(picture: np.ndarray) -> None:
    """Put the picture into the image datablock, by a file.

    Pixels that are set from Python would count as a change of the image: Blender would offer to
    save it on closing, by packing it into the .blend file.
    """
    path = Path(bpy.app.tempdir) / "segue_error_curve.png"
    path.write_bytes(plot.png(picture))
    image = bpy.data.images.get((IMAGE, None))
    if image is None:
        image = bpy.data.images.load(str(path))
        image.name = IMAGE
        return
    if image.packed_file:
        image.unpack(method="REMOVE")
    image.source = "FILE"
    image.filepath = str(path)
    image.reload()


def _redraw() -> None:
    """Let the panel show what is new."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"PROPERTIES", "IMAGE_EDITOR"}:
                area.tag_redraw()


def output_stem(scene: bpy.types.Scene, *, animation: bool) -> str:
    """Path of the file that a render was written to, without its extension.

    All frames of a movie have one file: there the frame's number follows.
    """
    render = scene.render
    if animation:
        stem = _without(render.frame_path(frame=scene.frame_current), _EXTENSIONS)
        return f"{stem}_{scene.frame_current:04d}" if render.is_movie_format else stem
    # The name of a still keeps "#" as it is and has no frame number. Blender tells names with a
    # number only: so a number that is in no name is taken out again.
    path = _without(render.frame_path(frame=_NO_FRAME), _EXTENSIONS)
    hashes = re.findall("#+", re.sub("{.*?}", "", os.path.basename(render.filepath)))
    return _without(path.replace(str(_NO_FRAME), hashes[-1] if hashes else ""), _EXTENSIONS)


def _without(path: str, extensions: frozenset[str]) -> str:
    """The path without its extension if that is one of `extensions`."""
    # Not `splitext`: a name may be nothing but an extension.
    folder, name = os.path.split(path)
    stem, dot, extension = name.rpartition(".")
    return os.path.join(folder, stem if (dot + extension).lower() in extensions else name)


def _write_files(stem: str, runs: Sequence[Run]) -> None:
    for run in runs:
        # View layers and views have curves of their own.
        part = f"_{bpy.path.clean_name(run.name)}" if len(runs) > 1 else ""
        base = f"{stem}{part}_error"
        Path(f"{base}.csv").write_text(curve.table(run.points), encoding="utf-8")
        Path(f"{base}.png").write_bytes(plot.png(plot.draw(run.points)))


def _clear() -> None:
    _runs.clear()
    _shown.clear()
    _ended.clear()
    if _previews is not None:
        _previews.clear()


_HANDLERS = {
    "render_pre": _on_frame_begin,
    "render_write": _on_write,
    "render_complete": _on_end,
    "render_cancel": _on_end,
    "load_post": _on_load,
}


def register() -> None:
    """Begin to listen for renders."""
    global _previews
    _previews = bpy.utils.previews.new()
    for name, function in _HANDLERS.items():
        getattr(bpy.app.handlers, name).append(function)
    bpy.app.timers.register(_poll, first_interval=_INTERVAL, persistent=True)


def unregister() -> None:
    """Undo `register`."""
    global _previews
    if bpy.app.timers.is_registered(_poll):
        bpy.app.timers.unregister(_poll)
    for name, function in _HANDLERS.items():
        getattr(bpy.app.handlers, name).remove(function)
    _clear()
    bpy.utils.previews.remove(_previews)
    _previews = None
