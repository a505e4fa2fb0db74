"""Worlds: colour, strength, environment maps and their mapping."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

import builders


def _dome() -> tuple[dict | None, object, list[str]]:
    scene, warnings = builders.export()
    domes = [data for _, data in scene.lights if data["type"] == "dome"]
    return (domes[0] if domes else None), scene, warnings


def case_no_world_and_black_world() -> None:
    bpy.context.scene.world = None
    assert _dome()[0] is None
    _, _, node = builders.world()
    node.inputs["Strength"].default_value = 0.0
    assert _dome()[0] is None


def case_colour_and_strength() -> None:
    _, _, node = builders.world()
    node.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1)
    node.inputs["Strength"].default_value = 2.0
    dome, _, warnings = _dome()
    np.testing.assert_allclose(dome["radiance"], (0.2, 0.4, 0.8), rtol=1e-6)
    assert "image" not in dome and dome["camera_visible"] and not warnings


def case_world_without_nodes() -> None:
    if bpy.app.version >= (5, 0, 0):
        return
    world = bpy.data.worlds.new("Plain")
    world.color = (0.25, 0.5, 1.0)
    bpy.context.scene.world = world
    assert _dome()[0]["radiance"] == [0.25, 0.5, 1.0]


def case_sky_switched_off_in_the_view_layer() -> None:
    builders.world()
    bpy.context.view_layer.use_sky = False
    assert _dome()[0] is None


def _environment(rotation: tuple, scale: tuple = (1, 1, 1), kind: str = "POINT") -> np.ndarray:
    """A float picture whose texel (row, column) is unique, behind a Mapping node."""
    pixels = np.ones((4, 8, 4), np.float32)
    pixels[..., 0], pixels[..., 1] = np.arange(8)[None, :], np.arange(4)[:, None]
    _, tree, background = builders.world()
    image = tree.nodes.new("ShaderNodeTexEnvironment")
    image.image = builders.image("Sky", pixels, "Non-Color", is_float=True)
    place, mapping = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
    mapping.vector_type = kind
    mapping.inputs["Rotation"].default_value = rotation
    mapping.inputs["Scale"].default_value = scale
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], image.inputs["Vector"])
    tree.links.new(image.outputs["Color"], background.inputs["Color"])
    return pixels


def _blender_coordinates(direction: np.ndarray) -> np.ndarray:
    """Where Blender looks a direction up in an equirectangular picture."""
    x, y, z = direction
    return np.array([0.5 - np.arctan2(y, x) / (2 * np.pi), np.arcsin(z) / np.pi + 0.5])


def _segue_coordinates(direction: np.ndarray) -> np.ndarray:
    """The same for the ABI's dome: +Y on top, +Z in the centre, +X a quarter to its left."""
    x, y, z = direction
    return np.array([0.5 - np.arctan2(x, z) / (2 * np.pi), np.arcsin(y) / np.pi + 0.5])


def case_environment_maps_point_where_blenders_do() -> None:
    rng = np.random.default_rng(1)
    for kind in ("POINT", "TEXTURE", "VECTOR"):
        for rotation, scale in (
            ((0, 0, 0), (1, 1, 1)),
            ((0, 0, 1.2), (1, 1, 1)),
            ((0.3, -0.8, 2.0), (1, 1, 1)),
            ((0, 0, 0.5), (-1, 1, 1)),
        ):
            pixels = _environment(rotation, scale, kind)
            dome, scene, warnings = _dome()
            assert not warnings, warnings
            np.testing.assert_allclose(scene.images[dome["image"]]["pixels"], pixels[..., :3])
            pose = np.array(dome["transform"]).reshape(4, 4)[:3, :3]
            matrix = np.array(Euler(rotation).to_matrix()) @ np.diag(scale)
            if kind == "TEXTURE":
                matrix = np.linalg.inv(matrix)
            for direction in rng.normal(size=(20, 3)):
                direction /= np.linalg.norm(direction)
                wanted = _blender_coordinates(matrix @ direction)
                found = _segue_coordinates(np.linalg.inv(pose) @ direction)
                np.testing.assert_allclose(found, wanted, atol=1e-5, err_msg=f"{kind} {rotation}")


