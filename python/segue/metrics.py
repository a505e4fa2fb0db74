"""Errors of a picture against a reference, both linear RGB.

All are means over pixels and channels, in double precision, of a picture's values x and a
reference's values r; m is the mean of |r|. The 1 % of m in the denominators keeps dark pixels from
deciding. The definitions are those by which papers on light transport compare methods:

    mape:   |x - r| / (|r| + 0.01 m)                 mean absolute percentage error
    relmse: (x - r)^2 / (r^2 + (0.01 m)^2)           relative mean squared error
    smape:  2 |x - r| / (|x| + |r| + 0.01 m)         symmetric mean absolute percentage error
    mse:    (x - r)^2                                mean squared error

Radiance is not negative, so |r| is r; a filter with negative lobes may make it otherwise.
"""

from __future__ import annotations

import numpy as np

#: The names, in the order in which they are printed.
METRICS = ("mape", "relmse", "smape", "mse")

#: Share of the reference's mean that is added to denominators.
FLOOR = 0.01


def errors(picture: np.ndarray, reference: np.ndarray) -> dict[str, float]:
    """The metrics of `METRICS`.

    Where the reference is black everywhere, the relative metrics are 0 for a black picture and
    infinite for others.

    Raises:
        ValueError: the pictures differ in size, or one has values that are not finite.
    """
    x, r = _checked(picture, reference)
    floor = FLOOR * np.abs(r).mean()
    difference = np.abs(x - r)
    square = difference**2
    return {
        "mape": float(_ratio(difference, np.abs(r) + floor).mean()),
        "relmse": float(_ratio(square, r**2 + floor**2).mean()),
        "smape": float(_ratio(2 * difference, np.abs(x) + np.abs(r) + floor).mean()),
        "mse": float(square.mean()),
    }


def error_map(picture: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """(h, w): what each pixel adds to `mape`, whose mean is the metric.

    Raises:
        ValueError: as `errors`.
    """
    x, r = _checked(picture, reference)
    return _ratio(np.abs(x - r), np.abs(r) + FLOOR * np.abs(r).mean()).mean(axis=-1)


def relative_variance(variance: np.ndarray, mean: np.ndarray) -> float:
    """`relmse` that a picture of this variance and mean is expected to have."""
    m = np.asarray(mean, np.float64)
    floor = FLOOR * np.abs(m).mean()
    return float(_ratio(np.asarray(variance, np.float64), m**2 + floor**2).mean())


def difference_of_means(picture: np.ndarray, reference: np.ndarray) -> float:
    """The picture's mean over the reference's, less 1: what is too bright (+) or missing (-).

    Noise averages out of it, so that bias shows; 0 where both are black.

    Raises:
        ValueError: as `errors`.
    """
    x, r = _checked(picture, reference)
    mean = r.mean()
    difference = x.mean() - mean
    if mean:
        return float(difference / mean)
    return 0.0 if difference == 0 else float(np.copysign(np.inf, difference))


def not_finite(picture: np.ndarray) -> int:
    """How many values are NaN or infinite."""
    return int((~np.isfinite(picture)).sum())


def _checked(picture: np.ndarray, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    if picture.shape != reference.shape:
        raise ValueError(
            f"the pictures differ in size: {_size(picture)} against {_size(reference)}"
        )
    for name, values in (("picture", picture), ("reference", reference)):
        bad = not_finite(values)
        if bad:
            raise ValueError(f"the {name} has {bad} values that are NaN or not finite")
    return np.asarray(picture, np.float64), np.asarray(reference, np.float64)


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    # A black reference has no relative error where the picture is black too.
    zero = denominator == 0
    ratio = np.divide(numerator, denominator, where=~zero, out=np.zeros_like(numerator))
    ratio[zero & (numerator > 0)] = np.inf
    return ratio


def _size(picture: np.ndarray) -> str:
    return " x ".join(str(n) for n in (picture.shape[1], picture.shape[0], *picture.shape[2:]))
