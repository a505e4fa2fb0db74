"""Worlds whose nodes Segue does not know, as the environment maps that Cycles makes of them."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from ..log import ExportLog
from .fingerprint import fingerprint, nodes

_PROCESS = Path(__file__).with_name("panorama_process.py")
#: Seconds after which the process is given up, and between two looks at it.
_PATIENCE, _PAUSE = 120.0, 0.05


@dataclass(frozen=True)
class Panorama:
    """A world's radiance as an environment map of Blender's, and its sun."""

    name: str
    #: (height, width, 3), linear, top row first. Negative light is left out where it is used.
    pixels: np.ndarray
    #: `irradiance`, `direction` to it and `angle` of the whole disk; none where there is none.
    sun: dict[str, Any] | None

    def texels(self) -> np.ndarray:
        """See `ImageSource`."""
        return np.maximum(self.pixels, 0.0)

    def reach(self) -> tuple[float, float]:
        """See `ImageSource`."""
        return float(self.pixels.min()), float(self.pixels.max())


#: The last ones, or why there are none, by what they were made of: frames and edits of anything
#: else share them.
_made: dict[tuple[bool, str], Panorama | str] = {}


def panorama(
    world: bpy.types.World,
    frame: int,
    is_camera: bool,
    log: ExportLog,
    stop: Callable[[], bool],
) -> Panorama | None:
    """The world as it is at a frame, for rays from the camera or for others; none on failure."""
    images = (getattr(node, "image", None) for node in nodes(world.node_tree))
    unsaved = [image.name for image in images if image is not None and image.is_dirty]
    if unsaved:
        log.warn(f"World '{world.name}': its image '{unsaved[0]}' has changes that are not saved")
        return None
    key = (is_camera, fingerprint(world, frame))
    made = _made.pop(key, None)
    if made is None:
        try:
            made = _render(world, frame, is_camera, stop)
        except (OSError, subprocess.SubprocessError, ValueError) as problem:
            made = str(problem)
        if stop():
            return None
    while len(_made) > 1:
        del _made[next(iter(_made))]
    _made[key] = made
    if isinstance(made, str):
        log.warn(f"World '{world.name}': Cycles could not make a picture of it: {made}")
        return None
    return made


def _render(
    world: bpy.types.World, frame: int, is_camera: bool, stop: Callable[[], bool]
) -> Panorama:
    original = world.original
    asked = [node.object for node in nodes(world.node_tree) if getattr(node, "object", None)]
    request = {
        "world": original.name,
        "frame": frame,
        "is_camera": is_camera,
        "objects": {item.name: [row[:] for row in item.matrix_world] for item in asked},
    }
    with tempfile.TemporaryDirectory(prefix="segue-") as folder:
        file, question, output = (str(Path(folder) / n) for n in ("in.blend", "in.json", "out"))
        if original.library is not None:
            file = bpy.path.abspath(original.library.filepath)
        else:
            bpy.data.libraries.write(file, {original}, path_remap="ABSOLUTE")
        Path(question).write_text(json.dumps(request))
        _run([file, question, output], Path(folder) / "log.txt", stop)
        pixels = np.load(f"{output}.npy")
        if not np.isfinite(pixels).all():
            raise ValueError("it is not finite everywhere")
        sun = json.loads(Path(f"{output}.json").read_text())
    return Panorama(world.name, pixels, sun)


def _run(arguments: list[str], log: Path, stop: Callable[[], bool]) -> None:
    """The process, until it ends or nobody wants it to."""
    command = [sys.executable, str(_PROCESS)]
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "--background", "--factory-startup"]
        command += ["--python-exit-code", "1", "--python", str(_PROCESS), "--"]
    # Windows would open a console.
    flags = getattr(subprocess, "CREATE_NO_WINDOW", 0)
    with (
        log.open("w") as text,
        subprocess.Popen(
            [*command, *arguments], stdout=text, stderr=text, creationflags=flags
        ) as process,
    ):
        until = time.monotonic() + _PATIENCE
        while process.poll() is None:
            if stop() or time.monotonic() > until:
                process.kill()
                raise ValueError(f"it did not end within {_PATIENCE:g} seconds")
            time.sleep(_PAUSE)
    if process.returncode:
        lines = log.read_text(errors="replace").strip().splitlines()
        raise ValueError(lines[-1] if lines else f"exit status {process.returncode}")
