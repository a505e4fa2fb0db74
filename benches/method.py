"""The figures of docs/method.md: gain over path tracing at equal processor time, and the mean against the kernel's size.

Needs the scenes and references that are shared between renderers (SEGUE_SHARED, or ../shared beside the
checkout); without them it says so and does nothing. Run: .venv/bin/python benches/method.py table|consistency
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from segue import Render, images, metrics, usd

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared")) / "peers"
SCENES = ("cornell", "cornell_glass", "ajar_door", "glossy_box", "lamp", "furnace")
#: Relative noise of the references' means, as far as other renderers tell.
KNOWN_TO = {"ajar_door": 0.006, "lamp": 0.006}
SECONDS = 20.0
SIZES = (4.0, 2.0, 1.0, 0.5, 0.25)
SETS: dict[str, dict[str, Any]] = {
    "both": {},
    "camera": {"light_paths": 0},
    "camera, no next event": {"light_paths": 0, "next_event": False},
    "both, no next event": {"next_event": False},
    "light": {"camera_paths": False, "next_event": False},
    "light, next event": {"camera_paths": False},
}


def render(scene: Any, **settings: Any) -> tuple[np.ndarray, dict[str, Any]]:
    """A picture and its statistics."""
    job = Render(scene, settings)
    job.run()
    return job.read_pass("Combined")[..., :3], job.stats()


def load(name: str) -> tuple[Any, np.ndarray]:
    """A scene and its reference."""
    stage = usd.load(SHARED / "usd" / f"{name}.usda")
    return stage.scene, images.read_rgb(SHARED / "refs" / f"{name}.exr")


def table() -> None:
    """Markdown rows."""
    for name in SCENES:
        scene, reference = load(name)
        found = {}
        for method in ("path", "segment"):
            picture, stats = render(
                scene, integrator=method, resolution=[256, 256], time=SECONDS, threads=2
            )
            error = metrics.errors(picture, reference)["relmse"]
            found[method] = (stats["samples"], stats["cpu_seconds"], error, picture.mean())
        (n, cpu, error, _), (ns, cpu_s, error_s, mean) = found["path"], found["segment"]
        gain = error * cpu / (error_s * cpu_s)
        off = mean / reference.mean() - 1.0
        print(
            f"| {name} | {n:.0f} | {error:.4f} | {ns:.0f} | {error_s:.4f} | {gain:.1f} | {off:+.2%} |",
            flush=True,
        )


def consistency(seeds: int = 4, samples: int = 16) -> None:
    """Means by size of a fixed kernel, as JSON lines."""
    for name in SCENES:
        scene, reference = load(name)
        for what, techniques in SETS.items():
            for size in SIZES:
                means = []
                for seed in range(seeds):
                    picture, _ = render(
                        scene,
                        resolution=[128, 128],
                        samples=samples,
                        seed=seed,
                        kernel="fixed",
                        kernel_size=size,
                        **techniques,
                    )
                    means.append(float(picture.mean() / reference.mean()))
                row = {
                    "scene": name,
                    "techniques": what,
                    "kernel": size,
                    "mean": float(np.mean(means)),
                    "error": float(np.std(means, ddof=1) / seeds**0.5),
                }
                print(json.dumps(row), flush=True)


if __name__ == "__main__":
    if not (SHARED / "refs").is_dir():
        sys.exit(f"skipped: {SHARED} does not exist")
    {"table": table, "consistency": consistency}[sys.argv[1]]()
