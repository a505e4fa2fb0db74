"""docs/agreement.md: whether the integrators agree, by the means of small pictures of the gallery and of the shared scenes.

The shared scenes are those of SEGUE_SHARED, or of ../shared beside the checkout; without them it says so and takes the gallery
alone. A method and kernel has up to SEGUE_SECONDS of processor time for each seed of a scene. What was measured is kept in
results/agreement until that is deleted. Fails if anything differs. Run: .venv/bin/python benches/agreement.py [SCENE ...]
"""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from itertools import combinations, product
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np
from segue import Render, Scene, usd

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared")) / "peers" / "usd"
KEPT = ROOT / "results" / "agreement"
#: Processor seconds of a seed: at least, before a row is given up, and at most.
LEAST, ENOUGH, MOST = 0.5, 2.0, float(os.environ.get("SEGUE_SECONDS", "20"))
SEEDS, BLOCK = 6, 24
#: Pictures of the gallery, and of the shared scenes, which are square.
WIDE, SQUARE = (288, 162), (192, 192)
UNBIASED = ("path", "light", "bdpt")
BIASED = (
    *("segment", "mvf", "photon-filter", "segment-bridge", "segment-path"),
    *("ppm", "bpm", "vcm"),
)
#: Edges of fixed kernels, pixels: the default one after its area has shrunk eightfold, and one below a pixel.
KERNELS = (4.0 / 8.0**0.5, 0.5)
ROWS = [(m, None) for m in UNBIASED] + [(m, k) for m in BIASED for k in KERNELS]
#: Joins the unbiased methods where these are too noisy.
STAND_IN = ROWS.index(("vcm", KERNELS[-1]))
#: Largest relative difference of means that agree, and largest standard error that tells.
LIMIT = 0.005
#: Relative standard error at which a row has had enough time: with that of what it is compared with it stays below the limit.
AIM = 0.7 * LIMIT
#: Probability that a table tells of a difference where there is none.
FALSE_ALARM = 0.01
#: A standard error is at least so many times the largest contribution.
CHUNKS = 3.0
#: Gather photons: their light comes in portions that are larger the smaller the kernel.
GATHERS = ("ppm", "bpm", "photon-filter")
#: Roughness from which lobes are no Dirac ones.
ROUGH = 0.02
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
#: Parts of a picture: all, and what shows no mirror and no smooth glass.
ALL, CLEAR = 0, 1
CANNOT, CHANCE, SHRINKS = "cannot find", "by chance", "shrinks"
HEAD = f"""# Do the methods agree?

Mean luminance of pictures of {WIDE[0]} × {WIDE[1]} (gallery) and {SQUARE[0]} × {SQUARE[1]} pixels (scenes shared with other renderers), by `benches/agreement.py`: {SEEDS} seeds for every method,
all with random numbers of their own. A seed has {LEAST:g} s of processor time, twice that, and so on, until its method's standard error is {AIM:.2%}; at most {MOST:g} s, and no more than {ENOUGH:g} s where these would not do by far. Lights that are seen straight are left out (the pass `Emission`): all methods find them alike, and the noise
of a lamp's edge would hide the rest. *Clear* is the part of a picture that shows no mirror and no smooth glass, not even in a neighbouring pixel. There nobody sees a lamp by a rare
reflection, which is as noisy for all methods, and light tracing is complete.

**Standard errors** are the largest of three: by the scatter of the {SEEDS} seeds' means; by that of the pixels as if these were independent, times how much more seeds scatter than this lets expect, on
average over the scenes for the same method and kernel; and {CHUNKS:g} times the most that one pixel of one seed brings to the mean. The second is there since the first, from so few seeds, is
often much too small by accident. The third, since scatter knows only of light that came: where a mean is made of few bright events, some as bright may well not have happened yet, and what has met
but a few of them must not pass for precise. {", ".join(f"`{m}`" for m in GATHERS)} gather photons, and small kernels meet few: what one brings at {KERNELS[0]:.2f} pixels counts at {KERNELS[-1]:g} as well, as much brighter as
the kernel is smaller. What has met none cannot be told from its own pictures, and may be said to differ where it only had bad luck.

**Verdicts.** *agrees*: within {LIMIT:.1%} or two standard errors, which are at most {LIMIT:.1%}. *differs*: beyond {LIMIT:.1%} and beyond as many standard errors as one table in a hundred
reaches by accident. *{SHRINKS}*: the same, but the smaller kernel's deviation is less, by two of its standard errors, and does not differ: the larger kernel's is the price of its size. *{CANNOT}*: the same, too dark, and the method does not make all paths: `light` sees nothing rough in mirrors or behind smooth glass; `path` and `mvf` do not meet
lights without extent (points, a sun of no size) through mirrors or smooth glass, nor does `bdpt` if that is seen through such again. *too noisy to say*: all else; *{CHANCE}* where the
method finds those same paths for lights of some extent, if one happens to run into the light.
"""
PAIRS = """
## Unbiased methods

z-tests of each against each other: of the mean, and of the means of blocks of {side} × {side} pixels, of which the worst is told. One table in a hundred has by accident a mean beyond {mean:.1f} or a block
beyond {block:.1f}; what is beyond these *differs*.

| scene | part | methods | first over second | z | worst block | |
| --- | --- | --- | ---: | ---: | ---: | --- |
"""
KERNEL_ROWS = """
## Methods with a kernel

Deviations from the mean of the unbiased methods that make all paths (weighted by one over their variances), with fixed kernels: {first:.2f} pixels is the default of 4 after its area has shrunk
eightfold. Where the unbiased methods are known to no better than {half:.2%}, `vcm` with a kernel of {last:g} pixels joins them (*stands in*). Unbiased methods are listed where they
do not make all paths. The disks in which `ppm`, `bpm` and `vcm` gather hang over edges and find less light there: a loss that goes with the kernel's width in the picture, and these are small.

| scene | part | method | {first:.2f} pixels | {last:g} pixels |
| --- | --- | --- | --- | --- |
"""


