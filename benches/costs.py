"""What an iteration of `segment` costs: time by stage, threads, size of a fixed kernel's clusters, memory.

The scenes of the gallery, and the six shared ones where they are (SEGUE_SHARED, or ../shared beside the checkout). Writes a
section of docs/performance.md. Run on an idle machine: .venv/bin/python benches/costs.py [SCENE ...]
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from sections import replace_section
from segue import Render, Scene, usd

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared"))
RESOLUTION, SAMPLES, REPEATS = [384, 216], 4, 3
LARGE = [1920, 1080]
STAGES = ("sampling", "clustering", "areas", "weights", "propagation")
HEADING = "What an iteration costs"
HEAD = f"""Processor seconds of an iteration of `segment`, {RESOLUTION[0]} × {RESOLUTION[1]}, one thread, mean of the first {SAMPLES} with all light paths, by `benches/costs.py`.
*Filtering*: weights and propagation over sampling. *Fourfold*: the same seconds for four times the segments in a fixed kernel
of the same size in the scene, over those here. *Threads*: seconds of one thread over seconds of two, the median of {REPEATS} pairs that took turns.
*1080p*: peak memory of the process that renders one iteration at {LARGE[0]} × {LARGE[1]} with the default memory budget.

| scene | {" | ".join(STAGES)} | filtering | fourfold | threads | bytes a segment | 1080p, GB |
| --- |{" ---: |" * (len(STAGES) + 5)}
"""


def stages() -> dict[str, Path]:
    """Names and files of the scenes."""
    found = {p.stem: p for p in sorted((ROOT / "scenes").glob("*.usda"))}
    for name in ("cornell", "cornell_glass", "ajar_door", "glossy_box", "furnace"):
        path = SHARED / "peers" / "usd" / f"{name}.usda"
        if path.exists():
            found[f"{name} (shared)"] = path
        else:
            print(f"skipped: {path.name} is not there", flush=True)
    return found


def render(scene: Scene, scale: int = 1, threads: int = 1) -> dict[str, Any]:
    """Statistics of a render at `scale` times the resolution, whose kernel has one size in the scene."""
    job = Render(
        scene,
        {
            "resolution": [scale * side for side in RESOLUTION],
            "samples": SAMPLES,
            "threads": threads,
            "kernel": "fixed",
            "kernel_size": 4.0 * scale,
            "memory_budget": 8192,
            "keep_all": True,
        },
    )
    job.run()
    return job.stats()


def filtering(stats: dict[str, Any]) -> float:
    """Seconds of weights and propagation."""
    return sum(
        stats["stages"][stage]["seconds"] for stage in ("weights", "propagation")
    )


def peak(stage: Path) -> float:
    """Peak memory of a process that renders one iteration at full size, GB."""
    code = (
        "import json, sys; from segue import Render, usd;"
        "job = Render(usd.load(sys.argv[1]).scene, json.loads(sys.argv[2]));"
        "job.run(); print(job.stats()['peak_memory_bytes'])"
    )
    settings = json.dumps({"resolution": LARGE, "samples": 1, "threads": 2})
    command = [sys.executable, "-c", code, str(stage), settings]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return int(done.stdout.split()[-1]) / 1e9


def row(name: str, stage: Path) -> str:
    """The figures of a scene."""
    scene = usd.load(stage).scene
    one = render(scene)
    seconds = [one["stages"][s]["seconds"] / SAMPLES for s in STAGES]
    sampling = one["stages"]["sampling"]["seconds"]
    fourfold = filtering(render(scene, scale=2)) / filtering(one)
    pairs = [
        [render(scene, threads=n)["seconds"] for n in (1, 2)] for _ in range(REPEATS)
    ]
    speedup = np.median([single / double for single, double in pairs])
    cells = [f"{s:.2f}" for s in seconds]
    cells += [f"{filtering(one) / sampling:.2f}", f"{fourfold:.1f}", f"{speedup:.2f}"]
    cells += [f"{one['bytes_per_segment']:.0f}", f"{peak(stage):.2f}"]
    return f"| {name} | {' | '.join(cells)} |"


def main(names: list[str]) -> int:
    """Measures these scenes, or all, and writes the section."""
    rows = []
    for name, stage in stages().items():
        if not names or stage.stem in names:
            rows.append(row(name, stage))
            print(rows[-1], flush=True)
    if not names:
        replace_section(
            ROOT / "docs" / "performance.md", HEADING, HEAD + "\n".join(rows)
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
