"""Errors of a picture against a reference, both linear RGB.

All are means over pixels and channels; m is the mean of the reference. The 1 % of m in the
denominators keeps dark pixels from deciding.
"""

from __future__ import annotations

import numpy as np

#: The names, in the order in which they are printed.
METRICS = ("mape", "relmse", "smape", "mse")


def errors(picture: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """The metrics of `METRICS`; values of the picture that are not finite count as 0.

    mape: mean |x - r| / (r + 0.01 m)
    relmse: mean (x - r)^2 / (r^2 + (0.01 m)^2)
    smape: mean 2 |x - r| / (|x| + |r| + 0.01 m)
    mse: mean (x - r)^2

    Raises:
        ValueError: the pictures differ in size, or the reference is not finite.
    """
    if picture.shape != reference.shape:
        raise ValueError(
            f"the pictures differ in size: {_size(picture)} against {_size(reference)}"
        )
    r = np.asarray(reference, np.float64)
    x = np.asarray(picture, np.float64)
    if not np.isfinite(r).all():
        raise ValueError("the reference has values that are not finite")
    x = np.where(np.isfinite(x), x, 0.0)
    floor = 0.01 * r.mean()
    difference = np.abs(x - r)
    square = difference**2

    def mean_ratio(numerator: np.ndarray, denominator: np.ndarray) -> float:
        # A black reference has no relative error where the picture is black too.
        zero = denominator == 0
        ratio = np.divide(numerator, denominator, where=~zero, out=np.zeros_like(numerator))
        ratio[zero & (numerator > 0)] = np.inf
        return float(ratio.mean())

    return {
        "mape": mean_ratio(difference, r + floor),
        "relmse": mean_ratio(square, r**2 + floor**2),
        "smape": mean_ratio(2 * difference, np.abs(x) + np.abs(r) + floor),
        "mse": float(square.mean()),
    }


def not_finite(picture: np.ndarray) -> int:
    """How many values are NaN or infinite."""
    return int((~np.isfinite(picture)).sum())


def _size(picture: np.ndarray) -> str:
    return " x ".join(str(n) for n in (picture.shape[1], picture.shape[0], *picture.shape[2:]))