def case_stretched_environment() -> None:
    """No dome can be stretched: Cycles makes a picture of it, if it has the image."""
    pixels = _environment((0, 0, 0), (1, 2, 1))
    dome, scene, warnings = _dome()
    assert any("'Sky' has changes that are not saved" in text for text in warnings), warnings
    assert any("stretches" in text for text in warnings)
    assert scene.images[dome["image"]]["pixels"].shape == pixels[..., :3].shape
    bpy.data.images["Sky"].pack()
    tree = bpy.context.scene.world.node_tree
    image = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeTexEnvironment")
    image.interpolation = "Closest"
    dome, scene, warnings = _dome()
    assert not warnings, warnings
    found = scene.images[dome["image"]]["pixels"]
    assert found.shape == (1024, 2048, 3)
    # Where the vector (x, 2 y, z) points to in the picture.
    for x, y, z in ((1.0, 0.3, 0.2), (-1.0, 0.7, -0.4), (0.1, -0.6, 0.5)):
        u, v = _blender_coordinates(np.array([x, y, z]) / np.linalg.norm([x, y, z]))
        direction = np.array([x, 2.0 * y, z])
        s, t = _blender_coordinates(direction / np.linalg.norm(direction))
        wanted = pixels[::-1][int(t * 4), int(s * 8), :2]
        got = found[::-1][int(v * 1024), int(u * 2048), :2]
        np.testing.assert_allclose(got, wanted, atol=1e-4)


def case_strength_of_an_image() -> None:
    pixels = _environment((0, 0, 0))
    background = next(
        n for n in bpy.context.scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground"
    )
    background.inputs["Strength"].default_value = 3.0
    dome, scene, _ = _dome()
    shown = np.array(dome["radiance"]) * scene.images[dome["image"]]["pixels"]
    np.testing.assert_allclose(shown, 3.0 * pixels[..., :3], rtol=1e-3)


def case_unsupported_worlds() -> None:
    _environment((0, 0, 0))
    tree = bpy.context.scene.world.node_tree
    node = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeTexEnvironment")
    node.projection = "MIRROR_BALL"
    dome, _, warnings = _dome()
    assert any("mirror ball" in text for text in warnings), warnings
    # The average of the picture stands in.
    np.testing.assert_allclose(dome["radiance"], (3.5, 1.5, 1.0), rtol=1e-3)
    assert "image" not in dome
    bpy.data.images["Sky"].pack()
    dome, _, warnings = _dome()
    assert "image" in dome and not warnings, warnings


def case_skies_have_a_sun() -> None:
    """A picture of the sky, once, and its sun as a light; anew when its nodes change."""
    from blender_addon.export import panorama

    _, tree, background = builders.world()
    sky = tree.nodes.new("ShaderNodeTexSky")
    # So small that hardly a sample of the whole sky would meet it.
    sky.sun_elevation, sky.sun_rotation, sky.sun_size = 0.6, 1.0, 0.001
    background.inputs["Strength"].default_value = 0.1
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    made = []
    render = panorama._render

    def counted(*arguments: object) -> panorama.Panorama:
        made.append(arguments)
        return render(*arguments)

    panorama._render = counted
    (_, dome), (_, sun) = _dome()[1].lights
    assert dome["image"] is not None and sun["type"] == "distant"
    np.testing.assert_allclose(sun["angle"], 0.001, rtol=1e-6)
    towards = np.array(sun["transform"]).reshape(4, 4)[:3, 2]
    wanted = np.array([np.sin(1.0) * np.cos(0.6), np.cos(1.0) * np.cos(0.6), np.sin(0.6)])
    np.testing.assert_allclose(towards, wanted, atol=1e-3)
    red, _, blue = sun["irradiance"]
    assert red > blue > 0.0
    assert len(_dome()[1].lights) == 2 and len(made) == 1
    background.inputs["Strength"].default_value = 0.2
    (_, _), (_, brighter) = _dome()[1].lights
    np.testing.assert_allclose(brighter["irradiance"], 2.0 * np.array(sun["irradiance"]), rtol=0.01)
    # The whole sun shines as much, however large it is, but that Cycles rounds the solid angle of
    # the small one: by 5 %. Nor does it matter who sees it.
    sky.sun_size = 0.02
    bpy.context.scene.world.cycles_visibility.camera = False
    (_, dome), (_, larger) = _dome()[1].lights
    np.testing.assert_allclose(larger["irradiance"], brighter["irradiance"], rtol=0.06)
    assert not larger["camera_visible"] and not dome["camera_visible"]
    sky.sun_disc = False
    assert len(_dome()[1].lights) == 1 and len(made) == 4


