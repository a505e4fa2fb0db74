"""References that know their own error.

A reference is the mean of independent renders, each with a seed of its own. Their scatter gives the
variance of that mean, pixel by pixel, and from it the relative mean squared error that the
reference itself is expected to have. It says nothing of what the method cannot find or blurs:
references want an unbiased method that finds the light.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import images, metrics
from ..render import Render
from ..scene import Scene

#: Fewest renders from which a variance is believed.
MIN_RENDERS = 16
#: The two halves of the renders may differ by this factor in the error that they tell.
RELIABLE = 2.0
#: The first renders last so long, seconds, and so many times what building their scene takes.
SHORTEST, OVER_BUILDING = 0.1, 4.0
#: Seed of the first render where none is given. Far from the seeds of renders that are measured
#: against the reference: equal seeds share their noise, and the error would look too small.
FIRST_SEED = 1 << 30
#: Entry of the file's header that tells the error.
ERROR_ATTRIBUTE = "segue:relmse"


class Scatter:
    """Weighted mean and scatter of pictures, one by one (West, CACM 22(9), 1979)."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.count = 0
        self.weight = 0.0
        self.mean = np.zeros(shape)
        self.squares = np.zeros(shape)

    def add(self, picture: np.ndarray, weight: float) -> None:
        """Adds a picture whose variance goes as one over its weight."""
        self.count += 1
        self.weight += weight
        difference = picture - self.mean
        self.mean += difference * (weight / self.weight)
        self.squares += weight * difference * (picture - self.mean)

    def variance(self) -> np.ndarray:
        """Variance of a picture of weight 1."""
        return self.squares / (self.count - 1)

    def merged(self, other: Scatter) -> Scatter:
        """The scatter of both sets of pictures (Chan, Golub and LeVeque 1979)."""
        result = Scatter(self.mean.shape)
        result.count = self.count + other.count
        result.weight = self.weight + other.weight
        between = other.mean - self.mean
        result.mean = self.mean + between * (other.weight / result.weight)
        share = self.weight * other.weight / result.weight
        result.squares = self.squares + other.squares + share * between**2
        return result


@dataclass(frozen=True)
class Estimate:
    """What is known of the mean of some renders.

    Attributes:
        mean: (h, w, 3) linear colours.
        variance: (h, w, 3), that of the mean.
        relmse: expected relative mean squared error of the mean.
        halves: the same number as every other render, and as the rest, tell it.
        renders: how many there are.
        samples: their samples a pixel together.
    """

    mean: np.ndarray
    variance: np.ndarray
    relmse: float
    halves: tuple[float, float]
    renders: int
    samples: float

    @property
    def is_reliable(self) -> bool:
        """Whether the two halves agree.

        Where a few rare and bright samples are most of the error, one half has more of them: then
        there are others that nobody has met yet, and the estimate is too low.
        """
        return max(self.halves) <= RELIABLE * min(self.halves)


