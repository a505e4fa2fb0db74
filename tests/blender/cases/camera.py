"""Cameras, against Blender's own projection matrices."""

from __future__ import annotations

import itertools
import math

import bpy
import numpy as np
from mathutils import Euler, Matrix

import builders


def _window_from_matrix(
    item: bpy.types.Object, width: int, height: int, aspect: tuple[float, float]
) -> list[float]:
    """The film's edges, read back from Blender's projection matrix."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    projection = np.array(
        item.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=aspect[0], scale_y=aspect[1])
    )
    # A perspective point on z = -1 lands at P00 x - P02; an orthographic one at P00 x + P03.
    column, sign = (3, -1.0) if item.data.type == "ORTHO" else (2, 1.0)
    x = [(edge + sign * projection[0, column]) / projection[0, 0] for edge in (-1.0, 1.0)]
    y = [(edge + sign * projection[1, column]) / projection[1, 1] for edge in (-1.0, 1.0)]
    return [*x, *y]


def case_windows_match_blenders_projection() -> None:
    item = builders.camera(Matrix.Translation((0, 0, 5)))
    data = item.data
    data.lens, data.sensor_width, data.sensor_height = 42.0, 30.0, 17.0
    data.ortho_scale = 5.0
    scene = builders.settings()
    import fake_segue

    cases = itertools.product(
        ("PERSP", "ORTHO"),
        ("AUTO", "HORIZONTAL", "VERTICAL"),
        ((64, 48), (48, 64)),
        ((1.0, 1.0), (2.0, 1.0), (1.0, 1.5)),
        ((0.0, 0.0), (0.2, -0.3)),
    )
    for kind, fit, (width, height), aspect, shift in cases:
        data.type, data.sensor_fit = kind, fit
        data.shift_x, data.shift_y = shift
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
        bpy.ops.render.render()
        name, found = fake_segue.SCENES[-1].camera
        wanted = _window_from_matrix(item, width, height, aspect)
        label = f"{kind} {fit} {width}x{height} {aspect} {shift}"
        np.testing.assert_allclose(found["window"], wanted, rtol=1e-4, atol=1e-5, err_msg=label)
        assert found["type"] == {"PERSP": "perspective", "ORTHO": "orthographic"}[kind]
        assert name == "Camera"


def case_pose_has_no_scale() -> None:
    rotation = Euler((1.0, 0.2, 0.7)).to_matrix().to_4x4()
    builders.camera(Matrix.Translation((1, 2, 3)) @ rotation @ Matrix.Diagonal((2, 3, 4, 1)))
    scene, _ = builders.export()
    pose = np.array(scene.camera[1]["transform"]).reshape(4, 4)
    np.testing.assert_allclose(pose[:3, :3], np.array(rotation)[:3, :3], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 3], (1, 2, 3), atol=1e-6)


def case_clipping() -> None:
    builders.camera(clip_start=0.25, clip_end=75.0)
    scene, _ = builders.export()
    assert (scene.camera[1]["near"], scene.camera[1]["far"]) == (0.25, 75.0)


def case_depth_of_field() -> None:
    item = builders.camera(Matrix.Translation((0, 0, 5)), lens=50.0)
    scene, _ = builders.export()
    assert "aperture_radius" not in scene.camera[1]
    dof = item.data.dof
    dof.use_dof = True
    dof.aperture_fstop = 2.0
    dof.focus_distance = 4.0
    dof.aperture_blades, dof.aperture_rotation, dof.aperture_ratio = 6, 0.5, 2.0
    scene, _ = builders.export()
    found = scene.camera[1]
    # 50 mm at f/2 has a diameter of 25 mm.
    assert math.isclose(found["aperture_radius"], 0.0125, rel_tol=1e-5)
    assert math.isclose(found["focus_distance"], 4.0)
    assert (found["blades"], found["aperture_ratio"]) == (6, 2.0)
    assert math.isclose(found["blade_rotation"], 0.5 + math.pi, rel_tol=1e-6)
    # An object in focus counts by its depth, not by its distance.
    dof.focus_object = builders.link(None, "Focus", Matrix.Translation((3, 0, -1)))
    scene, _ = builders.export()
    assert math.isclose(scene.camera[1]["focus_distance"], 6.0, rel_tol=1e-5)


def case_panorama_falls_back_with_a_warning() -> None:
    builders.camera(type="PANO")
    scene, warnings = builders.export()
    assert scene.camera[1]["type"] == "perspective"
    assert any("pano" in text for text in warnings), warnings


def case_stereo_has_a_camera_for_each_eye() -> None:
    builders.camera(Matrix.Translation((0, 0, 5)))
    scene = builders.settings()
    scene.render.use_multiview = True
    import fake_segue

    seen = []
    original = fake_segue.Scene.set_camera

    def record(self: fake_segue.Scene, name: str, data: dict) -> None:
        seen.append(data["transform"][3])
        original(self, name, data)

    fake_segue.Scene.set_camera = record
    bpy.ops.render.render()
    assert len(seen) == 2 and abs(seen[1] - seen[0] - 0.065) < 1e-5, seen


def case_an_empty_clipping_range_is_left_out() -> None:
    camera = builders.camera(Matrix.Translation((0, 0, 5)), clip_start=20.0, clip_end=10.0)
    scene, warnings = builders.export()
    data = scene.camera[1]
    assert data["near"] == 0.0 and data["far"] == 1e30
    assert any(f"'{camera.name}'" in text and "clipping" in text for text in warnings), warnings
