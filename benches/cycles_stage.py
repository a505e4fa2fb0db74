"""Renders a shared stage with Cycles for so many processor seconds of a thread, twice, into numpy files.

Runs in the environment PEERS_BPY_PYTHON, in the folder of the shared harness, whose `cycles_check` imports the scene:
cycles_stage.py STAGE WIDTH SECONDS THREADS GUIDED OUT
"""

from __future__ import annotations

import json
import runpy
import sys
import tempfile
from pathlib import Path

import numpy as np
from processor import processor_seconds

BOUNCES = 64
#: Samples a pixel of the render that tells how many fit into the time.
TRIAL = 8


def main(
    stage: str, width: int, seconds: float, threads: int, guided: bool, out: Path
) -> None:
    """Writes the two pictures, and how many seconds of a thread each took."""
    import bpy

    # Blender's own `pxr`, which `cycles_check` imports
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    own = Path(bpy.utils.resource_path("LOCAL"), "python", "lib", version)
    sys.path.append(str(own / "site-packages"))

    folder = tempfile.TemporaryDirectory()
    file = Path(folder.name) / "picture.exr"
    sys.argv = ["cycles_check", stage, str(file.with_suffix(".png")), str(width), "1"]
    runpy.run_path("cycles_check.py")
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    settings = render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    render.filepath = str(file)
    render.threads_mode, render.threads = "FIXED", threads
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.use_guiding = guided
    cycles.pixel_filter_type = "BOX"
    cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", BOUNCES)

    def picture(samples: int, seed: int) -> tuple[np.ndarray, float]:
        cycles.samples, cycles.seed = samples, seed
        start = processor_seconds()
        bpy.ops.render.render(write_still=True)
        used = (processor_seconds() - start) / threads
        image = bpy.data.images.load(str(file), check_existing=False)
        pixels = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(pixels)
        shape = (image.size[1], image.size[0], -1)
        return pixels.reshape(shape)[::-1, :, :3], used

    # what a render takes beside its samples: the scene is built anew each time
    _, building = picture(1, 0)
    _, trial = picture(1 + TRIAL, 0)
    samples = max(1, round(seconds * TRIAL / max(trial - building, 1e-3)))
    pictures, times = zip(*(picture(samples, 1 + k) for k in range(2)), strict=True)
    np.save(out, np.array(pictures, dtype=np.float64))
    print(json.dumps([used - building for used in times]))


if __name__ == "__main__":
    main(
        sys.argv[1],
        int(sys.argv[2]),
        float(sys.argv[3]),
        int(sys.argv[4]),
        sys.argv[5] == "guided",
        Path(sys.argv[6]),
    )
