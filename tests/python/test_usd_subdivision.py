"""Subdivision surfaces against splines and limit masks worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pxr")

from segue import usd
from segue.usd.subdivision import Cage, Refinement
from stages import load, reported

CUBE_POINTS = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)
CUBE_FACES = np.array([0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5])
CUBE_EDGES = np.array(
    [[a, b] for a in range(8) for b in range(a + 1, 8) if bin(a ^ b).count("1") == 1]
)


def cube(**options) -> Cage:
    return Cage(8, np.full(6, 4), CUBE_FACES, **options)


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Quads of an n x n grid, and its points with random heights; point (i, j) is i + n j."""
    i, j = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    a = (i + n * j).ravel()
    quads = np.stack([a, a + 1, a + 1 + n, a + n], axis=1)
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    heights = np.random.default_rng(3).normal(size=n * n)
    return quads, np.stack([x.ravel(), y.ravel(), heights], axis=1).astype(float)


def bspline(t: float) -> np.ndarray:
    """Uniform cubic B-spline basis."""
    return (
        np.array([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3])
        / 6
    )


@pytest.mark.parametrize("levels", [0, 1, 2, 3])
def test_a_cubes_corners_go_to_half_of_it(levels):
    # (9 v + 4 sum of edge neighbours + sum of diagonals) / 24 = (9 + 4 - 1) / 24 v.
    points = Refinement(cube(), False, levels).points(CUBE_POINTS)
    np.testing.assert_allclose(points[:8], CUBE_POINTS / 2, atol=1e-12)


def test_a_regular_grid_is_a_bicubic_spline():
    n, levels = 7, 3
    quads, points = grid(n)
    refinement = Refinement(Cage(n * n, np.full(len(quads), 4), quads.ravel()), False, levels)
    surface = refinement.points(points)
    heights = points[:, 2].reshape(n, n)  # [j, i]
    step = 2**levels
    tested = 0
    # Away from the border (three spans) the boundary rules do not reach; x and y are linear there.
    for x, y, z in surface:
        if not (2 <= x <= n - 3 and 2 <= y <= n - 3):
            continue
        assert x * step == pytest.approx(round(x * step), abs=1e-9)
        i, j = min(int(x), n - 4), min(int(y), n - 4)
        expected = bspline(y - j) @ heights[j - 1 : j + 3, i - 1 : i + 3] @ bspline(x - i)
        assert z == pytest.approx(expected, abs=1e-12)
        tested += 1
    assert tested == (2 * step + 1) ** 2


def test_a_boundary_is_a_cubic_spline_between_sharp_corners():
    n, levels = 6, 3
    quads, points = grid(n)
    refinement = Refinement(Cage(n * n, np.full(len(quads), 4), quads.ravel()), False, levels)
    surface = refinement.points(points)
    corners = [0, n - 1, n * n - n, n * n - 1]
    np.testing.assert_allclose(surface[corners], points[corners], atol=1e-12)
    row = points[:n, 2]
    edge = surface[surface[:, 1] == 0]
    middle = edge[(edge[:, 0] >= 1.999) & (edge[:, 0] <= 3.001)]
    assert len(middle) == 2**levels + 1
    for x, _, z in middle:
        i = min(int(x + 1e-9), n - 4)
        assert z == pytest.approx(bspline(x - i) @ row[i - 1 : i + 3], abs=1e-12)


def test_boundary_corners_may_be_round():
    quads, points = grid(4)
    sharp = Cage(16, np.full(9, 4), quads.ravel())
    round_ = Cage(16, np.full(9, 4), quads.ravel(), sharp_corners=False)
    a, b = (Refinement(c, False, 2).points(points)[0] for c in (sharp, round_))
    np.testing.assert_allclose(a, points[0])
    np.testing.assert_allclose(b, (4 * points[0] + points[1] + points[4]) / 6)


def triangles(n: int) -> tuple[np.ndarray, np.ndarray]:
    quads, points = grid(n)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]), points


@pytest.mark.parametrize("levels", [0, 1, 2])
def test_loop_on_a_regular_grid_is_a_box_spline(levels):
    n = 7
    faces, points = triangles(n)
    refinement = Refinement(Cage(n * n, np.full(len(faces), 3), faces.ravel()), True, levels)
    surface = refinement.points(points)
    center = 3 + 3 * n
    around = [center + d for d in (1, -1, n, -n, n + 1, -n - 1)]
    expected = (6 * points[center] + points[around].sum(axis=0)) / 12
    np.testing.assert_allclose(surface[center], expected, atol=1e-12)


