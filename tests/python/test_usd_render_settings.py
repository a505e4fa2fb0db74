"""Render settings: what is followed, and what is named."""

from __future__ import annotations

import pytest

pytest.importorskip("pxr")

from segue import usd
from stages import LENS, camera, load, reported, settings


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("uniform float4 dataWindowNDC = (nan, 0, 1, 1)", "is not finite"),
        ("uniform float pixelAspectRatio = nan", "pixelAspectRatio nan"),
        ('string resolution = "a"', "resolution = a"),
        ("rel products = </Nope>", "/Nope does not exist"),
    ],
)
def test_what_is_wrong_with_the_settings_is_said(text, what):
    _, imported = camera(LENS, settings(text))
    ((path, said),) = reported(imported, usd.Kind.WARNING)
    assert path == "/Render/Settings"
    assert what in said
    assert imported.crop is None


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ('uniform token[] materialBindingPurposes = ["preview"]', "materialBindingPurposes"),
        ('uniform token renderingColorSpace = "acescg"', "renderingColorSpace 'acescg'"),
        ("rel products = [</A>, </B>]", "2 render products"),
    ],
)
def test_what_is_not_supported_of_the_settings_is_said(text, what):
    _, imported = camera(LENS, settings(text))
    ((path, said),) = reported(imported, usd.Kind.UNSUPPORTED)
    assert path == "/Render/Settings"
    assert what in said


@pytest.mark.parametrize("space", ["lin_rec709_scene", ""])
def test_defaults_of_the_settings_are_not_said(space):
    _, imported = camera(
        LENS,
        settings(
            f'uniform token renderingColorSpace = "{space}"\n'
            'uniform token[] materialBindingPurposes = ["full", ""]'
        ),
    )
    assert imported.report.entries == []


def test_the_products_values_go_before_the_settings():
    product = (
        'def Camera "Other" {\nfloat horizontalAperture = 10\nfloat verticalAperture = 10\n}\n'
        'def RenderProduct "P" {\nrel camera = </Other>\nuniform int2 resolution = (20, 10)\n}\n'
    )
    _, imported = camera(
        LENS,
        product
        + settings(
            "rel products = </P>\nrel camera = </Camera>\n"
            "uniform int2 resolution = (32, 32)\nuniform float pixelAspectRatio = 2"
        ),
    )
    assert (imported.camera, imported.resolution) == ("/Other", (20, 10))
    assert imported.report.entries == []
    found, _ = camera(
        LENS, product + settings("rel products = </P>\nuniform float pixelAspectRatio = 2")
    )
    assert found["window"] == pytest.approx([-0.4, 0.4, -0.1, 0.1])


@pytest.mark.parametrize(
    ("included", "drawn"), [("", ["/D"]), ('"default", "proxy"', ["/D", "/P"]), ('"proxy"', ["/P"])]
)
def test_included_purposes(included, drawn):
    body = 'def Sphere "D" { }\ndef Sphere "P" {\nuniform token purpose = "proxy"\n}\n'
    if included:
        body += settings(f"uniform token[] includedPurposes = [{included}]")
    scene, _ = load(body)
    assert [i.name for i in scene.instances] == drawn
    scene, _ = load(body, purposes=["proxy"])
    assert [i.name for i in scene.instances] == ["/P"]


def test_depth_of_field_can_be_disabled():
    lens = LENS + "float fStop = 2\nfloat focusDistance = 30"
    found, imported = camera(lens, settings("uniform bool disableDepthOfField = 1"))
    assert "aperture_radius" not in found
    assert imported.report.entries == []


@pytest.mark.parametrize(
    ("shutter", "text", "moving"),
    [
        ("", "", []),
        ("double shutter:close = 0.5", "", ["/Ball"]),
        ("double shutter:close = 0.5", "uniform bool disableMotionBlur = 1", []),
    ],
)
def test_motion_blur_is_said(shutter, text, moving):
    ball = (
        'def Sphere "Ball" {\n'
        "double3 xformOp:translate.timeSamples = {1: (0, 0, 0), 2: (1, 0, 0)}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]\n}\ndef Sphere "Still" { }\n'
    )
    _, imported = camera(LENS + shutter, ball + settings(text), frame=1)
    assert reported(imported, usd.Kind.UNSUPPORTED) == [(p, "motion blur") for p in moving]
