"""Renders one scene with Cycles and with Segue, and compares the pictures."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np

import builders


@dataclass(frozen=True)
class Comparison:
    """How two pictures differ. All figures are relative to the mean of Cycles' picture.

    `mean`: difference of the means of each channel. `blocks`: root mean square difference of the
    means of square blocks. `worst`: largest such difference. `correlation`: of the blocks.
    """

    mean: np.ndarray
    blocks: float
    worst: float
    correlation: float

    def __str__(self) -> str:
        mean = ", ".join(f"{value:+.4f}" for value in self.mean)
        return (
            f"mean {mean}; blocks {self.blocks:.4f}, worst {self.worst:.3f}, "
            f"correlation {self.correlation:.5f}"
        )


def _blocks(picture: np.ndarray, size: int) -> np.ndarray:
    height, width = (length // size * size for length in picture.shape[:2])
    shape = (height // size, size, width // size, size, 3)
    return picture[:height, :width].reshape(shape).mean(axis=(1, 3))


def compare(reference: np.ndarray, picture: np.ndarray, size: int = 8) -> Comparison:
    """Compare the colours of two pictures."""
    a, b = (values[..., :3].astype(np.float64) for values in (reference, picture))
    scale = a.mean()
    blocks_a, blocks_b = _blocks(a, size), _blocks(b, size)
    difference = np.abs(blocks_a - blocks_b)
    return Comparison(
        mean=(b.mean(axis=(0, 1)) - a.mean(axis=(0, 1))) / a.mean(axis=(0, 1)),
        blocks=float(np.sqrt((difference**2).mean()) / scale),
        worst=float(difference.max() / scale),
        correlation=float(np.corrcoef(blocks_a.ravel(), blocks_b.ravel())[0, 1]),
    )


def _cycles(scene: bpy.types.Scene, samples: int) -> None:
    """Cycles without anything that trades correctness for speed or beauty."""
    options = scene.cycles
    options.device = "CPU"
    options.samples = samples
    options.seed = 7
    options.use_denoising = options.use_adaptive_sampling = False
    options.sample_clamp_direct = options.sample_clamp_indirect = 0.0
    options.caustics_reflective = options.caustics_refractive = True
    options.blur_glossy = 0.0
    for bounces in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(options, f"{bounces}_bounces", 64)
    options.pixel_filter_type = "BOX"
    options.filter_width = 1.0


def render_both(
    width: int,
    height: int,
    cycles_samples: int,
    segue_samples: int,
    integrator: str = "path",
) -> tuple[np.ndarray, np.ndarray]:
    """The scene as Cycles and as Segue render it: (height, width, 4), linear.

    By default Segue traces paths, as Cycles does: at so few pixels the kernel of the segment
    method, which is some pixels wide, would be part of the comparison.
    """
    pictures = []
    for engine in ("CYCLES", "SEGUE"):
        scene = builders.settings(width, height, engine)
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.render.filepath = str(builders.OUTPUT / f"{engine}.exr")
        _cycles(scene, cycles_samples)
        scene.segue.samples = segue_samples
        scene.segue.integrator = integrator
        scene.segue.pixel_filter = "box"
        scene.segue.filter_width = 1.0
        builders.render(write_still=True)
        pictures.append(builders.read(builders.OUTPUT / f"{engine}.exr"))
    return pictures[0], pictures[1]
