"""Large pictures are made in bands, and look the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import segue

pytest.importorskip("pxr", reason="usd-core is not installed")
from segue import usd

FOLDER = Path(__file__).parents[2] / "scenes"
BLOCK = 8
SEEDS = 16
#: MiB for which bands are as small as they become: a row of tiles.
LEAST = 1


def blocks(scene: segue.Scene, **settings: object) -> np.ndarray:
    """Means over blocks of pixels."""
    settings = {
        "resolution": [96, 96],
        "samples": 4,
        "kernel": "fixed",
        "kernel_size": 1,
        **settings,
    }
    job = segue.Render(scene, settings)
    job.run()
    picture = job.read_pass("Combined")[..., :3].mean(axis=-1, dtype=float)
    return picture.reshape(96 // BLOCK, BLOCK, 96 // BLOCK, BLOCK).mean(axis=(1, 3))


@pytest.mark.parametrize("name", ["lamp", "glossy_room"])
def test_bands_change_noise_alone(name: str) -> None:
    """Blocks of pictures in three bands and in one differ by chance; so do their means."""
    scene = usd.load(FOLDER / f"{name}.usda").scene
    pairs = [
        [blocks(scene, seed=2 * k), blocks(scene, seed=2 * k + 1, memory_budget=LEAST)]
        for k in range(SEEDS)
    ]
    differences = np.array([banded - whole for whole, banded in pairs])
    error = differences.std(axis=0, ddof=1) / SEEDS**0.5
    z = differences.mean(axis=0) / error
    # Student's t of fifteen degrees of freedom has a variance of 15/13
    assert np.mean(z**2) < 1.6, z.round(1)
    means = differences.mean(axis=(1, 2))
    assert abs(means.mean()) < 4.0 * means.std(ddof=1) / SEEDS**0.5


def test_bands_with_a_crop_and_a_last_narrow_one() -> None:
    """Every pixel gets as many samples as in one band, and no light is lost at the seams."""
    scene = usd.load(FOLDER / "still_life.usda").scene
    common = {
        "resolution": [80, 120],
        "crop": [10, 11, 70, 110],
        "samples": 3,
        "passes": ["Combined", "Depth"],
    }
    depths = []
    for budget in (LEAST, 1024):
        job = segue.Render(scene, {**common, "memory_budget": budget})
        job.run()
        assert job.stats()["samples"] == 3
        depths.append(job.read_pass("Depth"))
    # what camera rays meet first does not depend on bands
    assert depths[0].shape[:2] == (99, 60)
    assert np.array_equal(depths[0], depths[1])
