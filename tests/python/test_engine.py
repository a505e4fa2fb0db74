"""Scenes and renders through the shared library."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import segue

pytestmark = pytest.mark.usefixtures("engine")

CAMERA = {
    "type": "perspective",
    "window": [-1, 1, -1, 1],
    "transform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 0, 1],
}
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)


def add_square(scene, color=0.5, **options):
    material = scene.add_material("m", {"surface": {"type": "diffuse", "color": color}})
    mesh = scene.add_mesh("square", SQUARE, [0, 1, 2, 3], [4], **options)
    scene.add_instances("square", mesh, np.eye(4), [material])


def lit_scene(color=0.5, **options):
    scene = segue.Scene()
    add_square(scene, color, **options)
    scene.add_light("sky", {"type": "dome", "radiance": [1, 2, 4]})
    scene.set_camera("camera", CAMERA)
    return scene


def settings(**more):
    return {"resolution": [16, 12], "samples": 8, "threads": 1, **more}


def test_versions():
    assert segue.engine_version() == segue.__version__


def test_a_picture():
    render = segue.Render(lit_scene(), settings(passes=["Combined", "Depth", "Normal"]))
    assert render.size == (16, 12)
    assert render.run() is True
    picture = render.read_pass("Combined")
    assert picture.shape == (12, 16, 4)
    assert picture.dtype == np.float32
    # An open plane under a white sky reflects its albedo; the frame's edge sees the sky itself.
    middle = picture[6, 8, :3]
    np.testing.assert_allclose(middle / [1, 2, 4], 0.5, rtol=0.35)
    np.testing.assert_allclose(picture[0, 0, :3], [1, 2, 4], rtol=1e-5)
    assert render.read_pass("Depth").shape == (12, 16, 1)
    np.testing.assert_allclose(render.read_pass("Depth")[6, 8], 3, rtol=1e-5)
    np.testing.assert_allclose(render.read_pass("Normal")[6, 8], [0, 0, 1], atol=1e-5)


def test_rows_and_columns_of_a_pass():
    render = segue.Render(lit_scene(), settings())
    render.run()
    whole = render.read_pass("Combined")
    np.testing.assert_array_equal(render.read_pass("Combined", (3, 2, 5, 4)), whole[2:6, 3:8])


def test_arrays_of_other_types_and_strides_arrive():
    pictures = []
    for points in (SQUARE, SQUARE.astype(np.float64), np.asfortranarray(SQUARE), SQUARE.tolist()):
        scene = segue.Scene()
        material = scene.add_material("m", {"surface": {"type": "diffuse", "color": 0.5}})
        mesh = scene.add_mesh("square", points, np.arange(4, dtype=np.int64), [4])
        scene.add_instances("square", mesh, np.eye(4), np.array([material]))
        scene.add_light("sky", {"type": "dome", "radiance": np.ones(3, np.float32)})
        scene.set_camera("camera", CAMERA)
        render = segue.Render(scene, settings())
        render.run()
        pictures.append(render.read_pass("Combined"))
    for picture in pictures[1:]:
        np.testing.assert_array_equal(picture, pictures[0])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, np.float32])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_textures_of_every_type(dtype, channels):
    top = np.iinfo(dtype).max if np.dtype(dtype).kind == "u" else 1
    pixels = np.full((4, 4, channels), 0.2 * top).astype(dtype)
    if channels in (2, 4):
        pixels[..., -1] = top
    scene = segue.Scene()
    image = scene.add_image("image", pixels, "raw")
    texture = scene.add_texture("texture", {"type": "image", "image": image})
    color = {"texture": texture}
    uv = segue.Attribute("st", [[0, 0], [1, 0], [1, 1], [0, 1]], "corner")
    add_square(scene, color, attributes=[uv])
    scene.add_light("sky", {"type": "dome", "radiance": [1, 1, 1]})
    scene.set_camera("camera", CAMERA)
    render = segue.Render(scene, settings(passes=["Combined", "Albedo"]))
    render.run()
    np.testing.assert_allclose(render.read_pass("Albedo")[6, 8], 0.2, rtol=1e-3)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_bump_maps_have_the_normal_of_the_raised_surface(size):
    """Heights that rise by 0.25 along u and by 0.5 along v, on a square of 2 x 4."""
    v, u = np.mgrid[0:32, 0:32] / 32.0
    ramp = (0.25 * u - 0.5 * v).astype(np.float32)
    scene = segue.Scene()
    image = scene.add_image("ramp", ramp, "raw")
    heights = scene.add_texture("heights", {"type": "image", "image": image})
    bump = {"height": {"texture": heights}, "distance": 2.0 * size}
    surface = {"type": "diffuse", "normal": bump}
    material = scene.add_material("material", {"surface": surface})
    uv = segue.Attribute("st", [[0, 0], [1, 0], [1, 1], [0, 1]], "corner")
    square = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]])
    mesh = scene.add_mesh("square", square, [0, 1, 2, 3], [4], attributes=[uv])
    stretched = np.diag([2 * size, 4 * size, size, 1.0])
    scene.add_instances("square", mesh, stretched, [material])
    scene.add_light("sky", {"type": "dome", "radiance": [1, 1, 1]})
    camera = np.eye(4)
    camera[2, 3] = 3 * size
    scene.set_camera("camera", {**CAMERA, "transform": camera.ravel().tolist()})
    render = segue.Render(scene, settings(passes=["Normal"], integrator="path"))
    render.run()
    found = render.read_pass("Normal")[6, 8]
    # slopes are 2 * 0.25 / 2 and 2 * 0.5 / 4
    expected = np.array([-0.25, -0.25, 1.0]) / np.linalg.norm([0.25, 0.25, 1.0])
    np.testing.assert_allclose(found[:3], expected, atol=1e-3)


@pytest.mark.parametrize("integrator", ["segment", "path", "vcm", "light", "photon-filter"])
@pytest.mark.parametrize("light", [{"type": "dome"}, {"type": "rect", "width": 9, "height": 9}])
def test_the_camera_alone_sees_backdrops(integrator, light):
    for with_floor in (False, True):
        scene = segue.Scene()
        if with_floor:
            add_square(scene)
        else:
            # something, that nothing is seen of
            mesh = scene.add_mesh("far", SQUARE - [0, 0, 1e3], [0, 1, 2, 3], [4])
            material = scene.add_material("m", {"surface": {"type": "diffuse"}})
            scene.add_instances("far", mesh, np.eye(4), [material])
        behind = np.diag([1.0, -1.0, -1.0, 1.0])
        behind[2, 3] = -2
        common = {"radiance": [1, 2, 4], "camera_only": True, "transform": behind.ravel().tolist()}
        scene.add_light("backdrop", {**light, **common})
        scene.set_camera("camera", CAMERA)
        render = segue.Render(scene, settings(integrator=integrator))
        render.run()
        picture = render.read_pass("Combined")[..., :3]
        middle = picture[5:7, 7:9].mean((0, 1))
        np.testing.assert_allclose(middle, (0, 0, 0) if with_floor else (1, 2, 4), rtol=1e-3)


def test_instances_and_left_handed_meshes():
    scene = lit_scene(left_handed=True)
    render = segue.Render(scene, settings(passes=["Combined", "Normal"]))
    render.run()
    # Normals are given towards the camera, whichever side is the front.
    assert abs(render.read_pass("Normal")[6, 8, 2]) == pytest.approx(1)
    assert scene.info()["counts"]


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda s: s.add_mesh("m", [[0, 0]], [0]), segue.BadArgumentError, "points"),
        (lambda s: s.add_mesh("m", SQUARE, [0, 1]), segue.BadArgumentError, "triangles"),
        (lambda s: s.add_mesh("m", SQUARE, [0, 1, -1]), segue.BadArgumentError, "out of range"),
        (lambda s: s.add_mesh("m", SQUARE, [0.5, 1, 2]), segue.BadArgumentError, "integers"),
        (lambda s: s.add_mesh("m", SQUARE, [0, 1, 9]), segue.BadSceneError, "m"),
        (
            lambda s: s.add_mesh("m", SQUARE, [0, 1, 2, 3], [4], face_slots=[0, 0]),
            segue.BadArgumentError,
            "face_slots",
        ),
        (
            lambda s: s.add_mesh(
                "m", SQUARE, [0, 1, 2], normals=[[0, 0, 1]], normal_interpolation="edge"
            ),
            segue.BadArgumentError,
            "edge",
        ),
        (lambda s: s.add_material("mat", {"surface": {"type": "paint"}}), segue.SegueError, "mat"),
        (
            lambda s: s.add_material("mat", {"surface": {"type": "diffuse", "colour": 1}}),
            segue.SegueError,
            "colour",
        ),
        (lambda s: s.add_light("sun", {"type": "distant"}), segue.SegueError, "sun"),
        (
            lambda s: s.add_light("sun", {"type": "dome", "radiance": [float("nan")] * 3}),
            segue.BadArgumentError,
            "sun",
        ),
        (lambda s: s.add_light("sun", {"type": object()}), segue.BadArgumentError, "JSON"),
        (lambda s: s.add_image("i", np.zeros((2, 2), np.int32)), segue.BadArgumentError, "int32"),
        (lambda s: s.add_image("i", np.zeros((2, 2, 5), np.uint8)), segue.SegueError, "i"),
        (lambda s: s.add_instances("x", 99, np.eye(4)), segue.SegueError, "x"),
        (lambda s: s.add_instances("x", 0, np.eye(3)), segue.BadArgumentError, "transforms"),
        (lambda s: s.add_light("a\0b", {"type": "dome"}), segue.BadArgumentError, "NUL"),
    ],
)
def test_bad_input_is_an_error_that_names_it(call, error, words):
    with pytest.raises(error, match=words):
        call(segue.Scene())


@pytest.mark.parametrize(
    "bad", [{"integrator": "magic"}, {"resolution": [0, 4]}, {"bounces": 3}, {"passes": ["Magic"]}]
)
def test_bad_settings(bad):
    with pytest.raises(segue.SegueError) as caught:
        segue.Render(lit_scene(), settings(**bad))
    assert caught.value.status in (1, 2)


def test_a_rectangle_outside_the_film():
    render = segue.Render(lit_scene(), settings())
    with pytest.raises(segue.BadArgumentError, match="outside"):
        render.read_pass("Combined", (10, 0, 10, 5))
    with pytest.raises(segue.SegueError, match="Magic"):
        render.read_pass("Magic")


def endless(**more):
    return settings(samples=0, time=60, resolution=[64, 64], **more)


def test_progress_and_cancelling_by_its_answer():
    reports = []
    render = segue.Render(lit_scene(), endless())

    def progress(report):
        reports.append(report)
        return report["samples"] >= 2

    began = time.monotonic()
    assert render.run(progress) is False
    assert time.monotonic() - began < 20
    assert {"fraction", "seconds", "remaining", "samples", "estimated_error", "stage"} <= set(
        reports[-1]
    )
    assert render.read_pass("Combined")[..., :3].max() > 0


def test_tiles_cover_the_film():
    seen = np.zeros((64, 64), bool)

    def tile(x, y, width, height):
        seen[y : y + height, x : x + width] = True

    render = segue.Render(lit_scene(), settings(resolution=[64, 64], samples=2))
    assert render.run(tile=tile)
    assert seen.all()


class BoomError(Exception):
    """Raised by a callback."""


@pytest.mark.parametrize("which", ["progress", "tile"])
def test_an_exception_in_a_callback_cancels_and_is_raised(which):
    def fail(*_):
        raise BoomError

    render = segue.Render(lit_scene(), endless())
    began = time.monotonic()
    with pytest.raises(BoomError):
        render.run(**{which: fail})
    assert time.monotonic() - began < 20
    assert render.read_pass("Combined").shape == (64, 64, 4)


def test_cancel_from_another_thread_while_python_goes_on():
    render = segue.Render(lit_scene(), endless())
    ticks = []

    def watch():
        for _ in range(5):
            time.sleep(0.05)
            ticks.append(render.read_pass("Combined").shape)
        render.cancel()

    thread = threading.Thread(target=watch)
    thread.start()
    assert render.run() is False
    thread.join()
    assert ticks == [(64, 64, 4)] * 5


def test_a_render_goes_on_after_being_cancelled():
    render = segue.Render(lit_scene(), settings(samples=6, resolution=[64, 64]))
    assert render.run(lambda report: report["samples"] >= 1) is False
    assert render.run() is True
    assert render.stats()["samples"] >= 6


def test_interrupt_from_the_keyboard():
    code = """
