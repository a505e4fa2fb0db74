"""Importing a stage: everything that one frame of it shows, into a scene."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import SegueError
from ..scene import Scene
from ._pxr import Tf, Usd, UsdGeom, reason
from .bounds import Bounds
from .camera import CameraError, Frame, exposure_scale, find_camera, framing_camera, read_camera
from .default_lights import add_default_lights, can_shine
from .geometry import Geometry, geometry_light_targets
from .inputs import Inputs
from .light import Lights, stage_is_z_up
from .material import Materials
from .motion import report_motion
from .properties import Properties
from .render_settings import read_settings
from .report import Report
from .texture import Textures
from .walk import Walker, is_light


class StageError(SegueError, ValueError):
    """A stage could not be opened, or has not what was asked of it."""


@dataclass
class Imported:
    """What came of a stage.

    Attributes:
        scene: ready to be rendered.
        camera: path of the camera used, or a word for one that was made up.
        resolution: width and height of the picture.
        crop: part of it to render, in pixels from the top left, or None.
        frame: time code that was read, or None for the stage's default.
        report: what could not be taken as it stands.
        counts: prims drawn and hidden.
    """

    scene: Scene
    camera: str
    resolution: tuple[int, int]
    crop: tuple[int, int, int, int] | None
    frame: float | None
    report: Report
    counts: dict[str, int] = field(default_factory=dict)

    def settings(self) -> dict[str, Any]:
        """The render settings that follow from the stage."""
        result: dict[str, Any] = {"resolution": list(self.resolution)}
        if self.crop is not None:
            result["crop"] = list(self.crop)
        return result


def open_stage(path: str | os.PathLike[str]) -> Usd.Stage:
    """Opens a stage with all its payloads.

    Raises:
        StageError: it does not exist or is not USD.
    """
    name = os.fspath(path)
    if not os.path.exists(name):
        raise StageError(f"{name} does not exist")
    try:
        stage = Usd.Stage.Open(name)
    except Tf.ErrorException as error:
        raise StageError(f"{name} cannot be opened as USD: {reason(error)}") from None
    if not stage:
        raise StageError(f"{name} cannot be opened as USD")
    return stage


def load(
    path_or_stage: str | os.PathLike[str] | Usd.Stage,
    *,
    frame: float | None = None,
    camera: str | None = None,
    purposes: Iterable[str] | None = None,
    resolution: tuple[int, int] | None = None,
    scene: Scene | None = None,
) -> Imported:
    """Imports a stage.

    Nothing is rescaled: lengths stay in the stage's units and radiance in UsdLux's, whatever
    `metersPerUnit` says.

    Args:
        path_or_stage: a file, or a stage that is open.
        frame: time code; None: the stage's start, or the earliest values where it names none.
        camera: path or name of a camera prim; None: the render settings' one, else the first.
        purposes: UsdGeom purposes to draw; None: the render settings' ones, else default and
            render.
        resolution: width and height; None: the render settings' ones, else 1280 pixels wide.
        scene: scene to add to; None: a new one.

    Raises:
        StageError: the stage cannot be opened, or the camera does not exist or has no place.
    """
    is_path = isinstance(path_or_stage, (str, os.PathLike))
    stage = open_stage(path_or_stage) if is_path else path_or_stage
    time = _time(stage, frame)
    report = Report()
    _report_composition(stage, report)
    properties = Properties(time, report)
    target = Scene() if scene is None else scene

    settings = read_settings(stage, properties)
    purposes = settings.purposes if purposes is None else tuple(purposes)
    z_up = stage_is_z_up(stage)
    bounds = Bounds()
    try:
        camera_prim = find_camera(stage, camera or "", settings, report)
        # Light transport is linear: a camera's exposure is a factor on all that emits.
        gain = exposure_scale(UsdGeom.Camera(camera_prim), properties) if camera_prim else 1.0
        shot = read_camera(camera_prim, properties, settings, resolution) if camera_prim else None
    except CameraError as error:
        raise StageError(str(error)) from None
    if camera_prim and settings.has_shutter:
        report_motion(camera_prim, properties)
    with np.errstate(all="ignore"):  # what is not finite is looked for where it matters
        counts = _fill(target, stage, properties, purposes, gain, z_up, bounds)
        if shot is None:
            report.note("", "the stage has no camera", "one was made that sees all of it")
            shot = framing_camera(bounds, settings, resolution, z_up)
    target.set_camera(shot.name, shot.camera)
    if not counts["lights"] and not counts["emissive gprims"] and not can_shine(stage):
        report.note("", "the stage has no light", "a grey sky and a lamp by the camera were added")
        add_default_lights(target, np.reshape(shot.camera["transform"], (4, 4)), gain)
    value = None if time.IsDefault() or time.IsEarliestTime() else time.GetValue()
    return Imported(target, shot.name, shot.resolution, shot.crop, value, report, counts)


def _fill(
    scene: Scene,
    stage: Usd.Stage,
    properties: Properties,
    purposes: tuple[str, ...],
    gain: float,
    z_up: bool,
    bounds: Bounds,
) -> dict[str, int]:
    """Adds the stage's lights and geometry; returns how many of what."""
    time, report = properties.time, properties.report
    inputs = Inputs(time, report)
    textures = Textures(scene, inputs)
    materials = Materials(scene, textures, inputs)
    lights = Lights(scene, textures, properties, gain, z_up, bounds)
    geometry = Geometry(scene, materials, lights, properties, gain, bounds)
    items = Walker(stage, time, purposes, report).items()
    geometry.geometry_lights = geometry_light_targets([i.prim for i in items])
    for item in items:
        if item.prim.GetTypeName() == "GeometryLight":
            continue
        try:
            if is_light(item.prim):
                lights.add(item.prim, item.transforms)
            else:
                geometry.add(item)
        except Tf.ErrorException as error:
            report.warning(item.prim, reason(error), "left out")
    return {"gprims": len(items), "lights": lights.count, "emissive gprims": geometry.emitters}


def _time(stage: Usd.Stage, frame: float | None) -> Usd.TimeCode:
    if frame is not None:
        return Usd.TimeCode(frame)
    if stage.HasAuthoredTimeCodeRange():
        return Usd.TimeCode(stage.GetStartTimeCode())
    return Usd.TimeCode.EarliestTime()


def _report_composition(stage: Usd.Stage, report: Report) -> None:
    """References and payloads that could not be followed."""
    if not hasattr(stage, "GetCompositionErrors"):
        return
    for error in stage.GetCompositionErrors():
        report.warning("", " ".join(str(error).split()), "ignored")


__all__ = ["Frame", "Imported", "StageError", "load", "open_stage"]
