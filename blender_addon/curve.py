"""The curve of estimated error against run time: its figures, its axes and its table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

#: A point as the engine's statistics tell it.
Point = Mapping[str, Any]

#: Columns of the table, by the names of the statistics.
COLUMNS = ("seconds", "samples", "estimated_error", "estimated_bias")

# What is beyond is as good as zero or infinite, and has no place on an axis.
_LEAST, _GREATEST = 1e-30, 1e30
# Marks at which an axis may begin and end, and those that are labelled on a short one.
_STEPS = (1, 2, 5)
# A length from which the powers of ten are labels enough.
_LONG = 100.0


def table(points: Sequence[Point]) -> str:
    """The curve as CSV, one point a line; what is unknown stays empty."""
    rows = [",".join(COLUMNS)]
    for point in points:
        values = (point.get(name) for name in COLUMNS)
        rows.append(",".join("" if value is None else repr(value) for value in values))
    return "\n".join(rows) + "\n"


def series(points: Sequence[Point], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Seconds and the root of the mean squared error `name`, in percent.

    Both are NaN at points that have no place on logarithmic axes.
    """
    seconds = np.array([_positive(point.get("seconds")) for point in points], np.float64)
    percent = np.array([_positive(point.get(name)) for point in points], np.float64)
    percent = 100.0 * np.sqrt(percent)
    missing = np.isnan(seconds) | np.isnan(percent)
    seconds[missing] = percent[missing] = np.nan
    return seconds, percent


def _positive(value: Any) -> float:
    """The number, or NaN for all that has no useful logarithm."""
    return float(value) if value is not None and _LEAST < value < _GREATEST else math.nan


@dataclass(frozen=True)
class Axis:
    """A logarithmic axis from `low` to `high`, each 1, 2 or 5 times a power of ten."""

    low: float
    high: float

    @classmethod
    def around(cls, values: np.ndarray, decades: float) -> Axis:
        """The shortest axis that holds the finite `values`, of about `decades` at most.

        What would make it longer falls off its lower end.
        """
        finite = values[np.isfinite(values)]
        if not len(finite):
            return cls(1.0, 10.0)
        greatest = float(finite.max())
        least = max(float(finite.min()), greatest / 10.0**decades)
        # Tolerance against rounding of powers of ten.
        low = max(mark for mark in _marks(least, _STEPS) if mark <= least * (1 + 1e-9))
        high = min(mark for mark in _marks(greatest, _STEPS) if mark >= greatest * (1 - 1e-9))
        if low == high:
            low = max(mark for mark in _marks(low, _STEPS) if mark < low * (1 - 1e-9))
            high = min(mark for mark in _marks(high, _STEPS) if mark > high * (1 + 1e-9))
        return cls(low, high)

    def fraction(self, values: np.ndarray) -> np.ndarray:
        """Where values lie: 0 at `low`, 1 at `high`."""
        return np.log(values / self.low) / math.log(self.high / self.low)

    def marks(self) -> list[float]:
        """Where grid lines are: 1 to 9 times each power of ten."""
        return self._within(range(1, 10))

    def decades(self) -> list[float]:
        """The powers of ten."""
        return self._within((1,))

    def labels(self) -> dict[float, str]:
        """The marks that have a number, and their numbers."""
        steps = (1,) if self.high / self.low >= _LONG else _STEPS
        return {mark: _number(mark) for mark in self._within(steps)}

    def _within(self, steps: Sequence[int]) -> list[float]:
        first, last = (math.floor(math.log10(value)) for value in (self.low, self.high))
        marks = [step * 10.0**power for power in range(first - 1, last + 2) for step in steps]
        return [m for m in marks if self.low * (1 - 1e-9) <= m <= self.high * (1 + 1e-9)]


def _marks(value: float, steps: Sequence[int]) -> list[float]:
    """The marks around `value`, ascending."""
    power = math.floor(math.log10(value))
    return [step * 10.0**p for p in (power - 1, power, power + 1) for step in steps]


def _number(mark: float) -> str:
    """A mark in five characters or fewer where that can be."""
    text = f"{mark:g}"
    if len(text) <= 5 and "e" not in text:
        return text
    power = math.floor(math.log10(mark) + 1e-9)
    return f"{mark / 10.0**power:.0f}e{power}"
