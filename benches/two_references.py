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


def relative(squares: np.ndarray, mean: np.ndarray) -> float:
    """Mean of squared errors over squared local means of a picture."""
    return float((squares / (smooth(mean) ** 2 + (0.01 * mean.mean()) ** 2)).mean())


def relative_error(picture: np.ndarray, first: np.ndarray, second: np.ndarray) -> float:
    """Relative mean squared error: squares are products of the differences from both references."""
    squares = (picture - first) * (picture - second)
    return relative(squares, (first + second) / 2)


def relative_noise(a: np.ndarray, b: np.ndarray, mean: np.ndarray) -> float:
    """Variance of each of two pictures that differ by noise alone, relative to what they ought to show: their own
    mean has their specks in it, and would excuse them."""
    return relative((a - b) ** 2 / 2, mean)
