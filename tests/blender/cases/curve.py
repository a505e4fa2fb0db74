"""The curve of error against run time: its picture, the image, the panel and the files."""

from __future__ import annotations

import csv
import math
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy
import numpy as np
from blender_addon import curve, history, panels, plot, preferences
from mathutils import Matrix

import builders
import fake_segue

OUTPUT = builders.OUTPUT


def _point(seconds: Any, error: Any, bias: Any = None, samples: float = 1.0) -> dict[str, Any]:
    return {
        "seconds": seconds,
        "samples": samples,
        "estimated_error": error,
        "estimated_bias": bias,
    }


def _prepare() -> bpy.types.Scene:
    scene = builders.settings(16, 12)
    builders.camera(Matrix.Translation((0, 0, 5)))
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(OUTPUT / "picture.png")
    return scene


def _curve(*points: dict[str, Any]) -> list[dict[str, Any]]:
    """Let the next renders have this curve."""
    fake_segue.CURVE[:] = points
    return list(points)


def _has(picture: np.ndarray, color: tuple[int, ...]) -> np.ndarray:
    return (picture == np.array(color)).all(-1)


def _pixels(image: bpy.types.Image) -> np.ndarray:
    """Bytes of an image, row 0 on top."""
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    values = values.reshape(image.size[1], image.size[0], 4)[::-1]
    return np.rint(255.0 * values[..., :3]).astype(np.uint8)


def _files() -> set[str]:
    return {str(p.relative_to(OUTPUT)) for p in OUTPUT.rglob("*_error*") if p.is_file()}


def _read_table(path: Path) -> list[dict[str, float | None]]:
    with path.open(encoding="utf-8", newline="") as file:
        return [
            {k: float(v) if v else None for k, v in row.items()} for row in csv.DictReader(file)
        ]


def case_curves_are_drawn_at_their_places() -> None:
    # 100 % after 1 s, 10 % after 10 s, 1 % after 100 s, and half as steep below: both axes are
    # from 1 to 100.
    picture = plot.draw([_point(1.0, 1.0), _point(10.0, 0.01, 25e-4), _point(100.0, 1e-4, 2.5e-4)])

    def place(seconds: float, percent: float) -> tuple[int, int]:
        x = plot.LEFT + math.log10(seconds) / 2 * (plot.RIGHT - plot.LEFT)
        y = plot.BOTTOM - math.log10(percent) / 2 * (plot.BOTTOM - plot.TOP)
        return round(y), round(x)

    error, bias = _has(picture, plot.ERROR), _has(picture, plot.BIAS)
    root = math.sqrt(10.0)
    for seconds, percent in ((1, 100), (root, 10 * root), (10, 10), (10 * root, root), (100, 1)):
        row, column = place(seconds, percent)
        assert error[row - 1 : row + 2, column - 1 : column + 2].any(), (seconds, percent)
    for seconds, percent in ((10, 5.0), (10 * root, 5 / 10**0.25), (100, 5 / root)):
        row, column = place(seconds, percent)
        assert bias[row - 1 : row + 2, column - 1 : column + 2].any(), (seconds, percent)
    # Everywhere within the axes the line is where the formula says, and nowhere else.
    for column in range(plot.LEFT + 4, plot.RIGHT - 4):
        rows = np.flatnonzero(error[plot.TOP : plot.BOTTOM + 1, column]) + plot.TOP
        share = (column - plot.LEFT) / (plot.RIGHT - plot.LEFT)
        expected = plot.TOP + share * (plot.BOTTOM - plot.TOP)
        assert len(rows) and np.abs(rows - expected).max() <= 4, (column, rows, expected)
    # The bias is not known before 10 s.
    half = (plot.LEFT + plot.RIGHT) // 2 - 8
    assert not bias[plot.TOP :, :half].any() and bias[plot.TOP :, half:].any()


def case_the_grid_is_at_decades() -> None:
    picture = plot.draw([_point(1.0, 1.0), _point(100.0, 1e-4)])
    row, column = plot.BOTTOM - 20, (plot.LEFT + plot.RIGHT) // 2
    assert tuple(picture[row, column]) == plot.COARSE
    fine = round(plot.LEFT + math.log10(2.0) / 2 * (plot.RIGHT - plot.LEFT))
    assert tuple(picture[row, fine]) == plot.FINE
    assert tuple(picture[row, fine + 10]) == plot.GROUND
    middle = (plot.TOP + plot.BOTTOM) // 2
    assert tuple(picture[middle, plot.LEFT + 20]) == plot.COARSE
    # Numbers are below and on the left.
    text = _has(picture, plot.TEXT)
    assert text[plot.BOTTOM + 1 :, column - 12 : column + 12].any() and text[:, : plot.LEFT].any()


