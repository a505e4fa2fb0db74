"""Cameras: what the picture shows, and at which size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._pxr import Sdf, Usd, UsdGeom
from .bounds import Bounds
from .properties import Properties
from .render_settings import Settings
from .report import Report
from .transform import column_matrix, flat, is_usable, without_scale, world_matrix

#: UsdGeomCamera's apertures and focal length are in tenths of a scene unit.
TENTH = 0.1
#: No lens is longer, or shorter than its inverse; beyond, arithmetic overflows.
LONGEST = 1e9
#: Width of a picture for which nothing else is said.
DEFAULT_WIDTH = 1280


class CameraError(Exception):
    """A camera does not exist or cannot be used; the text names it."""


def find_camera(
    stage: Usd.Stage, wanted: str, settings: Settings, report: Report
) -> Usd.Prim | None:
    """The camera that was asked for, else the settings' one, else the stage's first.

    Raises:
        CameraError: the camera that was asked for does not exist.
    """
    if wanted:
        return _named_camera(stage, wanted)
    if settings.camera:
        prim = stage.GetPrimAtPath(settings.camera)
        if prim and prim.IsA(UsdGeom.Camera):
            return prim
        report.warning("", f"the render settings name the camera {settings.camera}", "not found")
    cameras = _cameras(stage)
    if len(cameras) > 1:
        report.note(cameras[0], f"the stage has {len(cameras)} cameras", "the first one is used")
    return cameras[0] if cameras else None


def _cameras(stage: Usd.Stage) -> list[Usd.Prim]:
    """The stage's cameras; those inside instances only where there are no others."""
    found = [p for p in stage.Traverse() if p.IsA(UsdGeom.Camera)]
    if found:
        return found
    proxies = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
    return [p for p in stage.Traverse(proxies) if p.IsA(UsdGeom.Camera)]


def _named_camera(stage: Usd.Stage, wanted: str) -> Usd.Prim:
    if Sdf.Path.IsValidPathString(wanted) and wanted.startswith("/"):
        prim = stage.GetPrimAtPath(wanted)
        if prim and prim.IsA(UsdGeom.Camera):
            return prim
    cameras = _cameras(stage)
    for prim in cameras:
        if prim.GetName() == wanted:
            return prim
    known = ", ".join(str(p.GetPath()) for p in cameras) or "none"
    raise CameraError(f"there is no camera {wanted}; the stage's cameras: {known}")


def conform(
    window: tuple[float, float, float, float], aspect: float, policy: str
) -> tuple[float, float, float, float]:
    """The camera's window (x0, x1, y0, y1) fitted to a picture of another aspect ratio.

    UsdRender's aspectRatioConformPolicy; the window keeps its centre.
    """
    x0, x1, y0, y1 = window
    width, height = x1 - x0, y1 - y0
    own = width / height
    wider = {
        "expandAperture": aspect > own,
        "cropAperture": aspect < own,
        "adjustApertureWidth": True,
        "adjustApertureHeight": False,
    }.get(policy)
    if wider is None:  # adjustPixelAspectRatio: the window is stretched over the picture
        return window
    if wider:
        width = height * aspect
    else:
        height = width / aspect
    cx, cy = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    return cx - 0.5 * width, cx + 0.5 * width, cy - 0.5 * height, cy + 0.5 * height


def exposure_scale(camera: UsdGeom.Camera, properties: Properties) -> float:
    """The factor from radiance to pixel values.

    Newer USD has a photometric model of which `exposure` is one part; older has the latter alone.
    """
    if hasattr(camera, "ComputeLinearExposureScale"):
        scale = float(camera.ComputeLinearExposureScale(properties.time))
    else:
        scale = float(np.exp2(float(properties.get(camera.GetExposureAttr()))))
    if 0 <= scale < math.inf:
        return scale
    properties.report.warning(
        camera.GetPrim(), f"an exposure that multiplies by {scale:g}", "1 is used"
    )
    return 1.0


@dataclass(frozen=True)
class Frame:
    """A camera as `Scene.set_camera` takes it, and the picture's size.

    Attributes:
        name: path of the camera, or a word for one that was made up.
        camera: the ABI's description.
        resolution: width and height of the whole film.
        crop: x0, y0, x1, y1 in pixels from the top left, or None for the whole film.
    """

    name: str
    camera: dict[str, Any]
    resolution: tuple[int, int]
    crop: tuple[int, int, int, int] | None


def _is_length(value: float) -> bool:
    """Whether a lens can have this size."""
    return 1.0 / LONGEST < value < LONGEST


