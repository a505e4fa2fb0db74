"""The box around what was imported."""

from __future__ import annotations

import numpy as np


class Bounds:
    """Grows with each shape; `low` is above `high` while there is none."""

    def __init__(self) -> None:
        self.low = np.full(3, np.inf)
        self.high = np.full(3, -np.inf)

    def add(self, low: np.ndarray, high: np.ndarray, transforms: np.ndarray) -> None:
        """Adds a box under each of (n, 4, 4) transformations."""
        linear = transforms[:, :3, :3]
        center = linear @ (0.5 * (low + high)) + transforms[:, :3, 3]
        half = np.abs(linear) @ (0.5 * (high - low))
        self.low = np.minimum(self.low, (center - half).min(axis=0))
        self.high = np.maximum(self.high, (center + half).max(axis=0))
