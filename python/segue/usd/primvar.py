"""Primvars as mesh attributes: inherited, indexed, of any interpolation and float width."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._abi import INTERPOLATIONS
from ..scene import Attribute
from ._pxr import Sdf, Usd, UsdGeom
from .report import Report

#: UsdGeom's names of where values sit, as the ABI's.
INTERPOLATION = {
    "constant": "constant",
    "uniform": "face",
    "vertex": "vertex",
    "varying": "vertex",
    "faceVarying": "corner",
}
assert set(INTERPOLATION.values()) == set(INTERPOLATIONS)


@dataclass(frozen=True)
class Elements:
    """How many elements a mesh has of each kind."""

    faces: int
    vertices: int
    corners: int

    def of(self, interpolation: str) -> int:
        """Number of elements of an interpolation of the ABI."""
        return {
            "constant": 1,
            "face": self.faces,
            "vertex": self.vertices,
            "corner": self.corners,
        }[interpolation]


@dataclass(frozen=True)
class Values:
    """A primvar's values with their indices, checked against the mesh.

    Attributes:
        is_varying: values at vertices that a subdivision surface interpolates linearly.
    """

    data: np.ndarray
    interpolation: str
    indices: np.ndarray | None
    is_varying: bool = False

    def flattened(self) -> np.ndarray:
        """One value for each element."""
        return self.data if self.indices is None else self.data[self.indices]


def read(
    primvar: UsdGeom.Primvar, time: Usd.TimeCode, elements: Elements, report: Report
) -> Values | None:
    """A primvar's values, or None, with a warning, if they do not fit the mesh."""
    prim, name = primvar.GetAttr().GetPrim(), primvar.GetPrimvarName()
    raw = primvar.Get(time)
    if raw is None:
        return None
    data = np.asarray(raw)
    if data.dtype.kind not in "fiu":
        report.unsupported(prim, f"the primvar '{name}' holds no numbers", "it is ignored")
        return None
    data = data.astype(np.float32, copy=False)
    if not np.isfinite(data).all():
        report.warning(prim, f"the primvar '{name}' is not finite", "it is ignored")
        return None
    width = primvar.GetElementSize()
    # What is authored may be one value where the schema says an array.
    if not Sdf.GetValueTypeNameForValue(raw).isArray:
        data = data[None]
    if data.ndim == 1:
        data = data[:, None]
    if width > 1:
        report.unsupported(prim, f"the primvar '{name}' has elementSize {width}", "it is ignored")
        return None
    interpolation = INTERPOLATION.get(primvar.GetInterpolation())
    if interpolation is None:
        report.warning(
            prim,
            f"the primvar '{name}' has the unknown interpolation '{primvar.GetInterpolation()}'",
            "it is ignored",
        )
        return None
    indices = None
    if primvar.IsIndexed():
        indices = np.asarray(primvar.GetIndices(time), dtype=np.int64)
        if len(indices) and (indices.min() < 0 or indices.max() >= len(data)):
            report.warning(prim, f"the primvar '{name}' has indices out of range", "it is ignored")
            return None
        indices = indices.astype(np.uint32)
    count = len(data) if indices is None else len(indices)
    if count == 1 and elements.of(interpolation) != 1:
        interpolation = "constant"
    if interpolation == "constant" and count > 1:
        data, indices, count = data[:1] if indices is None else data[indices[:1]], None, 1
    if count != elements.of(interpolation):
        report.warning(
            prim,
            f"the primvar '{name}' has {count} values for {elements.of(interpolation)} "
            f"elements ({primvar.GetInterpolation()})",
            "it is ignored",
        )
        return None
    return Values(data, interpolation, indices, primvar.GetInterpolation() == "varying")


def find(prim: Usd.Prim, name: str) -> UsdGeom.Primvar | None:
    """The primvar of that name on the prim, or a constant one inherited from above it."""
    primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
    return primvar if primvar and primvar.HasAuthoredValue() else None


def attribute(name: str, values: Values) -> Attribute | None:
    """The values as a mesh attribute: 2 floats stay, 1 becomes grey, 3 and 4 stay."""
    components = values.data.shape[1]
    if components == 1:
        return Attribute(name, np.repeat(values.data, 3, 1), values.interpolation, values.indices)
    if components in (2, 3, 4):
        return Attribute(name, values.data, values.interpolation, values.indices)
    return None
