"""Shapes: turned, lofted, extruded and bevelled solids, all closed and facing outwards."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .mesh import Array, Mesh, merged, polygon_mesh

Modulation = Callable[[Array, Array], Array]


def curve(knots: ArrayLike, steps: int = 8) -> Array:
    """A centripetal Catmull-Rom curve through the knots, `steps` pieces between each two."""
    p = np.asarray(knots, float)
    p = np.concatenate([[2 * p[0] - p[1]], p, [2 * p[-1] - p[-2]]])
    t = np.concatenate([[0.0], np.cumsum(np.sqrt(np.linalg.norm(np.diff(p, axis=0), axis=1)))])
    out = []
    for i in range(1, len(p) - 2):
        u = np.linspace(t[i], t[i + 1], steps, endpoint=False)[:, None]

        def mix(a: Array, b: Array, ta: float, tb: float, u: Array = u) -> Array:
            return ((tb - u) * a + (u - ta) * b) / (tb - ta)

        a1 = mix(p[i - 1], p[i], t[i - 1], t[i])
        a2 = mix(p[i], p[i + 1], t[i], t[i + 1])
        a3 = mix(p[i + 1], p[i + 2], t[i + 1], t[i + 2])
        b1 = mix(a1, a2, t[i - 1], t[i + 1])
        b2 = mix(a2, a3, t[i], t[i + 2])
        out.append(mix(b1, b2, t[i], t[i + 1]))
    out.append(p[-2][None])
    return np.concatenate(out)


def arc(centre: Sequence[float], radius: float, start: float, end: float, steps: int = 6) -> Array:
    """Points on an arc in the plane, angles in degrees."""
    angle = np.radians(np.linspace(start, end, steps + 1))
    return np.asarray(centre) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def loft(rings: Array, wrap_rows: bool = False, wrap_columns: bool = True) -> Mesh:
    """A quad skin over an (m, n, 3) array of points; the outside is where column x row points to.

    A row whose points coincide becomes a pole of triangles.
    """
    rows, columns = rings.shape[:2]
    last_row = rows if wrap_rows else rows - 1
    last_column = columns if wrap_columns else columns - 1
    i, j = np.meshgrid(np.arange(last_row), np.arange(last_column), indexing="ij")
    k, n = (i + 1) % rows, (j + 1) % columns
    quads = np.stack([i * columns + j, i * columns + n, k * columns + n, k * columns + j], axis=-1)
    pole = np.ptp(rings, axis=1).max(axis=1) < 1e-9
    below, above = pole[i], pole[k]
    faces = [quads[~below & ~above], quads[below & ~above][:, [0, 2, 3]]]
    faces.append(quads[above & ~below][:, [0, 1, 2]])
    counts = np.concatenate([np.full(len(f), f.shape[1]) for f in faces])
    v, u = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    indices = np.concatenate([f.ravel() for f in faces])
    return _compact(Mesh(rings.reshape(-1, 3), counts, indices, uv))


def _compact(mesh: Mesh) -> Mesh:
    """The mesh without unused points."""
    used, indices = np.unique(mesh.indices, return_inverse=True)
    uv = None if mesh.uv is None else mesh.uv[used]
    return Mesh(mesh.points[used], mesh.counts, indices.reshape(-1), uv)


def lathe(
    profile: ArrayLike,
    segments: int = 64,
    modulate: Modulation | None = None,
    crease: float = 40.0,
    ring: bool = False,
) -> Mesh:
    """A profile of (radius, height) turned about the y axis.

    Walked along the profile, the outside is on the right. `modulate(angle, height)` gives a factor
    on the radius, for flutes and ribs. `ring` joins the profile's end to its start.
    """
    p = np.asarray(profile, float)
    # A seam of doubled points, so that u runs from 0 to 1 without a jump back.
    angle = np.linspace(0, 2 * np.pi, segments + 1)
    radius = np.repeat(p[:, :1], segments + 1, axis=1)
    height = np.repeat(p[:, 1:], segments + 1, axis=1)
    if modulate is not None:
        turn = np.broadcast_to(np.where(angle > 2 * np.pi - 1e-9, 0.0, angle), radius.shape)
        radius = radius * modulate(turn, height)
    c, s = np.cos(angle), np.sin(angle)
    c[-1], s[-1] = c[0], s[0]
    rings = np.stack([radius * c, height, -radius * s], axis=-1)
    return loft(rings, wrap_rows=ring, wrap_columns=False).smooth(crease)


def torus(major: float, minor: float, segments: int = 64, sides: int = 24) -> Mesh:
    """A torus about the y axis."""
    return lathe(arc((major, 0.0), minor, 0, 360, sides)[:-1], segments, ring=True)


def ball(radius: float, segments: int = 48, rings: int = 24) -> Mesh:
    """A sphere about the origin."""
    p = arc((0.0, 0.0), radius, -90, 90, rings)
    p[[0, -1], 0] = 0.0
    return lathe(p, segments, crease=180)


def tube(path: ArrayLike, radius: float, sides: int = 12) -> Mesh:
    """A round tube with flat ends along a path of points."""
    p = np.asarray(path, float)
    tangent = np.gradient(p, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent[0], [0.3, 0.9, 0.31])
    frames = []
    for t in tangent:
        side = side - t * (side @ t)
        side /= np.linalg.norm(side)
        frames.append((side, np.cross(t, side)))
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rows = [
        q + radius * (np.cos(angle)[:, None] * a + np.sin(angle)[:, None] * b)
        for q, (a, b) in zip(p, frames, strict=True)
    ]
    first, last = np.repeat(p[:1], sides, axis=0), np.repeat(p[-1:], sides, axis=0)
    return loft(np.array([first, *rows, last])).smooth(50)


def box(size: Sequence[float], bevel: float = 0.0, steps: int = 2) -> Mesh:
    """A box centred on the origin with rounded edges; uv is in metres on every side."""
    half = np.asarray(size, float) / 2
    if bevel <= 0:
        steps = 0
    core = half - bevel
    # Tangent spacing puts the rows of a rounded edge at equal angles.
    round_off = bevel * np.tan(np.linspace(-np.pi / 4, 0, steps + 1))
    parts = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        lines = [_edge_lines(core[a], round_off, bevel) for a in (u, v)]
        gu, gv = np.meshgrid(*lines, indexing="ij")
        for sign in (1.0, -1.0):
            q = np.zeros((*gu.shape, 3))
            q[..., axis], q[..., u], q[..., v] = sign * half[axis], gu, gv
            if bevel > 0:
                inner = np.clip(q, -core, core)
                out = q - inner
                q = inner + bevel * out / np.linalg.norm(out, axis=-1, keepdims=True)
            skin = loft(q, wrap_columns=False)
            skin = skin if sign < 0 else skin.flipped()
            flat = np.stack([skin.points[:, u], skin.points[:, v]], axis=1)
            parts.append(Mesh(skin.points, skin.counts, skin.indices, flat))
    return merged(parts).smooth(35 if bevel <= 0 else 60)


def _edge_lines(core: float, round_off: Array, bevel: float) -> Array:
    """Grid coordinates over one side of a rounded box."""
    if bevel <= 0:
        return np.array([-core, core])
    return np.concatenate([-core + round_off, -round_off[::-1] + core])


def extrude(outline: ArrayLike, depth: float, bevel: float = 0.0) -> Mesh:
    """An outline in xy, counter-clockwise, as a plate between z = -depth/2 and depth/2.

    The caps are fans about the outline's mean point, which must see the whole outline.
    """
    o = np.asarray(outline, float)
    inward = _inset(o, bevel)
    rows = [
        (inward, -depth / 2),
        (o, -depth / 2 + bevel),
        (o, depth / 2 - bevel),
        (inward, depth / 2),
    ]
    if bevel <= 0:
        rows = [(o, -depth / 2), (o, depth / 2)]
    rings = [np.column_stack([xy, np.full(len(o), z)]) for xy, z in rows]
    for at, z in ((0, -depth / 2), (len(rings) + 1, depth / 2)):
        rings.insert(at, np.tile([*o.mean(axis=0), z], (len(o), 1)))
    return loft(np.array(rings)).smooth(30)


def plate_ring(outer: ArrayLike, inner: ArrayLike, depth: float, bevel: float) -> Mesh:
    """A plate in the xy plane between two outlines of equally many points, edges bevelled."""
    o, i = np.asarray(outer, float), np.asarray(inner, float)
    h = depth / 2
    rows = [
        (_inset(o, bevel), -h),
        (o, -h + bevel),
        (o, h - bevel),
        (_inset(o, bevel), h),
        (_inset(i, -bevel), h),
        (i, h - bevel),
        (i, -h + bevel),
        (_inset(i, -bevel), -h),
    ]
    rings = np.array([np.column_stack([xy, np.full(len(xy), z)]) for xy, z in rows])
    return loft(rings, wrap_rows=True).smooth(30)


def _inset(outline: Array, distance: float) -> Array:
    """A counter-clockwise outline moved inwards along its corner normals."""
    edge = np.roll(outline, -1, axis=0) - outline
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    corner = normal + np.roll(normal, 1, axis=0)
    corner /= np.maximum(np.linalg.norm(corner, axis=1, keepdims=True), 1e-9)
    return outline + distance * corner


def gear_outline(teeth: int, root: float, tip: float) -> Array:
    """Outline of a spur gear with trapezoid teeth of four corners each, counter-clockwise.

    The first tooth is centred on the x axis.
    """
    phase = np.array([-0.32, -0.18, 0.18, 0.32])
    radius = np.tile([root, tip, tip, root], teeth)
    angle = 2 * np.pi * (np.arange(teeth)[:, None] + phase).ravel() / teeth
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def height_field(x: ArrayLike, z: ArrayLike, height: Callable[[Array, Array], Array]) -> Mesh:
    """An open sheet y = height(x, z) over a grid, facing up; uv is (x, z) in metres."""
    gx, gz = np.meshgrid(np.asarray(x, float), np.asarray(z, float), indexing="ij")
    rings = np.stack([gx, height(gx, gz), gz], axis=-1)
    sheet = loft(rings, wrap_columns=False)
    return Mesh(sheet.points, sheet.counts, sheet.indices, sheet.points[:, [0, 2]])


def basin_body(
    x: ArrayLike, z: ArrayLike, height: Callable[[Array, Array], Array], floor: float
) -> Mesh:
    """A closed body of liquid: a height field above, straight sides, a flat bottom at `floor`."""
    top = height_field(x, z, height)
    nx, nz = len(np.asarray(x)), len(np.asarray(z))
    grid = np.arange(nx * nz).reshape(nx, nz)
    rim = np.concatenate([grid[:, 0], grid[-1, 1:], grid[-2::-1, -1], grid[0, -2:0:-1]])
    below = top.points[rim].copy()
    below[:, 1] = floor
    ring = np.arange(len(rim))
    following = np.roll(ring, -1)
    sides = np.stack(
        [rim, rim[following], len(top.points) + following, len(top.points) + ring], axis=1
    )
    bottom = len(top.points) + ring
    body = Mesh(
        np.concatenate([top.points, below]),
        np.concatenate([top.counts, np.full(len(sides), 4), [len(bottom)]]),
        np.concatenate([top.indices, sides.ravel(), bottom]),
    )
    return body.smooth(45)


def quad(a: ArrayLike, b: ArrayLike, c: ArrayLike, d: ArrayLike) -> Mesh:
    """One flat quad, counter-clockwise from the front; uv is in metres from `a`."""
    p = np.array([a, b, c, d], float)
    w, h = np.linalg.norm(p[1] - p[0]), np.linalg.norm(p[3] - p[0])
    return polygon_mesh(p, [[0, 1, 2, 3]], [[0, 0], [w, 0], [w, h], [0, h]])