class Renders:
    """Independent renders in two halves."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._halves = (Scatter(shape), Scatter(shape))

    def add(self, picture: np.ndarray, samples: float) -> None:
        """Adds a render."""
        first, second = self._halves
        (first if first.count <= second.count else second).add(picture, samples)

    @property
    def count(self) -> int:
        """How many there are."""
        return sum(h.count for h in self._halves)

    @property
    def samples(self) -> float:
        """Samples a pixel of all together."""
        return sum(h.weight for h in self._halves)

    def estimate(self) -> Estimate | None:
        """What they tell; None of too few."""
        if self.count < MIN_RENDERS:
            return None
        first, second = self._halves
        whole = first.merged(second)

        # Relative to what the other half shows: a pixel that one far too bright sample has made
        # bright would hide the variance which that sample tells of.
        def told(scatter: Scatter, other: Scatter) -> float:
            return metrics.relative_variance(scatter.variance() / whole.weight, other.mean)

        halves = told(first, second), told(second, first)
        return Estimate(
            mean=whole.mean,
            variance=whole.variance() / whole.weight,
            relmse=sum(halves) / 2,
            halves=halves,
            renders=whole.count,
            samples=whole.weight,
        )


@dataclass(frozen=True)
class Result:
    """What came of making a reference.

    Attributes:
        estimate: what was reached, None if not even that is known.
        target: the error that was wanted.
        seconds: time taken.
        non_finite: samples that were dropped because they were not finite.
        cancelled: whether it was ended from outside.
    """

    estimate: Estimate | None
    target: float
    seconds: float
    non_finite: int
    cancelled: bool

    @property
    def refusal(self) -> str | None:
        """Why this is no reference; None if it is one."""
        found = self.estimate
        if found is None:
            return (
                f"after {self.seconds:.3g} s there are fewer than the {MIN_RENDERS} independent "
                "renders from which an error can be estimated"
            )
        if not found.is_reliable:
            low, high = sorted(found.halves)
            return (
                f"the estimated error is unreliable: one half of the {found.renders} renders tells "
                f"a relMSE of {low:.3g}, the other of {high:.3g}, which is more than a factor of "
                f"{RELIABLE:g}; a few bright samples decide it, and another integrator may find "
                "their light more often"
            )
        if found.relmse > self.target:
            return (
                f"after {self.seconds:.3g} s the estimated relMSE is {found.relmse:.3g}, not "
                f"{self.target:g}; it falls as one over the time"
            )
        return None


def make(
    scene: Scene,
    settings: Mapping[str, Any],
    target: float,
    max_time: float,
    on_estimate: Callable[[Estimate | None, float], Any] = lambda *_: None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Result:
    """Renders until the mean's estimated error is at most `target`, at least `MIN_RENDERS` times.

    Args:
        scene: what is rendered.
        settings: of every render, but for seed and limits; `seed` is that of the first.
        target: relative mean squared error.
        max_time: seconds, those of building the scene for every render included.
        on_estimate: told what is known after each render, and the seconds so far.
        cancelled: asked often whether to stop.
    """
    began = time.monotonic()

    def elapsed() -> float:
        return time.monotonic() - began

    def render(seed: int, samples: int) -> tuple[np.ndarray, dict[str, Any]] | None:
        left = max_time - elapsed()
        if left <= 0 or cancelled():
            return None
        limit = left if math.isfinite(left) else 0
        limits = {"samples": samples, "time": limit, "noise_threshold": 0, "seed": seed}
        made = Render(scene, {**settings, **limits})
        finished = made.run(lambda _: cancelled())
        stats = made.stats()
        # A render that the time cut short has other weights from pixel to pixel.
        if not finished or stats["stop_reason"] != "samples":
            return None
        return made.read_pass("Combined")[:, :, :3].astype(np.float64), stats

    seed, non_finite = int(settings.get("seed", FIRST_SEED)), 0
    renders: Renders | None = None
    found: Estimate | None = None
    first = render(seed, 1)
    if first is not None:
        # The pilot only tells how long a sample takes.
        picture, stats = first
        renders = Renders(picture.shape)
        wanted = max(SHORTEST, OVER_BUILDING * stats["build_seconds"])
        wanted = min(wanted, max_time / (2 * MIN_RENDERS))
        shortest = max(1, round(wanted / max(stats["seconds"], 1e-6)))
        while True:
            seed += 1
            # Longer and longer ones, so that building the scene anew costs little.
            made = render(seed, max(shortest, int(renders.samples) // MIN_RENDERS))
            if made is None:
                break
            picture, stats = made
            renders.add(picture, stats["samples"])
            non_finite += stats["non_finite"]
            found = renders.estimate()
            on_estimate(found, elapsed())
            if found is not None and found.is_reliable and found.relmse <= target:
                break
    return Result(found, target, elapsed(), non_finite, cancelled())


def write(path: Path, result: Result, attributes: Mapping[str, str | float]) -> None:
    """Writes layers `Combined` and `Variance` (of the mean), and the error in the header.

    Raises:
        OutputError: the file cannot be written.
    """
    found = result.estimate
    assert found is not None, "there is something to write"
    images.write_exr(
        path,
        {"Combined": found.mean, "Variance": found.variance},
        {
            ERROR_ATTRIBUTE: float(found.relmse),
            "segue:relmse_of_halves": f"{found.halves[0]:.6g} {found.halves[1]:.6g}",
            "segue:renders": found.renders,
            "segue:samples": float(found.samples),
            **attributes,
        },
    )


def known_error(path: str) -> float | None:
    """The error that a reference says it has; None of a picture that was made otherwise.

    Raises:
        ImageError: the file is missing or broken.
    """
    error = images.read_attribute(path, ERROR_ATTRIBUTE)
    return None if error is None else float(error)
