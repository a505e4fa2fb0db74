"""Values on their way through a node tree: constants, images, mesh attributes, functions of these.

A value is a float, a colour or a vector; sockets convert between these as Blender's do. Arithmetic
on images is done on their texels, which is exact but for the order of filtering and arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

if TYPE_CHECKING:
    from .coordinates import Coordinates

Kind = Literal["float", "color", "vector"]

# Blender's socket types; all others carry no value that a shader uses.
KINDS: dict[str, Kind] = {
    "VALUE": "float",
    "INT": "float",
    "BOOLEAN": "float",
    "RGBA": "color",
    "VECTOR": "vector",
}

# Luminance of linear Rec.709.
_LUMINANCE = np.array([0.2126390, 0.7151687, 0.0721923], np.float32)


_IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)

# Readings of a mesh attribute by which arithmetic on it is judged: four of them fix an affine
# function, and the others tell whether it is one, also beyond 0 and 1.
_READINGS = np.array(
    [
        *([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]),
        *([0.5, 0.25, 0.75], [-1, 0.5, 2], [3, -2, 0.1], [0.2, 4, -3], [-5, -4, -3], [6, 7, 8]),
    ]
)


class UnsupportedError(Exception):
    """A combination of values that cannot be expressed; the text says which."""


class ImageSource(Protocol):
    """Pixels that can become an image of the scene."""

    name: str

    def texels(self) -> np.ndarray:
        """(height, width, 4) float32, linear, row 0 on top."""

    def reach(self) -> tuple[float, float]:
        """The smallest and the largest number among the texels, as they are stored."""


@dataclass(frozen=True)
class Constant:
    """The same value everywhere."""

    rgb: tuple[float, float, float]
    kind: Kind

    @staticmethod
    def number(value: float) -> Constant:
        """A float."""
        return Constant((float(value),) * 3, "float")

    @staticmethod
    def color(values: object) -> Constant:
        """A colour, from a sequence of at least three numbers."""
        r, g, b = tuple(values)[:3]  # type: ignore[call-overload]
        return Constant((float(r), float(g), float(b)), "color")

    @staticmethod
    def vector(values: object) -> Constant:
        """A vector, from a sequence of at least three numbers."""
        return replace(Constant.color(values), kind="vector")


@dataclass(frozen=True)
class Sampling:
    """How an image is looked up.

    `matrix`: for "uv" the six numbers of the ABI's texture transform, for "environment" the nine of
    a 3x3 matrix applied to the direction, for noise what its strength depends on; then `uv` is the
    attribute that says where, and each component of "colored noise" has its own. `at`: what stands
    for the UV map or the attribute instead.
    """

    space: Literal["uv", "environment", "noise", "colored noise"]
    matrix: tuple[float, ...]
    uv: str = ""
    wrap: str = "repeat"
    filter: str = "linear"
    at: Value | None = None


@dataclass(frozen=True, eq=False)
class ImageValue:
    """An image times `gain`; `channel` is one of the ABI's, and "rgb" for colours and vectors."""

    source: ImageSource
    sampling: Sampling
    kind: Kind = "color"
    channel: str = "rgb"
    gain: float = 1.0


@dataclass(frozen=True)
class AttributeValue:
    """An attribute of the mesh, such as vertex colours; with `factor` as one number.

    How many components become that number, each mesh knows for itself. `affine`: the three rows of
    a 3x4 matrix that is applied to what is read.
    """

    name: str
    kind: Kind = "color"
    channel: str = "rgb"
    factor: bool = False
    affine: tuple[float, ...] = _IDENTITY

    @property
    def matrix(self) -> np.ndarray:
        """`affine` as an array of three rows."""
        return np.array(self.affine).reshape(3, 4)


@dataclass(frozen=True, eq=False)
class PlaceValue:
    """Texture coordinates as three numbers."""

    place: Coordinates
    kind: Kind = "vector"
    channel: str = "rgb"


@dataclass(frozen=True, eq=False)
class PatternValue:
    """A pattern that is computed where it is looked up: keys of the ABI's texture but `place`.

    `place`: an attribute or a value. `reach`: between what the pattern stays.
    """

    name: str
    data: dict[str, Any]
    place: str | Value
    reach: tuple[float, float]
    kind: Kind
    channel: str


