"""Lights: power, shape, direction, nodes."""

from __future__ import annotations

import math

import bpy
import numpy as np
from mathutils import Euler, Matrix

import builders

POSE = Matrix.Translation((1, 2, 3)) @ Euler((0.3, 0.5, 0.7)).to_matrix().to_4x4()


def _only(kind: str, matrix: Matrix = POSE, **properties: object) -> tuple[dict, list[str]]:
    item = builders.light(kind, matrix, **properties)
    scene, warnings = builders.export()
    bpy.data.objects.remove(item)
    ((_, data),) = scene.lights
    return data, warnings


def _pose(data: dict) -> np.ndarray:
    return np.array(data["transform"]).reshape(4, 4)


def case_point_with_radius() -> None:
    data, warnings = _only("POINT", energy=100.0, color=(1, 0.5, 0.25), shadow_soft_size=0.5)
    assert data["type"] == "sphere" and data["radius"] == 0.5 and not warnings
    radiance = 100.0 / (4.0 * math.pi**2 * 0.25)
    np.testing.assert_allclose(data["radiance"], [radiance, radiance / 2, radiance / 4], rtol=1e-6)
    np.testing.assert_allclose(_pose(data), np.array(POSE), atol=1e-6)
    assert data["camera_visible"] is False, "Blender hides new lights from the camera"


def case_point_without_radius() -> None:
    data, _ = _only("POINT", energy=100.0, shadow_soft_size=0.0)
    assert data["type"] == "point"
    np.testing.assert_allclose(data["intensity"], 100.0 / (4.0 * math.pi), rtol=1e-6)


def case_spot() -> None:
    data, _ = _only("SPOT", energy=50.0, shadow_soft_size=0.0, spot_size=1.2, spot_blend=0.4)
    np.testing.assert_allclose(data["intensity"], 50.0 / (4.0 * math.pi), rtol=1e-6)
    np.testing.assert_allclose(
        [data["shaping"]["spot_size"], data["shaping"]["spot_blend"]], [1.2, 0.4], rtol=1e-6
    )


def case_sun() -> None:
    data, _ = _only("SUN", energy=3.0, angle=0.2)
    assert data["type"] == "distant"
    np.testing.assert_allclose(data["irradiance"], 3.0)
    np.testing.assert_allclose(data["angle"], 0.2, rtol=1e-6)


def case_area_shapes() -> None:
    stretched = POSE @ Matrix.Diagonal((2, 3, 1, 1))
    for shape, sizes, area in (
        ("SQUARE", (2.0, 3.0), 6.0),
        ("RECTANGLE", (2.0, 1.5), 3.0),
        ("DISK", (2.0, 3.0), 6.0 * math.pi / 4),
        ("ELLIPSE", (2.0, 1.5), 3.0 * math.pi / 4),
    ):
        data, _ = _only("AREA", stretched, energy=10.0, shape=shape, size=1.0, size_y=0.5)
        np.testing.assert_allclose(data["radiance"], 10.0 / (math.pi * area), rtol=1e-6)
        axes = np.linalg.norm(_pose(data)[:3, :3], axis=0)
        if shape in {"SQUARE", "RECTANGLE"}:
            np.testing.assert_allclose((data["width"], data["height"]), sizes, rtol=1e-6)
            np.testing.assert_allclose(axes, 1.0, rtol=1e-6)
        else:
            np.testing.assert_allclose(axes[:2] * 2.0 * data["radius"], sizes, rtol=1e-6)
        assert "shaping" not in data


def case_area_spread_and_no_area() -> None:
    data, _ = _only("AREA", energy=10.0, size=1.0, spread=1.0)
    np.testing.assert_allclose(data["shaping"]["spread"], 1.0, rtol=1e-6)
    builders.light("AREA", energy=10.0, size=0.0)
    scene, warnings = builders.export()
    assert not scene.lights and any("without area" in text for text in warnings)


def case_scale_and_mirror_do_not_change_power() -> None:
    matrix = POSE @ Matrix.Diagonal((-3, 3, 3, 1))
    data, _ = _only("POINT", matrix, energy=100.0, shadow_soft_size=0.5)
    np.testing.assert_allclose(data["radiance"], 100.0 / math.pi**2, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(_pose(data)[:3, :3], axis=0), 1.0, rtol=1e-6)


