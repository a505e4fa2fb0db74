"""Procedural images: wood, tiles, plaster and skies. All tile, and come from fixed seeds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO

from .mesh import Array


def noise(shape: tuple[int, int], seed: int, falloff: float = 1.6, stretch: float = 1.0) -> Array:
    """Tileable noise of spectrum 1/f^falloff, mean 0 and deviation 1, stretched along columns."""
    rng = np.random.default_rng(seed)
    fy = np.fft.fftfreq(shape[0])[:, None] * shape[0]
    fx = np.fft.rfftfreq(shape[1])[None, :] * shape[1]
    f = np.hypot(fy, fx * stretch)
    f[0, 0] = 1.0
    amplitude = f**-falloff
    amplitude[0, 0] = 0.0
    phase = rng.uniform(0, 2 * np.pi, amplitude.shape)
    field = np.fft.irfft2(amplitude * np.exp(1j * phase), s=shape)
    return (field - field.mean()) / field.std()


def ramp(value: Array, stops: list[tuple[float, tuple[float, float, float]]]) -> Array:
    """Colours (sRGB-encoded) interpolated between stops by a scalar field."""
    at = [s for s, _ in stops]
    return np.stack([np.interp(value, at, [c[i] for _, c in stops]) for i in range(3)], axis=-1)


def planks(
    size: int,
    rows: int,
    stops: list[tuple[float, tuple[float, float, float]]],
    seed: int,
    gap: float = 0.012,
) -> Array:
    """Wooden boards along x: `rows` of them, each with its own grain and shade."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] / size
    row = np.minimum((y * rows).astype(int), rows - 1)
    fine = noise((size, size), seed + 1, 0.8, 40.0)
    broad = noise((size, size), seed + 2, 1.5, 14.0)
    shift = rng.integers(0, size, (rows, 2))
    shade = rng.normal(0, 0.35, rows)
    columns = np.arange(size)[None, :]
    lines = np.arange(size)[:, None]
    pick = (lines + shift[row, 0]) % size, (columns + shift[row, 1]) % size
    growth = np.sin(broad[pick] * 5.0 + fine[pick] * 0.6)
    value = 0.5 + 0.13 * growth + 0.09 * fine[pick] + 0.32 * shade[row]
    colour = ramp(value, stops)
    across = np.abs(y * rows - np.round(y * rows)) / rows
    joint = (x - rng.uniform(0, 1, rows)[row]) % 1.0
    along = np.minimum(joint, 1 - joint)
    line = np.minimum(across, along * 0.8) * rows
    return colour * (0.35 + 0.65 * np.clip(line / gap / 2, 0, 1))[..., None]


def tiles(
    size: int,
    count: int,
    palette: list[tuple[float, float, float]],
    grout: tuple[float, float, float],
    seed: int,
    joint: float = 0.06,
) -> Array:
    """Square tiles, each of a palette colour with a slight shade of its own, in grout."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] / size * count
    iy, ix = y.astype(int), x.astype(int)
    which = rng.integers(0, len(palette), (count, count))[iy, ix]
    shade = rng.normal(1, 0.07, (count, count))[iy, ix]
    cloud = 1 + 0.03 * noise((size, size), seed + 1)
    colour = np.array(palette)[which] * (shade * cloud)[..., None]
    edge = np.minimum(np.minimum(x % 1, 1 - x % 1), np.minimum(y % 1, 1 - y % 1))
    inside = np.clip((edge - joint / 2) / 0.02 + 0.5, 0, 1)[..., None]
    return colour * inside + np.array(grout) * (1 - inside)


def plaster(size: int, colour: tuple[float, float, float], depth: float, seed: int) -> Array:
    """A painted wall: clouds and trowel strokes."""
    cloud = noise((size, size), seed, 1.7) + 0.5 * noise((size, size), seed + 1, 1.1, 3.0)
    return np.array(colour) * (1 + depth * cloud)[..., None]


def checker(size: int, a: Array, b: Array, count: int, joint: float = 0.012) -> Array:
    """A chessboard of two stones, given as images of the same size."""
    y, x = np.mgrid[0:size, 0:size] / size * count
    odd = ((x.astype(int) + y.astype(int)) % 2)[..., None]
    edge = np.minimum(np.minimum(x % 1, 1 - x % 1), np.minimum(y % 1, 1 - y % 1))
    return np.where(odd, a, b) * (0.55 + 0.45 * np.clip(edge / joint, 0, 1))[..., None]


def marble(size: int, stops: list[tuple[float, tuple[float, float, float]]], seed: int) -> Array:
    """Stone with veins where a warped noise crosses zero."""
    warp = noise((size, size), seed, 1.5)
    vein = np.abs(noise((size, size), seed + 1, 1.7) + 0.25 * warp)
    value = np.clip(1 - vein * 3.0, 0, 1) ** 3 + 0.06 * noise((size, size), seed + 2, 1.3)
    return ramp(value, stops)


def terrazzo(
    size: int,
    ground: tuple[float, float, float],
    palette: list[tuple[float, float, float]],
    chips: int,
    seed: int,
) -> Array:
    """Chips of stone, convex polygons of many sizes, set in a ground."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:size, 0:size] / size
    image = np.tile(np.array(ground), (size, size, 1))
    for radius in np.sort(rng.lognormal(-4.5, 0.5, chips))[::-1]:
        at = rng.uniform(0, 1, 2)
        # Wrapped around, so that the image tiles.
        dx, dy = (x - at[0] + 0.5) % 1 - 0.5, (y - at[1] + 0.5) % 1 - 0.5
        angle = np.sort(rng.uniform(0, 2 * np.pi, 6))
        reach = radius * rng.uniform(0.7, 1.2, 6)
        inside = np.all(
            [np.cos(a) * dx + np.sin(a) * dy < r for a, r in zip(angle, reach, strict=True)], 0
        )
        inside &= np.hypot(dx, dy) < 2.2 * radius
        image[inside] = palette[rng.integers(len(palette))]
    return image


