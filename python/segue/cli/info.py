"""`segue info`: what is in a stage, what it needs, and what is not supported."""

from __future__ import annotations

import argparse
import json
from typing import Any

from .status import Status


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Adds the subcommand."""
    parser = commands.add_parser(
        "info",
        help="what is in a stage and what is not supported",
        description="Imports a stage without rendering it and prints what it holds, what the "
        "engine needs for it and leaves out, and what is not supported.",
    )
    parser.add_argument("stage", metavar="STAGE")
    parser.add_argument("--frame", type=float, help="time code (default: the stage's start)")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> Status:
    """Prints the description."""
    from .. import usd

    stage = usd.load(options.stage, frame=options.frame)
    width, height = stage.resolution
    print(f"camera      {stage.camera}")
    print(f"resolution  {width} x {height}")
    if stage.frame is not None:
        print(f"frame       {stage.frame:g}")
    for name, count in stage.counts.items():
        print(f"{name:16}{count}")
    described = stage.scene.info()
    for heading, key in (("Scene", "counts"), ("Needs", "needs")):
        if described.get(key):
            print(f"{heading}:")
            for name, value in described[key].items():
                print(f"  {name}: {_plain(value)}")
    for heading, key in (("Left out by the engine", "left_out"), ("Warnings", "warnings")):
        if described.get(key):
            print(f"{heading}:")
            for line in described[key]:
                print(f"  - {line}")
    text = stage.report.text(paths=1000)
    if text:
        print(text)
    elif not described.get("warnings"):
        print("Everything in the stage is supported.")
    return Status.DONE


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