@pytest.mark.parametrize("loop", [False, True])
@pytest.mark.parametrize("levels", [1, 3])
def test_limit_points_do_not_depend_on_the_level(loop, levels):
    if loop:
        faces, points = triangles(5)
        cage = Cage(25, np.full(len(faces), 3), faces.ravel())
    else:
        quads, points = grid(5)
        cage = Cage(25, np.full(16, 4), quads.ravel())
    coarse = Refinement(cage, loop, 0).points(points)
    fine = Refinement(cage, loop, levels).points(points)
    np.testing.assert_allclose(fine[:25], coarse, atol=1e-12)


def test_faces_of_any_size_close_up():
    """Euler's number of a refined prism with pentagonal ends stays that of a sphere."""
    a = np.arange(5)
    counts = np.array([5, 5, 4, 4, 4, 4, 4])
    sides = np.stack([a, (a + 1) % 5, (a + 1) % 5 + 5, a + 5], axis=1)
    corners = np.concatenate([a[::-1], a + 5, sides.ravel()])
    level = Refinement(Cage(10, counts, corners), False, 2).finest
    assert not level.boundary.any()
    assert level.cage.points - len(level.edges) + len(level.cage.counts) == 2


def test_infinite_creases_keep_the_cube():
    creased = cube(creases=CUBE_EDGES, crease_sharpness=np.full(12, np.inf))
    points = Refinement(creased, False, 3).points(CUBE_POINTS)
    np.testing.assert_allclose(np.abs(points).max(axis=1), 1)
    np.testing.assert_allclose(points[:8], CUBE_POINTS)


def test_semi_sharp_creases_lie_between():
    def corner(sharpness):
        creased = cube(creases=CUBE_EDGES, crease_sharpness=np.full(12, sharpness))
        return Refinement(creased, False, 4).points(CUBE_POINTS)[7, 0]

    values = [corner(s) for s in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, np.inf)]
    assert values[0] == pytest.approx(0.5)
    assert values[-1] == pytest.approx(1)
    assert values == sorted(values)
    # Sharp for one level, then smooth: a cube of four times as many faces whose corner has moved
    # nowhere. Its limit mask: edge neighbours at 0 along one axis, diagonals at 0 along two.
    assert values[2] == pytest.approx((9 * 1 + 4 * 2 + 1) / 24)


def test_a_sharp_corner_stays():
    sharp = np.zeros(8)
    sharp[7] = np.inf
    points = Refinement(cube(corner_sharpness=sharp), False, 3).points(CUBE_POINTS)
    np.testing.assert_allclose(points[7], [1, 1, 1])
    np.testing.assert_allclose(points[0], [-0.5] * 3, atol=0.02)


def test_values_at_corners_stay_linear_in_their_face():
    refinement = Refinement(cube(), False, 2)
    corner = np.arange(24, dtype=float)[:, None]
    fine = refinement.values(corner, "corner")
    level = refinement.finest
    assert len(fine) == len(level.cage.corners)
    face = refinement.values(np.arange(6.0)[:, None], "face")[:, 0]
    per_corner = np.repeat(face, 4)
    # Each face's corners have the values 4 f to 4 f + 3; nothing bleeds into another face.
    assert np.all((fine[:, 0] >= 4 * per_corner) & (fine[:, 0] <= 4 * per_corner + 3))
    assert sorted(np.bincount(face.astype(int))) == [16] * 6


CUBE = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,2,3,1, 4,5,7,6, 0,1,5,4, 2,6,7,3, 0,4,6,2, 1,3,7,5]
    point3f[] points = [(-1,-1,-1), (1,-1,-1), (-1,1,-1), (1,1,-1),
                        (-1,-1,1), (1,-1,1), (-1,1,1), (1,1,1)]
