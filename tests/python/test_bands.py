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


def test_long_paths_keep_within_the_budget() -> None:
    """In a closed white room paths have dozens of arrivals: its bands are the smaller."""
    scene = segue.Scene()
    surface = {"type": "diffuse", "color": 0.97}
    white = scene.add_material("white", {"surface": surface})
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    sides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4]]
    sides += [[1, 3, 7, 5]]
    triangles = np.array([[[a, b, c], [a, c, d]] for a, b, c, d in sides]).ravel()
    mesh = scene.add_mesh("room", corners.astype(np.float32), triangles)
    scene.add_instances("room", mesh, np.eye(4), [white])
    scene.add_light("lamp", {"type": "point", "intensity": [1, 1, 1]})
    scene.set_camera("camera", {"window": [-1, 1, -1, 1]})
    budget = 64
    settings = {"resolution": [192, 192], "samples": 1, "memory_budget": budget}
    job = segue.Render(scene, settings)
    job.run()
    stats = job.stats()
    held = stats["segments"] * stats["bytes_per_segment"]
    # a row of tiles is the least, and light paths are those of all bands
    assert held < 1.5 * budget * 2**20
