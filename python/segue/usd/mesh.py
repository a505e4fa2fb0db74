"""Polygon meshes: topology, normals, holes and subsets as the arrays of the ABI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..scene import Attribute
from . import primvar
from ._pxr import Usd, UsdGeom, UsdShade
from .report import Report

if TYPE_CHECKING:
    from .subdivided import Subdivided

_SMOOTH_SCHEMES = ("catmullClark", "loop")


@dataclass
class MeshData:
    """A mesh as `Scene.add_mesh` takes it.

    Attributes:
        slots: the prims whose bindings are the material slots: the mesh, then its subsets.
        face_slots: slot of each face, or None: all are the mesh's own.
        subdivided: how values on the control cage become values on this mesh, if it has one.
    """

    points: np.ndarray
    face_counts: np.ndarray
    face_indices: np.ndarray
    normals: np.ndarray | None = None
    normal_interpolation: str = "vertex"
    holes: np.ndarray | None = None
    left_handed: bool = False
    attributes: list[Attribute] = field(default_factory=list)
    slots: list[Usd.Prim] = field(default_factory=list)
    face_slots: np.ndarray | None = None
    subdivided: Subdivided | None = None

    @property
    def elements(self) -> primvar.Elements:
        """How many faces, points and corners there are, on the cage if there is one."""
        if self.subdivided is not None:
            return self.subdivided.elements
        return primvar.Elements(len(self.face_counts), len(self.points), len(self.face_indices))


def read_mesh(mesh: UsdGeom.Mesh, time: Usd.TimeCode, report: Report) -> MeshData | None:
    """A mesh without its attributes, or None, with an entry in the report, if it has no shape."""
    prim = mesh.GetPrim()
    points = numbers(mesh.GetPointsAttr(), time, 3)
    counts = numbers(mesh.GetFaceVertexCountsAttr(), time)
    indices = numbers(mesh.GetFaceVertexIndicesAttr(), time)
    if points is None or counts is None or indices is None:
        report.warning(prim, "a mesh whose points or faces are of a wrong type", "left out")
        return None
    if not len(points) or not len(counts):
        report.left_out(prim, "a mesh without points or faces")
        return None
    fault = _fault(points, counts, indices)
    if fault:
        report.warning(prim, f"a mesh {fault}", "left out")
        return None
    data = MeshData(
        points=points,
        face_counts=counts.astype(np.uint32),
        face_indices=indices.astype(np.uint32),
        left_handed=mesh.GetOrientationAttr().Get(time) == UsdGeom.Tokens.leftHanded,
    )
    holes = numbers(mesh.GetHoleIndicesAttr(), time)
    if holes is not None and len(holes):
        inside = holes[(holes >= 0) & (holes < len(counts))]
        if len(inside) < len(holes):
            report.warning(prim, "holeIndices out of range", "they are ignored")
        data.holes = np.unique(inside).astype(np.uint32)
    _read_subsets(prim, time, data, report)
    if mesh.GetSubdivisionSchemeAttr().Get(time) in _SMOOTH_SCHEMES:
        from .subdivided import Subdivided  # which needs this module's MeshData

        return Subdivided(mesh, time, data, report).data()
    _read_normals(mesh, time, data, report)
    return data


def numbers(attribute: Usd.Attribute, time: Usd.TimeCode, width: int = 0) -> np.ndarray | None:
    """An attribute's numbers: (n, width) float32, or (n,) int64 for a width of 0.

    Empty where there is no value; None where the value is of another kind.
    """
    shape, dtype = ((0, width), np.float32) if width else ((0,), np.int64)
    value = attribute.Get(time)
    if value is None:
        return np.zeros(shape, dtype)
    array = np.asarray(value)
    if array.ndim and not len(array):
        return np.zeros(shape, dtype)
    fits = array.ndim == len(shape) and array.shape[1:] == shape[1:]
    if not fits or array.dtype.kind not in ("f" if width else "iu"):
        return None
    return array.astype(dtype)


def _fault(points: np.ndarray, counts: np.ndarray, indices: np.ndarray) -> str:
    """What makes the topology unusable, or ""."""
    if counts.min() < 0:
        return "with a negative face vertex count"
    if counts.sum() != len(indices):
        return f"whose faces want {counts.sum()} vertex indices and have {len(indices)}"
    if len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        return "with vertex indices out of range"
    if not np.isfinite(points).all():
        return "with points that are not finite"
    return ""


def _read_normals(mesh: UsdGeom.Mesh, time: Usd.TimeCode, data: MeshData, report: Report) -> None:
    """Authored normals. A bilinear surface is its cage, where they do not count: it is flat."""
    prim = mesh.GetPrim()
    if mesh.GetSubdivisionSchemeAttr().Get(time) != UsdGeom.Tokens.none:
        return
    values = None
    normals = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
    if normals and normals.HasAuthoredValue():
        values = primvar.read(normals, time, data.elements, report)
    elif mesh.GetNormalsAttr().HasAuthoredValue():
        values = _plain_normals(mesh, time, data, report)
    if values is None:
        return
    flattened = values.flattened()
    if flattened.shape[1] != 3 or not np.isfinite(flattened).all():
        report.warning(prim, "normals that are not finite vectors", "it is drawn flat")
        return
    data.normals, data.normal_interpolation = flattened, values.interpolation


def _plain_normals(
    mesh: UsdGeom.Mesh, time: Usd.TimeCode, data: MeshData, report: Report
) -> primvar.Values | None:
    normals = numbers(mesh.GetNormalsAttr(), time, 3)
    if normals is None:
        report.warning(mesh.GetPrim(), "normals of a wrong type", "it is drawn flat")
        return None
    interpolation = primvar.INTERPOLATION[mesh.GetNormalsInterpolation()]
    wanted = data.elements.of(interpolation)
    if len(normals) != wanted:
        report.warning(
            mesh.GetPrim(),
            f"{len(normals)} normals for {wanted} elements ({mesh.GetNormalsInterpolation()})",
            "it is drawn flat",
        )
        return None
    return primvar.Values(normals, interpolation, None)


def _area_vectors(data: MeshData, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Twice each face's area vector (Newell), zero for holes, and the face of each corner."""
    counts = data.face_counts.astype(np.int64)
    corners = data.face_indices.astype(np.int64)
    starts = np.cumsum(counts) - counts
    following = np.arange(1, len(corners) + 1)
    filled = counts > 0
    following[(starts + counts - 1)[filled]] = starts[filled]
    face_of_corner = np.repeat(np.arange(len(counts)), counts)
    # Relative to each face's first point: no cancellation far from the origin.
    local = points[corners] - points[corners[starts[face_of_corner]]]
    edges = np.cross(local, local[following])
    vectors = np.stack(
        [np.bincount(face_of_corner, edges[:, k], len(counts)) for k in range(3)], axis=1
    )
    if data.holes is not None:
        vectors[data.holes] = 0
    return vectors, face_of_corner


