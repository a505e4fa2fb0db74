"""UDIM tiles: pictures side by side in the plane of texture coordinates, joined into one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .images import ImageError, Picture, read, resized

#: What stands for the number of a tile in the name of a file.
MARK = "<UDIM>"
#: The tile of the unit square; others follow to the right in rows of ten, the rows upwards.
FIRST = 1001
#: The last one that is looked for.
LAST = 1100
_ROW = 10
# Bytes that joined pictures may take; larger ones are joined at half their resolution, or less.
_MOST_BYTES = 1 << 29


@dataclass(frozen=True)
class Tiled:
    """Tiles as one picture.

    Attributes:
        picture: all of them, and black between.
        counts: how many stand side by side and above one another from the first: the picture's
            coordinates are texture coordinates divided by these.
        reduction: what the resolution was divided by.
    """

    picture: Picture
    counts: tuple[int, int]
    reduction: int


def place(number: int) -> tuple[int, int]:
    """Column and row of a tile, from 0."""
    row, column = divmod(number - FIRST, _ROW)
    return column, row


def join(paths: Mapping[int, str], most_bytes: int = _MOST_BYTES) -> Tiled:
    """Reads the files of tiles, by their numbers, and joins them at the size of the largest.

    Raises:
        ImageError: there is none, one cannot be read, or they differ in channels or pixel type.
    """
    if not paths:
        raise ImageError("there is no tile")
    pictures = {number: read(path) for number, path in sorted(paths.items())}
    kinds = {(p.pixels.shape[2], p.pixels.dtype) for p in pictures.values()}
    if len(kinds) > 1:
        raise ImageError("its tiles differ in their channels or in their pixel type")
    ((channels, dtype),) = kinds
    places = {number: place(number) for number in pictures}
    columns, rows = (1 + max(along) for along in zip(*places.values(), strict=True))
    height = max(p.pixels.shape[0] for p in pictures.values())
    width = max(p.pixels.shape[1] for p in pictures.values())
    reduction = 1
    while (
        rows * columns * height * width * channels * dtype.itemsize > most_bytes
        and min(height, width) > 1
    ):
        height, width, reduction = height // 2, width // 2, 2 * reduction
    joined = np.zeros((rows * height, columns * width, channels), dtype)
    for number, picture in pictures.items():
        column, row = places[number]
        top, left = (rows - 1 - row) * height, column * width
        joined[top : top + height, left : left + width] = resized(picture.pixels, width, height)
    return Tiled(Picture(joined, ""), (columns, rows), reduction)
