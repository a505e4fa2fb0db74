"""Cameras, render settings and the picture's size."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("pxr")

from segue import usd
from stages import LENS, LIGHT, QUAD, camera, load, reported, settings


def test_window_and_default_size():
    found, imported = camera(LENS)
    assert found["type"] == "perspective"
    assert found["window"] == pytest.approx([-0.4, 0.4, -0.2, 0.2])
    assert imported.resolution == (1280, 640)
    assert found["near"] == 0
    assert "far" not in found
    assert "aperture_radius" not in found


def test_aperture_offsets_shift_the_window():
    found, _ = camera(
        LENS + "float horizontalApertureOffset = 5\nfloat verticalApertureOffset = -2.5"
    )
    assert found["window"] == pytest.approx([-0.3, 0.5, -0.25, 0.15])


def test_depth_of_field_is_in_tenths_of_scene_units():
    found, _ = camera(LENS + "float fStop = 2\nfloat focusDistance = 30")
    assert found["aperture_radius"] == pytest.approx(50 * 0.1 / 2 / 2)
    assert found["focus_distance"] == 30


def test_no_focus_distance_no_blur():
    found, imported = camera(LENS + "float fStop = 2")
    assert "aperture_radius" not in found
    assert [p for p, _ in reported(imported, usd.Kind.WARNING)] == ["/Camera"]


def test_orthographic():
    found, _ = camera(
        LENS + 'token projection = "orthographic"\nfloat fStop = 2\nfloat focusDistance = 3'
    )
    assert found["type"] == "orthographic"
    assert found["window"] == pytest.approx([-2, 2, -1, 1])
    assert "aperture_radius" not in found


def test_clipping_range():
    found, _ = camera(LENS + "float2 clippingRange = (0.25, 40)")
    assert (found["near"], found["far"]) == (0.25, 40)
    found, _ = camera(LENS + "float2 clippingRange = (0.5, inf)")
    assert found["near"] == 0.5
    assert "far" not in found


def test_a_clipping_range_that_is_no_range():
    found, imported = camera(LENS + "float2 clippingRange = (nan, 40)")
    assert found["near"] == 0
    assert [p for p, _ in reported(imported, usd.Kind.WARNING)] == ["/Camera"]


@pytest.mark.parametrize("scale", ["(1, 0, 1)", "(nan, 1, 1)", "(1, 1, inf)"])
def test_a_camera_without_a_place_is_an_error_that_names_it(scale):
    with pytest.raises(usd.StageError, match=r"the camera /Camera is singular or not finite"):
        camera(
            LENS + f"double3 xformOp:scale = {scale}\n"
            'uniform token[] xformOpOrder = ["xformOp:scale"]'
        )


def test_transformation_without_scale():
    found, _ = camera(
        LENS + "double3 xformOp:translate = (1, 2, 3)\nfloat xformOp:rotateY = 90\n"
        "double3 xformOp:scale = (7, 7, 7)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY", "xformOp:scale"]'
    )
    expected = [[0, 0, 1, 1], [0, 1, 0, 2], [-1, 0, 0, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(np.reshape(found["transform"], (4, 4)), expected, atol=1e-12)


def test_the_lens_does_not_change_with_the_units():
    a, _ = camera(LENS, header="metersPerUnit = 1")
    b, _ = camera(LENS, header="metersPerUnit = 0.01")
    assert a == b


@pytest.mark.parametrize(
    ("policy", "width", "height", "window"),
    [
        # The camera's own aspect ratio is 2; half extents 0.4 x 0.2.
        ("expandAperture", 400, 100, (0.8, 0.2)),
        ("expandAperture", 100, 100, (0.4, 0.4)),
        ("cropAperture", 400, 100, (0.4, 0.1)),
        ("cropAperture", 100, 100, (0.2, 0.2)),
        ("adjustApertureWidth", 100, 100, (0.2, 0.2)),
        ("adjustApertureWidth", 400, 100, (0.8, 0.2)),
        ("adjustApertureHeight", 100, 100, (0.4, 0.4)),
        ("adjustApertureHeight", 400, 100, (0.4, 0.1)),
        ("adjustPixelAspectRatio", 400, 100, (0.4, 0.2)),
    ],
)
def test_aspect_ratio_policies(policy, width, height, window):
    found, imported = camera(
        LENS,
        settings(
            f"uniform int2 resolution = ({width}, {height})\n"
            f'uniform token aspectRatioConformPolicy = "{policy}"'
        ),
    )
    x, y = window
    assert found["window"] == pytest.approx([-x, x, -y, y])
    assert imported.resolution == (width, height)


def test_pixels_that_are_not_square():
    found, _ = camera(
        LENS, settings("uniform int2 resolution = (100, 100)\nuniform float pixelAspectRatio = 2")
    )
    assert found["window"] == pytest.approx([-0.4, 0.4, -0.2, 0.2])


@pytest.mark.parametrize("with_settings", [True, False])
def test_a_resolution_by_hand_keeps_the_width(with_settings):
    more = settings("uniform int2 resolution = (200, 100)") if with_settings else ""
    found, imported = camera(LENS, more, resolution=(300, 300))
    assert imported.resolution == (300, 300)
    assert found["window"] == pytest.approx([-0.4, 0.4, -0.4, 0.4])


def test_settings_named_by_the_stage_win():
    found, imported = camera(
        LENS,
        'def Camera "Other" {\nfloat horizontalAperture = 10\n}\n'
        'def RenderSettings "Mine" {\nrel camera = </Other>\n'
        "uniform int2 resolution = (30, 20)\n}\n" + settings("uniform int2 resolution = (1, 1)"),
        header='renderSettingsPrimPath = "/Mine"',
    )
    assert found["name"] == imported.camera == "/Other"
    assert imported.resolution == (30, 20)
    assert imported.settings() == {"resolution": [30, 20]}


def test_data_window_is_a_crop_from_the_top_left():
    _, imported = camera(
        LENS,
        settings(
            "uniform int2 resolution = (200, 100)\nuniform float4 dataWindowNDC = (0.25, 0, 1, 0.5)"
        ),
    )
    assert imported.crop == (50, 50, 200, 100)
    assert imported.settings() == {"resolution": [200, 100], "crop": [50, 50, 200, 100]}


def test_overscan_is_said():
    _, imported = camera(
        LENS,
        settings(
            "uniform int2 resolution = (20, 10)\nuniform float4 dataWindowNDC = (-1, 0, 1, 1)"
        ),
    )
    assert imported.crop is None
    assert [p for p, _ in reported(imported, usd.Kind.UNSUPPORTED)] == ["/Render/Settings"]


TWO = 'def Camera "A" { }\ndef Camera "B" { }\n' + LIGHT


@pytest.mark.parametrize("wanted", ["/B", "B"])
def test_a_camera_by_path_or_name(wanted):
    scene, imported = load(TWO, plain=True, camera=wanted)
    assert scene.camera["name"] == "/B"
    assert imported.report.entries == []


def test_the_first_of_several_is_said():
    scene, imported = load(TWO, plain=True)
    assert scene.camera["name"] == "/A"
    assert len(reported(imported, usd.Kind.NOTE)) == 1


def test_an_unknown_camera_is_an_error_that_names_the_known_ones():
    with pytest.raises(usd.StageError, match=r"/C.*/A, /B"):
        load(TWO, plain=True, camera="/C")


@pytest.mark.parametrize("up", ["Y", "Z"])
def test_a_stage_without_camera_is_seen_whole(up):
    scene, imported = load(
        LIGHT + 'def Cube "C" {\ndouble3 xformOp:translate = (10, 20, 30)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\n',
        f'upAxis = "{up}"',
        plain=True,
    )
    assert len(reported(imported, usd.Kind.NOTE)) == 1
    matrix = np.reshape(scene.camera["transform"], (4, 4))
    corners = np.array([[x, y, z, 1] for x in (9, 11) for y in (19, 21) for z in (29, 31)])
    seen = corners @ np.linalg.inv(matrix).T
    x, y = seen[:, 0] / -seen[:, 2], seen[:, 1] / -seen[:, 2]
    x0, x1, y0, y1 = scene.camera["window"]
    assert (seen[:, 2] < 0).all()
    assert x0 < x.min() and x.max() < x1 and y0 < y.min() and y.max() < y1
    assert y.max() - y.min() > 0.3 * (y1 - y0)
    assert matrix[2 if up == "Z" else 1, 1] > 0.9  # the picture's up is the stage's
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize("extent", ["(0, 0, 0), (0, 0, 0)", "(-900, -900, -900), (900, 900, 900)"])
def test_authored_extents_do_not_move_the_framing_camera(extent):
    quad = f'def Mesh "M" {{\n{QUAD}\n%s\n}}\n{LIGHT}'
    right, _ = load(quad % "", plain=True)
    scene, _ = load(quad % f"float3[] extent = [{extent}]", plain=True)
    assert scene.camera == right.camera
    place = np.reshape(scene.camera["transform"], (4, 4))[:3, 3]
    assert np.linalg.norm(place - [0.5, 0.5, 0]) == pytest.approx(
        math.sqrt(0.5) / math.sin(math.atan(0.5625 * 18 / 35))
    )


def test_lights_are_seen_by_the_framing_camera():
    one = 'def SphereLight "L" {\nfloat inputs:radius = 3\n}\n'
    scene, _ = load(one, plain=True)
    place = np.reshape(scene.camera["transform"], (4, 4))[:3, 3]
    distance = 3 * math.sqrt(3) / math.sin(math.atan(0.5625 * 18 / 35))
    assert np.linalg.norm(place) == pytest.approx(distance)


def test_camera_at_a_frame():
    moving = (
        LENS + "double3 xformOp:translate.timeSamples = {\n1: (0, 0, 0),\n3: (8, 0, 0),\n}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n'
        "float focalLength.timeSamples = {\n1: 50,\n3: 100,\n}"
    ).replace("float focalLength = 50\n", "")
    found, imported = camera(moving, frame=2)
    assert found["transform"][3] == pytest.approx(4)
    assert found["window"][1] == pytest.approx(20 / 75)
    assert imported.frame == 2


@pytest.mark.parametrize(
    ("attributes", "what"),
    [
        ("float focalLength = 0", "focal length"),
        ("float horizontalAperture = 0", "aperture"),
        ("float4[] clippingPlanes = [(1, 0, 0, 0)]", "clipping planes"),
        (
            'double3 xformOp:scale = (1, 2, 3)\nuniform token[] xformOpOrder = ["xformOp:scale"]',
            "non-uniform scale",
        ),
    ],
)
def test_what_is_wrong_with_a_camera_is_said(attributes, what):
    found, imported = camera(attributes)
    ((entry),) = imported.report.entries
    assert entry.path == "/Camera"
    assert what in entry.what
    assert all(math.isfinite(v) for v in found["window"] + found["transform"])


@pytest.mark.parametrize(
    ("name", "content"),
    [("gone.usda", None), ("bad.usda", "#usda 1.0\ndef Mesh {"), ("bad.usdc", "PXR-USDC nonsense")],
)
def test_stages_that_cannot_be_opened(tmp_path, name, content):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(usd.StageError, match=name):
        usd.open_stage(tmp_path / name)


def test_the_report_is_one_list():
    _, imported = load(
        'def BasisCurves "C1" { }\ndef BasisCurves "C2" { }\ndef Points "P" { }\n'
        'def Mesh "Empty" { }\n' + "".join(f'def Volume "V{n}" {{ }}\n' for n in range(6))
    )
    assert imported.report.text().splitlines() == [
        "Not supported:",
        "  - curves; left out",
        "      /C1, /C2",
        "  - points; left out",
        "      /P",
        "  - volumes; left out",
        "      /V0, /V1, /V2, /V3 and 2 more",
        "Left out:",
        "  - a mesh without points or faces",
        "      /Empty",
    ]
    assert str(imported.report.entries[0]) == "/C1: curves; left out"
