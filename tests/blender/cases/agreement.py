"""The same scene in Segue and in Cycles gives the same picture."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils import Euler, Matrix

import agreement
import builders
from harness import SkipCaseError


def _check(found: agreement.Comparison, mean: float, blocks: float, correlation: float) -> None:
    print(found)
    assert np.abs(found.mean).max() < mean, found
    assert found.blocks < blocks, found
    assert found.correlation > correlation, found


def _environment(pixels: np.ndarray, rotation: tuple[float, float, float], strength: float) -> None:
    _, tree, background = builders.world()
    texture, mapping = (
        tree.nodes.new("ShaderNodeTexEnvironment"),
        tree.nodes.new("ShaderNodeMapping"),
    )
    place = tree.nodes.new("ShaderNodeTexCoord")
    texture.image = builders.image("Environment", pixels, "Linear Rec.709", is_float=True)
    mapping.inputs["Rotation"].default_value = rotation
    background.inputs["Strength"].default_value = strength
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])


def _sky() -> np.ndarray:
    """A soft sky with a bright patch, (32, 64, 4)."""
    v, u = np.mgrid[0:32, 0:64] / np.array([32.0, 64.0])[:, None, None]
    pixels = np.ones((32, 64, 4), np.float32)
    pixels[..., 0] = 0.2 + 0.3 * v
    pixels[..., 1] = 0.3 + 0.1 * np.sin(2 * np.pi * u)
    pixels[..., 2] = 0.6 - 0.4 * v
    patch = np.exp(-(((u - 0.3) * 12) ** 2) - ((v - 0.3) * 8) ** 2)
    pixels[..., :3] += 8.0 * patch[..., None] * np.array([1.0, 0.8, 0.5])
    return pixels


def _textured() -> bpy.types.Material:
    """A diffuse material with a picture of few large texels, mapped with rotation and scale."""
    data, tree, output = builders.material("Textured")
    pixels = np.ones((6, 6, 4), np.float32)
    pixels[..., :3] = np.random.default_rng(2).random((6, 6, 3)) * 0.8
    texture, mapping = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeMapping")
    place, diffuse = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeBsdfDiffuse")
    texture.image = builders.image("Patches", pixels)
    texture.interpolation = "Closest"
    mapping.inputs["Rotation"].default_value = (0, 0, 0.4)
    mapping.inputs["Scale"].default_value = (2, 3, 1)
    tree.links.new(place.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return data


def _ten_materials() -> list[bpy.types.Material]:
    make = builders.shader_material
    plastic = {"Base_Color": (0.1, 0.3, 0.7, 1), "Roughness": 0.3}
    gold = {"Base_Color": (0.9, 0.6, 0.25, 1), "Metallic": 1.0, "Roughness": 0.3}
    return [
        make("BsdfDiffuse", "Red", Color=(0.7, 0.15, 0.1, 1)),
        make("BsdfDiffuse", "Rough", Color=(0.6, 0.6, 0.5, 1), Roughness=0.8),
        make("BsdfAnisotropic", "Glossy", Color=(0.7, 0.7, 0.7, 1), Roughness=0.3),
        make("BsdfAnisotropic", "Mirror", Color=(0.9, 0.9, 0.9, 1), Roughness=0.0),
        make("BsdfGlass", "Glass", Color=(0.9, 1.0, 0.95, 1), Roughness=0.0, IOR=1.5),
        make("BsdfTranslucent", "Leaf", Color=(0.3, 0.7, 0.2, 1)),
        make("BsdfPrincipled", "Plastic", **plastic),
        make("BsdfPrincipled", "Gold", **gold),
        make("Emission", "Lamp", Color=(1.0, 0.7, 0.4, 1), Strength=2.0),
        _textured(),
    ]


def _instances() -> None:
    """A ring of small cubes, instances of one collection."""
    collection = bpy.data.collections.new("Parts")
    data = builders.cube(half=0.15)
    data.materials.append(builders.shader_material("BsdfDiffuse", "Part", Color=(0.5, 0.4, 0.8, 1)))
    part = bpy.data.objects.new("Part", data)
    part.rotation_euler = (0.4, 0.5, 0.6)
    collection.objects.link(part)
    for i in range(12):
        angle = 2.0 * np.pi * i / 12
        place = Matrix.Translation((3.2 * np.cos(angle), 2.4 * np.sin(angle), 0.3))
        mirror = Matrix.Diagonal((-1 if i % 2 else 1, 1, 1 + 0.1 * i, 1))
        empty = builders.link(None, f"Copy {i}", place @ mirror)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection


def _a_whole_scene(integrator: str) -> None:
    """Ten materials, instances, an environment map and four lights."""
    _environment(_sky(), (0.1, -0.2, 0.8), 0.6)
    floor = builders.quad("Floor", 8.0)
    floor.materials.append(
        builders.shader_material("BsdfDiffuse", "Floor", Color=(0.5, 0.5, 0.45, 1))
    )
    builders.link(floor)
    for i, material in enumerate(_ten_materials()):
        ball = builders.sphere(f"Ball {i}", 0.45, 48, 24)
        ball.materials.append(material)
        builders.link(
            ball, matrix=Matrix.Translation((1.1 * (i % 5 - 2), 1.2 * (i // 5) - 0.6, 0.5))
        )
    _instances()

    def tilted(x: float, y: float, z: float, *angles: float) -> Matrix:
        return Matrix.Translation((x, y, z)) @ Euler(angles).to_matrix().to_4x4()

    soft = {"use_soft_falloff": False}
    builders.light("POINT", tilted(-3, -2, 2, 0, 0, 0), energy=80.0, shadow_soft_size=0.4, **soft)
    builders.light(
        "SPOT", tilted(3, -3, 4, 0.6, 0.5, 0), energy=250.0, shadow_soft_size=0.3,
        spot_size=1.0, spot_blend=0.3, color=(0.6, 0.8, 1.0), **soft,
    )  # fmt: skip
    builders.light("SUN", tilted(0, 0, 5, 0.5, -0.6, 0), energy=0.8, angle=0.3)
    builders.light("AREA", tilted(0, 4, 3, -0.9, 0, 0), energy=120.0, size=2.0, size_y=1.0,
                   shape="RECTANGLE", color=(1.0, 0.8, 0.6))  # fmt: skip
    pose = Matrix.Translation((0, -7, 4)) @ Euler((1.05, 0, 0)).to_matrix().to_4x4()
    builders.camera(pose, lens=40.0)
    pictures = agreement.render_both(160, 120, 128, 128, integrator)
    _check(agreement.compare(*pictures), mean=0.005, blocks=0.02, correlation=0.999)


def case_a_whole_scene() -> None:
    _a_whole_scene("path")


def case_a_whole_scene_by_segments() -> None:
    _a_whole_scene("segment")


# Name -> shader node and its inputs. Both engines define these alike, but for one thing that keeps
# some from being brighter here: what microfacets scatter more than once, Cycles gives back to
# brushed metals as if they were isotropic, so that a white one reflects 94 % where Segue reflects
# all.
_MATERIALS: dict[str, tuple[str, dict[str, Any]]] = {
    "diffuse": ("BsdfDiffuse", {"Color": (0.8, 0.2, 0.1, 1)}),
    "rough diffuse": ("BsdfDiffuse", {"Color": (0.8, 0.2, 0.1, 1), "Roughness": 0.8}),
    "glossy": ("BsdfAnisotropic", {"Color": (0.8, 0.6, 0.2, 1), "Roughness": 0.3}),
    "mirror": ("BsdfAnisotropic", {"Color": (0.8, 0.6, 0.2, 1), "Roughness": 0.0}),
    "rough glossy": ("BsdfAnisotropic", {"Color": (0.8, 0.6, 0.2, 1), "Roughness": 0.6}),
    "brushed": (
        "BsdfAnisotropic",
        {"Color": (0.3, 0.2, 0.1, 1), "Roughness": 0.3, "Anisotropy": 0.7, "Rotation": 0.1},
    ),
    "glass": ("BsdfGlass", {"Color": (1, 0.9, 0.8, 1), "Roughness": 0.0, "IOR": 1.5}),
    "rough glass": ("BsdfGlass", {"Color": (1, 0.9, 0.8, 1), "Roughness": 0.3, "IOR": 1.5}),
    "very rough glass": ("BsdfGlass", {"Color": (1, 0.7, 0.4, 1), "Roughness": 0.7, "IOR": 1.5}),
    "frosted": ("BsdfRefraction", {"Color": (1, 0.9, 0.8, 1), "Roughness": 0.2, "IOR": 1.3}),
    "transparent": ("BsdfTransparent", {"Color": (0.5, 0.9, 0.8, 1)}),
    "translucent": ("BsdfTranslucent", {"Color": (0.5, 0.9, 0.8, 1)}),
    "sheen": ("BsdfSheen", {"Color": (0.5, 0.9, 0.8, 1), "Roughness": 0.4}),
    "emission": ("Emission", {"Color": (0.5, 0.9, 0.8, 1), "Strength": 3.0}),
}
if bpy.app.version < (4, 5, 0):
    # Of a rough diffuse surface Cycles 4.2 leaves out the light that is passed on between facets,
    # which is a twentieth of a bright one's. A dark one has next to none.
    _MATERIALS["rough diffuse"] = ("BsdfDiffuse", {"Color": (0.2, 0.15, 0.1, 1), "Roughness": 0.8})
_PRINCIPLED: dict[str, dict[str, Any]] = {
    "plain": {},
    "metal": {"Metallic": 1.0, "Roughness": 0.3},
    "rough metal": {"Metallic": 1.0, "Roughness": 0.8},
    "tinted metal": {"Metallic": 1.0, "Roughness": 0.2, "Specular_Tint": (0.2, 0.9, 0.4, 1)},
    "plastic": {"Roughness": 0.1},
    "high index": {"Roughness": 0.2, "IOR": 2.0},
    "no specular": {"Roughness": 0.2, "Specular_IOR_Level": 0.0},
    "tinted specular": {"Roughness": 0.2, "Specular_Tint": (1, 0.3, 0.1, 1)},
    "glass": {"Roughness": 0.0, "Transmission_Weight": 1.0},
    "rough glass": {"Roughness": 0.2, "Transmission_Weight": 1.0},
    "very rough glass": {"Roughness": 0.6, "Transmission_Weight": 1.0},
    "half glass": {"Roughness": 0.1, "Transmission_Weight": 0.5},
    "coat": {"Roughness": 0.6, "Coat_Weight": 1.0, "Coat_Roughness": 0.05},
    "tinted coat": {"Coat_Weight": 0.8, "Coat_Roughness": 0.3, "Coat_Tint": (0.4, 0.8, 1, 1)},
    "sheen": {"Sheen_Weight": 1.0, "Sheen_Roughness": 0.3, "Sheen_Tint": (1, 0.8, 0.6, 1)},
    "glowing": {"Emission_Color": (1, 0.5, 0.2, 1), "Emission_Strength": 2.0},
    "glowing below layers": {
        "Emission_Color": (1, 0.5, 0.2, 1),
        "Emission_Strength": 2.0,
        "Coat_Weight": 0.8,
        "Coat_Tint": (0.4, 0.8, 1, 1),
        "Sheen_Weight": 0.5,
    },
    "alpha": {"Alpha": 0.4},
    "brushed": {"Metallic": 1.0, "Roughness": 0.3, "Anisotropic": 0.8},
}
# Samples a pixel, and the limits of mean, blocks and correlation. With other seeds the worst of
# four comparisons reaches half to two thirds of them; behind glass there is more noise.
_LIMITS = (256, 0.005, 0.012, 0.9995)
_GLASS_LIMITS = (512, 0.007, 0.015, 0.999)
_LIMITS_OF = {
    "glass": _GLASS_LIMITS,
    "rough glass": _GLASS_LIMITS,
    "very rough glass": _GLASS_LIMITS,
    "half glass": _GLASS_LIMITS,
    "frosted": _GLASS_LIMITS,
    "brushed": (256, 0.01, 0.015, 0.9995),
}


def _stage(kind: str, inputs: dict[str, Any]) -> None:
    """A ball over a floor, under an area light and a plain sky."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    _, _, background = builders.world()
    background.inputs["Color"].default_value = (0.3, 0.4, 0.5, 1)
    pose = Matrix.Translation((0, -5, 2.5)) @ Euler((1.24, 0, 0)).to_matrix().to_4x4()
    builders.camera(pose)
    floor = builders.quad("Floor", 6.0)
    floor.materials.append(
        builders.shader_material("BsdfDiffuse", "Floor", Color=(0.5, 0.45, 0.4, 1))
    )
    builders.link(floor)
    ball = builders.sphere("Ball", 1.0, 64, 32)
    tested = builders.shader_material(kind, "Tested", **inputs)
    if kind == "BsdfRefraction":
        # A new node is of Beckmann's distribution, for which Segue uses GGX.
        nodes = tested.node_tree.nodes
        next(n for n in nodes if n.bl_idname == "ShaderNodeBsdfRefraction").distribution = "GGX"
    ball.materials.append(tested)
    builders.link(ball, matrix=Matrix.Translation((0, 0, 1.05)))
    lamp = Matrix.Translation((2, -2, 4)) @ Euler((-0.5, 0.5, 0)).to_matrix().to_4x4()
    builders.light("AREA", lamp, energy=150.0, size=1.5)


