"""Catmull-Clark and Loop subdivision, uniform, with creases, corners, boundaries and limit points.

Catmull and Clark (1978), Loop (1987); semi-sharp creases after DeRose, Kass and Truong,
"Subdivision Surfaces in Character Animation" (1998): a sharpness of s makes an edge sharp for s
levels. Boundaries are sharp. Face-varying values are interpolated linearly within faces.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .mesh_data import sum_rows

#: Sharpness from which UsdGeomMesh takes an edge or a vertex as infinitely sharp.
INFINITE = 10.0


@dataclass
class Cage:
    """A control mesh.

    Attributes:
        points: number of vertices.
        counts: corners of each face.
        corners: vertex of each corner.
        edge_sharpness: sharpness of creased edges, by sorted pair of vertices: (n, 2) and (n,).
        corner_sharpness: sharpness of each vertex.
        sharp_corners: whether vertices of only one face are corners (`edgeAndCorner`).
    """

    points: int
    counts: np.ndarray
    corners: np.ndarray
    creases: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    crease_sharpness: np.ndarray = field(default_factory=lambda: np.zeros(0))
    corner_sharpness: np.ndarray | None = None
    sharp_corners: bool = True


class Level:
    """One mesh with its edges, and the rules that lead to the next finer one."""

    def __init__(self, cage: Cage, loop: bool) -> None:
        self.cage = cage
        self.loop = loop
        counts, corners = cage.counts, cage.corners
        starts = np.cumsum(counts) - counts
        self.face_of_corner = np.repeat(np.arange(len(counts)), counts)
        self.following = np.arange(1, len(corners) + 1)
        filled = counts > 0
        self.following[(starts + counts - 1)[filled]] = starts[filled]
        self.previous = np.empty_like(self.following)
        self.previous[self.following] = np.arange(len(corners))
        ends = np.sort(np.stack([corners, corners[self.following]], axis=1), axis=1)
        keys, self.edge_of_corner, uses = np.unique(
            ends[:, 0] * cage.points + ends[:, 1], return_inverse=True, return_counts=True
        )
        self.edges = np.stack([keys // cage.points, keys % cage.points], axis=1)
        self.boundary = uses != 2
        self.sharpness = np.where(self.boundary, np.inf, 0.0)
        if len(cage.creases):
            wanted = np.sort(cage.creases, axis=1) @ [cage.points, 1]
            found = np.searchsorted(keys, wanted)
            found[found == len(keys)] = 0
            exists = keys[found] == wanted
            np.maximum.at(self.sharpness, found[exists], cage.crease_sharpness[exists])
        self._classify()

    def _classify(self) -> None:
        """Valence, number of sharp edges and mean sharpness of each vertex."""
        n, edges = self.cage.points, self.edges
        flat = edges.reshape(-1)
        sharp = np.repeat(self.sharpness > 0, 2)
        self.valence = np.bincount(flat, minlength=n)
        self.sharp_count = np.bincount(flat[sharp], minlength=n)
        finite = np.minimum(np.repeat(self.sharpness, 2), INFINITE)
        total = np.bincount(flat[sharp], finite[sharp], minlength=n)
        self.mean_sharpness = total / np.maximum(self.sharp_count, 1)
        self.vertex_sharpness = (
            np.zeros(n)
            if self.cage.corner_sharpness is None
            else self.cage.corner_sharpness.astype(float)
        )
        if self.cage.sharp_corners:
            faces = np.bincount(self.cage.corners, minlength=n)
            on_boundary = np.bincount(flat[np.repeat(self.boundary, 2)], minlength=n) > 0
            self.vertex_sharpness = np.where(
                (faces == 1) & on_boundary, np.inf, self.vertex_sharpness
            )

    def _face_points(self, values: np.ndarray) -> np.ndarray:
        sums = sum_rows(self.face_of_corner, values[self.cage.corners], len(self.cage.counts))
        return sums / np.maximum(self.cage.counts, 1)[:, None]

    def _edge_points(self, values: np.ndarray, faces: np.ndarray) -> np.ndarray:
        ends = values[self.edges[:, 0]] + values[self.edges[:, 1]]
        if self.loop:
            opposite = values[self.cage.corners[self.previous]]
            across = sum_rows(self.edge_of_corner, opposite, len(self.edges))
            smooth = 0.375 * ends + 0.125 * across
        else:
            across = sum_rows(self.edge_of_corner, faces[self.face_of_corner], len(self.edges))
            smooth = 0.25 * (ends + across)
        blend = np.clip(self.sharpness, 0, 1)[:, None]
        return (1 - blend) * smooth + blend * 0.5 * ends

    def _neighbors(self, values: np.ndarray, weights: np.ndarray | None = None) -> np.ndarray:
        """Sum of the neighbours' values along all edges, or along weighted ones."""
        a, b = self.edges.T
        ends = np.concatenate([values[b], values[a]])
        if weights is not None:
            ends = ends * np.concatenate([weights, weights])[:, None]
        return sum_rows(np.concatenate([a, b]), ends, self.cage.points)

    def _blended(self, values: np.ndarray, smooth: np.ndarray, crease: np.ndarray) -> np.ndarray:
        """Each vertex's rule by its sharp edges: smooth or dart, crease, corner; blended."""
        is_crease = self.sharp_count == 2
        sharp = np.where(is_crease[:, None], crease, values)
        share = np.where(self.sharp_count >= 2, np.clip(self.mean_sharpness, 0, 1), 0)[:, None]
        result = (1 - share) * smooth + share * sharp
        corner = np.clip(self.vertex_sharpness, 0, 1)[:, None]
        result = (1 - corner) * result + corner * values
        result[self.valence == 0] = values[self.valence == 0]
        return result

    def _vertex_points(self, values: np.ndarray, faces: np.ndarray) -> np.ndarray:
        n = np.maximum(self.valence, 1)[:, None].astype(float)
        around = self._neighbors(values)
        if self.loop:
            beta = _loop_beta(n)
            smooth = (1 - n * beta) * values + beta * around
        else:
            face_sum = sum_rows(self.cage.corners, faces[self.face_of_corner], self.cage.points)
            smooth = (n - 2) / n * values + (around + face_sum) / n**2
        along = self._neighbors(values, (self.sharpness > 0).astype(float))
        return self._blended(values, smooth, 0.75 * values + 0.125 * along)

    def refine_vertex(self, values: np.ndarray) -> np.ndarray:
        """Values at vertices, by the rules of the points."""
        faces = self._face_points(values)
        parts = [self._vertex_points(values, faces), self._edge_points(values, faces)]
        return np.concatenate(parts if self.loop else [*parts, faces])

    def refine_varying(self, values: np.ndarray) -> np.ndarray:
        """Values at vertices, linearly."""
        parts = [values, values[self.edges].mean(axis=1)]
        return np.concatenate(parts if self.loop else [*parts, self._face_points(values)])

    def refine_corner(self, values: np.ndarray) -> np.ndarray:
        """Values at corners, linearly within each face."""
        forward = 0.5 * (values + values[self.following])
        backward = 0.5 * (values + values[self.previous])
        if self.loop:
            outer = np.stack([values, forward, backward], axis=1)
            inner = forward.reshape(-1, 3, values.shape[1])
            triangles = outer.reshape(-1, 3, 3, values.shape[1])
            return np.concatenate([triangles, inner[:, None]], axis=1).reshape(-1, values.shape[1])
        faces = sum_rows(self.face_of_corner, values, len(self.cage.counts))
        faces = (faces / np.maximum(self.cage.counts, 1)[:, None])[self.face_of_corner]
        return np.stack([values, forward, faces, backward], axis=1).reshape(-1, values.shape[1])

    def refine_face(self, values: np.ndarray) -> np.ndarray:
        """Values of faces."""
        if self.loop:
            return np.repeat(values, 4, axis=0)
        return values[self.face_of_corner]

    def finer(self) -> Level:
        """The next level."""
        n, e = self.cage.points, len(self.edges)
        vertex = self.cage.corners
        forward = n + self.edge_of_corner
        backward = n + self.edge_of_corner[self.previous]
        if self.loop:
            outer = np.stack([vertex, forward, backward], axis=1).reshape(-1, 3, 3)
            inner = forward.reshape(-1, 1, 3)
            corners = np.concatenate([outer, inner], axis=1).reshape(-1)
            size, width = n + e, 3
        else:
            face = n + e + self.face_of_corner
            corners = np.stack([vertex, forward, face, backward], axis=1).reshape(-1)
            size, width = n + e + len(self.cage.counts), 4
        kept = np.nonzero((self.sharpness > 1) & ~self.boundary)[0]
        middle = n + kept
        creases = np.concatenate([np.stack([self.edges[kept, k], middle], axis=1) for k in (0, 1)])
        less = np.where(self.sharpness >= INFINITE, self.sharpness, self.sharpness - 1)[kept]
        at_vertices = np.zeros(size)
        own = self.vertex_sharpness
        at_vertices[:n] = np.where(own >= INFINITE, own, np.maximum(own - 1, 0))
        cage = Cage(
            size,
            np.full(len(corners) // width, width),
            corners,
            creases,
            np.concatenate([less, less]),
            at_vertices,
            sharp_corners=False,  # those of the cage are kept in corner_sharpness
        )
        return Level(cage, self.loop)

    def limit(self, values: np.ndarray) -> np.ndarray:
        """Vertices moved to where endless refinement would bring them."""
        n = np.maximum(self.valence, 1)[:, None].astype(float)
        around = self._neighbors(values)
        if self.loop:
            weight = 3 / (8 * _loop_beta(n))
            smooth = (weight * values + around) / (weight + n)
        else:
            opposite = values[self.cage.corners[self.following[self.following]]]
            diagonal = sum_rows(self.cage.corners, opposite, self.cage.points)
            smooth = (n**2 * values + 4 * around + diagonal) / (n * (n + 5))
        along = self._neighbors(values, (self.sharpness > 0).astype(float))
        return self._blended(values, smooth, (4 * values + along) / 6)


def _loop_beta(n: np.ndarray) -> np.ndarray:
    """Loop's weight of each neighbour of a vertex of valence n."""
    return (0.625 - (0.375 + 0.25 * np.cos(2 * np.pi / n)) ** 2) / n


class Refinement:
    """Several levels of subdivision of one cage, for its points and for values on it."""

    def __init__(self, cage: Cage, loop: bool, levels: int) -> None:
        self._levels = [Level(cage, loop)]
        for _ in range(levels):
            self._levels.append(self._levels[-1].finer())

    @property
    def coarsest(self) -> Level:
        """The cage."""
        return self._levels[0]

    @property
    def finest(self) -> Level:
        """The last level."""
        return self._levels[-1]

    def points(self, points: np.ndarray) -> np.ndarray:
        """The finest level's points, on the limit surface."""
        return self.values(points.astype(np.float64), "vertex")

    def values(self, values: np.ndarray, kind: str) -> np.ndarray:
        """Values at "vertex", "varying", "corner" or "face" of the cage, at the finest level."""
        if kind == "constant":
            return values
        for level in self._levels[:-1]:
            values = {
                "vertex": level.refine_vertex,
                "varying": level.refine_varying,
                "corner": level.refine_corner,
                "face": level.refine_face,
            }[kind](values)
        return self.finest.limit(values) if kind == "vertex" else values


def corner_normals(level: Level, points: np.ndarray) -> np.ndarray | None:
    """Normals of each corner, split along sharp edges; None if no edge within is sharp."""
    split = (level.sharpness > 0) & ~level.boundary
    if not split.any():
        return None
    corners, following, previous = level.cage.corners, level.following, level.previous
    # Corners at one vertex belong together across edges that are not sharp: the corner after an
    # edge and the one before it, in the two faces of the edge.
    group = np.arange(len(corners))
    order = np.argsort(level.edge_of_corner, kind="stable")
    pairs = order[: len(order)]
    first = np.nonzero(np.diff(level.edge_of_corner[order], prepend=-1))[0]
    inner = first[(~level.boundary & ~split)]
    a, b = pairs[inner], pairs[inner + 1]
    same = corners[a] == corners[b]
    start_b = np.where(same, b, following[b])
    end_b = np.where(same, following[b], b)
    left = np.concatenate([a, following[a]])
    right = np.concatenate([start_b, end_b])
    while True:
        low = np.minimum(group[left], group[right])
        before = group.copy()
        np.minimum.at(group, left, low)
        np.minimum.at(group, right, low)
        group = group[group]
        if np.array_equal(group, before):
            break
    edges_out = points[corners[following]] - points[corners]
    edges_in = points[corners[previous]] - points[corners]
    weighted = np.cross(edges_out, edges_in)
    sums = sum_rows(group, weighted, len(corners))[group]
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return np.divide(sums, lengths, out=np.zeros_like(sums), where=lengths > 0)
