"""A stand-in for the `segue` package that records what the add-on hands over.

It lets the export be checked without rendering. Its pictures are a gradient: red grows to the
right, green downwards, so that orientation and border can be seen.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np


class SegueError(RuntimeError):
    """Mirrors `segue.SegueError`."""


def error_text(report: dict[str, Any]) -> str:
    """Mirrors `segue.error_text`."""
    error = report.get("estimated_error")
    return "error -" if error is None else f"error {error}"


@dataclass
class Attribute:
    """Mirrors `segue.Attribute`."""

    name: str
    data: np.ndarray
    interpolation: str
    indices: np.ndarray | None = None


@dataclass
class Scene:
    """Records every call."""

    meshes: list[dict[str, Any]] = field(default_factory=list)
    images: list[dict[str, Any]] = field(default_factory=list)
    textures: list[tuple[str, dict]] = field(default_factory=list)
    materials: list[tuple[str, dict]] = field(default_factory=list)
    lights: list[tuple[str, dict]] = field(default_factory=list)
    instances: list[dict[str, Any]] = field(default_factory=list)
    camera: tuple[str, dict] | None = None

    def __post_init__(self) -> None:
        SCENES.append(self)

    def add_mesh(self, name: str, points: np.ndarray, face_indices: np.ndarray, **rest: Any) -> int:
        self.meshes.append(
            {"name": name, "points": points.copy(), "face_indices": face_indices.copy(), **rest}
        )
        return len(self.meshes) - 1

    def add_image(self, name: str, pixels: np.ndarray, colorspace: str = "srgb") -> int:
        self.images.append({"name": name, "pixels": pixels.copy(), "colorspace": colorspace})
        return len(self.images) - 1

    def add_texture(self, name: str, data: dict) -> int:
        self.textures.append((name, data))
        return len(self.textures) - 1

    def add_material(self, name: str, data: dict) -> int:
        self.materials.append((name, data))
        return len(self.materials) - 1

    def add_light(self, name: str, data: dict) -> int:
        self.lights.append((name, data))
        return len(self.lights) - 1

    def set_camera(self, name: str, data: dict) -> None:
        self.camera = (name, data)

    def add_instances(self, name: str, mesh: int, transforms: np.ndarray, **rest: Any) -> None:
        self.instances.append(
            {"name": name, "mesh": mesh, "transforms": np.array(transforms), **rest}
        )

    def info(self) -> dict[str, Any]:
        return {"warnings": [], "counts": {}}


# What the statistics of every render warn about; cases put texts here.
WARNINGS: list[str] = []

SCENES: list[Scene] = []
RENDERS: list[Render] = []

# The curve in the statistics of every render; cases put other ones here.
CURVE: list[dict[str, Any]] = [
    {"seconds": 0.1, "samples": 1.0, "estimated_error": None, "estimated_bias": None},
    {"seconds": 0.2, "samples": 2.0, "estimated_error": 0.2, "estimated_bias": 0.01},
    {"seconds": 0.4, "samples": 4.0, "estimated_error": 0.1, "estimated_bias": 0.02},
]

_CHANNELS = {"Combined": 4, "Depth": 1, "ObjectIndex": 1, "MaterialIndex": 1, "Alpha": 1}


class Render:
    """Renders the gradient in four tiles."""

    def __init__(self, scene: Scene, settings: dict[str, Any]) -> None:
        self.scene = scene
        self.settings = settings
        x0, y0, x1, y1 = settings["crop"]
        self.size = (x1 - x0, y1 - y0)
        self.cancelled = False
        RENDERS.append(self)

    def run(self, progress: Any = None, tile: Any = None) -> bool:
        width, height = self.size
        for step in range(4):
            state = {
                "fraction": step / 4,
                "seconds": 0.1 * step,
                "remaining": 0.4 - 0.1 * step,
                "samples": step,
                "estimated_error": 0.1,
                "stage": "sampling",
            }
            if progress(state):
                self.cancelled = True
                return False
            tile((step % 2) * (width // 2), (step // 2) * (height // 2), width // 2, height // 2)
        return True

    def read_pass(self, name: str, rect: tuple[int, int, int, int] | None = None) -> np.ndarray:
        channels = _CHANNELS.get(name, 3)
        x0, y0, _, _ = self.settings["crop"]
        x, y, width, height = rect or (0, 0, *self.size)
        result = np.zeros((height, width, channels), np.float32)
        result[..., 0] = (x0 + x + np.arange(width))[None, :]
        if channels > 1:
            result[..., 1] = (y0 + y + np.arange(height))[:, None]
        if channels == 4:
            result[..., 3] = 1.0
        return result

    def stats(self) -> dict[str, Any]:
        return {
            "samples": 4,
            "seconds": 0.4,
            "peak_memory_bytes": 2**20,
            "non_finite": 0,
            "estimated_error": CURVE[-1]["estimated_error"] if CURVE else None,
            "curve": list(CURVE),
            "warnings": list(WARNINGS),
        }
