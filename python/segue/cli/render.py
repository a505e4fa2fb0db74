"""`segue render`: a stage to a picture."""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from .. import images
from ..render import Render
from ..reporting import error_text
from ..scene import Scene
from ..tonemapping import TONEMAPPING
from . import arguments, output
from .cancellation import Cancellation
from .curve import Curve
from .progress import Progress, clock
from .status import InputError, Status, UsageError

#: When to stop where nothing is said.
DEFAULT_THRESHOLD, DEFAULT_SECONDS = 0.003, 600.0


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Adds the subcommand."""
    parser = commands.add_parser(
        "render",
        help="render a stage",
        description="Renders a USD stage. Without --samples, --time and --noise-threshold it stops "
        f"at an estimated relative mean squared error of {DEFAULT_THRESHOLD:g}, or after "
        f"{DEFAULT_SECONDS / 60:g} minutes.",
    )
    add = parser.add_argument
    add("stage", metavar="STAGE", help="a .usd, .usda, .usdc or .usdz file")
    add(
        "-o",
        "--output",
        required=True,
        metavar="OUT.exr",
        type=Path,
        help="the picture; a .png is written in addition to an .exr beside it, tonemapped "
        f"({TONEMAPPING}). With --frames the number replaces #### or %%04d",
    )
    add(
        "--integrator",
        metavar="NAME",
        help="method: segment (default), segment-bridge, mvf, photon-filter, segment-path, path, "
        "light, bdpt, ppm, bpm or vcm",
    )
    add(
        "--kernel",
        choices=("adaptive", "progressive", "fixed"),
        help="whether the kernel shrinks or stays, for methods that have one; the segment method "
        "also makes it larger or smaller place by place (adaptive, the default)",
    )
    add(
        "--kernel-size",
        type=arguments.positive,
        metavar="PIXELS",
        help="edge of the kernel in the first iteration (default: 4)",
    )
    add(
        "--memory-budget",
        type=arguments.count,
        metavar="MIB",
        help="what the segments of an iteration may take at a time, about (default: 768); larger "
        "pictures are made in bands, which takes longer",
    )
    add(
        "--estimator",
        choices=("leave-one-out", "literal"),
        help="how the segment method uses light segments: consistently (default), or by the "
        "paper's recursion as written, which is too bright where photons are few",
    )
    add(
        "--bridges",
        choices=("uniform", "power"),
        help="how segment-bridge chooses the light segment to which a camera segment is joined: "
        "all alike (default), or by the flux they carry",
    )
    stop = parser.add_mutually_exclusive_group()
    stop.add_argument(
        "--samples", type=arguments.count, metavar="N", help="stop after N samples a pixel"
    )
    stop.add_argument(
        "--time", type=arguments.positive, metavar="SECONDS", help="stop after this time"
    )
    stop.add_argument(
        "--noise-threshold",
        type=arguments.positive,
        metavar="E",
        help="stop at this estimated relative mean squared error",
    )
    arguments.add_view(parser)
    frames = parser.add_mutually_exclusive_group()
    frames.add_argument("--frame", type=float, metavar="F", help="time code")
    frames.add_argument(
        "--frames", type=arguments.frames, metavar="A:B", help="every frame from A to B"
    )
    add("--seed", type=int, default=0, metavar="N", help="default: 0")
    add("--passes", metavar="a,b,...", help="passes in the EXR beside Combined")
    add("--reference", metavar="REF.exr", help="measure the error against this picture")
    add("--stats", type=Path, metavar="STATS.json", help="write statistics")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> Status:
    """Renders one frame or several."""
    if options.stats is not None:
        if not options.stats.parent.is_dir():
            raise UsageError(f"{options.stats}: the folder {options.stats.parent} does not exist")
        output.check_files(options.stats)
    reference = images.read_rgb(options.reference) if options.reference else None
    frames = [options.frame]
    if options.frames is not None:
        first, last = options.frames
        frames = [float(f) for f in range(first, last + 1)]
    many = len(frames) > 1
    output.check_path(*(output.frame_path(options.output, frame, many) for frame in frames))
    collected = []
    with Cancellation() as cancellation:
        for frame in frames:
            stats = _render_frame(options, frame, many, reference, cancellation)
            if stats is not None:
                collected.append(stats)
            if cancellation.requested:
                break
    if options.stats is not None and collected:
        result = collected[0] if options.frames is None else {"frames": collected}
        options.stats.write_text(json.dumps(result, indent=2) + "\n")
    return Status.CANCELLED if cancellation.requested else Status.DONE


def _settings(options: argparse.Namespace) -> dict[str, Any]:
    """The engine's settings that the command line gives; what it leaves unsaid stays unsaid."""
    settings: dict[str, Any] = {"threads": options.threads, "seed": options.seed}
    if options.integrator:
        settings["integrator"] = options.integrator
    if options.kernel:
        settings["kernel"] = options.kernel
    if options.kernel_size:
        settings["kernel_size"] = options.kernel_size
    if options.memory_budget:
        settings["memory_budget"] = options.memory_budget
    if options.estimator:
        settings["estimator"] = options.estimator
    if options.bridges:
        settings["bridges"] = options.bridges
    if options.max_depth is not None:
        settings["max_depth"] = options.max_depth
    if options.passes:
        named = [p.strip() for p in options.passes.split(",") if p.strip()]
        settings["passes"] = ["Combined", *(p for p in named if p != "Combined")]
    if options.samples:
        settings["samples"] = options.samples
    elif options.time:
        settings["time"] = options.time
    elif options.noise_threshold:
        settings["noise_threshold"] = options.noise_threshold
    else:
        settings["noise_threshold"] = DEFAULT_THRESHOLD
        settings["time"] = DEFAULT_SECONDS
    return settings


