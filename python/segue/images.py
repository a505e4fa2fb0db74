"""Pictures from files, through OpenImageIO, in their own pixel type."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from .errors import OutputError


class ImageError(Exception):
    """A picture could not be read; the text says why."""


@dataclass(frozen=True)
class Picture:
    """Pixels and what their file says of them.

    Attributes:
        pixels: (h, w, c), 1 to 4 channels, uint8, uint16, float16 or float32, row 0 on top; colour
            is not multiplied by alpha, and not decoded.
        wrap: the file's word on tiling in s and t, as in OpenEXR's `wrapmodes`, or "".
    """

    pixels: np.ndarray
    wrap: str

    @property
    def is_8_bit(self) -> bool:
        """Whether the file holds bytes."""
        return self.pixels.dtype == np.uint8

    @property
    def has_alpha(self) -> bool:
        """Whether there is an alpha channel that is not 1 everywhere."""
        if self.pixels.shape[2] not in (2, 4):
            return False
        alpha = self.pixels[:, :, -1]
        one = np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1
        return bool((alpha != one).any())


def read(path: str) -> Picture:
    """Reads a file, or one in a package as USD writes it: `asset.usdz[texture.png]`.

    Raises:
        ImageError: it is missing, broken, or OpenImageIO is not installed.
    """
    if not path.endswith("]") or "[" not in path:
        return _read_file(path)
    outer, inner = path.split("[", 1)
    try:
        data = Path(outer).read_bytes()
        # Packages may be nested: a.usdz[b.usdz[c.png]].
        names = inner.rstrip("]").split("[")
        for name in names:
            with zipfile.ZipFile(BytesIO(data)) as archive:
                data = archive.read(name)
    except (OSError, KeyError, zipfile.BadZipFile) as error:
        raise ImageError(f"{path}: {error}") from error
    with tempfile.NamedTemporaryFile(suffix=Path(names[-1]).suffix) as file:
        file.write(data)
        file.flush()
        return _read_file(file.name)


def _oiio() -> Any:
    try:
        import OpenImageIO
    except ImportError as error:
        raise ImageError("pictures need OpenImageIO: install segue[images]") from error
    return OpenImageIO


def _read_file(path: str) -> Picture:
    oiio = _oiio()
    config = oiio.ImageSpec()
    # Without this the reader multiplies the colours of a PNG by its alpha.
    config["oiio:UnassociatedAlpha"] = 1
    file = oiio.ImageInput.open(path, config)
    if file is None:
        raise ImageError(oiio.geterror() or f"{path} cannot be opened")
    try:
        spec = file.spec()
        if spec.deep:
            raise ImageError(f"{path} is a deep picture")
        channels = _channels(list(spec.channelnames))
        base = str(spec.format)
        kind = {"uint8": "uint8", "uint16": "uint16", "half": "half"}.get(base, "float")
        pixels = file.read_image(0, 0, 0, spec.nchannels, kind)
        if pixels is None:
            raise ImageError(file.geterror() or f"{path} cannot be read")
        wrap = spec.getattribute("wrapmodes") or ""
    finally:
        file.close()
    pixels = np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels)
    if channels != list(range(spec.nchannels)):
        pixels = np.ascontiguousarray(pixels[:, :, channels])
    return Picture(pixels, str(wrap))


def resized(pixels: np.ndarray, width: int, height: int) -> np.ndarray:
    """A picture (h, w, c) at another size, of the same pixel type, filtered."""
    if pixels.shape[:2] == (height, width):
        return pixels
    oiio = _oiio()
    channels = pixels.shape[2]
    result = oiio.ImageBufAlgo.resize(
        oiio.ImageBuf(np.ascontiguousarray(pixels)),
        roi=oiio.ROI(0, width, 0, height, 0, 1, 0, channels),
    )
    return np.asarray(result.get_pixels(str(pixels.dtype).replace("float16", "half"))).reshape(
        height, width, channels
    )


def _channels(names: list[str]) -> list[int]:
    """Which channels to take, in the order grey, alpha or red, green, blue, alpha."""
    lower = [n.lower().rsplit(".", 1)[-1] for n in names]
    if all(c in lower for c in "rgb"):
        wanted = [lower.index(c) for c in "rgb"]
        return wanted + ([lower.index("a")] if "a" in lower else [])
    return list(range(min(len(names), 4)))


def read_rgb(path: str) -> np.ndarray:
    """The linear colours of an EXR file: (h, w, 3) float32, of `R G B` or `Combined.R G B`.

    Raises:
        ImageError: it is missing, broken, or holds no colours.
    """
    oiio = _oiio()
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise ImageError(oiio.geterror() or f"{path} cannot be opened")
    try:
        spec = file.spec()
        names = list(spec.channelnames)
        for prefix in ("", "Combined.", "ViewLayer.Combined.", "RenderLayer.Combined."):
            wanted = [prefix + c for c in "RGB"]
            if all(w in names for w in wanted):
                break
        else:
            raise ImageError(f"{path} has no channels R, G and B, only {', '.join(names)}")
        pixels = file.read_image(0, 0, 0, spec.nchannels, "float")
        if pixels is None:
            raise ImageError(file.geterror() or f"{path} cannot be read")
    finally:
        file.close()
    pixels = np.asarray(pixels, np.float32).reshape(spec.height, spec.width, -1)
    return np.ascontiguousarray(pixels[:, :, [names.index(w) for w in wanted]])


def read_attribute(path: str, name: str) -> Any:
    """An entry of a picture's header, None where there is none.

    Raises:
        ImageError: the file is missing or broken.
    """
    oiio = _oiio()
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise ImageError(oiio.geterror() or f"{path} cannot be opened")
    try:
        return file.spec().getattribute(name)
    finally:
        file.close()


def write_exr(
    path: Path, layers: Mapping[str, np.ndarray], attributes: Mapping[str, str | float]
) -> None:
    """Writes layers of one size, (h, w, 3) each, as 32-bit floats: `Combined.R` and so on.

    The file takes its place when it is complete.

    Raises:
        OutputError: it cannot be written.
    """
    oiio = _oiio()
    height, width, _ = next(iter(layers.values())).shape
    spec = oiio.ImageSpec(width, height, 3 * len(layers), "float")
    spec.channelnames = [f"{layer}.{c}" for layer in layers for c in "RGB"]
    spec["compression"] = "zip"
    for name, value in attributes.items():
        spec[name] = value
    pixels = np.concatenate([np.asarray(p, np.float32) for p in layers.values()], axis=2)
    unfinished = path.with_name(f".{path.stem}.unfinished.exr")
    try:
        _write(oiio, unfinished, spec, pixels, path)
        unfinished.replace(path)
    except OSError:
        unfinished.unlink(missing_ok=True)
        raise


def write_png(path: Path, pixels: np.ndarray) -> None:
    """Writes (h, w, 3) uint8 sRGB pixels.

    Raises:
        OutputError: the file cannot be written.
    """
    oiio = _oiio()
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, "uint8")
    spec["oiio:ColorSpace"] = "sRGB"
    _write(oiio, path, spec, pixels, path)


def _write(oiio: Any, path: Path, spec: Any, pixels: np.ndarray, name: Path) -> None:
    """Writes a picture; failures are told of the file called `name`."""
    file = oiio.ImageOutput.create(str(path))
    if file is None:
        raise OutputError(f"{name} cannot be written: {oiio.geterror()}")
    written = file.open(str(path), spec) and file.write_image(np.ascontiguousarray(pixels))
    if not (file.close() and written):
        reason = file.geterror() or "the folder or the disk does not take it"
        raise OutputError(f"{name} cannot be written: {reason}")
