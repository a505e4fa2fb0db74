"""The one place where `pxr` is imported, so that its absence is said in plain words."""

from __future__ import annotations

try:
    from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade
except ImportError as error:
    raise ImportError(
        "reading USD needs the pxr module: install segue[usd], or put Blender's own on sys.path "
        f"({error})"
    ) from error


def reason(error: Tf.ErrorException) -> str:
    """What USD says of a failure, in one line."""
    return " ".join(str(error.args[0].commentary if error.args else error).split())


__all__ = ["Ar", "Gf", "Sdf", "Tf", "Usd", "UsdGeom", "UsdLux", "UsdRender", "UsdShade", "reason"]
