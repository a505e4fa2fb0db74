"""Light paths and filtering are left out where they do not pay; the picture stays what it is."""

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


def render(
    scene: segue.Scene, what: str = "light paths", **settings: object
) -> tuple[np.ndarray, list[str]]:
    """Means over blocks of pixels, and how much of `what` was left out."""
    job = segue.Render(scene, {"resolution": [96, 56], "samples": 6, **settings})
    job.run()
    picture = job.read_pass("Combined")[..., :3].mean(axis=-1, dtype=float)
    rows, columns = (n // BLOCK for n in picture.shape)
    blocks = picture.reshape(rows, BLOCK, columns, BLOCK).mean(axis=(1, 3))
    return blocks, [line for line in job.stats()["left_out"] if line.startswith(what)]


def test_a_lamp_in_glass_keeps_its_light_paths() -> None:
    """What only they find well cannot be left out."""
    scene = usd.load(FOLDER / "lamp.usda").scene
    assert render(scene)[1] == []


def compare(scene: segue.Scene, what: str, **settings: object) -> None:
    """`what` is left out, but not if all is kept; blocks of both pictures differ by noise alone."""
    differences = []
    for seed in range(SEEDS):
        thrifty, left_out = render(scene, what, seed=seed, **settings)
        lavish, all_left_out = render(scene, what, seed=seed, keep_all=True, **settings)
        assert left_out and all_left_out == []
        differences.append(thrifty - lavish)
    mean, error = np.mean(differences, axis=0), np.std(differences, axis=0, ddof=1) / SEEDS**0.5
    z = mean / error
    # Student's t of nine degrees of freedom has a variance of 9/7
    assert np.mean(z**2) < 2.0, z.round(1)
    assert abs(mean.mean()) < 4.0 * np.mean(differences, axis=(1, 2)).std(ddof=1) / SEEDS**0.5


def test_a_still_life_needs_none_and_looks_the_same_with_them() -> None:
    compare(usd.load(FOLDER / "still_life.usda").scene, "light paths")


def rough_ground() -> segue.Scene:
    """Slightly shiny ground of facets that are as small as pixels, under the sun and the sky."""
    scene = segue.Scene()
    side = 160
    y, x = np.mgrid[0:side, 0:side].reshape(2, -1)
    heights = 0.15 * np.random.default_rng(1).random(side * side)
    points = np.stack([x / 20 - side / 40, y / 20 - side / 40, heights], axis=1)
    corners = np.arange(side * side).reshape(side, side)
    quads = np.stack(
        [corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]], axis=-1
    )
    surface = {"type": "principled", "base_color": [0.3, 0.2, 0.1], "roughness": 0.5}
    material = scene.add_material("Ground", {"surface": surface})
    mesh = scene.add_mesh(
        "Ground", points.astype(np.float32), quads.ravel(), np.full(len(quads) ** 2, 4)
    )
    scene.add_instances("Ground", mesh, [np.eye(4)], [material])
    scene.add_light("Sky", {"type": "dome", "radiance": [0.4, 0.5, 0.6]})
    slanted = [1, 0, 0, 0, 0, 0.8, -0.6, 0, 0, 0.6, 0.8, 0, 0, 0, 0, 1]
    sun = {"type": "distant", "angle": 0.01, "irradiance": [3, 3, 3], "transform": slanted}
    scene.add_light("Sun", sun)
    above = [1, 0, 0, 0, 0, 0.8, -0.6, -4, 0, 0.6, 0.8, 5, 0, 0, 0, 1]
    window = [-0.6, 0.6, -0.35, 0.35]
    scene.set_camera("Camera", {"transform": above, "window": window})
    return scene


def test_filtering_is_left_out_where_it_smooths_nothing() -> None:
    # a larger kernel would blur facets that are as small as pixels: the pictures differed by 0.3 %
    compare(rough_ground(), "filtering", samples=8, kernel_size=1.0)
