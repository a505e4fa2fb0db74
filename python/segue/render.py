"""Renders: running, watching, cancelling and reading the film."""

from __future__ import annotations

import ctypes
import json
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from os import PathLike, fspath
from typing import Any

import numpy as np

from . import _abi
from ._library import check, library
from ._values import from_json, pointer, text, to_json
from .errors import BadArgumentError, CancelledError
from .scene import Scene

Progress = Callable[[dict], Any]
Tile = Callable[[int, int, int, int], Any]


@contextmanager
def _interrupt_collected(raised: list[BaseException]) -> Iterator[None]:
    """Has Ctrl-C add a KeyboardInterrupt to the list instead of raising it.

    Raised at the entry of a ctypes callback, before its first line, it would be lost. A handler
    that somebody else installed is left alone.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda *_: raised.append(KeyboardInterrupt()))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


class Render:
    """One render of a scene. The scene may be changed or dropped afterwards.

    Args:
        scene: what to render.
        settings: keys of docs/abi.md, "Render settings".
    """

    def __init__(self, scene: Scene, settings: Mapping[str, Any]) -> None:
        self._handle = ctypes.c_void_p()
        self._library = library()
        check(
            self._library.segue_render_create(
                scene.handle, to_json(settings, "settings"), ctypes.byref(self._handle)
            )
        )

    def __del__(self) -> None:
        handle = getattr(self, "_handle", None)
        if handle:
            self._library.segue_render_free(handle)
            self._handle = ctypes.c_void_p()

    def run(self, progress: Progress | None = None, tile: Tile | None = None) -> bool:
        """Renders until the settings say stop; may be called again to continue.

        The interpreter is free for other threads meanwhile. Callbacks run on this thread. An
        exception in one of them, KeyboardInterrupt included, cancels the render and is raised
        here afterwards; what was rendered so far stays readable.

        Args:
            progress: called at least ten times a second with a dictionary of fraction, seconds,
                remaining, samples, estimated_error, estimated_bias and stage; a true answer
                cancels.
            tile: called with x, y, width, height of each rectangle of the film with new content.

        Returns:
            True when finished, False when cancelled.
        """
        raised: list[BaseException] = []

        # Both callbacks are always given to the engine: entering the interpreter is what lets
        # Python run the handler of a pending signal (Ctrl-C) on the main thread.
        def on_progress(_user: int | None, report: bytes) -> int:
            try:
                if raised:
                    return 1
                return int(bool(progress(json.loads(report)))) if progress else 0
            except BaseException as error:
                raised.append(error)
                return 1

        def on_tile(_user: int | None, x: int, y: int, width: int, height: int) -> None:
            try:
                if tile and not raised:
                    tile(x, y, width, height)
            except BaseException as error:
                raised.append(error)
                self._library.segue_render_cancel(self._handle)

        callbacks = _abi.CCallbacks(
            progress=_abi.PROGRESS_FN(on_progress),
            tile=_abi.TILE_FN(on_tile),
            user=None,
        )
        with _interrupt_collected(raised):
            status = self._library.segue_render_run(self._handle, ctypes.byref(callbacks))
        if raised:
            raise raised[0]
        if status == CancelledError.status:
            return False
        check(status)
        return True

    def cancel(self) -> None:
        """Makes a running `run` return soon. Any thread may call it."""
        check(self._library.segue_render_cancel(self._handle))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the film in pixels, after crop."""
        width, height = ctypes.c_uint32(), ctypes.c_uint32()
        check(
            self._library.segue_render_size(self._handle, ctypes.byref(width), ctypes.byref(height))
        )
        return width.value, height.value

    def read_pass(self, name: str, rect: tuple[int, int, int, int] | None = None) -> np.ndarray:
        """A pass as it stands now, or a rectangle of it. Any thread may call it at any time.

        Args:
            name: the pass, such as "Combined".
            rect: x, y (from the top left), width, height; None: the whole film.

        Returns:
            (h, w, c) float32, row 0 on top.
        """
        x, y, width, height = self._rectangle(rect)
        encoded = text(name, "pass name")
        channels = ctypes.c_uint32()
        check(
            self._library.segue_render_pass_channels(self._handle, encoded, ctypes.byref(channels))
        )
        out = np.empty((height, width, channels.value), np.float32)
        check(
            self._library.segue_render_read_pass(
                self._handle, encoded, x, y, width, height, pointer(out), out.size
            )
        )
        return out

    def read_exr(self, x: int, y: int, width: int, height: int) -> bytes:
        """A rectangle of the film, all passes, as the bytes of an EXR file."""
        x, y, width, height = self._rectangle((x, y, width, height))
        data, size = ctypes.c_void_p(), ctypes.c_size_t()
        check(
            self._library.segue_render_read_exr(
                self._handle, x, y, width, height, ctypes.byref(data), ctypes.byref(size)
            )
        )
        return ctypes.string_at(data, size.value)

    def write_exr(
        self,
        path: str | PathLike[str],
        half: bool = True,
        compression: str = "zip",
        layer: str = "",
        attributes: Mapping[str, str] | None = None,
    ) -> None:
        """Writes the film as a tiled EXR file with all passes, settings and statistics.

        Args:
            path: the file.
            half: colours as 16-bit floats rather than 32-bit ones.
            compression: EXR's name of it.
            layer: prefix of the channels' names.
            attributes: further header entries.

        Raises:
            OutputError: the file could not be written.
        """
        options = {
            "half": half,
            "compression": compression,
            "layer": layer,
            "attributes": dict(attributes or {}),
        }
        check(
            self._library.segue_render_write_exr(
                self._handle, text(fspath(path), "path"), to_json(options, "options")
            )
        )

    def stats(self) -> dict[str, Any]:
        """Statistics so far: keys of docs/abi.md, "Statistics"."""
        answer = ctypes.c_char_p()
        check(self._library.segue_render_stats(self._handle, ctypes.byref(answer)))
        return from_json(answer)

    def _rectangle(self, rect: tuple[int, int, int, int] | None) -> tuple[int, int, int, int]:
        film_width, film_height = self.size
        if rect is None:
            return 0, 0, film_width, film_height
        x, y, width, height = (int(v) for v in rect)
        if min(x, y, width, height) < 0 or x + width > film_width or y + height > film_height:
            raise BadArgumentError(
                f"the rectangle {(x, y, width, height)} reaches outside the film of "
                f"{film_width} x {film_height} pixels"
            )
        return x, y, width, height