def case_exposure_temperature_and_normalize() -> None:
    data = bpy.data.lights.new("Probe", "POINT")
    if not hasattr(data, "exposure"):
        return
    energy = {"energy": 10.0}
    found, _ = _only("POINT", shadow_soft_size=0.0, exposure=2.0, **energy)
    np.testing.assert_allclose(found["intensity"], 40.0 / (4.0 * math.pi), rtol=1e-6)
    found, _ = _only("SUN", use_temperature=True, temperature=3000.0, **energy)
    data.use_temperature, data.temperature = True, 3000.0
    np.testing.assert_allclose(
        found["irradiance"], 10.0 * np.array(data.temperature_color), rtol=1e-5
    )
    for kind, key, properties, wanted in (
        ("POINT", "radiance", {"shadow_soft_size": 0.5}, 10.0 / math.pi),
        ("POINT", "intensity", {"shadow_soft_size": 0.0}, 10.0 / math.pi),
        ("AREA", "radiance", {"size": 0.5}, 10.0 / math.pi),
        ("SUN", "radiance", {"angle": 0.5}, 10.0),
        ("SUN", "irradiance", {"angle": 0.0}, 10.0),
    ):
        found, _ = _only(kind, normalize=False, **energy, **properties)
        np.testing.assert_allclose(found[key], wanted, rtol=1e-6, err_msg=f"{kind} {properties}")


def case_nodes_of_a_light() -> None:
    item = builders.light("POINT", energy=10.0, shadow_soft_size=0.0)
    item.data.use_nodes = True
    tree = item.data.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputLight")
    emission = tree.nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (1, 0.5, 0, 1)
    emission.inputs["Strength"].default_value = 2.0
    tree.links.new(emission.outputs[0], output.inputs[0])
    scene, warnings = builders.export()
    intensity = 10.0 / (4.0 * math.pi)
    np.testing.assert_allclose(
        scene.lights[0][1]["intensity"], [2 * intensity, intensity, 0.0], rtol=1e-6
    )
    # A fall-off that no lamp has is named.
    falloff = tree.nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 3.0
    tree.links.new(falloff.outputs["Linear"], emission.inputs["Strength"])
    assert not warnings
    scene, warnings = builders.export()
    np.testing.assert_allclose(scene.lights[0][1]["intensity"][0], 3 * intensity, rtol=1e-6)
    assert any("falloff" in text for text in warnings)


def case_odd_lights_are_named() -> None:
    builders.light("POINT", name="Negative", energy=-5.0)
    shadowless = builders.light("SUN", name="Shadowless")
    shadowless.data.use_shadow = False
    scene, warnings = builders.export()
    assert {name for name, _ in scene.lights} == {"Negative", "Shadowless"}
    assert np.min(dict(scene.lights)["Negative"]["intensity"]) == 0.0
    assert any("Negative" in text for text in warnings)
    assert any("Shadowless" in text for text in warnings)


def case_instanced_lights() -> None:
    collection = bpy.data.collections.new("Lamps")
    collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
    for i in range(3):
        empty = builders.link(None, f"Copy {i}", Matrix.Translation((i, 0, 0)))
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    scene, _ = builders.export()
    assert sorted(_pose(data)[0, 3] for _, data in scene.lights) == [0.0, 1.0, 2.0]


def case_what_lights_ask_for_in_vain_is_named() -> None:
    stretched = Matrix.Diagonal((2, 1, 1, 1))
    builders.light("SPOT", stretched, name="Stretched", shadow_soft_size=0.1)
    builders.light("SPOT", Matrix.Scale(2, 4), name="Even", shadow_soft_size=0.1)
    builders.light("POINT", name="Balloon", shadow_soft_size=2.0)
    hard = builders.light("POINT", name="Hard", shadow_soft_size=2.0)
    hard.data.use_soft_falloff = False
    short = builders.light("SUN", name="Short")
    short.data.cycles.max_bounces = 3
    _, warnings = builders.export()
    for name, word in (("Stretched", "scale"), ("Balloon", "soft falloff"), ("Short", "bounces")):
        assert sum(f"'{name}'" in text and word in text for text in warnings) == 1, warnings
    assert len(warnings) == 3, warnings
