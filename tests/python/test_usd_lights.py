"""Lights: the radiance handed over, against UsdLux's definitions worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("pxr")

from pxr import UsdLux

from segue import usd
from stages import QUAD, load, reported

CAMERA = 'def Camera "Camera" { }'
PI = math.pi


def light(body: str, header: str = 'upAxis = "Y"'):
    """The one light of a stage, and the report."""
    scene, imported = load(body + CAMERA, header, plain=True)
    (description,) = scene.lights.values()
    return description, imported


def transform(description: dict) -> np.ndarray:
    return np.array(description["transform"]).reshape(4, 4)


@pytest.mark.parametrize(
    ("attributes", "radiance"),
    [
        ("", [1, 1, 1]),
        ("float inputs:intensity = 3", [3, 3, 3]),
        ("float inputs:exposure = 4", [16, 16, 16]),
        ("float inputs:exposure = -1\nfloat inputs:intensity = 3", [1.5, 1.5, 1.5]),
        ("color3f inputs:color = (0.5, 0.25, 2)\nfloat inputs:intensity = 4", [2, 1, 8]),
        # Ignored where it is not enabled.
        ("float inputs:colorTemperature = 2000", [1, 1, 1]),
    ],
)
@pytest.mark.parametrize("kind", ["Rect", "Disk", "Sphere", "Cylinder", "Dome"])
def test_radiance(kind, attributes, radiance):
    found, _ = light(f'def {kind}Light "L" {{\n{attributes}\n}}\n')
    assert found["radiance"] == pytest.approx(radiance, rel=2e-3)


@pytest.mark.parametrize("kelvin", [1500, 2700, 6500, 9000])
def test_color_temperature(kelvin):
    found, _ = light(
        f'def RectLight "L" {{\nfloat inputs:colorTemperature = {kelvin}\n'
        "bool inputs:enableColorTemperature = 1\ncolor3f inputs:color = (0.5, 1, 2)\n}\n"
    )
    tint = np.array(found["radiance"]) / [0.5, 1, 2]
    np.testing.assert_allclose(tint, UsdLux.BlackbodyTemperatureAsRgb(kelvin), rtol=1e-6)
    # UsdLux: blackbodies keep their luminance, warm ones are red, cool ones blue. (A Planckian
    # radiator of 6500 K is a little off the white of Rec.709, which is D65.)
    assert tint @ [0.2126, 0.7152, 0.0722] == pytest.approx(1, rel=1e-3)
    assert bool(tint[0] > tint[2]) is (kelvin <= 6500)


SCALE = 'double3 xformOp:scale = {}\nuniform token[] xformOpOrder = ["xformOp:scale"]'


@pytest.mark.parametrize(
    ("kind", "size", "scale", "area"),
    [
        ("Rect", "float inputs:width = 2\nfloat inputs:height = 3", (1, 1, 1), 6),
        ("Rect", "float inputs:width = 2\nfloat inputs:height = 3", (0.5, 4, 9), 12),
        ("Disk", "float inputs:radius = 2", (1, 1, 1), 4 * PI),
        ("Disk", "float inputs:radius = 2", (3, 0.5, 7), 6 * PI),
        ("Sphere", "float inputs:radius = 2", (1, 1, 1), 16 * PI),
        ("Sphere", "float inputs:radius = 2", (0.5, 0.5, 0.5), 4 * PI),
        # Prolate spheroid, semi-axes 1, 1, 2: 2 pi (1 + 2 asin(e) / e), e = sqrt(3) / 2.
        (
            "Sphere",
            "float inputs:radius = 1",
            (1, 1, 2),
            2 * PI * (1 + 2 * math.asin(math.sqrt(0.75)) / math.sqrt(0.75)),
        ),
        ("Cylinder", "float inputs:radius = 2\nfloat inputs:length = 5", (1, 1, 1), 20 * PI),
        ("Cylinder", "float inputs:radius = 2\nfloat inputs:length = 5", (3, 0.5, 0.5), 30 * PI),
    ],
)
def test_normalize_divides_by_the_world_space_area(kind, size, scale, area):
    body = (
        f'def {kind}Light "L" {{\nfloat inputs:intensity = 7\n{size}\n{SCALE.format(scale)}\n%s}}\n'
    )
    plain, _ = light(body % "")
    assert plain["radiance"] == pytest.approx([7] * 3)
    normalized, _ = light(body % "bool inputs:normalize = 1\n")
    assert normalized["radiance"] == pytest.approx([7 / area] * 3, rel=1e-6)


@pytest.mark.parametrize("units", [1, 0.01])
@pytest.mark.parametrize("normalize", [0, 1])
def test_radiance_does_not_change_with_the_units(units, normalize):
    found, _ = light(
        'def RectLight "L" {\nfloat inputs:intensity = 7\n'
        f"bool inputs:normalize = {normalize}\n}}\n",
        f"metersPerUnit = {units}",
    )
    assert found["radiance"] == pytest.approx([7] * 3)
    assert found["width"] == found["height"] == 1


@pytest.mark.parametrize(
    ("attributes", "key", "level", "angle"),
    [
        ("", "radiance", 50000, 0.53),
        ("float inputs:angle = 0\nfloat inputs:intensity = 3", "irradiance", 3, 0),
        (
            "float inputs:angle = 0\nfloat inputs:intensity = 3\nbool inputs:normalize = 1",
            "irradiance",
            3,
            0,
        ),
        (
            "float inputs:angle = 10\nfloat inputs:intensity = 3\nbool inputs:normalize = 1",
            "irradiance",
            3,
            10,
        ),
        ("float inputs:angle = 10\nfloat inputs:intensity = 3", "radiance", 3, 10),
    ],
)
def test_distant_light(attributes, key, level, angle):
    found, _ = light(f'def DistantLight "L" {{\n{attributes}\n}}\n')
    assert found[key] == pytest.approx([level] * 3)
    assert ("radiance" in found) != ("irradiance" in found)
    assert found["angle"] == pytest.approx(math.radians(angle))


@pytest.mark.parametrize("radius", [0, 0.001, 3])
def test_a_normalized_point_light_has_a_quarter_of_its_value_as_intensity(radius):
    # A sphere of radiance L has the intensity pi r^2 L, and normalised L = 32 / (4 pi r^2).
    found, _ = light(
        f'def SphereLight "L" {{\nfloat inputs:intensity = 32\nfloat inputs:radius = {radius}\n'
        "bool inputs:normalize = 1\nbool treatAsPoint = 1\n}\n"
    )
    assert found["type"] == "point"
    assert found["intensity"] == pytest.approx([8] * 3)


def test_a_point_light_that_is_not_normalized():
    found, _ = light(
        'def SphereLight "L" {\nfloat inputs:intensity = 5\nfloat inputs:radius = 2\n'
        f"bool treatAsPoint = 1\n{SCALE.format((3, 3, 3))}\n}}\n"
    )
    assert found["intensity"] == pytest.approx([5 * PI * 36] * 3)


def test_shaping():
    found, _ = light("""
