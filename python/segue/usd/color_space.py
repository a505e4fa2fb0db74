"""The colour space that colours are authored in: the renderer computes in linear Rec.709."""

from __future__ import annotations

from ._pxr import Usd
from .report import Report

#: Names of linear Rec.709 with D65 white, and of what says nothing.
LINEAR_REC709 = ("", "lin_rec709_scene", "lin_rec709", "lin_srgb", "identity", "data", "raw")


def check_color_space(prim: Usd.Prim, report: Report) -> None:
    """Reports colours of another space, which UsdColorSpaceAPI gives to a prim and those below."""
    if not hasattr(Usd, "ColorSpaceAPI"):  # USD before 25.2
        return
    name = str(Usd.ColorSpaceAPI.ComputeColorSpaceName(prim, None))
    if name not in LINEAR_REC709:
        report.unsupported(prim, f"colours in the space '{name}'", "read as linear Rec.709")
