"""Nodes: shared branches, textures and their places, curves, and values that make no sense."""

from __future__ import annotations

import bpy
import numpy as np

import builders
from cases.materials import Tree, _close


def case_branches_that_are_shared_are_translated_once() -> None:
    """Forty mixes of a shader with itself are that shader."""
    tree = Tree()
    source = tree.node("BsdfDiffuse", Color=(0.1, 0.2, 0.3, 1))
    for _ in range(40):
        mix = tree.node("MixShader")
        tree.link(source.outputs[0], mix.inputs[1])
        tree.link(source.outputs[0], mix.inputs[2])
        source = mix
    tree.surface(source)
    surface, _, warnings = tree.export()
    assert surface["type"] == "diffuse" and not warnings
    _close(surface["color"], (0.1, 0.2, 0.3))


def case_surfaces_that_double_with_every_node_end() -> None:
    tree = Tree()
    glow = tree.node("Emission")
    source = tree.node("BsdfDiffuse")
    for _ in range(30):
        add, mix = tree.node("AddShader"), tree.node("MixShader")
        tree.link(source.outputs[0], add.inputs[0])
        tree.link(glow.outputs[0], add.inputs[1])
        tree.link(source.outputs[0], mix.inputs[1])
        tree.link(add.outputs[0], mix.inputs[2])
        source = mix
    tree.surface(source)

    def count(closure: dict) -> int:
        if closure["type"] not in {"mix", "add"}:
            return 1
        return count(closure["a"]) + count(closure["b"])

    surface, _, warnings = tree.export()
    assert 100 < count(surface) <= 256
    assert any("more than 256 shaders" in text for text in warnings), warnings


def case_channels_of_data_are_not_multiplied_by_alpha() -> None:
    pixels = np.full((2, 2, 4), 0.5, np.float32)
    pixels[0, :, 3] = 0.0
    pixels[1, :, 3] = 0.25
    for is_float in (False, True):
        for alpha_used in (False, True):
            tree = Tree()
            image = tree.node("TexImage")
            image.image = builders.image("Data", pixels, "Non-Color", is_float=is_float)
            shader = tree.surface(tree.node("BsdfPrincipled"))
            tree.link(image.outputs["Color"], shader.inputs["Base Color"])
            if alpha_used:
                tree.link(image.outputs["Alpha"], shader.inputs["Alpha"])
            _, scene, _ = tree.export()
            found = scene.images[0]["pixels"][..., :3]
            np.testing.assert_allclose(found, 0.5 if is_float else 128)
            bpy.data.objects.remove(tree.item)
            bpy.data.materials.remove(tree.material)


def _lookup(tree: Tree, node: bpy.types.Node) -> np.ndarray:
    """Where the corners of the unit square are looked up by an image behind `node`."""
    image = tree.node("TexImage")
    image.image = builders.image("Picture", np.ones((2, 2, 4), np.float32))
    shader = tree.surface(tree.node("BsdfDiffuse"))
    tree.link(image.outputs["Color"], shader.inputs["Color"])
    tree.link(node.outputs[0], image.inputs["Vector"])
    surface, scene, warnings = tree.export()
    assert not warnings, warnings
    matrix = np.array(scene.textures[surface["color"]["texture"]][1]["transform"]).reshape(2, 3)
    corners = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1]])
    return corners @ matrix.T


def case_coordinates_from_nothing_are_constant() -> None:
    tree = Tree()
    mapping = tree.node("Mapping", Location=(0.25, 0.5, 0), Scale=(3, 3, 3))
    _close(_lookup(tree, mapping), [(0.25, 0.5)] * 3)
    maths = tree.node("VectorMath")
    maths.inputs[0].default_value, maths.inputs[1].default_value = (0.25, 0.5, 0), (0.5, 0.25, 0)
    _close(_lookup(tree, maths), [(0.75, 0.75)] * 3)
    # What only passes on nothing is as if it were not there.
    _close(_lookup(tree, tree.tree.nodes.new("NodeReroute")), [(0, 0), (1, 0), (0, 1)])
    muted = tree.node("Mapping", Scale=(3, 3, 3))
    muted.mute = True
    _close(_lookup(tree, muted), [(0, 0), (1, 0), (0, 1)])
    # The input of a group has a value of its own.
    group = bpy.data.node_groups.new("Passage", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketVector")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketVector")
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    group.links.new(start.outputs[0], end.inputs[0])
    passage = tree.node("Group")
    passage.node_tree = group
    passage.inputs[0].default_value = (0.5, 0.75, 0)
    _close(_lookup(tree, passage), [(0.5, 0.75)] * 3)


