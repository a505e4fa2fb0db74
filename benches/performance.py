"""docs/performance.md: `segment` beside Cycles, LuxCore and Mitsuba on the same scenes for the same time.

Needs the scenes, references and harness that are shared between renderers (SEGUE_SHARED, or ../shared beside the
checkout) and two Python environments: PEERS_BPY_PYTHON with `bpy`, PEERS_PYTHON with `mitsuba`, `pyluxcore`,
`OpenImageIO` and `matplotlib`. Without them it says so and does nothing. Run:
.venv/bin/python benches/performance.py [--long] [SCENE ...]

With --long four times as long, beside those of the others alone that were best in some scene of the short table.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from sections import replace_section
from segue import Render, images, usd
from two_references import SHARP, relative_error

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared")) / "peers"
SCENES = ("cornell", "furnace", "glossy_box", "ajar_door", "cornell_glass", "lamp")
PEERS = (
    "cycles-base",
    "cycles-guided",
    "mitsuba-path",
    "luxcore-path",
    "luxcore-bidir",
    "luxcore-bidir-metro",
    "luxcore-bidirvm-random",
)
OURS = ("segment", "path")
#: Those that were best somewhere in the short table.
BEST = ("mitsuba-path", "luxcore-bidirvm-random")
SHORT, LONG = 15.0, 60.0
#: For the second reference, with a fixed kernel of a third of a pixel.
REFERENCE_SECONDS = 120.0
THREADS = 2
HEADING, LONG_HEADING = "Six scenes for all", "The same for a minute"
HEAD = """relMSE after {seconds:g} seconds of {threads} threads (processor seconds over threads; loading, building and compiling left out) at
256 × 256, one seed each, one after the other in one run of `benches/performance.py`. The scenes are the same for all (`peers/usd`).

Each squared error is the product of the differences from two independent references, `(a - r1)(a - r2)`, so that the references' own noise
does not count: `r1` was made by other renderers, `r2` by `segment` with a fixed kernel of a third of a pixel, {reference:g} seconds. It is divided by the
squared mean of both over 5 × 5 pixels. What was measured at a slightly other time is scaled as one over time. A picture whose error is bias
(kernels, or light that a method cannot find) gains less from more time.

| scene | {heads} | best of the others | its error over `segment`'s |
|---|{lines}---|---|
"""


def ours(scene: Any, **settings: Any) -> tuple[np.ndarray, float]:
    """A picture, and the processor seconds of a thread that it took."""
    common = {"resolution": [256, 256], "threads": THREADS}
    job = Render(scene, {**common, **settings})
    job.run()
    picture = job.read_pass("Combined")[..., :3].astype(np.float64)
    return picture, job.stats()["cpu_seconds"] / THREADS


def theirs(
    harness: Path, name: str, peers: Sequence[str], seconds: float
) -> dict[str, tuple[np.ndarray, float]]:
    """Pictures of the other renderers and the processor seconds of a thread that they took."""
    command = [
        os.environ["PEERS_PYTHON"],
        "peers.py",
        name,
        "--peers",
        ",".join(peers),
    ]
    command += ["--time", f"{seconds:g}"]
    environment = {**os.environ, "H_THREADS": str(THREADS)}
    subprocess.run(
        command,
        check=False,
        cwd=harness,
        env=environment,
        stdout=subprocess.DEVNULL,
    )
    records = json.loads((harness / "results" / name / "records.json").read_text())
    return {
        r["peer"]: (
            images.read_rgb(Path(r["exr"])).astype(np.float64),
            r["cpu"] / THREADS,
        )
        for r in records
    }


def row(
    harness: Path, name: str, own: Sequence[str], peers: Sequence[str], limit: float
) -> str:
    """The table's row of a scene."""
    scene = usd.load(SHARED / "usd" / f"{name}.usda").scene
    first = images.read_rgb(SHARED / "refs" / f"{name}.exr").astype(np.float64)
    second, _ = ours(scene, time=REFERENCE_SECONDS, **SHARP)
    found = {m: ours(scene, integrator=m, time=limit) for m in own}
    found |= theirs(harness, name, peers, limit)
    errors = {
        method: relative_error(picture, first, second) * seconds / limit
        for method, (picture, seconds) in found.items()
    }
    best = min((m for m in peers if m in errors), key=errors.__getitem__, default=None)
    cells = [f"{errors[m]:.2g}" if m in errors else "failed" for m in (*own, *peers)]
    cells += [best or "none"]
    cells += [f"{errors[best] / errors['segment']:.2g}" if best else ""]
    return f"| {name} | " + " | ".join(cells) + " |"


def main(names: list[str]) -> int:
    """Writes the table."""
    is_long = "--long" in names
    names = [name for name in names if name != "--long"]
    heading, own, peers, limit = (
        (LONG_HEADING, OURS[:1], BEST, LONG)
        if is_long
        else (HEADING, OURS, PEERS, SHORT)
    )
    missing = [v for v in ("PEERS_BPY_PYTHON", "PEERS_PYTHON") if v not in os.environ]
    if missing or not SHARED.exists():
        print(f"skipped: {', '.join(missing) or SHARED} is not there")
        return 0
    methods = (*own, *peers)
    with tempfile.TemporaryDirectory() as folder:
        # the harness writes beside itself
        harness = Path(folder) / "peers"
        shutil.copytree(SHARED, harness)
        rows = []
        for name in names or SCENES:
            rows.append(row(harness, name, own, peers, limit))
            print(rows[-1], flush=True)
    head = HEAD.format(
        seconds=limit,
        reference=REFERENCE_SECONDS,
        threads=THREADS,
        heads=" | ".join(methods),
        lines="---|" * len(methods),
    )
    body = head + "\n".join(rows)
    replace_section(ROOT / "docs" / "performance.md", heading, body)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
