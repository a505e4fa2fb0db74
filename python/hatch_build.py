"""Puts the engine's shared library into the wheel and tags the wheel with the platform."""

import os
import sysconfig
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class SharedLibraryHook(BuildHookInterface):
    """Adds ``libsegue`` to a wheel; an editable install uses the checkout's ``build/`` instead."""

    def initialize(self, version: str, build_data: dict) -> None:
        """Called by hatchling before a wheel of the given kind is built."""
        if version == "editable":
            return
        default = Path(self.root).parent / "build" / "libsegue.so"
        library = Path(os.environ.get("SEGUE_LIBRARY") or default)
        if not library.is_file():
            raise FileNotFoundError(
                f"{library} does not exist: build the engine first (make), or name its shared "
                "library in SEGUE_LIBRARY"
            )
        # ctypes needs neither a Python version nor a Python ABI: only the platform counts.
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{platform}"
        build_data["force_include"][str(library)] = "segue/libsegue.so"
