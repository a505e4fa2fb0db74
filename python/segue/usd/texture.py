"""UsdUVTexture networks: images, coordinates and their transformations as textures of the ABI."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .. import images, tiles
from ..scene import Scene
from ._pxr import Ar, Sdf, Usd, UsdShade
from .inputs import Inputs, is_node

#: UsdPrimvarReader_<type> whose result is a number or a colour.
COLOR_READERS = tuple(
    f"UsdPrimvarReader_{t}" for t in ("float", "float2", "float3", "float4", "vector", "point")
)


class Rgba(NamedTuple):
    """The value that is used instead of a picture that cannot be read."""

    r: float
    g: float
    b: float
    a: float

    def channel(self, name: str) -> float:
        """The component of an output `r`, `g`, `b` or `a`; the red one of `rgb`."""
        return self["rgba".index(name[0])]


#: Where nothing is authored.
MISSING = Rgba(0.5, 0.5, 0.5, 1.0)


@dataclass(frozen=True)
class Coordinates:
    """Texture coordinates: a primvar's name and the affine map applied to it."""

    primvar: str
    matrix: np.ndarray

    @property
    def transform(self) -> list[float]:
        """The ABI's six numbers."""
        return [float(v) for v in self.matrix[:2].reshape(6)]


@dataclass(frozen=True)
class ImageTexture:
    """A UsdUVTexture that was read.

    Attributes:
        id: the texture.
        coordinates: its primvar, which the mesh has to bring.
        has_alpha: its alpha is not 1 everywhere.
    """

    id: int
    coordinates: Coordinates
    has_alpha: bool


@dataclass(frozen=True)
class _Loaded:
    """An image of the scene and what its file said.

    `tiles`: by what texture coordinates are divided, where it is made of such.
    """

    id: int
    has_alpha: bool
    is_8_bit: bool
    channels: int
    wrap: str
    tiles: tuple[int, int] = (1, 1)


