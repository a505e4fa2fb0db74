"""`segue compare`: errors of a picture against a reference."""

from __future__ import annotations

import argparse
import json
import math

from .. import images, metrics
from .status import InputError, Status, UsageError


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Adds the subcommand."""
    parser = commands.add_parser(
        "compare",
        help="error of a picture against a reference",
        description="Errors of the linear colours of an EXR picture against a reference: mean "
        "absolute percentage error, relative and plain mean squared error, symmetric mean "
        "absolute percentage error.",
    )
    parser.add_argument("picture", metavar="A.exr")
    parser.add_argument("reference", metavar="REF.exr")
    parser.add_argument(
        "--metric",
        default=",".join(metrics.METRICS),
        help="which, separated by commas (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> Status:
    """Prints the errors."""
    wanted = [name.strip() for name in options.metric.split(",") if name.strip()]
    unknown = [name for name in wanted if name not in metrics.METRICS]
    if unknown or not wanted:
        raise UsageError(f"--metric {options.metric}: known are {', '.join(metrics.METRICS)}")
    picture = images.read_rgb(options.picture)
    reference = images.read_rgb(options.reference)
    try:
        found = metrics.errors(picture, reference)
    except ValueError as error:
        raise InputError(str(error)) from None
    # Against a black reference relative errors are infinite, which JSON cannot say.
    result = {name: found[name] if math.isfinite(found[name]) else None for name in wanted}
    if options.json:
        print(json.dumps(result))
    else:
        for name, number in result.items():
            print(f"{name:12} {'infinite' if number is None else f'{number:.6g}'}")
    return Status.DONE
