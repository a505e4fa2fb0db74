"""Arguments on their way to the ABI: arrays as pointers, dictionaries as JSON."""

from __future__ import annotations

import ctypes
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import BadArgumentError


def array(
    values: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int, ...], what: str
) -> np.ndarray:
    """The values as a contiguous array; a contiguous one of that dtype is passed on uncopied.

    Args:
        values: what the caller gave.
        dtype: wanted element type. A float is never turned into an integer, and an integer that
            the dtype cannot hold is an error rather than wrapped around.
        shape: wanted shape; -1 stands for any length, and a flat array is folded into it.
        what: name of the argument, for messages.

    Raises:
        BadArgumentError: the values do not fit.
    """
    try:
        given = np.asarray(values)
    except ValueError as error:
        raise BadArgumentError(f"{what}: {error}") from error
    wanted = np.dtype(dtype)
    if given.dtype != wanted:
        if wanted.kind in "ui" and given.size:
            if given.dtype.kind not in "uib":
                raise BadArgumentError(f"{what}: {given.dtype} values where integers are wanted")
            info = np.iinfo(wanted)
            low, high = int(given.min()), int(given.max())
            if low < info.min or high > info.max:
                raise BadArgumentError(f"{what}: {low if low < info.min else high} is out of range")
        elif wanted.kind == "f" and given.dtype.kind not in "fuib":
            raise BadArgumentError(f"{what}: {given.dtype} values where numbers are wanted")
    if given.ndim != len(shape) or any(s not in (-1, g) for s, g in zip(shape, given.shape)):
        try:
            given = given.reshape(shape)
        except ValueError as error:
            raise BadArgumentError(
                f"{what}: an array of shape {given.shape} where {shape} is wanted"
            ) from error
    return np.ascontiguousarray(given, dtype=wanted)


def pointer(values: np.ndarray | None) -> int | None:
    """Address of an array's first element; None for none or an empty array."""
    return values.ctypes.data if values is not None and values.size else None


def text(value: str, what: str) -> bytes:
    """A string as NUL-terminated UTF-8."""
    encoded = str(value).encode("utf-8", errors="replace")
    if b"\0" in encoded:
        raise BadArgumentError(f"{what}: {value!r} holds a NUL character")
    return encoded


def to_json(value: Mapping[str, Any], what: str) -> bytes:
    """A dictionary as JSON. Numpy scalars and arrays are allowed, NaN and infinity are not."""

    def plain(item: Any) -> Any:
        if isinstance(item, (np.generic, np.ndarray)):
            return item.tolist()
        raise BadArgumentError(f"{what}: {item!r} has no place in JSON")

    try:
        return json.dumps(value, default=plain, allow_nan=False).encode()
    except ValueError as error:
        if isinstance(error, BadArgumentError):
            raise
        raise BadArgumentError(f"{what}: {error}") from error


def from_json(value: ctypes.c_char_p) -> Any:
    """What a JSON answer of the engine says."""
    return json.loads((value.value or b"null").decode())