class Textures:
    """Loads each picture once for each way it is decoded, and makes a texture for each node."""

    def __init__(self, scene: Scene, inputs: Inputs) -> None:
        self._scene = scene
        self._inputs = inputs
        self._time = inputs.time
        self._report = inputs.report
        self._images: dict[tuple, _Loaded | str] = {}
        self._textures: dict[tuple, ImageTexture | Rgba] = {}

    def uv_texture(
        self,
        shader: UsdShade.Shader,
        normal_map: bool = False,
        threshold: float | None = None,
        channel: str = "",
    ) -> ImageTexture | Rgba:
        """The texture of a UsdUVTexture node, or the value that stands in for it.

        Args:
            shader: the node.
            normal_map: it feeds a normal, where an 8-bit picture needs scale 2 and bias -1.
            threshold: the picture's `channel` becomes 1 where its scaled value reaches this and 0
                elsewhere: a mask.
            channel: that channel.
        """
        key = (shader.GetPath(), normal_map, threshold, channel)
        if key not in self._textures:
            self._textures[key] = self._uv_texture(shader, normal_map, threshold, channel)
        return self._textures[key]

    def attribute(self, shader: UsdShade.Shader) -> tuple[int, str] | None:
        """A primvar reader as a texture, and the primvar's name."""
        name = self._primvar_name(shader)
        if not name:
            return None
        numbers = self._inputs.floats(shader, "fallback", (0.0, 0.0, 0.0, 1.0))
        texture = self._scene.add_texture(
            str(shader.GetPath()), {"type": "attribute", "name": name, "default": numbers}
        )
        return texture, name

    def light_image(self, attribute: Usd.Attribute) -> int | None:
        """The image of a light's texture, or None, with a warning, if it cannot be read."""
        asset = attribute.Get(self._time) if attribute else None
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            return None
        loaded = self._load(attribute, asset, "auto")
        if isinstance(loaded, str):
            self._report.warning(attribute.GetPrim(), loaded, "the light is plain")
            return None
        return loaded.id

    def _uv_texture(
        self, shader: UsdShade.Shader, normal_map: bool, threshold: float | None, channel: str
    ) -> ImageTexture | Rgba:
        prim, inputs = shader.GetPrim(), self._inputs
        scale = inputs.floats(shader, "scale", (1.0, 1.0, 1.0, 1.0))
        bias = inputs.floats(shader, "bias", (0.0, 0.0, 0.0, 0.0))
        file_attribute = inputs.attribute(shader, "file")
        asset = file_attribute.Get(self._time) if file_attribute else None
        space = str(inputs.value(shader, "sourceColorSpace", "auto"))
        mask = None if threshold is None else (channel, scale, bias, threshold)
        loaded: _Loaded | str = "a UsdUVTexture without a file"
        if isinstance(asset, Sdf.AssetPath) and asset.path:
            loaded = self._load(file_attribute, asset, space, mask)
        if isinstance(loaded, str):
            if inputs.source(shader, "fallback") is None:
                self._report.warning(prim, loaded, "grey 0.5 is used")
                return MISSING
            self._report.warning(prim, loaded, "its fallback value is used")
            return Rgba(*inputs.floats(shader, "fallback", (0.0, 0.0, 0.0, 1.0)))
        if mask is not None:
            scale, bias = [1.0] * 4, [0.0] * 4
        elif normal_map and loaded.is_8_bit and scale[:3] == [1, 1, 1] and bias[:3] == [0, 0, 0]:
            self._report.warning(
                prim,
                "an 8-bit normal map without scale 2 and bias -1, which UsdPreviewSurface asks for",
                "they are applied",
            )
            scale, bias = [2.0, 2.0, 2.0, 1.0], [-1.0, -1.0, -1.0, 0.0]
        coordinates = self._coordinates(shader)
        across, up = loaded.tiles
        of_tiles = Coordinates("", np.diag([1.0 / across, 1.0 / up, 1.0]) @ coordinates.matrix)
        wraps = loaded.wrap.split(",") if loaded.wrap else []
        texture: dict[str, Any] = {
            "type": "image",
            "image": loaded.id,
            "uv": coordinates.primvar,
            "transform": of_tiles.transform,
            "wrap_s": self._wrap(shader, "wrapS", wraps[0] if wraps else ""),
            "wrap_t": self._wrap(shader, "wrapT", wraps[-1] if wraps else ""),
            "scale": scale,
            "bias": bias,
        }
        if mask is not None:
            texture["filter"] = "closest"
        number = self._scene.add_texture(str(prim.GetPath()), texture)
        return ImageTexture(number, coordinates, loaded.has_alpha or scale[3] + bias[3] != 1)

    def _wrap(self, shader: UsdShade.Shader, name: str, metadata: str) -> str:
        mode = str(self._inputs.value(shader, name, "useMetadata"))
        if mode == "useMetadata":
            # UsdUVTexture: the file's own mode, and black where the file has none.
            mode = {"periodic": "repeat", "clamp": "clamp", "mirror": "mirror"}.get(
                metadata, "black"
            )
        if mode not in ("repeat", "clamp", "mirror", "black"):
            self._report.warning(shader.GetPrim(), f"{name} '{mode}' is unknown", "black is used")
            mode = "black"
        return mode

    def _coordinates(self, shader: UsdShade.Shader) -> Coordinates:
        """Follows `st` through UsdTransform2d nodes to the primvar."""
        matrix = np.eye(3)
        name, node = "st", shader
        passed = {shader.GetPath()}
        while True:
            found = self._inputs.source(node, name)
            if not is_node(found):
                if found is not None and node.GetInput(name).GetAttr().HasAuthoredValue():
                    # A constant coordinate: every point sees the same texel.
                    constant = matrix @ np.array(
                        [*self._inputs.checked(node, name, found, (0.0, 0.0)), 1.0]
                    )
                    matrix = np.zeros((3, 3))
                    matrix[:, 2] = constant
                else:
                    self._report.warning(
                        shader.GetPrim(),
                        "a UsdUVTexture without texture coordinates",
                        "the primvar 'st' is used",
                    )
                return Coordinates("st", matrix)
            node = found[0]
            if node.GetPath() in passed:
                self._report.warning(
                    node.GetPrim(),
                    "texture coordinates that depend on themselves",
                    "the primvar 'st' is used",
                )
                return Coordinates("st", np.eye(3))
            passed.add(node.GetPath())
            kind = node.GetIdAttr().Get()
            if kind == "UsdTransform2d":
                matrix = matrix @ self._transform_2d(node)
                name = "in"
            elif kind and kind.startswith("UsdPrimvarReader_float2"):
                return Coordinates(self._primvar_name(node) or "st", matrix)
            else:
                self._report.unsupported(
                    node.GetPrim(), f"texture coordinates from '{kind}'", "the primvar 'st' is used"
                )
                return Coordinates("st", matrix)

    def _transform_2d(self, node: UsdShade.Shader) -> np.ndarray:
        """UsdTransform2d: scaled, then turned counter-clockwise, then moved."""
        turn = math.radians(self._inputs.floats(node, "rotation", (0.0,))[0])
        sx, sy = self._inputs.floats(node, "scale", (1.0, 1.0))
        tx, ty = self._inputs.floats(node, "translation", (0.0, 0.0))
        c, s = math.cos(turn), math.sin(turn)
        return np.array([[c * sx, -s * sy, tx], [s * sx, c * sy, ty], [0.0, 0.0, 1.0]])

    def _primvar_name(self, node: UsdShade.Shader) -> str:
        name = self._inputs.value(node, "varname", "")
        return str(name).removeprefix("primvars:") if name else ""

    def _load(
        self, attribute: Usd.Attribute, asset: Sdf.AssetPath, space: str, mask: Any = None
    ) -> _Loaded | str:
        """The image of an asset, or what is wrong with it."""
        path = asset.resolvedPath
        found: dict[int, str] = {}
        if tiles.MARK in asset.path:
            found = self._tiles(attribute, asset)
            path = found[min(found)] if found else ""
        if not path:
            return f"the file {asset.path} does not exist"
        key = (path, bool(found), space, None if mask is None else repr(mask))
        if key not in self._images:
            try:
                if found:
                    self._images[key] = self._add_tiles(attribute, asset, found, space, mask)
                else:
                    self._images[key] = self._add_image(path, images.read(path), space, mask)
            except images.ImageError as error:
                text = " ".join(str(error).split())
                self._images[key] = f"the file {asset.path} cannot be read ({text})"
        return self._images[key]

    def _add_image(self, path: str, picture: images.Picture, space: str, mask: Any) -> _Loaded:
        pixels = picture.pixels
        colorspace = _colorspace(picture, space)
        if mask is not None:
            pixels, colorspace = _thresholded(pixels, colorspace, *mask), "raw"
        number = self._scene.add_image(path, pixels, colorspace)
        return _Loaded(
            number, picture.has_alpha, picture.is_8_bit, picture.pixels.shape[2], picture.wrap
        )

    def _add_tiles(
        self,
        attribute: Usd.Attribute,
        asset: Sdf.AssetPath,
        found: dict[int, str],
        space: str,
        mask: Any,
    ) -> _Loaded:
        tiled = tiles.join(found)
        if tiled.reduction > 1:
            self._report.warning(
                attribute.GetPrim(),
                f"the tiles of {asset.path} take too much memory",
                f"their resolution is divided by {tiled.reduction}",
            )
        loaded = self._add_image(asset.path, tiled.picture, space, mask)
        return replace(loaded, tiles=tiled.counts)

    def _tiles(self, attribute: Usd.Attribute, asset: Sdf.AssetPath) -> dict[int, str]:
        """The files of a UDIM texture by the numbers of their tiles."""
        for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
            found = {}
            for number in range(tiles.FIRST, tiles.LAST + 1):
                relative = asset.path.replace(tiles.MARK, str(number))
                resolved = Ar.GetResolver().Resolve(spec.layer.ComputeAbsolutePath(relative))
                if resolved:
                    found[number] = str(resolved.GetPathString())
            if found:
                return found
        return {}


