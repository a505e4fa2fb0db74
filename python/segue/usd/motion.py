"""Motion during the shutter's time, which is not rendered: what stands still that should not."""

from __future__ import annotations

from ._pxr import Usd, UsdGeom
from .properties import Properties
from .walk import all_prims


def report_motion(camera: Usd.Prim, properties: Properties) -> None:
    """Names the prims that move, where the camera's shutter stays open for a while."""
    lens = UsdGeom.Camera(camera)
    opened, closed = (
        properties.get(a) for a in (lens.GetShutterOpenAttr(), lens.GetShutterCloseAttr())
    )
    if not closed > opened:
        return
    for prim in all_prims(camera.GetStage()):
        if _moves(prim):
            properties.report.unsupported(prim, "motion blur", "it stands where the frame has it")


def _moves(prim: Usd.Prim) -> bool:
    """Whether a prim's own place or its points may change over time."""
    xformable, points = UsdGeom.Xformable(prim), UsdGeom.PointBased(prim)
    return bool(
        (xformable and xformable.TransformMightBeTimeVarying())
        or (points and points.GetPointsAttr().ValueMightBeTimeVarying())
    )
