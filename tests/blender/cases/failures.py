"""What happens when something goes wrong: an error in Blender's way, never a crash."""

from __future__ import annotations

import bpy
from mathutils import Matrix

import builders
import fake_segue

OUTPUT = builders.OUTPUT


def _render_fails(text: str) -> None:
    """F12 with a file to write must fail with `text` and leave Blender alive."""
    scene = bpy.context.scene
    scene.render.filepath = str(OUTPUT / "never.png")
    try:
        builders.render(write_still=True)
    except RuntimeError as error:
        assert text in str(error), error
    else:
        raise AssertionError("the render did not fail")
    assert not (OUTPUT / "never.png").exists()
    # The next render works.
    if scene.camera is None:
        builders.camera(Matrix.Translation((0, 0, 5)))


def _prepare() -> None:
    builders.settings()
    builders.camera(Matrix.Translation((0, 0, 5)))


def case_exception_in_the_export() -> None:
    _prepare()
    builders.link(builders.cube())
    original = fake_segue.Scene.add_mesh

    def broken(self: fake_segue.Scene, name: str, *arguments: object, **rest: object) -> int:
        raise fake_segue.SegueError(f"mesh '{name}': broken on purpose")

    fake_segue.Scene.add_mesh = broken
    _render_fails("mesh 'Cube': broken on purpose")
    fake_segue.Scene.add_mesh = original
    builders.render()


def case_exception_while_rendering() -> None:
    _prepare()
    original = fake_segue.Render.run

    def broken(self: fake_segue.Render, progress: object = None, tile: object = None) -> bool:
        raise fake_segue.SegueError("out of luck")

    fake_segue.Render.run = broken
    _render_fails("out of luck")
    fake_segue.Render.run = original
    builders.render()


def case_exception_in_every_call() -> None:
    """Whatever raises, Blender survives and says so."""
    _prepare()
    builders.link(builders.cube())
    for owner, name in (
        (fake_segue.Scene, "add_material"),
        (fake_segue.Scene, "add_instances"),
        (fake_segue.Scene, "set_camera"),
        (fake_segue.Scene, "info"),
        (fake_segue.Render, "read_pass"),
        (fake_segue.Render, "stats"),
    ):
        original = getattr(owner, name)

        def broken(*arguments: object, _name: str = name, **rest: object) -> None:
            raise ValueError(f"{_name} failed")

        setattr(owner, name, broken)
        _render_fails(f"{name} failed")
        setattr(owner, name, original)
    builders.render()


def case_no_camera() -> None:
    builders.settings()
    try:
        builders.render()
    except RuntimeError as error:
        assert "camera" in str(error).lower(), error
    else:
        raise AssertionError("a render without a camera did not fail")


def case_empty_scene() -> None:
    _prepare()
    bpy.context.scene.render.filepath = str(OUTPUT / "empty.png")
    builders.render(write_still=True)
    assert (OUTPUT / "empty.png").exists()


def case_nothing_would_end_the_render() -> None:
    _prepare()
    bpy.context.scene.segue.samples = 0
    _render_fails("would never end")


def case_cancel() -> None:
    from blender_addon.engine import SegueRenderEngine

    _prepare()
    bpy.context.scene.render.filepath = str(OUTPUT / "cancelled.png")
    calls = []

    def stop(self: SegueRenderEngine) -> bool:
        calls.append(1)
        return bool(fake_segue.RENDERS)

    original, SegueRenderEngine.stop_requested = SegueRenderEngine.stop_requested, stop
    builders.render(write_still=True)
    assert fake_segue.RENDERS[-1].cancelled and calls
    # A cancelled export starts no render at all, and an empty picture is written.
    SegueRenderEngine.stop_requested = lambda self: True
    count = len(fake_segue.RENDERS)
    builders.render(write_still=True)
    assert len(fake_segue.RENDERS) == count
    SegueRenderEngine.stop_requested = original


def case_meshes_without_faces() -> None:
    _prepare()
    builders.link(builders.mesh("Nothing", [], []))
    data = bpy.data.meshes.new("Edge")
    data.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    builders.link(data)
    scene, warnings = builders.export()
    assert not scene.meshes and not scene.instances and not warnings


