"""Polygon meshes as plain arrays, and the few operations the gallery needs on them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]

WELD = 1e-6
"""Corners nearer than this (metres) are one point for shading normals and for closedness."""


@dataclass(frozen=True)
class Mesh:
    """A polygon mesh; faces are counter-clockwise seen from outside. Lengths are metres."""

    points: Array
    counts: Index
    indices: Index
    uv: Array | None = None
    normals: Array | None = None

    @property
    def triangles(self) -> int:
        """Number of triangles after splitting every face into a fan."""
        return int((self.counts - 2).sum())

    def moved(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Mesh:
        """The mesh translated."""
        return self.transformed(np.eye(3), np.array([x, y, z]))

    def scaled(self, x: float, y: float, z: float) -> Mesh:
        """The mesh scaled about the origin by positive factors."""
        return self.transformed(np.diag([x, y, z]), np.zeros(3))

    def turned(self, axis: str, degrees: float) -> Mesh:
        """The mesh rotated about the `x`, `y` or `z` axis through the origin."""
        return self.transformed(rotation(axis, degrees), np.zeros(3))

    def transformed(self, linear: Array, offset: Array) -> Mesh:
        """The mesh with every point `p` taken to `linear p + offset`; `linear` keeps handedness."""
        normals = self.normals
        if normals is not None:
            normals = normals @ np.linalg.inv(linear)
            normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        return Mesh(self.points @ linear.T + offset, self.counts, self.indices, self.uv, normals)

    def flipped(self) -> Mesh:
        """The mesh turned inside out."""
        starts = np.repeat(np.cumsum(self.counts) - self.counts, self.counts)
        within = np.arange(len(self.indices)) - starts
        order = starts + np.repeat(self.counts, self.counts) - 1 - within
        normals = None if self.normals is None else -self.normals
        return Mesh(self.points, self.counts, self.indices[order], self.uv, normals)

    def welded(self) -> tuple[Array, Index]:
        """The distinct points, and for every point its place among them."""
        keys = np.round(self.points / WELD).astype(np.int64)
        _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        return self.points[first], place.reshape(-1)

    def is_closed(self) -> bool:
        """Whether every edge is met as often in one direction as in the other, points welded."""
        _, place = self.welded()
        corners = place[self.indices]
        ends = np.cumsum(self.counts)
        following = np.arange(1, len(corners) + 1)
        following[ends - 1] = ends - self.counts
        edges = np.stack([corners, corners[following]], axis=1)
        edges = edges[edges[:, 0] != edges[:, 1]]
        size = int(corners.max()) + 1
        forward = np.sort(edges[:, 0] * size + edges[:, 1])
        backward = np.sort(edges[:, 1] * size + edges[:, 0])
        return bool(np.array_equal(forward, backward))

    def volume(self) -> float:
        """Signed enclosed volume, positive when the faces look outwards."""
        tri = fan(self.counts, self.indices)
        a, b, c = (self.points[tri[:, i]] for i in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    def faceted(self) -> Mesh:
        """The mesh with flat faces: no shading normals, coincident points made one, no uv."""
        points, place = self.welded()
        return Mesh(points, self.counts, place[self.indices])

    def smooth(self, crease: float = 40.0) -> Mesh:
        """The mesh with shading normals, averaged over faces that meet at less than `crease` deg.

        Points on a crease are split, one for each smooth side.
        """
        _, place = self.welded()
        face_normal, corner_angle = _face_frames(self)
        face = np.repeat(np.arange(len(self.counts)), self.counts)
        left, right = _pairs(place[self.indices])
        facing = np.einsum("ij,ij->i", face_normal[face[left]], face_normal[face[right]])
        near = facing > np.cos(np.radians(crease))
        left, right = left[near], right[near]
        total = np.zeros((len(self.indices), 3))
        np.add.at(total, left, face_normal[face[right]] * corner_angle[right, None])
        total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
        keys = np.concatenate(
            [self.indices[:, None], np.round(total * 2000).astype(np.int64)], axis=1
        )
        _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        old = self.indices[first]
        uv = None if self.uv is None else self.uv[old]
        return Mesh(self.points[old], self.counts, index.reshape(-1), uv, total[first])


def fan(counts: Index, indices: Index) -> Index:
    """Triangles (n, 3) of polygons given by corner counts and point indices."""
    starts = np.cumsum(counts) - counts
    per_face = counts - 2
    face = np.repeat(np.arange(len(counts)), per_face)
    step = np.arange(len(face)) - np.repeat(np.cumsum(per_face) - per_face, per_face)
    base = starts[face]
    return np.stack([indices[base], indices[base + step + 1], indices[base + step + 2]], axis=1)


def merged(meshes: Iterable[Mesh]) -> Mesh:
    """Several meshes as one; uv and normals stay only where all have them."""
    parts = list(meshes)
    offsets = np.cumsum([0] + [len(m.points) for m in parts[:-1]])
    uvs = [m.uv for m in parts if m.uv is not None]
    normals = [m.normals for m in parts if m.normals is not None]
    return Mesh(
        np.concatenate([m.points for m in parts]),
        np.concatenate([m.counts for m in parts]),
        np.concatenate([m.indices + o for m, o in zip(parts, offsets, strict=True)]),
        np.concatenate(uvs) if len(uvs) == len(parts) else None,
        np.concatenate(normals) if len(normals) == len(parts) else None,
    )


def rotation(axis: str, degrees: float) -> Array:
    """Rotation matrix about a coordinate axis, for column vectors."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def polygon_mesh(
    points: ArrayLike, faces: Sequence[Sequence[int]], uv: ArrayLike | None = None
) -> Mesh:
    """A mesh from a list of faces."""
    return Mesh(
        np.asarray(points, float),
        np.array([len(f) for f in faces]),
        np.concatenate([np.asarray(f, dtype=np.int64) for f in faces]),
        None if uv is None else np.asarray(uv, float),
    )


def _face_frames(mesh: Mesh) -> tuple[Array, Array]:
    """Unit normal of every face (Newell's method), and the angle at every corner."""
    ends = np.cumsum(mesh.counts)
    starts = ends - mesh.counts
    corner = np.arange(len(mesh.indices))
    following, before = corner + 1, corner - 1
    following[ends - 1] = starts
    before[starts] = ends - 1
    here = mesh.points[mesh.indices]
    there, back = here[following], here[before]
    normal = np.add.reduceat(np.cross(here, there), starts, axis=0)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    out, into = there - here, back - here
    length = np.linalg.norm(out, axis=1) * np.linalg.norm(into, axis=1)
    cosine = np.einsum("ij,ij->i", out, into) / np.maximum(length, 1e-30)
    return normal, np.arccos(np.clip(cosine, -1.0, 1.0))


def _pairs(group: Index) -> tuple[Index, Index]:
    """All ordered pairs of positions whose group is the same."""
    order = np.argsort(group, kind="stable")
    _, size = np.unique(group[order], return_counts=True)
    start = np.cumsum(size) - size
    repeat = np.repeat(size, size)
    left = np.repeat(np.arange(len(group)), repeat)
    first = np.repeat(np.repeat(start, size), repeat)
    step = np.arange(len(left)) - np.repeat(np.cumsum(repeat) - repeat, repeat)
    return order[left], order[first + step]
