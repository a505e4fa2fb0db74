"""F12 with the recording package: passes, border, layers, files, animation, settings."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

import builders
import fake_segue

OUTPUT = builders.OUTPUT


def _prepare(width: int = 64, height: int = 48) -> bpy.types.Scene:
    scene = builders.settings(width, height)
    builders.camera(Matrix.Translation((0, 0, 5)))
    image = scene.render.image_settings
    image.file_format = "OPEN_EXR"
    image.color_depth = "32"
    scene.render.filepath = str(OUTPUT / "picture.exr")
    return scene


def _rendered() -> np.ndarray:
    builders.render(write_still=True)
    return builders.read(OUTPUT / "picture.exr")


def case_the_file_has_the_picture_the_right_way_up() -> None:
    _prepare()
    picture = _rendered()
    assert picture.shape == (48, 64, 4)
    # The recording package paints the column into red and the row, from the top, into green.
    np.testing.assert_array_equal(picture[..., 0], np.broadcast_to(np.arange(64.0), (48, 64)))
    np.testing.assert_array_equal(
        picture[..., 1], np.broadcast_to(np.arange(48.0)[:, None], (48, 64))
    )


def case_resolution_percentage() -> None:
    scene = _prepare()
    scene.render.resolution_percentage = 50
    assert _rendered().shape == (24, 32, 4)
    assert fake_segue.RENDERS[-1].settings["resolution"] == [32, 24]


def case_border_without_crop() -> None:
    scene = _prepare()
    render = scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.75
    render.border_min_y, render.border_max_y = 0.5, 1.0
    picture = _rendered()
    assert fake_segue.RENDERS[-1].settings["crop"] == [16, 0, 48, 24]
    assert picture.shape == (48, 64, 4)
    np.testing.assert_array_equal(picture[10, 16:48, 0], np.arange(16.0, 48.0))
    np.testing.assert_array_equal(picture[:24, 20, 1], np.arange(24.0))
    assert not picture[24:].any() and not picture[:, :16].any()


def case_border_with_crop_at_odd_places() -> None:
    scene = _prepare(101, 67)
    render = scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x, render.border_max_x = 0.123, 0.777
    render.border_min_y, render.border_max_y = 0.211, 0.639
    picture = _rendered()
    x0, y0, x1, y1 = fake_segue.RENDERS[-1].settings["crop"]
    assert picture.shape[:2] == (y1 - y0, x1 - x0)
    assert (x0, x1) == (int(0.123 * 101), int(0.777 * 101))
    # Rows count from the top here, from the bottom in Blender.
    assert (67 - y1, 67 - y0) == (int(0.211 * 67), int(0.639 * 67))
    np.testing.assert_array_equal(picture[0, :, 0], np.arange(x0, x1, dtype=np.float32))
    np.testing.assert_array_equal(picture[:, 0, 1], np.arange(y0, y1, dtype=np.float32))


def _multilayer(scene: bpy.types.Scene) -> None:
    image = scene.render.image_settings
    if bpy.app.version >= (5, 0, 0):
        image.media_type = "MULTI_LAYER_IMAGE"
    image.file_format = "OPEN_EXR_MULTILAYER"
    image.color_depth = "32"


def _channels(layer: bpy.types.ViewLayer, flags: bool) -> None:
    for switch in ("z", "position", "normal", "uv", "object_index", "material_index", "emit"):
        setattr(layer, f"use_pass_{switch}", flags)
    for switch in ("albedo", "direct", "indirect"):
        setattr(layer.segue, f"use_pass_{switch}", flags)


def case_every_pass_reaches_the_file() -> None:
    scene = _prepare()
    _multilayer(scene)
    _channels(bpy.context.view_layer, True)
    builders.render(write_still=True)
    found = builders.exr_channels(OUTPUT / "picture.exr")
    new = bpy.app.version >= (5, 0, 0)
    names = {
        "Combined": "RGBA",
        "Depth": "Z",
        "Position": "XYZ",
        "Normal": "XYZ",
        "UV": "UVA",
        "Object Index" if new else "IndexOB": "X",
        "Material Index" if new else "IndexMA": "X",
        "Emission" if new else "Emit": "RGB",
        "Albedo": "RGB",
        "Direct": "RGB",
        "Indirect": "RGB",
    }
    layer = bpy.context.view_layer.name
    wanted = {
        f"{layer}.{name}.{channel}" for name, channels in names.items() for channel in channels
    }
    assert wanted <= found, wanted - found
    asked = "Combined Depth Position Normal UV ObjectIndex MaterialIndex Emission"
    asked += " Albedo Direct Indirect"
    assert fake_segue.RENDERS[-1].settings["passes"] == asked.split()


def case_view_layers_are_rendered_apart() -> None:
    scene = _prepare()
    _multilayer(scene)
    first = bpy.context.view_layer
    second = scene.view_layers.new("Second")
    collection = bpy.data.collections.new("Only in the second")
    scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects.new("Cube", builders.cube()))
    first.layer_collection.children[0].exclude = True
    _channels(second, True)
    second.samples = 5
    builders.render(write_still=True)
    one, two = fake_segue.RENDERS[-2:]
    assert (len(one.scene.meshes), len(two.scene.meshes)) == (0, 1)
    assert (one.settings["samples"], two.settings["samples"]) == (128, 5)
    found = builders.exr_channels(OUTPUT / "picture.exr")
    assert {f"{first.name}.Combined.R", "Second.Combined.R", "Second.Albedo.R"} <= found
    assert f"{first.name}.Albedo.R" not in found


def case_passes_are_sockets_of_the_compositor() -> None:
    scene = _prepare()
    layer = bpy.context.view_layer
    layer.segue.use_pass_albedo = True
    if bpy.app.version >= (5, 0, 0):
        tree = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
        scene.compositing_node_group = tree
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    node = tree.nodes.new("CompositorNodeRLayers")
    layer.update_render_passes()
    assert node.outputs["Albedo"].enabled


def case_animation() -> None:
    scene = _prepare(8, 8)
    item = builders.link(builders.cube())
    for frame, x in ((1, 0.0), (3, 2.0)):
        item.location.x = x
        item.keyframe_insert("location", frame=frame)
    scene.frame_start, scene.frame_end = 1, 3
    scene.render.filepath = str(OUTPUT / "frame_")
    bpy.ops.render.render(animation=True)
    xs = [render.scene.instances[0]["transforms"][0, 0, 3] for render in fake_segue.RENDERS]
    assert xs[0] == 0.0 and xs[2] == 2.0 and 0.0 < xs[1] < 2.0
    assert sorted(path.name for path in OUTPUT.glob("frame_*")) == [
        f"frame_000{i}.exr" for i in (1, 2, 3)
    ]


def case_settings_reach_the_engine() -> None:
    scene = _prepare()
    options = scene.segue
    options.samples, options.time_limit, options.noise_threshold = 9, 12.5, 0.125
    options.max_bounces, options.seed = 3, 42
    options.pixel_filter, options.filter_width = "box", 2.0
    scene.render.film_transparent = True
    scene.render.threads_mode, scene.render.threads = "FIXED", 3
    builders.render()
    found = fake_segue.RENDERS[-1].settings
    wanted = {
        "integrator": "segment",
        "samples": 9,
        "time": 12.5,
        "noise_threshold": 0.125,
        "max_depth": 3,
        "seed": 42,
        "filter": "box",
        "filter_width": 2.0,
        "transparent_background": True,
        "threads": 3,
    }
    assert {key: found[key] for key in wanted} == wanted


def case_tiles_are_shown_while_rendering() -> None:
    from blender_addon import job

    _prepare()
    # As in a window: show every tile at once.
    shown = []

    class Monitor(job._Monitor):
        def __init__(self, *arguments: object) -> None:
            super().__init__(*arguments)
            self.next_display = 0.0

        def _display(self) -> None:
            before, self.next_display = self.dirty, 0.0
            super()._display()
            if before and not self.dirty:
                shown.append(before)

    job._Monitor = Monitor
    picture = _rendered()
    assert shown == [(0, 0, 32, 24), (32, 0, 64, 24), (0, 24, 32, 48), (32, 24, 64, 48)]
    np.testing.assert_array_equal(picture[..., 0], np.broadcast_to(np.arange(64.0), (48, 64)))
    np.testing.assert_array_equal(
        picture[..., 1], np.broadcast_to(np.arange(48.0)[:, None], (48, 64))
    )


def case_progress_and_statistics_are_told() -> None:
    from blender_addon import job

    fractions, lines = [], []

    class Listener:
        """What Blender's side of the engine would be told."""

        update_progress = staticmethod(fractions.append)
        update_stats = staticmethod(lambda head, text: lines.append((head, text)))
        stop_requested = staticmethod(lambda: False)

    class Monitor(job._Monitor):
        def __init__(self, engine: object, *arguments: object) -> None:
            super().__init__(Listener, *arguments)

    job._Monitor = Monitor
    _prepare()
    builders.render()
    assert fractions == [0.0, 0.25, 0.5, 0.75]
    layer = bpy.context.view_layer.name
    assert lines[1] == (layer, "Sampling | Remaining: 00:00.30 | Sample 1 | Error 0.1"), lines


