"""UsdPreviewSurface networks as closures, and which material a prim gets."""

from __future__ import annotations

import pytest

pytest.importorskip("pxr")

from pxr import Usd

from segue import usd
from stages import QUAD, load, reported

MESH = f"""
def Mesh "M" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {{ {QUAD}
    rel material:binding = </Look>
}}
"""


def preview(inputs: str, more: str = "", name: str = "Look") -> str:
    """A material of one UsdPreviewSurface node."""
    return f"""
def Material "{name}" {{
    token outputs:surface.connect = </{name}/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
    {more}
}}
"""


def material(inputs: str, more: str = ""):
    """The one material of a mesh with such a node, without its name, and the report."""
    scene, imported = load(MESH + preview(inputs, more))
    (description,) = scene.instances[0].materials
    return {k: v for k, v in description.items() if k != "name"}, imported


def closure(inputs: str) -> dict:
    description, imported = material(inputs)
    assert imported.report.entries == []
    assert set(description) == {"surface"}
    return description["surface"]


LAMBERT = "color3f inputs:diffuseColor = (0.1, 0.2, 0.3)\nfloat inputs:ior = 1\n"


@pytest.mark.parametrize(
    "inputs",
    [
        LAMBERT,
        LAMBERT + "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0, 0, 0)",
        LAMBERT + "float inputs:roughness = 1",
    ],
)
def test_lambert_has_no_specular_lobe(inputs):
    assert closure(inputs) == {"type": "diffuse", "color": pytest.approx([0.1, 0.2, 0.3])}


def test_metal():
    found = closure(
        "color3f inputs:diffuseColor = (0.9, 0.8, 0.7)\nfloat inputs:metallic = 1\n"
        "float inputs:roughness = 0.3"
    )
    # F0 and F90 are both the colour: a microfacet reflection without a Fresnel ramp.
    assert found == {
        "type": "glossy",
        "color": pytest.approx([0.9, 0.8, 0.7]),
        "roughness": pytest.approx(0.3),
    }


def test_defaults_are_those_of_usd_preview_surface():
    assert closure("") == {
        "type": "principled",
        "base_color": 0.18,
        "metallic": 0.0,
        "roughness": 0.5,
        "ior": 1.5,
        "metal_f90": "base",
    }


def test_coated_mixture():
    found = closure(
        "float inputs:metallic = 0.5\nfloat inputs:clearcoat = 0.75\n"
        "float inputs:clearcoatRoughness = 0.25\nfloat inputs:ior = 1.25"
    )
    assert found["metallic"] == 0.5
    assert found["metal_f90"] == "base"
    assert (found["coat"], found["coat_roughness"], found["ior"]) == (0.75, 0.25, 1.25)


def test_specular_workflow_replaces_the_normal_reflectance():
    found = closure(
        "int inputs:useSpecularWorkflow = 1\ncolor3f inputs:specularColor = (0.5, 0.25, 0.125)\n"
        "float inputs:metallic = 1"
    )
    assert found["specular_color"] == [0.5, 0.25, 0.125]
    assert found["metallic"] == 0


GLASS = "float inputs:opacity = 0\nfloat inputs:ior = 1.33\nfloat inputs:roughness = 0\n"


@pytest.mark.parametrize("mode", ["", 'token inputs:opacityMode = "transparent"'])
def test_opacity_0_is_glass(mode):
    assert closure(GLASS + mode) == {
        "type": "glass",
        "color": 1,
        "roughness": 0.0,
        "ior": pytest.approx(1.33),
    }


def test_rough_glass():
    found = closure("float inputs:opacity = 0\nfloat inputs:roughness = 0.5")
    assert (found["type"], found["roughness"], found["ior"]) == ("glass", 0.5, 1.5)


def test_glass_of_ior_1_is_not_there():
    assert closure("float inputs:opacity = 0\nfloat inputs:ior = 1")["type"] == "transparent"