def case_things_that_are_left_out_are_named() -> None:
    _prepare()
    bpy.context.scene.render.use_motion_blur = True
    curves = bpy.data.hair_curves.new("Strands")
    builders.link(curves, "Strands")
    builders.link(bpy.data.volumes.new("Smoke"), "Smoke")
    bpy.context.view_layer.use_pass_mist = True
    item = builders.link(builders.cube(), "Catcher")
    item.is_shadow_catcher = True
    _, warnings = builders.export()
    for word in ("Motion blur", "Strands", "Smoke", "Mist", "Catcher"):
        assert sum(word in text for text in warnings) == 1, (word, warnings)


def case_missing_engine_is_explained() -> None:
    import sys

    from blender_addon import library

    sys.modules["segue"] = None
    try:
        library.load()
    except library.EngineMissingError as error:
        assert "not available" in str(error) and "Install" in str(error)
    else:
        raise AssertionError("a missing package was not noticed")

    def broken() -> None:
        raise OSError("libsegue.so: wrong ELF class")

    fake_segue.Scene, original = broken, fake_segue.Scene
    sys.modules["segue"] = fake_segue
    try:
        library.load()
    except library.EngineMissingError as error:
        assert "wrong ELF class" in str(error)
    else:
        raise AssertionError("a broken library was not noticed")
    fake_segue.Scene = original


def case_what_the_engine_finds_while_rendering_is_told_once() -> None:
    _prepare()
    fake_segue.WARNINGS[:] = ['material "M": more than 10 lobes may meet in a point']
    bpy.context.scene.render.use_motion_blur = True
    _, warnings = builders.export()
    fake_segue.WARNINGS.clear()
    assert sum("10 lobes" in text for text in warnings) == 1, warnings
    assert sum("Motion blur" in text for text in warnings) == 1, warnings


def case_news_are_given_once() -> None:
    from blender_addon.log import ExportLog

    log = ExportLog()
    log.warn("one")
    assert log.news() == ["one"]
    log.warn("one")
    log.warn("two")
    assert log.news() == ["two"] and log.news() == []


def case_objects_nowhere_are_left_out() -> None:
    _prepare()
    builders.link(builders.cube(), "Lost", Matrix.Translation((float("nan"), 0, 0)))
    builders.light("POINT", Matrix.Translation((0, float("nan"), 0)), name="Astray")
    builders.light("POINT", name="Blinding", color=(1, 1, 1), energy=float("inf"))
    scene, warnings = builders.export()
    assert not scene.instances and not scene.lights
    for name in ("Lost", "Astray", "Blinding"):
        assert sum(f"'{name}'" in text for text in warnings) == 1, (name, warnings)


def case_a_camera_nowhere_is_named() -> None:
    builders.settings()
    builders.camera(Matrix.Translation((float("nan"), 0, 5)))
    _render_fails("camera 'Camera': its transform is not finite")


def case_settings_of_cycles_that_are_left_out_are_named() -> None:
    _prepare()
    scene = bpy.context.scene
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = False
    scene.render.film_transparent = scene.cycles.film_transparent_glass = True
    _, warnings = builders.export()
    for text in ("reflective caustics", "refractive caustics", "Transparent glass"):
        assert sum(text in warning for warning in warnings) == 1, (text, warnings)
    scene.render.film_transparent = False
    assert not any("Transparent glass" in text for text in builders.export()[1])


def case_passes_of_cycles_that_are_left_out_are_named() -> None:
    _prepare()
    layer = bpy.context.view_layer
    layer.aovs.add().name = "Mask"
    layer.lightgroups.add(name="Key")
    layer.cycles.denoising_store_passes = True
    layer.cycles.pass_debug_sample_count = True
    layer.cycles.use_pass_volume_direct = True
    (text,) = builders.export()[1]
    for name in ("AOV 'Mask'", "Light Group 'Key'", "Denoising Data", "Sample Count", "Volume"):
        assert name in text, (name, text)
