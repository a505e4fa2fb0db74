"""Pictures that Blender shows but a part of to scripts: UDIM tiles, and frames of sequences."""

from __future__ import annotations

import contextlib
import importlib
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

# Blender's other way to write where a tile is: by column and row, from one.
_BY_COLUMN_AND_ROW = "<UVTILE>"


class UnreadableError(Exception):
    """A picture cannot be had from its files; the text says why."""


@dataclass(frozen=True)
class FromFiles:
    """Pixels as Blender's own images have them: (height, width, 4) float32, row 0 on top.

    Those of files with bytes are encoded, by 255, and not multiplied by their alpha; others are
    linear and are. `counts`: how many tiles stand side by side and above one another; `reduction`:
    what their resolution was divided by.
    """

    values: np.ndarray
    counts: tuple[int, int] = (1, 1)
    reduction: int = 1


def read_frame(image: bpy.types.Image, user: bpy.types.ImageUser) -> FromFiles:
    """The picture of a sequence that a node shows in the frame that is rendered."""
    path = image.filepath_from_user(image_user=user)
    with _modules() as (images, _):
        try:
            return FromFiles(_as_blenders(images.read(path), image))
        except images.ImageError as error:
            raise UnreadableError(str(error)) from error


def read_tiles(image: bpy.types.Image) -> FromFiles:
    """All tiles of an image in one picture, black where there is none."""
    with _modules() as (images, tiles), tempfile.TemporaryDirectory() as unpacked:
        paths = {number: str(path) for number, path in _tile_files(tiles, image, Path(unpacked))}
        try:
            tiled = tiles.join(paths)
        except images.ImageError as error:
            raise UnreadableError(str(error)) from error
    return FromFiles(_as_blenders(tiled.picture, image), tiled.counts, tiled.reduction)


def _tile_files(tiles: Any, image: bpy.types.Image, unpacked: Path) -> Iterator[tuple[int, Path]]:
    for packed in image.packed_files:
        path = unpacked / f"{packed.tile_number}{Path(packed.filepath).suffix}"
        path.write_bytes(packed.packed_file.data)
        yield packed.tile_number, path
    if image.packed_files:
        return
    pattern = bpy.path.abspath(image.filepath, library=image.library)
    for tile in image.tiles:
        column, row = tiles.place(tile.number)
        name = pattern.replace(tiles.MARK, str(tile.number))
        path = Path(name.replace(_BY_COLUMN_AND_ROW, f"u{column + 1}_v{row + 1}"))
        if path.is_file():
            yield tile.number, path


def _as_blenders(picture: Any, image: bpy.types.Image) -> np.ndarray:
    """A file's pixels as Blender's images have them."""
    pixels, has_bytes = picture.pixels, picture.is_8_bit
    most = np.iinfo(pixels.dtype).max if pixels.dtype.kind == "u" else 1
    values = pixels.astype(np.float32) / np.float32(most)
    channels = values.shape[2]
    result = np.ones((*values.shape[:2], 4), np.float32)
    result[..., :3] = values[..., :3] if channels >= 3 else values[..., :1]
    if channels in {2, 4}:
        result[..., 3] = values[..., -1]
    if not has_bytes and pixels.dtype.kind == "u":
        if image.colorspace_settings.name == "sRGB":
            result[..., :3] = srgb_to_linear(result[..., :3])
        if not image.colorspace_settings.is_data:
            result[..., :3] *= result[..., 3:]
    return result


def srgb_to_linear(values: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1 decoding."""
    low = values / np.float32(12.92)
    high = ((np.maximum(values, 0.0) + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.where(values <= 0.04045, low, high)


@contextlib.contextmanager
def _modules() -> Iterator[tuple[Any, Any]]:
    """The engine's readers, with Blender's OpenImageIO where Python does not find another."""
    version = f"python{sysconfig.get_python_version()}"
    bundled = Path(bpy.utils.resource_path("LOCAL"), "python", "lib", version, "site-packages")
    sys.path.append(str(bundled))
    try:
        yield tuple(importlib.import_module(f"segue.{name}") for name in ("images", "tiles"))
    except ImportError as error:
        raise UnreadableError(str(error)) from error
    finally:
        sys.path.remove(str(bundled))
