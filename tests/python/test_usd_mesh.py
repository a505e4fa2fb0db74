"""Meshes: topology, normals, holes, subsets, primvars."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pxr")

from segue import usd
from stages import QUAD, load, reported


def test_polygons_of_any_size_keep_their_corners():
    scene, imported = load("""
def Mesh "M" {
    int[] faceVertexCounts = [3, 4, 5]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3, 4, 0, 4, 5, 6, 1]
    point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0), (-1,1,0), (-1,-1,0), (0,-1,0)]
    uniform token subdivisionScheme = "none"
}
""")
    (mesh,) = scene.meshes
    assert mesh.face_counts.tolist() == [3, 4, 5]
    assert mesh.face_indices.tolist() == [0, 1, 2, 0, 2, 3, 4, 0, 4, 5, 6, 1]
    assert mesh.points[4].tolist() == [-1, 1, 0]
    assert mesh.normals is None
    assert not mesh.left_handed
    assert imported.report.entries == []


@pytest.mark.parametrize(
    ("interpolation", "count", "expected"),
    [
        ("vertex", 4, "vertex"),
        ("varying", 4, "vertex"),
        ("faceVarying", 4, "corner"),
        ("uniform", 1, "face"),
        ("constant", 1, "constant"),
    ],
)
@pytest.mark.parametrize("name", ["normals", "primvars:normals"])
def test_authored_normals(interpolation, count, expected, name):
    values = ", ".join(["(0, 0.6, 0.8)"] * count)
    scene, imported = load(f"""
def Mesh "M" {{ {QUAD}
    normal3f[] {name} = [{values}] (
        interpolation = "{interpolation}"
    )
}}
""")
    (mesh,) = scene.meshes
    assert mesh.normal_interpolation == expected
    np.testing.assert_allclose(mesh.normals, [[0, 0.6, 0.8]] * count, rtol=1e-6)
    assert imported.report.entries == []


def test_indexed_normals_are_expanded():
    scene, _ = load(f"""
def Mesh "M" {{ {QUAD}
    normal3f[] primvars:normals = [(1, 0, 0), (0, 1, 0)] (
        interpolation = "faceVarying"
    )
    int[] primvars:normals:indices = [1, 0, 0, 1]
}}
""")
    assert scene.meshes[0].normals.tolist() == [[0, 1, 0], [1, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_wrong_number_of_normals_is_said_and_drawn_flat():
    scene, imported = load(f"""
def Mesh "M" {{ {QUAD}
    normal3f[] normals = [(0, 0, 1), (0, 0, 1)] (
        interpolation = "vertex"
    )
}}
""")
    assert scene.meshes[0].normals is None
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/M"
    assert "2 normals for 4" in what


CUBE = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,2,3,1, 4,5,7,6, 0,1,5,4, 2,6,7,3, 0,4,6,2, 1,3,7,5]
    point3f[] points = [(-1,-1,-1), (1,-1,-1), (-1,1,-1), (1,1,-1),
                        (-1,-1,1), (1,-1,1), (-1,1,1), (1,1,1)]
"""


def test_holes():
    scene, imported = load(f"""
def Mesh "M" {{ {CUBE}
    uniform token subdivisionScheme = "none"
    int[] holeIndices = [4, 1, 9]
}}
""")
    assert scene.meshes[0].holes.tolist() == [1, 4]
    assert reported(imported, usd.Kind.WARNING) == [("/M", "holeIndices out of range")]


@pytest.mark.parametrize("double", [False, True])
def test_orientation_and_sidedness(double):
    scene, _ = load(f"""
def Mesh "M" {{ {QUAD}
    uniform token orientation = "leftHanded"
    uniform bool doubleSided = {int(double)}
}}
""")
    assert scene.meshes[0].left_handed
    assert scene.instances[0].two_sided_emission is double


