"""Polygon meshes: topology, normals, holes and subsets as the arrays of the ABI."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from . import primvar
from ._pxr import Usd, UsdGeom, UsdShade
from .mesh_data import MeshData, numbers
from .report import Report
from .subdivided import Subdivided

_SMOOTH_SCHEMES = ("catmullClark", "loop")


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
        return Subdivided(mesh, time, data, report).data()
    _read_normals(mesh, time, data, report)
    return data


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
    interpolation = primvar.INTERPOLATION.get(mesh.GetNormalsInterpolation())
    if interpolation is None:
        report.warning(
            mesh.GetPrim(),
            f"normals with the unknown interpolation '{mesh.GetNormalsInterpolation()}'",
            "it is drawn flat",
        )
        return None
    wanted = data.elements.of(interpolation)
    if len(normals) != wanted:
        report.warning(
            mesh.GetPrim(),
            f"{len(normals)} normals for {wanted} elements ({mesh.GetNormalsInterpolation()})",
            "it is drawn flat",
        )
        return None
    return primvar.Values(normals, interpolation, None)


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
