"""Blender's images as pixel arrays."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

from ..log import ExportLog
from .image_files import FromFiles, UnreadableError, read_frame, read_tiles, srgb_to_linear

# Colour spaces of byte images that Segue decodes; float images are scene linear already.
_COLORSPACES = {
    "sRGB": "srgb",
    "Non-Color": "raw",
    "Raw": "raw",
    "Linear Rec.709": "linear",
    "Linear": "linear",
    "scene_linear": "linear",
}


@dataclass(frozen=True)
class Pixels:
    """A picture: (height, width, 3 or 4) of uint8 or float32, row 0 on top.

    `tiles`: how many of UDIM stand in it side by side and above one another.
    """

    values: np.ndarray
    colorspace: str
    tiles: tuple[int, int] = (1, 1)

    def linear(self) -> np.ndarray:
        """The decoded picture as (height, width, 4) float32."""
        values = self.values
        if values.dtype == np.uint8:
            values = values.astype(np.float32) / np.float32(255.0)
        if self.colorspace == "srgb":
            values = values.copy()
            values[..., :3] = srgb_to_linear(values[..., :3])
        if values.shape[2] == 3:
            values = np.concatenate([values, np.ones_like(values[..., :1])], axis=2)
        return values


def _colorspace(image: bpy.types.Image, log: ExportLog) -> str:
    name = image.colorspace_settings.name
    if image.is_float:
        return "raw" if name in {"Non-Color", "Raw"} else "linear"
    if name not in _COLORSPACES:
        log.warn(
            f"Image '{image.name}': colour space '{name}' is not supported, it is read as sRGB"
        )
    return _COLORSPACES.get(name, "srgb")


def read_image(
    image: bpy.types.Image,
    user: bpy.types.ImageUser,
    log: ExportLog,
    *,
    straight_alpha: bool,
) -> Pixels | None:
    """The pixels of an image as a node shows it; None if they cannot be had.

    With `straight_alpha` the colours are free of the alpha channel, as a shader that uses the alpha
    wants them; otherwise they are multiplied by it, as Cycles does unless the image says not to.
    """
    found = _from_files(image, user, log) or _loaded(image)
    if found is None:
        return None
    values = _alpha(image, found.values, straight_alpha)
    if not image.is_float:
        # Byte images come as value / 255, so this is exact.
        values = np.rint(values * np.float32(255.0)).clip(0, 255).astype(np.uint8)
    opaque = 255 if values.dtype == np.uint8 else 1.0
    if (values[..., 3] == opaque).all():
        values = values[..., :3]
    return Pixels(np.ascontiguousarray(values), _colorspace(image, log), found.counts)


def _from_files(
    image: bpy.types.Image, user: bpy.types.ImageUser, log: ExportLog
) -> FromFiles | None:
    """The pixels of what has several files; None for all else, and where they cannot be read."""
    name = f"Image '{image.name}'"
    if image.source == "TILED":
        try:
            found = read_tiles(image)
        except UnreadableError as reason:
            instead = "the first tile is used everywhere"
            log.warn(f"{name}: its UDIM tiles cannot be read ({reason}), {instead}")
            return None
        if found.reduction > 1:
            instead = f"their resolution is divided by {found.reduction}"
            log.warn(f"{name}: its UDIM tiles take too much memory, {instead}")
        return found
    instead = "the frame now loaded is used"
    if image.source == "SEQUENCE":
        try:
            return read_frame(image, user)
        except UnreadableError as reason:
            log.warn(f"{name}: the frame of its sequence cannot be read ({reason}), {instead}")
    elif image.source == "MOVIE":
        log.warn(f"{name}: frames of movies are not supported, {instead}")
    return None


def _loaded(image: bpy.types.Image) -> FromFiles | None:
    """The pixels that Blender has, of one file."""
    width, height = image.size
    if width == 0 or height == 0:
        return None
    values = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(values)
    return FromFiles(values.reshape(height, width, 4)[::-1])


def _alpha(image: bpy.types.Image, values: np.ndarray, straight: bool) -> np.ndarray:
    """Bring colour and alpha into the wanted relation. Byte pixels are straight, float ones not.

    The channels of data, such as normals and roughness, have nothing to do with one another.
    """
    if image.alpha_mode == "NONE":
        values = values.copy()
        values[..., 3] = 1.0
        return values
    if image.alpha_mode == "CHANNEL_PACKED" or image.colorspace_settings.is_data:
        return values
    alpha = values[..., 3:]
    if image.is_float and straight:
        color = np.divide(values[..., :3], alpha, out=values[..., :3].copy(), where=alpha > 0)
        return np.concatenate([color, alpha], axis=2)
    if not image.is_float and not straight:
        return np.concatenate([values[..., :3] * alpha, alpha], axis=2)
    return values
