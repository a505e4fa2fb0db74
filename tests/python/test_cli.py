"""The command as a whole, in processes of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import segue

pytest.importorskip("pxr")
pytest.importorskip("OpenImageIO")

from segue import images, tonemapping
from segue.cli.curve import Curve

pytestmark = pytest.mark.usefixtures("engine")

PACKAGE = os.path.dirname(os.path.dirname(segue.__file__))
STAGE = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 3
)
def Sphere "Ball" {
    double3 xformOp:translate.timeSamples = {
        1: (-1, 0, 0),
        3: (1, 0, 0),
    }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    color3f[] primvars:displayColor = [(0.8, 0.4, 0.2)]
}
def BasisCurves "Hair" { }
def DomeLight "Sky" {
    float inputs:intensity = 0.5
}
def RectLight "Lamp" {
    float inputs:diffuse = 0.5
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Camera "Camera" {
    double3 xformOp:translate = (0, 0, 20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Scope "Render" {
    def RenderSettings "Settings" {
        uniform int2 resolution = (48, 32)
    }
}
"""


@pytest.fixture
def stage(tmp_path):
    path = tmp_path / "stage.usda"
    path.write_text(STAGE)
    return path


def start(*arguments, **options):
    environment = {**os.environ, "PYTHONPATH": PACKAGE}
    return subprocess.Popen(
        [sys.executable, "-m", "segue", *map(str, arguments)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def run(*arguments, status=0):
    process = start(*arguments)
    out, err = process.communicate(timeout=120)
    assert process.returncode == status, err
    return out, err


def test_render(stage, tmp_path):
    out, err = run("render", stage, "-o", tmp_path / "a.exr", "--samples", 4)
    assert out == ""
    assert "curves; left out" in err
    assert "/Hair" in err
    picture = images.read_rgb(str(tmp_path / "a.exr"))
    assert picture.shape == (32, 48, 3)
    np.testing.assert_allclose(picture[0, 0], 0.5, rtol=1e-3)


def test_quiet_says_nothing(stage, tmp_path):
    assert run("render", stage, "-o", tmp_path / "a.exr", "--samples", 1, "--quiet") == ("", "")


def test_png_beside_the_exr(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "a.png", "--samples", 4, "--quiet")
    linear = images.read_rgb(str(tmp_path / "a.exr"))
    png = images.read(str(tmp_path / "a.png")).pixels
    assert png.shape == (32, 48, 3)
    expected = tonemapping.to_srgb(tonemapping.neutral(linear)).astype(int)
    assert np.abs(png.astype(int) - expected).max() <= 1  # the EXR holds 16-bit floats


def test_statistics(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "a.exr", "--samples", 4, "--stats", tmp_path / "s.json",
        "--quiet")  # fmt: skip
    stats = json.loads((tmp_path / "s.json").read_text())
    assert {
        "integrator", "seconds", "cpu_seconds", "loading_seconds", "samples", "rays",
        "peak_memory_bytes", "non_finite", "stages", "left_out", "unsupported", "curve",
    } <= set(stats)  # fmt: skip
    assert stats["samples"] == 4
    assert stats["unsupported"] == [
        "/Hair: curves; left out",
        "/Lamp: the diffuse multiplier 0.5 of a light; 1 is used",
    ]
    for point in stats["curve"]:
        assert set(point) == {
            "seconds", "cpu_seconds", "samples", "estimated_error", "estimated_bias", "mape",
            "relmse",
        }  # fmt: skip


def test_the_curve_against_a_reference_falls(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "ref.exr", "--samples", 512, "--quiet")
    run("render", stage, "-o", tmp_path / "a.exr", "--time", 2, "--seed", 5, "--reference",
        tmp_path / "ref.exr", "--stats", tmp_path / "s.json", "--quiet")  # fmt: skip
    stats = json.loads((tmp_path / "s.json").read_text())
    curve = stats["curve"]
    assert len(curve) >= 3
    for name in ("seconds", "cpu_seconds", "samples"):
        values = [p[name] for p in curve]
        assert values == sorted(values), name
    assert curve[-1]["mape"] < curve[0]["mape"]
    assert curve[-1]["seconds"] == stats["seconds"]
    out, _ = run("compare", tmp_path / "a.exr", tmp_path / "ref.exr", "--json")
    assert json.loads(out)["mape"] == pytest.approx(curve[-1]["mape"], rel=0.02)


class PaintedFilm:
    """Stands for a render whose film holds one value."""

    size = (4, 2)
    value = 0.0

    def read_pass(self, name):
        assert name == "Combined"
        return np.full((2, 4, 4), self.value, np.float32)


def test_reports_after_the_end_do_not_lengthen_the_curve():
    film = PaintedFilm()
    curve = Curve(film, np.ones((2, 4, 3), np.float32))
    for seconds, film.value in ((0.1, 0.1), (0.3, 0.5), (1.5, 0.9), (2.0, 0.9)):
        curve.update({"seconds": seconds, "samples": 10 * seconds})
    points = curve.finish({"seconds": 1.4, "samples": 14.5})
    assert [p["samples"] for p in points] == [3.0, 14.5]
    assert 0.3 <= points[0]["seconds"] < points[1]["seconds"] == 1.4
    assert points[0]["cpu_seconds"] <= points[1]["cpu_seconds"]
    np.testing.assert_allclose([p["mape"] for p in points], [0.5, 0.1], rtol=0.02)


def test_compare(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "a.exr", "--samples", 1, "--quiet")
    out, _ = run(
        "compare", tmp_path / "a.exr", tmp_path / "a.exr", "--json", "--metric", "mape,mse"
    )
    assert json.loads(out) == {"mape": 0.0, "mse": 0.0}
    out, _ = run("compare", tmp_path / "a.exr", tmp_path / "a.exr")
    assert out.split()[:2] == ["mape", "0"]


def test_frames(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "f.####.exr", "--frames", "1:3", "--samples", 4,
        "--stats", tmp_path / "s.json", "--quiet")  # fmt: skip
    pictures = [images.read_rgb(str(tmp_path / f"f.000{n}.exr")) for n in (1, 2, 3)]
    reds = [(p[..., 0] - p[..., 2])[16] for p in pictures]
    centers = [np.average(np.arange(48), weights=np.maximum(r, 0) + 1e-9) for r in reds]
    assert centers[0] < centers[1] < centers[2]
    assert len(json.loads((tmp_path / "s.json").read_text())["frames"]) == 3


def test_options_reach_the_engine(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "a.exr", "--samples", 2, "--resolution", "20x10",
        "--max-depth", 1, "--threads", 1, "--seed", 3, "--passes", "Depth,Normal",
        "--integrator", "path", "--camera", "Camera", "--frame", 2, "--stats",
        tmp_path / "s.json", "--quiet")  # fmt: skip
    stats = json.loads((tmp_path / "s.json").read_text())
    assert (stats["width"], stats["height"], stats["seed"], stats["threads"]) == (20, 10, 3, 1)
    import OpenImageIO

    file = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr"))
    names = " ".join(file.spec().channelnames)
    assert "Depth" in names
    assert "Normal" in names


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["render", "gone.usda", "-o", "a.exr"], 3, "gone.usda"),
        (["render", "STAGE", "-o", "a.exr", "--camera", "Nobody"], 3, "Nobody"),
        (["render", "STAGE", "-o", "a.exr", "--integrator", "magic"], 2, "magic"),
        (["render", "STAGE", "-o", "a.exr", "--passes", "Magic"], 2, "Magic"),
        (["render", "STAGE", "-o", "a.exr", "--reference", "gone.exr"], 3, "gone.exr"),
        (["compare", "gone.exr", "gone.exr"], 3, "gone.exr"),
        (["info", "gone.usda"], 3, "gone.usda"),
    ],
)
def test_failures_are_one_line(stage, tmp_path, arguments, status, words):
    here = {"STAGE": str(stage), "a.exr": str(tmp_path / "a.exr")}
    out, err = run(*(here.get(a, a) for a in arguments), status=status)
    assert out == ""
    line = err.strip().splitlines()[-1]
    assert line.startswith("segue: ")
    assert words in line
    assert "Traceback" not in err


