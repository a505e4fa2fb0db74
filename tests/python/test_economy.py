"""Light paths are left out where they do not pay, and the picture stays what it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import segue

pytest.importorskip("pxr", reason="usd-core is not installed")
from segue import usd

FOLDER = Path(__file__).parents[2] / "scenes"
BLOCK = 8
SEEDS = 10


def render(scene: segue.Scene, **settings: object) -> tuple[np.ndarray, list[str]]:
    """Means over blocks of pixels, and what was left out."""
    job = segue.Render(scene, {"resolution": [96, 56], "samples": 6, **settings})
    job.run()
    picture = job.read_pass("Combined")[..., :3].mean(axis=-1, dtype=float)
    rows, columns = (n // BLOCK for n in picture.shape)
    blocks = picture.reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))
    return blocks, [line for line in job.stats()["left_out"] if "light paths" in line]


def test_a_lamp_in_glass_keeps_its_light_paths() -> None:
    """What only they find well cannot be left out."""
    scene = usd.load(FOLDER / "lamp.usda").scene
    assert render(scene)[1] == []


def test_a_still_life_needs_none_and_looks_the_same_with_them() -> None:
    """Blocks of both pictures differ by noise alone."""
    scene = usd.load(FOLDER / "still_life.usda").scene
    differences = []
    for seed in range(SEEDS):
        thrifty, left_out = render(scene, seed=seed)
        lavish, all_left_out = render(scene, seed=seed, keep_all=True)
        assert left_out and all_left_out == []
        differences.append(thrifty - lavish)
    mean, error = np.mean(differences, axis=0), np.std(differences, axis=0, ddof=1) / SEEDS**0.5
    z = mean / error
    # Student's t of nine degrees of freedom has a variance of 9/7
    assert np.mean(z**2) < 2.0, z.round(1)
    assert abs(mean.mean()) < 4.0 * np.mean(differences, axis=(1, 2)).std(ddof=1) / SEEDS**0.5
