"""What the user chooses once for all files."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
from bpy.props import BoolProperty


class SeguePreferences(bpy.types.AddonPreferences):
    """Preferences of the add-on, kept by Blender where the add-on is enabled there."""

    bl_idname = __package__

    write_error_curve: BoolProperty(
        name="Write error curve beside each output",
        description="When a render is written to a file, write the curve of its error beside it: "
        "NAME_error.csv with the figures and NAME_error.png with the picture",
        default=False,
    )

    def draw(self, context: bpy.types.Context) -> None:
        """Called by Blender whenever the preferences are shown."""
        self.layout.prop(self, "write_error_curve")


@dataclass
class Defaults:
    """What holds where Blender keeps no preferences of the add-on."""

    write_error_curve: bool = False


_defaults = Defaults()


def current() -> SeguePreferences | Defaults:
    """The preferences in force; scripts may change them, however the add-on was registered."""
    addon = bpy.context.preferences.addons.get(__package__)
    preferences = addon.preferences if addon else None
    return preferences if preferences is not None else _defaults


def register() -> None:
    """Register the preferences."""
    bpy.utils.register_class(SeguePreferences)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(SeguePreferences)