def case_negative_emission_is_named() -> None:
    tree = Tree()
    for kind, name in (("Emission", "Strength"), ("BsdfPrincipled", "Emission Strength")):
        node = tree.surface(tree.node(kind))
        for strength, named in ((-0.2, True), (2.0, False), (0.0, False)):
            node.inputs[name].default_value = strength
            _, _, warnings = tree.export()
            assert any("negative emission" in text for text in warnings) == named, warnings


def case_negative_texels_that_emit_are_named() -> None:
    tree = Tree()
    image, node = tree.node("TexImage"), tree.surface(tree.node("Emission"))
    tree.link(image.outputs["Color"], node.inputs["Color"])
    for least, strength, named in ((-1, 1, True), (-1, 0, False), (0, 1, False), (0, -1, True)):
        pixels = np.ones((2, 2, 4), np.float32)
        pixels[0, 0, 0] = least
        image.image = builders.image("Glow", pixels, "Non-Color", is_float=True)
        node.inputs["Strength"].default_value = strength
        _, _, warnings = tree.export()
        assert any("negative emission" in text for text in warnings) == named, (least, strength)


def case_numbers_that_are_not_finite_are_named() -> None:
    tree = Tree()
    node = tree.surface(tree.node("BsdfDiffuse"))
    node.inputs["Color"].default_value = (0.5, float("nan"), 0.5, 1)
    surface, _, warnings = tree.export()
    assert surface["color"] == [0.0, 0.0, 0.0]
    assert any("'Tested'" in text and "'Color'" in text for text in warnings), warnings


def case_single_scattering_is_told_from_multiple() -> None:
    tree = Tree()
    for kind in ("BsdfAnisotropic", "BsdfGlass", "BsdfPrincipled", "BsdfMetallic"):
        if not hasattr(bpy.types, f"ShaderNode{kind}"):
            continue
        node = tree.surface(tree.node(kind))
        for distribution, loses in (("GGX", True), ("MULTI_GGX", False)):
            node.distribution = distribution
            surface, _, warnings = tree.export()
            assert (surface.get("multiscatter") is False) == loses and not warnings


def case_checkers_in_space_are_named() -> None:
    tree = Tree()
    shader = tree.surface(tree.node("BsdfDiffuse"))
    checker = tree.node("TexChecker", Scale=2.0)
    tree.link(checker.outputs["Color"], shader.inputs["Color"])
    for data, named in ((builders.quad("Level", 1.0), False), (builders.cube("Cube"), True)):
        data.materials.append(tree.material)
        placed = builders.link(data)
        _, warnings = builders.export()
        bpy.data.objects.remove(placed)
        assert any(f"'{data.name}': a checker in space" in text for text in warnings) == named


def case_patterns_without_a_counterpart_are_named() -> None:
    tree = Tree()
    for kind, properties, inputs in (
        ("TexGradient", {"gradient_type": "RADIAL"}, {}),
        ("TexBrick", {}, {"Brick Width": 0.0}),
        ("TexNoise", {"noise_dimensions": "4D"}, {}),
        ("TexVoronoi", {"voronoi_dimensions": "4D"}, {}),
        ("TexVoronoi", {"feature": "DISTANCE_TO_EDGE"}, {"Detail": 1.0}),
        ("TexMagic", {}, {}),
    ):
        shader = tree.surface(tree.node("BsdfDiffuse"))
        texture = tree.node(kind)
        for key, value in inputs.items():
            texture.inputs[key].default_value = value
        for key, value in properties.items():
            setattr(texture, key, value)
        tree.link(next(o for o in texture.outputs if o.enabled), shader.inputs["Color"])
        warnings = tree.export()[2]
        assert any(f"'{texture.name}'" in text for text in warnings), (kind, properties, warnings)


def case_projections_go_to_the_meshes_that_ask_for_them() -> None:
    tree = Tree()
    shader = tree.surface(tree.node("BsdfDiffuse"))
    checker, place = tree.node("TexChecker"), tree.node("TexCoord")
    tree.link(place.outputs["Object"], checker.inputs["Vector"])
    tree.link(checker.outputs["Fac"], shader.inputs["Roughness"])
    for name, material in (("Asks", tree.material), ("Plain", None)):
        data = builders.quad(name, 1.0)
        data.materials.append(material)
        builders.link(data)
    scene, _ = builders.export()
    names = {mesh["name"]: [a.name for a in mesh["attributes"]] for mesh in scene.meshes}
    assert any("object" in name for name in names["Asks"]), names
    assert not any("object" in name for name in names["Plain"]), names


def case_opaque_shadows_are_named() -> None:
    tree = Tree()
    tree.material.use_transparent_shadow = False
    tree.surface(tree.node("BsdfDiffuse"))
    assert not tree.export()[2]
    tree.surface(tree.node("BsdfPrincipled", Alpha=0.5))
    assert any("opaque shadows" in text for text in tree.export()[2])


