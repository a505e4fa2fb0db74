"""Implicit shapes: closed, of the right size, facing outwards."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("pxr")

from pxr import UsdGeom

from segue import usd
from stages import load, reported, stage

PI = math.pi


def triangles(scene) -> tuple[np.ndarray, np.ndarray]:
    """Corner points and normals of the one shape's faces, fanned, in world space: (n, 3, 3)."""
    (instances,) = scene.instances
    mesh, matrix = instances.mesh, instances.transforms[0]
    points = mesh.points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3]
    normals = None
    if mesh.normals is not None:
        normals = mesh.normals.astype(float) @ np.linalg.inv(matrix[:3, :3])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    faces = []
    start = 0
    for count in mesh.face_counts:
        ring = mesh.face_indices[start : start + count]
        faces += [[ring[0], ring[i], ring[i + 1]] for i in range(1, count - 1)]
        start += count
    faces = np.array(faces)
    return points[faces], None if normals is None else normals[faces]


def area_and_volume(corners: np.ndarray) -> tuple[float, float]:
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    return 0.5 * np.linalg.norm(cross, axis=1).sum(), volume


SHAPES = [
    # type, attributes, area, volume
    ("Sphere", "double radius = 2", 16 * PI, 32 * PI / 3),
    ("Cube", "double size = 3", 54, 27),
    ("Cylinder", "double radius = 2\ndouble height = 5", 28 * PI, 20 * PI),
    (
        "Cylinder_1",
        "double radiusTop = 1\ndouble radiusBottom = 2\ndouble height = 3",
        PI * (1 + 4 + 3 * math.sqrt(10)),
        PI * 7,
    ),
    ("Cone", "double radius = 2\ndouble height = 3", PI * (4 + 2 * math.sqrt(13)), 4 * PI),
    ("Capsule", "double radius = 2\ndouble height = 5", 36 * PI, 20 * PI + 32 * PI / 3),
    (
        "Capsule_1",
        "double radiusTop = 2\ndouble radiusBottom = 2\ndouble height = 5",
        36 * PI,
        20 * PI + 32 * PI / 3,
    ),
]


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(("kind", "attributes", "area", "volume"), SHAPES)
def test_area_and_volume(kind, attributes, area, volume, axis):
    extra = "" if kind in ("Sphere", "Cube") else f'uniform token axis = "{axis}"'
    scene, imported = load(f'def {kind} "S" {{\n{attributes}\n{extra}\n}}')
    corners, normals = triangles(scene)
    found_area, found_volume = area_and_volume(corners)
    # A volume with the right sign says that the faces wind counter-clockwise seen from outside.
    assert found_area == pytest.approx(area, rel=2e-3)
    assert found_volume == pytest.approx(volume, rel=2e-3)
    if normals is not None:
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        assert np.einsum("ijk,ik->ij", normals, flat).min() > 0.99
    assert imported.report.entries == []


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(("kind", "attributes"), [(s[0], s[1]) for s in SHAPES])
def test_extent_is_the_one_usd_computes(kind, attributes, axis):
    extra = "" if kind in ("Sphere", "Cube") else f'uniform token axis = "{axis}"'
    scene, _ = load(f'def {kind} "S" {{\n{attributes}\n{extra}\n}}')
    corners, _ = triangles(scene)
    made = stage(f'def {kind} "S" {{\n{attributes}\n{extra}\n}}')
    prim = made.GetPrimAtPath("/S")
    expected = UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), 0)
    np.testing.assert_allclose(corners.min(axis=(0, 1)), expected[0], atol=1e-5)
    np.testing.assert_allclose(corners.max(axis=(0, 1)), expected[1], atol=1e-5)


def test_a_cubes_primvars_are_in_openusds_order():
    scene, _ = load(
        'def Cube "C" {\n'
        "color3f[] primvars:displayColor = [(0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), "
        '(1, 0, 0), (-1, 0, 0)] (\ninterpolation = "uniform"\n)\n}\n'
    )
    corners, _ = triangles(scene)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    (mesh,) = scene.meshes
    np.testing.assert_array_equal(cross[::2] / 4, mesh.attributes["displayColor"].data)
    # Vertices: from +X +Y around the top, then from -X -Y around the bottom.
    assert mesh.points[[0, 2, 4, 6]].tolist() == [[1, 1, 1], [-1, -1, 1], [-1, -1, -1], [1, 1, -1]]


def test_the_tip_of_a_cone_is_on_its_axis():
    scene, _ = load('def Cone "S" {\nuniform token axis = "X"\ndouble height = 4\n}')
    corners, _ = triangles(scene)
    tip = corners.reshape(-1, 3)[corners.reshape(-1, 3)[:, 0].argmax()]
    np.testing.assert_allclose(tip, [2, 0, 0], atol=1e-6)


def test_a_tapered_capsule_is_tangent():
    scene, _ = load(
        'def Capsule_1 "S" {\ndouble radiusTop = 0.5\ndouble radiusBottom = 1\ndouble height = 2\n}'
    )
    corners, normals = triangles(scene)
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    assert np.einsum("ijk,ik->ij", normals, flat).min() > 0.99
    z = corners.reshape(-1, 3)[:, 2]
    assert (z.min(), z.max()) == pytest.approx((-2, 1.5))


@pytest.mark.parametrize(
    ("axis", "low", "normal"),
    [("X", (0, -3, -1), (1, 0, 0)), ("Y", (-1, 0, -3), (0, 1, 0)), ("Z", (-1, -3, 0), (0, 0, 1))],
)
def test_plane(axis, low, normal):
    scene, _ = load(
        f'def Plane "S" {{\ndouble width = 2\ndouble length = 6\nuniform token axis = "{axis}"\n}}'
    )
    corners, _ = triangles(scene)
    np.testing.assert_allclose(corners.min(axis=(0, 1)), low)
    np.testing.assert_allclose(corners.max(axis=(0, 1)), -np.array(low))
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(cross / np.linalg.norm(cross, axis=1, keepdims=True), [normal] * 2)
    assert scene.instances[0].two_sided_emission


def test_spheres_share_their_triangles():
    scene, _ = load(
        "".join(f'def Sphere "S{n}" {{\ndouble radius = {n + 1}\n}}\n' for n in range(9))
    )
    assert len(scene.meshes) == 1
    assert [i.transforms[0][0, 0] for i in scene.instances] == list(range(1, 10))


def test_a_shape_without_size_is_left_out():
    scene, imported = load('def Sphere "S" {\ndouble radius = 0\n}')
    assert scene.instances == []
    assert reported(imported, usd.Kind.LEFT_OUT) == [("/S", "a shape without size")]


@pytest.mark.parametrize(
    ("kind", "what"),
    [
        ("BasisCurves", "curves"),
        ("NurbsCurves", "curves"),
        ("HermiteCurves", "curves"),
        ("NurbsPatch", "NURBS patches"),
        ("Points", "points"),
        ("TetMesh", "tetrahedral meshes"),
        ("Volume", "volumes"),
        ("SkelRoot", "skinning"),
    ],
)
def test_what_is_not_drawn_is_said(kind, what):
    scene, imported = load(f'def {kind} "S" {{ }}')
    assert scene.instances == []
    assert reported(imported, usd.Kind.UNSUPPORTED) == [("/S", what)]
