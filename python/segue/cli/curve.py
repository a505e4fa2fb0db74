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

    Taking one copies the film to a temporary file; its error is computed after the render. What
    the copying takes is measured and taken off the times.

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
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the curve
        self._points: list[dict[str, Any]] = []
        self._next = FIRST
        self._cpu_start = time.process_time()
        #: Seconds and CPU seconds that taking snapshots has cost.
        self.cost, self.cpu_cost = 0.0, 0.0

    def update(self, report: dict[str, Any]) -> None:
        """Takes a snapshot if it is time for one. `report` is what the engine's progress says."""
        seconds = float(report.get("seconds", 0.0)) - self.cost
        if seconds >= self._next and report.get("samples"):
            self._take(seconds, report)
            while self._next <= seconds:
                self._next *= RATIO

    def finish(self, stats: dict[str, Any]) -> list[dict[str, Any]]:
        """The curve, its last point being the finished picture; the snapshots are dropped."""
        self._take(float(stats["seconds"]) - self.cost, stats)
        self._file.seek(0)
        shape = self._reference.shape
        for point in self._points:
            data = np.frombuffer(self._file.read(4 * math.prod(shape)), np.float32)
            found = metrics.errors(data.reshape(shape), self._reference)
            point["mape"], point["relmse"] = found["mape"], found["relmse"]
        self._file.close()
        return self._points

    def _take(self, seconds: float, report: dict[str, Any]) -> None:
        began, cpu_began = time.perf_counter(), time.process_time()
        picture = self._render.read_pass("Combined")[:, :, :3]
        self._file.write(np.ascontiguousarray(picture).data)
        self._points.append(
            {
                "seconds": seconds,
                "cpu_seconds": cpu_began - self._cpu_start - self.cpu_cost,
                "samples": report.get("samples"),
                "estimated_error": report.get("estimated_error"),
            }
        )
        self.cost += time.perf_counter() - began
        self.cpu_cost += time.process_time() - cpu_began
