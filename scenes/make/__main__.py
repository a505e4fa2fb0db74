"""Makes the gallery: `python -m scenes.make [NAME ...]`, from the root of the project."""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path

NAMES = [
    "glass_caustic",
    "door_ajar",
    "glossy_room",
    "lamp",
    "night_market",
    "pool",
    "still_life",
]


def main() -> None:
    """Writes every named stage, or all of them, with the textures they use."""
    parser = argparse.ArgumentParser(prog="python -m scenes.make", description=main.__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}")
    parser.add_argument(
        "--out", type=Path, default=Path(__file__).parents[1], help="folder to write into"
    )
    given = parser.parse_args()
    unknown = [name for name in given.names if name not in NAMES]
    if unknown:
        parser.error(f"no such scene: {', '.join(unknown)}")
    (given.out / "textures").mkdir(parents=True, exist_ok=True)
    for name in given.names or NAMES:
        scene = importlib.import_module(f".{name}", __package__).build(given.out / "textures")
        path = scene.save(given.out)
        print(f"{path}  {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
