"""Finding the engine: the `segue` package and the shared library behind it."""

from __future__ import annotations

import importlib
from types import ModuleType


class EngineMissingError(RuntimeError):
    """The render engine cannot be loaded; the text says why and what to do."""


def load() -> ModuleType:
    """The `segue` package with its library loaded.

    Raises:
        EngineMissingError: it cannot be; the text says why.
    """
    try:
        module = importlib.import_module("segue")
    except ImportError as error:
        raise EngineMissingError(
            "The Python package 'segue' is not available in this Blender "
            f"({error}). Install Segue from its .zip, which carries the package, "
            "by Preferences > Get Extensions > Install from Disk."
        ) from error
    try:
        # A scene is the cheapest thing that needs the shared library and its ABI version.
        module.Scene()
    except Exception as error:
        raise EngineMissingError(
            f"Segue's engine library could not be loaded: {error}. "
            "The extension may have been built for another operating system or processor."
        ) from error
    return module
