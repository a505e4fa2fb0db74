"""Stages written in the tests, and what an import makes of them."""

from __future__ import annotations

from pathlib import Path

from pxr import Usd

from recording import RecordingScene
from segue import usd

#: A camera and a light, so that the import adds none of its own.
CAMERA_AND_LIGHT = """
def Camera "Camera" { }
def DomeLight "Sky" { }
"""


def stage(body: str, header: str = 'upAxis = "Y"') -> Usd.Stage:
    """A stage from usda text without its first lines. One property a line."""
    made = Usd.Stage.CreateInMemory()
    assert made.GetRootLayer().ImportFromString(f"#usda 1.0\n(\n{header}\n)\n{body}")
    return made


def load(body: str, header: str = 'upAxis = "Y"', plain: bool = False, **options):
    """The recorded scene and the import of a stage; a camera and a sky are added unless `plain`."""
    text = body if plain else body + CAMERA_AND_LIGHT
    scene = RecordingScene()
    imported = usd.load(stage(text, header), scene=scene, **options)
    return scene, imported


def load_file(path: Path, **options):
    """The recorded scene and the import of a file."""
    scene = RecordingScene()
    return scene, usd.load(path, scene=scene, **options)


def reported(imported: usd.Imported, kind: usd.Kind) -> list[tuple[str, str]]:
    """(path, what) of the report's entries of a kind."""
    return [(e.path, e.what) for e in imported.report.of(kind)]


QUAD = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
"""

#: A light alone, and a lens.
LIGHT = 'def DomeLight "Sky" { }\n'
LENS = "float focalLength = 50\nfloat horizontalAperture = 40\nfloat verticalAperture = 20\n"


def camera(attributes: str, more: str = "", header: str = 'upAxis = "Y"', **options):
    """The description of a camera with these attributes, and the import."""
    body = f'def Camera "Camera" {{\n{attributes}\n}}\n{more}\n{LIGHT}'
    scene, imported = load(body, header, plain=True, **options)
    return scene.camera, imported


def settings(text: str) -> str:
    """Render settings with these attributes."""
    return f'def Scope "Render" {{\ndef RenderSettings "Settings" {{\n{text}\n}}\n}}'
