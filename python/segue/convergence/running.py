"""Methods rendered in turns, and their errors measured on the way.

Each method has a render of its own, which is continued slice by slice while the others wait: what
disturbs the machine disturbs all of them alike. Error is measured between slices, on nobody's time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import metrics
from ..errors import SegueError
from ..render import Render
from ..scene import Scene
from .methods import settings_of

#: Ratio of neighbouring times at which errors are measured.
RATIO = 1.4
#: A slice is this part of the whole time, but at least so many iterations of the slowest method
#: (an iteration that is cut short leaves pixels with fewer samples than others), and no more than
#: that part of the time.
PART, ITERATIONS, LARGEST_PART = 1 / 64, 4, 1 / 4


@dataclass(frozen=True)
class Point:
    """A measurement.

    Attributes:
        method: whose.
        repeat: which of its renders, from 0.
        seconds: wall time of rendering, summed over the slices.
        cpu_seconds: processor time likewise, all threads; None where it is not known.
        iterations: samples a pixel.
        mape: mean absolute percentage error, as a fraction.
        relmse: relative mean squared error.
        smape: symmetric mean absolute percentage error, as a fraction.
        difference_of_means: relative, of picture and reference: noise averages out of it.
        estimated_relmse: what the engine itself estimates, if it does.
        bias: the engine's estimate of the kernel's bias, if it makes one.
        stages: seconds so far of each stage of an iteration.
    """

    method: str
    repeat: int
    seconds: float
    cpu_seconds: float | None
    iterations: float
    mape: float
    relmse: float
    smape: float
    difference_of_means: float
    estimated_relmse: float | None = None
    bias: float | None = None
    stages: Mapping[str, float] = field(default_factory=dict)


@dataclass
class Outcome:
    """What one method's render came to.

    Attributes:
        method: whose.
        repeat: which of its renders.
        points: measurements in the order of time.
        picture: (h, w, 3) the last film.
        stats: the engine's statistics at the end; empty for other renderers.
    """

    method: str
    repeat: int
    points: list[Point]
    picture: np.ndarray
    stats: dict[str, Any]


def measure_times(total: float, slice_seconds: float) -> list[float]:
    """Times up to the total, spaced by `RATIO`, the first no shorter than a slice."""
    times = [total]
    while times[0] / RATIO >= slice_seconds:
        times.insert(0, times[0] / RATIO)
    return times


def slice_length(total: float, slowest_iteration: float) -> float:
    """Seconds of a slice."""
    return min(max(PART * total, ITERATIONS * slowest_iteration), LARGEST_PART * total)


def create(scene: Scene, method: str, settings: Mapping[str, Any]) -> Render:
    """A method's render.

    Raises:
        SegueError: the engine refuses it; the text names the method.
    """
    try:
        return Render(scene, {**settings, **settings_of(method)})
    except SegueError as error:
        raise type(error)(f"method {method}: {error}") from None


def iteration_seconds(
    scene: Scene, methods: Sequence[str], settings: Mapping[str, Any], cancelled: Callable[[], bool]
) -> dict[str, float]:
    """What an iteration of each method takes; code and scene are warm afterwards.

    Raises:
        SegueError: a method is unknown or cannot be used.
    """
    result = {}
    for method in methods:
        pilot = create(scene, method, {**settings, "samples": 1})
        if not cancelled():
            pilot.run(lambda _: cancelled())
        result[method] = float(pilot.stats()["seconds"])
    return result


class Contestant:
    """One method's render, continued slice by slice."""

    def __init__(
        self, scene: Scene, method: str, repeat: int, settings: Mapping[str, Any], length: float
    ) -> None:
        self.method = method
        self.repeat = repeat
        self.points: list[Point] = []
        self._length = length
        seed = int(settings.get("seed", 0)) + repeat
        self._render = create(scene, method, {**settings, "time": length, "seed": seed})
        self.stats = self._render.stats()
        # Stages that are over before the first iteration are no part of one.
        self._before = {name: stage["seconds"] for name, stage in self.stats["stages"].items()}

    def is_before(self, seconds: float) -> bool:
        """Whether another slice brings it nearer to that time."""
        return self.stats["seconds"] + 0.5 * self._length < seconds

    def run_slice(self, cancelled: Callable[[], bool]) -> None:
        """Renders for one slice, or for one iteration if that is longer."""
        self._render.run(lambda _: cancelled())
        self.stats = self._render.stats()

    def picture(self) -> np.ndarray:
        """(h, w, 3) the film."""
        return self._render.read_pass("Combined")[:, :, :3]

    def measure(self, reference: np.ndarray) -> None:
        """Adds a point, unless nothing is new."""
        stats = self.stats
        last = self.points[-1].seconds if self.points else 0.0
        if not (stats["seconds"] > last and stats["samples"]):
            return
        self.points.append(
            Point(
                self.method,
                self.repeat,
                seconds=stats["seconds"],
                cpu_seconds=stats["cpu_seconds"],
                iterations=stats["samples"],
                estimated_relmse=stats["estimated_error"],
                bias=stats.get("estimated_bias"),
                stages={
                    name: stage["seconds"]
                    for name, stage in stats["stages"].items()
                    if stage["seconds"] > self._before.get(name, 0.0)
                },
                **measured(self.picture(), reference),
            )
        )

    def outcome(self) -> Outcome:
        """What it came to."""
        return Outcome(self.method, self.repeat, self.points, self.picture(), self.stats)


def measured(picture: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """The errors of a point."""
    found = metrics.errors(picture, reference)
    difference = metrics.difference_of_means(picture, reference)
    return {**{k: found[k] for k in ("mape", "relmse", "smape")}, "difference_of_means": difference}


def race(
    contestants: Sequence[Contestant],
    times: Sequence[float],
    reference: np.ndarray,
    cancelled: Callable[[], bool],
    on_time: Callable[[float], Any] = lambda _: None,
) -> None:
    """Runs all up to each of the times in turns, and measures there.

    Args:
        contestants: who takes part.
        times: seconds of each one's own rendering, growing.
        reference: (h, w, 3) linear colours.
        cancelled: asked often whether to stop.
        on_time: told of each time that all have reached.
    """
    for seconds in times:
        while behind := [c for c in contestants if c.is_before(seconds)]:
            for contestant in behind:
                if not cancelled():
                    contestant.run_slice(cancelled)
            if cancelled():
                break
        for contestant in contestants:
            contestant.measure(reference)
        if cancelled():
            return
        on_time(seconds)
