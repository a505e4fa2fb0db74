"""Agreement with other renderers on matched scenes.

The references are pictures by other engines. Each scene is rendered with several seeds, so that the
deviation of the picture's mean is judged by its own scatter.
"""

from __future__ import annotations

import numpy as np
import pytest

import segue

pytest.importorskip("pxr")

from segue import images, usd

pytestmark = pytest.mark.usefixtures("engine")

# Samples a pixel, and the largest difference of the means in percent. Where light comes through
# glass or a gap, a path tracer finds it rarely, and the references' own means are known to 0.6 %.
SCENES = {
    "cornell": (32, 0.5),
    "glossy_box": (64, 0.5),
    "furnace": (16, 0.5),
    "ajar_door": (64, 1.5),
    "cornell_glass": (96, 2.0),
}
SEEDS = 4


def mean_of(imported: usd.Imported, samples: int, seed: int) -> float:
    """Mean value of a rendered picture."""
    settings = {"resolution": [128, 128], "samples": samples, "seed": seed}
    render = segue.Render(imported.scene, settings)
    assert render.run()
    assert render.stats()["non_finite"] == 0
    return float(render.read_pass("Combined")[..., :3].mean(dtype=np.float64))


@pytest.mark.parametrize("name", SCENES)
def test_the_mean_is_that_of_other_renderers(name, shared):
    samples, percent = SCENES[name]
    reference = images.read_rgb(str(shared / "peers" / "refs" / f"{name}.exr"))
    imported = usd.load(shared / "peers" / "usd" / f"{name}.usda")
    means = np.array([mean_of(imported, samples, seed) for seed in range(SEEDS)])
    means /= reference.mean(dtype=np.float64)
    error = means.std(ddof=1) / np.sqrt(SEEDS)
    print(f"{name}: mean ratio {means.mean():.5f} +- {error:.5f}")
    assert error < percent / 100, "too noisy to tell"
    assert abs(means.mean() - 1) < percent / 100 + 3 * error
