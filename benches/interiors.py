"""docs/performance.md, scenes made by others: `segment` and `path` beside Cycles and Mitsuba.

Needs the scenes and the harness that are shared between renderers (SEGUE_SHARED, or ../shared beside the checkout) and two
Python environments: PEERS_BPY_PYTHON with `bpy`, PEERS_PYTHON with `mitsuba` and `usd-core`. Without them it says so and does
nothing. Run: .venv/bin/python benches/interiors.py [SCENE ...]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from sections import replace_section
from segue import Render, usd
from two_references import SHARP, relative_error, relative_noise

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared"))
SCENES = (
    "bathroom",
    "kitchen-ppg",
    "living-room",
    "staircase",
    "veach-ajar",
    "veach-mis",
)
SECONDS = float(os.environ.get("SEGUE_SECONDS", "15"))
THREADS = 2
WIDTH = 256
HEADING = "Scenes made by others"
HEAD = f"""relMSE after {SECONDS:g} seconds of {THREADS} threads (processor seconds over threads; loading, building and compiling left out), {WIDTH}
pixels wide, by `benches/interiors.py`. `segment` and `path`: against two references by `segment` with a fixed kernel of a third of a pixel and other seeds,
{2 * SECONDS:g} s each, so that blur and whatever else is wrong with the pictures counts. The others: noise alone, from two renders of other seeds, by the same
references' brightness. Cycles renders what Blender imports, with glass as glass, without and with path guiding; Mitsuba (`llvm_ad_rgb`, `path`) the stage's materials.
In brackets the mean of the picture over that of the references: what is far from 1 is not the same scene.

| scene | `segment` | `path` | Cycles | Cycles, guided | Mitsuba | best of the others over `segment` |
| --- | ---: | ---: | ---: | ---: | ---: | ---: |
"""
#: How the others are run: environment, script and what it wants to know beside stage, width, time and file.
OTHERS = (
    ("PEERS_BPY_PYTHON", "cycles_stage.py", ["base"]),
    ("PEERS_BPY_PYTHON", "cycles_stage.py", ["guided"]),
    ("PEERS_PYTHON", "mitsuba_stage.py", []),
)


def theirs(
    stage: Path, python: str, script: str, more: list[str]
) -> tuple[np.ndarray, float]:
    """Two pictures by another renderer, and the share of the time that counts which each of them took."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "pictures.npy"
        command = [os.environ[python], str(ROOT / "benches" / script), str(stage)]
        command += [str(WIDTH), str(SECONDS), str(THREADS), *more, str(out)]
        done = subprocess.run(
            command,
            check=True,
            cwd=SHARED / "peers",
            stdout=subprocess.PIPE,
            text=True,
        )
        pictures = np.load(out)
    seconds = np.mean(json.loads(done.stdout.splitlines()[-1]))
    return pictures, float(seconds) / SECONDS


def row(name: str) -> str:
    """The table's row of a scene."""
    stage = SHARED / "scenes" / name / f"{name}.usdc"
    found = [theirs(stage, *other) for other in OTHERS]
    height, width = found[0][0].shape[1:3]
    scene = usd.load(stage).scene
    common = {"resolution": [width, height], "threads": THREADS}

    def picture(**settings: object) -> tuple[np.ndarray, float]:
        job = Render(scene, {**common, **settings})
        job.run()
        pixels = job.read_pass("Combined")[..., :3].astype(float)
        return pixels, job.stats()["cpu_seconds"] / THREADS / SECONDS

    first, second = (
        picture(time=2 * SECONDS, **{**SHARP, "seed": SHARP["seed"] + k})[0]
        for k in range(2)
    )
    truth = (first + second) / 2
    errors, means = [], []
    for method in ("segment", "path"):
        ours, time = picture(integrator=method, time=SECONDS)
        errors.append(relative_error(ours, first, second) * time)
        means.append(ours.mean())
    noises = [relative_noise(*pair, truth) * time for pair, time in found]
    means += [pair.mean() for pair, _ in found]
    cells = [
        f"{error:.2g} ({mean / truth.mean():.2f})"
        for error, mean in zip(errors + noises, means, strict=True)
    ]
    return (
        f"| {name} | " + " | ".join([*cells, f"{min(noises) / errors[0]:.2g}"]) + " |"
    )


def main(names: list[str]) -> int:
    """Writes the table."""
    missing = [v for v in ("PEERS_BPY_PYTHON", "PEERS_PYTHON") if v not in os.environ]
    if missing or not (SHARED / "scenes").exists():
        print(f"skipped: {', '.join(missing) or SHARED} is not there")
        return 0
    rows = []
    for name in names or SCENES:
        rows.append(row(name))
        print(rows[-1], flush=True)
    body = HEAD + "\n".join(rows)
    replace_section(ROOT / "docs" / "performance.md", HEADING, body)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
