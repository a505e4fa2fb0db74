"""Runs the tests in every supported Blender: `python tests/blender/run_versions.py [VERSION ...]`.

Each version gets an environment of its own, `.venv-bpy-VERSION` in the checkout (about 800 MB),
which is kept for the next run. A version whose Python is not installed is skipped with a word.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]

# Blender -> the Python that its module is built for.
VERSIONS = {
    "4.2": ("bpy==4.2.*", "python3.11"),
    "4.5": ("bpy==4.5.*", "python3.11"),
    "5.0": ("bpy==5.0.*", "python3.11"),
    "5.1": ("bpy==5.1.*", "python3.13"),
    "5.2": ("bpy==5.2.*", "python3.13"),
}


def environment(version: str) -> Path | None:
    """The Python that has this version's module; None where the Python it needs is missing."""
    requirement, interpreter = VERSIONS[version]
    folder = REPOSITORY / f".venv-bpy-{version}"
    python = folder / "bin" / "python"
    if (folder / "ready").exists():
        return python
    found = shutil.which(interpreter)
    # A version manager may know a name and have nothing behind it.
    if found is None or subprocess.run([found, "-c", ""], check=False).returncode:
        return None
    subprocess.run([found, "-m", "venv", "--clear", folder], check=True)
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*install, requirement], check=True)
    (folder / "ready").touch()
    return python


def main(versions: list[str]) -> int:
    """Run the tests of each version; the number of versions that failed."""
    failed = []
    for version in versions:
        print(f"Blender {version}", flush=True)
        python = environment(version)
        if python is None:
            print(f"skipped: {VERSIONS[version][1]} is not installed")
            continue
        command = ["env", f"SEGUE_BPY_PYTHON={python}", sys.executable, "-m", "pytest", "-q", HERE]
        command += ["-n", "auto", "--dist", "worksteal"]
        if subprocess.run(command, cwd=REPOSITORY, check=False).returncode:
            failed.append(version)
    if failed:
        print(f"failed in Blender {', '.join(failed)}")
    return len(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or list(VERSIONS)))