def case_objects_turn_a_world() -> None:
    """Coordinates of an object: its place is that of the frame, and the picture is made anew."""
    _environment((0, 0, 0))
    bpy.data.images["Sky"].pack()
    nodes = bpy.context.scene.world.node_tree.nodes
    place = next(n for n in nodes if n.bl_idname == "ShaderNodeTexCoord")
    mapping = next(n for n in nodes if n.bl_idname == "ShaderNodeMapping")
    place.object = builders.link(None, "Compass")
    place.id_data.links.new(place.outputs["Object"], mapping.inputs["Vector"])
    shown = []
    for turn in (0.0, 0.5 * np.pi):
        place.object.rotation_euler.z = turn
        dome, scene, warnings = _dome()
        assert not warnings, warnings
        shown.append(scene.images[dome["image"]]["pixels"])
    # A quarter to the left, where +Y is; pixels at the edges of texels have samples of both.
    np.testing.assert_allclose(np.roll(shown[0], -512, axis=1), shown[1], atol=0.1)
    assert shown[0].std() > 0.5


def case_without_cycles_patterns_are_averaged() -> None:
    from blender_addon.export import panorama

    _, tree, background = builders.world()
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Color"], background.inputs["Color"])
    panorama._PROCESS = panorama._PROCESS.with_name("missing.py")
    dome, _, warnings = _dome()
    assert "image" not in dome
    assert any("Cycles could not make a picture" in text for text in warnings), warnings
    assert any("'Noise Texture'" in text for text in warnings), warnings


def case_camera_rays_may_see_another_background() -> None:
    """A mix by the Light Path node becomes two domes: one that shines, and a backdrop."""
    _, tree, background = builders.world()
    other, mix = tree.nodes.new("ShaderNodeBackground"), tree.nodes.new("ShaderNodeMixShader")
    path = tree.nodes.new("ShaderNodeLightPath")
    background.inputs["Color"].default_value = (1, 0, 0, 1)
    other.inputs["Color"].default_value = (0, 0, 1, 1)
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(background.outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs[0])
    _, scene, warnings = _dome()
    shining, backdrop = (data for _, data in scene.lights)
    assert (shining["radiance"], shining["camera_visible"]) == ([1.0, 0.0, 0.0], False)
    assert (backdrop["radiance"], backdrop["camera_only"]) == ([0.0, 0.0, 1.0], True)
    assert not warnings
    background.inputs["Strength"].default_value = 0.0
    assert [data["camera_only"] for _, data in _dome()[1].lights] == [True]
    tree.links.remove(mix.inputs[0].links[0])
    tree.links.new(path.outputs["Is Glossy Ray"], mix.inputs[0])
    assert any("Light Path" in text for text in _dome()[2])


def case_up_is_up() -> None:
    """The top row of a picture without mapping is the sky above."""
    _environment((0, 0, 0))
    dome, _, _ = _dome()
    pose = Matrix(np.array(dome["transform"]).reshape(4, 4).tolist())
    assert (pose.to_3x3() @ Vector((0, 1, 0)) - Vector((0, 0, 1))).length < 1e-6


