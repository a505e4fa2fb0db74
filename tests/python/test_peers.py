"""Agreement with other renderers on matched scenes.

The references are pictures by other engines. What is compared is one number, the mean of all pixels
and channels: that of four renders of 128 x 128 pixels, with seeds of their own, against the
reference's. It may differ by the scene's tolerance and three standard errors, which the scatter of
the four tells; a scene whose standard error exceeds its tolerance fails as too noisy.

Path tracing: the tolerances are 0.5 % for `cornell`, `glossy_box` and `furnace`. They are wider
where it finds the light rarely: 1.5 % for `ajar_door`, whose reference's own mean is known to
0.6 %, and 2 % for `cornell_glass`, whose reference's is known to 0.08 %. `lamp`, a light shut in a
glass bulb, is not compared: in a time fit for a test, the path tracer's scatter says nothing.

Segments, over one pixel: 0.5 % for `cornell` and `cornell_glass`, 1 % for `lamp`, 1.5 % for
`ajar_door` as above.
"""

from __future__ import annotations

import numpy as np
import pytest

import segue

pytest.importorskip("pxr")

from segue import images, usd

pytestmark = pytest.mark.usefixtures("engine")

# Method, scene, samples a pixel, and the tolerance of the mean in percent.
CASES = [
    ("path", "cornell", 32, 0.5),
    ("path", "glossy_box", 64, 0.5),
    ("path", "furnace", 16, 0.5),
    ("path", "ajar_door", 64, 1.5),
    ("path", "cornell_glass", 96, 2.0),
    ("segment", "cornell", 16, 0.5),
    ("segment", "cornell_glass", 24, 0.5),
    ("segment", "ajar_door", 32, 1.5),
    ("segment", "lamp", 32, 1.0),
]
SEEDS = 4


def mean_of(imported: usd.Imported, integrator: str, samples: int, seed: int) -> float:
    """Mean value of a rendered picture."""
    settings = {
        "integrator": integrator,
        "kernel_size": 1,
        "resolution": [128, 128],
        "samples": samples,
        "seed": seed,
    }
    render = segue.Render(imported.scene, settings)
    assert render.run()
    assert render.stats()["non_finite"] == 0
    return float(render.read_pass("Combined")[..., :3].mean(dtype=np.float64))


@pytest.mark.parametrize(("integrator", "name", "samples", "percent"), CASES)
def test_the_mean_is_that_of_other_renderers(integrator, name, samples, percent, shared):
    reference = images.read_rgb(str(shared / "peers" / "refs" / f"{name}.exr"))
    imported = usd.load(shared / "peers" / "usd" / f"{name}.usda")
    means = np.array([mean_of(imported, integrator, samples, seed) for seed in range(SEEDS)])
    means /= reference.mean(dtype=np.float64)
    error = means.std(ddof=1) / np.sqrt(SEEDS)
    print(f"{name}: mean ratio {means.mean():.5f} +- {error:.5f}")
    assert error < percent / 100, "too noisy to tell"
    assert abs(means.mean() - 1) < percent / 100 + 3 * error
