"""Settings that the add-on keeps in the .blend file."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty


class SegueSceneSettings(bpy.types.PropertyGroup):
    """Render settings of a scene (`scene.segue`)."""

    integrator: EnumProperty(
        name="Integrator",
        description="Method of light transport",
        items=[
            (
                "segment",
                "Segments",
                "Segments from the camera and from the lights, gathered in small clusters: "
                "finds caustics and light behind glass",
            ),
            ("path", "Path Tracing", "Unidirectional path tracing with next-event estimation"),
        ],
        default="segment",
    )
    samples: IntProperty(
        name="Samples",
        description="Samples for every pixel. 0 means no limit: "
        "then set a time or a noise threshold",
        default=128,
        min=0,
        soft_max=16384,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description="Render no longer than this. 0 means no limit",
        default=0.0,
        min=0.0,
        unit="TIME_ABSOLUTE",
        step=100,
    )
    noise_threshold: FloatProperty(
        name="Noise Threshold",
        description="Stop when the estimated relative mean squared error of the picture is below "
        "this. 0 means no threshold",
        default=0.0,
        min=0.0,
        max=1.0,
        precision=5,
        step=0.01,
    )
    max_bounces: IntProperty(
        name="Max Bounces",
        description="Number of bounces after which light is no longer followed. -1 means no limit",
        default=-1,
        min=-1,
        soft_max=64,
    )
    seed: IntProperty(
        name="Seed",
        description="Pictures with equal seeds have equal noise",
        default=0,
        min=0,
    )
    pixel_filter: EnumProperty(
        name="Pixel Filter",
        description="Weight of the samples around a pixel's centre",
        items=[
            ("box", "Box", "Each sample counts for its own pixel only"),
            ("blackman-harris", "Blackman-Harris", "Smooth filter that Cycles uses too"),
        ],
        default="blackman-harris",
    )
    filter_width: FloatProperty(
        name="Filter Width",
        description="Width of the pixel filter",
        default=1.5,
        min=0.01,
        soft_max=10.0,
        subtype="PIXEL",
    )


class SegueViewLayerSettings(bpy.types.PropertyGroup):
    """Passes of a view layer that Blender has no switch for (`view_layer.segue`)."""

    use_pass_albedo: BoolProperty(
        name="Albedo",
        description="Colour of surfaces without light, as denoisers want it",
        update=lambda self, context: context.view_layer.update_render_passes(),
    )
    use_pass_direct: BoolProperty(
        name="Direct",
        description="Light that was emitted towards the first surface seen",
        update=lambda self, context: context.view_layer.update_render_passes(),
    )
    use_pass_indirect: BoolProperty(
        name="Indirect",
        description="Light that was scattered at least twice",
        update=lambda self, context: context.view_layer.update_render_passes(),
    )


CLASSES = (SegueSceneSettings, SegueViewLayerSettings)


def register() -> None:
    """Register the property groups and hang them on Blender's types."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.segue = PointerProperty(type=SegueSceneSettings, name="Segue")
    bpy.types.ViewLayer.segue = PointerProperty(type=SegueViewLayerSettings, name="Segue")


def unregister() -> None:
    """Undo `register`."""
    del bpy.types.ViewLayer.segue
    del bpy.types.Scene.segue
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
