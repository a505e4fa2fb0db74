"""The figures of docs/method.md: gain over path tracing at equal processor time, and the mean against the kernel's size.

Needs the scenes and references that are shared between renderers (SEGUE_SHARED, or ../shared beside the
checkout); without them it says so and does nothing. `gallery` needs them for two of its scenes, `pictures` needs what
`cargo test --release --test method_pictures -- --ignored` draws. Run:
.venv/bin/python benches/method.py table [SCENE ...]|consistency|units|gallery [SCENE ...]|plot|pictures
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
from segue import Render, images, usd
from two_references import SHARP, relative_error

ROOT = Path(__file__).parent.parent
SHARED = Path(os.environ.get("SEGUE_SHARED", ROOT.parent / "shared")) / "peers"
SCENES = ("cornell", "cornell_glass", "ajar_door", "glossy_box", "lamp", "furnace")
#: Scenes of the gallery and two of the shared ones, an unbiased method (or one whose bias is least) that finds their light, samples a pixel, and
#: light paths for each camera path: many where a sun's photons are few in pixels of so small a picture.
GALLERY = {
    "door_ajar": ("bdpt", 96, 1),
    "glass_caustic": ("vcm", 256, 16),
    "glossy_room": ("bdpt", 96, 1),
    "lamp": ("vcm", 96, 1),
    "night_market": ("path", 96, 1),
    "pool": ("vcm", 96, 8),
    "still_life": ("path", 96, 1),
    "usd/cornell_glass": ("vcm", 192, 2),
    "usd/lamp": ("vcm", 192, 1),
}
PICTURES = ROOT / "docs" / "pictures"
#: Relative noise of the references' means, as far as other renderers tell.
KNOWN_TO = {"ajar_door": 0.006, "lamp": 0.006}
SECONDS = 20.0
SIZES = (4.0, 1.0, 0.25)
SETS: dict[str, dict[str, Any]] = {
    "both": {},
    "camera": {"light_paths": 0},
    "light": {"integrator": "photon-filter"},
    "both, no next event": {"next_event": False},
}
#: Scenes of one light over a wall, and the method beside which their means are looked at.
UNITS = {
    "unit_bulb": "vcm",
    "unit_disk": "path",
    "unit_env": "path",
    "unit_point": "path",
    "unit_rect": "path",
    "unit_sphere": "path",
}


def render(scene: Any, **settings: Any) -> tuple[np.ndarray, dict[str, Any]]:
    """A picture and its statistics."""
    job = Render(scene, settings)
    job.run()
    return job.read_pass("Combined")[..., :3], job.stats()


def load(name: str) -> tuple[Any, np.ndarray]:
    """A scene and its reference."""
    stage = usd.load(SHARED / "usd" / f"{name}.usda")
    return stage.scene, images.read_rgb(SHARED / "refs" / f"{name}.exr")


def table() -> None:
    """Markdown rows."""
    for name in sys.argv[2:] or SCENES:
        scene, first = load(name)
        common = {"resolution": [256, 256], "threads": 2}
        second, _ = render(scene, time=2.0 * SECONDS, **common, **SHARP)
        cells, costs = [], []
        for method in ("path", "segment"):
            picture, stats = render(scene, integrator=method, time=SECONDS, **common)
            error = relative_error(*(p.astype(float) for p in (picture, first, second)))
            cells += [f"{stats['samples']:.0f}", f"{error:.3g}"]
            costs.append(error * stats["cpu_seconds"])
        off = picture.mean(dtype=float) / first.mean(dtype=float) - 1.0
        cells += [f"{costs[0] / costs[1]:.1f}", f"{off:+.2%}"]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def consistency(seeds: int = 4, samples: int = 12) -> None:
    """Means by size of a fixed kernel, as JSON lines."""
    for name in SCENES:
        scene, reference = load(name)
        for what, techniques in SETS.items():
            for size in SIZES:
                means = []
                for seed in range(seeds):
                    picture, _ = render(
                        scene,
                        resolution=[128, 128],
                        samples=samples,
                        seed=seed,
                        kernel="fixed",
                        kernel_size=size,
                        **techniques,
                    )
                    means.append(float(picture.mean() / reference.mean()))
                row = {
                    "scene": name,
                    "techniques": what,
                    "kernel": size,
                    "mean": float(np.mean(means)),
                    "error": float(np.std(means, ddof=1) / seeds**0.5),
                }
                print(json.dumps(row), flush=True)


def means(scene: Any, seeds: int, **settings: Any) -> np.ndarray:
    """Means of pictures, one for every seed."""
    pictures = (render(scene, seed=1000 * seed, **settings)[0] for seed in range(seeds))
    return np.array([picture.mean(dtype=float) for picture in pictures])


def print_offsets(
    name: str,
    scene: Any,
    unbiased: str,
    tries: dict[str, dict],
    seeds: int,
    **common: Any,
) -> None:
    """How far the means of these settings are from those of an unbiased method, with standard errors, as JSON lines.

    All take the same camera samples for a seed, so what camera rays see straight or through glass (glints of the sun,
    mostly) has no part in the differences.
    """
    common = {"kernel": "fixed", **common}
    # the disks of `vcm` lose light at edges: small ones
    expected = means(scene, seeds, **common, integrator=unbiased, kernel_size=0.5)
    for what, settings in tries.items():
        got = means(scene, seeds, **{**common, **settings})
        off = (got - expected) / expected.mean()
        row = {"scene": name, "against": unbiased, "method": what}
        row |= {"off": off.mean(), "error": off.std(ddof=1) / seeds**0.5}
        print(json.dumps(row), flush=True)


def gallery(seeds: int = 6) -> None:
    """Means of scenes by size of a fixed kernel, beside an unbiased method."""
    tries = {f"segment {s:g} px": {"kernel_size": s} for s in SIZES}
    for name in sys.argv[2:] or GALLERY:
        unbiased, samples, light_paths = GALLERY[name]
        folder = SHARED if name.startswith("usd/") else ROOT / "scenes"
        if not (folder / f"{name}.usda").exists():
            print(f"skipped: {folder / name}.usda does not exist", file=sys.stderr)
            continue
        scene = usd.load(folder / f"{name}.usda").scene
        common = {"resolution": [128, 72], "samples": samples}
        common |= {"light_paths": light_paths}
        print_offsets(name, scene, unbiased, tries, seeds, **common)


def units(seeds: int = 6) -> None:
    """Means of one light over a wall each, with a fixed kernel of a quarter of a pixel, beside an unbiased method."""
    tries = {what: {"kernel_size": SIZES[-1], **with_} for what, with_ in SETS.items()}
    for name, unbiased in UNITS.items():
        scene = usd.load(SHARED / "usd" / f"{name}.usda").scene
        common = {"resolution": [64, 64], "samples": 64}
        print_offsets(name, scene, unbiased, tries, seeds, **common)


def plot() -> None:
    """The output of `consistency`, from the standard input, as a picture."""
    from matplotlib import pyplot

    rows = [json.loads(line) for line in sys.stdin if line.strip()]
    figure, axes = pyplot.subplots(
        2, 3, figsize=(11, 6), sharex=True, constrained_layout=True
    )
    for axis, name in zip(axes.flat, SCENES, strict=True):
        for color, what in enumerate(SETS):
            found = [r for r in rows if r["scene"] == name and r["techniques"] == what]
            # a set that cannot find the paths says nothing
            if (
                not found
                or min(r["mean"] for r in found) < 0.9
                or found[-1]["error"] > 0.03
            ):
                continue
            sizes, means = (
                [r["kernel"] for r in found],
                [100 * (r["mean"] - 1) for r in found],
            )
            bars = [100 * r["error"] for r in found]
            axis.errorbar(
                sizes,
                means,
                bars,
                label=what,
                color=f"C{color}",
                marker="o",
                markersize=3,
                capsize=2,
            )
        known = 100 * KNOWN_TO.get(name, 0.002)
        axis.axhspan(-known, known, color="0.9")
        axis.set(title=name, xscale="log", ylim=(-4, 4))
        axis.set_xticks(SIZES, [f"{s:g}" for s in SIZES])
        axis.minorticks_off()
    for axis in axes[1]:
        axis.set_xlabel("edge of a fixed kernel, pixels")
    figure.supylabel("mean of the picture against the reference, %")
    handles = {
        h.get_label(): h for a in axes.flat for h in a.get_legend_handles_labels()[0]
    }
    figure.legend(
        handles.values(),
        handles.keys(),
        loc="outside upper center",
        ncols=4,
        frameon=False,
    )
    figure.savefig(PICTURES / "consistency.png", dpi=100)


def pictures() -> None:
    """Clusters, segments, and what one iteration makes of its samples."""
    import matplotlib.image

    drawn = ROOT / "target" / "method"
    for names, into in (
        (("clusters_1.ppm", "clusters_101.ppm"), "clusters.png"),
        (("segments.ppm",), "segments.png"),
    ):
        parts = [matplotlib.image.imread(drawn / n) for n in names]
        matplotlib.image.imsave(PICTURES / into, np.concatenate(parts, axis=1))
    scene = usd.load(ROOT / "scenes" / "glass_caustic.usda").scene
    steps = [
        {"integrator": "path", "samples": 1},
        {"kernel": "fixed", "kernel_size": 0.001, "samples": 1},
        {"samples": 1},
        {"samples": 64},
    ]
    shown = [render(scene, resolution=[320, 180], **step)[0] for step in steps]
    rows = [np.concatenate(shown[k : k + 2], axis=1) for k in (0, 2)]
    images.write_png(PICTURES / "stages.png", np.concatenate(rows, axis=0))


if __name__ == "__main__":
    command = sys.argv[1]
    if command in ("table", "consistency", "units") and not (SHARED / "refs").is_dir():
        sys.exit(f"skipped: {SHARED} does not exist")
    PICTURES.mkdir(exist_ok=True)
    commands = (table, consistency, units, gallery, plot, pictures)
    {f.__name__: f for f in commands}[command]()