def case_errors_are_roots_in_percent() -> None:
    points = [_point(1.0, 1.0, 1e-6), _point(2.0, 4e-4), _point(3.0, 0.0)]
    seconds, percent = curve.series(points, "estimated_error")
    np.testing.assert_allclose(seconds, [1.0, 2.0, math.nan])
    np.testing.assert_allclose(percent, [100.0, 2.0, math.nan])
    np.testing.assert_allclose(curve.series(points, "estimated_bias")[1], [0.1, math.nan, math.nan])


def case_axes_hold_their_values() -> None:
    for values, ends in (
        ([1.0, 100.0], (1.0, 100.0)),
        ([0.3, 7.0], (0.2, 10.0)),
        ([3.0], (2.0, 5.0)),
        ([1.0], (0.5, 2.0)),
        ([1000.0], (500.0, 2000.0)),
        ([math.nan], (1.0, 10.0)),
        # No more than three decades below the greatest.
        ([1e-9, 20.0], (0.02, 20.0)),
    ):
        axis = curve.Axis.around(np.array(values), 3.0)
        np.testing.assert_allclose((axis.low, axis.high), ends, rtol=1e-9)
        assert len(axis.labels()) >= 2, axis
    assert list(curve.Axis(0.001, 1e5).labels().values()) == [
        *("0.001", "0.01", "0.1", "1", "10", "100", "1000", "10000", "1e5")
    ]
    assert list(curve.Axis(0.2, 2.0).labels().values()) == ["0.2", "0.5", "1", "2"]
    assert "1e-4" in curve.Axis(1e-5, 1.0).labels().values()


def case_broken_curves_have_a_picture() -> None:
    nothing = (
        [],
        [_point(1.0, None)],
        [_point(1.0, 0.0, 0.0), _point(2.0, 0.0, 0.0)],
        [_point(1.0, math.nan), _point(2.0, math.inf), _point(3.0, -1.0)],
        [_point(0.0, 0.5), _point(None, 0.5), _point(math.nan, 0.5)],
        [_point(1e300, 1e300), _point(5e-324, 5e-324)],
        [{}],
    )
    for points in nothing:
        picture = plot.draw(points)
        assert picture.shape == (plot.SIZE, plot.SIZE, 3) and picture.dtype == np.uint8
        # Some words instead of axes.
        assert _has(picture, plot.TEXT).any() and not _has(picture, plot.BORDER).any(), points
        assert not (_has(picture, plot.ERROR) | _has(picture, plot.BIAS)).any(), points
    something = (
        [_point(3.0, 0.5)],
        [_point(1.0, math.nan), _point(2.0, 0.5), _point(4.0, 0.0)],
        # Neither order nor distance is to be relied upon.
        [_point(2.0, 0.5), _point(1.0, 0.4), _point(1.0, 0.4)],
        [_point(1e-20, 1e-20), _point(1e20, 1e20)],
        [_point(1, 1), _point(7, 0.1, 1e-30)],
    )
    for points in something:
        picture = plot.draw(points)
        drawn = _has(picture, plot.ERROR)[plot.TOP :]
        assert drawn.any(), points
    # A gap is not bridged.
    gap = plot.draw([_point(1.0, 1.0), _point(10.0, None), _point(100.0, 1e-4)])
    middle = (plot.LEFT + plot.RIGHT) // 2
    assert not _has(gap, plot.ERROR)[plot.TOP :, middle - 40 : middle + 40].any()


def case_png_files_are_readable() -> None:
    picture = plot.draw(_curve(_point(1.0, 1.0), _point(100.0, 1e-4)))
    path = OUTPUT / "curve.png"
    path.write_bytes(plot.png(picture))
    np.testing.assert_array_equal(_pixels(bpy.data.images.load(str(path))), picture)


def case_the_image_shows_the_last_render() -> None:
    _prepare()
    assert history.IMAGE not in bpy.data.images
    first = _curve(_point(1.0, 1.0), _point(100.0, 1e-4))
    builders.render()
    image = bpy.data.images[history.IMAGE]
    np.testing.assert_array_equal(_pixels(image), plot.draw(first))
    assert _pixels(image).std() > 1.0
    second = _curve(_point(1.0, 0.01), _point(9.0, 0.001, 1e-4))
    builders.render()
    again = bpy.data.images[history.IMAGE]
    assert again.as_pointer() == image.as_pointer()
    assert sum(item.name.startswith(history.IMAGE) for item in bpy.data.images) == 1
    np.testing.assert_array_equal(_pixels(again), plot.draw(second))
    assert (plot.draw(first) != plot.draw(second)).any()