def may_be_smooth(closure: Mapping[str, Any]) -> bool:
    """Whether a closure of docs/abi.md may have Dirac lobes, straight passage apart."""

    def is_rough(key: str, default: float) -> bool:
        value = closure.get(key, default)
        return isinstance(value, (int, float)) and value >= ROUGH

    kind = closure["type"]
    if kind in ("mix", "add"):
        return may_be_smooth(closure["a"]) or may_be_smooth(closure["b"])
    if kind == "principled" and (
        closure.get("transmission", 0) != 0
        or (closure.get("coat", 0) != 0 and not is_rough("coat_roughness", 0.03))
    ):
        return True
    if kind in ("glossy", "principled"):
        return not is_rough("roughness", 0.5)
    return kind in ("glass", "refraction")


class Noted(Scene):
    """A scene that notes what is hard for some methods, and marks its smooth materials in the pass MaterialIndex."""

    has_smooth = has_points = False

    def add_material(self, name: str, material: Mapping[str, Any]) -> int:
        """Adds a material."""
        is_smooth = may_be_smooth(material["surface"])
        self.has_smooth |= is_smooth
        return super().add_material(name, {**material, "pass_index": int(is_smooth)})

    def add_light(self, name: str, light: Mapping[str, Any]) -> int:
        """Adds a light."""
        is_sharp = light["type"] == "distant" and light.get("angle", 0) == 0
        self.has_points |= is_sharp or light["type"] == "point"
        return super().add_light(name, light)


