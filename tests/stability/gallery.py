"""What holds in every scene of the gallery."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import segue
from case import Rows, case, exact
from segue import usd

GROUP = "Gallery"
SCENES = Path(__file__).resolve().parents[2] / "scenes"


def stages(full: bool) -> list[Path]:
    """The gallery, or two of its scenes."""
    found = sorted(SCENES.glob("*.usda"))
    return found if full else found[:2]


@case(GROUP, "not one: the picture of one thread, bit for bit, and no sample refused")
def threads(full: bool) -> Rows:
    """Values that differ with the number of threads."""
    for stage in stages(full):
        scene = usd.load(stage).scene
        pictures, refused = [], 0
        for count in (1, 2, 7):
            # kernels are chosen anew after iterations 4 and 8
            limits = {"resolution": [96, 54], "samples": 10, "threads": count}
            job = segue.Render(scene, limits)
            job.run()
            stats = job.stats()
            pictures.append(job.read_pass("Combined"))
            refused += stats["non_finite"] + stats["dropped"]
        for count, picture in zip((2, 7), pictures[1:], strict=True):
            differ = int(np.count_nonzero(picture != pictures[0]))
            yield exact(f"{stage.stem}, {count} threads", 0.0, differ, refused=refused)