def test_half_transparent():
    found = closure(LAMBERT.replace("ior = 1", "ior = 1.5") + "float inputs:opacity = 0.25")
    assert (found["type"], found["factor"]) == ("mix", 0.25)
    assert found["a"]["type"] == "glass"
    assert found["b"]["type"] == "principled"


def test_presence_cuts_out():
    description, _ = material(
        LAMBERT + 'float inputs:opacity = 0.25\ntoken inputs:opacityMode = "presence"'
    )
    assert description["opacity"] == 0.25
    assert description["surface"]["type"] == "diffuse"


@pytest.mark.parametrize(("opacity", "expected"), [(0.4, 0.0), (0.5, 1), (0.6, 1)])
def test_threshold_whatever_the_mode(opacity, expected):
    description, _ = material(
        LAMBERT + f"float inputs:opacity = {opacity}\nfloat inputs:opacityThreshold = 0.5"
    )
    assert description.get("opacity", 1) == expected
    assert description["surface"]["type"] == "diffuse"


def test_emission():
    description, _ = material(LAMBERT + "color3f inputs:emissiveColor = (1, 2, 4)")
    found = description["surface"]
    assert found["type"] == "add"
    assert found["b"] == {"type": "emission", "color": [1, 2, 4], "strength": 1}


def test_a_black_surface_that_glows_only_glows():
    found = closure(
        "color3f inputs:diffuseColor = (0, 0, 0)\nfloat inputs:ior = 1\n"
        "color3f inputs:emissiveColor = (1, 1, 1)"
    )
    assert found == {"type": "emission", "color": 1.0, "strength": 1}


def test_values_may_come_from_the_materials_interface_and_node_graphs():
    body = (
        MESH
        + """
def Material "Look" {
    color3f inputs:paint = (0.1, 0.2, 0.3)
    token outputs:surface.connect = </Look/G.outputs:surface>
    def NodeGraph "G" {
        color3f inputs:paint.connect = </Look.inputs:paint>
        token outputs:surface.connect = </Look/G/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Look/G.inputs:paint>
            float inputs:ior = 1
            token outputs:surface
        }
    }
}
"""
    )
    scene, _ = load(body)
    assert scene.instances[0].materials[0]["surface"]["color"] == pytest.approx([0.1, 0.2, 0.3])


def test_a_connection_to_nothing_falls_back():
    description, _ = material("color3f inputs:diffuseColor.connect = </Gone.outputs:rgb>")
    assert description["surface"]["base_color"] == 0.18


def test_values_of_a_wrong_type_do_not_stop_the_import():
    description, _ = material(
        'color4f inputs:diffuseColor = (0.1, 0.2, 0.3, 1)\nstring inputs:roughness = "rough"\n'
        "color3f inputs:metallic = (0.5, 0, 0)"
    )
    found = description["surface"]
    assert found["base_color"] == pytest.approx([0.1, 0.2, 0.3])
    assert (found["roughness"], found["metallic"]) == (0.5, 0.5)


RED, GREEN, BLUE = [1, 0, 0], [0, 1, 0], [0, 0, 1]


def looks() -> str:
    return "".join(
        preview(f"color3f inputs:diffuseColor = {color}\nfloat inputs:ior = 1", name=name)
        for name, color in (("Red", "(1,0,0)"), ("Green", "(0,1,0)"), ("Blue", "(0,0,1)"))
    )


def color_of(body: str) -> list[float]:
    scene, _ = load(body + looks())
    (instances,) = scene.instances
    return instances.materials[0]["surface"]["color"]


def bound(parent: str, child: str = "", more: str = "") -> str:
    return f"""
def Xform "X" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {{
    {parent}
    def Mesh "M" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    ) {{ {QUAD}
        {child}
    }}
}}
{more}
"""


def test_bindings_are_inherited():
    assert color_of(bound("rel material:binding = </Red>")) == RED


def test_a_prims_own_binding_is_stronger():
    assert (
        color_of(bound("rel material:binding = </Red>", "rel material:binding = </Blue>")) == BLUE
    )


