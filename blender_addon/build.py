"""Builds the extension: `python blender_addon/build.py [--wheel FILE] [--output DIR]`.

The zip holds the add-on and the wheel of the `segue` package, which carries the engine's shared
library; Blender unpacks the wheel when the extension is installed. Without `--wheel` the wheel is
built from `python/`, which needs the library to be built (`make`) and pip.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parent
# What is of no use to Blender.
LEFT_OUT = {"build.py", "ruff.toml"}
# Zip archives cannot hold earlier times; a fixed one makes equal sources give equal archives.
EPOCH = (1980, 1, 1, 0, 0, 0)


def build_wheel(output: Path) -> Path:
    """Build the wheel of the `segue` package into `output`."""
    source = REPOSITORY / "python"
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", output]
    subprocess.run([*command, source], check=True)
    (wheel,) = output.glob("segue-*.whl")
    return wheel


def platform_of(wheel: Path) -> str:
    """Blender's name of the platform that a wheel is for, from its file name."""
    tag = wheel.stem.rsplit("-", 1)[1]
    if "linux" in tag:
        return "linux-arm64" if tag.endswith("aarch64") else "linux-x64"
    if tag.startswith("macosx"):
        return "macos-arm64" if tag.endswith("arm64") else "macos-x64"
    if tag.startswith("win"):
        return "windows-arm64" if tag.endswith("arm64") else "windows-x64"
    raise SystemExit(f"{wheel.name} is for no platform that Blender knows")


def manifest(wheel: Path) -> str:
    """The manifest, with the wheel that is packed and its platform."""
    text = (HERE / "blender_manifest.toml").read_text()
    text = re.sub(r"(?m)^wheels = .*$", f'wheels = ["./wheels/{wheel.name}"]', text)
    return re.sub(r"(?m)^platforms = .*$", f'platforms = ["{platform_of(wheel)}"]', text)


def version() -> str:
    """Version of the extension."""
    match = re.search(r'(?m)^version = "(.*)"$', (HERE / "blender_manifest.toml").read_text())
    assert match
    return match[1]


def build_zip(wheel: Path, output: Path) -> Path:
    """Pack the add-on and the wheel into an archive in `output`."""
    target = output / f"segue-blender-{version()}-{platform_of(wheel)}.zip"
    output.mkdir(parents=True, exist_ok=True)
    files = {
        path.relative_to(HERE).as_posix(): path.read_bytes()
        for path in sorted(HERE.rglob("*"))
        if path.suffix in {".py", ".md"} and path.name not in LEFT_OUT
    }
    files["blender_manifest.toml"] = manifest(wheel).encode()
    files[f"wheels/{wheel.name}"] = wheel.read_bytes()
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        files[name] = (REPOSITORY / name).read_bytes()
    with zipfile.ZipFile(target, "w") as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data)
    return target


def main() -> None:
    """Build the extension and print the path of its archive."""
    parser = argparse.ArgumentParser(description="Builds the Blender extension.")
    parser.add_argument("--wheel", type=Path, help="wheel of the segue package; default: build it")
    parser.add_argument(
        "--output", type=Path, default=REPOSITORY / "dist", help="folder of the zip"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        wheel = options.wheel or build_wheel(Path(folder))
        print(build_zip(wheel, options.output))


if __name__ == "__main__":
    main()