def SphereLight "L" (
    prepend apiSchemas = ["ShapingAPI"]
) {
    float inputs:shaping:cone:angle = 30
    float inputs:shaping:cone:softness = 0.25
    float inputs:shaping:focus = 2
    color3f inputs:shaping:focusTint = (0.1, 0.2, 0.3)
}
""")
    assert found["shaping"] == {
        "cone_angle": pytest.approx(PI / 6),
        "cone_softness": 0.25,
        "focus": 2,
        "focus_tint": pytest.approx([0.1, 0.2, 0.3]),
    }


@pytest.mark.parametrize(
    ("kind", "angle", "shaped"),
    [("Sphere", 90, True), ("Sphere", 180, False), ("Rect", 90, False), ("Rect", 89, True)],
)
def test_a_cone_that_cuts_nothing_off_is_left_away(kind, angle, shaped):
    found, _ = light(
        f'def {kind}Light "L" (\nprepend apiSchemas = ["ShapingAPI"]\n) {{\n'
        f"float inputs:shaping:cone:angle = {angle}\n}}\n"
    )
    assert ("shaping" in found) is shaped


Z_POLE = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]


@pytest.mark.parametrize(
    ("kind", "up", "axis", "rotation"),
    [
        ("DomeLight", "Y", "", np.eye(3)),
        ("DomeLight", "Z", "", np.eye(3)),
        ("DomeLight_1", "Y", "", np.eye(3)),
        ("DomeLight_1", "Z", "", Z_POLE),
        ("DomeLight_1", "Z", 'uniform token poleAxis = "Y"', np.eye(3)),
        ("DomeLight_1", "Y", 'uniform token poleAxis = "Z"', Z_POLE),
    ],
)
def test_the_domes_pole(kind, up, axis, rotation):
    found, _ = light(f'def {kind} "L" {{\n{axis}\n}}\n', f'upAxis = "{up}"')
    np.testing.assert_allclose(transform(found)[:3, :3], rotation)
    # The image's top is the pole, its centre is +Z of the dome: -Y of the stage for a Z pole.
    if rotation is Z_POLE:
        np.testing.assert_allclose(transform(found)[:3, :3] @ [0, 1, 0], [0, 0, 1])
        np.testing.assert_allclose(transform(found)[:3, :3] @ [0, 0, 1], [0, -1, 0])


def test_transformations_are_for_column_vectors():
    found, _ = light("""