import os, signal, sys, threading
sys.path[:0] = sys.argv[1:3]
import segue
from test_engine import endless, lit_scene
render = segue.Render(lit_scene(), endless())
# a test that runs in the background of a shell inherits an ignored signal
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    render.run()
except KeyboardInterrupt:
    print("interrupted", float(render.read_pass("Combined")[..., :3].max()) > 0)
"""
    here = os.path.dirname(__file__)
    package = os.path.dirname(os.path.dirname(segue.__file__))
    done = subprocess.run(
        [sys.executable, "-c", code, package, here],
        capture_output=True,
        text=True,
        timeout=50,
        check=True,
    )
    assert done.stdout.split() == ["interrupted", "True"], done.stderr


def test_exr_bytes_and_file(tmp_path):
    pytest.importorskip("OpenImageIO")
    from segue import images

    render = segue.Render(lit_scene(), settings())
    render.run()
    picture = render.read_pass("Combined")[..., :3]
    render.write_exr(tmp_path / "whole.exr", half=False, attributes={"note": "a test"})
    np.testing.assert_array_equal(images.read_rgb(str(tmp_path / "whole.exr")), picture)
    (tmp_path / "part.exr").write_bytes(render.read_exr(4, 2, 8, 6))
    part = images.read_rgb(str(tmp_path / "part.exr"))
    np.testing.assert_allclose(part, picture[2:8, 4:12], rtol=2e-3)


def test_a_file_that_cannot_be_written(tmp_path):
    render = segue.Render(lit_scene(), settings(samples=1))
    render.run()
    with pytest.raises(segue.OutputError, match="gone"):
        render.write_exr(tmp_path / "gone" / "x.exr")


def test_statistics():
    render = segue.Render(lit_scene(), settings())
    render.run()
    stats = render.stats()
    assert stats["samples"] == 8
    assert stats["rays"] >= 16 * 12 * 8
    assert stats["non_finite"] == 0
    assert json.dumps(stats)


def test_the_same_seed_is_the_same_picture():
    def picture(**more):
        render = segue.Render(lit_scene(), settings(**more))
        render.run()
        return render.read_pass("Combined")

    np.testing.assert_array_equal(picture(), picture(threads=2))
    assert not np.array_equal(picture(), picture(seed=1))


def test_the_scene_may_go_before_the_render():
    render = segue.Render(lit_scene(), settings())
    assert render.run()


@pytest.mark.parametrize("content", [None, b"not a library"])
def test_a_library_that_cannot_be_used(tmp_path, content):
    path = tmp_path / "libsegue.so"
    if content is not None:
        path.write_bytes(content)
    code = "import segue\ntry:\n segue.Scene()\nexcept segue.LibraryError as e:\n print(e)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={
            **os.environ,
            "SEGUE_LIBRARY": str(path),
            "PYTHONPATH": os.path.dirname(os.path.dirname(segue.__file__)),
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert str(path) in done.stdout


def test_a_library_of_another_abi_version(tmp_path):
    import shutil

    if not shutil.which("cc"):
        pytest.skip("no C compiler")
    source = tmp_path / "other.c"
    source.write_text("unsigned segue_abi_version(void) { return 999; }")
    path = tmp_path / "libsegue.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", path, source], check=True)
    code = "import segue\ntry:\n segue.Scene()\nexcept segue.LibraryError as e:\n print(e)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={
            **os.environ,
            "SEGUE_LIBRARY": str(path),
            "PYTHONPATH": os.path.dirname(os.path.dirname(segue.__file__)),
        },
        capture_output=True,
        text=True,
        check=True,
    )
    assert "999" in done.stdout
