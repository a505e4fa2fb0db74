"""The panels of the Properties editor."""

from __future__ import annotations

from typing import ClassVar

import bpy

from . import history
from .engine import SegueRenderEngine

ENGINE = SegueRenderEngine.bl_idname

# Blender's own panels that do not apply, or that a panel of this file replaces.
_NOT_OURS = {
    "DATA_PT_light",
    "DATA_PT_falloff_curve",
    "NODE_DATA_PT_light",
    "RENDER_PT_simplify_greasepencil",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
    "VIEWLAYER_PT_freestyle",
    "RENDER_PT_freestyle",
}

# Node-based panels that Blender keeps under the name of EEVEE but that hold nothing of EEVEE's own.
_SHADER_PANELS = {
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "DATA_PT_EEVEE_light",
}


class _Panel(bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine == ENGINE


class SEGUE_RENDER_PT_sampling(_Panel):
    """How much work goes into the picture."""

    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender whenever the panel is shown."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.segue
        layout.prop(settings, "integrator")
        column = layout.column(align=True)
        column.prop(settings, "samples")
        column.prop(settings, "time_limit")
        column.prop(settings, "noise_threshold")
        layout.prop(settings, "max_bounces")
        layout.prop(settings, "seed")


class SEGUE_RENDER_PT_film(_Panel):
    """How samples become pixels."""

    bl_label = "Film"
    bl_context = "render"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender whenever the panel is shown."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.segue
        layout.prop(context.scene.render, "film_transparent", text="Transparent")
        column = layout.column(align=True)
        column.prop(settings, "pixel_filter")
        column.prop(settings, "filter_width", text="Width")


class SEGUE_RENDER_PT_error(_Panel):
    """How the error of the last render fell."""

    bl_label = "Error"
    bl_context = "render"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender whenever the panel is shown."""
        layout = self.layout
        shown = history.shown(context.scene)
        if shown is None:
            layout.label(text="Render to see how the error falls")
            return
        layout.template_icon(icon_value=shown.icon, scale=_icon_scale(context))
        layout.label(text=shown.text)


def _icon_scale(context: bpy.types.Context) -> float:
    """Scale at which an icon fills the width of a panel but for its margins."""
    # Blender has no scale before its first window.
    unit = 20.0 * (context.preferences.system.ui_scale or 1.0)
    return min(max(context.region.width / unit - 3.0, 6.0), 30.0)


class SEGUE_VIEWLAYER_PT_passes(_Panel):
    """Which passes a view layer has."""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender whenever the panel is shown."""
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        view_layer = context.view_layer
        column = layout.column(heading="Data")
        for switch in ("z", "position", "normal", "uv", "object_index", "material_index"):
            column.prop(view_layer, f"use_pass_{switch}")
        column.prop(view_layer.segue, "use_pass_albedo")
        column = layout.column(heading="Light")
        column.prop(view_layer, "use_pass_emit", text="Emission")
        column.prop(view_layer.segue, "use_pass_direct")
        column.prop(view_layer.segue, "use_pass_indirect")


CLASSES = (
    SEGUE_RENDER_PT_sampling,
    SEGUE_RENDER_PT_film,
    SEGUE_RENDER_PT_error,
    SEGUE_VIEWLAYER_PT_passes,
)


def _shared_panels() -> list[type[bpy.types.Panel]]:
    """Blender's panels that show properties Segue reads."""
    shared = []
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", ())
        general = "BLENDER_RENDER" in engines and panel.__name__ not in _NOT_OURS
        if general or panel.__name__ in _SHADER_PANELS:
            shared.append(panel)
    return shared


def register() -> None:
    """Register the panels and join Blender's own."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister() -> None:
    """Undo `register`."""
    for panel in bpy.types.Panel.__subclasses__():
        getattr(panel, "COMPAT_ENGINES", set()).discard(ENGINE)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
