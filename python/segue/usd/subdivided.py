"""UsdGeomMesh's subdivision attributes: from a control cage to the mesh that is drawn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ._pxr import Usd, UsdGeom
from .mesh_data import MeshData, numbers, smooth_normals
from .primvar import Elements, Values
from .report import Report
from .subdivision import INFINITE, Cage, Refinement, corner_normals

#: Levels of refinement: as many as keep a mesh below this many faces, and no more than that.
MOST_FACES = 400_000
MOST_LEVELS = 4


class Subdivided:
    """A subdivided mesh, and how values on its cage follow.

    Args:
        mesh: its attributes.
        cage: the cage with its material slots and holes.
    """

    def __init__(
        self, mesh: UsdGeom.Mesh, time: Usd.TimeCode, cage: MeshData, report: Report
    ) -> None:
        self._cage = cage
        self._loop = mesh.GetSubdivisionSchemeAttr().Get(time) == UsdGeom.Tokens.loop
        self._faces, self._corners, counts = _usable(cage, self._loop)
        prim = mesh.GetPrim()
        if mesh.GetTriangleSubdivisionRuleAttr().Get(time) == UsdGeom.Tokens.smooth:
            report.unsupported(prim, "triangleSubdivisionRule = smooth", "catmullClark is used")
        control = Cage(len(cage.points), counts, cage.face_indices.astype(np.int64)[self._corners])
        _read_sharpness(mesh, time, control, report)
        boundary = mesh.GetInterpolateBoundaryAttr().Get(time)
        control.sharp_corners = boundary != UsdGeom.Tokens.edgeOnly
        levels = _levels(len(self._corners), self._loop)
        if levels == 0:
            report.unsupported(
                prim,
                f"subdivision of a cage of {len(counts)} faces",
                "the cage is drawn with smooth normals",
            )
        self._refinement = Refinement(control, self._loop, levels)
        self._hidden = self._holes(boundary == UsdGeom.Tokens.none)

    @property
    def elements(self) -> Elements:
        """How many faces, points and corners the cage has."""
        return self._cage.elements

    def data(self) -> MeshData:
        """The mesh to draw, without attributes."""
        level = self._refinement.finest
        points = self._refinement.points(self._cage.points)
        data = replace(
            self._cage,
            points=points.astype(np.float32),
            face_counts=level.cage.counts.astype(np.uint32),
            face_indices=level.cage.corners.astype(np.uint32),
            holes=None,
            subdivided=self,
        )
        if self._hidden.any():
            data.holes = np.nonzero(self._refinement.values(self._hidden, "face"))[0].astype(
                np.uint32
            )
        if self._cage.face_slots is not None:
            data.face_slots = self._refinement.values(self._cage.face_slots[self._faces], "face")
        split = corner_normals(level, points)
        if split is None:
            data.normals = smooth_normals(data)
        else:
            sign = -1 if data.left_handed else 1
            data.normals, data.normal_interpolation = (sign * split).astype(np.float32), "corner"
        return data

    def values(self, values: Values) -> Values:
        """A primvar of the cage on the mesh that is drawn."""
        data, kind = values.flattened(), values.interpolation
        if kind == "face":
            data = data[self._faces]
        elif kind == "corner":
            data = data[self._corners]
        elif kind == "vertex" and values.is_varying:
            kind = "varying"
        refined = self._refinement.values(data.astype(np.float32, copy=False), kind)
        return Values(refined.astype(np.float32), values.interpolation, None)

    def _holes(self, drop_boundary: bool) -> np.ndarray:
        """Faces of the cage that are not drawn."""
        hidden = np.zeros(len(self._cage.face_counts), bool)
        if self._cage.holes is not None:
            hidden[self._cage.holes] = True
        hidden = hidden[self._faces]
        if drop_boundary:
            level = self._refinement.coarsest
            at = np.zeros(level.cage.points, bool)
            at[level.edges[level.boundary]] = True
            np.logical_or.at(hidden, level.face_of_corner, at[level.cage.corners])
        return hidden


def _levels(corners: int, loop: bool) -> int:
    """Levels for a cage. The first Catmull-Clark level makes a face of each corner."""
    faces = corners / 3 * 4 if loop else corners
    levels = 0
    while levels < MOST_LEVELS and faces <= MOST_FACES:
        levels += 1
        faces *= 4
    return levels


def _usable(cage: MeshData, loop: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faces of at least three corners, as a fan of triangles for Loop's scheme.

    Returns:
        For each face used its face in the cage, for each corner its corner there, and the counts.
    """
    counts = cage.face_counts.astype(np.int64)
    starts = np.cumsum(counts) - counts
    faces = np.nonzero(counts >= 3)[0]
    if not loop:
        kept = np.repeat(counts >= 3, counts)
        return faces, np.nonzero(kept)[0], counts[faces]
    triangles = np.repeat(faces, counts[faces] - 2)
    first = np.repeat(np.cumsum(counts[faces] - 2) - (counts[faces] - 2), counts[faces] - 2)
    step = np.arange(len(triangles)) - first
    start = starts[triangles]
    corners = np.stack([start, start + step + 1, start + step + 2], axis=1).reshape(-1)
    return triangles, corners, np.full(len(triangles), 3)


def _read_sharpness(mesh: UsdGeom.Mesh, time: Usd.TimeCode, cage: Cage, report: Report) -> None:
    """Creases (chains of vertices with a sharpness for the chain or for each edge) and corners."""
    chain = numbers(mesh.GetCreaseIndicesAttr(), time)
    lengths = numbers(mesh.GetCreaseLengthsAttr(), time)
    sharpness = _floats(mesh.GetCreaseSharpnessesAttr(), time)
    if chain is not None and lengths is not None and len(lengths):
        per_edge = np.maximum(lengths - 1, 0)
        if len(sharpness) == len(lengths):
            sharpness = np.repeat(sharpness, per_edge)
        last = np.cumsum(lengths)
        fits = lengths.min() >= 0 and last[-1] == len(chain) and per_edge.sum() == len(sharpness)
        if fits and len(chain) and chain.min() >= 0 and chain.max() < cage.points:
            inside = np.ones(len(chain), bool)
            inside[last[lengths > 0] - 1] = False
            begin = np.nonzero(inside)[0]
            cage.creases = np.stack([chain[begin], chain[begin + 1]], axis=1)
            cage.crease_sharpness = _sharp(sharpness)
        else:
            report.warning(mesh.GetPrim(), "creases that do not fit the mesh", "they are ignored")
    corners = numbers(mesh.GetCornerIndicesAttr(), time)
    sharpness = _floats(mesh.GetCornerSharpnessesAttr(), time)
    if corners is None or not len(corners):
        return
    if len(sharpness) == len(corners) and corners.min() >= 0 and corners.max() < cage.points:
        cage.corner_sharpness = np.zeros(cage.points)
        cage.corner_sharpness[corners] = _sharp(sharpness)
    else:
        report.warning(mesh.GetPrim(), "corners that do not fit the mesh", "they are ignored")


def _floats(attribute: Usd.Attribute, time: Usd.TimeCode) -> np.ndarray:
    """An attribute's numbers; none, which fit nothing, where they are of another kind."""
    values = np.asarray(attribute.Get(time))
    fits = values.ndim == 1 and values.dtype.kind in "fiu"
    return values.astype(np.float64) if fits else np.zeros(0)


def _sharp(values: np.ndarray) -> np.ndarray:
    return np.where(values >= INFINITE, np.inf, np.maximum(values, 0.0))