def _each(materials: dict[str, tuple[str, dict[str, Any]]]) -> None:
    """Compare every material, and name all that differ."""
    failures = []
    for name, (kind, inputs) in materials.items():
        _stage(kind, inputs)
        samples, mean, blocks, correlation = _LIMITS_OF.get(name, _LIMITS)
        found = agreement.compare(*agreement.render_both(64, 48, samples, samples))
        print(f"{name}: {found}", flush=True)
        within = np.abs(found.mean).max() < mean and found.blocks < blocks
        if not within or found.correlation < correlation:
            failures.append(f"{name}: {found}")
    assert not failures, "\n".join(failures)


def case_shaders_one_by_one() -> None:
    _each(_MATERIALS)


def case_principled_one_by_one() -> None:
    base = {"Base_Color": (0.6, 0.3, 0.1, 1)}
    _each({name: ("BsdfPrincipled", base | extra) for name, extra in _PRINCIPLED.items()})


def _factor(tree: bpy.types.NodeTree, kind: str, output: str, **inputs: float) -> Any:
    """The output of a node that asks where the surface is seen from."""
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node.outputs[output]


def case_surfaces_look_different_from_aside() -> None:
    """Colours, emission and mixes, also with what lets light through as it is."""
    rim = ("LayerWeight", "Facing", {"Blend": 0.8})
    for below, above, (kind, output, inputs), integrator in (
        ("BsdfDiffuse", "BsdfAnisotropic", ("Fresnel", "Fac", {"IOR": 1.8}), "path"),
        ("BsdfTransparent", "BsdfDiffuse", ("Fresnel", "Fac", {"IOR": 1.5}), "path"),
        ("BsdfDiffuse", "Emission", rim, "path"),
        ("BsdfDiffuse", "BsdfAnisotropic", ("LayerWeight", "Fresnel", {"Blend": 0.6}), "segment"),
        ("BsdfTransparent", "BsdfAnisotropic", rim, "segment"),
        ("BsdfGlass", "BsdfAnisotropic", rim, "path"),
    ):
        _stage("BsdfDiffuse", {})
        tree = bpy.data.materials["Tested"].node_tree
        tree.nodes.clear()
        mix, end = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeOutputMaterial")
        tree.links.new(_factor(tree, kind, output, **inputs), mix.inputs[0])
        for index, shader in enumerate((below, above), 1):
            node = tree.nodes.new(f"ShaderNode{shader}")
            node.inputs["Color"].default_value = (
                (0.9, 0.3, 0.1, 1) if index == 1 else (0.2, 0.5, 1, 1)
            )
            tree.links.new(node.outputs[0], mix.inputs[index])
        tree.links.new(mix.outputs[0], end.inputs["Surface"])
        found = agreement.compare(*agreement.render_both(64, 48, 256, 256, integrator))
        print(below, above, kind, output, integrator)
        _check(found, mean=0.005, blocks=0.015, correlation=0.999)