def case_the_image_is_no_part_of_the_file() -> None:
    _prepare()
    builders.render()
    image = bpy.data.images[history.IMAGE]
    assert (image.users, image.use_fake_user, image.packed_file) == (0, False, None)
    # A changed image would be packed on closing.
    assert not image.is_dirty
    path = str(OUTPUT / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert history.IMAGE not in bpy.data.images
    assert history.shown(bpy.context.scene) is None
    builders.render()
    assert bpy.data.images[history.IMAGE].users == 0
    assert history.shown(bpy.context.scene) is not None


def case_an_image_that_was_saved_is_used_again() -> None:
    _prepare()
    builders.render()
    image = bpy.data.images[history.IMAGE]
    image.use_fake_user = True
    image.pack()
    path = str(OUTPUT / "scene.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert history.IMAGE in bpy.data.images
    points = _curve(_point(1.0, 0.01), _point(9.0, 0.001, 1e-4))
    builders.render()
    names = [item.name for item in bpy.data.images if item.name.startswith(history.IMAGE)]
    assert names == [history.IMAGE]
    image = bpy.data.images[history.IMAGE]
    np.testing.assert_array_equal(_pixels(image), plot.draw(points))
    assert image.packed_file is None


def case_files_are_written_only_where_asked() -> None:
    _prepare()
    points = _curve(
        _point(0.1, None, None, 1.0),
        _point(1.0 / 3.0, 0.1 + 0.2, 1e-17, 2.5),
        _point(2.0, 0.0123456789012345, None, 7.0),
    )
    builders.render(write_still=True)
    assert not _files()
    preferences.current().write_error_curve = True
    builders.render()
    assert not _files(), "nothing was written, so there is nothing to be beside"
    builders.render(write_still=True)
    assert _files() == {"picture_error.csv", "picture_error.png"}
    assert _read_table(OUTPUT / "picture_error.csv") == points
    header = (OUTPUT / "picture_error.csv").read_text().splitlines()[0]
    assert header == "seconds,samples,estimated_error,estimated_bias"
    saved = bpy.data.images.load(str(OUTPUT / "picture_error.png"))
    np.testing.assert_array_equal(_pixels(saved), plot.draw(points))
    for name in _files():
        (OUTPUT / name).unlink()
    preferences.current().write_error_curve = False
    builders.render(write_still=True)
    assert not _files()


def case_every_frame_of_an_animation_has_its_files() -> None:
    scene = _prepare()
    scene.frame_start, scene.frame_end = 3, 4
    scene.render.filepath = str(OUTPUT / "frame_")
    preferences.current().write_error_curve = True
    original = fake_segue.Render.stats

    def stats(self: fake_segue.Render) -> dict[str, Any]:
        _curve(_point(float(scene.frame_current), 0.5))
        return original(self)

    fake_segue.Render.stats = stats
    bpy.ops.render.render(animation=True)
    assert _files() == {f"frame_000{i}_error.{kind}" for i in (3, 4) for kind in ("csv", "png")}
    for frame in (3, 4):
        (row,) = _read_table(OUTPUT / f"frame_000{frame}_error.csv")
        assert row["seconds"] == frame


def case_files_are_beside_their_output_whatever_its_name() -> None:
    scene = _prepare()
    scene.frame_start = scene.frame_end = scene.frame_current = 7
    preferences.current().write_error_curve = True
    names = ["p", "p.png", "p.exr", "p.bar", "p.PNG", "p_##", "#_#.png"]
    names += ["p_0007", "p.0001.png", "é p", "d/"]
    if bpy.app.version >= (5, 0, 0):
        names += ["{resolution_x}", "{fps}_##_0001.png"]
    for extension in (True, False):
        scene.render.use_file_extension = extension
        for index, name in enumerate(names):
            # Without extension this is no file's name.
            stills = [True] if extension or name != "d/" else []
            for still in (*stills, False):
                folder = OUTPUT / f"{extension}{index}{still}"
                scene.render.filepath = f"{folder}/{name}"
                bpy.ops.render.render(write_still=still, animation=not still)
                found = {p for p in folder.rglob("*") if p.is_file()}
                written = {p for p in found if "_error." not in p.name}
                (output,) = written
                named = output.suffix.lower() in {".png", ".exr"} or output.name == ".png"
                stem = output.name[:-4] if named else output.name
                beside = {output.with_name(f"{stem}_error{end}") for end in (".csv", ".png")}
                assert found - written == beside, (name, extension, still, found)


def case_a_movie_has_files_of_every_frame() -> None:
    scene = _prepare()
    if bpy.app.version >= (5, 0, 0):
        scene.render.image_settings.media_type = "VIDEO"
    scene.render.image_settings.file_format = "FFMPEG"
    scene.frame_start, scene.frame_end, scene.frame_current = 1, 2, 2
    scene.render.filepath = str(OUTPUT / "film_")
    stem = history.output_stem(scene, animation=True)
    assert stem == str(OUTPUT / "film_0001-0002_0002"), stem


def case_view_layers_have_files_of_their_own() -> None:
    scene = _prepare()
    scene.view_layers[0].name = "Front"
    scene.view_layers.new("Far away")
    preferences.current().write_error_curve = True
    builders.render(write_still=True)
    assert _files() == {
        f"picture_{layer}_error.{kind}"
        for layer in ("Front", "Far_away")
        for kind in ("csv", "png")
    }
    assert history.shown(scene).text == "Far away: Error 0.1"
    # A layer that is no longer rendered leaves nothing behind.
    scene.view_layers["Front"].use = False
    scene.render.filepath = str(OUTPUT / "other.png")
    builders.render(write_still=True)
    assert {name for name in _files() if name.startswith("other")} == {
        "other_error.csv",
        "other_error.png",
    }


def case_preferences_of_the_enabled_add_on_count() -> None:
    _prepare()
    assert not preferences.current().write_error_curve
    preferences.current().write_error_curve = True
    addon = bpy.context.preferences.addons.new()
    addon.module = "blender_addon"
    # Blender's preferences stand above what was set before there were any.
    assert not addon.preferences.write_error_curve
    builders.render(write_still=True)
    assert not _files()
    addon.preferences.write_error_curve = True
    builders.render(write_still=True)
    assert _files() == {"picture_error.csv", "picture_error.png"}
    bpy.context.preferences.addons.remove(addon)


def case_a_stopped_render_is_shown_and_not_written() -> None:
    from blender_addon.engine import SegueRenderEngine

    scene = _prepare()
    preferences.current().write_error_curve = True
    original = SegueRenderEngine.stop_requested
    SegueRenderEngine.stop_requested = lambda self: bool(fake_segue.RENDERS)
    builders.render(write_still=True)
    SegueRenderEngine.stop_requested = original
    assert fake_segue.RENDERS[-1].cancelled
    assert not _files()
    assert history.shown(scene).text == "Error 0.1"


def case_previews_are_not_kept() -> None:
    from blender_addon import job

    class Preview:
        """An engine that renders a preview."""

        is_preview = True

        def __init__(self, engine: Any) -> None:
            self._engine = engine

        def __getattr__(self, name: str) -> Any:
            return getattr(self._engine, name)

    scene = _prepare()
    original = job.run
    job.run = lambda engine, *arguments: original(Preview(engine), *arguments)
    builders.render()
    job.run = original
    assert fake_segue.RENDERS
    assert history.shown(scene) is None and history.IMAGE not in bpy.data.images
    builders.render()
    assert history.shown(scene) is not None


def case_a_render_never_fails_for_its_curve() -> None:
    _prepare()
    preferences.current().write_error_curve = True
    original = plot.draw

    def broken(points: Any) -> np.ndarray:
        raise ValueError("out of ink")

    plot.draw = broken
    warnings = builders.warned(lambda: builders.render(write_still=True))
    plot.draw = original
    assert (OUTPUT / "picture.png").exists()
    assert warnings and all("out of ink" in text for text in warnings), warnings

    for points in ([], [_point(math.nan, math.nan)], [{}], [_point("soon", "little")], [None]):
        _curve()
        fake_segue.CURVE.extend(points)
        stats, fake_segue.Render.stats = fake_segue.Render.stats, _stats
        builders.warned(lambda: builders.render(write_still=True))
        fake_segue.Render.stats = stats
    # Files that cannot be written.
    _curve(_point(1.0, 0.5))
    for name in _files():
        (OUTPUT / name).unlink()
    (OUTPUT / "picture_error.csv").mkdir()
    warnings = builders.warned(lambda: builders.render(write_still=True))
    assert len(warnings) == 1 and "picture_error.csv" in warnings[0], warnings
    # The next render works.
    (OUTPUT / "picture_error.csv").rmdir()
    assert not builders.warned(lambda: builders.render(write_still=True))
    assert _files() == {"picture_error.csv", "picture_error.png"}


def _stats(self: fake_segue.Render) -> dict[str, Any]:
    return {"samples": 4, "seconds": 0.4, "curve": list(fake_segue.CURVE)}


def case_statistics_without_a_curve_are_enough() -> None:
    scene = _prepare()
    original = fake_segue.Render.stats
    fake_segue.Render.stats = lambda self: {"samples": 4, "seconds": 0.4}
    assert not builders.warned(builders.render)
    fake_segue.Render.stats = original
    assert history.shown(scene).text == "Error -"
    np.testing.assert_array_equal(_pixels(bpy.data.images[history.IMAGE]), plot.draw([]))


def case_blender_is_left_alone_outside_the_main_thread() -> None:
    scene = _prepare()
    run = history.Run("Layer", "", [_point(1.0, 1.0), _point(9.0, 0.1)], "Error 1", False, True)

    def end() -> None:
        history.keep(scene, run)
        history._on_end(scene)

    thread = threading.Thread(target=end)
    thread.start()
    thread.join()
    assert history.IMAGE not in bpy.data.images and history.shown(scene) is None
    assert bpy.app.timers.is_registered(history._poll)
    assert history._poll() > 0.0
    assert history.shown(scene).text == "Error 1"
    np.testing.assert_array_equal(_pixels(bpy.data.images[history.IMAGE]), plot.draw(run.points))


class _Layout:
    """Records what a panel shows."""

    def __init__(self) -> None:
        self.labels: list[str] = []
        self.icons: list[tuple[int, float]] = []

    def label(self, text: str) -> None:
        self.labels.append(text)

    def template_icon(self, icon_value: int, scale: float) -> None:
        self.icons.append((icon_value, scale))


def _panel(scene: bpy.types.Scene) -> _Layout:
    layout = _Layout()
    context = SimpleNamespace(
        scene=scene,
        region=SimpleNamespace(width=400),
        preferences=bpy.context.preferences,
    )
    panels.SEGUE_RENDER_PT_error.draw(SimpleNamespace(layout=layout), context)
    return layout


def case_the_panel_shows_the_curve_of_its_scene() -> None:
    scene = _prepare()
    assert not _panel(scene).icons and len(_panel(scene).labels) == 1
    points = _curve(_point(1.0, 0.25), _point(2.0, 0.125))
    builders.render()
    found = _panel(scene)
    assert found.labels == ["Error 0.125"]
    ((icon, scale),) = found.icons
    assert icon == history.shown(scene).icon and 6.0 <= scale <= 30.0
    preview = history._previews[str(scene.session_uid)]
    assert tuple(preview.image_size) == (plot.SIZE, plot.SIZE)
    pixels = np.empty(4 * plot.SIZE**2, np.float32)
    preview.image_pixels_float.foreach_get(pixels)
    pixels = pixels.reshape(plot.SIZE, plot.SIZE, 4)[::-1]
    assert (pixels[..., 3] == 1.0).all()
    np.testing.assert_array_equal(
        np.rint(255 * pixels[..., :3]).astype(np.uint8), plot.draw(points)
    )
    # Another scene has had no render.
    other = bpy.data.scenes.new("Other")
    assert not _panel(other).icons
    # The panel is there, and listens to this engine alone.
    assert panels.SEGUE_RENDER_PT_error.is_registered
    assert panels.SEGUE_RENDER_PT_error.poll(SimpleNamespace(engine="SEGUE"))
    assert not panels.SEGUE_RENDER_PT_error.poll(SimpleNamespace(engine="CYCLES"))


def case_nothing_listens_after_unregistering() -> None:
    import blender_addon

    def listening() -> list[Any]:
        groups = (getattr(bpy.app.handlers, name) for name in history._HANDLERS)
        return [f for group in groups for f in group if f.__module__ == history.__name__]

    assert len(listening()) == len(history._HANDLERS)
    blender_addon.unregister()
    left, timed = listening(), bpy.app.timers.is_registered(history._poll)
    blender_addon.register()
    assert not left and not timed
    _prepare()
    builders.render()
    assert history.IMAGE in bpy.data.images