@dataclass
class Row:
    """What the pictures of all seeds tell, of either part, as shares of the mean luminance.

    Attributes:
        budget: what could be spent.
        sums: what every block brings, by part, seed and block.
        variance: of the blocks' means over the seeds if pixels are independent, by part and block.
        chunk: most that a pixel of a seed brings above its own mean, by part.
    """

    budget: list[float]
    sums: list[list[list[float]]]
    variance: list[list[float]]
    chunk: list[float]

    def excess(self) -> float:
        """Variance of the seeds' means over what it would be if pixels were independent."""
        means = np.sum(self.sums[ALL], axis=1)
        return means.var(ddof=1) / SEEDS / np.sum(self.variance[ALL])

    def estimate(self, part: int, blocks: bool = False) -> tuple[Any, Any]:
        """Mean and standard error of a part, or of each of its blocks: see `HEAD`."""
        sums, variance = np.array(self.sums[part]), np.array(self.variance[part])
        if not blocks:
            sums, variance = sums.sum(axis=1), variance.sum()
        by_seeds = sums.std(axis=0, ddof=1) / SEEDS**0.5
        least = np.maximum(np.sqrt(variance), CHUNKS * self.chunk[part])
        return sums.mean(axis=0), np.maximum(by_seeds, least)

    def gains_from_more(self, seconds: float) -> bool:
        """Whether more than these seconds a seed bring a part's mean to the aim, or may do so for all that is known."""
        for part in (ALL, CLEAR):
            mean, error = self.estimate(part)
            needed = seconds * (error / (AIM * mean)) ** 2 if mean > 0.0 else 0.0
            if seconds < needed and (needed <= MOST or seconds < ENOUGH):
                return True
        return False


def by_block(values: np.ndarray) -> list:
    """Sums over blocks of pixels; the last two axes become one."""
    height, width = values.shape[-2:]
    rows = np.add.reduceat(values, np.arange(0, height, BLOCK), axis=-2)
    both = np.add.reduceat(rows, np.arange(0, width, BLOCK), axis=-1)
    return both.reshape(*values.shape[:-2], -1).tolist()


class Place:
    """A scene and its rows."""

    def __init__(self, path: Path) -> None:
        """Loads a stage, looks where it shows smooth surfaces, and renders what is not kept."""
        is_shared = path.parent == SHARED
        self.name = f"shared/{path.stem}" if is_shared else path.stem
        self.size = SQUARE if is_shared else WIDE
        self.scene = Noted()
        usd.load(path, scene=self.scene)
        (width, height), fine = self.size, 4
        once = {"integrator": "path", "samples": 1, "max_depth": 0, "threads": 1}
        once |= {"resolution": [fine * width, fine * height]}
        job = Render(self.scene, {**once, "passes": ["MaterialIndex"]})
        job.run()
        smooth = job.read_pass("MaterialIndex").reshape(height, fine, width, fine)
        smooth = np.pad(smooth.max(axis=(1, 3)), 1)
        near = np.lib.stride_tricks.sliding_window_view(smooth, (3, 3))
        self.clear = near.max(axis=(2, 3)) == 0
        self.rows = [self.row(*row, 1 + SEEDS * k) for k, row in enumerate(ROWS)]

    def row(self, method: str, kernel: float | None, seed: int) -> Row:
        """A row from its file, or measured with seeds from this one on."""
        name = f"{self.name}-{method}" + (f"-{kernel:.2f}px" if kernel else "")
        file = KEPT / f"{name.replace('/', '-')}.json"
        budget = [MOST, SEEDS, *self.size]
        if file.exists():
            row = Row(**json.loads(file.read_text()))
            if row.budget == budget:
                return row
        settings = {"kernel": "fixed", "kernel_size": kernel} if kernel else {}
        settings |= {"integrator": method, "threads": 1, "resolution": self.size}
        # slices: a busy machine gives less processor time than its clock says
        settings |= {"passes": ["Combined", "Emission"], "time": LEAST / 2}
        # for a seed all methods take the same camera samples: every row has seeds of its own
        jobs = [
            Render(self.scene, {**settings, "seed": seed + k}) for k in range(SEEDS)
        ]
        seconds = LEAST
        while True:
            for job in jobs:
                while job.stats()["cpu_seconds"] < seconds:
                    job.run()
            row = Row(budget, *self.parts(jobs))
            if seconds >= MOST or not row.gains_from_more(seconds):
                break
            seconds = min(2.0 * seconds, MOST)
        file.parent.mkdir(parents=True, exist_ok=True)
        file.with_suffix(".unfinished").write_text(json.dumps(asdict(row)))
        file.with_suffix(".unfinished").replace(file)
        mean, error = row.estimate(ALL)
        print(f"{name}: {mean:.5g} ± {error / mean:.2%}, {seconds:g} s", flush=True)
        return row

    def parts(self, jobs: list[Render]) -> tuple[list, list, list]:
        """Sums of blocks, their variances and the largest contribution, as `Row` has them."""
        pictures = []
        for job in jobs:
            straight = job.read_pass("Emission").astype(float)
            pictures.append(job.read_pass("Combined")[..., :3] - straight)
        masks = np.array([np.ones_like(self.clear), self.clear], float)
        parts = (np.array(pictures) @ LUMINANCE) * masks[:, None] / self.clear.size
        away = parts - parts.mean(axis=1, keepdims=True)
        variance = (away**2).sum(axis=1) / (SEEDS * (SEEDS - 1))
        chunk = (away.max(axis=(1, 2, 3)) / SEEDS).tolist()
        return by_block(parts), by_block(variance), chunk