def case_the_inside_of_a_bowl_is_not_its_outside() -> None:
    _stage("BsdfDiffuse", {})
    tree = bpy.data.materials["Tested"].node_tree
    diffuse = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.8, 0.1, 0.1, 1)
    tree.links.new(_factor(tree, "NewGeometry", "Backfacing"), ramp.inputs[0])
    tree.links.new(ramp.outputs["Color"], diffuse.inputs["Color"])
    import bmesh

    data = bpy.data.objects["Ball"].data
    bowl = bmesh.new()
    bowl.from_mesh(data)
    gone = [vertex for vertex in bowl.verts if vertex.co.z > 0.1]
    bmesh.ops.delete(bowl, geom=gone, context="VERTS")
    bowl.to_mesh(data)
    _check_floor("bowl")


def case_brushes_go_around_an_axis() -> None:
    """By default around z, whatever the UV map says; or around another axis, or along the map."""
    for direction in ("", "X", "UV_MAP"):
        _stage("BsdfPrincipled", {"Base_Color": (0.3, 0.2, 0.1, 1), "Metallic": 1.0})
        tested = bpy.data.materials["Tested"]
        node = next(n for n in tested.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
        node.inputs["Roughness"].default_value = 0.3
        node.inputs["Anisotropic"].default_value = 0.8
        if direction:
            tangent = tested.node_tree.nodes.new("ShaderNodeTangent")
            tangent.direction_type = "UV_MAP" if direction == "UV_MAP" else "RADIAL"
            if direction != "UV_MAP":
                tangent.axis = direction
            tested.node_tree.links.new(tangent.outputs[0], node.inputs["Tangent"])
        # around an axis in its own plane a flat thing has no direction
        if direction != "X":
            bpy.data.objects["Floor"].data.materials[0] = tested
        bpy.data.objects["Ball"].rotation_euler = (0.5, 0.4, 0.3)
        found = agreement.compare(*agreement.render_both(64, 48, 256, 256))
        print(direction or "default")
        _check(found, mean=0.01, blocks=0.015, correlation=0.9995)


def case_white_metals_reflect_all_light() -> None:
    """In a white world, white metal cannot be told from what it mirrors, however it is finished."""
    for roughness, anisotropy in ((0.3, 0.0), (0.8, 0.0), (0.3, 0.7)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        _, _, background = builders.world()
        background.inputs["Color"].default_value = (1, 1, 1, 1)
        builders.camera(Matrix.Translation((0, 0, 5)), lens=100.0)
        ball = builders.sphere("Ball", 1.0, 64, 32)
        inputs = {"Color": (1, 1, 1, 1), "Roughness": roughness, "Anisotropy": anisotropy}
        ball.materials.append(builders.shader_material("BsdfAnisotropic", **inputs))
        builders.link(ball, matrix=Euler((1.2, 0.3, 0)).to_matrix().to_4x4())
        _, picture = agreement.render_both(32, 32, 1, 256)
        ball_mean = float(picture[10:22, 10:22, :3].mean())
        print(f"roughness {roughness}, anisotropy {anisotropy}: {ball_mean:.4f}")
        assert abs(ball_mean - 1.0) < 0.01


def _floor_of(kind: str, space: str) -> tuple[bpy.types.NodeTree, bpy.types.Node, bpy.types.Node]:
    """The stage with a texture for the floor, by turned coordinates: tree, texture and shader."""
    _stage("BsdfDiffuse", {})
    tree = bpy.data.materials["Floor"].node_tree
    texture = tree.nodes.new(f"ShaderNode{kind}")
    if space:
        place, mapping = (tree.nodes.new(f"ShaderNode{n}") for n in ("TexCoord", "Mapping"))
        mapping.inputs["Rotation"].default_value = (0, 0, 0.3)
        mapping.inputs["Location"].default_value = (0.1, 0.2, 0.0)
        tree.links.new(place.outputs[space], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    diffuse = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeBsdfDiffuse")
    return tree, texture, diffuse


def _through_ramp(
    tree: bpy.types.NodeTree, texture: bpy.types.Node, shader: bpy.types.Node, *ends: float
) -> None:
    """Leads the texture's factor through a ramp from red at the first of `ends` to the second."""
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.8, 0.1, 0.1, 1)
    for element, position in zip(ramp.color_ramp.elements, ends, strict=True):
        element.position = position
    factor = next(output for output in texture.outputs if output.type == "VALUE")
    tree.links.new(factor, ramp.inputs[0])
    tree.links.new(ramp.outputs["Color"], shader.inputs["Color"])


def _check_floor(*what: object) -> None:
    found = agreement.compare(*agreement.render_both(64, 48, 64, 64))
    print(*what)
    _check(found, mean=0.004, blocks=0.012, correlation=0.9995)


def case_checkers_and_pictures_by_other_coordinates() -> None:
    """On the floor, and pictures by the object's own coordinates on the ball as well."""
    pixels = builders.patches(6)
    for space, kind in (
        *((space, "TexChecker") for space in ("", "UV", "Object", "Generated")),
        *((space, "TexImage") for space in ("Object", "Generated")),
    ):
        tree, texture, diffuse = _floor_of(kind, space)
        if kind == "TexImage":
            texture.image, texture.interpolation = builders.image("Patches", pixels), "Closest"
            bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        else:
            texture.inputs["Scale"].default_value = 0.7 if space == "Object" else 3.0
            texture.inputs["Color1"].default_value = (0.8, 0.1, 0.1, 1)
        tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
        _check_floor(space, kind)


def case_pictures_around_things() -> None:
    """From the sides of a box, sharp and blended, around a sphere and a tube; on floor and ball."""
    # with so many rows no edge is where a flat floor looks its one colour up
    pixels = builders.patches(7)
    for projection, blend, space in (
        ("BOX", 0.0, "Object"),
        ("BOX", 0.6, "Generated"),
        ("SPHERE", 0.0, "Generated"),
        ("TUBE", 0.0, "Generated"),
        ("FLAT", 0.0, "Normal"),
    ):
        tree, texture, diffuse = _floor_of("TexImage", space)
        texture.image, texture.interpolation = builders.image("Patches", pixels), "Closest"
        texture.projection, texture.projection_blend = projection, blend
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        bpy.data.objects["Ball"].rotation_euler = (0.5, 0.4, 0.3)
        tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
        _check_floor(projection, blend, space)


def case_masks_by_where_and_how_things_are() -> None:
    """By height, by what faces up, and by another object's coordinates; on floor and ball."""
    for kind, output in (
        ("NewGeometry", "Position"),
        ("NewGeometry", "Normal"),
        ("NewGeometry", "True Normal"),
        ("TexCoord", "Object"),
        ("TexCoord", "Normal"),
    ):
        tree, dot, diffuse = _floor_of("VectorMath", "")
        dot.operation = "DOT_PRODUCT"
        dot.inputs[1].default_value = (0.2, 0.3, 0.6)
        source = tree.nodes.new(f"ShaderNode{kind}")
        if output == "Object":
            source.object = builders.link(None, "Helper")
            source.object.location = (0.3, 0.2, 0.6)
            source.object.rotation_euler = (0.4, 0.0, 0.5)
        tree.links.new(source.outputs[output], dot.inputs[0])
        _through_ramp(tree, dot, diffuse, 0.1, 0.5)
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        bpy.data.objects["Ball"].rotation_euler = (0.5, 0.4, 0.3)
        _check_floor(kind, output)


def case_coloured_noise() -> None:
    """Plain, of another hue, and by coordinates that it bends itself."""
    for use in ("plain", "hue", "bend"):
        tree, noise, diffuse = _floor_of("TexNoise", "Object")
        noise.inputs["Scale"].default_value, noise.inputs["Distortion"].default_value = 2.0, 0.3
        last = noise
        if use == "hue":
            last = tree.nodes.new("ShaderNodeHueSaturation")
            last.inputs["Hue"].default_value, last.inputs["Saturation"].default_value = 0.7, 1.5
            tree.links.new(noise.outputs["Color"], last.inputs["Color"])
        elif use == "bend":
            last, bend = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeMixRGB")
            last.inputs["Scale"].default_value, last.inputs["Detail"].default_value = 3.0, 1.0
            place = tree.nodes.new("ShaderNodeTexCoord")
            tree.links.new(place.outputs["Object"], bend.inputs["Color1"])
            tree.links.new(noise.outputs["Color"], bend.inputs["Color2"])
            tree.links.new(bend.outputs["Color"], last.inputs["Vector"])
        tree.links.new(last.outputs["Color"], diffuse.inputs["Color"])
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(use)


def case_cells() -> None:
    """Distances through a ramp, and colours, on floor and ball."""
    if bpy.app.version < (5, 0, 0):
        raise SkipCaseError("Blender 5.0 has other cells than those before it")
    for output, properties, inputs in (
        ("Color", {}, {}),
        ("Distance", {}, {"Randomness": 0.6}),
        # Sums of colours that are not normalized would reflect more light than arrives.
        ("Color", {"feature": "F2", "distance": "MANHATTAN", "normalize": True}, {"Detail": 1.5}),
        ("Distance", {"feature": "F2", "normalize": True}, {"Detail": 2.0, "Roughness": 0.6}),
        ("Distance", {"feature": "SMOOTH_F1", "distance": "MINKOWSKI"}, {"Exponent": 1.5}),
        ("Color", {"feature": "SMOOTH_F1"}, {"Smoothness": 0.8}),
        ("Distance", {"feature": "DISTANCE_TO_EDGE"}, {}),
        ("Distance", {"distance": "CHEBYCHEV", "normalize": True}, {}),
    ):
        tree, texture, diffuse = _floor_of("TexVoronoi", "Object")
        for name, value in properties.items():
            setattr(texture, name, value)
        for name, value in {"Scale": 1.5, **inputs}.items():
            texture.inputs[name].default_value = value
        if output == "Color":
            tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
        else:
            _through_ramp(tree, texture, diffuse, 0.1, 0.7)
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(output, properties, inputs)


def case_noise() -> None:
    """As colour through a ramp and as bumps, on floor and ball."""
    for inputs, space, as_bumps in (
        ({"Scale": 3.0, "Detail": 0.0}, "", False),
        ({"Scale": 2.0, "Detail": 3.5, "Roughness": 0.6}, "Object", False),
        ({"Scale": 4.0, "Distortion": 0.8, "Lacunarity": 2.3}, "UV", False),
        ({"Scale": 3.0, "Detail": 1.0}, "Object", True),
    ):
        tree, texture, diffuse = _floor_of("TexNoise", space)
        for name, value in inputs.items():
            texture.inputs[name].default_value = value
        if as_bumps:
            bump = tree.nodes.new("ShaderNodeBump")
            # Of steep bumps Cycles softens the terminator.
            bump.inputs["Distance"].default_value = 0.06
            tree.links.new(texture.outputs[0], bump.inputs["Height"])
            tree.links.new(bump.outputs["Normal"], diffuse.inputs["Normal"])
        else:
            _through_ramp(tree, texture, diffuse, 0.4, 0.6)
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(inputs, space, as_bumps)


def _masked(
    tree: bpy.types.NodeTree, picture: bpy.types.Node, noise: bpy.types.Node
) -> bpy.types.Node:
    """The picture, with another colour where the noise is strong."""
    steep, mix = tree.nodes.new("ShaderNodeMapRange"), tree.nodes.new("ShaderNodeMix")
    steep.inputs["From Min"].default_value, steep.inputs["From Max"].default_value = 0.4, 0.6
    mix.data_type = "RGBA"
    inputs = {entry.identifier: entry for entry in mix.inputs}
    tree.links.new(noise.outputs[0], steep.inputs["Value"])
    tree.links.new(steep.outputs[0], inputs["Factor_Float"])
    tree.links.new(picture.outputs["Color"], inputs["A_Color"])
    inputs["B_Color"].default_value = (0.7, 0.2, 0.05, 1)
    return mix


def _overlaid(
    tree: bpy.types.NodeTree, picture: bpy.types.Node, noise: bpy.types.Node
) -> bpy.types.Node:
    """The picture over the noise, and its hue turned: no sum of products."""
    over, turn = tree.nodes.new("ShaderNodeMixRGB"), tree.nodes.new("ShaderNodeHueSaturation")
    over.blend_type = "OVERLAY"
    over.inputs["Fac"].default_value = 0.9
    turn.inputs["Hue"].default_value, turn.inputs["Saturation"].default_value = 0.6, 0.8
    tree.links.new(noise.outputs[0], over.inputs["Color1"])
    tree.links.new(picture.outputs["Color"], over.inputs["Color2"])
    tree.links.new(over.outputs["Color"], turn.inputs["Color"])
    return turn


def _compared(
    tree: bpy.types.NodeTree, picture: bpy.types.Node, noise: bpy.types.Node
) -> bpy.types.Node:
    """One channel where the picture is brighter than the noise, and the two in the others."""
    where, parts = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeCombineColor")
    where.operation = "GREATER_THAN"
    tree.links.new(picture.outputs["Color"], where.inputs[0])
    tree.links.new(noise.outputs[0], where.inputs[1])
    for index, source in enumerate((where, noise, picture)):
        tree.links.new(source.outputs[0], parts.inputs[index])
    return parts


def case_textures_of_several() -> None:
    """A picture and noise, each looked up elsewhere, as one colour and as one height."""
    smooth = np.ones((64, 64, 4), np.float32)
    v, u = np.mgrid[0:64, 0:64] / 64.0
    smooth[..., 0] = 0.5 + 0.4 * np.sin(2 * np.pi * u)
    smooth[..., 1] = 0.5 + 0.4 * np.cos(2 * np.pi * v)
    smooth[..., 2] = 0.5 + 0.3 * np.sin(2 * np.pi * (u + v))
    for made in (_masked, _overlaid, _compared, None):
        tree, picture, diffuse = _floor_of("TexImage", "UV")
        picture.image = builders.image("Smooth", smooth, "Non-Color", is_float=True)
        noise, place = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeTexCoord")
        noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 2.0, 1.0
        tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
        if made:
            tree.links.new(made(tree, picture, noise).outputs[0], diffuse.inputs["Color"])
        else:
            both, bump = tree.nodes.new("ShaderNodeMath"), tree.nodes.new("ShaderNodeBump")
            both.operation = "MULTIPLY"
            bump.inputs["Distance"].default_value = 0.06
            tree.links.new(picture.outputs["Color"], both.inputs[0])
            tree.links.new(noise.outputs[0], both.inputs[1])
            tree.links.new(both.outputs[0], bump.inputs["Height"])
            tree.links.new(bump.outputs["Normal"], diffuse.inputs["Normal"])
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(made.__name__ if made else "bumps")


def _bent(tree: bpy.types.NodeTree, space: str) -> bpy.types.NodeSocket:
    """Coordinates that noise bends, and that are turned and scaled then."""
    place, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
    bend, turn = tree.nodes.new("ShaderNodeVectorMath"), tree.nodes.new("ShaderNodeMapping")
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 1.5, 0.0
    bend.operation = "MULTIPLY_ADD"
    bend.inputs[1].default_value = (0.5, 0.4, 0.3)
    turn.inputs["Rotation"].default_value = (0.2, 0, 0.4)
    turn.inputs["Scale"].default_value = (1.5, 1, 1)
    tree.links.new(place.outputs[space], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], bend.inputs[0])
    tree.links.new(place.outputs[space], bend.inputs[2])
    tree.links.new(bend.outputs[0], turn.inputs["Vector"])
    return turn.outputs[0]


def case_objects_with_colours_of_their_own() -> None:
    """By their random number and colour: objects that share mesh and material, and instances."""
    tree, info, diffuse = _floor_of("ObjectInfo", "")
    mix = tree.nodes.new("ShaderNodeMixRGB")
    tree.links.new(info.outputs["Random"], mix.inputs["Fac"])
    tree.links.new(info.outputs["Color"], mix.inputs["Color1"])
    mix.inputs["Color2"].default_value = (0.1, 0.6, 0.1, 1)
    tree.links.new(mix.outputs["Color"], diffuse.inputs["Color"])
    ball = bpy.data.objects["Ball"]
    ball.data.materials[0] = bpy.data.materials["Floor"]
    group = bpy.data.collections.new("Small")
    small = bpy.data.objects.new("Grain", ball.data)
    group.objects.link(small)
    small.color = (0.2, 0.2, 0.9, 1)
    for index in range(6):
        turn = Matrix.Rotation(index, 4, "Z") @ Matrix.Translation((1.6, 0, 0.3))
        place = turn @ Matrix.Scale(0.3, 4)
        if index % 2:
            item = bpy.data.objects.new("Group", None)
            item.instance_type, item.instance_collection = "COLLECTION", group
        else:
            item = bpy.data.objects.new("Ball", ball.data)
            item.color = (0.9, 0.1 * index, 0.2, 1)
        bpy.context.scene.collection.objects.link(item)
        item.matrix_world = place
    _check_floor("objects")


def case_coordinates_that_are_computed() -> None:
    """Bent ones for pictures and patterns, and single ones as numbers."""
    pixels = builders.patches(8)
    for kind, space in (
        ("TexImage", "UV"),
        ("TexNoise", "Object"),
        ("TexWave", "Generated"),
        ("SeparateXYZ", "Generated"),
    ):
        tree, texture, diffuse = _floor_of(kind, "")
        tree.links.new(_bent(tree, space), texture.inputs["Vector"])
        if kind == "TexImage":
            texture.image = builders.image("Patches", pixels, "Non-Color", is_float=True)
            tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
        else:
            if kind != "SeparateXYZ":
                texture.inputs["Scale"].default_value = 1.0
            _through_ramp(tree, texture, diffuse, 0.2, 0.8)
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(kind, space)


def case_bricks_and_bent_waves() -> None:
    """Walls, rings, waves that noise bends, and distances, on floor and ball."""
    for kind, properties, inputs in (
        ("TexBrick", {"squash": 0.6, "offset": 0.3}, {"Mortar Smooth": 0.7, "Mortar Size": 0.05}),
        ("TexBrick", {"offset_frequency": 3}, {"Bias": -0.2, "Row Height": 0.4}),
        ("TexWave", {"wave_type": "RINGS", "rings_direction": "Z"}, {"Phase Offset": 1.0}),
        ("TexWave", {"bands_direction": "DIAGONAL", "wave_profile": "TRI"}, {"Distortion": 3.0}),
        ("TexWave", {"wave_type": "RINGS", "rings_direction": "SPHERICAL"}, {"Distortion": 2.0}),
        ("TexGradient", {"gradient_type": "SPHERICAL"}, {}),
        ("VectorMath", {"operation": "DISTANCE"}, {}),
    ):
        tree, texture, diffuse = _floor_of(kind, "" if kind == "VectorMath" else "Object")
        for name, value in properties.items():
            setattr(texture, name, value)
        for name, value in inputs.items():
            texture.inputs[name].default_value = value
        if kind == "TexBrick":
            texture.inputs["Scale"].default_value = 0.8
            texture.inputs["Color1"].default_value = (0.7, 0.2, 0.1, 1)
            texture.inputs["Color2"].default_value = (0.3, 0.3, 0.1, 1)
            tree.links.new(texture.outputs["Color"], diffuse.inputs["Color"])
        else:
            if kind == "VectorMath":
                place = tree.nodes.new("ShaderNodeTexCoord")
                tree.links.new(place.outputs["Object"], texture.inputs[0])
                texture.inputs[1].default_value = (0.3, 0.2, 0.1)
            elif kind == "TexWave":
                texture.inputs["Scale"].default_value = 0.3
            _through_ramp(tree, texture, diffuse, 0.2, 0.8)
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(kind, properties, inputs)


def case_gradients_and_waves() -> None:
    """Through a colour ramp, on floor and ball."""
    for kind, properties, scale, space in (
        ("TexGradient", {"gradient_type": "LINEAR"}, 0.0, "Generated"),
        ("TexGradient", {"gradient_type": "QUADRATIC"}, 0.0, "UV"),
        ("TexGradient", {"gradient_type": "EASING"}, 0.0, ""),
        ("TexGradient", {"gradient_type": "DIAGONAL"}, 0.0, "Object"),
        ("TexWave", {"bands_direction": "X"}, 0.5, "Object"),
        ("TexWave", {"bands_direction": "DIAGONAL", "wave_profile": "SAW"}, 1.0, "Generated"),
        ("TexWave", {"bands_direction": "Y", "wave_profile": "TRI"}, 1.0, "UV"),
    ):
        tree, texture, diffuse = _floor_of(kind, space)
        for key, value in properties.items():
            setattr(texture, key, value)
        if scale:
            texture.inputs["Scale"].default_value = scale
            texture.inputs["Phase Offset"].default_value = 0.7
        _through_ramp(tree, texture, diffuse, 0.3, 1.0)
        bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["Floor"]
        _check_floor(kind, properties, space)


def case_the_camera_may_see_another_world() -> None:
    """A mirror and glass show what lights the scene, holes the backdrop."""
    for kind, inputs in (
        ("BsdfAnisotropic", {"Roughness": 0.0}),
        ("BsdfGlass", {"Roughness": 0.0}),
        ("BsdfPrincipled", {"Alpha": 0.5}),
    ):
        _stage(kind, inputs)
        tree = bpy.context.scene.world.node_tree
        other, mix = (tree.nodes.new(f"ShaderNode{n}") for n in ("Background", "MixShader"))
        path = tree.nodes.new("ShaderNodeLightPath")
        other.inputs["Color"].default_value = (0.9, 0.2, 0.1, 1)
        output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
        first = output.inputs[0].links[0].from_socket
        tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
        tree.links.new(first, mix.inputs[1])
        tree.links.new(other.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], output.inputs[0])
        for integrator in ("path", "segment") if kind == "BsdfGlass" else ("path",):
            found = agreement.compare(*agreement.render_both(64, 48, 256, 256, integrator))
            print(kind, integrator)
            _check(found, mean=0.007, blocks=0.02, correlation=0.9995)


