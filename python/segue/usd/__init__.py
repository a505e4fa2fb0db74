"""Import of USD stages: `load` turns a file or an open stage into a `segue.Scene`.

Works with usd-core's `pxr` and with the one that Blender brings.
"""

from .report import Entry, Kind, Report
from .stage import Imported, StageError, load, open_stage

__all__ = ["Entry", "Imported", "Kind", "Report", "StageError", "load", "open_stage"]
