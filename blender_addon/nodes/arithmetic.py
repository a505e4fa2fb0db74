"""Arithmetic on values: on the texels of one picture, or on what is read of one attribute.

On images it is exact but for the order of filtering and arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .values import (
    AttributeValue,
    Baked,
    Composed,
    Constant,
    ImageSource,
    ImageValue,
    Kind,
    PatternValue,
    PlaceValue,
    UnsupportedError,
    Value,
    bounds,
    grey,
)

# Readings of a mesh attribute by which arithmetic on it is judged: four of them fix an affine
# function, and the others tell whether it is one, also beyond 0 and 1.
_READINGS = np.array(
    [
        *([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]),
        *([0.5, 0.25, 0.75], [-1, 0.5, 2], [3, -2, 0.1], [0.2, 4, -3], [-5, -4, -3], [6, 7, 8]),
    ]
)


def array(value: Value) -> np.ndarray:
    """A value as (height, width, 1 or 3) floats; constants have size 1 by 1."""
    if isinstance(value, Constant):
        width = 1 if value.kind == "float" else 3
        return np.array(value.rgb[:width], np.float32).reshape(1, 1, width)
    if isinstance(value, AttributeValue):
        raise UnsupportedError("arithmetic on a mesh attribute")
    if isinstance(value, PlaceValue | PatternValue | Composed):
        raise UnsupportedError("arithmetic on several textures")
    if value.sampling.space == "colored noise":
        raise UnsupportedError("arithmetic on coloured noise")
    texels = value.source.texels()
    if value.gain != 1.0:
        texels = texels * np.float32(value.gain)
    return _channel(texels, value)


def _channel(texels: np.ndarray, value: ImageValue | AttributeValue | Composed) -> np.ndarray:
    """What a value takes of its texels."""
    if value.channel == "rgb":
        return texels[..., :3]
    if value.channel in "rgba":
        result = texels[..., ["rgba".index(value.channel)]]
    else:
        result = grey(texels[..., :3], "color" if value.channel == "luminance" else "vector")
    return result if value.kind == "float" else np.repeat(result, 3, axis=2)


def average(value: Value) -> Constant:
    """The mean of a value, as a constant."""
    if isinstance(value, Constant):
        return value
    if isinstance(value, AttributeValue):
        return Constant((1.0, 1.0, 1.0), value.kind)
    if isinstance(value, PlaceValue | PatternValue):
        return Constant((float(np.mean(bounds(value))),) * 3, value.kind)
    if isinstance(value, Composed):
        return _average_of_composed(value)
    if value.sampling.space == "colored noise":
        return Constant((float(np.mean(bounds(value))),) * 3, value.kind)
    mean = array(value).mean(axis=(0, 1))
    if value.kind == "float":
        return Constant.number(mean[0])
    return replace(Constant.color(mean), kind=value.kind)


def products(values: list[np.ndarray]) -> list[np.ndarray]:
    """The products of all subsets of values, in the order of `Composed`'s coefficients."""
    ones = np.ones_like(values[0])
    return [
        np.prod([ones, *(v for i, v in enumerate(values) if subset >> i & 1)], axis=0)
        for subset in range(1 << len(values))
    ]


def _average_of_composed(value: Composed) -> Constant:
    """A sum of products by its values' averages; of a table the mean of all entries."""
    means = [np.array(average(of).rgb) for of in value.of]
    if value.coefficients is not None:
        found = (value.coefficients * products(means)).sum(axis=0)
    else:
        assert value.table is not None
        found = value.table.values.mean(axis=(0, 1))
    numbers = _channel(found[None, None], value)[0, 0]
    if value.kind == "float":
        return Constant.number(numbers[0])
    return replace(Constant.color(numbers), kind=value.kind)


def pick(source: ImageSource, u: float, v: float, texture_filter: str) -> Constant:
    """The colour of a repeated picture at one point, (0, 0) at the bottom left."""
    texels = source.texels()[::-1, :, :3]
    height, width = texels.shape[:2]
    x, y = u * width, v * height
    if texture_filter == "closest":
        return Constant.color(texels[int(np.floor(y)) % height, int(np.floor(x)) % width])
    x, y = x - 0.5, y - 0.5
    left, bottom = int(np.floor(x)), int(np.floor(y))
    columns, rows = [left % width, (left + 1) % width], [bottom % height, (bottom + 1) % height]
    across, up = np.array([left + 1 - x, x - left]), np.array([bottom + 1 - y, y - bottom])
    return Constant.color(np.einsum("y,x,yxc", up, across, texels[np.ix_(rows, columns)]))


def _affine(
    kind: Kind, function: Callable[..., np.ndarray], values: tuple[Value, ...]
) -> AttributeValue:
    """Apply `function` to one attribute and constants, where that scales and shifts the attribute.

    Only then is it the same whether the values are computed before their interpolation or after.
    """
    attributes = [value for value in values if isinstance(value, AttributeValue)]
    first = attributes[0]
    if any(
        not isinstance(value, Constant | AttributeValue) or getattr(value, "channel", "") == "a"
        for value in values
    ):
        raise UnsupportedError("arithmetic on a mesh attribute")
    if any((other.name, other.factor) != (first.name, first.factor) for other in attributes):
        raise UnsupportedError("arithmetic on several mesh attributes")
    readings = np.pad(_READINGS, ((0, 0), (0, 1)), constant_values=1.0)
    with np.errstate(all="ignore"):
        found = function(
            *(
                _channel((readings @ value.matrix.T)[None], value)
                if isinstance(value, AttributeValue)
                else array(value)
                for value in values
            )
        )
    found = np.broadcast_to(np.asarray(found, np.float64), (1, len(readings), 3))[0]
    matrix = np.column_stack([*(found[1:4] - found[0]), found[0]])
    if not np.allclose(readings @ matrix.T, found, rtol=1e-4, atol=1e-5):
        raise UnsupportedError("arithmetic on a mesh attribute that does more than scale and shift")
    channel = "r" if kind == "float" else "rgb"
    return replace(
        first, kind=kind, channel=channel, affine=tuple(float(entry) for entry in matrix.ravel())
    )


def combine(name: str, kind: Kind, function: Callable[..., np.ndarray], *values: Value) -> Value:
    """Apply `function` to the arrays of `values`: to one number, or to every texel.

    Images must be looked up alike and have one size, since no other image could hold the result.
    """
    if any(isinstance(value, AttributeValue) for value in values):
        return _affine(kind, function, values)
    images = [value for value in values if isinstance(value, ImageValue)]
    if any(image.sampling != images[0].sampling for image in images):
        raise UnsupportedError("images with different mappings")
    arrays = [array(value) for value in values]
    sizes = {values.shape[:2] for values in arrays} - {(1, 1)}
    if len(sizes) > 1:
        raise UnsupportedError("images of different sizes")
    with np.errstate(all="ignore"):
        result = np.nan_to_num(
            np.asarray(function(*arrays), np.float32), nan=0.0, posinf=0.0, neginf=0.0
        )
    if not images:
        flat = result.ravel()
        return (
            Constant.number(flat[0])
            if kind == "float"
            else replace(Constant.color(flat), kind=kind)
        )
    channel = "r" if kind == "float" else "rgb"
    return ImageValue(Baked(name, result), images[0].sampling, kind, channel)
