"""Lights for stages that have none, and which stages those are."""

from __future__ import annotations

import math

import numpy as np

from ..scene import Scene
from ._pxr import Usd, UsdLux, UsdShade
from .material import PREVIEW_SURFACES
from .transform import flat
from .walk import all_prims, is_light


def can_shine(stage: Usd.Stage) -> bool:
    """Whether anything in a stage is meant to shine, at whatever time and however it is hidden.

    Such a stage is dark when its lights are off; it is not one that was left without lights.
    """
    return any(
        is_light(prim)
        or prim.HasAPI(UsdLux.LightAPI)
        or prim.HasAPI(UsdLux.MeshLightAPI)
        or _glows(UsdShade.Shader(prim))
        for prim in all_prims(stage)
    )


def _glows(node: UsdShade.Shader) -> bool:
    """Whether a surface's emission is textured or not black at some time."""
    if not node or node.GetIdAttr().Get() not in PREVIEW_SURFACES:
        return False
    emission = node.GetInput("emissiveColor")
    for attribute in emission.GetValueProducingAttributes() if emission else ():
        times = [Usd.TimeCode.Default(), *attribute.GetTimeSamples()]
        if UsdShade.Output.IsOutput(attribute) or any(
            np.any(attribute.Get(time) or 0) for time in times
        ):
            return True
    return False


def add_default_lights(scene: Scene, camera: np.ndarray, gain: float) -> None:
    """Lights for a stage that has none: a grey sky, and a soft lamp over the camera's shoulder.

    Args:
        scene: what they are added to.
        camera: (4, 4) camera to world.
        gain: factor on every radiance.
    """
    scene.add_light("default sky", {"type": "dome", "radiance": [0.4 * gain] * 3})
    c, s = math.cos(math.radians(35)), math.sin(math.radians(35))
    # Both turns take the camera's direction of view, -Z: to the right, then downwards.
    to_right = np.array([[c, 0, -s, 0], [0, 1, 0, 0], [s, 0, c, 0], [0, 0, 0, 1.0]])
    down = np.array([[1.0, 0, 0, 0], [0, c, s, 0], [0, -s, c, 0], [0, 0, 0, 1]])
    lamp = camera @ to_right @ down
    scene.add_light(
        "default lamp",
        {
            "type": "distant",
            "angle": math.radians(10),
            "irradiance": [2 * gain] * 3,
            "transform": flat(lamp),
        },
    )