def test_unless_the_parents_is_stronger_than_descendants():
    strong = 'rel material:binding = </Red> (\nbindMaterialAs = "strongerThanDescendants"\n)'
    assert color_of(bound(strong, "rel material:binding = </Blue>")) == RED


def test_the_full_purpose_wins_over_all_purpose_and_preview():
    own = (
        "rel material:binding = </Red>\nrel material:binding:preview = </Green>\n"
        "rel material:binding:full = </Blue>"
    )
    assert color_of(bound("", own)) == BLUE


def test_a_preview_binding_is_used_where_there_is_no_other():
    assert color_of(bound("", "rel material:binding:preview = </Green>")) == GREEN


def test_collection_bindings():
    body = (
        bound(
            "rel material:binding = </Red>\n"
            "rel material:binding:collection:some = [</X.collection:some>, </Green>]"
        )
        .replace(
            'prepend apiSchemas = ["MaterialBindingAPI"]',
            'prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"]',
            1,
        )
        .replace("rel material:binding = </Red>", "rel collection:some:includes = </X/M>", 1)
    )
    assert color_of(body) == GREEN


@pytest.mark.parametrize(
    ("primvars", "color", "opacity"),
    [
        ("", [0.18] * 3, 1),
        ("color3f[] primvars:displayColor = [(1, 0, 0)]", RED, 1),
        (
            "color3f[] primvars:displayColor = [(1, 0, 0)]\n"
            "float[] primvars:displayOpacity = [0.5]",
            RED,
            0.5,
        ),
    ],
)
def test_display_color_where_nothing_is_bound(primvars, color, opacity):
    scene, _ = load(bound("", primvars))
    (found,) = scene.instances[0].materials
    assert found["surface"] == {"type": "diffuse", "color": color}
    assert found.get("opacity", 1) == opacity


def test_display_color_that_varies():
    scene, _ = load(
        bound(
            "",
            "color3f[] primvars:displayColor = [(1,0,0), (0,1,0), (0,0,1), (1,1,1)] (\n"
            'interpolation = "vertex"\n)\nfloat[] primvars:displayOpacity = [0, 1, 0, 1] (\n'
            'interpolation = "faceVarying"\n)',
        )
    )
    (found,) = scene.instances[0].materials
    color, opacity = found["surface"]["color"], found["opacity"]
    assert scene.textures[color["texture"]]["name"] == "displayColor"
    assert scene.textures[opacity["texture"]]["name"] == "displayOpacity"
    attributes = scene.meshes[0].attributes
    assert attributes["displayColor"].interpolation == "vertex"
    assert attributes["displayOpacity"].interpolation == "corner"
    assert attributes["displayOpacity"].data.tolist() == [[0] * 3, [1] * 3, [0] * 3, [1] * 3]


@pytest.mark.parametrize(
    ("look", "what"),
    [
        (
            'def Material "Look" {\ntoken outputs:mtlx:surface.connect = </Look/S.outputs:out>\n'
            'def Shader "S" {\nuniform token info:id = "ND_standard_surface_surfaceshader"\n'
            "token outputs:out\n}\n}",
            "ND_standard_surface_surfaceshader",
        ),
        ('def Material "Look" { }', "without a surface"),
        (
            'def Material "Look" {\ntoken outputs:surface.connect = </Look/S.outputs:out>\n'
            'def Shader "S" {\nuniform token info:id = "OmniPBR"\ntoken outputs:out\n}\n}',
            "OmniPBR",
        ),
    ],
)
def test_unknown_surfaces_are_said_and_grey(look, what):
    scene, imported = load(MESH + look)
    assert scene.instances[0].materials[0]["surface"]["color"] == [0.18] * 3
    ((path, said),) = reported(imported, usd.Kind.UNSUPPORTED)
    assert path == "/Look"
    assert what in said


