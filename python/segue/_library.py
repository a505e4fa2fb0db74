"""Finds the engine's shared library, checks its ABI version, and turns statuses into exceptions."""

from __future__ import annotations

import ctypes
import os
import sys
from functools import lru_cache
from pathlib import Path

from . import _abi
from .errors import SegueError, from_status

_NAMES = {"win32": "segue.dll", "darwin": "libsegue.dylib"}


class LibraryError(SegueError, ImportError):
    """The engine's shared library is missing, cannot be loaded, or is of another ABI version."""


def library_path() -> Path:
    """Path of the shared library: `$SEGUE_LIBRARY`, else in the package, else in the checkout.

    Raises:
        LibraryError: there is none.
    """
    override = os.environ.get("SEGUE_LIBRARY")
    if override:
        path = Path(override)
        if path.is_file():
            return path
        raise LibraryError(f"SEGUE_LIBRARY names {path}, which is not a file")
    package = Path(__file__).resolve().parent
    name = _NAMES.get(sys.platform, "libsegue.so")
    places = (package / name, package.parents[1] / "build" / name)
    for path in places:
        if path.is_file():
            return path
    raise LibraryError(
        f"the engine's shared library {name} was not found in "
        + " or ".join(str(p.parent) for p in places)
        + "; build it with make, or set SEGUE_LIBRARY to its path"
    )


@lru_cache(maxsize=1)
def library() -> ctypes.CDLL:
    """The loaded library, with prototypes. Loaded once, at first use.

    Raises:
        LibraryError: it is missing, broken, or its ABI version is not the one of this package.
    """
    path = library_path()
    try:
        loaded = ctypes.CDLL(str(path))
        loaded.segue_abi_version.restype = ctypes.c_uint32
        version = loaded.segue_abi_version()
    except (OSError, AttributeError) as error:
        raise LibraryError(f"{path} cannot be used: {error}") from error
    if version != _abi.ABI_VERSION:
        raise LibraryError(
            f"{path} has ABI version {version}, this package needs {_abi.ABI_VERSION}: "
            "install the package and the library of the same release"
        )
    try:
        _abi.declare(loaded)
    except AttributeError as error:
        raise LibraryError(f"{path} cannot be used: {error}") from error
    return loaded


def engine_version() -> str:
    """Version of the engine, such as "0.1.0"."""
    return library().segue_version().decode()


def check(status: int) -> None:
    """Raises the exception of a status other than 0.

    The text of a failure is kept per thread: call this on the thread that made the call.
    """
    if status:
        raise from_status(status, library().segue_last_error().decode(errors="replace"))
