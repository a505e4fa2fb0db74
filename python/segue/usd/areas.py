"""World-space areas of lights' shapes under any affine transformation."""

from __future__ import annotations

import math

import numpy as np

#: Gauss-Legendre points along, and points around, for areas of stretched shapes.
_ALONG, _AROUND = 64, 256


def rect_area(width: float, height: float, matrix: np.ndarray) -> float:
    """World-space area of a rectangle in the local XY plane."""
    return float(np.linalg.norm(np.cross(matrix[:3, 0] * width, matrix[:3, 1] * height)))


def disk_area(radius: float, matrix: np.ndarray) -> float:
    """World-space area of a disk in the local XY plane; stretched, it is an ellipse."""
    return math.pi * radius**2 * rect_area(1.0, 1.0, matrix)


def sphere_area(radius: float, matrix: np.ndarray) -> float:
    """World-space area of a sphere; stretched, it is an ellipsoid.

    A patch dA with normal n becomes |det M| |M^-T n| dA (Nanson), integrated over the sphere.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_ALONG)
    angles = np.arange(_AROUND) * (2 * math.pi / _AROUND)
    ring = np.sqrt(1 - nodes**2)
    normals = np.stack(
        [
            ring[:, None] * np.cos(angles),
            ring[:, None] * np.sin(angles),
            np.broadcast_to(nodes[:, None], (_ALONG, _AROUND)),
        ],
        axis=-1,
    )
    linear = matrix[:3, :3]
    stretch = np.linalg.norm(normals @ _cofactor(linear).T, axis=-1).mean(axis=1)
    return float(2 * math.pi * radius**2 * (weights * stretch).sum())


def cylinder_area(radius: float, length: float, matrix: np.ndarray) -> float:
    """World-space area of a cylinder around local X, without its caps."""
    angles = np.arange(_AROUND) * (2 * math.pi / _AROUND)
    tangents = np.stack([np.zeros(_AROUND), -np.sin(angles), np.cos(angles)], axis=-1)
    linear = matrix[:3, :3]
    patches = np.cross(linear[:, 0], tangents @ linear.T)
    return float(2 * math.pi * radius * length * np.linalg.norm(patches, axis=1).mean())


def _cofactor(linear: np.ndarray) -> np.ndarray:
    """The matrix that turns area vectors: its columns are the cross products of the others."""
    x, y, z = linear.T
    return np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=-1)