def case_odd_strengths_are_clamped_and_named() -> None:
    _, _, node = builders.world()
    node.inputs["Color"].default_value = (0.5, 0.25, 0.0, 1)
    node.inputs["Strength"].default_value = -1.0
    dome, _, warnings = _dome()
    assert dome is None
    assert any("World 'World': negative light" in text for text in warnings), warnings
    node.inputs["Strength"].default_value = float("nan")
    dome, _, warnings = _dome()
    assert dome is None
    assert any("'Strength'" in text and "not finite" in text for text in warnings), warnings


def case_negative_texels_are_named() -> None:
    _environment((0, 0, 0))
    assert not _dome()[2]
    image = bpy.data.images["Sky"]
    image.pixels[0] = -1.0
    dome, _, warnings = _dome()
    assert "image" in dome
    assert any("negative light" in text for text in warnings), warnings


def case_colour_in_the_place_of_a_shader() -> None:
    _, tree, _ = builders.world()
    color = tree.nodes.new("ShaderNodeRGB")
    color.outputs[0].default_value = (0.25, 0.5, 0.75, 1)
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(color.outputs[0], output.inputs[0])
    dome, _, warnings = _dome()
    assert dome["radiance"] == [0.25, 0.5, 0.75] and not warnings, warnings


def case_mapping_of_nothing_is_a_constant_direction() -> None:
    pixels = _environment((0, 0, 0))
    tree = bpy.context.scene.world.node_tree
    nodes = {node.bl_idname: node for node in tree.nodes}
    mapping, image = nodes["ShaderNodeMapping"], nodes["ShaderNodeTexEnvironment"]
    tree.links.remove(mapping.inputs["Vector"].links[0])
    image.interpolation = "Closest"
    for direction in ((0, 0, 0), (1, 2, 0.5), (-1, -0.5, -3)):
        mapping.inputs["Location"].default_value = direction
        dome, _, warnings = _dome()
        length = np.linalg.norm(direction)
        u, v = _blender_coordinates(np.array(direction) / length) if length else (0.0, 0.0)
        wanted = pixels[::-1][int(v * 4), int(u * 8), :3]
        np.testing.assert_allclose(dome["radiance"], wanted, err_msg=str(direction))
        assert "image" not in dome and not warnings, warnings
    # Between four texels, across the edges of the picture: its mean columns and rows.
    image.interpolation = "Linear"
    mapping.inputs["Location"].default_value = (0, 0, 0)
    np.testing.assert_allclose(_dome()[0]["radiance"], (3.5, 1.5, 1.0))


def case_branches_that_are_shared_are_read_once() -> None:
    """Forty mixes of a background with itself would be a billion backgrounds otherwise."""
    _, tree, background = builders.world()
    background.inputs["Color"].default_value = (0.5, 0.25, 0.125, 1)
    source = background.outputs[0]
    for _ in range(40):
        mix = tree.nodes.new("ShaderNodeMixShader")
        tree.links.new(source, mix.inputs[1])
        tree.links.new(source, mix.inputs[2])
        source = mix.outputs[0]
    output = next(n for n in tree.nodes if n.bl_idname == "ShaderNodeOutputWorld")
    tree.links.new(source, output.inputs[0])
    np.testing.assert_allclose(_dome()[0]["radiance"], (0.5, 0.25, 0.125))


def case_rays_that_should_not_see_the_world_are_named() -> None:
    data, _, _ = builders.world()
    data.cycles_visibility.diffuse = data.cycles_visibility.scatter = False
    data.cycles.max_bounces = 4
    _, _, warnings = _dome()
    assert any("'World'" in text and "diffuse, volume scatter" in text for text in warnings)
    assert any("'World'" in text and "bounces" in text for text in warnings), warnings


def case_the_background_in_the_emission_pass_is_named() -> None:
    builders.world()
    layer = bpy.context.view_layer
    assert not _dome()[2]
    layer.use_pass_emit = True
    assert any("Emission pass" in text for text in _dome()[2])
    bpy.context.scene.render.film_transparent = True
    assert not _dome()[2]
