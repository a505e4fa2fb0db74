"""Stages with wrong numbers, missing lines and emptied arrays: an error or a report, no crash."""

from __future__ import annotations

import random
import re

import pytest

pytest.importorskip("pxr")

from pxr import Tf, Usd

import segue
from recording import RecordingScene
from segue import usd

STAGE = """#usda 1.0
(
    upAxis = "Z"
)
def Mesh "Mesh" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{
    int[] faceVertexCounts = [4, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 0, 3, 4]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 1, 0)]
    normal3f[] normals = [(0, 0, 1), (0, 0, 1)] (
        interpolation = "uniform"
    )
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "faceVarying"
    )
    int[] primvars:st:indices = [0, 1, 2, 3, 0, 3, 2]
    int[] holeIndices = [1]
    rel material:binding = </Look>
    def GeomSubset "Subset"
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
    }
}
def Mesh "Smooth"
{
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 4, 5]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 2, 1), (0, 2, 1)]
    int[] creaseIndices = [2, 3]
    int[] creaseLengths = [2]
    float[] creaseSharpnesses = [3]
    int[] cornerIndices = [0]
    float[] cornerSharpnesses = [2]
    color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (
        interpolation = "uniform"
    )
}
def PointInstancer "Instancer"
{
    rel prototypes = [</Instancer/Ball>]
    int[] protoIndices = [0, 0, 0]
    int64[] ids = [1, 2, 3]
    int64[] invisibleIds = [2]
    point3f[] positions = [(0, 0, 0), (4, 0, 0), (8, 0, 0)]
    quath[] orientations = [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)]
    float3[] scales = [(1, 1, 1), (2, 2, 2), (3, 3, 3)]
    def Sphere "Ball"
    {
        double radius = 0.25
    }
}
def Material "Look"
{
    token outputs:surface.connect = </Look/Surface.outputs:surface>
    def Shader "Surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Look/Texture.outputs:rgb>
        float inputs:roughness = 0.25
        float inputs:opacity = 0.5
        float inputs:opacityThreshold = 0
        float inputs:ior = 1.5
        color3f inputs:emissiveColor = (0, 0.5, 1)
        token outputs:surface
    }
    def Shader "Texture"
    {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @missing.png@
        float4 inputs:fallback = (0.25, 0.5, 0.75, 1)
        float4 inputs:scale = (1, 1, 1, 1)
        float3 outputs:rgb
    }
}
def SphereLight "Lamp" (
    prepend apiSchemas = ["ShapingAPI"]
)
{
    float inputs:intensity = 30
    float inputs:exposure = 1
    float inputs:radius = 0.25
    float inputs:shaping:cone:angle = 60
    bool inputs:normalize = 1
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "Sun"
{
    float inputs:angle = 0.5
    float inputs:intensity = 2
    matrix4d xformOp:transform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
def Camera "Camera"
{
    float focalLength = 35
    float horizontalAperture = 20
    float verticalAperture = 15
    float fStop = 2
    float focusDistance = 5
    float2 clippingRange = (0.5, 100)
    matrix4d xformOp:transform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 9, 1))
    uniform token[] xformOpOrder = ["xformOp:transform"]
}
def RenderSettings "Settings"
{
    uniform int2 resolution = (32, 24)
    uniform float4 dataWindowNDC = (0, 0, 1, 1)
    rel camera = </Camera>
}
"""
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?![\w.])")
PROPERTY = re.compile(
    r"(?P<uniform>uniform )?(?P<kind>\w+(\[\])?) (?P<name>[\w:]+) = [^\n]*(?<!\()$", re.MULTILINE
)
VALUES = ("0", "-1", "nan", "inf", "1e38", "-1e38", "1e-42", "7", "99999", "0.5")


def damaged(text: str, chance: random.Random) -> str:
    """The text with a few numbers replaced, arrays emptied or lines removed."""
    for _ in range(chance.randint(1, 5)):
        kind = chance.random()
        if kind < 0.6:
            found = chance.choice([m for m in NUMBER.finditer(text) if m.start() > 40])
            text = text[: found.start()] + chance.choice(VALUES) + text[found.end() :]
        elif kind < 0.8:
            found = chance.choice(list(re.finditer(r"= [\[(][^\n]*[\])]$", text, re.MULTILINE)))
            text = text[: found.start()] + chance.choice(("= []", "= None")) + text[found.end() :]
        else:
            lines = text.split("\n")
            del lines[chance.randrange(4, len(lines))]
            text = "\n".join(lines)
    return text


def mistyped(text: str, chance: random.Random) -> str:
    """The text with a few properties of another type, blocked, or with words nobody knows."""
    for _ in range(chance.randint(1, 4)):
        found = chance.choice(list(PROPERTY.finditer(text)))
        uniform, kind, name = (found[n] or "" for n in ("uniform", "kind", "name"))
        new = chance.choice(
            (
                f'{uniform}string {name} = "q"',
                f'{uniform}token {name} = ""',
                f'{uniform}token[] {name} = ["q"]',
                f"{uniform}float3 {name} = (1, nan, 3)",
                f"{uniform}float[] {name} = [1, 2, 3, 4, 5]",
                f"{uniform}int {name} = -7",
                f"{uniform}bool {name} = 1",
                f"{uniform}asset {name} = @q@",
                f"{kind} {name}.timeSamples = {{0: None}}",
            )
        )
        text = text[: found.start()] + new + text[found.end() :]
    return text


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("real", [False, True])
@pytest.mark.parametrize("damaged", [damaged, mistyped])
def test_damaged_stages(seed, real, damaged, request):
    if real:
        request.getfixturevalue("engine")
    chance = random.Random(seed)
    read = 0
    for _ in range(50):
        text = damaged(STAGE, chance)
        stage = Usd.Stage.CreateInMemory()
        try:
            if not stage.GetRootLayer().ImportFromString(text):
                continue
        except Tf.ErrorException:
            continue
        read += 1
        scene = segue.Scene() if real else RecordingScene()
        try:
            usd.load(stage, scene=scene)
        except segue.SegueError as error:
            # The engine's own refusals are allowed if they name what they refuse.
            assert "/" in str(error), text
    assert read > 15
