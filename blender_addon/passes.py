"""The render passes: which Blender switch asks for which pass of Segue, under which name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy

# Blender 5.0 renamed its built-in passes; compositor sockets carry these names.
_LONG_NAMES = bpy.app.version >= (5, 0, 0)


@dataclass(frozen=True)
class RenderPass:
    """One pass as Blender stores it.

    `source` is Segue's name, `name` Blender's, `channels` names one letter a channel, `kind` is
    Blender's pass type, and `switch` the view layer property that asks for it (of the view layer
    itself, or of its `segue` group when `custom`).
    """

    source: str
    name: str
    channels: str
    kind: str
    switch: str | None = None
    custom: bool = False


PASSES: tuple[RenderPass, ...] = (
    RenderPass("Combined", "Combined", "RGBA", "COLOR"),
    RenderPass("Depth", "Depth", "Z", "VALUE", "use_pass_z"),
    RenderPass("Position", "Position", "XYZ", "VECTOR", "use_pass_position"),
    RenderPass("Normal", "Normal", "XYZ", "VECTOR", "use_pass_normal"),
    RenderPass("UV", "UV", "UVA", "VECTOR", "use_pass_uv"),
    RenderPass(
        "ObjectIndex",
        "Object Index" if _LONG_NAMES else "IndexOB",
        "X",
        "VALUE",
        "use_pass_object_index",
    ),
    RenderPass(
        "MaterialIndex",
        "Material Index" if _LONG_NAMES else "IndexMA",
        "X",
        "VALUE",
        "use_pass_material_index",
    ),
    RenderPass("Emission", "Emission" if _LONG_NAMES else "Emit", "RGB", "COLOR", "use_pass_emit"),
    RenderPass("Albedo", "Albedo", "RGB", "COLOR", "use_pass_albedo", custom=True),
    RenderPass("Direct", "Direct", "RGB", "COLOR", "use_pass_direct", custom=True),
    RenderPass("Indirect", "Indirect", "RGB", "COLOR", "use_pass_indirect", custom=True),
)

# Blender's names of the passes that hold light, and not data.
LIGHT = frozenset(
    render_pass.name
    for render_pass in PASSES
    if render_pass.source in {"Combined", "Emission", "Direct", "Indirect"}
)

# Switches of Blender's own view layer that Segue has no pass for.
_UNSUPPORTED = (
    "use_pass_mist",
    "use_pass_vector",
    "use_pass_shadow",
    "use_pass_ambient_occlusion",
    "use_pass_environment",
    "use_pass_diffuse_direct",
    "use_pass_diffuse_indirect",
    "use_pass_diffuse_color",
    "use_pass_glossy_direct",
    "use_pass_glossy_indirect",
    "use_pass_glossy_color",
    "use_pass_transmission_direct",
    "use_pass_transmission_indirect",
    "use_pass_transmission_color",
    "use_pass_subsurface_direct",
    "use_pass_subsurface_indirect",
    "use_pass_subsurface_color",
    "use_pass_cryptomatte_object",
    "use_pass_cryptomatte_material",
    "use_pass_cryptomatte_asset",
    "use_pass_grease_pencil",
)

# The same for the switches that Cycles adds to a view layer, and their labels in its panels.
_UNSUPPORTED_CYCLES = {
    "use_pass_volume_direct": "Volume Direct",
    "use_pass_volume_indirect": "Volume Indirect",
    "use_pass_volume_scatter": "Volume Scatter",
    "use_pass_volume_transmit": "Volume Transmit",
    "use_pass_volume_majorant": "Volume Majorant",
    "use_pass_shadow_catcher": "Shadow Catcher",
    "denoising_store_passes": "Denoising Data",
    "pass_debug_sample_count": "Sample Count",
    "pass_render_time": "Render Time",
}


def enabled(view_layer: bpy.types.ViewLayer) -> Iterator[RenderPass]:
    """The passes that `view_layer` asks for; Combined is always among them."""
    for render_pass in PASSES:
        owner = view_layer.segue if render_pass.custom else view_layer
        if render_pass.switch is None or getattr(owner, render_pass.switch):
            yield render_pass


def unsupported(view_layer: bpy.types.ViewLayer) -> list[str]:
    """Labels of the passes that are switched on and that Segue cannot render."""
    properties = view_layer.bl_rna.properties
    names = [
        properties[switch].name
        for switch in _UNSUPPORTED
        if switch in properties and getattr(view_layer, switch)
    ]
    cycles = getattr(view_layer, "cycles", None)
    names += [
        label for switch, label in _UNSUPPORTED_CYCLES.items() if getattr(cycles, switch, False)
    ]
    names += [f"AOV '{aov.name}'" for aov in view_layer.aovs]
    names += [f"Light Group '{group.name}'" for group in view_layer.lightgroups]
    return names