def smooth_normals(data: MeshData) -> np.ndarray:
    """Vertex normals: the sum of the adjacent faces' area vectors, holes left out.

    They point to the front side, whichever way the corners wind.
    """
    vectors, face_of_corner = _area_vectors(data, data.points.astype(np.float64))
    at_corner = vectors[face_of_corner]
    corners = data.face_indices.astype(np.int64)
    normals = np.stack(
        [np.bincount(corners, at_corner[:, k], len(data.points)) for k in range(3)], axis=1
    )
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    normals[lengths[:, 0] == 0] = (0, 0, 1)
    return (-normals if data.left_handed else normals).astype(np.float32)


def _read_subsets(prim: Usd.Prim, time: Usd.TimeCode, data: MeshData, report: Report) -> None:
    """Material slots from the subsets of the family `materialBind`; slot 0 is the mesh's own."""
    data.slots = [prim]
    slots = np.zeros(len(data.face_counts), np.uint32)
    taken = np.zeros(len(data.face_counts), bool)
    for subset in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets():
        element = subset.GetElementTypeAttr().Get(time)
        if element != UsdGeom.Tokens.face:
            report.unsupported(
                subset.GetPrim(), f"a material subset of '{element}'", "it is ignored"
            )
            continue
        faces = numbers(subset.GetIndicesAttr(), time)
        if faces is None:
            report.warning(subset.GetPrim(), "a subset without face indices", "it is ignored")
            continue
        inside = faces[(faces >= 0) & (faces < len(slots))]
        if len(inside) < len(faces):
            report.warning(
                subset.GetPrim(), "a subset with faces that do not exist", "they are ignored"
            )
        if taken[inside].any():
            report.warning(
                subset.GetPrim(),
                "a subset that shares faces with one before it",
                "those keep the first one's material",
            )
            inside = inside[~taken[inside]]
        taken[inside] = True
        slots[inside] = len(data.slots)
        data.slots.append(subset.GetPrim())
    if len(data.slots) > 1:
        data.face_slots = slots


def add_attributes(
    data: MeshData,
    primvars: Mapping[str, UsdGeom.Primvar | None],
    time: Usd.TimeCode,
    report: Report,
) -> None:
    """Adds those of the named primvars that were found and fit the mesh."""
    for name, found in primvars.items():
        values = primvar.read(found, time, data.elements, report) if found else None
        if values and data.subdivided is not None:
            values = data.subdivided.values(values)
        attribute = primvar.attribute(name, values) if values else None
        if attribute is not None:
            data.attributes.append(attribute)


def area(data: MeshData, matrix: np.ndarray) -> float:
    """Surface area in world space, holes left out; exact for planar faces."""
    points = data.points.astype(np.float64) @ matrix[:3, :3].T
    vectors, _ = _area_vectors(data, points)
    return 0.5 * float(np.linalg.norm(vectors, axis=1).sum())
