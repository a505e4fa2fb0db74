"""How far the scene reaches."""

from __future__ import annotations

import numpy as np


class Extent:
    """Spheres around the instances of a scene, world space."""

    def __init__(self) -> None:
        self._centers = [np.empty((0, 3))]
        self._radii = [np.empty(0)]

    def add(self, box: np.ndarray, transforms: np.ndarray) -> None:
        """Add instances of a mesh: its box as (2, 3), and (n, 4, 4) matrices."""
        center = box.mean(axis=0)
        radius = 0.5 * np.linalg.norm(box[1] - box[0])
        self._centers.append(transforms[:, :3, :3] @ center + transforms[:, :3, 3])
        # No direction is stretched by more than the Frobenius norm.
        stretch = np.linalg.norm(transforms[:, :3, :3], axis=(1, 2))
        self._radii.append(radius * stretch)

    def farthest(self, origin: np.ndarray, direction: np.ndarray) -> float:
        """An upper bound of the depth of any surface along `direction` (a unit vector)."""
        depths = (np.concatenate(self._centers) - origin) @ direction
        return float(np.max(depths + np.concatenate(self._radii), initial=0.0))
