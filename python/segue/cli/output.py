"""Where pictures go: file names of frames, EXR and tonemapped PNG."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .. import images
from ..render import Render
from .status import UsageError

_PATTERN = re.compile(r"#+|%0?(\d*)d")

#: What is done to linear colours on their way to a PNG.
TONEMAPPING = "Khronos PBR Neutral, then the sRGB curve"


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


def neutral(color: np.ndarray) -> np.ndarray:
    """The Khronos PBR Neutral tone mapper (2024 specification), linear Rec.709 to linear [0, 1].

    Colours up to about 0.8 stay as they are but for the 4 % that Fresnel reflection adds; above,
    the peak is compressed and the colour is drawn towards white.
    """
    start, desaturation = 0.8 - 0.04, 0.15
    color = np.maximum(np.nan_to_num(color, nan=0.0, posinf=1e6), 0.0)
    low = color.min(axis=-1, keepdims=True)
    offset = np.where(low < 0.08, low - 6.25 * low**2, 0.04)
    color = color - offset
    peak = color.max(axis=-1, keepdims=True)
    span = 1.0 - start
    compressed = 1.0 - span**2 / (np.maximum(peak, start) + span - start)
    scaled = color * compressed / np.maximum(peak, 1e-12)
    mix = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0)
    return np.where(peak < start, color, scaled * (1 - mix) + compressed * mix)


def to_srgb(color: np.ndarray) -> np.ndarray:
    """Linear [0, 1] to 8-bit sRGB (IEC 61966-2-1)."""
    color = np.clip(color, 0.0, 1.0)
    encoded = np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255.0).astype(np.uint8)
