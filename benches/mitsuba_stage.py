"""Renders a shared stage with Mitsuba for so many processor seconds of a thread, twice, into numpy files.

Runs in the environment PEERS_PYTHON, in the folder of the shared harness, whose `usd2mitsuba` builds the scene:
mitsuba_stage.py STAGE WIDTH SECONDS THREADS OUT

The stages name two materials for each surface, that of the scene's source and the preview surface, which the others render. They
differ in plastics alone: the source lets light bounce below their surface, which takes about half of it. Here these are `principled`.
"""

from __future__ import annotations

import json
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
from processor import processor_seconds

#: Samples a pixel of one call.
STEP = 4
#: Bounces, and one for the light.
DEPTH = 65


def previewed(bsdf: Any) -> Any:
    """A BSDF of the source, with plastics as the preview surface has them."""
    if not isinstance(bsdf, dict):
        return bsdf
    if bsdf.get("type") not in ("plastic", "roughplastic"):
        return {key: previewed(value) for key, value in bsdf.items()}
    ratio = bsdf.get("int_ior", 1.5) / bsdf.get("ext_ior", 1.0)
    normal_reflectance = ((ratio - 1.0) / (ratio + 1.0)) ** 2
    return {
        "type": "principled",
        "base_color": bsdf["diffuse_reflectance"],
        "roughness": bsdf.get("alpha", 0.0) ** 0.5,
        "specular": min(1.0, normal_reflectance / 0.08),
    }


def main(stage: str, width: int, seconds: float, threads: int, out: Path) -> None:
    """Writes the two pictures, and how many seconds of a thread each took."""
    sys.argv = ["usd2mitsuba", stage, str(out)]
    sys.path.insert(0, ".")
    import drjit
    import mitsuba

    # the harness asks for the scalar variant, which is many times slower
    choose = mitsuba.set_variant
    mitsuba.set_variant = lambda _: choose("llvm_ad_rgb")
    drjit.set_thread_count(threads)
    import usd2mitsuba

    read = types.SimpleNamespace(loads=lambda text: previewed(json.loads(text)))
    usd2mitsuba.json = read
    scene = usd2mitsuba.build(stage, width, 1, DEPTH)
    np.asarray(mitsuba.render(scene, spp=STEP, seed=2**31 - 1))  # compiles
    pictures, times, seed = [], [], 0
    for _ in range(2):
        start, total, calls = processor_seconds(), 0.0, 0
        while processor_seconds() - start < seconds * threads:
            total = total + np.asarray(mitsuba.render(scene, spp=STEP, seed=seed))
            calls, seed = calls + 1, seed + 1
        pictures.append(total[..., :3] / calls)
        times.append((processor_seconds() - start) / threads)
    np.save(out, np.array(pictures, dtype=np.float64))
    print(json.dumps(times))


if __name__ == "__main__":
    main(
        sys.argv[1],
        int(sys.argv[2]),
        float(sys.argv[3]),
        int(sys.argv[4]),
        Path(sys.argv[5]),
    )
