"""The transfer operator of the propagation: no iteration diverges, and few sweeps are enough."""

from __future__ import annotations

import segue
from case import Rows, below, case
from gallery import SCENES, stages
from segue import usd
from stiff import furnace

GROUP = "Sweeps"
#: Applications of the transfer operator.
SWEEPS = 200
#: Distances below this are made of rounding.
ROUNDING = 1e-5


def graph(scene: segue.Scene, resolution: list[int], **settings: object) -> tuple[dict, int]:
    """The graph of a render's last iteration, and how many samples were refused."""
    settings = {"resolution": resolution, "operator_sweeps": SWEEPS, "kernel": "fixed", **settings}
    job = segue.Render(scene, settings)
    job.run()
    stats = job.stats()
    return stats["graph"], stats["non_finite"] + stats["dropped"]


@case(GROUP, "a spectral radius below 1 (estimated by 200 sweeps without emission)")
def spectral_radius(full: bool) -> Rows:
    """The gallery's scenes, by kernel and seed."""
    for stage in stages(full):
        scene = usd.load(stage).scene
        for size in (8.0, 1.0, 0.25) if full else (4.0,):
            for seed in (0, 1, 2) if full else (0,):
                set_up = {"samples": 1, "seed": seed, "kernel_size": size}
                found, refused = graph(scene, [160, 90] if full else [64, 36], **set_up)
                sweeps, sums = found["sweeps"], found["row_sums"]
                what = (
                    f"{stage.stem}, {size:g} px, seed {seed}: row sums {sums['mean']:.3f} in the "
                    f"mean, at most {sums['largest']:.3g}; most light {sweeps['peak']:.3f}"
                )
                yield below(what, 1.0, sweeps["radius"], refused)


@case(GROUP, "the distance from the solution when starting from darkness", axis="sweeps")
def starts(full: bool) -> Rows:
    """Distance from the solution, starting from own-path tails: closed rooms, and a caustic."""
    albedos = (0.9, 0.99, 0.999) if full else (0.9,)
    kinds = {f"closed room, albedo {a}": furnace(a).scene for a in albedos}
    kinds["glass_caustic"] = usd.load(SCENES / "glass_caustic.usda").scene
    for name, scene in kinds.items():
        found, refused = graph(scene, [32, 32], samples=1, kernel_size=2.0, seed=5)
        sweeps = found["sweeps"]
        both = zip(sweeps["from_darkness"], sweeps["from_tails"], strict=True)
        for k, (darkness, tails) in enumerate(both):
            if darkness < ROUNDING:
                break
            yield below(f"{name}, {2**k} sweeps", darkness, tails, refused, 2**k, name)
