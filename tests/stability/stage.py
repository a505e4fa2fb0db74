"""Small scenes for the stability suite, and what is measured of their pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import segue

Vector = Sequence[float]

DIFFUSE = {"type": "diffuse", "color": 0.5}
#: For pictures of few pixels, in which a kernel of the usual size is a large part of the scene.
SHARP = {"kernel": "fixed", "kernel_size": 0.5}


def look(eye: Vector, target: Vector) -> np.ndarray:
    """Camera to world for a camera at `eye` that looks at `target`."""
    back = np.subtract(eye, target).astype(float)
    back /= np.linalg.norm(back)
    up = [0.0, 1.0, 0.0] if abs(back[2]) > 0.9 else [0.0, 0.0, 1.0]
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = right, np.cross(back, right), back, eye
    return m


def icosphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a unit sphere, made finer `levels` times."""
    g = (1 + 5**0.5) / 2
    base = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    base += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    points = [np.array(p) / np.linalg.norm(p) for p in base]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11)]
    triangles += [(1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8)]
    triangles += [(3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9)]
    triangles += [(4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(levels):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                m = points[a] + points[b]
                points.append(m / np.linalg.norm(m))
                middles[key] = len(points) - 1
            return middles[key]

        finer = []
        for a, b, c in triangles:
            d, e, f = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, d, f), (b, e, d), (c, f, e), (d, e, f)]
        triangles = finer
    return np.array(points), np.array(triangles)


@dataclass
class Stage:
    """A scene whose units are multiplied by `scale` and which is moved by `shift`."""

    scale: float = 1.0
    #: Of what is added next, for messages.
    name: str = "object"
    shift: Vector = (0.0, 0.0, 0.0)
    scene: segue.Scene = field(default_factory=segue.Scene)

    def _world(self, m: np.ndarray) -> np.ndarray:
        """A transform, moved and scaled."""
        out = np.array(m, float)
        out[:3] *= self.scale
        out[:3, 3] += self.shift
        return out

    def material(self, surface: dict[str, Any], **more: Any) -> int:
        """Adds a material."""
        return self.scene.add_material(self.name, {"surface": surface, **more})

    def mesh(
        self,
        points: Any,
        triangles: Any,
        surface: dict[str, Any],
        at: Any = None,
        smooth: bool = False,
    ) -> None:
        """Adds triangles at a transform."""
        points = np.asarray(points, np.float32)
        normals = points if smooth else None
        mesh = self.scene.add_mesh(self.name, points, np.ravel(triangles), normals=normals)
        m = self._world(np.eye(4) if at is None else at)
        self.scene.add_instances(self.name, mesh, m, [self.material(surface)])

    def quad(self, corners: Any, surface: dict[str, Any]) -> None:
        """Adds a quadrilateral."""
        self.mesh(corners, [0, 1, 2, 0, 2, 3], surface)

    def floor(self, half: float, surface: dict[str, Any], height: float = 0.0) -> None:
        """Adds a horizontal square that faces +z."""
        a, z = half, height
        self.quad([[-a, -a, z], [a, -a, z], [a, a, z], [-a, a, z]], surface)

    def ball(self, surface: dict[str, Any], at: Vector, radius: float, levels: int = 4) -> None:
        """Adds a smooth ball."""
        m = np.diag([radius, radius, radius, 1.0])
        m[:3, 3] = at
        self.mesh(*icosphere(levels), surface, m, smooth=True)

    def light(self, kind: str, at: Any = None, **keys: Any) -> None:
        """Adds a light at a transform."""
        m = self._world(np.eye(4) if at is None else at)
        self.scene.add_light(self.name, {"type": kind, "transform": m.ravel().tolist(), **keys})

    def camera(self, eye: Vector, target: Vector, half: float, **keys: Any) -> None:
        """Sets a camera whose window is `half` to every side."""
        m = look(eye, target)
        m[:3, 3] = m[:3, 3] * self.scale + self.shift
        window = [-half, half, -half, half]
        if keys.get("type") == "orthographic":
            window = [w * self.scale for w in window]
        keys = {"transform": m.ravel().tolist(), "window": window, **keys}
        self.scene.set_camera("camera", keys)

    def render(self, side: int, samples: int, **settings: Any) -> tuple[np.ndarray, dict]:
        """A square picture and its statistics."""
        settings = {"resolution": [side, side], "samples": samples, **settings}
        job = segue.Render(self.scene, settings)
        job.run()
        return job.read_pass(settings.get("passes", ["Combined"])[0])[..., :3], job.stats()

    def means(self, side: int, samples: int, seeds: int, **settings: Any) -> Means:
        """Means of the picture over seeds."""
        found, refused = [], 0
        for seed in range(seeds):
            picture, stats = self.render(side, samples, seed=101 * seed, **settings)
            found.append(float(picture.astype(float).mean()))
            refused += stats["non_finite"] + stats["dropped"]
        return Means(np.array(found), refused)


@dataclass
class Means:
    """Means of pictures, one for every seed, and samples that were refused or dropped."""

    values: np.ndarray
    refused: int = 0

    @property
    def mean(self) -> float:
        """Their mean."""
        return float(self.values.mean())

    @property
    def error(self) -> float:
        """Its standard error."""
        n = len(self.values)
        return float(self.values.std(ddof=1) / n**0.5) if n > 1 else 0.0
