"""The reports of docs/convergence: error against run time of the method, its parts and its rivals; and their last figures
as a section of docs/method.md.

Three scenes are of the gallery. The others come from those that are shared between renderers (SEGUE_SHARED, or ../shared
beside the checkout); those that are missing are named and left out. Four have references by other renderers, at twice the
resolution. Those of the gallery and of the two interiors are means of independent renders by `segment` with a small fixed
kernel, which blurs about a pixel; how far two halves of them are apart is printed. Run:
.venv/bin/python benches/convergence.py [SCENE ...]
"""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from sections import replace_section
from segue import Render, images, usd

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared"))
REPORTS = ROOT / "docs" / "convergence"
METHODS = "segment,segment-progressive,segment-fixed,mvf,photon-filter,bpm,vcm,path"
#: Stages whose references are made here, resolutions, and seconds of one thread for a reference.
OWN = {
    "glass_caustic": (ROOT / "scenes/glass_caustic.usda", (192, 108), 900.0),
    "door_ajar": (ROOT / "scenes/door_ajar.usda", (192, 108), 900.0),
    "glossy_room": (ROOT / "scenes/glossy_room.usda", (192, 108), 900.0),
    "bathroom": (SHARED / "scenes/bathroom/bathroom.usdc", (180, 120), 900.0),
    "kitchen": (SHARED / "scenes/kitchen-ppg/kitchen-ppg.usdc", (180, 120), 2400.0),
}
#: Those that have references by other renderers.
OTHERS = ("cornell_glass", "lamp", "ajar_door", "glossy_box")
#: References that are made here are kept in this folder and taken up again; delete them to make them anew.
KEPT = ROOT / "build" / "references"
#: Seconds of one thread for each method.
SECONDS = 30.0
KERNEL = 0.5
#: Where half a pixel is not enough for light paths to fill: the settings there.
COARSER = {"glass_caustic": {"kernel_size": 1.5, "light_paths": 8.0}}
HEADING = "Error against run time"
HEAD = f"""MAPE in percent and, in brackets, relMSE of eight methods after {SECONDS:g} seconds of one thread, the lowest MAPE first, by `benches/convergence.py`; the whole curves are in
`docs/convergence`. References are by other renderers, at 128 × 128, or, of three scenes of the gallery (192 × 108) and the two interiors (180 × 120), by `segment` with a fixed kernel of {KERNEL:g} pixels (glass_caustic: of 1.5, with eight times the light paths). `progressive` and `fixed` are `segment` with those
kernels; that of `segment`, of `mvf` and of `photon-filter` is adaptive.

| scene |{" |" * len(METHODS.split(","))}
| --- |{" --- |" * len(METHODS.split(","))}
"""


def halved(made: Path, into: Path) -> tuple[int, int]:
    """Writes a reference at half its resolution, which is returned."""
    pixels = images.read_rgb(made).astype(np.float64)
    height, width = pixels.shape[0] // 2, pixels.shape[1] // 2
    mean = pixels.reshape(height, 2, width, 2, 3).mean((1, 3))
    images.write_exr(into, {"Combined": mean.astype(np.float32)}, {})
    return width, height


def reference(
    stage: Path, resolution: tuple[int, int], seconds: float, into: Path
) -> None:
    """Writes a reference, and says how well two halves of it agree."""
    scene = usd.load(stage, resolution=resolution).scene
    renders = []
    until = time.monotonic() + seconds
    while time.monotonic() < until or len(renders) < 2:
        settings = {
            "resolution": list(resolution),
            "kernel": "fixed",
            "kernel_size": KERNEL,
            **COARSER.get(stage.stem, {}),
        }
        seed = 2**30 + len(renders)
        job = Render(scene, {**settings, "time": 30.0, "seed": seed, "threads": 1})
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


def nameless(report: Path, folders: list[Path]) -> None:
    """Takes these folders, which are of one machine, out of a report's texts."""
    for path in (report / "curves.json", report / "index.html"):
        text = path.read_text()
        for folder in folders:
            text = text.replace(f"{folder}/", "")
        path.write_text(text)


def row(report: Path) -> str:
    """A row of the table: how the curves of a report end."""
    last = {}
    with (report / "curves.csv").open() as lines:
        for point in csv.DictReader(lines):
            last[point["method"].removeprefix("segment-")] = point
    best = sorted(last.items(), key=lambda item: float(item[1]["mape"]))
    cells = [
        f"{method} {100 * float(p['mape']):.1f} ({float(p['relmse']):.2g})"
        for method, p in best
    ]
    return f"| {report.name} | " + " | ".join(cells) + " |\n"


def main(names: list[str]) -> int:
    """Makes the reports of these scenes, or of all."""
    REPORTS.mkdir(parents=True, exist_ok=True)
    for name in names or [*OWN, *OTHERS]:
        stage = SHARED / "peers" / "usd" / f"{name}.usda"
        if name in OWN:
            stage, resolution, seconds = OWN[name]
        if not stage.exists():
            print(f"skipped: {stage} does not exist", flush=True)
            continue
        with tempfile.TemporaryDirectory() as scratch:
            if name in OWN:
                made = KEPT / f"{name}.exr"
                made.parent.mkdir(parents=True, exist_ok=True)
                if not made.exists():
                    reference(stage, resolution, seconds, made)
            else:
                made = Path(scratch) / "reference.exr"
                resolution = halved(SHARED / "peers" / "refs" / f"{name}.exr", made)
            command = [sys.executable, "-m", "segue", "converge", str(stage), "--quiet"]
            command += ["--methods", METHODS, "--time", str(SECONDS), "--threads", "1"]
            command += ["--resolution", "{}x{}".format(*resolution)]
            command += ["--reference", str(made), "-o", str(REPORTS / name)]
            status = subprocess.run(command, check=False).returncode
            if status:
                return status
            nameless(REPORTS / name, [stage.parent, made.parent])
    reports = sorted(p.parent for p in REPORTS.glob("*/curves.csv"))
    body = HEAD + "".join(map(row, reports))
    replace_section(ROOT / "docs" / "method.md", HEADING, body)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
