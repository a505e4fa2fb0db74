"""Node trees: what each becomes, and that nothing is dropped in silence."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

import builders


class Tree:
    """A material under test, on a quad."""

    def __init__(self) -> None:
        self.material, self.tree, self.output = builders.material("Tested")
        data = builders.quad()
        data.materials.append(self.material)
        self.item = builders.link(data)

    def node(
        self, kind: str, tree: bpy.types.NodeTree | None = None, **inputs: Any
    ) -> bpy.types.Node:
        node = (tree or self.tree).nodes.new(f"ShaderNode{kind}")
        for key, value in inputs.items():
            node.inputs[key.replace("_", " ")].default_value = value
        return node

    def link(self, output: bpy.types.NodeSocket, target: bpy.types.NodeSocket) -> None:
        target.id_data.links.new(output, target)

    def surface(self, node: bpy.types.Node) -> bpy.types.Node:
        self.link(node.outputs[0], self.output.inputs["Surface"])
        return node

    def export(self) -> tuple[dict, Any, list[str]]:
        scene, warnings = builders.export()
        ((name, data),) = scene.materials
        assert name == "Tested"
        return data["surface"], scene, warnings


def _close(found: Any, wanted: Any) -> None:
    np.testing.assert_allclose(found, wanted, rtol=1e-5, atol=1e-6)


def case_every_shader_of_the_table() -> None:
    tree = Tree()
    for kind, wanted in (
        ("BsdfDiffuse", "diffuse"),
        ("BsdfAnisotropic", "glossy"),
        ("BsdfGlass", "glass"),
        ("BsdfRefraction", "refraction"),
        ("BsdfTransparent", "transparent"),
        ("BsdfTranslucent", "translucent"),
        ("BsdfSheen", "sheen"),
        ("Emission", "emission"),
    ):
        node = tree.surface(tree.node(kind, Color=(0.1, 0.2, 0.3, 1)))
        surface, _, warnings = tree.export()
        assert surface["type"] == wanted and not warnings, (kind, surface, warnings)
        _close(surface["color"], (0.1, 0.2, 0.3))
        if "Roughness" in node.inputs:
            _close(surface["roughness"], node.inputs["Roughness"].default_value)


def case_principled_sockets() -> None:
    tree = Tree()
    node = tree.surface(tree.node("BsdfPrincipled"))
    values = {
        "Base Color": ("base_color", (0.1, 0.2, 0.3, 1)),
        "Metallic": ("metallic", 0.4),
        "Roughness": ("roughness", 0.3),
        "IOR": ("ior", 1.7),
        "Diffuse Roughness": ("diffuse_roughness", 0.2),
        "Specular IOR Level": ("specular_level", 0.7),
        "Specular Tint": ("specular_tint", (0.9, 0.8, 0.7, 1)),
        "Anisotropic": ("anisotropy", 0.5),
        "Anisotropic Rotation": ("rotation", 0.25),
        "Transmission Weight": ("transmission", 0.6),
        "Coat Weight": ("coat", 0.3),
        "Coat Roughness": ("coat_roughness", 0.15),
        "Coat IOR": ("coat_ior", 1.6),
        "Coat Tint": ("coat_tint", (0.5, 0.6, 0.7, 1)),
        "Sheen Weight": ("sheen", 0.2),
        "Sheen Roughness": ("sheen_roughness", 0.35),
        "Sheen Tint": ("sheen_tint", (0.3, 0.2, 0.1, 1)),
        "Emission Color": ("emission_color", (1, 0.5, 0.25, 1)),
        "Emission Strength": ("emission_strength", 2.0),
    }
    present = {name: entry for name, entry in values.items() if name in node.inputs}
    assert set(values) - set(present) <= {"Diffuse Roughness"}
    for name, (_, value) in present.items():
        node.inputs[name].default_value = value
    surface, _, warnings = tree.export()
    assert surface["type"] == "principled" and not warnings, warnings
    for key, value in present.values():
        _close(surface[key], value[:3] if isinstance(value, tuple) else value)


def case_no_socket_of_principled_is_forgotten() -> None:
    """Sockets that this version of Blender has are translated, ignored by name, or known."""
    from blender_addon.nodes.closures import SHADERS

    tree = Tree()
    for kind, shader in SHADERS.items():
        try:
            node = tree.tree.nodes.new(kind)
        except RuntimeError:
            continue  # younger than this Blender
        known = set(shader.keys.values()) | set(shader.normals.values()) | set(shader.ignored)
        if kind == "ShaderNodeBsdfPrincipled":
            known |= {"Alpha"}
        if "anisotropy" in shader.keys:
            known |= {"Tangent"}
        if "Thin Film Thickness" in known:
            known |= {"Thin Film IOR"}  # does nothing without a film
        known |= {"Weight"}  # hidden in every node, for node groups' sake
        subsurface = {entry.identifier for entry in node.inputs if "Subsurface" in entry.identifier}
        if kind == "ShaderNodeSubsurfaceScattering":
            subsurface = {"Scale", "Radius", "IOR", "Roughness", "Anisotropy", "Normal"}
        if kind == "ShaderNodeBsdfMetallic":
            subsurface = {"IOR", "Extinction"}  # said as "a measured conductor"
        missing = {entry.identifier for entry in node.inputs} - known - subsurface
        assert not missing, (kind, missing)


def case_alpha_becomes_a_mix_with_transparency() -> None:
    tree = Tree()
    tree.surface(tree.node("BsdfPrincipled", Alpha=0.25))
    surface, _, _ = tree.export()
    assert surface["type"] == "mix" and surface["a"]["type"] == "transparent"
    assert surface["b"]["type"] == "principled"
    _close(surface["factor"], 0.25)


def case_what_a_shader_cannot_do_is_named_once() -> None:
    tree = Tree()
    tree.surface(tree.node("BsdfPrincipled", Subsurface_Weight=0.5, Thin_Film_Thickness=100.0))
    for _ in range(2):
        _, _, warnings = tree.export()
        assert sum("subsurface" in text for text in warnings) == 1, warnings
        assert sum("Thin Film" in text for text in warnings) == 1, warnings
        assert all("Material 'Tested'" in text for text in warnings)
    toon = tree.surface(tree.node("BsdfToon", Color=(0.2, 0.4, 0.6, 1)))
    surface, _, warnings = tree.export()
    assert surface["type"] == "diffuse" and any(toon.name in text for text in warnings)
    _close(surface["color"], (0.2, 0.4, 0.6))
    tree.surface(tree.node("Holdout"))
    surface, _, warnings = tree.export()
    assert len(warnings) == 1
    _close(surface["color"], 0.0)


def case_mix_and_add() -> None:
    tree = Tree()
    mix = tree.surface(tree.node("MixShader", Fac=0.25))
    add = tree.node("AddShader")
    tree.link(tree.node("BsdfDiffuse").outputs[0], mix.inputs[1])
    tree.link(add.outputs[0], mix.inputs[2])
    tree.link(tree.node("BsdfGlass").outputs[0], add.inputs[0])
    tree.link(tree.node("Emission").outputs[0], add.inputs[1])
    surface, _, _ = tree.export()
    assert (surface["type"], surface["a"]["type"], surface["b"]["type"]) == (
        "mix",
        "diffuse",
        "add",
    )
    assert (surface["b"]["a"]["type"], surface["b"]["b"]["type"]) == ("glass", "emission")
    _close(surface["factor"], 0.25)
    mix.inputs[0].default_value = 1.0
    assert tree.export()[0]["type"] == "add"


def case_fresnel_mixes_are_layers() -> None:
    tree = Tree()
    mix, fresnel = tree.surface(tree.node("MixShader")), tree.node("Fresnel", IOR=1.4)
    refraction = tree.node("BsdfRefraction", Color=(0.9, 0.8, 0.7, 1), IOR=1.4, Roughness=0.1)
    refraction.distribution = "GGX"
    glossy = tree.node("BsdfAnisotropic", Color=(0.9, 0.8, 0.7, 1), Roughness=0.1)
    tree.link(fresnel.outputs[0], mix.inputs[0])
    tree.link(refraction.outputs[0], mix.inputs[1])
    tree.link(glossy.outputs[0], mix.inputs[2])
    surface, _, warnings = tree.export()
    assert surface["type"] == "glass" and not warnings, warnings
    _close((surface["ior"], surface["roughness"]), (1.4, 0.1))
    glossy.inputs["Roughness"].default_value = 0.3
    assert any("unequal" in text for text in tree.export()[2])
    # With something else in place of the reflection it stays a mix.
    tree.link(tree.node("Emission").outputs[0], mix.inputs[2])
    surface, _, warnings = tree.export()
    assert surface["type"] == "mix" and not warnings, warnings


def case_the_direction_of_view_is_a_texture() -> None:
    tree = Tree()
    mix, weight = tree.surface(tree.node("MixShader")), tree.node("LayerWeight", Blend=0.2)
    tree.link(weight.outputs["Fresnel"], mix.inputs[0])
    tree.link(tree.node("BsdfDiffuse").outputs[0], mix.inputs[1])
    tree.link(tree.node("BsdfTransparent").outputs[0], mix.inputs[2])
    surface, scene, warnings = tree.export()
    assert not warnings, warnings
    table = scene.textures[surface["factor"]["texture"]][1]
    assert table["type"] == "table" and table["domain"] == [[-1.0, 1.0]]
    assert scene.textures[table["of"][0]["texture"]][1] == {"type": "facing"}
    # A normal of the node's own is not followed.
    tree.link(tree.node("Bump").outputs[0], weight.inputs["Normal"])
    assert any("normal of its own" in text for text in tree.export()[2])


def case_reroutes_mutes_and_groups() -> None:
    group = bpy.data.node_groups.new("Paint", "ShaderNodeTree")
    group.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    diffuse = group.nodes.new("ShaderNodeBsdfDiffuse")
    group.links.new(start.outputs["Tint"], diffuse.inputs["Color"])
    group.links.new(diffuse.outputs[0], end.inputs["Shader"])
    tree = Tree()
    outer = tree.node("Group")
    outer.node_tree = group
    outer.inputs["Tint"].default_value = (0.3, 0.6, 0.9, 1)
    reroute = tree.tree.nodes.new("NodeReroute")
    tree.link(outer.outputs[0], reroute.inputs[0])
    tree.link(reroute.outputs[0], tree.output.inputs["Surface"])
    _close(tree.export()[0]["color"], (0.3, 0.6, 0.9))
    # A colour from outside, through a muted node that passes its first colour on.
    rgb, invert = tree.node("RGB"), tree.node("Invert")
    rgb.outputs[0].default_value = (0.1, 0.2, 0.3, 1)
    tree.link(rgb.outputs[0], invert.inputs["Color"])
    tree.link(invert.outputs[0], outer.inputs["Tint"])
    _close(tree.export()[0]["color"], (0.9, 0.8, 0.7))
    invert.mute = True
    _close(tree.export()[0]["color"], (0.1, 0.2, 0.3))
    tree.tree.links[-1].is_muted = True
    _close(tree.export()[0]["color"], (0.3, 0.6, 0.9))


def _checker() -> np.ndarray:
    pixels = np.ones((4, 4, 4), np.float32)
    pixels[..., :3] = np.round(np.random.default_rng(3).random((4, 4, 3)) * 255) / 255
    return pixels


def _textured(
    tree: Tree, colorspace: str = "sRGB"
) -> tuple[bpy.types.Node, bpy.types.Node, np.ndarray]:
    pixels = _checker()
    node = tree.node("TexImage")
    node.image = builders.image("Picture", pixels, colorspace)
    diffuse = tree.surface(tree.node("BsdfDiffuse"))
    tree.link(node.outputs["Color"], diffuse.inputs["Color"])
    return node, diffuse, pixels


def case_image_texture() -> None:
    tree = Tree()
    node, _, pixels = _textured(tree)
    node.extension, node.interpolation = "EXTEND", "Closest"
    surface, scene, warnings = tree.export()
    assert surface["color"]["channel"] == "rgb" and not warnings
    _, texture = scene.textures[surface["color"]["texture"]]
    assert (texture["wrap_s"], texture["filter"], texture["uv"]) == ("clamp", "closest", "")
    _close(texture["transform"], (1, 0, 0, 0, 1, 0))
    image = scene.images[texture["image"]]
    assert image["colorspace"] == "srgb" and image["pixels"].dtype == np.uint8
    np.testing.assert_array_equal(image["pixels"], np.rint(pixels[..., :3] * 255))


def case_data_images_and_channels() -> None:
    tree = Tree()
    node, diffuse, _ = _textured(tree, "Non-Color")
    tree.link(node.outputs["Color"], diffuse.inputs["Roughness"])
    surface, scene, _ = tree.export()
    assert surface["roughness"]["channel"] == "luminance"
    assert scene.images[0]["colorspace"] == "raw" and len(scene.images) == 1
    separate = tree.node("SeparateColor")
    tree.link(node.outputs["Color"], separate.inputs[0])
    tree.link(separate.outputs["Green"], diffuse.inputs["Roughness"])
    surface, scene, _ = tree.export()
    assert surface["roughness"]["channel"] == "g" and len(scene.images) == 1


def case_alpha_of_an_image() -> None:
    pixels = np.ones((2, 2, 4), np.float32)
    pixels[..., :3] = 0.6
    pixels[..., 3] = [[1.0, 0.2], [0.4, 0.0]]
    tree = Tree()
    node = tree.node("TexImage")
    node.image = builders.image("Leaf", pixels)
    principled = tree.surface(tree.node("BsdfPrincipled"))
    tree.link(node.outputs["Color"], principled.inputs["Base Color"])
    surface, scene, _ = tree.export()
    # Alone, colours are multiplied by their alpha, as in Cycles.
    _close(scene.images[0]["pixels"][0, :, 0], (153, 31))
    tree.link(node.outputs["Alpha"], principled.inputs["Alpha"])
    surface, scene, _ = tree.export()
    _close(scene.images[0]["pixels"][..., 0], 153)
    assert surface["factor"]["channel"] == "a"
    assert surface["factor"]["texture"] == surface["b"]["base_color"]["texture"]


def case_mapping_and_uv_maps() -> None:
    tree = Tree()
    node, _, _ = _textured(tree)
    place, mapping = tree.node("UVMap"), tree.node("Mapping")
    place.uv_map = "UVMap"
    mapping.inputs["Location"].default_value = (0.1, 0.2, 0)
    mapping.inputs["Rotation"].default_value = (0, 0, np.pi / 2)
    mapping.inputs["Scale"].default_value = (2, 3, 1)
    tree.link(place.outputs[0], mapping.inputs["Vector"])
    tree.link(mapping.outputs[0], node.inputs["Vector"])
    surface, scene, warnings = tree.export()
    texture = scene.textures[surface["color"]["texture"]][1]
    # Scale, then rotate by a quarter turn, then shift: s = -3 v + 0.1, t = 2 u + 0.2.
    _close(texture["transform"], (0, -3, 0.1, 2, 0, 0.2))
    assert texture["uv"] == "UVMap" and not warnings
    mapping.vector_type = "TEXTURE"
    surface, scene, _ = tree.export()
    texture = scene.textures[surface["color"]["texture"]][1]
    # The inverse: s = (v - 0.2) / 2, t = (0.1 - u) / 3.
    _close(texture["transform"], (0, 0.5, -0.1, -1 / 3, 0, 0.1 / 3))
    scale = tree.node("VectorMath")
    scale.operation = "SCALE"
    scale.inputs["Scale"].default_value = 4.0
    tree.link(tree.node("TexCoord").outputs["UV"], scale.inputs[0])
    tree.link(scale.outputs[0], node.inputs["Vector"])
    surface, scene, _ = tree.export()
    _close(scene.textures[surface["color"]["texture"]][1]["transform"], (4, 0, 0, 0, 4, 0))


def case_normal_map() -> None:
    tree = Tree()
    node, diffuse, _ = _textured(tree, "Non-Color")
    tree.tree.links.remove(diffuse.inputs["Color"].links[0])
    normal = tree.node("NormalMap", Strength=0.5)
    normal.uv_map = "UVMap"
    tree.link(node.outputs["Color"], normal.inputs["Color"])
    tree.link(normal.outputs[0], diffuse.inputs["Normal"])
    surface, scene, warnings = tree.export()
    found = surface["normal"]
    _close(found["strength"], 0.5)
    assert (found["space"], found["uv"]) == ("tangent", "UVMap") and not warnings
    texture = scene.textures[found["texture"]][1]
    assert texture["scale"][:3] == [2.0] * 3 and texture["bias"][:3] == [-1.0] * 3
    if hasattr(normal, "convention"):
        normal.convention = "DIRECTX"
        surface, scene, _ = tree.export()
        texture = scene.textures[surface["normal"]["texture"]][1]
        assert (texture["scale"][:3], texture["bias"][:3]) == ([2.0, -2.0, 2.0], [-1.0, 1.0, -1.0])
    bump = tree.node("Bump")
    tree.link(normal.outputs[0], bump.inputs["Normal"])
    tree.link(bump.outputs[0], diffuse.inputs["Normal"])
    assert tree.export()[0]["normal"]["space"] == "tangent", "no height: the map below"
    tree.link(node.outputs["Color"], bump.inputs["Height"])
    bump.inputs["Distance"].default_value, bump.inputs["Strength"].default_value = 0.1, 0.5
    bump.invert = True
    surface, scene, warnings = tree.export()
    found = surface["normal"]
    assert scene.textures[found["height"]["texture"]][1]["type"] == "image" and not warnings
    _close((found["distance"], found["strength"]), (-0.1, 0.5))
    assert found["normal"]["space"] == "tangent"


def case_constants_are_folded() -> None:
    tree = Tree()
    diffuse = tree.surface(tree.node("BsdfDiffuse"))
    value = tree.node("Value")
    value.outputs[0].default_value = 0.25
    for operation, wanted in (
        ("MULTIPLY", 0.5),
        ("POWER", 0.0625),
        ("SQRT", 0.5),
        ("SUBTRACT", 0.0),
    ):
        node = tree.node("Math")
        node.operation, node.use_clamp = operation, True
        node.inputs[1].default_value = 2.0
        tree.link(value.outputs[0], node.inputs[0])
        tree.link(node.outputs[0], diffuse.inputs["Roughness"])
        _close(tree.export()[0]["roughness"], wanted)
    mix = tree.node("Mix")
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    factor, a, b = (entry for entry in mix.inputs if entry.enabled)
    factor.default_value = 0.5
    a.default_value, b.default_value = (0.8, 0.4, 0.2, 1), (0.5, 0.5, 0.5, 1)
    result = next(output for output in mix.outputs if output.enabled)
    tree.link(result, diffuse.inputs["Color"])
    _close(tree.export()[0]["color"], (0.6, 0.3, 0.15))
    # A colour in a socket for numbers is its luminance.
    tree.link(result, diffuse.inputs["Roughness"])
    _close(tree.export()[0]["roughness"], 0.2126390 * 0.6 + 0.7151687 * 0.3 + 0.0721923 * 0.15)


def case_arithmetic_on_images() -> None:
    tree = Tree()
    node, diffuse, pixels = _textured(tree, "Non-Color")
    ramp = tree.node("ValToRGB")
    ramp.color_ramp.elements[0].color = (1, 0, 0, 1)
    ramp.color_ramp.elements[1].color = (0, 0, 1, 1)
    gamma = tree.node("Gamma", Gamma=2.0)
    tree.link(node.outputs["Color"], gamma.inputs["Color"])
    tree.link(gamma.outputs[0], ramp.inputs[0])
    tree.link(ramp.outputs[0], diffuse.inputs["Color"])
    surface, scene, warnings = tree.export()
    assert not warnings, warnings
    image = scene.images[scene.textures[surface["color"]["texture"]][1]["image"]]
    grey = pixels[..., :3] ** 2 @ np.array([0.2126390, 0.7151687, 0.0721923])
    np.testing.assert_allclose(image["pixels"][..., 2], grey, atol=2e-3)
    np.testing.assert_allclose(image["pixels"][..., 0], 1 - grey, atol=2e-3)
    assert image["colorspace"] == "linear"


def case_unsupported_nodes_are_named_once() -> None:
    tree = Tree()
    diffuse = tree.surface(tree.node("BsdfDiffuse"))
    magic = tree.node("TexMagic")
    for name in ("Color", "Roughness"):
        tree.link(magic.outputs["Color"], diffuse.inputs[name])
    surface, _, warnings = tree.export()
    assert len(warnings) == 1 and "Magic Texture" in warnings[0], warnings
    _close(surface["color"], 0.5)
    # Two images that are looked up differently are multiplied where they are looked up.
    first, second = tree.node("TexImage"), tree.node("TexImage")
    first.image = builders.image("First", np.full((2, 2, 4), (0.2, 0.4, 0.6, 1)), "Non-Color")
    second.image = builders.image("Second", np.full((2, 2, 4), (0.8, 0.8, 0.8, 1)), "Non-Color")
    second.extension = "CLIP"
    mix = tree.node("MixRGB", Fac=1.0)
    mix.blend_type = "MULTIPLY"
    tree.link(first.outputs[0], mix.inputs[1])
    tree.link(second.outputs[0], mix.inputs[2])
    tree.link(mix.outputs[0], diffuse.inputs["Color"])
    tree.tree.links.remove(diffuse.inputs["Roughness"].links[0])
    surface, scene, warnings = tree.export()
    assert not warnings, warnings
    product = scene.textures[surface["color"]["texture"]][1]
    np.testing.assert_allclose(product["coefficients"], [[0] * 3] * 3 + [[1] * 3], atol=1e-6)
    names = [scene.textures[of["texture"]][0] for of in product["of"]]
    assert names == ["First", "Second"], names


def case_missing_images_are_magenta() -> None:
    tree = Tree()
    node, _, _ = _textured(tree)
    node.image = None
    surface, _, warnings = tree.export()
    _close(surface["color"], (1, 0, 1))
    assert len(warnings) == 1
    lost = builders.OUTPUT / "nowhere.png"
    lost.write_bytes(b"not a picture")
    node.image = bpy.data.images.load(str(lost))
    lost.unlink()
    surface, scene, warnings = tree.export()
    assert len(warnings) == 1 and "nowhere.png" in warnings[0], warnings
    _close(scene.images[-1]["pixels"].ravel(), (1, 0, 1))


def case_outputs() -> None:
    tree = Tree()
    # Nothing plugged in: black.
    _close(tree.export()[0]["color"], 0.0)
    # A colour straight into the surface glows.
    rgb = tree.node("RGB")
    rgb.outputs[0].default_value = (0.1, 0.2, 0.3, 1)
    tree.surface(rgb)
    surface, _, _ = tree.export()
    assert surface["type"] == "emission"
    _close(surface["color"], (0.1, 0.2, 0.3))
    # An output for EEVEE alone is not ours.
    tree.output.target = "EEVEE"
    _close(tree.export()[0]["color"], 0.0)


def case_volumes_are_named() -> None:
    tree = Tree()
    volume = tree.node("VolumeScatter")
    tree.link(volume.outputs[0], tree.output.inputs["Volume"])
    surface, _, warnings = tree.export()
    assert surface["type"] == "transparent"
    assert len(warnings) == 1 and "Volume Scatter" in warnings[0], warnings


def case_displacement() -> None:
    tree = Tree()
    shader, cover = tree.node("BsdfPrincipled"), tree.node("BsdfDiffuse")
    both = tree.surface(tree.node("AddShader"))
    tree.link(shader.outputs[0], both.inputs[0])
    tree.link(cover.outputs[0], both.inputs[1])
    raised = tree.node("Displacement", Midlevel=0.25, Scale=0.5)
    tree.link(raised.outputs[0], tree.output.inputs["Displacement"])
    image = tree.node("TexImage")
    pixels = np.full((2, 2, 4), 0.75, np.float32)
    image.image = builders.image("Heights", pixels, "Non-Color", is_float=True)

    def exported(method: str) -> tuple[dict, dict | None, Any]:
        tree.material.displacement_method = method
        scene, warnings = builders.export()
        assert not warnings, (method, warnings)
        data = scene.materials[0][1]
        return data["surface"], data.get("displacement"), scene

    for method in ("BUMP", "BOTH", "DISPLACEMENT"):
        # The same everywhere, it shows only if the surface is moved.
        raised.inputs["Height"].default_value = 0.75
        surface, displacement, _ = exported(method)
        assert "normal" not in surface["a"]
        if method != "BUMP":
            _close(displacement["height"], 0.25)
        assert (method == "BUMP") == (displacement is None)
        tree.link(image.outputs["Color"], raised.inputs["Height"])
        surface, displacement, scene = exported(method)
        for part, key in (("a", "normal"), ("a", "coat_normal"), ("b", "normal")):
            assert (key in surface[part]) == (method != "DISPLACEMENT")
        for found in (displacement, surface["b"].get("normal")):
            if found:
                assert found["space"] == "object"
                texture = scene.textures[found["height"]["texture"]][1]
                _close(scene.images[texture["image"]]["pixels"][0, 0, 0], 0.25)
        tree.tree.links.remove(raised.inputs["Height"].links[0])
    tree.link(image.outputs["Color"], raised.inputs["Height"])
    tree.material.displacement_method = "BUMP"
    # Colours by the height that it is raised to are those from before.
    tree.material.displacement_method = "DISPLACEMENT"
    place, ramp = tree.node("TexCoord"), tree.node("SeparateXYZ")
    tree.link(place.outputs["Object"], ramp.inputs[0])
    tree.link(ramp.outputs["Z"], cover.inputs["Color"])
    _, warnings = builders.export()
    assert len(warnings) == 1 and "before its displacement" in warnings[0], warnings
    tree.tree.links.remove(cover.inputs["Color"].links[0])
    tree.material.displacement_method = "BUMP"
    # A bump map is raised over it, a normal map takes its place.
    bump, waves = tree.node("Bump"), tree.node("TexWave")
    tree.link(waves.outputs[0], bump.inputs["Height"])
    tree.link(bump.outputs[0], cover.inputs["Normal"])
    flat = tree.node("NormalMap")
    tree.link(image.outputs["Color"], flat.inputs["Color"])
    tree.link(flat.outputs[0], shader.inputs["Normal"])
    raised.space = "WORLD"
    surface, _, _ = tree.export()
    assert surface["b"]["normal"]["normal"]["space"] == "world"
    assert "height" not in surface["a"]["normal"] and "height" in surface["a"]["coat_normal"]
    vector = tree.node("VectorDisplacement")
    tree.link(vector.outputs[0], tree.output.inputs["Displacement"])
    assert any("by a vector" in text for text in tree.export()[2])


def case_insides_absorb() -> None:
    tree = Tree()
    volume = tree.output.inputs["Volume"]
    plain = tree.node("VolumeAbsorption", Color=(0.9, 0.5, 1.5, 1), Density=2.0)
    tree.link(plain.outputs[0], volume)

    def found() -> tuple[list[float], list[str]]:
        scene, warnings = builders.export()
        return scene.materials[0][1].get("absorption", [0.0] * 3), warnings

    coefficient, warnings = found()
    _close(coefficient, (0.2, 1.0, 0.0))
    assert not warnings, warnings
    # Half of it, and half of a principled one that also scatters.
    mix = tree.node("MixShader", Fac=0.5)
    fog = tree.node("VolumePrincipled", Density=4.0, Color=(0.5, 0, 0, 1))
    fog.inputs["Absorption Color"].default_value = (0.25, 0.25, 1, 1)
    for shader, entry in ((plain, mix.inputs[1]), (fog, mix.inputs[2]), (mix, volume)):
        tree.link(shader.outputs[0], entry)
    coefficient, warnings = found()
    _close(coefficient, (0.1 + 0.5, 0.5 + 1.0, 0.0))
    assert len(warnings) == 1 and "scattering of volumes" in warnings[0], warnings
    # Noise in the density is averaged, and said to be.
    noise = tree.node("TexNoise")
    tree.link(noise.outputs[0], plain.inputs["Density"])
    tree.link(plain.outputs[0], volume)
    coefficient, warnings = found()
    assert coefficient[1] > 0.0 and len(warnings) == 1, (coefficient, warnings)


def case_pass_index_and_material_without_nodes() -> None:
    tree = Tree()
    tree.material.pass_index = 12
    scene, _ = builders.export()
    assert scene.materials[0][1]["pass_index"] == 12
    if bpy.app.version < (5, 0, 0):
        tree.material.use_nodes = False
        tree.material.diffuse_color = (0.2, 0.3, 0.4, 1)
        surface, _, _ = tree.export()
        assert surface["type"] == "diffuse"
        _close(surface["color"], (0.2, 0.3, 0.4))
