"""A mesh on its way to the scene: its arrays, its normals and its area."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..scene import Attribute
from . import primvar
from ._pxr import Usd

if TYPE_CHECKING:
    from .subdivided import Subdivided


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


def sum_rows(index: np.ndarray, values: np.ndarray, size: int) -> np.ndarray:
    """The sums of the rows of (n, k) values that share an index, as (size, k) float64."""
    columns = [np.bincount(index, column, size) for column in values.T]
    return np.stack(columns, axis=1).astype(np.float64)


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
    vectors = sum_rows(face_of_corner, edges, len(counts))
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
    normals = sum_rows(corners, at_corner, len(data.points))
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0)
    normals[lengths[:, 0] == 0] = (0, 0, 1)
    return (-normals if data.left_handed else normals).astype(np.float32)


def area(data: MeshData, matrix: np.ndarray) -> float:
    """Surface area in world space, holes left out; exact for planar faces."""
    points = data.points.astype(np.float64) @ matrix[:3, :3].T
    vectors, _ = _area_vectors(data, points)
    return 0.5 * float(np.linalg.norm(vectors, axis=1).sum())