@pytest.mark.parametrize("name", ["folder.exr", "folder.png", "/proc/x.exr", "/proc/x.png"])
def test_outputs_that_cannot_be_written_are_found_first(stage, tmp_path, name):
    (tmp_path / "folder.exr").mkdir()
    (tmp_path / "folder.png").mkdir()
    began = time.monotonic()
    _, err = run("render", stage, "-o", tmp_path / name, "--time", 60, status=1)
    assert time.monotonic() - began < 30
    assert err.splitlines()[0].startswith("segue: ")
    reason = "it is a folder" if "folder" in name else "No such file or directory"
    assert err.endswith(f" cannot be written: {reason}\n")


def test_statistics_that_cannot_be_written_are_found_first(stage, tmp_path):
    _, err = run("render", stage, "-o", tmp_path / "a.exr", "--stats", tmp_path, status=1)
    assert err == f"segue: {tmp_path} cannot be written: it is a folder\n"
    assert list(tmp_path.glob("*.exr")) == []


def test_a_picture_that_cannot_be_written_says_why(tmp_path):
    with pytest.raises(segue.OutputError, match=r"gone/a.png cannot be written: \w+"):
        images.write_png(tmp_path / "gone" / "a.png", np.zeros((2, 2, 3), np.uint8))
    with pytest.raises(segue.OutputError, match=r"gone/a.exr cannot be written: \w+"):
        images.write_exr(tmp_path / "gone" / "a.exr", {"Combined": np.zeros((2, 2, 3))}, {})


