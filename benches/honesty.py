"""How true the error is that a render tells of itself: the told relMSE over the true one, by scene and time.

The scenes of the gallery; the truth is by two references (`two_references.py`), which are kept in results/honesty until these are
deleted. Writes a section of docs/method.md, and fails if fewer than nine in ten are within a factor of two. Run on an idle
machine: .venv/bin/python benches/honesty.py [SCENE ...]
"""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sections import replace_section
from segue import Render, Scene, images, usd
from two_references import SHARP, relative, relative_error

ROOT = Path(__file__).parent.parent
KEPT = ROOT / "results" / "honesty"
RESOLUTION, THREADS = [192, 108], 1
SECONDS = (3, 10, 30)
SEEDS = 4
REFERENCE_SECONDS = float(os.environ.get("SEGUE_SECONDS", "120"))
#: Where single segments find too little light for a kernel of a third of a pixel, and times as many seconds.
COARSER: dict[str, tuple[dict[str, object], float]] = {
    "door_ajar": ({"kernel_size": 1.0}, 2.5)
}
#: Least share of scenes and times whose told error is within a factor of two.
WANTED = 0.9
HEADING = "How true the told error is"
HEAD = f"""relMSE that `segment` tells of its picture over the true one, by `benches/honesty.py`: {RESOLUTION[0]} × {RESOLUTION[1]}, {THREADS} thread, {SEEDS} seeds.
Each true squared error is the product of the differences from two independent references, {REFERENCE_SECONDS:g} s each with a fixed kernel of a
third of a pixel (door_ajar: of one pixel, {2.5 * REFERENCE_SECONDS:g} s); *systematic* is what two seeds have in common, the rest is noise. Renders
of fewer than four iterations tell nothing (nan). Single glints of lamps in glass decide over glass_caustic and lamp at this size, in the references as well.

| scene | seconds | true | systematic | told | told systematic | told over true |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
"""


@dataclass
class Told:
    """A picture, and the error that it tells."""

    picture: np.ndarray
    error: float
    bias: float


#: What stands for an error of fewer than four iterations, of which nothing is told.
NOTHING = float("nan")


def render(scene: Scene, **settings: object) -> Told:
    """A render and what it says."""
    job = Render(scene, {"resolution": RESOLUTION, "threads": THREADS, **settings})
    job.run()
    stats = job.stats()
    picture = job.read_pass("Combined")[..., :3].astype(np.float64)
    error = stats["estimated_error"]
    return Told(
        picture, NOTHING if error is None else error, stats["estimated_bias"] or 0.0
    )


def references(name: str, scene: Scene) -> list[np.ndarray]:
    """Two pictures whose noise is independent."""
    found = []
    settings, times = COARSER.get(name, ({}, 1.0))
    seconds = times * REFERENCE_SECONDS
    for k in range(2):
        path = KEPT / f"{name}-{RESOLUTION[0]}-{seconds:g}s-{k}.exr"
        if not path.exists():
            KEPT.mkdir(parents=True, exist_ok=True)
            sharp = {**SHARP, **settings, "seed": SHARP["seed"] + k}
            picture = render(scene, time=seconds, **sharp).picture
            images.write_exr(path, {"Combined": picture}, {})
        found.append(images.read_rgb(path).astype(np.float64))
    return found


def measure(name: str) -> tuple[list[str], list[float]]:
    """Rows of a scene, and told over true in the mean of the seeds, for every time at which something is told."""
    scene = usd.load(ROOT / "scenes" / f"{name}.usda").scene
    first, second = references(name, scene)
    rows, ratios = [], []
    for seconds in SECONDS:
        told = [render(scene, time=seconds, seed=seed) for seed in range(SEEDS)]
        true = [relative_error(t.picture, first, second) for t in told]
        common = (told[0].picture - first) * (told[1].picture - second)
        both = relative(common, (first + second) / 2)
        within = [t.error / e for t, e in zip(told, true, strict=True)]
        known = [k for k, t in enumerate(told) if not np.isnan(t.error)]
        if known:
            means = [np.mean([told[k].error for k in known])]
            means.append(np.mean([true[k] for k in known]))
            ratios.append(means[0] / means[1])
        cells = [np.mean(true), both, *np.mean([(t.error, t.bias) for t in told], 0)]
        shown = " | ".join(f"{c:.2g}" for c in cells)
        each = ", ".join(f"{r:.2f}" for r in within)
        rows.append(f"| {name} | {seconds} | {shown} | {each} |")
        print(rows[-1], flush=True)
    return rows, ratios


def main(names: list[str]) -> int:
    """Measures these scenes, or all, and writes the section."""
    rows, ratios = [], []
    for name in names or sorted(p.stem for p in (ROOT / "scenes").glob("*.usda")):
        more_rows, more_ratios = measure(name)
        rows += more_rows
        ratios += more_ratios
    share = np.mean([0.5 <= r <= 2.0 for r in ratios])
    tail = f"\n\nWithin a factor of two in the mean of the seeds: {share:.0%} of {len(ratios)} scenes and times."
    print(tail.strip())
    if not names:
        replace_section(
            ROOT / "docs" / "method.md", HEADING, HEAD + "\n".join(rows) + tail
        )
    return 0 if share >= WANTED else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