def case_microfacets_that_scatter_once_lose_as_much_light() -> None:
    for kind, inputs in (
        ("BsdfAnisotropic", {"Color": (0.9, 0.8, 0.7, 1), "Roughness": 0.9}),
        ("BsdfPrincipled", {"Base_Color": (0.9, 0.6, 0.3, 1), "Metallic": 1.0, "Roughness": 0.8}),
        ("BsdfGlass", {"Roughness": 0.6, "IOR": 1.5}),
    ):
        _stage(kind, inputs)
        tree = bpy.data.materials["Tested"].node_tree
        next(n for n in tree.nodes if n.bl_idname == f"ShaderNode{kind}").distribution = "GGX"
        found = agreement.compare(*agreement.render_both(64, 48, 256, 256))
        print(kind)
        _check(found, mean=0.007, blocks=0.015, correlation=0.999)


def case_bump_maps_look_alike() -> None:
    """Waves of a picture in metal and, inverted, in plaster, scaled unevenly."""
    v, u = np.mgrid[0:128, 0:128] / 128.0
    waves = np.ones((128, 128, 4), np.float32)
    waves[..., :3] = (0.5 + 0.25 * (np.sin(4 * np.pi * u) + np.sin(6 * np.pi * v)))[..., None]
    for kind, inverted in (("BsdfAnisotropic", False), ("BsdfDiffuse", True)):
        _stage(kind, {"Roughness": 0.2} if kind == "BsdfAnisotropic" else {})
        ball = bpy.data.objects["Ball"]
        data = builders.quad("Waves", 1.0)
        material = ball.data.materials[0]
        data.materials.append(material)
        ball.data = data
        turned = Euler((0.9, 0.2, 0.3)).to_matrix().to_4x4()
        ball.matrix_world = Matrix.Translation((0, 0, 1.3)) @ turned @ Matrix.Diagonal((2, 1, 1, 1))
        tree = material.node_tree
        shader = next(n for n in tree.nodes if n.bl_idname == f"ShaderNode{kind}")
        texture, bump = (tree.nodes.new(f"ShaderNode{n}") for n in ("TexImage", "Bump"))
        texture.image = builders.image("Waves", waves, "Non-Color", is_float=True)
        bump.invert = inverted
        bump.inputs["Distance"].default_value, bump.inputs["Strength"].default_value = 0.2, 0.8
        tree.links.new(texture.outputs["Color"], bump.inputs["Height"])
        tree.links.new(bump.outputs["Normal"], shader.inputs["Normal"])
        found = agreement.compare(*agreement.render_both(96, 72, 256, 256))
        # Cycles takes slopes across a pixel, Segue across a texel: highlights end elsewhere.
        _check(found, mean=0.008, blocks=0.04, correlation=0.999)