def test_a_reference_of_another_size(stage, tmp_path):
    run("render", stage, "-o", tmp_path / "r.exr", "--samples", 1, "--resolution", "8x8", "--quiet")
    _, err = run("render", stage, "-o", tmp_path / "a.exr", "--samples", 1, "--reference",
                 tmp_path / "r.exr", status=3)  # fmt: skip
    assert "8 x 8" in err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_save_what_was_rendered(stage, tmp_path, number):
    process = start("render", stage, "-o", tmp_path / "a.exr", "--time", 100, "--stats",
                    tmp_path / "s.json")  # fmt: skip
    time.sleep(4)
    began = time.monotonic()
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert time.monotonic() - began < 10
    picture = images.read_rgb(str(tmp_path / "a.exr"))
    np.testing.assert_allclose(picture[0, 0], 0.5, rtol=1e-3)
    assert json.loads((tmp_path / "s.json").read_text())["samples"] > 0


def test_the_engines_warnings_are_said(tmp_path):
    path = tmp_path / "closed.usda"
    path.write_text(
        '#usda 1.0\ndef Camera "Camera" { }\ndef Sphere "Ball" { }\n'
        'def SphereLight "Lamp" (\nprepend apiSchemas = ["ShapingAPI"]\n) {\n'
        "float inputs:shaping:cone:angle = 0\n}\n"
    )
    dropped = 'light "/Lamp": dropped, it emits nothing: its cone is closed'
    _, err = run("render", path, "-o", tmp_path / "a.exr", "--samples", 1, "--resolution", "8x8")
    assert err.count(dropped) == 1
    assert "nothing emits light" in err
    out, _ = run("info", path)
    assert out.count(dropped) == 1
    assert "Everything in the stage is supported" not in out


def test_info(stage):
    out, _ = run("info", stage)
    assert "/Camera" in out
    assert "48 x 32" in out
    assert "curves; left out" in out


def test_progress_bar_on_a_terminal(stage, tmp_path):
    pytest.importorskip("rich")
    pty = pytest.importorskip("pty")
    main, terminal = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "segue", "render", str(stage), "-o", str(tmp_path / "a.exr"),
         "--time", "2"],
        env={**os.environ, "PYTHONPATH": PACKAGE, "TERM": "xterm", "COLUMNS": "120"},
        stdout=subprocess.DEVNULL,
        stderr=terminal,
    )  # fmt: skip
    os.close(terminal)
    shown = b""
    while True:
        try:
            part = os.read(main, 65536)
        except OSError:
            break
        if not part:
            break
        shown += part
    assert process.wait(timeout=30) == 0
    text = shown.decode(errors="replace")
    for word in ("a.exr", "samples", "elapsed", "left", "error"):
        assert word in text