@dataclass(frozen=True, eq=False)
class Composed:
    """A function of other values, none of them constant, component by component.

    Either `coefficients`, a factor (3) for the product of every subset of them, where bit `i` of
    its number tells whether value `i` is in it; or a `table` over their `domain`, in the order of
    the ABI. `reach`: between what the function stays.
    """

    name: str
    of: tuple[Value, ...]
    kind: Kind
    channel: str
    reach: tuple[float, float]
    coefficients: np.ndarray | None = None
    table: Baked | None = None
    domain: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        if self.lookups > _MOST_LOOKUPS:
            raise UnsupportedError(f"a mix of {self.lookups} textures")

    @property
    def lookups(self) -> int:
        """How many textures are looked up for it, itself included."""
        return 1 + sum(map(lookups, self.of))


#: What is not the same everywhere.
Texture = ImageValue | AttributeValue | PlaceValue | PatternValue | Composed
Value = Constant | Texture

# What the ABI allows.
_MOST_LOOKUPS = 256

# Between which numbers coordinates are expected that have no bounds of their own.
_FAR = 16.0


def lookups(value: Value) -> int:
    """How many textures are looked up for a value."""
    if isinstance(value, Composed):
        return value.lookups
    if isinstance(value, ImageValue) and value.sampling.at is not None:
        return 1 + lookups(value.sampling.at)
    if isinstance(value, PatternValue) and not isinstance(value.place, str):
        return 1 + lookups(value.place)
    return 1


@dataclass(eq=False)
class Baked:
    """An image that was computed from others. `values`: (height, width, 1 or 3), linear.

    It has no alpha channel of its own: values that came from one are ordinary numbers here.
    """

    name: str
    values: np.ndarray = field(repr=False)

    def texels(self) -> np.ndarray:
        """See `ImageSource`."""
        height, width, channels = self.values.shape
        result = np.ones((height, width, 4), np.float32)
        result[..., :3] = self.values if channels == 3 else np.repeat(self.values, 3, axis=2)
        return result

    def reach(self) -> tuple[float, float]:
        """See `ImageSource`."""
        return float(self.values.min()), float(self.values.max())


def convert(value: Value, kind: Kind) -> Value:
    """What a socket of another kind makes of a value."""
    if value.kind == kind:
        return value
    if isinstance(value, Constant):
        if kind != "float":
            return replace(value, kind=kind)
        return Constant.number(_grey(np.array(value.rgb), value.kind)[0])
    if kind == "float" and value.channel == "rgb":
        return replace(
            value, kind=kind, channel="luminance" if value.kind == "color" else "average"
        )
    return replace(value, kind=kind)


def _grey(rgb: np.ndarray, kind: Kind) -> np.ndarray:
    """Colours become their luminance, vectors their mean; the last axis shrinks to one."""
    if kind == "color":
        return (rgb @ _LUMINANCE.astype(rgb.dtype))[..., None]
    return rgb.mean(axis=-1, keepdims=True)


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
        result = _grey(texels[..., :3], "color" if value.channel == "luminance" else "vector")
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


def _average_of_composed(value: Composed) -> Constant:
    """A sum of products by its values' averages; of a table the mean of all entries."""
    means = [np.array(average(of).rgb) for of in value.of]
    if value.coefficients is not None:
        products = [
            np.prod([np.ones(3), *(m for i, m in enumerate(means) if subset >> i & 1)], axis=0)
            for subset in range(len(value.coefficients))
        ]
        found = (value.coefficients * products).sum(axis=0)
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


def bounds(value: Value) -> tuple[float, float]:
    """Between which numbers a value stays. Attributes of meshes are taken to be colours."""
    if isinstance(value, Constant):
        return min(value.rgb), max(value.rgb)
    if isinstance(value, AttributeValue):
        return 0.0, 1.0
    if isinstance(value, PlaceValue):
        return (0.0, 1.0) if value.place.space == "generated" else (-_FAR, _FAR)
    if isinstance(value, PatternValue | Composed):
        return value.reach
    ends = [value.gain * end for end in value.source.reach()]
    return min(ends), max(ends)


def component(value: Texture, index: int) -> Value:
    """A component of a colour or vector."""
    channel = "rgb"[index] if value.channel == "rgb" else value.channel
    return replace(value, kind="float", channel=channel)


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
