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


@pytest.fixture(scope="session")
def archive(blender_python: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The extension's archive, built with the library under test."""
    need_library()
    command = [sys.executable, REPOSITORY / "blender_addon" / "build.py", "--output"]
    output = tmp_path_factory.mktemp("archive")
    environment = os.environ | {"SEGUE_LIBRARY": str(library())}
    subprocess.run([*command, output], env=environment, check=True)
    (path,) = output.glob("*.zip")
    return path


@pytest.fixture
def run_case(blender_python: str, tmp_path: Path, request: pytest.FixtureRequest) -> RunCase:
    """Run one case; its failure is the test's, with all that Blender printed."""

    def run(module: str, name: str, engine: str) -> None:
        path = [HERE]
        environment = os.environ | {
            "BLENDER_USER_RESOURCES": str(tmp_path / "resources"),
            "SEGUE_TEST_OUTPUT": str(tmp_path),
        }
        if engine == "installed":
            # Only what the archive brings may be found.
            environment["SEGUE_TEST_ARCHIVE"] = str(request.getfixturevalue("archive"))
            environment.pop("SEGUE_LIBRARY", None)
        else:
            path += [REPOSITORY, REPOSITORY / "python"]
        if engine == "real":
            need_library()
            environment["SEGUE_LIBRARY"] = str(library())
        environment["PYTHONPATH"] = os.pathsep.join(map(str, path))
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


def need_library() -> None:
    """Skip where the engine is not built."""
    if not library().exists():
        pytest.skip(f"the engine library is not built: {library()} is not there")


def library() -> Path:
    """The engine's shared library."""
    return Path(os.environ.get("SEGUE_LIBRARY", REPOSITORY / "build" / "libsegue.so"))
