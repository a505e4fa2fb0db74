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
{2 * SECONDS:g} s each, so that blur and whatever else is wrong with the pictures counts. Mitsuba (`llvm_ad_rgb`, `path`, the scenes' original materials, which
differ a little): noise alone, from two renders of other seeds, by the same references' brightness.

| scene | `segment` | `path` | Mitsuba | Mitsuba over `segment` |
| --- | ---: | ---: | ---: | ---: |
"""


def theirs(stage: Path) -> tuple[np.ndarray, float]:
    """Two pictures by Mitsuba, and the share of the time that counts which each of them took."""
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
        pictures = np.load(out)
    seconds = np.mean(json.loads(done.stdout.splitlines()[-1]))
    return pictures, float(seconds) / SECONDS


def row(name: str) -> str:
    """The table's row of a scene."""
    stage = SHARED / "scenes" / name / f"{name}.usdc"
    pair, their_time = theirs(stage)
    scene = usd.load(stage).scene
    common = {"resolution": [pair.shape[2], pair.shape[1]], "threads": THREADS}

    def picture(**settings: object) -> tuple[np.ndarray, float]:
        job = Render(scene, {**common, **settings})
        job.run()
        pixels = job.read_pass("Combined")[..., :3].astype(float)
        return pixels, job.stats()["cpu_seconds"] / THREADS / SECONDS

    first, second = (
        picture(time=2 * SECONDS, **{**SHARP, "seed": SHARP["seed"] + k})[0]
        for k in range(2)
    )
    noise = relative_noise(*pair, (first + second) / 2) * their_time
    errors = []
    for method in ("segment", "path"):
        ours, time = picture(integrator=method, time=SECONDS)
        errors.append(relative_error(ours, first, second) * time)
    cells = [f"{e:.2g}" for e in (*errors, noise, noise / errors[0])]
    return f"| {name} | " + " | ".join(cells) + " |"


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
