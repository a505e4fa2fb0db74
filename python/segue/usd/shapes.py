"""UsdGeom's implicit shapes, tessellated finely, with smooth normals where they curve.

Spheres, cubes, cylinders, cones and planes are one mesh each, scaled by the instance's matrix, so
that a thousand spheres of any size share their triangles. Capsules and tapered cylinders depend on
the ratio of their sizes and get a mesh for each.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._pxr import Usd
from .mesh_data import MeshData
from .properties import Properties

#: Segments around an axis, and from pole to pole.
AROUND = 128
POLE_TO_POLE = 64

#: Rotations that bring +Z to the named axis (cyclic, so that handedness stays).
_TO_AXIS = {
    "Z": np.eye(3),
    "X": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    "Y": np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]),
}

#: A key that equal shapes share, the function that makes it, and the matrix to the prim's space.
Shape = tuple[tuple, Any, np.ndarray]


def shape_of(prim: Usd.Prim, properties: Properties) -> Shape | None:
    """The implicit shape that a prim is, or None if it is none."""

    def get(name: str) -> Any:
        return properties.named(prim, name)

    kind = prim.GetTypeName()
    if kind == "Sphere":
        return ("sphere",), sphere, _matrix(scale=[float(get("radius"))] * 3)
    if kind == "Cube":
        return ("cube",), cube, _matrix(scale=[0.5 * float(get("size"))] * 3)
    if kind == "Plane":
        return ("plane",), plane, _plane_matrix(get)
    if kind in ("Cylinder", "Cone"):
        radius, height = float(get("radius")), float(get("height"))
        matrix = _matrix(get("axis"), [radius, radius, 0.5 * height])
        return (kind.lower(),), cylinder if kind == "Cylinder" else cone, matrix
    if kind in ("Cylinder_1", "Capsule", "Capsule_1"):
        height = float(get("height"))
        if kind == "Capsule":
            top = bottom = float(get("radius"))
        else:
            top, bottom = float(get("radiusTop")), float(get("radiusBottom"))
        make = cylinder if kind == "Cylinder_1" else capsule
        key = (make.__name__, top, bottom, height)
        return key, lambda: make(top, bottom, height), _matrix(get("axis"))
    return None


def _matrix(axis: str = "Z", scale: Any = (1.0, 1.0, 1.0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = _TO_AXIS[axis] @ np.diag(scale)
    return matrix


def _plane_matrix(get: Any) -> np.ndarray:
    """UsdGeomPlane: width along X (along Z when the axis is X), length along Y (Z for axis Y)."""
    axis, width, length = get("axis"), float(get("width")), float(get("length"))
    matrix = np.eye(4)
    u, v = {"Z": (0, 1), "X": (2, 1), "Y": (0, 2)}[axis]
    normal = 3 - u - v
    matrix[:3, :3] = 0
    # The mesh lies in XY and faces +Z; its second edge is turned so that it faces +axis.
    flip = -1.0 if np.cross(np.eye(3)[u], np.eye(3)[v])[normal] < 0 else 1.0
    matrix[u, 0], matrix[v, 1], matrix[normal, 2] = 0.5 * width, 0.5 * flip * length, 1.0
    return matrix


def _grid(rows: int, columns: int, closed: bool) -> np.ndarray:
    """Quads of a grid of points, counter-clockwise when columns go right and rows go up."""
    last = columns if closed else columns - 1
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(last), indexing="ij")
    a = r * columns + c
    b = r * columns + (c + 1) % columns
    return np.stack([a, b, b + columns, a + columns], axis=-1).reshape(-1, 4)


def _data(points: np.ndarray, faces: np.ndarray, normals: np.ndarray | None) -> MeshData:
    return MeshData(
        points=points.astype(np.float32),
        face_counts=np.full(len(faces), faces.shape[1], np.uint32),
        face_indices=faces.reshape(-1).astype(np.uint32),
        normals=None if normals is None else normals.astype(np.float32),
        normal_interpolation="vertex",
    )


def _surface_of_revolution(
    heights: np.ndarray, radii: np.ndarray, slope_z: np.ndarray, slope_r: np.ndarray
) -> MeshData:
    """Rings around +Z, from low to high; the slopes are the normal's parts along Z and outwards.

    A ring of radius 0 leaves degenerate edges, so its quads are really triangles; the engine drops
    what has no area.
    """
    angles = np.arange(AROUND) * (2 * np.pi / AROUND)
    around = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    points = np.concatenate(
        [
            radii[:, None, None] * around,
            np.broadcast_to(heights[:, None, None], (len(heights), AROUND, 1)),
        ],
        axis=2,
    )
    normals = np.concatenate(
        [
            slope_r[:, None, None] * around,
            np.broadcast_to(slope_z[:, None, None], (len(heights), AROUND, 1)),
        ],
        axis=2,
    )
    faces = _grid(len(heights), AROUND, True)
    return _data(points.reshape(-1, 3), _triangles(faces, radii), normals.reshape(-1, 3))


def _triangles(faces: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Quads as triangles, without those whose edge is a pole."""
    lower = faces[:, [0, 1, 2]]
    upper = faces[:, [0, 2, 3]]
    ring = np.arange(len(radii) - 1).repeat(AROUND)
    return np.concatenate([lower[radii[ring] > 0], upper[radii[ring + 1] > 0]])