@dataclass(frozen=True)
class Part:
    """A part of a scene's picture, and how the methods are judged there."""

    place: Place
    part: int

    @property
    def cells(self) -> list[str]:
        """The first cells of its rows in tables."""
        share = f"clear, {self.place.clear.mean():.0%}" if self.part == CLEAR else "all"
        return [self.place.name, share]

    def weakness(self, method: str) -> str:
        """Whether the method does not make some of the paths, or meets lights by chance."""
        scene = self.place.scene
        shows_smooth = self.part == ALL and not self.place.clear.all()
        casts_smooth = method in ("path", "mvf") and scene.has_smooth
        if casts_smooth or (method == "bdpt" and shows_smooth):
            return CANNOT if scene.has_points else CHANCE
        return CANNOT if method == "light" and shows_smooth else ""

    def complete(self) -> list[int]:
        """Rows of the unbiased methods that make all paths."""
        return [k for k, m in enumerate(UNBIASED) if self.weakness(m) != CANNOT]

    def consensus(self) -> tuple[float, float, bool]:
        """Mean of the complete methods, its standard error, and whether the stand-in has joined."""
        for joins in (False, True):
            used = self.complete() + [STAND_IN] * joins
            if used:
                found = [self.place.rows[k].estimate(self.part) for k in used]
                means, errors = np.array(found).T
                mean = np.average(means, weights=errors**-2.0)
                error = (errors**-2.0).sum() ** -0.5
                if error <= LIMIT / 2 * mean:
                    break
        return mean, error, joins

    def against(self, i: int, j: int) -> tuple[float, float, float, float]:
        """Relative difference of two rows and its standard error; the one over the other, and so in the worst block."""
        a, b = self.place.rows[i], self.place.rows[j]
        (x, dx), (y, dy) = a.estimate(self.part), b.estimate(self.part)
        (u, du), (v, dv) = (row.estimate(self.part, blocks=True) for row in (a, b))
        error, errors = np.hypot(dx, dy), np.hypot(du, dv)
        z = np.divide(u - v, errors, out=np.zeros_like(u), where=errors > 0)
        return (x - y) / y, error / y, (x - y) / error, z[np.abs(z).argmax()]


def lend(places: list[Place]) -> None:
    """Corrects rows by what others tell of their scatter and of their largest contribution."""
    for alike in zip(*(place.rows for place in places), strict=True):
        excess = max(float(np.mean([row.excess() for row in alike])), 1.0)
        for row in alike:
            row.variance = (excess * np.array(row.variance)).tolist()
    brighter = (KERNELS[0] / KERNELS[-1]) ** 2
    for place, method in product(places, GATHERS):
        large, small = (place.rows[ROWS.index((method, k))] for k in KERNELS)
        chunks = zip(small.chunk, large.chunk, strict=True)
        small.chunk = [max(own, brighter * other) for own, other in chunks]


def threshold(tests: int) -> float:
    """Standard errors within which so many normal numbers stay but for a false alarm (Šidák)."""
    each = 1.0 - (1.0 - FALSE_ALARM) ** (1.0 / max(tests, 1))
    return NormalDist().inv_cdf(1.0 - each / 2.0)


