"""Files made by others, opened and rendered as they are."""

from __future__ import annotations

import os
from pathlib import Path

import bpy
import numpy as np

import agreement
import builders
from harness import SkipCaseError


def _open(name: str) -> None:
    default = Path(__file__).resolve().parents[4] / "shared"
    path = Path(os.environ.get("SEGUE_SHARED", default)) / "blend" / name
    if not path.exists():
        raise SkipCaseError(f"{path} is not there")
    bpy.ops.wm.open_mainfile(filepath=str(path))
    render = bpy.context.scene.render
    render.use_compositing = render.use_sequencer = render.use_border = False
    if bpy.app.version >= (5, 0, 0):
        render.image_settings.media_type = "IMAGE"


def _agrees(
    size: tuple[int, int], samples: int, mean: float, blocks: float, correlation: float
) -> None:
    """The open file looks as with Cycles."""
    found = agreement.compare(*agreement.render_both(*size, samples, samples))
    print(found)
    assert np.abs(found.mean).max() < mean and found.blocks < blocks, found
    assert found.correlation > correlation, found


def _renders(name: str, width: int, height: int) -> None:
    """For files that use nodes that Segue lacks: a picture with something in it."""
    _open(name)
    scene = builders.settings(width, height)
    scene.segue.samples = 4
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(builders.OUTPUT / "picture.exr")
    builders.render(write_still=True)
    picture = builders.read(builders.OUTPUT / "picture.exr")[..., :3]
    assert np.isfinite(picture).all() and picture.std() > 0.01


def case_clevr_studio() -> None:
    _open("clevr/base_scene.blend")
    _agrees((80, 60), 64, mean=0.006, blocks=0.012, correlation=0.999)


def case_cornell_box() -> None:
    _open("ostrava-optics/cornel_box.blend")
    _agrees((64, 64), 256, mean=0.008, blocks=0.03, correlation=0.9999)


def case_motion_blur() -> None:
    """The blur is left out, of Cycles' picture too."""
    _open("ostrava-optics/motion_blur.blend")
    bpy.context.scene.render.use_motion_blur = False
    _agrees((96, 48), 64, mean=0.004, blocks=0.01, correlation=0.9995)


def case_caustics() -> None:
    _renders("ostrava-optics/caustics.blend", 96, 54)


def case_depth_of_field() -> None:
    _renders("ostrava-optics/depth_of_field.blend", 96, 54)


def case_dispersion() -> None:
    _renders("ostrava-optics/wavelength.blend", 96, 54)