def read_camera(
    prim: Usd.Prim,
    properties: Properties,
    settings: Settings,
    resolution: tuple[int, int] | None,
) -> Frame:
    """A UsdGeomCamera. A resolution given by hand keeps the picture's width in the scene.

    Raises:
        CameraError: it stands nowhere.
    """
    camera, get, report = UsdGeom.Camera(prim), properties.get, properties.report
    world = column_matrix(world_matrix(prim, properties.time, report))
    if not is_usable(world[None])[0]:
        raise CameraError(
            f"the transformation of the camera {prim.GetPath()} is singular or not finite"
        )
    rigid, lengths = without_scale(world)
    if not np.allclose(lengths, lengths[0], rtol=1e-4):
        report.unsupported(prim, "a camera with a non-uniform scale", "its scale is left away")
    focal = float(get(camera.GetFocalLengthAttr()))
    width = float(get(camera.GetHorizontalApertureAttr()))
    height = float(get(camera.GetVerticalApertureAttr()))
    if not (_is_length(width) and _is_length(height)):
        report.warning(prim, f"an aperture of {width:g} x {height:g}", "20.955 x 15.2908 is used")
        width, height = 20.955, 15.2908
    orthographic = get(camera.GetProjectionAttr()) == UsdGeom.Tokens.orthographic
    if not orthographic and not _is_length(focal):
        report.warning(prim, f"a focal length of {focal:g}", "50 is used")
        focal = 50.0
    x = float(get(camera.GetHorizontalApertureOffsetAttr()))
    y = float(get(camera.GetVerticalApertureOffsetAttr()))
    if not abs(x) + abs(y) < LONGEST:
        report.warning(prim, f"an aperture offset of {x:g}, {y:g}", "0 is used")
        x = y = 0.0
    scale = TENTH if orthographic else 1.0 / focal
    window = (
        (x - 0.5 * width) * scale,
        (x + 0.5 * width) * scale,
        (y - 0.5 * height) * scale,
        (y + 0.5 * height) * scale,
    )
    size, window = _size(window, settings, resolution)
    description: dict[str, Any] = {
        "type": "orthographic" if orthographic else "perspective",
        "transform": flat(rigid),
        "window": list(window),
    }
    description.update(_clipping(camera, properties))
    stop = float(get(camera.GetFStopAttr()))
    distance = float(get(camera.GetFocusDistanceAttr()))
    if settings.has_lens and stop > 0 and not orthographic:
        if _is_length(stop) and 0 < distance < math.inf:
            description["aperture_radius"] = 0.5 * focal * TENTH / stop
            description["focus_distance"] = distance
        else:
            report.warning(
                prim, f"fStop {stop:g} with focusDistance {distance:g}", "everything is in focus"
            )
    if len(get(camera.GetClippingPlanesAttr())):
        report.unsupported(prim, "clipping planes", "they are ignored")
    return Frame(str(prim.GetPath()), description, size, _crop(size, settings))


def _clipping(camera: UsdGeom.Camera, properties: Properties) -> dict[str, float]:
    """The near and far planes. The schema's fallbacks only say that nothing was said."""
    clipping = camera.GetClippingRangeAttr()
    if not clipping.HasAuthoredValue():
        return {"near": 0.0}
    near, far = (float(v) for v in properties.get(clipping))
    if not math.isfinite(near):
        properties.report.warning(
            camera.GetPrim(), f"the clippingRange ({near:g}, {far:g})", "nothing is cut off"
        )
        return {"near": 0.0}
    planes = {"near": max(near, 0.0)}
    if math.isfinite(far) and far > near:
        planes["far"] = far
    return planes


def _size(
    window: tuple[float, float, float, float],
    settings: Settings,
    resolution: tuple[int, int] | None,
) -> tuple[tuple[int, int], tuple[float, float, float, float]]:
    """The picture's size, and the window fitted to it."""
    aspect = (window[1] - window[0]) / (window[3] - window[2])
    if settings.resolution:
        w, h = settings.resolution
        window = conform(window, settings.pixel_aspect * w / h, settings.policy)
        if resolution is None:
            return settings.resolution, window
    if resolution is None:
        return (DEFAULT_WIDTH, max(1, round(DEFAULT_WIDTH / aspect))), window
    return resolution, conform(window, resolution[0] / resolution[1], "adjustApertureHeight")


def _crop(size: tuple[int, int], settings: Settings) -> tuple[int, int, int, int] | None:
    x0, y0, x1, y1 = settings.data_window
    if (x0, y0, x1, y1) == (0.0, 0.0, 1.0, 1.0):
        return None
    w, h = size
    # UsdRender: a pixel belongs to the window when its centre does.
    crop = [math.ceil(v - 0.5) for v in (x0 * w, (1 - y1) * h, x1 * w, (1 - y0) * h)]
    return tuple(crop) if crop[0] < crop[2] and crop[1] < crop[3] else None  # type: ignore[return-value]


def framing_camera(
    bounds: Bounds,
    settings: Settings,
    resolution: tuple[int, int] | None,
    z_up: bool,
) -> Frame:
    """A camera that sees all that was imported, for stages without one: a 35 mm lens."""
    low, high = bounds.low, bounds.high
    if not np.isfinite([low, high]).all():
        low, high = -np.ones(3), np.ones(3)
    center, radius = 0.5 * (low + high), max(0.5 * float(np.linalg.norm(high - low)), 1e-3)
    half = 18.0 / 35.0
    window = (-half, half, -half * 0.5625, half * 0.5625)
    size, window = _size(window, settings, resolution)
    narrow = min(window[1], window[3])
    distance = radius / math.sin(math.atan(narrow))
    # From the front, a little from the right and above: no axis-aligned plane is seen edge-on.
    turn, rise = math.radians(25), math.radians(20)
    side, front, height = (
        math.sin(turn) * math.cos(rise),
        math.cos(turn) * math.cos(rise),
        math.sin(rise),
    )
    toward = np.array([side, -front, height] if z_up else [side, height, front])
    right = np.cross([0.0, 0.0, 1.0] if z_up else [0.0, 1.0, 0.0], toward)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2] = right, np.cross(toward, right), toward
    matrix[:3, 3] = center + distance * toward
    camera = {"type": "perspective", "transform": flat(matrix), "window": list(window)}
    return Frame("framing camera", camera, size, _crop(size, settings))