def _render_frame(
    options: argparse.Namespace,
    frame: float | None,
    many: bool,
    reference: np.ndarray | None,
    cancellation: Cancellation,
) -> dict[str, Any] | None:
    """Renders and writes one frame; returns its statistics, None if it was cancelled early."""
    from .. import usd

    began = time.perf_counter()
    scene: Scene = Scene()
    stage = usd.load(
        options.stage,
        frame=frame,
        camera=options.camera,
        resolution=options.resolution,
        scene=scene,
    )
    loading = time.perf_counter() - began
    _say(options, stage.report.text())
    if cancellation.requested:
        return None
    render = Render(scene, {**stage.settings(), **_settings(options)})
    report = {kind.name.lower(): [str(e) for e in stage.report.of(kind)] for kind in usd.Kind}
    del scene, stage.scene  # the render has its own copy
    curve = None
    if reference is not None:
        try:
            curve = Curve(render, reference)
        except ValueError as error:
            raise InputError(f"{options.reference}: {error}") from None
    path = output.frame_path(options.output, frame, many)
    with Progress(path.name, options.quiet) as progress:

        def on_progress(report: dict[str, Any]) -> bool:
            progress.update(report)
            if curve is not None:
                curve.update(report)
            return cancellation.requested

        render.run(on_progress)
    stats = render.stats()
    stats["loading_seconds"] = loading + float(stats.get("build_seconds", 0.0))
    stats["unsupported"] = report["unsupported"]
    stats["stage"] = {
        "path": str(options.stage),
        "camera": stage.camera,
        "frame": stage.frame,
        **{k: v for k, v in report.items() if k != "unsupported"},
    }
    if curve is not None:
        stats["curve"] = curve.finish(stats)
        stats["cpu_seconds"] -= curve.cpu_cost
    else:
        for point in stats.get("curve", []):
            point.setdefault("mape", None)
            point.setdefault("relmse", None)
    _say(options, _engine_warnings(stats))
    written = output.write(render, path, {"segue:stage": str(options.stage)})
    _say(options, _summary(stats, written))
    return stats


def _engine_warnings(stats: dict[str, Any]) -> str:
    """What the engine repaired or dropped of what it was given, each once."""
    found = dict.fromkeys(stats.get("warnings", ()))
    return "\n".join(["Warnings:", *(f"  - {w}" for w in found)]) if found else ""


def _summary(stats: dict[str, Any], written: list[Path]) -> str:
    parts = [
        f"{', '.join(str(p) for p in written)}: {stats['samples']:g} samples",
        f"{error_text(stats)} after {clock(stats['seconds'])}",
        f"{clock(stats['loading_seconds'])} loading",
    ]
    if stats.get("non_finite"):
        parts.append(f"{stats['non_finite']} non-finite samples were dropped")
    if stats.get("curve"):
        last = stats["curve"][-1]
        if last.get("mape") is not None:
            parts.append(f"MAPE {last['mape']:.4g}, relMSE {last['relmse']:.4g}")
    return "; ".join(parts)


def _say(options: argparse.Namespace, text: str) -> None:
    if text and not options.quiet:
        print(text, file=sys.stderr)