def case_displacement_looks_alike() -> None:
    """As bumps, as a moved surface and as both, of objects of another size than one."""
    for method, space in (
        ("BUMP", "OBJECT"),
        ("BUMP", "WORLD"),
        ("DISPLACEMENT", "OBJECT"),
        ("DISPLACEMENT", "WORLD"),
        ("BOTH", "OBJECT"),
    ):
        tree, noise, _ = _floor_of("TexNoise", "Object")
        noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 3.0, 1.0
        raised = tree.nodes.new("ShaderNodeDisplacement")
        raised.space = space
        # Of steep bumps Cycles softens the terminator.
        raised.inputs["Scale"].default_value = 0.3 if method == "DISPLACEMENT" else 0.06
        tree.links.new(noise.outputs[0], raised.inputs["Height"])
        output = tree.get_output_node("CYCLES")
        tree.links.new(raised.outputs[0], output.inputs["Displacement"])
        bpy.data.materials["Floor"].displacement_method = method
        ball = bpy.data.objects["Ball"]
        ball.data.materials[0] = bpy.data.materials["Floor"]
        ball.matrix_world = ball.matrix_world @ Matrix.Diagonal((1.3, 1.3, 0.8, 1))
        _check_floor(method, space)


def case_coarse_smoothed_mirrors_have_no_dark_rims() -> None:
    """At the silhouette the shading normals would mirror the inside of the ball."""
    _stage("BsdfAnisotropic", {"Roughness": 0.0})
    ball = bpy.data.objects["Ball"]
    coarse = builders.sphere("Coarse", 1.0, 12, 6)
    coarse.polygons.foreach_set("use_smooth", [True] * len(coarse.polygons))
    coarse.materials.append(ball.data.materials[0])
    ball.data = coarse
    found = agreement.compare(*agreement.render_both(64, 48, 128, 128))
    _check(found, mean=0.003, blocks=0.02, correlation=0.9995)


