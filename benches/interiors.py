"""docs/performance.md, scenes made by others: `segment` and `path` beside Mitsuba's compiled path tracer.

Needs the scenes and the harness that are shared between renderers (SEGUE_SHARED, or ../shared beside the checkout) and a
Python environment PEERS_PYTHON with `mitsuba` and `usd-core`. Without them it says so and does nothing. Run:
.venv/bin/python benches/interiors.py [SCENE ...]
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
from two_references import SHARP, relative_error, smooth

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
{2 * SECONDS:g} s each, so that blur and whatever else is wrong with the pictures counts. Mitsuba (`llvm_ad_rgb`, `path`, the scenes' original materials, which
differ a little): noise alone, from two renders of other seeds. The last columns leave out the worst hundredth of the pixels.

| scene | `segment` | `path` | Mitsuba | Mitsuba over `segment` | `segment`, 99 % | Mitsuba, 99 % | ratio |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
"""


def without_worst(errors: np.ndarray) -> float:
    """Mean without the largest hundredth."""
    ordered = np.sort(errors.ravel())
    return float(ordered[: int(0.99 * ordered.size)].mean())


def relative(squares: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """Squared errors of pixels, relative to the squared local means."""
    return (squares / (smooth(mean) ** 2 + (0.01 * mean.mean()) ** 2)).mean(axis=-1)


def theirs(stage: Path) -> tuple[np.ndarray, np.ndarray]:
    """Mitsuba's pictures, and the relative errors of its pixels at the time that counts."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "pictures.npy"
        command = [
            os.environ["PEERS_PYTHON"],
            str(ROOT / "benches" / "mitsuba_stage.py"),
            str(stage),
            str(WIDTH),
            str(SECONDS),
            str(THREADS),
            str(out),
        ]
        done = subprocess.run(
            command,
            check=True,
            cwd=SHARED / "peers",
            stdout=subprocess.PIPE,
            text=True,
        )
        a, b = np.load(out)
    seconds = np.mean(json.loads(done.stdout.splitlines()[-1]))
    mean = (a + b) / 2
    return mean, relative((a - b) ** 2 / 2, mean) * (seconds / SECONDS)


def row(name: str) -> str:
    """The table's row of a scene."""
    stage = SHARED / "scenes" / name / f"{name}.usdc"
    mean, noise = theirs(stage)
    scene = usd.load(stage).scene
    common = {"resolution": [mean.shape[1], mean.shape[0]], "threads": THREADS}

    def picture(**settings: object) -> tuple[np.ndarray, float]:
        job = Render(scene, {**common, **settings})
        job.run()
        pixels = job.read_pass("Combined")[..., :3].astype(float)
        return pixels, job.stats()["cpu_seconds"] / THREADS / SECONDS

    first, second = (
        picture(time=2 * SECONDS, **{**SHARP, "seed": SHARP["seed"] + k})[0]
        for k in range(2)
    )
    both = (first + second) / 2
    found = {}
    for method in ("segment", "path"):
        ours, time = picture(integrator=method, time=SECONDS)
        errors = relative((ours - first) * (ours - second), both) * time
        found[method] = relative_error(ours, first, second) * time, errors
    (segment, errors), (path, _) = found["segment"], found["path"]
    calm, their_calm = without_worst(errors), without_worst(noise)
    cells = [f"{segment:.2g}", f"{path:.2g}", f"{noise.mean():.2g}"]
    cells += [f"{noise.mean() / segment:.2g}", f"{calm:.2g}", f"{their_calm:.2g}"]
    return f"| {name} | " + " | ".join(cells) + f" | {their_calm / calm:.2g} |"


def main(names: list[str]) -> int:
    """Writes the table."""
    if "PEERS_PYTHON" not in os.environ or not (SHARED / "scenes").exists():
        print(f"skipped: PEERS_PYTHON or {SHARED} is not there")
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
