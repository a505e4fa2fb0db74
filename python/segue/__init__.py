"""Segue: a physically based render engine.

Scenes are built from numpy arrays with `Scene`, rendered with `Render`; `segue.usd` imports USD
stages. Conventions (units, matrices, row order) are those of the engine's C ABI: matrices are for
column vectors, row 0 of a picture is its top row, radiance is linear Rec.709.
"""

from ._library import LibraryError, engine_version, library_path
from .errors import (
    BadArgumentError,
    BadSceneError,
    CancelledError,
    InternalError,
    OutputError,
    SegueError,
)
from .render import Render
from .reporting import error_text
from .scene import Attribute, Scene

__version__ = "0.1.0"

__all__ = [
    "Attribute",
    "BadArgumentError",
    "BadSceneError",
    "CancelledError",
    "InternalError",
    "LibraryError",
    "OutputError",
    "Render",
    "Scene",
    "SegueError",
    "engine_version",
    "error_text",
    "library_path",
]
