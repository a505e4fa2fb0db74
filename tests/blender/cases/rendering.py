"""F12 with the real engine: passes, film, border, layers, time, cancelling, animation, threads."""

from __future__ import annotations

import threading
import time

import bpy
import numpy as np
from mathutils import Euler, Matrix

import builders

OUTPUT = builders.OUTPUT
OBJECT, MATERIAL = (
    ("Object Index", "Material Index") if bpy.app.version >= (5, 0, 0) else ("IndexOB", "IndexMA")
)
EMISSION = "Emission" if bpy.app.version >= (5, 0, 0) else "Emit"


def _scene(width: int = 64, height: int = 48) -> bpy.types.Scene:
    """A camera 5 above a glowing quad of half width 1 that lies in the plane z = 1."""
    scene = builders.settings(width, height)
    builders.camera(Matrix.Translation((0, 0, 5)), lens=36.0, sensor_width=36.0)
    data = builders.quad()
    data.materials.append(
        builders.shader_material("Emission", "Glow", Color=(0.2, 0.4, 0.8, 1), Strength=1.0)
    )
    data.materials[0].pass_index = 3
    builders.link(data, "Quad", Matrix.Translation((0, 0, 1))).pass_index = 7
    scene.segue.samples = 4
    scene.segue.pixel_filter = "box"
    scene.segue.filter_width = 1.0
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(OUTPUT / "picture.exr")
    return scene


def _picture() -> np.ndarray:
    builders.render(write_still=True)
    return builders.read(OUTPUT / "picture.exr")


