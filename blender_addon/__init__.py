"""Segue for Blender: the render engine, its settings and its panels."""

from __future__ import annotations

from . import engine, history, library, panels, preferences, properties

MODULES = (preferences, properties, history, engine, panels)


def register() -> None:
    """Register the add-on; fails with a readable reason where the engine cannot be loaded."""
    library.load()
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Undo `register`."""
    for module in reversed(MODULES):
        module.unregister()
