"""Where pictures go: file names of frames, EXR and tonemapped PNG."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from .. import images
from ..errors import OutputError
from ..render import Render
from ..tonemapping import neutral, to_srgb
from .status import UsageError

_PATTERN = re.compile(r"#+|%0?(\d*)d")


def frame_path(path: Path, frame: float | None, many: bool) -> Path:
    """The file of a frame: its number replaces #### or %04d, or goes before the suffix."""
    if frame is None or not (many or _PATTERN.search(path.name)):
        return path
    number = round(frame)
    match = _PATTERN.search(path.name)
    if match is None:
        return path.with_name(f"{path.stem}.{number:04d}{path.suffix}")
    digits = len(match[0]) if match[0].startswith("#") else int(match[1] or 1)
    return path.with_name(
        path.name[: match.start()] + f"{number:0{digits}d}" + path.name[match.end() :]
    )


def files(path: Path) -> list[Path]:
    """What is written for a picture of that name: the EXR, and the PNG if that was asked for."""
    return [path.with_suffix(".exr"), path] if path.suffix.lower() == ".png" else [path]


def check_path(*paths: Path) -> None:
    """Refuses what cannot be written, before anything is rendered.

    Raises:
        UsageError: the suffix is unknown, or the folder does not exist.
        OutputError: a file is a folder, or its folder takes no files.
    """
    for path in paths:
        if path.suffix.lower() not in (".exr", ".png"):
            raise UsageError(f"{path}: the output has to be an .exr or a .png")
        if not path.parent.is_dir():
            raise UsageError(f"{path}: the folder {path.parent} does not exist")
    check_files(*(file for path in paths for file in files(path)))


def check_files(*paths: Path) -> None:
    """Refuses files that cannot be written. Each folder is tried once, however many go there.

    Raises:
        OutputError: one is a folder, or its folder takes no files.
    """
    for path in paths:
        if path.is_dir():
            raise OutputError(f"{path} cannot be written: it is a folder")
    for folder, path in {path.parent: path for path in reversed(paths)}.items():
        _try(folder, path)


def _try(folder: Path, path: Path) -> None:
    """Refuses `path` if its folder takes no files."""
    try:
        # Permissions do not tell: what holds for a user need not hold for a file system.
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".segue-"):
            pass
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror}") from None


def write(render: Render, path: Path, attributes: dict[str, str]) -> list[Path]:
    """Writes the EXR, and the PNG if that was asked for. Returns what was written."""
    written = files(path)
    render.write_exr(written[0], attributes=attributes)
    for png in written[1:]:
        images.write_png(png, to_srgb(neutral(render.read_pass("Combined")[:, :, :3])))
    return written
