"""The one place where `pxr` is imported, so that its absence is said in plain words."""

from __future__ import annotations

try:
    from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade
except ImportError as error:
    raise ImportError(
        "reading USD needs the pxr module: install segue[usd], or put Blender's own on sys.path "
        f"({error})"
    ) from error

__all__ = ["Ar", "Gf", "Sdf", "Tf", "Usd", "UsdGeom", "UsdLux", "UsdRender", "UsdShade"]