def case_media_are_as_bright_as_in_cycles() -> None:
    """A window of a single sheet, a lamp and a camera inside of glass: no factor of the index."""
    for place in ("window", "lamp", "camera"):
        _stage("BsdfDiffuse", {"Color": (0.6, 0.5, 0.4, 1)})
        glass = builders.shader_material("BsdfGlass", "Glass", IOR=1.5)
        if place == "window":
            sheet = builders.quad("Sheet", 2.0)
            pose = Matrix.Translation((0, -3, 1.5)) @ Euler((1.3, 0, 0)).to_matrix().to_4x4()
        else:
            sheet = builders.sphere("Sheet", 1.3 if place == "lamp" else 1.0, 64, 32)
            centre = (0, 0, 1.05) if place == "lamp" else (0, -5, 2.5)
            pose = Matrix.Translation(centre)
        if place == "lamp":
            glowing = builders.shader_material("Emission", "Glowing", Strength=2.0)
            bpy.data.objects["Ball"].data.materials[0] = glowing
        sheet.materials.append(glass)
        builders.link(sheet, matrix=pose)
        found = agreement.compare(*agreement.render_both(64, 48, 512, 512))
        print(place)
        _check(found, mean=0.01, blocks=0.03, correlation=0.995)


def case_skies_and_patterns_of_the_world() -> None:
    """Nodes that only Cycles knows, as the picture that it makes of them."""
    for kind in ("ShaderNodeTexSky", "ShaderNodeTexNoise"):
        _stage("BsdfDiffuse", {"Color": (0.6, 0.5, 0.4, 1)})
        _, tree, background = builders.world()
        node = tree.nodes.new(kind)
        tree.links.new(node.outputs["Color"], background.inputs["Color"])
        background.inputs["Strength"].default_value = 0.1
        found = agreement.compare(*agreement.render_both(64, 48, 256, 256))
        print(kind)
        _check(found, mean=0.003, blocks=0.01, correlation=0.9995)