def _join(*parts: MeshData) -> MeshData:
    starts = np.cumsum([0] + [len(p.points) for p in parts[:-1]])
    return MeshData(
        points=np.concatenate([p.points for p in parts]),
        face_counts=np.concatenate([p.face_counts for p in parts]),
        face_indices=np.concatenate([p.face_indices + np.uint32(s) for p, s in zip(parts, starts)]),
        normals=np.concatenate([p.normals for p in parts]),
        normal_interpolation="vertex",
    )


def _cap(radius: float, height: float, up: float) -> MeshData:
    """A disk at a height, facing +Z (up 1) or -Z (up -1)."""
    angles = np.arange(AROUND) * (2 * np.pi / AROUND)
    rim = np.stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(AROUND, height)], axis=-1
    )
    points = np.concatenate([rim, [[0.0, 0.0, height]]])
    here = np.arange(AROUND)
    following = (here + 1) % AROUND
    order = (here, following) if up > 0 else (following, here)
    faces = np.stack([*order, np.full(AROUND, AROUND)], axis=-1)
    return _data(points, faces, np.tile([0.0, 0.0, up], (AROUND + 1, 1)))


def sphere() -> MeshData:
    """Unit sphere."""
    polar = np.linspace(-np.pi / 2, np.pi / 2, POLE_TO_POLE + 1)
    height, radius = np.sin(polar), np.cos(polar)
    radius[[0, -1]] = 0
    return _surface_of_revolution(height, radius, height, np.cos(polar))


def cube() -> MeshData:
    """Cube from -1 to 1, its points, faces and corners in the order of OpenUSD's imaging.

    The order is what primvars are authored in: around +Z from +X +Y, then around -Z from -X -Y;
    the faces +Z, -Z, +Y, -Y, +X, -X.
    """
    rim = [[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]
    corner = np.array(rim + [[-x, -y, -z] for x, y, z in (rim[0], rim[3], rim[2], rim[1])], float)
    faces = np.array(
        [[0, 1, 2, 3], [4, 5, 6, 7], [0, 6, 5, 1], [4, 7, 3, 2], [0, 3, 7, 6], [4, 2, 1, 5]]
    )
    return _data(corner, faces, None)


def plane() -> MeshData:
    """Square from -1 to 1 in XY, facing +Z."""
    corner = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    return _data(corner, np.arange(4)[None], None)


def cylinder(top: float = 1.0, bottom: float = 1.0, height: float = 2.0) -> MeshData:
    """Cylinder or frustum around +Z, centred, with caps."""
    slant = np.hypot(height, bottom - top) or 1.0
    heights = np.array([-0.5 * height, 0.5 * height])
    side = _surface_of_revolution(
        heights,
        np.array([bottom, top]),
        np.full(2, (bottom - top) / slant),
        np.full(2, height / slant),
    )
    caps = [
        _cap(radius, up * 0.5 * height, up)
        for radius, up in ((bottom, -1.0), (top, 1.0))
        if radius > 0
    ]
    return _join(side, *caps)


def cone() -> MeshData:
    """Cone of base radius 1 at z = -1 and its tip at z = 1."""
    return cylinder(0.0, 1.0, 2.0)


def capsule(top: float, bottom: float, height: float) -> MeshData:
    """Two spherical caps and what joins them, tangent to both, around +Z.

    `height` is the distance between the spheres' centres.
    """
    sine = np.clip((bottom - top) / height, -1, 1) if height > 0 else 0.0
    joint = np.arcsin(sine)  # polar angle at which the side leaves each sphere
    low = np.linspace(-np.pi / 2, joint, POLE_TO_POLE // 2 + 1)
    high = np.linspace(joint, np.pi / 2, POLE_TO_POLE // 2 + 1)
    heights = np.concatenate(
        [bottom * np.sin(low) - 0.5 * height, top * np.sin(high) + 0.5 * height]
    )
    radii = np.concatenate([bottom * np.cos(low), top * np.cos(high)])
    radii[[0, -1]] = 0
    angle = np.concatenate([low, high])
    return _surface_of_revolution(heights, radii, np.sin(angle), np.cos(angle))
