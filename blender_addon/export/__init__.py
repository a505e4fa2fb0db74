"""From Blender's evaluated scene to a `segue.Scene`."""