def case_insides_absorb() -> None:
    """A core in smooth and in frosted glass, and in a volume without a surface."""
    for kind, roughness in (("BsdfGlass", 0.0), ("BsdfGlass", 0.2), (None, 0.0)):
        _stage("BsdfDiffuse", {"Color": (0.6, 0.5, 0.4, 1)})
        if kind:
            shell = builders.shader_material(kind, "Shell", IOR=1.3, Roughness=roughness)
        else:
            shell, _, _ = builders.material("Shell")
        tree = shell.node_tree
        volume = tree.nodes.new("ShaderNodeVolumeAbsorption")
        volume.inputs["Color"].default_value = (0.9, 0.5, 0.1, 1.0)
        volume.inputs["Density"].default_value = 2.0
        output = tree.get_output_node("CYCLES")
        tree.links.new(volume.outputs[0], output.inputs["Volume"])
        ball = builders.sphere("Shell", 1.3, 64, 32)
        ball.materials.append(shell)
        builders.link(ball, matrix=Matrix.Translation((0, 0, 1.35)))
        found = agreement.compare(*agreement.render_both(64, 48, 256, 256))
        print(kind, roughness)
        _check(found, mean=0.01, blocks=0.03, correlation=0.995)


def case_lights_one_by_one() -> None:
    """Every kind of light, alone, over a floor with a cube."""
    soft = {"use_soft_falloff": False}
    lights: list[tuple[str, dict[str, Any]]] = [
        ("POINT", {"energy": 100.0, "shadow_soft_size": 0.2, **soft}),
        ("POINT", {"energy": 100.0, "shadow_soft_size": 0.0}),
        (
            "SPOT",
            {"energy": 100.0, "shadow_soft_size": 0.1, "spot_size": 1.2, "spot_blend": 0.3, **soft},
        ),
        ("SPOT", {"energy": 100.0, "shadow_soft_size": 0.0, "spot_size": 0.8, "spot_blend": 1.0}),
        ("SUN", {"energy": 3.0, "angle": 0.2}),
        ("SUN", {"energy": 3.0, "angle": 0.0}),
        ("AREA", {"energy": 100.0, "size": 1.0}),
        ("AREA", {"energy": 100.0, "size": 1.0, "size_y": 0.4, "shape": "ELLIPSE"}),
        ("AREA", {"energy": 100.0, "size": 1.0, "shape": "RECTANGLE", "spread": 1.0}),
    ]
    for kind, properties in lights:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        builders.camera(Matrix.Translation((0, -6, 3)) @ Euler((1.1, 0, 0)).to_matrix().to_4x4())
        for data, place in ((builders.quad("Floor", 5.0), 0.0), (builders.cube(half=0.5), 0.5)):
            data.materials.append(builders.shader_material("BsdfDiffuse", Color=(0.5, 0.5, 0.5, 1)))
            builders.link(data, matrix=Matrix.Translation((place, 0, place)))
        pose = Matrix.Translation((0, 0, 3)) @ Euler((0.3, 0.2, 0)).to_matrix().to_4x4()
        builders.light(kind, pose, **properties)
        found = agreement.compare(*agreement.render_both(64, 48, 512, 256))
        print(kind, properties)
        # Most of the difference is noise in the bright middle of the narrow spread.
        _check(found, mean=0.004, blocks=0.01, correlation=0.9998)


def case_environment_maps_turn_alike() -> None:
    """A mirror shows where an environment map points, for every mapping of directions."""
    for kind, rotation in (("POINT", (0.3, 0.2, 1.0)), ("TEXTURE", (0.3, 0.2, 1.0))):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        _environment(_sky(), rotation, 1.0)
        tree = bpy.context.scene.world.node_tree
        next(n for n in tree.nodes if n.bl_idname == "ShaderNodeMapping").vector_type = kind
        builders.camera(Matrix.Translation((0, -4, 0)) @ Euler((1.5708, 0, 0)).to_matrix().to_4x4())
        ball = builders.sphere("Ball", 1.0, 64, 32)
        ball.materials.append(builders.shader_material("BsdfAnisotropic", Roughness=0.0))
        builders.link(ball)
        found = agreement.compare(*agreement.render_both(64, 48, 32, 32))
        _check(found, mean=0.004, blocks=0.008, correlation=0.9998)