def case_curves() -> None:
    tree = Tree()
    shader = tree.surface(tree.node("BsdfDiffuse"))
    curves = tree.node("RGBCurve", Fac=0.5, Color=(0.5, 0.25, 1.5, 1))
    # The combined curve halves, the red one inverts.
    curves.mapping.curves[3].points[1].location = (1, 0.5)
    curves.mapping.curves[0].points[0].location = (0, 1)
    curves.mapping.curves[0].points[1].location = (1, 0)
    tree.link(curves.outputs[0], shader.inputs["Color"])
    curved = np.array((0.75, 0.125, 0.75))
    surface, _, warnings = tree.export()
    np.testing.assert_allclose(
        surface["color"], (curved + np.array((0.5, 0.25, 1.5))) / 2, atol=2e-3
    )
    curves.mapping.extend = "HORIZONTAL"
    surface, _, _ = tree.export()
    np.testing.assert_allclose(surface["color"][2], (0.5 + 1.5) / 2, atol=2e-3)
    curve = tree.node("FloatCurve", Value=0.5)
    curve.mapping.curves[0].points[1].location = (1, 0.5)
    tree.link(curve.outputs[0], shader.inputs["Roughness"])
    surface, _, more = tree.export()
    np.testing.assert_allclose(surface["roughness"], 0.25, atol=2e-3)
    assert not warnings and not more


def case_the_hsl_model() -> None:
    from mathutils import Color

    rng = np.random.default_rng(2)
    tree = Tree()
    shader = tree.surface(tree.node("BsdfDiffuse"))
    separate, combine = tree.node("SeparateColor"), tree.node("CombineColor")
    for rgb in (*rng.uniform(size=(8, 3)), (0, 0, 0), (1, 1, 1), (0.5, 0.5, 0.5), (1, 0, 0)):
        separate.mode = "HSL"
        combine.mode = "RGB"
        separate.inputs[0].default_value = (*rgb, 1)
        for i in range(3):
            tree.link(separate.outputs[i], combine.inputs[i])
        tree.link(combine.outputs[0], shader.inputs["Color"])
        surface, _, warnings = tree.export()
        high, low = max(rgb), min(rgb)
        lightness = (high + low) / 2
        saturation = (high - low) / (1 - abs(2 * lightness - 1)) if high > low else 0.0
        wanted = (Color(rgb).h, saturation, lightness)
        np.testing.assert_allclose(surface["color"], wanted, rtol=1e-4, atol=1e-5)
        combine.mode = "HSL"
        _close(tree.export()[0]["color"], rgb)
        assert not warnings


def case_arithmetic_on_vertex_colours() -> None:
    tree = Tree()
    values = np.random.default_rng(3).uniform(size=(4, 4)).astype(np.float32)
    paint = tree.item.data.color_attributes.new("Paint", "FLOAT_COLOR", "POINT")
    paint.data.foreach_set("color", values.ravel())
    reader = tree.node("VertexColor")
    reader.layer_name = "Paint"
    tint = tree.node("MixRGB", Fac=0.5, Color2=(0.5, 0.25, 1, 1))
    tint.blend_type = "MULTIPLY"
    shader = tree.surface(tree.node("BsdfDiffuse"))
    tree.link(reader.outputs["Color"], tint.inputs["Color1"])
    tree.link(tint.outputs["Color"], shader.inputs["Color"])
    surface, scene, warnings = tree.export()
    assert not warnings, warnings
    name = scene.textures[surface["color"]["texture"]][1]["name"]
    found = {attribute.name: attribute for attribute in scene.meshes[0]["attributes"]}
    _close(found[name].data[:, :3], values[:, :3] * (0.75, 0.625, 1.0))
    # What is not the same before and after the interpolation is done after it, by a table.
    tint.blend_type = "DIVIDE"
    tint.inputs["Fac"].default_value = 1.0
    tint.use_clamp = True
    surface, scene, warnings = tree.export()
    assert not warnings, warnings
    table = scene.textures[surface["color"]["texture"]][1]
    row = scene.images[table["image"]]["pixels"][0, :, :3]
    at = np.linspace(*table["domain"][0], len(row))
    # but for the means around the entries
    wanted = np.minimum(at[:, None] / (0.5, 0.25, 1.0), 1.0)
    assert table["type"] == "table" and table["domain"] == [[0.0, 1.0]]
    np.testing.assert_allclose(row, wanted, atol=2e-3)
    assert scene.textures[table["of"][0]["texture"]][1]["name"] == "Paint"


