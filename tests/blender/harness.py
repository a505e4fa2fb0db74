"""Runs one case inside Blender: `python harness.py MODULE CASE fake|real|installed`."""

from __future__ import annotations

import importlib
import os
import sys
import traceback


class SkipCaseError(Exception):
    """Raised by a case that cannot run here; the text says why."""


def main() -> int:
    """Register the add-on, run the case in an empty file, unregister; the exit code tells.

    A case for the "installed" engine installs the add-on itself.
    """
    module_name, case_name, engine = sys.argv[1:4]
    import bpy

    if engine == "fake":
        sys.modules["segue"] = importlib.import_module("fake_segue")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    code = 0
    if engine != "installed":
        import blender_addon

        blender_addon.register()
    try:
        case = getattr(importlib.import_module(f"cases.{module_name}"), case_name)
        case()
    except SkipCaseError as reason:
        print(f"skipped: {reason}")
        code = 77
    except BaseException:
        traceback.print_exc()
        code = 1
    if engine != "installed":
        blender_addon.unregister()
    return code


if __name__ == "__main__":
    # The case may raise the exception class of this very module.
    sys.modules["harness"] = sys.modules["__main__"]
    result = main()
    sys.stdout.flush()
    sys.stderr.flush()
    # Blender's module may hang or crash in its destructors after rendering.
    os._exit(result)
