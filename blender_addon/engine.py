"""The render engine as Blender knows it."""

from __future__ import annotations

import traceback

import bpy

from . import job, passes


class SegueRenderEngine(bpy.types.RenderEngine):
    """Final (F12) renders, previews of materials, and animations.

    There is no `__init__`: Blender calls it once without arguments in 4.2 and twice with some
    from 4.4 on.
    """

    bl_idname = "SEGUE"
    bl_label = "Segue"
    bl_use_preview = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    def update_render_passes(
        self, scene: bpy.types.Scene | None = None, renderlayer: bpy.types.ViewLayer | None = None
    ) -> None:
        """Tell the compositor which passes a view layer will have."""
        for render_pass in passes.enabled(renderlayer):
            channels = render_pass.channels
            self.register_pass(
                scene, renderlayer, render_pass.name, len(channels), channels, render_pass.kind
            )

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render one view layer.

        Blender crashes on writing a file when a render left no pixels behind, and an exception
        that reaches it is only printed: so whatever happens, a result is merged and errors are
        reported.
        """
        frame = job.Frame(self, depsgraph)
        try:
            frame.clear()
            job.run(self, depsgraph, frame)
        except Exception as error:
            traceback.print_exc()
            text = str(error) or type(error).__name__
            self.report({"ERROR"}, f"Segue: {text}")
            self.error_set(f"Segue: {text}")

    def stop_requested(self) -> bool:
        """Whether the user wants the render to end."""
        return self.test_break()


def register() -> None:
    """Register the engine."""
    bpy.utils.register_class(SegueRenderEngine)


def unregister() -> None:
    """Undo `register`."""
    bpy.utils.unregister_class(SegueRenderEngine)