def verdict(off: float, error: float, most: float, weakness: str) -> str:
    """What a relative deviation means, of which so many standard errors may be accident."""
    if abs(off) > max(LIMIT, most * error):
        if not weakness or off > 0:
            return "differs"
        if weakness == CANNOT:
            return CANNOT
        # what was not met by chance is in no standard error
    elif error <= LIMIT and abs(off) <= max(LIMIT, 2.0 * error):
        return "agrees"
    return "too noisy to say" + (f", {CHANCE}" if weakness == CHANCE else "")


def shrinks(found: list[tuple[float, float, str]]) -> bool:
    """Whether the deviation of the larger kernel is that of its size: the smaller one's is less beyond accident, and passes."""
    (large, _, told), (small, error, small_told) = found[0], found[-1]
    is_less = abs(small) + 2.0 * error < abs(large)
    return told == "differs" and small_told != "differs" and is_less


def pairs(parts: list[Part], said: Counter[str]) -> str:
    """The section of unbiased methods; counts the verdicts."""
    tests = [
        (part, *pair) for part in parts for pair in combinations(part.complete(), 2)
    ]
    blocks = sum(len(part.place.rows[0].variance[ALL]) for part, _, _ in tests)
    most = {"mean": threshold(len(tests)), "block": threshold(blocks)}
    text = PAIRS.format(side=BLOCK, **most)
    for part, i, j in tests:
        off, error, z, worst = part.against(i, j)
        told = "passes" if error <= LIMIT else "too noisy to say"
        if abs(z) > most["mean"] or abs(worst) > most["block"]:
            told = "differs"
        said[told] += 1
        cells = [*part.cells, f"`{UNBIASED[i]}`, `{UNBIASED[j]}`"]
        cells += [f"{off:+.2%} ± {error:.2%}", f"{z:+.1f}", f"{worst:+.1f}", told]
        text += f"| {' | '.join(cells)} |\n"
    return text


def kernels(parts: list[Part], said: Counter[str]) -> str:
    """The section of methods with a kernel; counts the verdicts."""
    most = threshold(len(parts) * len(ROWS))
    text = KERNEL_ROWS.format(first=KERNELS[0], last=KERNELS[-1], half=LIMIT / 2)
    for part in parts:
        mean, error, joins = part.consensus()
        for method in (*UNBIASED, *BIASED):
            weakness = part.weakness(method)
            if method in UNBIASED and weakness != CANNOT:
                continue
            cells = [*part.cells, f"`{method}`"]
            found = []
            for number in (k for k, row in enumerate(ROWS) if row[0] == method):
                own, own_error = part.place.rows[number].estimate(part.part)
                off, off_error = own / mean - 1.0, np.hypot(own_error, error) / mean
                told = verdict(off, off_error, most, weakness)
                told = "stands in" if joins and number == STAND_IN else told
                found.append((off, off_error, told))
            if shrinks(found):
                found[0] = (*found[0][:2], SHRINKS)
            for off, off_error, told in found:
                said[told] += 1
                cells.append(f"{off:+.2%} ± {off_error:.2%}, {told}")
            text += f"| {' | '.join(cells)} |{' |' * (5 - len(cells))}\n"
    return text


def main(names: list[str]) -> int:
    """Measures these scenes, or all, and writes the document."""
    if not SHARED.is_dir():
        print(f"{SHARED} does not exist: the gallery alone", file=sys.stderr)
    paths = [p for d in (ROOT / "scenes", SHARED) for p in sorted(d.glob("*.usda"))]
    wanted = [p for p in paths if not names or p.stem in names]
    places = [Place(path) for path in wanted]
    lend(places)
    parts, said = [], Counter()
    for place in places:
        shown = [ALL] if place.clear.all() or not place.clear.any() else [ALL, CLEAR]
        parts += [Part(place, part) for part in shown]
    text = HEAD + pairs(parts, said) + kernels(parts, said)
    counts = ", ".join(f"{said[what]} × *{what}*" for what in sorted(said))
    text += f"\nIn all: {counts}.\n"
    print(text)
    if not names:
        (ROOT / "docs" / "agreement.md").write_text(text)
    return 1 if said["differs"] else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