"""


@pytest.mark.parametrize("hand", ["rightHanded", "leftHanded"])
def test_the_default_scheme_is_catmull_clark(hand):
    scene, imported = load(f'def Mesh "M" {{ {CUBE}\nuniform token orientation = "{hand}"\n}}')
    (mesh,) = scene.meshes
    assert len(mesh.face_counts) == 6 * 4**4
    radius = np.linalg.norm(mesh.points, axis=1)
    assert radius.min() > 0.8
    assert radius.max() < 0.9
    # Almost a sphere: normals along the radius, inwards for left-handed faces.
    outward = np.einsum("ij,ij->i", mesh.normals, mesh.points / radius[:, None])
    sign = -1 if hand == "leftHanded" else 1
    assert (sign * outward).min() > 0.97
    assert imported.report.entries == []


def test_authored_normals_do_not_count_on_a_subdivision_surface():
    scene, _ = load(
        f'def Mesh "M" {{ {CUBE}\nnormal3f[] normals = [(1, 0, 0)] (\n'
        'interpolation = "constant"\n)\n}'
    )
    assert len(scene.meshes[0].normals) == len(scene.meshes[0].points)


def test_creases_of_a_mesh_split_its_normals():
    scene, _ = load(
        f'def Mesh "M" {{ {CUBE}\n'
        "int[] creaseIndices = [4, 5, 7, 6, 4]\nint[] creaseLengths = [5]\n"
        "float[] creaseSharpnesses = [10]\n}"
    )
    (mesh,) = scene.meshes
    assert mesh.normal_interpolation == "corner"
    rim = np.abs(mesh.points[mesh.face_indices][:, 2] - mesh.points[:, 2].max()) < 1e-6
    top = mesh.normals[rim]
    # Along the creased rim some corners look straight up, others to the side.
    assert (top[:, 2] > 0.999).any()
    assert (top[:, 2] < 0.7).any()


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("int[] creaseIndices = [0, 1]\nint[] creaseLengths = [3]\n"
         "float[] creaseSharpnesses = [1]", "creases"),
        ("int[] creaseIndices = [0, 99]\nint[] creaseLengths = [2]\n"
         "float[] creaseSharpnesses = [1]", "creases"),
        ("int[] cornerIndices = [0, 1]\nfloat[] cornerSharpnesses = [1]", "corners"),
    ],
)  # fmt: skip
def test_broken_creases_are_said(text, what):
    scene, imported = load(f'def Mesh "M" {{ {CUBE}\n{text}\n}}')
    ((path, said),) = reported(imported, usd.Kind.WARNING)
    assert path == "/M"
    assert said.startswith(what)
    assert len(scene.meshes) == 1


def test_holes_slots_and_primvars_follow():
    scene, imported = load(f"""
def Mesh "M" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {{ {CUBE}
    int[] holeIndices = [2]
    color3f[] primvars:displayColor = [(0,0,0), (1,0,0), (2,0,0), (3,0,0), (4,0,0), (5,0,0)] (
        interpolation = "uniform"
    )
    def GeomSubset "S" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    ) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </Look>
    }}
}}
def Material "Look" {{
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }}
}}
""")
    (mesh,) = scene.meshes
    color = np.asarray(mesh.attributes["displayColor"].data)[:, 0]
    assert np.bincount(color.astype(int)).tolist() == [256] * 6
    assert (color[mesh.holes] == 2).all()
    assert len(mesh.holes) == 256
    np.testing.assert_array_equal(mesh.face_slots == 1, color == 1)
    assert imported.report.entries == []


@pytest.mark.parametrize(("kind", "inner"), [("vertex", False), ("varying", True)])
def test_vertex_values_are_smooth_and_varying_ones_linear(kind, inner):
    scene, _ = load(f"""
def Mesh "M" {{ {CUBE}
    color3f[] primvars:displayColor = [(0,0,0), (1,0,0), (0,0,0), (1,0,0),
        (0,0,0), (1,0,0), (0,0,0), (1,0,0)] (
        interpolation = "{kind}"
    )
}}
""")
    values = np.asarray(scene.meshes[0].attributes["displayColor"].data)[:8, 0]
    assert (set(values.round(6)) == {0, 1}) is inner
    if not inner:  # as the points do: the cube's corners go to half of it
        np.testing.assert_allclose(sorted(values), [0.25] * 4 + [0.75] * 4, atol=1e-6)


def test_loop_takes_polygons_apart():
    scene, _ = load(f'def Mesh "M" {{ {CUBE}\nuniform token subdivisionScheme = "loop"\n}}')
    (mesh,) = scene.meshes
    assert (mesh.face_counts == 3).all()
    assert len(mesh.face_counts) == 12 * 4**4


def test_without_boundary_interpolation_the_border_faces_are_gone():
    points = ", ".join(f"({x}, {y}, 0)" for y in range(4) for x in range(4))
    quads = [[a, a + 1, a + 5, a + 4] for a in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
    scene, _ = load(f"""
def Mesh "M" {{
    int[] faceVertexCounts = {[4] * 9}
    int[] faceVertexIndices = {np.ravel(quads).tolist()}
    point3f[] points = [{points}]
    uniform token interpolateBoundary = "none"
}}
""")
    (mesh,) = scene.meshes
    assert len(mesh.holes) == 8 * 4**4


def test_a_bilinear_surface_is_its_flat_cage():
    scene, imported = load(
        f'def Mesh "M" {{ {CUBE}\nuniform token subdivisionScheme = "bilinear"\n}}'
    )
    assert len(scene.meshes[0].points) == 8
    assert scene.meshes[0].normals is None
    assert imported.report.entries == []