SUBSETS = f"""
def Mesh "M" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {{ {CUBE}
    uniform token subdivisionScheme = "none"
    rel material:binding = </Looks/Grey>
    def GeomSubset "Red" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    ) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [0, 3]
        rel material:binding = </Looks/Red>
    }}
    def GeomSubset "Unbound" {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [5]
    }}
    def GeomSubset "Selection" {{
        uniform token elementType = "face"
        uniform token familyName = "selection"
        int[] indices = [1, 2]
    }}
    def GeomSubset "Blue" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    ) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [3, 4, 17]
        rel material:binding = </Looks/Blue>
    }}
}}
"""

LOOKS = (
    'def Scope "Looks" {'
    + "".join(
        f"""
def Material "{name}" {{
    token outputs:surface.connect = </Looks/{name}/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = {color}
        float inputs:ior = 1
        token outputs:surface
    }}
}}
"""
        for name, color in (
            ("Grey", "(0.5, 0.5, 0.5)"),
            ("Red", "(1, 0, 0)"),
            ("Blue", "(0, 0, 1)"),
        )
    )
    + "}\n"
)


def test_subsets_give_each_face_its_material():
    scene, imported = load(SUBSETS + LOOKS)
    (mesh,) = scene.meshes
    (instances,) = scene.instances
    colors = [m["surface"]["color"] for m in instances.materials]
    by_face = [colors[slot] for slot in mesh.face_slots]
    # Face 1 is in no material subset, 5 in one without a binding: both have the mesh's own.
    assert by_face == [[1, 0, 0], 0.5, 0.5, [1, 0, 0], [0, 0, 1], 0.5]
    warnings = reported(imported, usd.Kind.WARNING)
    assert [path for path, _ in warnings] == ["/M/Blue", "/M/Blue"]
    assert "shares faces" in warnings[1][1]


PRIMVARS = """
def Mesh "M" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {
    int[] faceVertexCounts = [3, 3]
    int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
    rel material:binding = </Look>
    %s
}
def Material "Look" {
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Look/R.outputs:result>
        float inputs:ior = 1
        token outputs:surface
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "tint"
        float3 inputs:fallback = (0.1, 0.2, 0.3)
        float3 outputs:result
    }
}
"""


@pytest.mark.parametrize(
    ("interpolation", "count", "expected"),
    [
        ("constant", 1, "constant"),
        ("uniform", 2, "face"),
        ("vertex", 4, "vertex"),
        ("varying", 4, "vertex"),
        ("faceVarying", 6, "corner"),
    ],
)
@pytest.mark.parametrize("kind", ["color3f", "float3", "double3", "half3", "color4f"])
def test_primvars_of_every_interpolation_and_precision(interpolation, count, expected, kind):
    width = int(kind.rstrip("fh")[-1])
    values = ", ".join(str((i, 0.5, 0.25, 1)[:width]) for i in range(count))
    scene, imported = load(
        PRIMVARS
        % f"""{kind}[] primvars:tint = [{values}] (
        interpolation = "{interpolation}"
    )"""
    )
    attribute = scene.meshes[0].attributes["tint"]
    assert attribute.interpolation == expected
    assert attribute.indices is None
    assert np.asarray(attribute.data)[:, 0].tolist() == list(range(count))
    assert attribute.data.shape == (count, width)
    assert scene.textures == [
        {"type": "attribute", "name": "tint", "default": pytest.approx([0.1, 0.2, 0.3, 1])}
    ]
    assert imported.report.entries == []


def test_an_indexed_primvar_stays_indexed():
    scene, _ = load(
        PRIMVARS
        % """color3f[] primvars:tint = [(1, 0, 0), (0, 1, 0)] (
        interpolation = "faceVarying"
    )
    int[] primvars:tint:indices = [0, 0, 1, 1, 0, 1]"""
    )
    attribute = scene.meshes[0].attributes["tint"]
    assert len(attribute.data) == 2
    assert attribute.indices.tolist() == [0, 0, 1, 1, 0, 1]


