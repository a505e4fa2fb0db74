"""What the subcommands' arguments have in common: their types, and how a stage is named."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import Any


def size(text: str) -> tuple[int, int]:
    """A size of a picture."""
    match = re.fullmatch(r"(\d+)[xX](\d+)", text)
    if not match or not (int(match[1]) and int(match[2])):
        raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT, such as 1280x720")
    return int(match[1]), int(match[2])


def frames(text: str) -> tuple[int, int]:
    """A range of frames."""
    match = re.fullmatch(r"(-?\d+):(-?\d+)", text)
    if not match or int(match[1]) > int(match[2]):
        raise argparse.ArgumentTypeError(f"{text!r} is not FIRST:LAST, such as 1:24")
    return int(match[1]), int(match[2])


def positive(text: str) -> float:
    """A finite number above 0."""
    number = float(text)
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return number


def count(text: str) -> int:
    """A whole number above 0."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{text} is not at least 1")
    return number


def names(text: str) -> list[str]:
    """Names between commas, each once."""
    found = list(dict.fromkeys(n.strip() for n in text.split(",") if n.strip()))
    if not found:
        raise argparse.ArgumentTypeError("names nothing")
    return found


def add_view(parser: argparse.ArgumentParser) -> None:
    """Adds how a stage is seen, and what every method obeys."""
    add = parser.add_argument
    add("--resolution", type=size, metavar="WxH", help="default: the stage's, else 1280 wide")
    add("--camera", metavar="PRIM", help="path or name of a camera (default: the stage's)")
    add("--max-depth", type=int, metavar="N", help="bounces, -1 without limit (default)")
    add("--threads", type=int, default=0, metavar="N", help="default: all")
    add("--quiet", action="store_true", help="say nothing but errors")


def add_stage(parser: argparse.ArgumentParser) -> None:
    """Adds a stage at one time, and the view of it."""
    add = parser.add_argument
    add("stage", metavar="STAGE", type=Path, help="a .usd, .usda, .usdc or .usdz file")
    add("--frame", type=float, metavar="F", help="time code")
    add_view(parser)


def load_stage(options: argparse.Namespace) -> tuple[Any, dict[str, Any]]:
    """The stage that `add_stage` names, and the settings of its renders."""
    from .. import usd

    stage = usd.load(
        options.stage,
        frame=options.frame,
        camera=options.camera,
        resolution=options.resolution,
    )
    settings = {**stage.settings(), "threads": options.threads}
    if options.max_depth is not None:
        settings["max_depth"] = options.max_depth
    return stage, settings
