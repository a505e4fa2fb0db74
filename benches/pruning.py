"""What leaving out saves: time of an iteration with and without `keep_all`, and whether the pictures agree.

The scenes of the gallery and a ball under a plain sky. Renders with and without take turns, in one process. Writes a section
of docs/performance.md. Run on an idle machine: .venv/bin/python benches/pruning.py [SCENE ...]
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import segue
from sections import replace_section
from segue import usd

ROOT = Path(__file__).parent.parent
RESOLUTION, SAMPLES, SEEDS = [240, 135], 12, 8
#: The picture's blocks, across and down, whose means are compared.
BLOCKS = (4, 3)
SHARP = {"kernel": "fixed", "kernel_size": 0.35}
#: The 0.1 % of Student's t with 14 degrees of freedom that lie beyond, for the largest of 36.
CRITICAL = 5.9


def plain() -> segue.Scene:
    """A diffuse ball's worth of what needs next to nothing: two squares under a uniform sky."""
    scene = segue.Scene()
    white = scene.add_material("white", {"surface": {"type": "diffuse", "color": 0.7}})
    points = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    upright = points[:, [0, 2, 1]] + np.float32([0, 0.5, 0.5])
    for name, corners in (("floor", points), ("wall", upright)):
        mesh = scene.add_mesh(name, corners, np.array([0, 1, 2, 0, 2, 3]))
        scene.add_instances(name, mesh, np.eye(4), [white])
    scene.add_light("sky", {"type": "dome", "radiance": [1, 1, 1]})
    tilt = np.eye(4)
    tilt[1:3, 1:3] = np.array([[0.8, -0.6], [0.6, 0.8]])
    tilt[:3, 3] = [0, -2.1, 2.8]
    window = [-0.5, 0.5, -0.28, 0.28]
    scene.set_camera("camera", {"window": window, "transform": tilt.ravel().tolist()})
    return scene


def with_unused(scene: segue.Scene) -> segue.Scene:
    """Adds what nothing in the scene uses."""
    pixels = np.random.default_rng(1).uniform(size=(64, 64, 4)).astype(np.float32)
    image = scene.add_image("unused", pixels)
    texture = scene.add_texture("unused", {"type": "image", "image": image})
    color = {"texture": texture}
    mixed = {
        "type": "mix",
        "factor": 0.5,
        "a": {"type": "glass", "ior": 1.5},
        "b": {"type": "transparent"},
    }
    scene.add_material("unused", {"surface": mixed})
    scene.add_material("unused too", {"surface": {"type": "diffuse", "color": color}})
    return scene


def timed(scene: segue.Scene, seed: int, keep_all: bool) -> tuple[float, list[str]]:
    """Seconds of an iteration, and what was left out."""
    limits = {"resolution": RESOLUTION, "samples": SAMPLES, "seed": seed, "threads": 2}
    job = segue.Render(scene, {**limits, "keep_all": keep_all})
    job.run()
    stats = job.stats()
    return stats["seconds"] / stats["samples"], stats["left_out"]


def blocks(scene: segue.Scene, seed: int, keep_all: bool) -> np.ndarray:
    """Means of the blocks of a picture with a kernel that hardly blurs: blur may differ, light may not."""
    limits = {"resolution": RESOLUTION, "samples": SAMPLES, "seed": seed, "threads": 2}
    job = segue.Render(scene, {**limits, **SHARP, "keep_all": keep_all})
    job.run()
    (across, down), (width, height) = BLOCKS, RESOLUTION
    picture = job.read_pass("Combined")[..., :3].astype(np.float64)
    return picture.reshape(down, height // down, across, width // across, 3).mean(
        (1, 3)
    )


def compare(name: str, a: segue.Scene, b: segue.Scene, keep_all: bool) -> str:
    """A row: `b`, with `keep_all` or not, over `a`, pruned."""
    times, means, left_out = ([], []), ([], []), []
    for seed in range(SEEDS):
        # each first in turn
        for k in ((0, 1), (1, 0))[seed % 2]:
            which = ((a, b)[k], 1000 * k + seed, keep_all and k == 1)
            seconds, left = timed(*which)
            times[k].append(seconds)
            means[k].append(blocks(*which))
            left_out = left if k == 0 else left_out
    ratio = np.median(np.divide(times[1], times[0]))
    spread = sum(np.var(m, axis=0, ddof=1) / SEEDS for m in means)
    difference = np.mean(means[0], axis=0) - np.mean(means[1], axis=0)
    z = np.abs(difference) / np.sqrt(np.maximum(spread, 1e-30))
    verdict = "agree" if z.max() < CRITICAL else "**differ**"
    parts = "; ".join(text.split(":")[0] for text in left_out)
    milliseconds = [f"{1000 * np.median(t):.1f}" for t in times]
    return f"| {name} | {parts} | {' | '.join(milliseconds)} | {ratio:.2f} | {z.max():.1f}, {verdict} |"


def main(names: list[str]) -> int:
    """Measures these scenes, or all, and writes the section."""
    heading = "| scene | left out | ms | ms with all | ratio | largest deviation |"
    rows = [heading, "| --- | --- | ---: | ---: | ---: | --- |"]
    for stage in sorted((ROOT / "scenes").glob("*.usda")):
        if not names or stage.stem in names:
            scene = usd.load(stage).scene
            rows.append(compare(stage.stem, scene, scene, True))
            print(rows[-1], flush=True)
    rows.append(compare("two squares under a sky", plain(), plain(), True))
    print(rows[-1], flush=True)
    rows.append(
        compare(
            "the same, beside it with unused glass, holes and textures",
            plain(),
            with_unused(plain()),
            False,
        )
    )
    print(rows[-1], flush=True)
    replace_section(
        ROOT / "docs" / "performance.md",
        "What is left out, and what it saves",
        f"""Milliseconds of an iteration of `segment`, {RESOLUTION[0]} × {RESOLUTION[1]}, 2 threads, {SAMPLES} iterations, the median of {SEEDS} renders that took turns
with those that leave nothing out (`--keep-all`), by `benches/pruning.py`. *Ratio*: with all over pruned, median of the pairs. *Largest deviation*: of the means
of {BLOCKS[0] * BLOCKS[1]} blocks in three channels between both, in standard errors over seeds, in renders of their own with a kernel of {SHARP["kernel_size"]} pixels; they differ beyond {CRITICAL} (one in a thousand).

"""
        + "\n".join(rows),
    )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
