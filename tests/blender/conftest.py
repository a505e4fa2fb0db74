"""Runs cases inside Blender's Python module, each in a process of its own.

`SEGUE_BPY_PYTHON` names a Python with `bpy`; by default it is the one that runs the tests. A case
is a function `case_*` of a module in `cases/`; `harness.py` runs it. A process of its own keeps a
crash of one case from hiding the others, and Blender's module cannot be restarted within one.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
TIMEOUT = 900

RunCase = Callable[[str, str, str], None]


@pytest.fixture(scope="session")
def blender_python() -> str:
    """A Python that can import `bpy`."""
    python = os.environ.get("SEGUE_BPY_PYTHON")
    if python:
        return python
    if importlib.util.find_spec("bpy") is None:
        pytest.skip("no bpy in this Python, and SEGUE_BPY_PYTHON is not set")
    return sys.executable


@pytest.fixture
def run_case(blender_python: str, tmp_path: Path) -> RunCase:
    """Run one case; its failure is the test's, with all that Blender printed."""

    def run(module: str, name: str, engine: str) -> None:
        if engine == "real" and not library().exists():
            pytest.skip(f"the engine library is not built: {library()} is not there")
        environment = os.environ | {
            "BLENDER_USER_RESOURCES": str(tmp_path / "resources"),
            "PYTHONPATH": os.pathsep.join([str(HERE), str(REPOSITORY), str(REPOSITORY / "python")]),
            "SEGUE_TEST_OUTPUT": str(tmp_path),
        }
        if engine == "real":
            environment["SEGUE_LIBRARY"] = str(library())
        process = subprocess.run(
            [blender_python, str(HERE / "harness.py"), module, name, engine],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=TIMEOUT,
            check=False,
        )
        output = process.stdout
        if process.returncode == 77:
            pytest.skip(output.strip().splitlines()[-1])
        assert process.returncode == 0, (
            f"{module}.{name} ended with {process.returncode}:\n{output}"
        )

    return run


def library() -> Path:
    """The engine's shared library."""
    return Path(os.environ.get("SEGUE_LIBRARY", REPOSITORY / "build" / "libsegue.so"))