def _noises(tree: Tree, count: int) -> list[bpy.types.Node]:
    noises = [tree.node("TexNoise") for _ in range(count)]
    for number, noise in enumerate(noises):
        noise.inputs["Scale"].default_value = 1.0 + number
    return noises


def case_functions_of_several_textures() -> None:
    """What is linear in each is a sum of products, what is not a table, also in such sums."""
    for blend, kinds in (
        ("MIX", ["multilinear"]),
        ("SCREEN", ["multilinear"]),
        ("DIFFERENCE", ["multilinear", "table"]),
        ("COLOR", None),
    ):
        tree = Tree()
        mix = tree.node("MixRGB")
        mix.blend_type = blend
        for noise, entry in zip(_noises(tree, 3), mix.inputs, strict=True):
            tree.link(noise.outputs["Color" if kinds is None else "Fac"], entry)
        shader = tree.surface(tree.node("BsdfDiffuse"))
        tree.link(mix.outputs[0], shader.inputs["Color"])
        surface, scene, warnings = tree.export()
        made = {data["type"] for _, data in scene.textures}
        if kinds is None:
            # Hues are no matter of single components.
            assert any("several textures" in text for text in warnings), warnings
            continue
        assert not warnings and made == {"noise", *kinds}, (blend, made, warnings)
        assert scene.textures[surface["color"]["texture"]][1]["type"] == "multilinear"
        bpy.data.objects.remove(tree.item)
        bpy.data.materials.remove(tree.material)


def case_mixes_of_too_many_textures_are_named() -> None:
    tree = Tree()
    shader = tree.surface(tree.node("BsdfDiffuse"))
    noises = _noises(tree, 10)
    # Each doubles what is looked up.
    source = noises[0]
    for noise in noises[1:]:
        product, mix = tree.node("Math"), tree.node("Math")
        product.operation, mix.operation = "MULTIPLY", "MULTIPLY_ADD"
        tree.link(source.outputs[0], product.inputs[0])
        tree.link(noise.outputs[0], product.inputs[1])
        for entry, node in zip(mix.inputs, (source, product, product), strict=True):
            tree.link(node.outputs[0], entry)
        source = mix
    tree.link(source.outputs[0], shader.inputs["Roughness"])
    _, _, warnings = tree.export()
    assert any("a mix of" in text and "averages are used" in text for text in warnings), warnings
    # Five at once are named as well.
    spread = tree.node("MapRange")
    for noise, entry in zip(noises, list(spread.inputs)[:5], strict=False):
        tree.link(noise.outputs[0], entry)
    tree.link(spread.outputs[0], shader.inputs["Roughness"])
    assert any("5 textures at once" in text for text in tree.export()[2])


def case_functions_that_no_table_holds_are_named() -> None:
    """Steeper and finer than the entries of a table, and beyond single precision."""
    for operation, factor in (("FRACT", 5000.0), ("EXPONENT", 90.0)):
        tree = Tree()
        place, parts = tree.node("TexCoord"), tree.node("SeparateXYZ")
        scale, steep = tree.node("Math"), tree.node("Math")
        scale.operation, steep.operation = "MULTIPLY", operation
        scale.inputs[1].default_value = factor
        tree.link(place.outputs["Object"], parts.inputs[0])
        tree.link(parts.outputs["Z"], scale.inputs[0])
        tree.link(scale.outputs[0], steep.inputs[0])
        shader = tree.surface(tree.node("BsdfDiffuse"))
        tree.link(steep.outputs[0], shader.inputs["Roughness"])
        _, _, warnings = tree.export()
        assert any("averages are used" in text for text in warnings), (operation, warnings)
        bpy.data.objects.remove(tree.item)
        bpy.data.materials.remove(tree.material)


def case_clamps_of_coordinates_and_attributes_hold_beyond_one() -> None:
    """A clamp does nothing between 0 and 1, where coordinates are not."""
    for source, output in (("TexCoord", "Object"), ("Attribute", "Vector")):
        tree = Tree()
        place, parts, clamp = tree.node(source), tree.node("SeparateXYZ"), tree.node("Clamp")
        if source == "Attribute":
            place.attribute_name = "Far"
            tree.item.data.attributes.new("Far", "FLOAT_VECTOR", "POINT")
        tree.link(place.outputs[output], parts.inputs[0])
        tree.link(parts.outputs["Z"], clamp.inputs["Value"])
        shader = tree.surface(tree.node("BsdfDiffuse"))
        tree.link(clamp.outputs[0], shader.inputs["Roughness"])
        surface, scene, warnings = tree.export()
        texture = scene.textures[surface["roughness"]["texture"]][1]
        assert not warnings and texture["type"] == "table", (source, texture, warnings)
        bpy.data.objects.remove(tree.item)
        bpy.data.materials.remove(tree.material)
