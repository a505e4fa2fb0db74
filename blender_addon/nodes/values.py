"""Values on their way through a node tree: constants, images, mesh attributes, functions of these.

A value is a float, a colour or a vector; sockets convert between these as Blender's do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol

import numpy as np

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


def scaling(factor: float) -> np.ndarray:
    """The 4x4 matrix that scales places."""
    return np.diag([factor, factor, factor, 1.0])


#: Spaces of unit vectors.
NORMALS = ("normal", "face normal", "own normal")


@dataclass(frozen=True)
class Coordinates:
    """`matrix` (4x4) times a UV map, times where a point of the mesh is, or times a direction.

    `space`: "uv"; "generated" or "object" (see `export.mesh.Projection`); "position", "normal" and
    "face normal" in the scene, and "own normal" in the space of the mesh; "environment".
    """

    space: str
    uv: str
    matrix: np.ndarray

    @property
    def is_geometry(self) -> bool:
        """Whether the engine takes them from the geometry, and not from attributes."""
        return self.space == "position" or self.space in NORMALS

    def by(self, matrix: np.ndarray) -> Coordinates:
        """A 4x4 matrix times these."""
        return replace(self, matrix=matrix @ self.matrix)

    def scaled(self, factor: float) -> Coordinates:
        """The same times a number."""
        return self.by(scaling(factor))

    def along(self, row: Sequence[float]) -> Coordinates:
        """`row` (4) times these, as the first coordinate; the others are constant."""
        rest = [[0.0, 0.0, 0.0, height] for height in (0.5, 0.0, 1.0)]
        return self.by(np.array([row, *rest]))

    def uv_transform(self) -> tuple[float, ...]:
        """The six numbers of the ABI's texture transform; UV maps have a third component of 0."""
        return tuple(float(value) for value in self.matrix[:2][:, [0, 1, 3]].ravel())

    def point(self) -> np.ndarray | None:
        """The point that all coordinates are mapped to; None if they differ."""
        return None if self.matrix[:3, :3].any() else self.matrix[:3, 3]

    def direction_matrix(self) -> tuple[float, ...]:
        """The nine numbers applied to a direction; one that is also shifted cannot be expressed."""
        if np.abs(self.matrix[:3, 3]).max() > 1e-6:
            raise UnsupportedError("a shifted environment")
        return tuple(float(value) for value in self.matrix[:3, :3].ravel())


@dataclass(frozen=True)
class Sampling:
    """How an image is looked up.

    `matrix`: for "uv" the six numbers of the ABI's texture transform, for "environment" the nine of
    a 3x3 matrix applied to the direction, for noise what its strength depends on; then `uv` is the
    attribute that says where, and each component of "colored noise" has its own. `at`: what stands
    for the UV map or the attribute instead. `projection`: the ABI's, of what is `at`.
    """

    space: Literal["uv", "environment", "noise", "colored noise"]
    matrix: tuple[float, ...]
    uv: str = ""
    wrap: str = "repeat"
    filter: str = "linear"
    at: Value | None = None
    projection: Any = "flat"


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
    a 3x4 matrix that is applied to what is read. `is_color`: what is read stays between 0 and 1.
    """

    name: str
    kind: Kind = "color"
    channel: str = "rgb"
    factor: bool = False
    affine: tuple[float, ...] = _IDENTITY
    is_color: bool = False

    @property
    def matrix(self) -> np.ndarray:
        """`affine` as an array of three rows."""
        return np.array(self.affine).reshape(3, 4)


@dataclass(frozen=True, eq=False)
class PlaceValue:
    """Texture coordinates as three numbers, from -`extent` to `extent` if not from 0 to 1."""

    place: Coordinates
    extent: float
    kind: Kind = "vector"
    channel: str = "rgb"


@dataclass(frozen=True, eq=False)
class PatternValue:
    """A pattern that is computed where it is looked up: keys of the ABI's texture.

    `inputs`: those among them that are values, or attributes by name. `reach`: between what the
    pattern stays.
    """

    name: str
    data: dict[str, Any]
    inputs: dict[str, str | Value]
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

# The ABI allows 256, of which what is looked up by a value takes some more.
_MOST_LOOKUPS = 192

#: How far from 0 attributes that are no colours, and UV maps, are expected.
FAR = 16.0


def lookups(value: Value) -> int:
    """How many textures are looked up for a value."""
    if isinstance(value, Composed):
        return value.lookups
    if isinstance(value, ImageValue) and value.sampling.at is not None:
        return 1 + lookups(value.sampling.at)
    if isinstance(value, PatternValue):
        return 1 + sum(lookups(of) for of in value.inputs.values() if not isinstance(of, str))
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


def grey(rgb: np.ndarray, kind: Kind) -> np.ndarray:
    """Colours become their luminance, vectors their mean; the last axis shrinks to one."""
    if kind == "color":
        return (rgb @ _LUMINANCE.astype(rgb.dtype))[..., None]
    return rgb.mean(axis=-1, keepdims=True)


def convert(value: Value, kind: Kind) -> Value:
    """What a socket of another kind makes of a value."""
    if value.kind == kind:
        return value
    if isinstance(value, Constant):
        if kind != "float":
            return replace(value, kind=kind)
        return Constant.number(grey(np.array(value.rgb), value.kind)[0])
    if kind == "float" and value.channel == "rgb":
        return replace(
            value, kind=kind, channel="luminance" if value.kind == "color" else "average"
        )
    return replace(value, kind=kind)


def bounds(value: Value) -> tuple[float, float]:
    """Between which numbers a value stays; of what meshes have, where it is expected."""
    if isinstance(value, Constant):
        return min(value.rgb), max(value.rgb)
    if isinstance(value, AttributeValue):
        return _mapped((0.0, 1.0) if value.is_color else (-FAR, FAR), value.matrix)
    if isinstance(value, PlaceValue):
        is_unit = value.place.space == "generated"
        ends = (0.0, 1.0) if is_unit else (-value.extent, value.extent)
        return _mapped(ends, value.place.matrix[:3])
    if isinstance(value, PatternValue | Composed):
        return value.reach
    ends = [value.gain * end for end in value.source.reach()]
    return min(ends), max(ends)


def _mapped(ends: tuple[float, float], matrix: np.ndarray) -> tuple[float, float]:
    """Between which numbers three rows of a 3x4 matrix bring three components."""
    low, high = ends
    middle = matrix @ [*[(low + high) / 2.0] * 3, 1.0]
    reach = np.abs(matrix[:, :3]).sum(axis=1) * (high - low) / 2.0
    return float((middle - reach).min()), float((middle + reach).max())


def is_negative(value: Value) -> bool:
    """Whether a value is below 0 somewhere; attributes of meshes are not taken to be."""
    return not _is_of_meshes(value) and bounds(value)[0] < 0.0


def _is_of_meshes(value: Value) -> bool:
    if isinstance(value, Composed):
        return any(map(_is_of_meshes, value.of))
    return isinstance(value, AttributeValue | PlaceValue)


def component(value: Value, index: int) -> Value:
    """A component of a colour or vector."""
    if isinstance(value, Constant):
        return Constant.number(value.rgb[index])
    channel = "rgb"[index] if value.channel == "rgb" else value.channel
    return replace(value, kind="float", channel=channel)
