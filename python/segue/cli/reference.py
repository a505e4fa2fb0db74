"""`segue reference`: a picture to measure others against, which knows its own error."""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from ..convergence import methods, reference
from ..scene import Scene
from . import arguments
from .cancellation import Cancellation
from .progress import INTERVAL, clock
from .status import Status, UsageError


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Adds the subcommand."""
    parser = commands.add_parser(
        "reference",
        help="render a reference whose own error is known",
        description="Renders a stage again and again, each time with another seed, until the "
        "relative mean squared error of the mean, estimated from the renders' scatter, is at most "
        "the target. The EXR holds the layers Combined and Variance (of the mean). If the target "
        "is not reached in time, or if the two halves of the renders tell errors that differ by "
        f"more than a factor of {reference.RELIABLE:g}, what there is goes to OUT.partial.exr and "
        "the exit status is 4. The estimate is of noise: not of what the method blurs or cannot "
        "find.",
    )
    arguments.add_stage(parser)
    add = parser.add_argument
    add("-o", "--output", required=True, metavar="REF.exr", type=Path, help="the reference")
    add(
        "--target-relmse",
        required=True,
        type=arguments.positive,
        metavar="E",
        help="estimated relative mean squared error at which to stop",
    )
    add(
        "--max-time",
        type=arguments.positive,
        default=float("inf"),
        metavar="SECONDS",
        help="give up after this time (default: never)",
    )
    add("--integrator", default="path", metavar="NAME", help="method (default: %(default)s)")
    add(
        "--seed",
        type=int,
        default=reference.FIRST_SEED,
        metavar="N",
        help="first seed; far from those of what is compared with it (default: %(default)s)",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> Status:
    """Makes the reference, or says why not."""
    if options.output.suffix.lower() != ".exr":
        raise UsageError(f"{options.output}: a reference has to be an .exr")
    if not options.output.parent.is_dir():
        raise UsageError(f"{options.output}: the folder {options.output.parent} does not exist")
    stage, settings = arguments.load_stage(options)
    settings.update(integrator=options.integrator, seed=options.seed)
    with Cancellation() as cancellation:
        return make(
            stage.scene,
            settings,
            options.target_relmse,
            options.max_time,
            options.output,
            options.stage,
            cancellation,
            options.quiet,
        )


def make(
    scene: Scene,
    settings: dict[str, Any],
    target: float,
    max_time: float,
    path: Path,
    stage: Path,
    cancellation: Cancellation,
    quiet: bool,
) -> Status:
    """Makes a reference and writes it, as `.partial.exr` where it is none."""
    integrator = settings["integrator"]
    if integrator not in methods.UNBIASED and not quiet:
        print(
            f"segue: {integrator} blurs: its bias, that of renders of at most a "
            f"{reference.MIN_RENDERS}th of all samples, is no part of the estimated error",
            file=sys.stderr,
        )
    last = time.monotonic()

    def on_estimate(found: reference.Estimate | None, seconds: float) -> None:
        nonlocal last
        if quiet or found is None or time.monotonic() - last < INTERVAL:
            return
        last = time.monotonic()
        print(
            f"{path.name}: {found.renders} renders, {found.samples:g} samples, {clock(seconds)}: "
            f"relMSE {found.relmse:.3g}, wanted {target:g}",
            file=sys.stderr,
        )

    result = reference.make(
        scene, settings, target, max_time, on_estimate, lambda: cancellation.requested
    )
    refusal = result.refusal
    written = path if refusal is None else path.with_name(f"{path.stem}.partial.exr")
    if result.estimate is not None:
        described = {"segue:stage": str(stage), "segue:integrator": integrator}
        reference.write(written, result, described)
    if result.non_finite:
        print(f"segue: {result.non_finite} non-finite samples were dropped", file=sys.stderr)
    if refusal is not None:
        kept = f" (kept as {written})" if result.estimate is not None else ""
        print(f"segue: no reference: {refusal}{kept}", file=sys.stderr)
        return Status.CANCELLED if result.cancelled else Status.REFUSED
    if not quiet:
        found = result.estimate
        print(
            f"{written}: relMSE {found.relmse:.3g} (halves {found.halves[0]:.3g} and "
            f"{found.halves[1]:.3g}), {found.renders} renders, {found.samples:g} samples, "
            f"{clock(result.seconds)}",
            file=sys.stderr,
        )
    return Status.DONE