def sky(
    width: int,
    zenith: tuple[float, float, float],
    horizon: tuple[float, float, float],
    ground: tuple[float, float, float],
    clouds: float,
    seed: int,
) -> Array:
    """A lat-long sky in linear radiance: a gradient, soft clouds, and a plain ground below."""
    height = width // 2
    elevation = np.pi / 2 - (np.arange(height) + 0.5) / height * np.pi
    up = np.clip(np.sin(elevation), 0, 1)[:, None, None]
    air = np.array(zenith) * up**0.5 + np.array(horizon) * (1 - up**0.5)
    cover = np.clip(noise((height, width), seed, 1.6, 0.4), 0, 2)[..., None] * up**0.7
    air = air * (1 - 0.3 * clouds * cover) + clouds * cover * np.array([1.0, 0.97, 0.93]) * np.mean(
        horizon
    )
    below = (elevation < 0)[:, None, None]
    return np.where(below, np.array(ground), air)


def save_colour(folder: Path, name: str, image: Array) -> None:
    """Writes an sRGB-encoded image as JPEG."""
    spec = OpenImageIO.ImageSpec(image.shape[1], image.shape[0], 3, OpenImageIO.UINT8)
    spec.attribute("Compression", "jpeg:88")
    spec.attribute("oiio:ColorSpace", "srgb_rec709_scene")
    _write(folder / f"{name}.jpg", spec, np.clip(image, 0, 1))


def save_data(folder: Path, name: str, field: Array) -> None:
    """Writes a scalar field as a grey PNG, which keeps its values as they are."""
    spec = OpenImageIO.ImageSpec(field.shape[1], field.shape[0], 1, OpenImageIO.UINT8)
    _write(folder / f"{name}.png", spec, np.clip(field, 0, 1)[..., None])


def save_radiance(folder: Path, name: str, image: Array) -> None:
    """Writes linear radiance as a half-float OpenEXR file."""
    spec = OpenImageIO.ImageSpec(image.shape[1], image.shape[0], 3, OpenImageIO.HALF)
    spec.attribute("compression", "zip")
    _write(folder / f"{name}.exr", spec, image)


def _write(path: Path, spec: OpenImageIO.ImageSpec, image: Array) -> None:
    # A date of its own would make every run's file differ.
    spec.attribute("DateTime", "2000:01:01 00:00:00")
    out = OpenImageIO.ImageOutput.create(str(path))
    if out is None or not out.open(str(path), spec):
        raise OSError(f"cannot write {path}: {OpenImageIO.geterror()}")
    if not out.write_image(np.ascontiguousarray(image, np.float32)):
        raise OSError(f"cannot write {path}: {out.geterror()}")
    out.close()