@pytest.mark.parametrize(
    ("primvar", "what"),
    [
        ('color3f[] primvars:tint = [(1, 0, 0)] (\ninterpolation = "vertex"\n)', None),
        (
            'color3f[] primvars:tint = [(1,0,0), (1,0,0)] (\ninterpolation = "vertex"\n)',
            "2 values for 4 elements",
        ),
        (
            'color3f[] primvars:tint = [(1, 0, 0)] (\ninterpolation = "vertex"\n)\n'
            "int[] primvars:tint:indices = [0, 0, 0, 5]",
            "indices out of range",
        ),
        ('string primvars:tint = "red"', "holds no numbers"),
    ],
)
def test_primvars_that_do_not_fit(primvar, what):
    scene, imported = load(PRIMVARS % primvar)
    texts = [e.what for e in imported.report.entries]
    if what is None:  # a single value is understood as a constant
        assert scene.meshes[0].attributes["tint"].interpolation == "constant"
        assert texts == []
    else:
        assert "tint" not in scene.meshes[0].attributes
        assert any(what in t for t in texts), texts


def test_a_missing_primvar_is_said():
    _, imported = load(PRIMVARS % "")
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/M"
    assert "tint" in what


def test_constant_primvars_are_inherited():
    body = (PRIMVARS % "").replace('def Mesh "M"', 'def Xform "X" {\n def Mesh "M"', 1)
    body = body.replace('def Material "Look"', '}\ndef Material "Look"', 1).replace(
        'def Xform "X" {',
        'def Xform "X" {\ncolor3f[] primvars:tint = [(1, 0, 1)] (\ninterpolation = "constant"\n)',
        1,
    )
    scene, _ = load(body)
    assert np.asarray(scene.meshes[0].attributes["tint"].data).tolist() == [[1, 0, 1]]


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("int[] faceVertexCounts = [5]", "5 vertex indices"),
        ("int[] faceVertexIndices = [0, 1, 2, 9]", "out of range"),
        ("int[] faceVertexIndices = [0, 1, 2, -1]", "out of range"),
        ("int[] faceVertexCounts = [-4]", "negative"),
        (
            "point3f[] points = [(0, 0, 0), (1, 0, 0), (1, inf, 0), (0, 1, 0)]",
            "not finite",
        ),
        ("int points = 4", "wrong type"),
    ],
)
def test_broken_meshes_are_named_and_left_out(text, what):
    name = text.split(" = ")[0].split()[-1]
    lines = [line for line in QUAD.splitlines() if f" {name} " not in line]
    scene, imported = load(
        'def Mesh "Bad" {\n' + "\n".join([*lines, text]) + '\n}\ndef Mesh "Good" {' + QUAD + "}"
    )
    assert [m.name for m in scene.meshes] == ["/Good"]
    ((path, said),) = reported(imported, usd.Kind.WARNING)
    assert path == "/Bad"
    assert what in said


def test_an_empty_mesh_is_left_out():
    scene, imported = load('def Mesh "Empty" { }')
    assert scene.meshes == []
    assert reported(imported, usd.Kind.LEFT_OUT) == [("/Empty", "a mesh without points or faces")]


def test_points_of_the_frame():
    unmoving = [line for line in QUAD.splitlines() if "points" not in line]
    body = f"""
def Mesh "M" {{ {chr(10).join(unmoving)}
    point3f[] points.timeSamples = {{
        1: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
        3: [(0, 0, 4), (1, 0, 4), (1, 1, 4), (0, 1, 4)],
    }}
}}
"""
    assert load(body, frame=2)[0].meshes[0].points[:, 2].tolist() == [2] * 4
    assert load(body)[0].meshes[0].points[:, 2].tolist() == [0] * 4
    header = "startTimeCode = 3\nendTimeCode = 4"
    assert load(body, header)[0].meshes[0].points[:, 2].tolist() == [4] * 4
