"""The reports of docs/convergence: error against run time of the method, its parts and its rivals.

Two interiors come from the scenes that are shared between renderers (SEGUE_SHARED, or ../shared beside the
checkout) and are left out, with a word, where those are not. References are means of independent renders by
`segment` with a small fixed kernel, which finds every scene's light and blurs a third of a pixel. Run:
.venv/bin/python benches/convergence.py [SCENE ...]
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from segue import Render, images, usd

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared")) / "scenes"
REPORTS = ROOT / "docs" / "convergence"
METHODS = "segment,segment-fixed,mvf,photon-filter,bpm,vcm,path"
SCENES = {
    "bathroom": (SHARED / "bathroom" / "bathroom.usdc", (180, 120)),
    "kitchen": (SHARED / "kitchen-ppg" / "kitchen-ppg.usdc", (180, 120)),
    "glass_caustic": (ROOT / "scenes" / "glass_caustic.usda", (192, 108)),
    "lamp": (ROOT / "scenes" / "lamp.usda", (192, 108)),
    "door_ajar": (ROOT / "scenes" / "door_ajar.usda", (192, 108)),
}
#: Seconds of two threads for a reference, and of one thread for each method.
REFERENCE_SECONDS = 150.0
SECONDS = 24.0
KERNEL = 0.35


def reference(stage: Path, resolution: tuple[int, int], into: Path) -> None:
    """Writes a reference, and says how well two halves of it agree."""
    scene = usd.load(stage).scene
    renders = []
    until = time.monotonic() + REFERENCE_SECONDS
    while time.monotonic() < until or len(renders) < 2:
        settings = {
            "resolution": list(resolution),
            "kernel": "fixed",
            "kernel_size": KERNEL,
        }
        job = Render(scene, {**settings, "time": 15.0, "seed": 2**30 + len(renders)})
        job.run()
        renders.append(job.read_pass("Combined")[..., :3].astype(np.float64))
    even, odd = np.mean(renders[::2], axis=0), np.mean(renders[1::2], axis=0)
    mean = np.mean(renders, axis=0)
    doubt = np.abs(even - odd).mean() / 2 / mean.mean()
    print(
        f"{stage.stem}: reference of {len(renders)} renders, halves {doubt:.2%} apart",
        flush=True,
    )
    images.write_exr(into, {"Combined": mean.astype(np.float32)}, {})


def main(names: list[str]) -> int:
    """Makes the reports of these scenes, or of all."""
    REPORTS.mkdir(parents=True, exist_ok=True)
    for name in names or SCENES:
        stage, resolution = SCENES[name]
        if not stage.exists():
            print(f"skipped: {stage} does not exist", flush=True)
            continue
        with tempfile.TemporaryDirectory() as folder:
            made = Path(folder) / "reference.exr"
            reference(stage, resolution, made)
            command = [sys.executable, "-m", "segue", "converge", str(stage), "--quiet"]
            command += ["--methods", METHODS, "--time", str(SECONDS), "--threads", "1"]
            command += [
                "--resolution",
                "{}x{}".format(*resolution),
                "--reference",
                str(made),
            ]
            status = subprocess.run(
                [*command, "-o", str(REPORTS / name)], check=False
            ).returncode
            if status:
                return status
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
