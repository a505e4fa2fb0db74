"""Images and attributes as the ABI's images and textures, each added once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np

from ..export.images import Pixels, read_image
from ..export.mesh import Projection, Reading
from ..log import ExportLog
from .coordinates import AS_IT_IS
from .values import (
    AttributeValue,
    Baked,
    Composed,
    Constant,
    Coordinates,
    ImageSource,
    ImageValue,
    Kind,
    PatternValue,
    PlaceValue,
    Texture,
    UnsupportedError,
    Value,
)

#: What the numbers of a picture that is looked up by noise are.
NOISE = ("detail", "roughness", "lacunarity", "distortion")


class BlenderSource:
    """An image of the .blend file as a node shows it, read when it is first needed."""

    def __init__(
        self,
        image: bpy.types.Image,
        user: bpy.types.ImageUser,
        straight_alpha: bool,
        log: ExportLog,
    ) -> None:
        self.name = image.name
        self._image = image
        self._user = user
        self._straight = straight_alpha
        self._log = log
        self._pixels: Pixels | None = None
        self._reach: tuple[float, float] | None = None

    def pixels(self) -> Pixels:
        """The pixels as Blender stores them; magenta for an image that cannot be read."""
        if self._pixels is None:
            self._pixels = read_image(
                self._image, self._user, self._log, straight_alpha=self._straight
            )
        if self._pixels is None:
            self._log.warn(f"Image '{self.name}': it cannot be read, magenta is used")
            self._pixels = Pixels(np.array([[[1.0, 0.0, 1.0]]], np.float32), "linear")
        return self._pixels

    def texels(self) -> np.ndarray:
        """See `ImageSource`."""
        return self.pixels().linear()

    def reach(self) -> tuple[float, float]:
        """See `ImageSource`."""
        if self._reach is None:
            values = self.pixels().values
            most = 255.0 if values.dtype == np.uint8 else 1.0
            self._reach = float(values.min()) / most, float(values.max()) / most
        return self._reach


class TextureStore:
    """Adds images and textures to the scene, and remembers which are there."""

    def __init__(self, scene: Any, log: ExportLog) -> None:
        self._scene = scene
        self._log = log
        self._sources: dict[tuple[int, str, bool], BlenderSource] = {}
        self._images: dict[int, tuple[ImageSource, int]] = {}
        self._textures: dict[str, int] = {}
        #: How far meshes reach from their origins, and from that of the scene.
        self.extent = self.reach = 1.0
        # Attributes of meshes that are read as UV maps, and what is read of others, by the names
        # that the scene knows it by.
        self.uvs: set[str] = set()
        self.readings: dict[str, Reading] = {}
        # Attributes that are made of where the points of meshes are.
        self.projections: dict[str, Projection] = {}
        # Those that were asked for since this was last cleared.
        self.asked: set[str] = set()

    def source(
        self, image: bpy.types.Image, user: bpy.types.ImageUser, straight_alpha: bool
    ) -> BlenderSource:
        """The source for what a node shows of an image, one for each treatment of its alpha."""
        path = image.filepath_from_user(image_user=user) if image.source == "SEQUENCE" else ""
        key = (image.as_pointer(), path, straight_alpha)
        if key not in self._sources:
            self._sources[key] = BlenderSource(image, user, straight_alpha, self._log)
        return self._sources[key]

    def place(
        self, place: Coordinates, *, in_layers: bool = False
    ) -> tuple[str, tuple[float, ...]]:
        """The UV map and the transform by which a flat picture is looked up.

        With `in_layers` the picture is moved by half of it in every other layer of height 0.5.
        """
        if place.space == "uv":
            depth = place.matrix[2]
            if in_layers and depth[:2].any():
                raise UnsupportedError("a pattern that is tilted against its UV map")
            shift = 0.5 * (np.floor(2.0 * depth[3]) % 2) if in_layers else 0.0
            transform = place.uv_transform()
            return place.uv, (*transform[:2], transform[2] + shift, *transform[3:])
        return self._projected(place, 2, in_layers), AS_IT_IS

    def solid(self, place: Coordinates) -> str:
        """The attribute that holds three coordinates."""
        return self._projected(place, 3)

    def _projected(self, place: Coordinates, width: int, in_layers: bool = False) -> str:
        rows = tuple(float(value) for value in place.matrix[:3].ravel())
        projection = Projection(place.space, place.uv, rows, width, in_layers)
        known = next((n for n, other in self.projections.items() if other == projection), None)
        name = known or f"{projection.space} ({len(self.projections) + 1})"
        self.projections[name] = projection
        self.asked.add(name)
        return name

    def image(self, source: ImageSource) -> int:
        """Id of a source's image in the scene."""
        # The source is kept along with the id, so that its identity stays taken.
        if id(source) not in self._images:
            if isinstance(source, BlenderSource):
                pixels = source.pixels()
                values, colorspace = pixels.values, pixels.colorspace
            else:
                values, colorspace = source.texels()[..., :3], "linear"
            identifier = self._scene.add_image(source.name, values, colorspace)
            self._images[id(source)] = (source, identifier)
        return self._images[id(source)][1]

    def texture(
        self,
        value: Texture,
        scale: Sequence[float] = (1.0, 1.0, 1.0),
        bias: Sequence[float] = (0.0, 0.0, 0.0),
    ) -> int:
        """Id of the texture that yields `scale * value + bias`.

        Attributes, places and patterns are never scaled.
        """
        data: dict[str, Any]
        if isinstance(value, PlaceValue) and value.place.is_geometry:
            name = value.place.space
            data = _geometry(value.place)
        elif isinstance(value, PlaceValue):
            name = self.solid(value.place)
            data = {"type": "attribute", "name": name, "default": [0.0, 0.0, 0.0, 1.0]}
        elif isinstance(value, PatternValue):
            name = value.name
            inputs = {
                key: of if isinstance(of, str) else self.json(of, of.kind)
                for key, of in value.inputs.items()
            }
            data = value.data | inputs
        elif isinstance(value, AttributeValue):
            name = self._reading(value)
            default = [*value.matrix[:, 3].tolist(), 1.0]
            data = {"type": "attribute", "name": name, "default": default}
        elif isinstance(value, Composed):
            name = value.name
            data = self._composed(value, np.array(scale), np.array(bias))
        else:
            name = value.source.name
            data = self._picture(value)
            data["scale"] = [*(factor * value.gain for factor in scale), 1.0]
            data["bias"] = [*bias, 0.0]
        key = json.dumps(data, sort_keys=True)
        if key not in self._textures:
            self._textures[key] = self._scene.add_texture(name, data)
        return self._textures[key]

    def _picture(self, value: ImageValue) -> dict[str, Any]:
        """A picture that is looked up by coordinates or by noise, as it is."""
        sampling = value.sampling
        data: dict[str, Any] = {"image": self.image(value.source)}
        if sampling.space in {"noise", "colored noise"}:
            data |= zip(NOISE, sampling.matrix, strict=True)
            data["place"] = self.json(sampling.at, "vector") if sampling.at else sampling.uv
            return data | {"type": "noise", "colored": sampling.space == "colored noise"}
        if sampling.at:
            data["at"] = self.json(sampling.at, "vector")
            data["projection"] = sampling.projection
        elif sampling.uv:
            self.uvs.add(sampling.uv)
        return data | {
            "type": "image",
            "uv": sampling.uv,
            "transform": list(sampling.matrix),
            "wrap_s": sampling.wrap,
            "wrap_t": sampling.wrap,
            "filter": sampling.filter,
        }

    def _composed(self, value: Composed, scale: np.ndarray, bias: np.ndarray) -> dict[str, Any]:
        """A function of other textures."""
        of = [self.json(other, other.kind) for other in value.of]
        if value.coefficients is not None:
            coefficients = value.coefficients * scale
            coefficients[0] += bias
            return {"type": "multilinear", "of": of, "coefficients": coefficients.tolist()}
        assert value.table is not None
        table = value.table
        if (scale != 1.0).any() or bias.any():
            table = Baked(table.name, (table.values * scale + bias).astype(np.float32))
        domain = [list(ends) for ends in value.domain]
        return {"type": "table", "of": of, "domain": domain, "image": self.image(table)}

    def _reading(self, value: AttributeValue) -> str:
        """The scene's name for what is read of an attribute."""
        reading = Reading(value.name, value.factor, value.affine)
        for name, known in self.readings.items():
            if known == reading:
                return name
        plain = value.affine == AttributeValue.affine and not value.factor
        name = value.name if plain else f"{value.name} ({len(self.readings) + 1})"
        self.readings[name] = reading
        return name

    def json(self, value: Value, kind: Kind) -> Any:
        """A value as the ABI writes it, for a key that takes a number or a colour."""
        if isinstance(value, Constant):
            return value.rgb[0] if kind == "float" else list(value.rgb)
        return {"texture": self.texture(value), "channel": value.channel}


def _geometry(place: Coordinates) -> dict[str, Any]:
    """The ABI's texture of what the geometry has."""
    of = {"own normal": "normal", "face normal": "face_normal"}.get(place.space, place.space)
    rows = [float(number) for number in place.matrix[:3].ravel()]
    space = "object" if place.space == "own normal" else "world"
    return {"type": "geometry", "of": of, "space": space, "transform": rows}
