"""Error against time: snapshots of the film while it is rendered, measured afterwards."""

from __future__ import annotations

import math
import tempfile
import time
from typing import Any

import numpy as np

from .. import metrics
from ..render import Render

#: Seconds of the first snapshot, and the ratio between one and the next.
FIRST, RATIO = 0.25, math.sqrt(2.0)


class Curve:
    """Snapshots at geometric times.

    Taking one copies the film to a temporary file; its error is computed after the render. A
    snapshot's time is that of the end of its copying, for the workers go on meanwhile: no
    picture is dated too early. The processor time of copying is taken off.

    Args:
        render: what is being rendered.
        reference: (h, w, 3) linear colours.

    Raises:
        ValueError: the reference has another size than the film.
    """

    def __init__(self, render: Render, reference: np.ndarray) -> None:
        width, height = render.size
        if reference.shape[:2] != (height, width):
            raise ValueError(
                f"the reference is {reference.shape[1]} x {reference.shape[0]}, "
                f"the picture {width} x {height}"
            )
        self._render = render
        self._reference = reference
        self._bytes = 4 * reference.size
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the curve
        self._points: list[dict[str, Any]] = []
        self._next = FIRST
        self._cpu_start = time.process_time()
        # CPU seconds that each snapshot took.
        self._costs: list[float] = []

    @property
    def cpu_cost(self) -> float:
        """CPU seconds that taking snapshots has cost the render."""
        return sum(self._costs)

    def update(self, report: dict[str, Any]) -> None:
        """Takes a snapshot if it is time for one. `report` is what the engine's progress says."""
        seconds = float(report.get("seconds", 0.0))
        if seconds >= self._next and report.get("samples"):
            self._take(seconds, report)
            while self._next <= seconds:
                self._next *= RATIO

    def finish(self, stats: dict[str, Any]) -> list[dict[str, Any]]:
        """The curve, its last point being the finished picture; the snapshots are dropped."""
        end = float(stats["seconds"])
        # The last reports may come when rendering is over: they show the finished picture.
        while self._points and self._points[-1]["seconds"] >= end:
            self._points.pop()
            self._costs.pop()
        self._take(end, stats)
        self._points[-1]["seconds"] = end
        self._costs.pop()
        self._file.seek(0)
        shape = self._reference.shape
        for point in self._points:
            data = np.frombuffer(self._file.read(self._bytes), np.float32)
            found = metrics.errors(data.reshape(shape), self._reference)
            point["mape"], point["relmse"] = found["mape"], found["relmse"]
        self._file.close()
        return self._points

    def _take(self, seconds: float, report: dict[str, Any]) -> None:
        began, cpu_began = time.perf_counter(), time.thread_time()
        picture = self._render.read_pass("Combined")[:, :, :3]
        self._file.seek(len(self._points) * self._bytes)
        self._file.write(np.ascontiguousarray(picture).data)
        self._costs.append(time.thread_time() - cpu_began)
        self._points.append(
            {
                "seconds": seconds + time.perf_counter() - began,
                "cpu_seconds": time.process_time() - self._cpu_start - self.cpu_cost,
                "samples": report.get("samples"),
                "estimated_error": report.get("estimated_error"),
                "estimated_bias": report.get("estimated_bias"),
            }
        )