def _passes(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """Every pass of a render, as the engine hands them to Blender."""
    from blender_addon import job

    seen: dict[str, np.ndarray] = {}
    original = job.Frame.write

    def write(self: job.Frame, pixels: dict[str, np.ndarray], **rest: object) -> None:
        seen.update(pixels)
        original(self, pixels, **rest)

    job.Frame.write = write
    builders.render()
    job.Frame.write = original
    return seen


def case_data_passes_have_their_values() -> None:
    scene = _scene()
    layer = bpy.context.view_layer
    for name in ("z", "position", "normal", "uv", "object_index", "material_index", "emit"):
        setattr(layer, f"use_pass_{name}", True)
    for name in ("albedo", "direct", "indirect"):
        setattr(layer.segue, f"use_pass_{name}", True)
    found = _passes(scene)
    # The film spans 5 units at distance 5, so 4 units at distance 4: the quad is its middle half.
    inside, outside = (24, 40), (2, 2)
    pixel = 4.0 / 64.0
    x, y = (inside[1] + 0.5 - 32) * pixel, (24 - inside[0] - 0.5) * pixel
    np.testing.assert_allclose(found["Depth"][inside], 4.0, rtol=1e-4)
    assert found["Depth"][outside][0] >= 1e9
    np.testing.assert_allclose(found["Position"][inside], (x, y, 1.0), atol=pixel)
    np.testing.assert_allclose(found["Normal"][inside], (0, 0, 1), atol=1e-3)
    uv = ((x + 1) / 2, (y + 1) / 2, 1.0)
    np.testing.assert_allclose(found["UV"][inside], uv, atol=pixel)
    assert (found[OBJECT][inside][0], found[OBJECT][outside][0]) == (7, 0)
    assert (found[MATERIAL][inside][0], found[MATERIAL][outside][0]) == (3, 0)
    np.testing.assert_allclose(found[EMISSION][inside], (0.2, 0.4, 0.8), rtol=1e-4)
    np.testing.assert_allclose(found["Combined"][inside][:3], (0.2, 0.4, 0.8), rtol=1e-4)


def case_light_passes_add_up() -> None:
    scene = _scene()
    _, _, background = builders.world()
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    data = builders.quad(size=4.0)
    data.materials.append(builders.shader_material("BsdfDiffuse", Color=(0.6, 0.3, 0.1, 1)))
    builders.link(data)
    layer = bpy.context.view_layer
    layer.use_pass_emit = True
    for name in ("albedo", "direct", "indirect"):
        setattr(layer.segue, f"use_pass_{name}", True)
    found = _passes(scene)
    total = found[EMISSION] + found["Direct"] + found["Indirect"]
    np.testing.assert_allclose(total, found["Combined"][..., :3], atol=1e-4)
    np.testing.assert_allclose(found["Albedo"][2, 2], (0.6, 0.3, 0.1), rtol=1e-3)
    assert found["Direct"][2, 2].min() > 0.0


def case_transparent_film() -> None:
    scene = _scene()
    _, _, background = builders.world()
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    scene.render.film_transparent = True
    picture = _picture()
    np.testing.assert_allclose(picture[2, 2], (0, 0, 0, 0), atol=1e-6)
    np.testing.assert_allclose(picture[24, 40], (0.2, 0.4, 0.8, 1), rtol=1e-4)
    scene.render.film_transparent = False
    np.testing.assert_allclose(_picture()[2, 2], (0.5, 0.5, 0.5, 1), rtol=1e-4)


def case_border_is_a_part_of_the_whole() -> None:
    scene = _scene()
    scene.segue.samples, scene.segue.integrator = 1, "path"
    data = builders.sphere()
    data.materials.append(builders.shader_material("BsdfDiffuse"))
    builders.link(data, matrix=Matrix.Translation((0.5, 0, 2)))
    builders.light("POINT", Matrix.Translation((3, 3, 5)), energy=500.0)
    whole = _picture()
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.3, 0.9
    render.border_min_y, render.border_max_y = 0.2, 0.7
    part = _picture()
    x0, x1 = int(0.3 * 64), int(np.float32(0.9) * np.float32(64))
    y0, y1 = int(np.float32(0.2) * np.float32(48)), int(np.float32(0.7) * np.float32(48))
    assert part.shape[:2] == (y1 - y0, x1 - x0)
    # The same samples: the border changes what is rendered, not how.
    np.testing.assert_allclose(part, whole[48 - y1 : 48 - y0, x0:x1], rtol=1e-4, atol=1e-6)


def case_percentage_shows_the_same_view() -> None:
    scene = _scene(128, 96)
    full = _picture()
    scene.render.resolution_percentage = 50
    half = _picture()
    assert half.shape == (48, 64, 4)
    np.testing.assert_allclose(half.mean(axis=(0, 1)), full.mean(axis=(0, 1)), rtol=0.05)


def case_time_limit_ends_the_render() -> None:
    scene = _scene(320, 240)
    scene.segue.samples = 0
    scene.segue.time_limit = 1.0
    start = time.monotonic()
    builders.render()
    assert 0.9 < time.monotonic() - start < 10.0


def case_cancelling_is_prompt_and_keeps_the_picture() -> None:
    from blender_addon.engine import SegueRenderEngine

    scene = _scene(320, 240)
    _, _, background = builders.world()
    background.inputs["Color"].default_value = (0.5, 0.5, 0.5, 1)
    scene.segue.samples = 10_000_000
    stop = threading.Event()
    original = SegueRenderEngine.stop_requested
    SegueRenderEngine.stop_requested = lambda self: stop.is_set()
    pressed: list[float] = []

    def press() -> None:
        pressed.append(time.monotonic())
        stop.set()

    timer = threading.Timer(2.0, press)
    timer.start()
    picture = _picture()
    latency = time.monotonic() - pressed[0]
    SegueRenderEngine.stop_requested = original
    assert latency < 3.0, latency
    np.testing.assert_allclose(picture[120, 200, :3], (0.2, 0.4, 0.8), rtol=1e-3)


def case_animation_moves() -> None:
    scene = _scene(32, 24)
    item = bpy.data.objects["Quad"]
    for frame, x in ((1, -0.6), (2, 0.6)):
        item.location.x = x
        item.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, 2
    scene.render.filepath = str(OUTPUT / "frame_")
    bpy.ops.render.render(animation=True)
    centres = []
    for frame in (1, 2):
        blue = builders.read(OUTPUT / f"frame_000{frame}.exr")[..., 2]
        centres.append((blue.sum(axis=0) * np.arange(32)).sum() / blue.sum())
    assert centres[1] - centres[0] > 6.0, centres


def case_seeds_and_threads() -> None:
    scene = _scene()
    data = builders.sphere()
    data.materials.append(builders.shader_material("BsdfDiffuse"))
    builders.link(data, matrix=Matrix.Translation((0.5, 0, 2)))
    builders.light("AREA", Matrix.Translation((1, 1, 5)), energy=500.0, size=2.0)
    first = _picture()
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    np.testing.assert_array_equal(_picture(), first)
    scene.segue.seed = 1
    assert np.abs(_picture() - first).max() > 1e-3


def case_stereo() -> None:
    from blender_addon import job

    scene = _scene()
    scene.render.use_multiview = True
    scene.camera.data.stereo.interocular_distance = 1.0
    scene.camera.data.stereo.convergence_mode = "PARALLEL"
    seen: dict[str, np.ndarray] = {}
    original = job.Frame.write

    def write(self: job.Frame, pixels: dict[str, np.ndarray], *, view: str, **rest: object) -> None:
        if pixels:
            seen[view] = pixels["Combined"][..., 2]
        original(self, pixels, view=view, **rest)

    job.Frame.write = write
    builders.render()
    job.Frame.write = original
    left, right = (
        (seen[eye].sum(axis=0) * np.arange(64)).sum() / seen[eye].sum() for eye in ("left", "right")
    )
    # One unit apart at distance 4, where the film spans 4 units: 16 pixels.
    assert abs(left - right - 16.0) < 0.5, (left, right)


def case_empty_scene_and_no_lights() -> None:
    builders.settings()
    builders.camera(Matrix.Translation((0, 0, 5)))
    scene = bpy.context.scene
    scene.segue.samples = 1
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(OUTPUT / "picture.exr")
    np.testing.assert_array_equal(_picture()[..., :3], 0.0)
    builders.link(builders.cube())
    np.testing.assert_array_equal(_picture()[..., :3], 0.0)


def case_broken_data_does_not_crash() -> None:
    """Flat, empty, non-finite and collapsed things."""
    scene = _scene()
    data = builders.cube("Broken")
    data.vertices[0].co = (float("nan"), 0, 0)
    data.vertices[1].co = (float("inf"), 0, 0)
    builders.link(data, "Broken")
    builders.link(builders.cube(), "Collapsed", Matrix.Diagonal((0, 0, 0, 1)))
    builders.link(builders.cube(), "Flat", Matrix.Diagonal((1, 0, 1, 1)))
    builders.link(builders.mesh("Line", [(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)]), "Line")
    builders.light("POINT", Matrix.Diagonal((0, 0, 0, 1)), energy=10.0)
    builders.light("AREA", Matrix.Diagonal((0, 1, 1, 1)), energy=10.0)
    far = builders.quad("Far")
    builders.link(
        far, "Far", Matrix.Translation((1e7, 0, 0)) @ Euler((1, 1, 1)).to_matrix().to_4x4()
    )
    picture = _picture()
    assert np.isfinite(picture).all()
    np.testing.assert_allclose(picture[24, 45, :3], (0.2, 0.4, 0.8), rtol=1e-3)
    assert scene.render.engine == "SEGUE"


def case_the_error_curve_is_that_of_the_statistics() -> None:
    from blender_addon import history, job, plot, preferences

    scene = _scene()
    builders.light("POINT", Matrix.Translation((0, 0, 3)), energy=50.0)
    builders.link(builders.quad("Floor", size=4.0))
    scene.segue.samples = 32
    preferences.current().write_error_curve = True
    told = []
    finish = job._finish

    def listen(engine: object, frame: object, stats: dict, error: str) -> None:
        told.append((stats, error))
        finish(engine, frame, stats, error)

    job._finish = listen
    _picture()
    job._finish = finish
    ((stats, error),) = told
    points = stats["curve"]
    assert points[-1]["estimated_error"] == stats["estimated_error"] > 0.0
    assert points[-1]["estimated_bias"] is not None

    lines = (OUTPUT / "picture_error.csv").read_text().splitlines()
    names = ("seconds", "samples", "estimated_error", "estimated_bias")
    assert lines[0] == ",".join(names)
    found = [[float(v) if v else None for v in line.split(",")] for line in lines[1:]]
    assert found == [[point[name] for name in names] for point in points]

    assert history.shown(scene).text == error.capitalize()
    picture = builders.read(OUTPUT / "picture_error.png")[..., :3]
    assert (np.rint(255 * picture) == plot.ERROR).all(-1).any()
    assert bpy.data.images[history.IMAGE].size[:] == (plot.SIZE, plot.SIZE)
