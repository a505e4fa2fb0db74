"""Renders the gallery's pictures: `python -m scenes.make.pictures [NAME ...] --time 60`."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import OpenImageIO

from .__main__ import NAMES

FOLDER = Path(__file__).parents[1]


def picture(name: str, options: list[str], quality: int) -> Path:
    """Renders one stage with the `segue` command and writes its picture as JPEG."""
    out = FOLDER / "pictures" / f"{name}.jpg"
    out.parent.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        png = Path(temporary) / f"{name}.png"
        stage = FOLDER / f"{name}.usda"
        command = [sys.executable, "-m", "segue", "render", str(stage), "-o", str(png), *options]
        subprocess.run(command, check=True)
        image = OpenImageIO.ImageBufAlgo.channels(OpenImageIO.ImageBuf(str(png)), (0, 1, 2))
        image.specmod().attribute("Compression", f"jpeg:{quality}")
        if not image.write(str(out)):
            raise OSError(f"cannot write {out}: {image.geterror()}")
    return out


def main() -> None:
    """Renders every named picture, or all."""
    parser = argparse.ArgumentParser(
        prog="python -m scenes.make.pictures", description=main.__doc__
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}")
    parser.add_argument("--quality", type=int, default=88, help="JPEG quality (default: 88)")
    parser.add_argument("--time", type=float, default=60, help="seconds for each (default: 60)")
    parser.add_argument("--integrator", metavar="NAME", help="method (default: the engine's)")
    given = parser.parse_args()
    options = ["--time", str(given.time)]
    if given.integrator:
        options += ["--integrator", given.integrator]
    for name in given.names or NAMES:
        path = picture(name, options, given.quality)
        print(f"{path}  {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
