"""Where tests find shared scenes and the engine."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import segue
from recording import RecordingScene

ROOT = Path(__file__).resolve().parents[2]
DATA = Path(__file__).resolve().parent / "data"


@pytest.fixture
def scene() -> RecordingScene:
    """A scene that records."""
    return RecordingScene()


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of shared scenes; tests that need it are skipped where it is absent."""
    path = Path(os.environ.get("SEGUE_SHARED") or ROOT.parent / "shared")
    if not (path / "scenes").is_dir():
        pytest.skip("the shared scenes are not here (SEGUE_SHARED)")
    return path


@pytest.fixture(scope="session")
def engine() -> Path:
    """The engine's shared library; tests that render are skipped where it is not built."""
    try:
        return segue.library_path()
    except segue.LibraryError as error:
        pytest.skip(str(error))
