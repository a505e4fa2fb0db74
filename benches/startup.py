"""Time from numpy arrays to the first pixels: a million triangles, a million instances.

Run with `.venv/bin/python benches/startup.py`. Prints one line a case; `benches/NOTES.md` keeps figures.
"""

from __future__ import annotations

import time

import numpy as np
import segue

CAMERA = {
    "window": [-0.5, 0.5, -0.5, 0.5],
    "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4, 0, 0, 0, 1],
}


def heightfield(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangle corners of a rough square of `2 * cells**2` triangles."""
    axis = np.linspace(-1, 1, cells + 1, dtype=np.float32)
    x, y = np.meshgrid(axis, axis)
    z = 0.05 * np.sin(40 * x) * np.cos(37 * y)
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    quads = np.stack([corner, corner + 1, corner + cells + 2, corner + cells + 1], -1)
    return points, quads[:, [0, 1, 2, 0, 2, 3]].astype(np.uint32)


def first_pixels(name: str, build: object) -> None:
    """Time the building of a scene, of the render, and one sample of a small picture."""
    start, cpu = time.perf_counter(), time.process_time()
    scene = segue.Scene()
    build(scene)
    scene.add_light("sky", {"type": "dome", "radiance": [1, 1, 1]})
    scene.set_camera("camera", CAMERA)
    added = time.perf_counter()
    render = segue.Render(scene, {"resolution": [160, 90], "samples": 1})
    built = time.perf_counter()
    render.run()
    done, cpu = time.perf_counter(), time.process_time() - cpu
    assert render.read_pass("Combined").mean() > 0
    memory = render.stats()["peak_memory_bytes"] / 2**20
    print(
        f"{name}: {done - start:.2f} s to the first pixels, {cpu:.2f} s of CPU time (scene {added - start:.2f}, "
        f"build {built - added:.2f}, one sample {done - built:.2f}), peak {memory:.0f} MiB"
    )


def million_triangles(scene: segue.Scene) -> None:
    """One mesh of a million triangles."""
    points, corners = heightfield(708)
    mesh = scene.add_mesh("field", points, corners.ravel())
    scene.add_instances("field", mesh, np.eye(4)[None])


def million_instances(scene: segue.Scene) -> None:
    """A million instances of a small mesh, all over a cube."""
    points, corners = heightfield(8)
    mesh = scene.add_mesh("leaf", points, corners.ravel())
    random = np.random.default_rng(1)
    transforms = np.tile(np.eye(4) * 0.01, (1_000_000, 1, 1))
    transforms[:, :3, 3] = random.uniform(-1, 1, (len(transforms), 3))
    transforms[:, 3, 3] = 1
    scene.add_instances("leaves", mesh, transforms)


if __name__ == "__main__":
    first_pixels("a million triangles", million_triangles)
    first_pixels("a million instances", million_instances)
