"""The curve of error against run time as a picture, drawn with nothing but numpy."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from .curve import Axis, Point, series

#: Pixels of the picture's edges. It is square because Blender shows icons in squares.
SIZE = 400
#: Rows and columns of the edges of the area within the axes.
LEFT, RIGHT, TOP, BOTTOM = 72, 384, 36, 346

#: sRGB colours: those of Okabe and Ito (2008) that stand out on a dark ground, for the curves.
ERROR, BIAS = (86, 180, 233), (230, 159, 0)
GROUND, FINE, COARSE, BORDER, TEXT = (29,) * 3, (43,) * 3, (74,) * 3, (110,) * 3, (205,) * 3

_LINE_WIDTH = 2.5
_DOT_WIDTH = 6.0
# Axes no longer than this keep the curve from being squeezed by a few odd points.
_TIME_DECADES, _ERROR_DECADES = 8.0, 4.0

# Letters of 5 x 7 pixels, row by row; pixels of them are drawn this large.
_SCALE = 2
_ADVANCE, _HEIGHT = 6 * _SCALE, 7 * _SCALE
_LETTERS = {
    "0": ".###. #...# #..## #.#.# ##..# #...# .###.",
    "1": "..#.. .##.. ..#.. ..#.. ..#.. ..#.. .###.",
    "2": ".###. #...# ....# ...#. ..#.. .#... #####",
    "3": ".###. #...# ....# ..##. ....# #...# .###.",
    "4": "...#. ..##. .#.#. #..#. ##### ...#. ...#.",
    "5": "##### #.... ####. ....# ....# #...# .###.",
    "6": "..##. .#... #.... ####. #...# #...# .###.",
    "7": "##### ....# ...#. ..#.. .#... .#... .#...",
    "8": ".###. #...# #...# .###. #...# #...# .###.",
    "9": ".###. #...# #...# .#### ....# ...#. .##..",
    ".": "..... ..... ..... ..... ..... .##.. .##..",
    "-": "..... ..... ..... .###. ..... ..... .....",
    "%": "##..# ##..# ...#. ..#.. .#... #..## #..##",
    "a": "..... ..... .###. ....# .#### #...# .####",
    "b": "#.... #.... #.##. ##..# #...# #...# ####.",
    "c": "..... ..... .###. #.... #.... #...# .###.",
    "d": "....# ....# .##.# #..## #...# #...# .####",
    "e": "..... ..... .###. #...# ##### #.... .###.",
    "i": "..#.. ..... .##.. ..#.. ..#.. ..#.. .###.",
    "m": "..... ..... ##.#. #.#.# #.#.# #.#.# #.#.#",
    "n": "..... ..... #.##. ##..# #...# #...# #...#",
    "o": "..... ..... .###. #...# #...# #...# .###.",
    "r": "..... ..... #.##. ##..# #.... #.... #....",
    "s": "..... ..... .###. #.... .###. ....# ####.",
    "t": ".#... .#... ###.. .#... .#... .#..# ..##.",
    " ": "..... ..... ..... ..... ..... ..... .....",
}
_GLYPHS = {
    letter: np.array([[dot == "#" for dot in row] for row in rows.split()])
    .repeat(_SCALE, 0)
    .repeat(_SCALE, 1)
    for letter, rows in _LETTERS.items()
}


def draw(points: Sequence[Point]) -> np.ndarray:
    """The curve of the error, and of the bias where it is known, both axes logarithmic.

    Args:
        points: the curve as the engine's statistics tell it.

    Returns:
        (SIZE, SIZE, 3) bytes, sRGB, row 0 on top.
    """
    picture = np.empty((SIZE, SIZE, 3), np.uint8)
    picture[:] = GROUND
    error, bias = series(points, "estimated_error"), series(points, "estimated_bias")
    seconds, percent = (np.concatenate(values) for values in zip(error, bias, strict=True))
    if np.isnan(percent).all():
        words = "no estimate"
        _write(picture, words, (SIZE - _width(words)) // 2, (SIZE - _HEIGHT) // 2, TEXT)
        return picture
    times, errors = Axis.around(seconds, _TIME_DECADES), Axis.around(percent, _ERROR_DECADES)
    _draw_axes(picture, times, errors)
    # The error comes last: it is the one that must not be hidden.
    column = RIGHT
    for title, color, curve in (("bias %", BIAS, bias), ("error %", ERROR, error)):
        if np.isfinite(curve[1]).any():
            places = (_columns(times, curve[0]), _rows(errors, curve[1]))
            _draw_curve(picture, np.stack(places, axis=-1), color)
            _write(picture, title, column - _width(title), TOP - _HEIGHT - 10, color)
            column -= _width(title) + 3 * _ADVANCE
    return picture


def _columns(axis: Axis, values: np.ndarray) -> np.ndarray:
    return LEFT + axis.fraction(values) * (RIGHT - LEFT)


def _rows(axis: Axis, values: np.ndarray) -> np.ndarray:
    return BOTTOM - axis.fraction(values) * (BOTTOM - TOP)


def _draw_axes(picture: np.ndarray, times: Axis, errors: Axis) -> None:
    """Grid, border and numbers."""
    for marks, color in ((Axis.marks, FINE), (Axis.decades, COARSE)):
        for column in np.rint(_columns(times, np.array(marks(times)))).astype(int):
            picture[TOP : BOTTOM + 1, column] = color
        for row in np.rint(_rows(errors, np.array(marks(errors)))).astype(int):
            picture[row, LEFT : RIGHT + 1] = color
    picture[TOP : BOTTOM + 1, [LEFT, RIGHT]] = BORDER
    picture[[TOP, BOTTOM], LEFT : RIGHT + 1] = BORDER

    free = 0
    for mark, number in times.labels().items():
        width = _width(number)
        column = round(_columns(times, mark) - width / 2)
        column = min(column, SIZE - width)
        # A number that would touch the one before is left out.
        if column >= free:
            _write(picture, number, column, BOTTOM + 10, TEXT)
            free = column + width + _ADVANCE // 2
    words = "seconds"
    _write(picture, words, (LEFT + RIGHT - _width(words)) // 2, SIZE - _HEIGHT - 4, TEXT)
    for mark, number in errors.labels().items():
        row = round(_rows(errors, mark) - _HEIGHT / 2)
        _write(picture, number, LEFT - 6 - _width(number), row, TEXT)


def _draw_curve(picture: np.ndarray, points: np.ndarray, color: tuple[int, ...]) -> None:
    """Dots at (x, y) `points`, and lines between neighbours; where one is NaN there is a gap."""
    coverage = np.zeros(picture.shape[:2])
    # What is far below the axis may not cost time.
    points = np.clip(points, -SIZE, 2 * SIZE)
    for point in points[np.isfinite(points).all(1)]:
        _stroke(coverage, point, point, _DOT_WIDTH)
    for begin, end in pairwise(points):
        if np.isfinite([begin, end]).all():
            _stroke(coverage, begin, end, _LINE_WIDTH)
    # Dots on the border are drawn whole, lines that leave the axes are cut.
    margin = int(_DOT_WIDTH / 2) + 1
    inside = np.zeros_like(coverage)
    inside[TOP - margin : BOTTOM + margin, LEFT - margin : RIGHT + margin] = 1.0
    coverage = (coverage * inside)[:, :, None]
    mixed = picture * (1.0 - coverage) + np.array(color) * coverage
    picture[:] = np.rint(mixed).astype(np.uint8)


def _stroke(coverage: np.ndarray, begin: np.ndarray, end: np.ndarray, width: float) -> None:
    """Cover what is within half of `width` of the line from `begin` to `end`, (x, y) both."""
    low = np.floor(np.minimum(begin, end) - width).astype(int)
    high = np.ceil(np.maximum(begin, end) + width).astype(int) + 1
    (x0, y0), (x1, y1) = np.clip(low, 0, SIZE), np.clip(high, 0, SIZE)
    if x0 >= x1 or y0 >= y1:
        return
    y, x = np.mgrid[y0:y1, x0:x1]
    along = end - begin
    length = float(along @ along)
    from_begin = np.stack([x - begin[0], y - begin[1]], axis=-1)
    share = np.clip(from_begin @ along / length, 0.0, 1.0) if length else np.zeros(x.shape)
    distance = np.linalg.norm(from_begin - share[:, :, None] * along, axis=-1)
    part = coverage[y0:y1, x0:x1]
    np.maximum(part, np.clip(width / 2 + 0.5 - distance, 0.0, 1.0), out=part)


def _width(words: str) -> int:
    return len(words) * _ADVANCE - _SCALE


def _write(picture: np.ndarray, words: str, column: int, row: int, color: tuple[int, ...]) -> None:
    """Set `words` with their top left corner at a pixel; what is outside is cut."""
    for letter in words:
        glyph = _GLYPHS[letter]
        if column >= 0 and row >= 0:
            part = picture[row : row + glyph.shape[0], column : column + glyph.shape[1]]
            part[glyph[: part.shape[0], : part.shape[1]]] = color
        column += _ADVANCE


def png(picture: np.ndarray) -> bytes:
    """A picture of (height, width, 3) bytes as a PNG file (PNG specification, section 5)."""
    height, width = picture.shape[:2]
    # Every row begins with its filter: 0 is none.
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = picture.reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
