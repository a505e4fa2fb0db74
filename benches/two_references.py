"""Errors that a reference's own noise is no part of: against two references whose noise is independent."""

from __future__ import annotations

import numpy as np

#: `segment` with a kernel whose blur is far below a pixel, and a seed that no measured picture has.
SHARP = {"kernel": "fixed", "kernel_size": 0.35, "seed": 2**30}


def smooth(picture: np.ndarray, radius: int = 2) -> np.ndarray:
    """Means over squares of pixels."""
    width = 2 * radius + 1
    padded = np.pad(picture, ((radius, radius), (radius, radius), (0, 0)), mode="edge")
    squares = np.lib.stride_tricks.sliding_window_view(
        padded, (width, width), axis=(0, 1)
    )
    return squares.mean(axis=(-2, -1))


def relative_error(picture: np.ndarray, first: np.ndarray, second: np.ndarray) -> float:
    """Relative mean squared error: the product of the differences from both references, over squared local means."""
    mean = (first + second) / 2
    scale = smooth(mean) ** 2 + (0.01 * mean.mean()) ** 2
    return float(((picture - first) * (picture - second) / scale).mean())