def test_a_preview_surface_of_materialx_is_read():
    scene, imported = load(
        MESH + 'def Material "Look" {\ntoken outputs:mtlx:surface.connect = </Look/S.outputs:out>\n'
        'def Shader "S" {\nuniform token info:id = "ND_UsdPreviewSurface_surfaceshader"\n'
        "color3f inputs:diffuseColor = (1, 0, 0)\nfloat inputs:ior = 1\ntoken outputs:out\n}\n}"
    )
    assert imported.report.entries == []
    assert scene.instances[0].materials[0]["surface"]["color"] == RED


def test_an_unknown_node_on_an_input_is_said():
    description, imported = material(
        "color3f inputs:diffuseColor.connect = </Look/N.outputs:out>",
        'def Shader "N" {\nuniform token info:id = "ND_marble3d"\ncolor3f outputs:out\n}',
    )
    assert description["surface"]["base_color"] == 0.18
    ((_, said),) = reported(imported, usd.Kind.UNSUPPORTED)
    assert "ND_marble3d" in said
    assert "diffuseColor" in said


def displaced(inputs, more=""):
    """The material of a mesh whose displacement is that of its UsdPreviewSurface."""
    return material(
        inputs + "\ntoken outputs:displacement",
        "token outputs:displacement.connect = </Look/S.outputs:displacement>\n" + more,
    )


HEIGHTS = """def Shader "H" {
    uniform token info:id = "UsdPrimvarReader_float"
    string inputs:varname = "height"
    float outputs:result
}"""
TEXTURED = "float inputs:displacement.connect = </Look/H.outputs:result>"


def test_displacement_moves_the_surface():
    description, imported = displaced("float inputs:displacement = 0.5")
    assert imported.report.entries == []
    moved = {"height": 0.5, "space": "object", "keeps_normals": False}
    assert description["displacement"] == moved
    assert "normal" not in description["surface"]
    # None is none, and without the material's output the node's input says nothing.
    for description, _ in (
        displaced("float inputs:displacement = 0"),
        displaced(""),
        material("float inputs:displacement = 0.5\ntoken outputs:displacement"),
    ):
        assert set(description) == {"surface"}


def test_textured_displacement_is_also_a_bump_map():
    """So that coarse meshes show it."""
    description, imported = displaced(TEXTURED, HEIGHTS)
    assert not reported(imported, usd.Kind.UNSUPPORTED)
    ((_, what),) = reported(imported, usd.Kind.WARNING)
    assert "primvar height" in what
    height = description["displacement"]["height"]
    assert height["channel"] == "r"
    assert description["displacement"]["keeps_normals"]
    assert description["surface"]["normal"] == {"height": height, "space": "object"}


def test_displacement_by_another_node_is_said():
    _, imported = material(
        "",
        "token outputs:displacement.connect = </Look/H.outputs:displacement>\n"
        + HEIGHTS.replace("float outputs:result", "token outputs:displacement"),
    )
    assert reported(imported, usd.Kind.UNSUPPORTED) == [("/Look", "displacement by another node")]


def test_one_description_is_one_material():
    scene, _ = load(
        "".join(f'def Mesh "M{i}" {{ {QUAD} }}\n' for i in range(5)) + preview("", name="Unused")
    )
    assert len(scene.materials) == 1
    assert len(scene.instances) == 5


@pytest.mark.parametrize("space", ["lin_rec709_scene", "lin_ap1_scene"])
def test_colors_of_another_space_are_said(space):
    if not hasattr(Usd, "ColorSpaceAPI"):
        pytest.skip("this USD has no ColorSpaceAPI")
    body = MESH + preview(LAMBERT)
    body = body.replace(
        'def Material "Look" {',
        'def Material "Look" (\nprepend apiSchemas = ["ColorSpaceAPI"]\n) {\n'
        f'uniform token colorSpace:name = "{space}"',
    )
    _, imported = load(body)
    said = reported(imported, usd.Kind.UNSUPPORTED)
    if space == "lin_ap1_scene":
        assert said == [("/Look/S", "colours in the space 'lin_ap1_scene'")]
    else:
        assert said == []