def case_panels_of_blender_are_shared() -> None:
    assert "SEGUE" in bpy.types.RENDER_PT_format.COMPAT_ENGINES
    assert "SEGUE" in bpy.types.EEVEE_MATERIAL_PT_surface.COMPAT_ENGINES
    import blender_addon

    blender_addon.unregister()
    left = [
        panel
        for panel in bpy.types.Panel.__subclasses__()
        if "SEGUE" in getattr(panel, "COMPAT_ENGINES", ())
    ]
    blender_addon.register()
    assert not left, left


def case_exposure_of_the_film() -> None:
    """It brightens light, and neither alpha nor data; nor what the engine keeps."""
    from blender_addon import job, passes

    _prepare()
    bpy.context.scene.cycles.film_exposure = 3.0
    given = {}
    original = job._read_passes

    def read(render: fake_segue.Render, frame: job.Frame) -> dict[str, np.ndarray]:
        given.update(original(render, frame))
        return given

    job._read_passes = read
    picture = _rendered()
    job._read_passes = original
    np.testing.assert_array_equal(given["Combined"][0, :, 0], np.arange(64.0))
    np.testing.assert_array_equal(picture[0, :, 0], 3.0 * np.arange(64.0))
    np.testing.assert_array_equal(picture[..., 3], 1.0)
    assert "Emission" in passes.LIGHT or "Emit" in passes.LIGHT
    assert not passes.LIGHT & {"Depth", "Normal", "Albedo", "Position", "UV"}
