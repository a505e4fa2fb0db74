"""Images of several files, beside Cycles."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix

import agreement
import builders
from harness import SkipCaseError


def _write(name: str, seed: int) -> None:
    """A picture of random patches."""
    image = builders.image("Patches", builders.patches(4, seed).repeat(8, 0).repeat(8, 1))
    image.filepath_raw, image.file_format = str(builders.OUTPUT / name), "PNG"
    image.save()
    bpy.data.images.remove(image)


def _shown(image: bpy.types.Image, scale: float) -> bpy.types.Node:
    """A glowing square with an image, seen from above; the image's node."""
    if bpy.app.version < (4, 5, 0):
        raise SkipCaseError("this Blender has no OpenImageIO of its own")
    square = builders.link(builders.quad(), "Square")
    data, tree, output = builders.material()
    square.data.materials.append(data)
    shader, texture, mapping, place = (
        tree.nodes.new(f"ShaderNode{kind}")
        for kind in ("Emission", "TexImage", "Mapping", "TexCoord")
    )
    texture.image, texture.interpolation = image, "Closest"
    mapping.inputs["Scale"].default_value = (scale, scale, 1.0)
    tree.links.new(place.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], shader.inputs["Color"])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    builders.camera(Matrix.Translation((0, 0, 9)), type="ORTHO", ortho_scale=1.9)
    return texture


def _check(what: str) -> None:
    pictures = []
    warnings = builders.warned(lambda: pictures.extend(agreement.render_both(64, 64, 64, 64)))
    assert not warnings, warnings
    found = agreement.compare(*pictures)
    print(what, found)
    assert np.abs(found.mean).max() < 0.01 and found.correlation > 0.999, found


def case_udim_tiles() -> None:
    """All of them, from files and packed; the fourth is missing, and out of the picture."""
    for seed, number in enumerate((1001, 1002, 1011)):
        _write(f"tile.{number}.png", seed)
    image = bpy.data.images.load(str(builders.OUTPUT / "tile.1001.png"))
    image.filepath, image.source = str(builders.OUTPUT / "tile.<UDIM>.png"), "TILED"
    image.colorspace_settings.name = "sRGB"
    for number in (1002, 1011):
        image.tiles.new(number)
    _shown(image, 1.9)
    # of the square the lower left, without the missing tile
    bpy.data.objects["Camera"].data.ortho_scale = 1.0
    for x, y in ((-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)):
        bpy.data.objects["Camera"].location = (x, y, 9)
        _check(f"at {x}, {y}")
    image.pack()
    _check("packed")


def case_frames_of_sequences() -> None:
    """Those that the timeline and the node's own settings ask for."""
    for frame in range(1, 6):
        _write(f"frame.{frame:04d}.png", frame)
    image = bpy.data.images.load(str(builders.OUTPUT / "frame.0001.png"))
    image.source = "SEQUENCE"
    user = _shown(image, 1.0).image_user
    user.frame_duration, user.use_auto_refresh = 5, True
    for start, offset, is_cyclic, frame in ((1, 0, False, 3), (1, 0, False, 9), (3, 1, True, 9)):
        user.frame_start, user.frame_offset, user.use_cyclic = start, offset, is_cyclic
        bpy.context.scene.frame_set(frame)
        _check(f"frame {frame} from {start}")


def case_what_is_not_there_is_named() -> None:
    """What Blender itself shows instead is used, which is nothing, and said to be."""
    _write("lost.0001.png", 1)
    image = bpy.data.images.load(str(builders.OUTPUT / "lost.0001.png"))
    _shown(image, 1.0)
    assert image.size[0] == 32
    image.source = "SEQUENCE"
    bpy.context.scene.frame_set(7)
    builders.settings(8, 8)
    bpy.context.scene.segue.samples = 1
    warnings = builders.warned(builders.render)
    assert all(text.startswith("Image 'lost.0001.png'") for text in warnings), warnings
    assert "lost.0007.png" in warnings[0] and "magenta" in warnings[1], warnings
