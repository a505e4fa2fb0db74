"""Where pictures go: file names of frames, EXR and tonemapped PNG."""

from __future__ import annotations

import re
from pathlib import Path

from .. import images
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


def check_path(path: Path) -> None:
    """Refuses what cannot be written, before anything is rendered.

    Raises:
        UsageError: the suffix is unknown, or the folder does not exist.
    """
    if path.suffix.lower() not in (".exr", ".png"):
        raise UsageError(f"{path}: the output has to be an .exr or a .png")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: the folder {path.parent} does not exist")


def write(render: Render, path: Path, attributes: dict[str, str]) -> list[Path]:
    """Writes the EXR, and the PNG if that was asked for. Returns what was written."""
    exr = path.with_suffix(".exr") if path.suffix.lower() == ".png" else path
    render.write_exr(exr, attributes=attributes)
    if exr == path:
        return [exr]
    images.write_png(path, to_srgb(neutral(render.read_pass("Combined")[:, :, :3])))
    return [exr, path]