def _colorspace(picture: images.Picture, space: str) -> str:
    """UsdUVTexture's `sourceColorSpace` as the ABI's colour space.

    "auto": sRGB for 8 bits with 3 or 4 channels, else raw. The file's own word is not asked for:
    OpenImageIO calls every PNG and JPEG sRGB, whether the file says so or not.
    """
    if space == "sRGB":
        return "srgb"
    if space == "raw":
        return "raw"
    return "srgb" if picture.is_8_bit and picture.pixels.shape[2] >= 3 else "raw"


def _thresholded(
    pixels: np.ndarray,
    colorspace: str,
    channel: str,
    scale: list[float],
    bias: list[float],
    threshold: float,
) -> np.ndarray:
    """One channel as a mask: 255 where its scaled and biased value reaches the threshold."""
    count = pixels.shape[2]
    component = {"r": 0, "g": 1, "b": 2, "a": 3, "rgb": 0}[channel]
    if component == 3:
        position = count - 1 if count in (2, 4) else None
    else:
        position = component if count >= 3 else 0
    if position is None:
        values = np.ones(pixels.shape[:2])
    else:
        values = pixels[:, :, position].astype(np.float64)
        if pixels.dtype.kind == "u":
            values /= np.iinfo(pixels.dtype).max
        if colorspace == "srgb" and component != 3:
            values = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    values = values * scale[component] + bias[component]
    return np.where(values >= threshold, np.uint8(255), np.uint8(0))
