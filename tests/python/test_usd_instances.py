"""Transformations, instancing, visibility and purpose."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pxr")

from pxr import Gf, Usd, UsdGeom

from segue import usd
from stages import QUAD, load, reported

MOVE = 'double3 xformOp:translate = {}\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'
MESH = f'def Mesh "M" {{ {QUAD} }}\n'


def places(scene) -> list[list[float]]:
    """Where the instances' origins are, over all meshes, in order."""
    matrices = np.concatenate([i.transforms for i in scene.instances])
    return matrices[:, :3, 3].tolist()


def test_transformations_compose_in_double_precision():
    scene, _ = load(f"""
def Xform "A" {{ {MOVE.format((100000000, 0, 0))}
    def Xform "B" {{
        double3 xformOp:translate = (0.25, 2, 3)
        float xformOp:rotateZ = 90
        double3 xformOp:scale = (2, 1, 1)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]
        {MESH}
    }}
}}
""")
    (matrix,) = scene.instances[0].transforms
    expected = [[0, -1, 0, 100000000.25], [2, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(matrix, expected, atol=1e-12)


def test_reset_xform_stack():
    scene, _ = load(f"""
def Xform "A" {{ {MOVE.format((1, 0, 0))}
    def Xform "B" {{
        double3 xformOp:translate = (0, 5, 0)
        uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
        {MESH}
    }}
}}
""")
    assert places(scene) == [[0, 5, 0]]


PROTOTYPE = f"""
class Xform "Proto" {{
    def Xform "Sub" {{ {MOVE.format((0, 1, 0))}
        {MESH}
    }}
}}
"""


def instance(name: str, place: tuple, target: str = "/Proto", more: str = "") -> str:
    return f"""
def Xform "{name}" (
    instanceable = true
    references = <{target}>
    {more}
) {{ {MOVE.format(place)} }}
"""


def test_instanceable_prims_share_their_mesh():
    scene, _ = load(PROTOTYPE + "".join(instance(f"I{n}", (n, 0, 0)) for n in range(4)))
    assert len(scene.meshes) == 1
    assert len(scene.instances) == 1
    assert places(scene) == [[n, 1, 0] for n in range(4)]


def test_nested_instances():
    outer = f"""
class Xform "Outer" {{
    {instance("A", (0, 0, 10))}
    {instance("B", (0, 0, 20))}
}}
"""
    scene, _ = load(
        PROTOTYPE + outer + instance("I", (1, 0, 0), "/Outer") + instance("J", (2, 0, 0), "/Outer")
    )
    assert len(scene.meshes) == 1
    assert sorted(places(scene)) == [[1, 1, 10], [1, 1, 20], [2, 1, 10], [2, 1, 20]]


LOOK = """
def Material "%s" {
    token outputs:surface.connect = </%s/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = %s
        float inputs:ior = 1
        token outputs:surface
    }
}
"""


def test_instances_inherit_their_own_materials_and_share_the_mesh():
    api = 'prepend apiSchemas = ["MaterialBindingAPI"]'
    bound = [
        instance(f"I{n}", (n, 0, 0), more=api).replace(
            "double3", f"rel material:binding = </{name}>\ndouble3", 1
        )
        for n, name in enumerate(("Red", "Blue", "Red"))
    ]
    looks = LOOK % ("Red", "Red", "(1, 0, 0)") + LOOK % ("Blue", "Blue", "(0, 0, 1)")
    scene, _ = load(PROTOTYPE + "".join(bound) + looks)
    assert len(scene.meshes) == 1
    found = {tuple(i.materials[0]["surface"]["color"]): i.transforms for i in scene.instances}
    assert found[1, 0, 0][:, 0, 3].tolist() == [0, 2]
    assert found[0, 0, 1][:, 0, 3].tolist() == [1]


def test_instances_inherit_primvars():
    api = 'prepend apiSchemas = ["MaterialBindingAPI"]'
    tinted = [
        instance(f"I{n}", (n, 0, 0), more=api).replace(
            "double3", f"color3f[] primvars:displayColor = [({n}, 0, 0)]\ndouble3", 1
        )
        for n in range(2)
    ]
    scene, _ = load(PROTOTYPE + "".join(tinted))
    assert len(scene.meshes) == 1
    assert [i.materials[0]["surface"]["color"] for i in scene.instances] == [[0] * 3, [1, 0, 0]]


INSTANCER = f"""
def PointInstancer "P" {{ {MOVE.format((100, 0, 0))}
    rel prototypes = [</P/Protos/A>, </P/Protos/B>]
    int[] protoIndices = [0, 1, 0, 1, 0]
    int64[] ids = [10, 11, 12, 13, 14]
    point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (4, 0, 0)]
    %s
    def Scope "Protos" {{
        def Xform "A" {{ {MOVE.format((0, 7, 0))}
            {MESH}
        }}
        def Xform "B" {{
            {MESH}
        }}
    }}
}}
"""


def by_prim(scene) -> dict[str, list[list[float]]]:
    return {i.name: i.transforms[:, :3, 3].tolist() for i in scene.instances}


def test_point_instancer():
    scene, imported = load(INSTANCER % "")
    assert by_prim(scene) == {
        "/P/Protos/A/M": [[100, 7, 0], [102, 7, 0], [104, 7, 0]],
        "/P/Protos/B/M": [[101, 0, 0], [103, 0, 0]],
    }
    assert imported.report.entries == []


@pytest.mark.parametrize(
    ("text", "hidden"),
    [
        ("int64[] invisibleIds = [12, 13]", {2, 3}),
        ("int64[] invisibleIds = [99]", set()),
    ],
)
def test_masked_ids(text, hidden):
    scene, _ = load(INSTANCER % text)
    seen = {x - 100 for p in by_prim(scene).values() for x, _, _ in p}
    assert seen == {0, 1, 2, 3, 4} - hidden


def test_deactivated_ids():
    scene, _ = load(
        (INSTANCER % "").replace(
            'def PointInstancer "P" {',
            'def PointInstancer "P" (\ninactiveIds = [10]\n) {',
            1,
        )
    )
    assert len(by_prim(scene)["/P/Protos/A/M"]) == 2


@pytest.mark.parametrize("kind", ["quath[] orientations", "quatf[] orientationsf"])
def test_orientations_and_scales(kind):
    if "orientationsf" in kind and not hasattr(UsdGeom.PointInstancer, "GetOrientationsfAttr"):
        pytest.skip("this USD has no float orientations")
    half = "0.70710677"
    turns = f"({half}, 0, 0, {half}), " + ", ".join(["(1, 0, 0, 0)"] * 4)
    sizes = "(1, 1, 1), (2, 3, 4), (1, 1, 1), (1, 1, 1), (1, 1, 1)"
    scene, _ = load(INSTANCER % f"{kind} = [{turns}]\nfloat3[] scales = [{sizes}]")
    a, b = (i.transforms for i in scene.instances)
    # A quarter turn around Z takes the prototype's own translation (0, 7, 0) to (-7, 0, 0).
    np.testing.assert_allclose(a[0][:3, 3], [100 - 7, 0, 0], atol=1e-2)
    np.testing.assert_allclose(a[0][:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-3)
    np.testing.assert_allclose(b[0][:3, :3], np.diag([2, 3, 4]), atol=1e-6)


def test_nested_point_instancers_multiply():
    scene, _ = load(f"""
def PointInstancer "Outer" {{
    rel prototypes = </Outer/Inner>
    int[] protoIndices = [0, 0, 0]
    point3f[] positions = [(0, 0, 100), (0, 0, 200), (0, 0, 300)]
    def PointInstancer "Inner" {{ {MOVE.format((0, 1, 0))}
        rel prototypes = </Outer/Inner/Proto>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(1, 0, 0), (2, 0, 0)]
        def Xform "Proto" {{
            {MESH}
        }}
    }}
}}
""")
    assert len(scene.meshes) == 1
    assert sorted(places(scene)) == sorted([x, 1, z] for x in (1, 2) for z in (100, 200, 300))


def test_an_instancer_in_an_instance():
    scene, _ = load(f"""
class Xform "Proto" {{
    def PointInstancer "P" {{
        rel prototypes = </Proto/P/Q>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(1, 0, 0), (2, 0, 0)]
        def Xform "Q" {{
            {MESH}
        }}
    }}
}}
{instance("I", (0, 10, 0))}
{instance("J", (0, 20, 0))}
""")
    assert len(scene.meshes) == 1
    assert sorted(places(scene)) == [[1, 10, 0], [1, 20, 0], [2, 10, 0], [2, 20, 0]]


def test_prototypes_below_an_over_are_drawn_by_the_instancer_only():
    scene, _ = load(f"""
over "Protos" {{
    def Xform "Q" {{
        {MESH}
    }}
}}
def PointInstancer "P" {{
    rel prototypes = </Protos/Q>
    int[] protoIndices = [0]
    point3f[] positions = [(1, 0, 0)]
}}
""")
    assert places(scene) == [[1, 0, 0]]


def test_an_instancer_that_holds_itself_ends():
    scene, imported = load("""
def PointInstancer "P" {
    rel prototypes = </P>
    int[] protoIndices = [0]
    point3f[] positions = [(1, 0, 0)]
}
""")
    assert scene.instances == []
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/P"
    assert "holds its own instancer" in what


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("point3f[] positions = [(0, 0, 0)]", "another number"),
        ("int[] protoIndices = [0, 1, 5, 1, 0]", "a prototype that does not exist"),
        ("rel prototypes = [</P/Protos/A>, </Gone>]", "/Gone does not exist"),
    ],
)
def test_broken_instancers_are_named(text, what):
    name = text.split(" = ")[0].split()[-1]
    body = "\n".join(
        text if f" {name} = " in line else line for line in (INSTANCER % "").splitlines()
    )
    _, imported = load(body)
    warnings = reported(imported, usd.Kind.WARNING)
    assert [path for path, _ in warnings] == ["/P"]
    assert what in warnings[0][1]


def test_values_for_each_instance_are_said():
    _, imported = load(
        INSTANCER
        % "color3f[] primvars:displayColor = [(1,0,0), (1,0,0), (1,0,0), (1,0,0), (1,0,0)] (\n"
        'interpolation = "vertex"\n)'
    )
    ((path, what),) = reported(imported, usd.Kind.UNSUPPORTED)
    assert path == "/P"
    assert "displayColor" in what


def test_instances_without_volume_are_left_out():
    sizes = "(1, 1, 1), (1, 1, 1), (0, 1, 1), (1, 1, 1), (1, 1, 1)"
    scene, imported = load(INSTANCER % f"float3[] scales = [{sizes}]")
    assert len(by_prim(scene)["/P/Protos/A/M"]) == 2
    assert reported(imported, usd.Kind.LEFT_OUT) == [
        ("/P/Protos/A/M", "1 instances without volume")
    ]


def test_visibility_is_inherited_and_timed():
    body = f"""
def Xform "Off" {{
    token visibility = "invisible"
    def Xform "On" {{
        token visibility = "inherited"
        {MESH}
    }}
}}
def Xform "Blinks" {{
    token visibility.timeSamples = {{
        1: "inherited",
        2: "invisible",
    }}
    {MESH}
}}
"""
    scene, imported = load(body, frame=1)
    assert [i.name for i in scene.instances] == ["/Blinks/M"]
    assert reported(imported, usd.Kind.LEFT_OUT) == [("/Off", "invisible")]
    scene, imported = load(body, frame=2)
    assert scene.instances == []


def test_purposes():
    body = "".join(
        f'def Xform "{p}" {{\nuniform token purpose = "{p}"\n{MESH}}}\n'
        for p in ("default", "render", "proxy", "guide")
    )
    scene, imported = load(body)
    assert [i.name for i in scene.instances] == ["/default/M", "/render/M"]
    assert reported(imported, usd.Kind.LEFT_OUT) == [
        ("/proxy/M", "of purpose 'proxy'"),
        ("/guide/M", "of purpose 'guide'"),
    ]
    scene, _ = load(body, purposes=("default", "proxy"))
    assert [i.name for i in scene.instances] == ["/default/M", "/proxy/M"]


def test_inactive_abstract_and_overs_are_not_drawn():
    body = f"""
def Mesh "Inactive" (
    active = false
) {{ {QUAD} }}
class Mesh "Class" {{ {QUAD} }}
over "Over" {{ {QUAD} }}
"""
    scene, _ = load(body)
    assert scene.instances == []


def test_the_same_places_as_usd_says():
    """Random trees: every mesh stands where UsdGeom.XformCache puts it."""
    random = np.random.default_rng(7)
    stage = Usd.Stage.CreateInMemory()
    paths = ["/R"]
    for number in range(60):
        path = f"{paths[random.integers(len(paths))]}/N{number}"
        paths.append(path)
        if random.random() < 0.5:
            prim = UsdGeom.Mesh.Define(stage, path)
            prim.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
            prim.CreateFaceVertexCountsAttr([3])
            prim.CreateFaceVertexIndicesAttr([0, 1, 2])
            prim.CreateSubdivisionSchemeAttr("none")
        else:
            prim = UsdGeom.Xform.Define(stage, path)
        matrix = Gf.Matrix4d(*np.eye(4).ravel().tolist())
        matrix.SetTranslate(Gf.Vec3d(*random.normal(size=3).tolist()))
        prim.AddTransformOp().Set(
            Gf.Matrix4d(Gf.Rotation(Gf.Vec3d(1, 2, 3), random.normal() * 90), Gf.Vec3d(0)) * matrix
        )
        prim.SetResetXformStack(bool(random.random() < 0.15))
    UsdGeom.Camera.Define(stage, "/Camera")
    from recording import RecordingScene

    scene = RecordingScene()
    usd.load(stage, scene=scene)
    assert len(scene.instances) > 10
    cache = UsdGeom.XformCache()
    for found in scene.instances:
        expected = np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(found.name))).T
        np.testing.assert_allclose(found.transforms[0], expected, rtol=1e-12, atol=1e-12)
