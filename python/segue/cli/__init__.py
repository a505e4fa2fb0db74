"""The `segue` command: render stages, compare pictures, and say what is in a stage."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from .. import __version__
from . import compare, converge, info, reference, render
from .status import BAD_USAGE, Status, status_of


def build_parser() -> argparse.ArgumentParser:
    """The command line."""
    parser = argparse.ArgumentParser(
        prog="segue",
        description="Physically based rendering of USD stages.",
        epilog="Exit status: 0 done, 1 the engine failed or a file could not be written, 2 bad "
        "usage, 3 bad input, 4 a reference was not reached, 130 cancelled (what was rendered so "
        "far is saved).",
    )
    parser.add_argument("--version", action="version", version=f"segue {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in (render, compare, converge, reference, info):
        command.add_parser(commands)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit status."""
    parser = build_parser()
    try:
        options = parser.parse_args(arguments)
    except SystemExit as stop:  # argparse: 0 after --help, 2 after a mistake
        return stop.code if isinstance(stop.code, int) else BAD_USAGE
    try:
        return int(options.run(options))
    except Exception as error:
        status = status_of(error)
        if status is None:
            raise
        print(f"segue: {error}", file=sys.stderr)
        return int(status)
    except KeyboardInterrupt:
        return int(Status.CANCELLED)
