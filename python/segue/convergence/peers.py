"""Other renderers on the same scene, through a harness beside the project, where there is one.

The harness (`peers/peers.py` in the folder of shared inputs) knows some scenes in the terms of each
renderer. It writes beside itself, so that a copy of it is run.
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

from .. import images
from .running import Outcome, Point, measured

#: What of a renderer stands for it: the harness has several variants of each.
VARIANTS = {"cycles": "cycles-base", "luxcore": "luxcore-bidir", "mitsuba": "mitsuba-path"}


class PeersError(Exception):
    """The others cannot be asked; the text says why."""


def harness() -> Path:
    """Where the harness should be.

    The shared inputs are in $SEGUE_SHARED, by default the folder `shared` beside the checkout.
    """
    checkout = Path(__file__).resolve().parents[3]
    shared = Path(os.environ.get("SEGUE_SHARED") or checkout.parent / "shared")
    return shared / "peers"


def render(
    stage: Path, names: Sequence[str], times: Sequence[float], seed: int, reference: np.ndarray
) -> list[Outcome]:
    """The renderers' errors at the times.

    Args:
        stage: of the name of a scene that the harness knows.
        names: keys of `VARIANTS`, or variants themselves.
        times: seconds of rendering.
        seed: of all.
        reference: (h, w, 3) linear colours.

    Raises:
        PeersError: there is no harness, it does not know the stage, or no renderer had a result.
    """
    home = harness()
    if not (home / "peers.py").is_file():
        raise PeersError(f"there is no {home / 'peers.py'} (SEGUE_SHARED)")
    if not (home / "usd" / f"{stage.stem}.usda").is_file():
        raise PeersError(f"the harness does not know a scene {stage.stem!r}")
    with tempfile.TemporaryDirectory() as temporary:
        copy = Path(temporary) / "peers"
        shutil.copytree(home, copy, copy_function=shutil.copyfile, ignore_dangling_symlinks=True)
        for folder in (copy, *(p for p in copy.rglob("*") if p.is_dir())):
            folder.chmod(0o755)
        chosen = ",".join(VARIANTS.get(name, name) for name in names)
        command = [sys.executable, str(copy / "peers.py"), stage.stem, "--peers", chosen]
        command += ["--time", ",".join(f"{t:g}" for t in times), "--clock", "wall"]
        command += ["--seeds", str(seed)]
        done = subprocess.run(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False
        )
        # What was rendered counts even if the harness failed after that.
        records = copy / "results" / stage.stem / "records.json"
        found = json.loads(records.read_text()) if records.is_file() else []
        if not found:
            logs = sorted((copy / "build" / "log").glob("*.txt"))
            said = [_last_line(text) for text in (done.stderr, *(p.read_text() for p in logs))]
            raise PeersError(f"the harness has no result: {'; '.join(filter(None, said))}")
        return _outcomes(found, reference)


def _last_line(text: str) -> str:
    lines = text.strip().splitlines()
    return lines[-1].strip() if lines else ""


def _outcomes(records: list[dict[str, Any]], reference: np.ndarray) -> list[Outcome]:
    result = []
    for name in dict.fromkeys(r["peer"] for r in records):
        points, picture = [], None
        for record in sorted((r for r in records if r["peer"] == name), key=lambda r: r["wall"]):
            picture = images.read_rgb(record["exr"])
            if picture.shape != reference.shape:
                height, width = picture.shape[:2]
                raise PeersError(f"its pictures are {width} x {height}: give that --resolution")
            point = Point(
                name,
                0,
                seconds=record["wall"],
                cpu_seconds=record.get("cpu"),
                iterations=record.get("spp") or 0,
                **measured(picture, reference),
            )
            points.append(point)
        result.append(Outcome(name, 0, points, picture, {}))
    return result
