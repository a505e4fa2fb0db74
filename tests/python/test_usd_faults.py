"""Values that cannot be used: each is named, and the rest of the stage is drawn."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pxr")

import segue
from segue import usd
from stages import QUAD, load, reported, stage


def warnings(imported: usd.Imported) -> list[tuple[str, str, str]]:
    """Path, what and instead of each warning."""
    return [(e.path, e.what, e.instead) for e in imported.report.of(usd.Kind.WARNING)]


def test_a_blocked_sample_is_the_fallback():
    scene, imported = load(
        'def DistantLight "L" {\nfloat inputs:intensity.timeSamples = {1: None, 2: 7}\n}\n', frame=1
    )
    # UsdLux's fallback for a DistantLight is that of no other light.
    assert scene.lights["/L"]["radiance"] == [50000] * 3
    assert warnings(imported) == [
        ("/L", "inputs:intensity has no value", "its fallback 50000.0 is used")
    ]


@pytest.mark.parametrize(
    ("attribute", "value", "key", "number"),
    [
        ('string inputs:intensity = "a"', "inputs:intensity = a", "radiance", [1, 1, 1]),
        ("float inputs:color = 0.5", "inputs:color = 0.5", "radiance", [1, 1, 1]),
        ("float3 inputs:width = (3, 3, 3)", "inputs:width = (3, 3, 3)", "width", 1),
        ('string inputs:exposure = "a"', "inputs:exposure = a", "radiance", [1, 1, 1]),
        ('string inputs:diffuse = "a"', "inputs:diffuse = a", "radiance", [1, 1, 1]),
    ],
)
def test_values_of_a_wrong_type_on_lights(attribute, value, key, number):
    scene, imported = load(f'def RectLight "L" {{\n{attribute}\n}}\n')
    assert scene.lights["/L"][key] == number
    ((path, what, _),) = warnings(imported)
    assert (path, what) == ("/L", f"{value}, which cannot be used")


@pytest.mark.parametrize("kind", ["float", "double", "half", "int"])
def test_numbers_of_another_width_are_taken(kind):
    scene, imported = load(f'def RectLight "L" {{\n{kind} inputs:intensity = 3\n}}\n')
    assert scene.lights["/L"]["radiance"] == [3, 3, 3]
    assert imported.report.entries == []


@pytest.mark.parametrize(
    ("kind", "attribute", "value"),
    [
        ("Cylinder", 'uniform token axis = "x"', "axis = x"),
        ("Cone", 'uniform token axis = "W"', "axis = W"),
        ("Plane", 'uniform token axis = ""', "axis = "),
        ("Capsule", 'string height = "a"', "height = a"),
        ("Sphere", "float3 radius = (1, 1, 1)", "radius = (1, 1, 1)"),
        ("Cube", 'string size = "a"', "size = a"),
    ],
)
def test_values_of_a_wrong_kind_on_shapes(kind, attribute, value):
    plain, _ = load(f'def {kind} "S" {{ }}\n')
    scene, imported = load(f'def {kind} "S" {{\n{attribute}\n}}\n')
    np.testing.assert_array_equal(scene.instances[0].transforms, plain.instances[0].transforms)
    ((path, what, _),) = warnings(imported)
    assert (path, what) == ("/S", f"{value}, which cannot be used")


@pytest.mark.parametrize(
    ("attribute", "what", "color"),
    [
        (
            'color3f[] primvars:displayColor = [(1, 0, 0)] (\ninterpolation = "facevarying"\n)',
            "the primvar 'displayColor' has the unknown interpolation 'facevarying'",
            [0.18] * 3,
        ),
        (
            "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (\n"
            'interpolation = "point"\n)',
            "normals with the unknown interpolation 'point'",
            [0.18] * 3,
        ),
        ("color3f primvars:displayColor = (0.1, 0.2, 0.3)", "", [0.1, 0.2, 0.3]),
        ("float[] primvars:displayColor = [0.5]", "", [0.5] * 3),
    ],
)
def test_odd_primvars(attribute, what, color):
    scene, imported = load(f'def Mesh "M" {{\n{QUAD}\n{attribute}\n}}\n')
    (material,) = scene.instances[0].materials
    assert material["surface"]["color"] == pytest.approx(color)
    assert scene.meshes[0].normals is None
    assert [w[1] for w in warnings(imported)] == ([what] if what else [])


@pytest.mark.parametrize(
    ("kind", "attribute", "what"),
    [
        ("SphereLight", "float inputs:radius = inf", "inputs:radius = inf, which is not finite"),
        ("SphereLight", "float inputs:radius = -0.5", "inputs:radius = -0.5, which is negative"),
        ("DiskLight", "float inputs:radius = -0.5", "inputs:radius = -0.5, which is negative"),
        ("RectLight", "float inputs:width = -0.5", "inputs:width = -0.5, which is negative"),
        ("CylinderLight", "float inputs:length = nan", "inputs:length = nan, which is not finite"),
        ("DistantLight", "float inputs:angle = nan", "inputs:angle = nan, which is not finite"),
        ("SphereLight", "float inputs:radius = 1e20", "an area of 1.25664e+41, too large"),
        ("RectLight", "float inputs:intensity = nan", "not finite (nan, nan, nan)"),
        (
            "SphereLight",
            "float inputs:shaping:cone:angle = nan",
            "inputs:shaping:cone:angle = nan, which is not finite",
        ),
        (
            "DiskLight",
            "float inputs:shaping:focus = inf",
            "inputs:shaping:focus = inf, which is not finite",
        ),
    ],
)
def test_a_light_that_cannot_be_drawn_is_left_out(kind, attribute, what):
    scene, imported = load(
        f'def {kind} "L" (\nprepend apiSchemas = ["ShapingAPI"]\n) {{\n{attribute}\n}}\n'
    )
    assert list(scene.lights) == ["/Sky"]
    ((path, said, instead),) = warnings(imported)
    assert (path, instead) == ("/L", "left out")
    assert what in said


@pytest.mark.parametrize(("value", "said"), [("nan", "nan"), ("inf", "inf"), ("-1", "-1")])
def test_a_mesh_light_that_cannot_shine_is_a_mesh(value, said):
    scene, imported = load(
        'def Mesh "M" (\nprepend apiSchemas = ["MeshLightAPI"]\n) {\n'
        f"{QUAD}\nfloat inputs:intensity = {value}\n}}\n"
    )
    (material,) = scene.instances[0].materials
    assert material["surface"] == {"type": "diffuse", "color": [0.18] * 3}
    assert [p for p, what, _ in warnings(imported) if f"({said}, {said}, {said})" in what] == ["/M"]


def test_what_the_engine_refuses_of_a_light_is_left_out(engine):
    class Refusing(segue.Scene):
        def add_light(self, name, light):
            if name == "/L":
                raise segue.BadSceneError('light "/L": it is refused')
            return super().add_light(name, light)

    imported = usd.load(stage('def RectLight "L" { }\ndef Camera "Camera" { }\n'), scene=Refusing())
    assert warnings(imported) == [("/L", 'light "/L": it is refused', "left out")]


def test_an_operation_of_a_wrong_type_is_left_away():
    scene, imported = load(
        'def Xform "X" {\n'
        "double3 xformOp:translate = (1, 2, 3)\n"
        'string xformOp:rotateZ = "a"\n'
        "float3 xformOp:scale = (2, 2, 2)\n"
        "uniform token[] xformOpOrder = "
        '["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]\n'
        'def Sphere "Ball" { }\ndef Camera "Inner" { }\n}\n',
        camera="Inner",
    )
    np.testing.assert_array_equal(
        scene.instances[0].transforms[0],
        [[2, 0, 0, 1], [0, 2, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]],
    )
    assert scene.camera["transform"][3::4] == [1, 2, 3, 1]
    what = "xformOp:rotateZ has no value that can be used"
    assert warnings(imported) == [("/X", what, "it is left away")]


def test_an_order_that_is_none():
    scene, imported = load(
        'def Sphere "Ball" {\nfloat xformOp:magic = 2\n'
        'uniform token[] xformOpOrder = ["xformOp:magic"]\n}\n'
    )
    np.testing.assert_array_equal(scene.instances[0].transforms[0], np.eye(4))
    assert [path for path, _, _ in warnings(imported)] == ["/Ball"]


@pytest.mark.parametrize("attribute", ["creaseSharpnesses", "cornerSharpnesses"])
def test_sharpnesses_that_are_no_numbers(attribute):
    scene, imported = load(
        f'def Mesh "M" {{\n{QUAD.replace("none", "catmullClark")}\n'
        "int[] creaseIndices = [0, 1]\nint[] creaseLengths = [2]\nint[] cornerIndices = [2]\n"
        f"float[] creaseSharpnesses = [1]\nfloat[] cornerSharpnesses = [1]\n}}\n".replace(
            f"float[] {attribute} = [1]", f'string {attribute} = "a"'
        )
    )
    assert len(scene.meshes) == 1
    (what,) = [what for _, what, _ in warnings(imported)]
    assert what == f"{attribute.removesuffix('Sharpnesses')}s that do not fit the mesh"


def test_a_light_beyond_single_precision_is_left_out():
    scene, imported = load(
        'def SphereLight "L" {\ndouble3 xformOp:translate = (1e39, 0, 0)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n'
    )
    assert list(scene.lights) == ["/Sky"]
    assert warnings(imported) == [("/L", "a place beyond single precision", "left out")]


@pytest.mark.parametrize("name", ["FooBar", "PxrRectLight"])
def test_prims_of_unknown_schemas_are_said(name):
    scene, imported = load(f'def {name} "P" {{\ndef Sphere "Ball" {{ }}\n}}\n')
    assert reported(imported, usd.Kind.UNSUPPORTED) == [
        ("/P", f"prims of the unknown type '{name}'")
    ]
    assert [i.name for i in scene.instances] == ["/P/Ball"]


@pytest.mark.parametrize(
    ("binding", "path", "what"),
    [
        ("rel material:binding = </Nope>", "/M", "names /Nope, which does not exist"),
        ("rel material:binding = </M>", "/M", "names /M, which is no material"),
        ("rel material:binding = [</A>, </B>]", "/M", "has 2 targets"),
        ("rel material:binding:full = </Nope>", "/M", "names /Nope, which does not exist"),
    ],
)
def test_bindings_that_bind_nothing_are_said(binding, path, what):
    _, imported = load(
        'def Mesh "M" (\nprepend apiSchemas = ["MaterialBindingAPI"]\n) {\n'
        f"{QUAD}\n{binding}\n}}\n"
        'def Material "A" { }\ndef Material "B" { }\n'
    )
    name = binding.split()[1]
    assert warnings(imported) == [(path, f"{name} {what}", "the binding is ignored")]


def test_an_inherited_binding_that_binds_nothing_is_said_once():
    _, imported = load(
        'def Xform "X" (\nprepend apiSchemas = ["MaterialBindingAPI"]\n) {\n'
        "rel material:binding = </Nope>\n"
        f'def Mesh "A" {{\n{QUAD}\n}}\ndef Mesh "B" {{\n{QUAD}\n}}\n}}\n'
    )
    assert [path for path, _, _ in warnings(imported)] == ["/X"]


@pytest.mark.parametrize(
    "interpolation", ["uniform", "vertex", "varying", "faceVarying", "instance"]
)
def test_values_for_each_instance_are_said(interpolation):
    _, imported = load(
        'def PointInstancer "P" {\nrel prototypes = </P/Q>\nint[] protoIndices = [0]\n'
        "point3f[] positions = [(0, 0, 0)]\n"
        f'color3f[] primvars:displayColor = [(1, 0, 0)] (\ninterpolation = "{interpolation}"\n)\n'
        'def Cube "Q" { }\n}\n'
    )
    assert ("/P", "values of 'displayColor' for each instance") in reported(
        imported, usd.Kind.UNSUPPORTED
    )


def test_indices_that_are_no_numbers():
    scene, imported = load(
        'def PointInstancer "P" {\nrel prototypes = </P/Q>\nstring[] protoIndices = ["a"]\n'
        'point3f[] positions = [(0, 0, 0)]\ndef Cube "Q" { }\n}\n'
    )
    assert scene.instances == []
    assert [path for path, _, _ in warnings(imported)] == ["/P"]


@pytest.mark.parametrize("kind", ["DistantLight", "DomeLight"])
def test_shaping_of_infinite_lights_is_said(kind):
    scene, imported = load(
        f'def {kind} "L" (\nprepend apiSchemas = ["ShapingAPI"]\n) {{\n'
        "float inputs:shaping:cone:angle = 20\n}\n"
    )
    assert "shaping" not in scene.lights["/L"]
    assert reported(imported, usd.Kind.UNSUPPORTED) == [("/L", f"ShapingAPI on a {kind}")]
