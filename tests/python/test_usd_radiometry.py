"""UsdLux lights through the whole chain: the brightness of a wall against closed forms.

A Lambertian wall of albedo 0.5 at z = 0 is seen by an orthographic camera from above; what a small
patch of it reflects is 0.5 E / pi, E being its irradiance.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("pxr")

import segue
from segue import usd
from stages import stage

pytestmark = pytest.mark.usefixtures("engine")
PI = math.pi

WALL = """
def Mesh "Wall" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0)]
    uniform token subdivisionScheme = "none"
    uniform bool doubleSided = 1
    rel material:binding = </Look>
}
def Material "Look" {
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.5, 0.5, 0.5)
        int inputs:useSpecularWorkflow = 1
        float inputs:ior = 1
        token outputs:surface
    }
}
def Camera "Camera" {
    token projection = "orthographic"
    float horizontalAperture = 0.1
    float verticalAperture = 0.1
    float2 clippingRange = (0.001, 1000)
    double3 xformOp:translate = (0, 0, 0.01)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def brightness(light: str, samples: int = 256) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard error of the wall's brightness around the origin."""
    imported = usd.load(stage(WALL + light), resolution=(16, 16))
    render = segue.Render(imported.scene, {**imported.settings(), "samples": samples})
    render.run()
    pixels = render.read_pass("Combined")[..., :3].reshape(-1, 3).astype(float)
    return pixels.mean(0), pixels.std(0, ddof=1) / math.sqrt(len(pixels))


def check(light: str, irradiance: float, color=(1, 1, 1)):
    mean, error = brightness(light)
    expected = 0.5 * irradiance / PI * np.array(color)
    # Five standard errors, and the 0.1 % that a patch of finite size is away from its centre.
    assert np.all(np.abs(mean - expected) <= 5 * error + 1e-3 * expected), (mean, expected, error)


def at(z: float, more: str = "") -> str:
    return (
        f"double3 xformOp:translate = (0, 0, {z})\n{more}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n'
    )


def rect_irradiance(radiance: float, width: float, height: float, z: float) -> float:
    """On the axis of a parallel rectangle: four corners of the standard form factor."""
    a, b = 0.5 * width / z, 0.5 * height / z
    x, y = math.hypot(1, a), math.hypot(1, b)
    quarter = (a / x * math.atan(b / x) + b / y * math.atan(a / y)) / (2 * PI)
    return radiance * PI * 4 * quarter


@pytest.mark.parametrize("normalize", [0, 1])
def test_rect(normalize):
    text = "float inputs:width = 2\nfloat inputs:height = 1\nfloat inputs:intensity = 3\n"
    text += f"bool inputs:normalize = {normalize}\n"
    expected = rect_irradiance(3 / (2 if normalize else 1), 2, 1, 1.5)
    check(f'def RectLight "L" {{\n{text}{at(1.5)}}}', expected)


@pytest.mark.parametrize("normalize", [0, 1])
def test_disk(normalize):
    radiance = 3 / (PI * 0.25 if normalize else 1)
    text = f"float inputs:intensity = 3\nbool inputs:normalize = {normalize}\n"
    check(f'def DiskLight "L" {{\n{text}{at(2)}}}', PI * radiance * 0.25 / (0.25 + 4))


@pytest.mark.parametrize("normalize", [0, 1])
def test_sphere(normalize):
    radiance = 3 / (PI if normalize else 1)
    text = f"float inputs:intensity = 3\nbool inputs:normalize = {normalize}\n"
    check(f'def SphereLight "L" {{\n{text}{at(2)}}}', PI * radiance * 0.25 / 4)


@pytest.mark.parametrize("normalize", [0, 1])
def test_cylinder(normalize):
    radiance = 4e4 / (2 * PI * 0.5 * 1 if normalize else 1)
    text = f"float inputs:intensity = 4e4\nbool inputs:normalize = {normalize}\n"
    # In the plane across its axis, a ray at the angle a meets the cylinder at the distance rho;
    # its length, small against rho, is seen under the angle 1 / rho.
    z, r = 100.0, 0.5
    edge = math.asin(r / z)
    a = (np.arange(10000) + 0.5) / 10000 * 2 * edge - edge
    rho = z * np.cos(a) - np.sqrt(r**2 - (z * np.sin(a)) ** 2)
    check(
        f'def CylinderLight "L" {{\n{text}{at(z)}}}',
        radiance * float((np.cos(a) / rho).mean()) * 2 * edge,
    )


def test_point():
    text = "float inputs:intensity = 32\nbool inputs:normalize = 1\nbool treatAsPoint = 1\n"
    check(f'def SphereLight "L" {{\n{text}{at(2)}}}', 8 / 4)


def test_exposure_and_color():
    text = "float inputs:exposure = 3\ncolor3f inputs:color = (1, 0.5, 0.25)\n"
    check(f'def SphereLight "L" {{\n{text}{at(2)}}}', PI * 8 * 0.25 / 4, (1, 0.5, 0.25))


@pytest.mark.parametrize("angle", [0, 0.53, 40])
def test_a_normalized_sun_is_irradiance(angle):
    text = f"float inputs:intensity = 3\nfloat inputs:angle = {angle}\nbool inputs:normalize = 1\n"
    check(f'def DistantLight "L" {{\n{text}}}', 3)


def test_a_sun_of_radiance():
    text = "float inputs:intensity = 3\nfloat inputs:angle = 40\n"
    check(f'def DistantLight "L" {{\n{text}}}', 3 * PI * math.sin(math.radians(20)) ** 2)


@pytest.mark.parametrize("kind", ["DomeLight", "DomeLight_1"])
def test_dome(kind):
    check(f'def {kind} "L" {{\nfloat inputs:intensity = 3\n}}', 3 * PI)


def test_a_cone_spares_what_is_outside():
    text = "float inputs:intensity = 3\nfloat inputs:shaping:cone:angle = {}\n"
    lamp = 'def SphereLight "L" (\nprepend apiSchemas = ["ShapingAPI"]\n) {{\n{}{}}}'
    # The wall's patch is on the axis; a lamp that points up does not reach it.
    check(lamp.format(text.format(60), at(2)), PI * 3 * 0.25 / 4)
    up = at(2, "float xformOp:rotateX = 180").replace(
        '["xformOp:translate"]', '["xformOp:translate", "xformOp:rotateX"]'
    )
    check(lamp.format(text.format(60), up), 0)


def test_a_mesh_light_is_the_rect_light_of_its_shape():
    text = """
def Mesh "L" (
    prepend apiSchemas = ["MeshLightAPI"]
) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [3, 2, 1, 0]
    point3f[] points = [(-1, -0.5, 1.5), (1, -0.5, 1.5), (1, 0.5, 1.5), (-1, 0.5, 1.5)]
    uniform token subdivisionScheme = "none"
    float inputs:intensity = 3
    uniform token light:materialSyncMode = "noMaterialResponse"
    bool inputs:normalize = 1
}
"""
    check(text, rect_irradiance(1.5, 2, 1, 1.5))
    # Turned over, its back is to the wall; a single-sided mesh emits from its front only.
    check(text.replace("[3, 2, 1, 0]", "[0, 1, 2, 3]"), 0)


def test_left_handed_faces_emit_from_their_front():
    text = """
def Mesh "L" (
    prepend apiSchemas = ["MeshLightAPI"]
) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -0.5, 1.5), (1, -0.5, 1.5), (1, 0.5, 1.5), (-1, 0.5, 1.5)]
    uniform token orientation = "leftHanded"
    uniform token subdivisionScheme = "none"
    float inputs:intensity = 3
    uniform token light:materialSyncMode = "noMaterialResponse"
}
"""
    check(text, rect_irradiance(3, 2, 1, 1.5))


def test_a_mirrored_mesh_keeps_its_front():
    text = """
def Mesh "L" (
    prepend apiSchemas = ["MeshLightAPI"]
) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [3, 2, 1, 0]
    point3f[] points = [(-1, -0.5, 1.5), (1, -0.5, 1.5), (1, 0.5, 1.5), (-1, 0.5, 1.5)]
    uniform token subdivisionScheme = "none"
    float inputs:intensity = 3
    uniform token light:materialSyncMode = "noMaterialResponse"
    double3 xformOp:scale = (-1, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
"""
    # UsdGeomGprim: the front is a matter of object space; a mirroring leaves it where it was.
    check(text, rect_irradiance(3, 2, 1, 1.5))