def Xform "X" {
    double3 xformOp:translate = (1, 2, 3)
    float xformOp:rotateZ = 90
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]
    def RectLight "L" { }
}
""")
    expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(transform(found), expected, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("float inputs:diffuse = 0.5", "diffuse multiplier 0.5"),
        ("float inputs:specular = 0", "specular multiplier 0"),
        ("bool collection:lightLink:includeRoot = 0", "light linking"),
        ("rel collection:shadowLink:excludes = </Camera>", "shadow linking"),
        ("rel light:filters = </F>", "light filters"),
    ],
)
def test_what_is_not_supported_of_lights_is_said(text, what):
    _, imported = light(f'def RectLight "L" {{\n{text}\n}}\n')
    ((path, said),) = reported(imported, usd.Kind.UNSUPPORTED)
    assert path == "/L"
    assert what in said


@pytest.mark.parametrize(
    ("api", "text", "what"),
    [
        ("ShapingAPI", "asset inputs:shaping:ies:file = @lamp.ies@", "IES profile lamp.ies"),
        ("ShadowAPI", "bool inputs:shadow:enable = 0", "without true shadows"),
        ("ShadowAPI", "color3f inputs:shadow:color = (1, 0, 0)", "without true shadows"),
    ],
)
def test_what_is_not_supported_of_lights_schemas_is_said(api, text, what):
    _, imported = light(f'def RectLight "L" (\nprepend apiSchemas = ["{api}"]\n) {{\n{text}\n}}\n')
    ((path, said),) = reported(imported, usd.Kind.UNSUPPORTED)
    assert path == "/L"
    assert what in said


def test_default_shadows_are_not_reported():
    _, imported = light('def RectLight "L" (\nprepend apiSchemas = ["ShadowAPI"]\n) { }\n')
    assert imported.report.entries == []


@pytest.mark.parametrize(
    ("body", "kind"),
    [
        ('def RectLight "L" { float inputs:intensity = 0 }', usd.Kind.LEFT_OUT),
        ('def RectLight "L" { float inputs:width = 0 }', usd.Kind.LEFT_OUT),
        ('def SphereLight "L" { float inputs:radius = 0 }', usd.Kind.LEFT_OUT),
        ('def RectLight "L" { float inputs:intensity = -1 }', usd.Kind.WARNING),
        ('def RectLight "L" { float inputs:intensity = inf }', usd.Kind.WARNING),
        ('def PortalLight "L" { }', usd.Kind.UNSUPPORTED),
        (f'def RectLight "L" {{ {SCALE.format((0, 1, 1))} }}', usd.Kind.LEFT_OUT),
        ('def RectLight "L" { token visibility = "invisible" }', usd.Kind.LEFT_OUT),
    ],
)
def test_lights_that_do_not_shine_are_said(body, kind):
    body = body.replace("{ ", "{\n").replace(" }", "\n}")
    scene, imported = load(body)
    assert list(scene.lights) == ["/Sky"]
    assert [path for path, _ in reported(imported, kind)] == ["/L"]


@pytest.mark.parametrize(
    "body",
    [
        'def DistantLight "L" {\nfloat inputs:intensity.timeSamples = {1: 0, 2: 3}\n}\n',
        'def SphereLight "L" {\ntoken visibility = "invisible"\n}\n',
        'def SphereLight "L" {\nfloat inputs:intensity = -1\n}\n',
        'def PortalLight "L" { }\n',
        'def Volume "V" (\nprepend apiSchemas = ["VolumeLightAPI"]\n) { }\n',
        'def Material "Look" {\ntoken outputs:surface.connect = </Look/S.outputs:surface>\n'
        'def Shader "S" {\nuniform token info:id = "UsdPreviewSurface"\n'
        "color3f inputs:emissiveColor.timeSamples = {1: (0, 0, 0), 2: (2, 2, 2)}\n"
        "token outputs:surface\n}\n}\n",
    ],
)
def test_a_stage_whose_lights_are_off_is_dark(body):
    scene, imported = load(body + 'def Camera "Camera" { }', plain=True, frame=1)
    assert scene.lights == {}
    assert reported(imported, usd.Kind.NOTE) == []


def test_a_black_emission_is_no_light():
    scene, _ = load(
        'def Material "Look" {\ntoken outputs:surface.connect = </Look/S.outputs:surface>\n'
        'def Shader "S" {\nuniform token info:id = "UsdPreviewSurface"\n'
        "color3f inputs:emissiveColor = (0, 0, 0)\ntoken outputs:surface\n}\n}\n"
        'def Camera "Camera" { }',
        plain=True,
    )
    assert set(scene.lights) == {"default sky", "default lamp"}


def test_a_stage_without_lights_gets_some():
    body = f'def Camera "Camera" {{ }}\ndef Mesh "M" {{ {QUAD} }}'
    scene, imported = load(body, plain=True)
    sky, lamp = scene.lights.values()
    assert sky["type"] == "dome"
    # The lamp is behind the camera, above it and to its left.
    x, y, z = transform(lamp)[:3, :3] @ [0, 0, 1]
    assert x < -0.2
    assert y > 0.2
    assert z > 0.2
    np.testing.assert_allclose(
        transform(lamp)[:3, :3] @ transform(lamp)[:3, :3].T, np.eye(3), atol=1e-12
    )
    assert len(reported(imported, usd.Kind.NOTE)) == 1


GLOW = f"""
def Mesh "M" (
    prepend apiSchemas = [%s "MaterialBindingAPI"]
) {{ {QUAD}
    rel material:binding = </Look>
    float inputs:intensity = 6
    color3f inputs:color = (1, 0.5, 0.25)
    %s
}}
def Material "Look" {{
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.2, 0.2, 0.2)
        color3f inputs:emissiveColor = %s
        float inputs:ior = 1
        token outputs:surface
    }}
}}
"""


def emission(scene) -> tuple[dict | None, np.ndarray]:
    """The scattering part of the one material, and the radiance it emits."""
    surface = scene.instances[0].materials[0]["surface"]
    glow = surface["b"] if surface["type"] == "add" else surface
    if glow["type"] != "emission":
        return surface, np.zeros(3)
    radiance = np.broadcast_to(glow["color"], 3) * np.broadcast_to(glow["strength"], 3)
    return (surface["a"] if glow is not surface else None), radiance


def test_emissive_material():
    scene, imported = load(GLOW % ("", "", "(3, 2, 1)") + CAMERA, plain=True)
    scattering, radiance = emission(scene)
    assert scattering["type"] == "diffuse"
    np.testing.assert_allclose(radiance, [3, 2, 1])
    assert scene.lights == {}
    assert imported.counts["emissive gprims"] == 1
    assert not scene.instances[0].two_sided_emission


@pytest.mark.parametrize(
    ("mode", "glow", "scatters", "radiance"),
    [
        ("", "(2, 2, 4)", True, [12, 6, 6]),  # the default mode tints the light with the glow
        ('uniform token light:materialSyncMode = "independent"', "(2, 2, 4)", True, [6, 3, 1.5]),
        (
            'uniform token light:materialSyncMode = "noMaterialResponse"',
            "(2, 2, 4)",
            False,
            [6, 3, 1.5],
        ),
        ("", "(0, 0, 0)", True, [6, 3, 1.5]),
        (
            "bool inputs:normalize = 1\n" + SCALE.format((2, 3, 1)),
            "(0, 0, 0)",
            True,
            [1, 0.5, 0.25],
        ),
    ],
)
def test_mesh_light(mode, glow, scatters, radiance):
    scene, _ = load(GLOW % ('"MeshLightAPI",', mode, glow))
    scattering, found = emission(scene)
    np.testing.assert_allclose(found, radiance, rtol=1e-6)
    assert (scattering is not None) is scatters


def test_geometry_light():
    if not hasattr(UsdLux, "GeometryLight"):
        pytest.skip("this USD has no GeometryLight")
    scene, _ = load(
        f'def Mesh "M" {{ {QUAD} }}\n'
        'def GeometryLight "L" {\nrel geometry = </M>\nfloat inputs:intensity = 9\n}\n'
    )
    _, found = emission(scene)
    np.testing.assert_allclose(found, [9, 9, 9])


def test_camera_exposure_is_a_factor_on_all_that_emits():
    scene, _ = load(
        GLOW % ("", "", "(3, 2, 1)")
        + 'def Camera "Camera" {\nfloat exposure = 1\n}\ndef RectLight "L" { }\n',
        plain=True,
    )
    assert scene.lights["/L"]["radiance"] == pytest.approx([2, 2, 2])
    np.testing.assert_allclose(emission(scene)[1], [6, 4, 2])
