"""Textures: files, colour spaces, coordinates, channels, and what happens without a file."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pxr")
pytest.importorskip("OpenImageIO")

import OpenImageIO as oiio  # noqa: N813
from pxr import Sdf, Usd

from segue import tiles, usd
from stages import load_file, reported

NETWORK = """#usda 1.0
def Mesh "M" (
    prepend apiSchemas = ["MaterialBindingAPI"]
) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:map1 = [(0, 0), (1, 0), (1, 1), (0, 1)] (
        interpolation = "faceVarying"
    )
    rel material:binding = </Look>
}
def Material "Look" {
    string inputs:frame:stPrimvarName = "map1"
    token outputs:surface.connect = </Look/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        %(inputs)s
        token outputs:surface
    }
    def Shader "T" {
        uniform token info:id = "UsdUVTexture"
        %(texture)s
        float2 inputs:st.connect = </Look/%(st)s.outputs:result>
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:b
        float outputs:a
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname.connect = </Look.inputs:frame:stPrimvarName>
        float2 outputs:result
    }
    %(more)s
}
def Camera "Camera" { }
def DomeLight "Sky" { }
"""
COLOR = "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>\nfloat inputs:ior = 1"


def write(path, pixels, **metadata):
    pixels = np.asarray(pixels)
    height, width, channels = pixels.shape
    kind = {"float16": "half", "float32": "float"}.get(pixels.dtype.name, pixels.dtype.name)
    spec = oiio.ImageSpec(width, height, channels, kind)
    for key, value in metadata.items():
        spec[key] = value
    spec["oiio:UnassociatedAlpha"] = 1
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec)
    assert file.write_image(pixels)
    file.close()


def import_network(folder, texture, inputs=COLOR, st="R", more=""):
    path = folder / "stage.usda"
    path.write_text(NETWORK % {"inputs": inputs, "texture": texture, "st": st, "more": more})
    return load_file(path)


def gradient(channels, dtype=np.uint8):
    top = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    values = np.arange(4 * 6 * channels).reshape(4, 6, channels) / (4 * 6 * channels)
    return (values * top).astype(dtype)


@pytest.mark.parametrize(
    ("name", "dtype", "channels", "space", "expected"),
    [
        ("t.png", np.uint8, 3, "auto", "srgb"),
        ("t.png", np.uint8, 4, "auto", "srgb"),
        ("t.png", np.uint8, 3, "raw", "raw"),
        ("t.png", np.uint8, 3, "sRGB", "srgb"),
        ("t.png", np.uint16, 3, "auto", "raw"),
        ("t.png", np.uint16, 3, "sRGB", "srgb"),
        ("t.exr", np.float16, 3, "auto", "raw"),
        ("t.exr", np.float32, 4, "raw", "raw"),
        ("t.tif", np.uint8, 3, "auto", "srgb"),
        ("t.tga", np.uint8, 4, "auto", "srgb"),
        ("t.png", np.uint8, 1, "sRGB", "srgb"),
    ],
)
def test_pixels_arrive_as_they_are(tmp_path, name, dtype, channels, space, expected):
    pixels = gradient(channels, dtype)
    write(tmp_path / name, pixels)
    scene, imported = import_network(
        tmp_path, f'asset inputs:file = @./{name}@\ntoken inputs:sourceColorSpace = "{space}"'
    )
    ((_, found, colorspace),) = scene.images
    assert colorspace == expected
    assert found.dtype == dtype
    np.testing.assert_array_equal(found, pixels)
    assert imported.report.entries == []


@pytest.mark.parametrize(
    ("name", "channels"), [("t.tif", 1), ("t.png", 1), ("t.png", 2), ("t.jpg", 1)]
)
def test_a_grey_byte_picture_is_raw(tmp_path, name, channels):
    write(tmp_path / name, gradient(channels))
    scene, _ = import_network(tmp_path, f"asset inputs:file = @./{name}@")
    assert scene.images[0][2] == "raw"
    assert scene.images[0][1].shape == (4, 6, channels)


def test_the_texture(tmp_path):
    write(tmp_path / "t.png", gradient(3))
    scene, _ = import_network(
        tmp_path,
        "asset inputs:file = @./t.png@\nfloat4 inputs:scale = (1, 2, 3, 4)\n"
        'float4 inputs:bias = (0.5, 0, 0, 0)\ntoken inputs:wrapS = "repeat"\n'
        'token inputs:wrapT = "mirror"',
    )
    assert scene.textures == [
        {
            "type": "image",
            "image": 0,
            "uv": "map1",
            "transform": [1, 0, 0, 0, 1, 0],
            "wrap_s": "repeat",
            "wrap_t": "mirror",
            "scale": [1, 2, 3, 4],
            "bias": [0.5, 0, 0, 0],
        }
    ]
    assert scene.meshes[0].attributes["map1"].interpolation == "corner"
    (material,) = scene.instances[0].materials
    assert material["surface"]["color"] == {"texture": 0, "channel": "rgb"}


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        ({}, ("black", "black")),
        ({"wrapmodes": "periodic,periodic"}, ("repeat", "repeat")),
        ({"wrapmodes": "clamp,mirror"}, ("clamp", "mirror")),
    ],
)
def test_wrap_modes_of_the_file(tmp_path, metadata, expected):
    write(tmp_path / "t.exr", gradient(3, np.float16), **metadata)
    scene, _ = import_network(tmp_path, "asset inputs:file = @./t.exr@")
    assert (scene.textures[0]["wrap_s"], scene.textures[0]["wrap_t"]) == expected


@pytest.mark.parametrize("channel", ["r", "g", "b", "a"])
@pytest.mark.parametrize("name", ["roughness", "metallic", "clearcoat", "ior"])
def test_channels(tmp_path, channel, name):
    write(tmp_path / "t.png", gradient(4))
    scene, _ = import_network(
        tmp_path,
        'asset inputs:file = @./t.png@\ntoken inputs:sourceColorSpace = "raw"',
        f"float inputs:{name}.connect = </Look/T.outputs:{channel}>",
    )
    surface = scene.instances[0].materials[0]["surface"]
    key = {"clearcoat": "coat"}.get(name, name)
    assert surface[key] == {"texture": 0, "channel": channel}


def test_one_node_is_one_texture_and_one_file_one_image(tmp_path):
    write(tmp_path / "t.png", gradient(4))
    scene, _ = import_network(
        tmp_path,
        "asset inputs:file = @./t.png@",
        COLOR + "\nfloat inputs:roughness.connect = </Look/T.outputs:g>\n"
        "color3f inputs:emissiveColor.connect = </Look/T2.outputs:rgb>",
        more='def Shader "T2" {\nuniform token info:id = "UsdUVTexture"\n'
        "asset inputs:file = @./t.png@\nfloat4 inputs:scale = (9, 9, 9, 1)\n"
        "float2 inputs:st.connect = </Look/R.outputs:result>\nfloat3 outputs:rgb\n}",
    )
    assert len(scene.images) == 1
    assert len(scene.textures) == 2


def test_transform_2d_scales_then_turns_then_moves(tmp_path):
    write(tmp_path / "t.png", gradient(3))
    scene, _ = import_network(
        tmp_path,
        "asset inputs:file = @./t.png@",
        st="X",
        more='def Shader "X" {\nuniform token info:id = "UsdTransform2d"\n'
        "float2 inputs:in.connect = </Look/R.outputs:result>\nfloat inputs:rotation = 90\n"
        "float2 inputs:scale = (2, 3)\nfloat2 inputs:translation = (0.5, 0.25)\n"
        "float2 outputs:result\n}",
    )
    a, b, c, d, e, f = scene.textures[0]["transform"]
    # (1, 0) -> (2, 0) -> (0, 2) -> (0.5, 2.25); (0, 1) -> (0, 3) -> (-3, 0) -> (-2.5, 0.25)
    assert (a + c, d + f) == pytest.approx((0.5, 2.25))
    assert (b + c, e + f) == pytest.approx((-2.5, 0.25))


def test_a_chain_of_transforms(tmp_path):
    write(tmp_path / "t.png", gradient(3))
    node = (
        'def Shader "%s" {\nuniform token info:id = "UsdTransform2d"\n'
        "float2 inputs:in.connect = </Look/%s.outputs:result>\n%s\nfloat2 outputs:result\n}\n"
    )
    scene, _ = import_network(
        tmp_path,
        "asset inputs:file = @./t.png@",
        st="X",
        more=node % ("X", "Y", "float2 inputs:scale = (10, 10)")
        + node % ("Y", "R", "float2 inputs:translation = (1, 2)"),
    )
    # Moved first, scaled afterwards.
    assert scene.textures[0]["transform"] == pytest.approx([10, 0, 10, 0, 10, 20])


@pytest.mark.parametrize("ring", [("X",), ("X", "Y"), ("X", "Y", "Z")])
def test_coordinates_that_depend_on_themselves(tmp_path, ring):
    write(tmp_path / "t.png", gradient(3))
    node = (
        'def Shader "%s" {\nuniform token info:id = "UsdTransform2d"\n'
        "float2 inputs:in.connect = </Look/%s.outputs:result>\n"
        "float2 inputs:scale = (3, 3)\nfloat2 outputs:result\n}\n"
    )
    following = dict(zip(ring, (*ring[1:], ring[0])))
    scene, imported = import_network(
        tmp_path,
        "asset inputs:file = @./t.png@",
        st="X",
        more="".join(node % pair for pair in following.items()),
    )
    assert (scene.textures[0]["uv"], scene.textures[0]["transform"]) == ("st", [1, 0, 0, 0, 1, 0])
    assert ("/Look/X", "texture coordinates that depend on themselves") in reported(
        imported, usd.Kind.WARNING
    )


@pytest.mark.parametrize(("authored", "number"), [(False, 0.5), (True, 0.25)])
def test_a_missing_file_is_named_and_visible(tmp_path, authored, number):
    fallback = "\nfloat4 inputs:fallback = (0.25, 0.25, 0.25, 1)" if authored else ""
    scene, imported = import_network(tmp_path, "asset inputs:file = @./gone.png@" + fallback)
    (material,) = scene.instances[0].materials
    assert material["surface"]["color"] == [number] * 3
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/Look/T"
    assert "gone.png" in what


@pytest.mark.parametrize("content", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n\x00\x00"])
def test_a_broken_file_is_named(tmp_path, content):
    (tmp_path / "t.png").write_bytes(content)
    scene, imported = import_network(tmp_path, "asset inputs:file = @./t.png@")
    assert scene.images == []
    assert scene.instances[0].materials[0]["surface"]["color"] == [0.5] * 3
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/Look/T"
    assert "t.png" in what


def test_a_truncated_file_is_named(tmp_path):
    write(tmp_path / "whole.png", np.random.default_rng(1).integers(0, 255, (64, 64, 3), np.uint8))
    (tmp_path / "t.png").write_bytes((tmp_path / "whole.png").read_bytes()[:4000])
    _, imported = import_network(tmp_path, "asset inputs:file = @./t.png@")
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/Look/T"
    assert "t.png" in what


def flat(size, value):
    return np.full((size, size, 3), value, np.uint8)


def test_udim_tiles_are_joined(tmp_path):
    """From the bottom left to the right and upwards; what is missing is black."""
    for number, size, value in ((1001, 4, 10), (1003, 2, 30), (1012, 4, 120)):
        write(tmp_path / f"t.{number}.png", flat(size, value))
    scene, imported = import_network(tmp_path, "asset inputs:file = @./t.<UDIM>.png@")
    assert not reported(imported, usd.Kind.UNSUPPORTED)
    assert not reported(imported, usd.Kind.WARNING)
    ((_, pixels, colorspace),) = scene.images
    assert colorspace == "srgb"
    assert pixels.shape == (8, 12, 3)
    assert pixels[::4, ::4, 0].tolist() == [[0, 120, 0], [10, 0, 30]]
    (texture,) = (item for item in scene.textures if item["type"] == "image")
    np.testing.assert_allclose(texture["transform"], [1 / 3, 0, 0, 0, 1 / 2, 0])


def test_udim_tiles_that_do_not_fit_are_named(tmp_path):
    """Where there is none, and where they are of several kinds."""
    _, imported = import_network(tmp_path, "asset inputs:file = @./t.<UDIM>.png@")
    ((path, what),) = reported(imported, usd.Kind.WARNING)
    assert path == "/Look/T"
    assert "t.<UDIM>.png does not exist" in what
    write(tmp_path / "t.1001.png", gradient(3))
    write(tmp_path / "t.1002.png", gradient(4))
    _, imported = import_network(tmp_path, "asset inputs:file = @./t.<UDIM>.png@")
    ((_, what),) = reported(imported, usd.Kind.WARNING)
    assert "differ" in what


def test_large_tiles_are_reduced(tmp_path):
    for number in (1001, 1002):
        write(tmp_path / f"{number}.png", flat(8, number - 1000))
    paths = {number: str(tmp_path / f"{number}.png") for number in (1001, 1002)}
    tiled = tiles.join(paths, most_bytes=8 * 8 * 3)
    assert (tiled.reduction, tiled.counts) == (2, (2, 1))
    assert tiled.picture.pixels[..., 0].tolist() == [[1] * 4 + [2] * 4] * 4


NORMAL = "normal3f inputs:normal.connect = </Look/T.outputs:rgb>\nfloat inputs:ior = 1"


@pytest.mark.parametrize("authored", [True, False])
def test_normal_maps(tmp_path, authored):
    write(tmp_path / "n.png", gradient(3))
    scaled = "\nfloat4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)"
    scene, imported = import_network(
        tmp_path,
        'asset inputs:file = @./n.png@\ntoken inputs:sourceColorSpace = "raw"'
        + (scaled if authored else ""),
        NORMAL,
    )
    surface = scene.instances[0].materials[0]["surface"]
    assert surface["normal"] == {"texture": 0, "uv": "map1"}
    assert scene.textures[0]["scale"] == [2, 2, 2, 1]
    assert scene.textures[0]["bias"] == [-1, -1, -1, 0]
    assert bool(imported.report.of(usd.Kind.WARNING)) is not authored


def test_a_float_normal_map_is_taken_as_it_is(tmp_path):
    write(tmp_path / "n.exr", gradient(3, np.float32))
    scene, imported = import_network(tmp_path, "asset inputs:file = @./n.exr@", NORMAL)
    assert scene.textures[0]["scale"] == [1, 1, 1, 1]
    assert imported.report.entries == []


def test_a_missing_normal_map_leaves_the_normal(tmp_path):
    scene, _ = import_network(tmp_path, "asset inputs:file = @./gone.png@", NORMAL)
    assert "normal" not in scene.instances[0].materials[0]["surface"]


OPACITY = COLOR + "\nfloat inputs:opacity.connect = </Look/T.outputs:a>\n"


def test_textured_opacity_cuts_out_unless_it_says_transparent(tmp_path):
    write(tmp_path / "t.png", gradient(4))
    file = "asset inputs:file = @./t.png@"
    scene, imported = import_network(tmp_path, file, OPACITY)
    (material,) = scene.instances[0].materials
    assert material["opacity"] == {"texture": 0, "channel": "a"}
    assert len(imported.report.of(usd.Kind.NOTE)) == 1
    scene, imported = import_network(
        tmp_path, file, OPACITY + 'token inputs:opacityMode = "transparent"'
    )
    (material,) = scene.instances[0].materials
    assert "opacity" not in material
    assert material["surface"]["type"] == "mix"
    assert material["surface"]["factor"] == {"texture": 0, "channel": "a"}
    assert imported.report.entries == []


@pytest.mark.parametrize("channels", [3, 4])
def test_an_opaque_alpha_costs_nothing(tmp_path, channels):
    pixels = gradient(channels)
    if channels == 4:
        pixels[:, :, 3] = 255
    write(tmp_path / "t.png", pixels)
    scene, imported = import_network(tmp_path, "asset inputs:file = @./t.png@", OPACITY)
    assert "opacity" not in scene.instances[0].materials[0]
    assert imported.report.entries == []


def test_a_threshold_makes_a_mask(tmp_path):
    pixels = gradient(4)
    write(tmp_path / "t.png", pixels)
    scene, _ = import_network(
        tmp_path,
        "asset inputs:file = @./t.png@\nfloat4 inputs:scale = (1, 1, 1, 0.5)\n"
        "float4 inputs:bias = (0, 0, 0, 0.25)",
        OPACITY + "float inputs:opacityThreshold = 0.5",
    )
    (material,) = scene.instances[0].materials
    texture = scene.textures[material["opacity"]["texture"]]
    _, mask, colorspace = scene.images[texture["image"]]
    assert colorspace == "raw"
    expected = pixels[:, :, 3] / 255 * 0.5 + 0.25 >= 0.5
    np.testing.assert_array_equal(mask == 255, expected)
    np.testing.assert_array_equal(mask == 0, ~expected)
    assert texture["scale"] == [1, 1, 1, 1]


def test_files_in_a_package(tmp_path):
    pixels = gradient(3)
    write(tmp_path / "t.png", pixels)
    import_network(tmp_path, "asset inputs:file = @./t.png@")
    package = tmp_path / "p.usdz"
    with (
        Sdf.ZipFileWriter.CreateNew(str(package))
        if hasattr(Sdf, "ZipFileWriter")
        else (Usd.ZipFileWriter.CreateNew(str(package))) as writer
    ):
        writer.AddFile(str(tmp_path / "stage.usda"), "stage.usda")
        writer.AddFile(str(tmp_path / "t.png"), "t.png")
    (tmp_path / "t.png").unlink()
    scene, imported = load_file(package)
    assert imported.report.entries == []
    np.testing.assert_array_equal(scene.images[0][1], pixels)


def test_a_dome_and_a_rect_have_pictures(tmp_path):
    write(tmp_path / "t.exr", gradient(3, np.float16))
    path = tmp_path / "stage.usda"
    path.write_text(
        '#usda 1.0\ndef Camera "Camera" { }\n'
        'def DomeLight "D" {\nasset inputs:texture:file = @./t.exr@\n}\n'
        'def RectLight "R" {\nasset inputs:texture:file = @./t.exr@\n}\n'
        'def DomeLight "Angular" {\nasset inputs:texture:file = @./t.exr@\n'
        'token inputs:texture:format = "angular"\n}\n'
        'def DomeLight "Gone" {\nasset inputs:texture:file = @./gone.exr@\n}\n'
    )
    scene, imported = load_file(path)
    assert scene.lights["/D"]["image"] == scene.lights["/R"]["image"] == 0
    assert len(scene.images) == 1
    assert "image" not in scene.lights["/Gone"]
    assert reported(imported, usd.Kind.UNSUPPORTED) == [("/Angular", "the dome format 'angular'")]
    ((path_of, what),) = reported(imported, usd.Kind.WARNING)
    assert path_of == "/Gone"
    assert "gone.exr" in what
