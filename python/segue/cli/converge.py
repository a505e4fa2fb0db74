"""`segue converge`: error against run time of several methods, as a report."""

from __future__ import annotations

import argparse
import os
import platform
import sys
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__, images
from ..convergence import methods, peers, running, tables
from ..convergence import reference as references
from ..scene import Scene
from . import arguments, reference
from .cancellation import Cancellation
from .status import InputError, Status, UsageError

#: The error of a reference that is made on the way.
DEFAULT_TARGET = 1e-4
_REFERENCE = "reference.exr"


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Adds the subcommand."""
    parser = commands.add_parser(
        "converge",
        help="measure error against run time of several methods",
        description="Renders a stage with several methods in turns, slice by slice, measures their "
        "errors against a reference as they go, and writes curves, tables, pictures and a page "
        "that shows all of it. Seconds are those of each method's own rendering.",
    )
    arguments.add_stage(parser)
    add = parser.add_argument
    add("-o", "--output", required=True, metavar="DIR", type=Path, help="folder of the report")
    add(
        "--methods",
        type=arguments.names,
        default=["segment", "path"],
        metavar="a,b,...",
        help=f"integrators, or {', '.join(methods.VARIANTS)} (default: segment,path)",
    )
    add(
        "--time",
        required=True,
        type=arguments.positive,
        metavar="SECONDS",
        help="rendering time of each method in each repeat",
    )
    add("--repeat", type=arguments.count, default=1, metavar="R", help="renders of each method")
    add("--seed", type=int, default=0, metavar="N", help="seed of the first repeat (default: 0)")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--reference", metavar="REF.exr", help="measure against this picture")
    source.add_argument(
        "--make-reference",
        type=arguments.positive,
        metavar="HOURS",
        help=f"make the reference first, in at most this time; it is kept as DIR/{_REFERENCE}",
    )
    add(
        "--target-relmse",
        type=arguments.positive,
        default=DEFAULT_TARGET,
        metavar="E",
        help="estimated error at which a reference is good enough (default: %(default)g)",
    )
    add(
        "--reference-integrator",
        default="path",
        metavar="NAME",
        help="method of --make-reference (default: %(default)s)",
    )
    add(
        "--peers",
        type=arguments.names,
        default=[],
        metavar="a,b,...",
        help="other renderers to compare with where their harness is installed: "
        f"{', '.join(peers.VARIANTS)}",
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> Status:
    """Renders, measures and writes the report."""
    if options.output.exists() and not options.output.is_dir():
        raise UsageError(f"{options.output} is not a folder")
    if not options.output.absolute().parent.is_dir():
        raise UsageError(f"{options.output}: its parent folder does not exist")
    # A missing library is better known before hours of rendering than after.
    from ..convergence import report

    # A reference that cannot be read likewise.
    picture = images.read_rgb(options.reference) if options.reference else None
    stage, settings = arguments.load_stage(options)
    settings["seed"] = options.seed
    with Cancellation() as cancellation:

        def cancelled() -> bool:
            return cancellation.requested

        lasting = running.iteration_seconds(stage.scene, options.methods, settings, cancelled)
        options.output.mkdir(exist_ok=True)
        path = Path(options.reference or options.output / _REFERENCE)
        if picture is None:
            status = _make_reference(options, stage.scene, settings, path, cancellation)
            if status is not Status.DONE:
                return status
            picture = images.read_rgb(str(path))
        length = running.slice_length(options.time, max(lasting.values()))
        times = running.measure_times(options.time, length)
        outcomes = []
        for repeat in range(options.repeat):
            contestants = [
                running.Contestant(stage.scene, method, repeat, settings, length)
                for method in options.methods
            ]
            _check_size(path, picture, contestants[0])

            def on_time(seconds: float, repeat: int = repeat) -> None:
                _say(options, f"repeat {repeat + 1} of {options.repeat}: {seconds:.3g} s each")

            running.race(contestants, times, picture, cancelled, on_time)
            outcomes += [c.outcome() for c in contestants if c.points]
            del contestants  # the next repeat's renders need the memory
            if cancelled():
                break
        if not outcomes:
            print("segue: cancelled before anything was measured", file=sys.stderr)
            return Status.CANCELLED
        if options.peers and not cancelled():
            outcomes += _ask_peers(options, times, picture)
    known = references.known_error(str(path))
    facts = _facts(options, settings, path, known, length, outcomes)
    report.write(options.output, options.stage.name, facts, outcomes, picture, known)
    rows = tables.final_errors(outcomes)
    _say(options, tables.markdown(rows) + f"{options.output / 'index.html'} is written")
    return Status.CANCELLED if cancelled() else Status.DONE


def _make_reference(
    options: argparse.Namespace,
    scene: Scene,
    settings: dict[str, Any],
    path: Path,
    cancellation: Cancellation,
) -> Status:
    return reference.make(
        scene,
        {**settings, "integrator": options.reference_integrator, "seed": references.FIRST_SEED},
        options.target_relmse,
        3600 * options.make_reference,
        path,
        options.stage,
        cancellation,
        options.quiet,
    )


def _check_size(path: Path, picture: np.ndarray, contestant: running.Contestant) -> None:
    height, width = contestant.picture().shape[:2]
    if picture.shape[:2] != (height, width):
        raise InputError(
            f"{path}: the reference is {picture.shape[1]} x {picture.shape[0]}, "
            f"the picture {width} x {height}"
        )
    bad = int((~np.isfinite(picture)).sum())
    if bad:
        raise InputError(f"{path}: {bad} values of the reference are not finite")


def _ask_peers(
    options: argparse.Namespace, times: list[float], picture: np.ndarray
) -> list[running.Outcome]:
    # Every time is a render of its own with them: every second one is enough.
    chosen = times[::-1][::2][::-1]
    try:
        found = peers.render(options.stage, options.peers, chosen, options.seed, picture)
    except peers.PeersError as error:
        print(f"segue: without other renderers: {error}", file=sys.stderr)
        return []
    for name in options.peers:
        if peers.VARIANTS.get(name, name) not in [o.method for o in found]:
            print(f"segue: without {name}: it has no result", file=sys.stderr)
    return found


def _facts(
    options: argparse.Namespace,
    settings: dict[str, Any],
    path: Path,
    known: float | None,
    length: float,
    outcomes: list[running.Outcome],
) -> list[tuple[str, str]]:
    width, height = settings["resolution"]
    threads = next((o.stats["threads"] for o in outcomes if o.stats), 0)
    own = f"relMSE {known:.3g} by its own estimate" if known is not None else "error not known"
    used = ", ".join(f"{m}: {_plain(methods.settings_of(m))}" for m in options.methods)
    return [
        ("Stage", str(options.stage)),
        ("Resolution", f"{width} x {height}"),
        ("Reference", f"{path} ({own})"),
        ("Methods", used),
        (
            "Time",
            f"{options.time:g} s for each method, in turns of {length:.3g} s; {options.repeat} "
            f"repeat{'s' if options.repeat > 1 else ''}, seeds from {options.seed}",
        ),
        ("Machine", f"{threads} threads of {os.cpu_count()}, {platform.machine()}"),
        ("Engine", f"Segue {__version__}"),
        ("All together", str(timedelta(seconds=round(_total(outcomes))))),
    ]


def _plain(settings: dict[str, Any]) -> str:
    return " ".join(f"{k}={v}" for k, v in settings.items())


def _total(outcomes: list[running.Outcome]) -> float:
    return sum(o.points[-1].seconds for o in outcomes if o.points)


def _say(options: argparse.Namespace, text: str) -> None:
    if not options.quiet:
        print(text, file=sys.stderr)
