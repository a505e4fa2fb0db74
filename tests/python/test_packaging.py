"""The wheel, and what importing the package costs."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import zipfile

import pytest

import segue
from conftest import ROOT


def build(folder, **environment) -> subprocess.CompletedProcess:
    code = f"from hatchling.build import build_wheel; print(build_wheel({str(folder)!r}))"
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT / "python",
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def test_wheel(engine, tmp_path):
    pytest.importorskip("hatchling")
    built = build(tmp_path, SEGUE_LIBRARY=str(engine))
    assert built.returncode == 0, built.stderr
    (wheel,) = tmp_path.glob("*.whl")
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    assert wheel.name == f"segue-{segue.__version__}-py3-none-{platform}.whl"
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    assert (tmp_path / "site" / "segue" / "libsegue.so").read_bytes() == engine.read_bytes()
    environment = {k: v for k, v in os.environ.items() if k != "SEGUE_LIBRARY"}
    code = "import segue; print(segue.library_path()); print(segue.engine_version())"
    used = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env={**environment, "PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
        check=True,
    )
    path, version = used.stdout.split()
    assert path == str(tmp_path / "site" / "segue" / "libsegue.so")
    assert version == segue.__version__


def test_a_wheel_without_the_library_is_refused(tmp_path):
    pytest.importorskip("hatchling")
    built = build(tmp_path, SEGUE_LIBRARY=str(tmp_path / "gone.so"))
    assert built.returncode != 0
    assert "gone.so does not exist" in built.stderr


def test_importing_the_package_imports_numpy_only():
    code = """
import sys
before = set(sys.modules)
import segue, segue.metrics, segue.images
new = {m.split(".")[0] for m in set(sys.modules) - before}
print(sorted(new - set(sys.stdlib_module_names)))
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": os.path.dirname(os.path.dirname(segue.__file__))},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "['numpy', 'segue']"
