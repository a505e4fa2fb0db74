"""`segue converge` and `segue reference` as a whole, on a tiny stage."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import threading

import numpy as np
import pytest

pytest.importorskip("pxr")
pytest.importorskip("OpenImageIO")
pytest.importorskip("matplotlib")

from segue import images, metrics, usd
from segue.cli import converge, main
from segue.cli.cancellation import Cancellation
from segue.convergence import peers, reference

pytestmark = pytest.mark.usefixtures("engine")

#: All of the picture is lit, and noisy: there are no few pixels that decide its error.
STAGE = """#usda 1.0
(
    upAxis = "Y"
)
def Sphere "Ball" {
    color3f[] primvars:displayColor = [(0.8, 0.4, 0.2)]
}
def Mesh "Wall" {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-40, -40, -3), (40, -40, -3), (40, 40, -3), (-40, 40, -3)]
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
def SphereLight "Lamp" {
    float inputs:radius = 2
    float inputs:intensity = 20
    double3 xformOp:translate = (4, 5, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DomeLight "Sky" {
    float inputs:intensity = 0.3
}
def Camera "Camera" {
    double3 xformOp:translate = (0, 0, 8)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
RESOLUTION = "32x24"
METHODS = ("segment", "mvf", "path")


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    path = tmp_path_factory.mktemp("stage") / "tiny.usda"
    path.write_text(STAGE)
    return path


@pytest.fixture(scope="module")
def good_reference(stage, engine):
    """A reference for all tests."""
    path = stage.parent / "ref.exr"
    arguments = ["reference", stage, "-o", path, "--resolution", RESOLUTION]
    assert run(*arguments, "--target-relmse", 5e-5, "--max-time", 60, "--quiet") == 0
    return path


def run(*arguments):
    return main([str(a) for a in arguments])


@pytest.fixture(scope="module")
def report(stage, good_reference):
    """The folder of a report."""
    folder = stage.parent / "report"
    arguments = ["converge", stage, "-o", folder, "--resolution", RESOLUTION, "--quiet"]
    arguments += ["--methods", ",".join(METHODS), "--time", 0.6, "--repeat", 2]
    assert run(*arguments, "--reference", good_reference) == 0
    return folder


def test_all_files_are_there(report):
    assert {p.name for p in report.iterdir()} == {
        "curves.csv", "curves.json", "curves.png", "curves.svg", "stages.png", "table1.md",
        "crops.png", "index.html",
    }  # fmt: skip
    for picture in report.glob("*.png"):
        assert images.read(str(picture)).pixels.std() > 10, picture.name


def test_the_csv(report):
    with (report / "curves.csv").open() as file:
        rows = list(csv.DictReader(file))
    for method in METHODS:
        for repeat in ("0", "1"):
            mine = [r for r in rows if (r["method"], r["repeat"]) == (method, repeat)]
            assert len(mine) >= 5, method
            for name in ("seconds", "cpu_seconds", "iterations"):
                values = [float(r[name]) for r in mine]
                assert values == sorted(values), (method, name)
            seconds = [float(r["seconds"]) for r in mine]
            # An iteration may begin just before the end, on a machine that has other work.
            assert 0.4 < seconds[-1] < 3
            assert all(b > a for a, b in zip(seconds, seconds[1:]))
            for name in ("mape", "relmse", "smape"):
                assert float(mine[-1][name]) < 0.7 * float(mine[0][name]), (method, name)
            # No method may be off as a whole.
            assert abs(float(mine[-1]["difference_of_means"])) < 0.02, method


def test_the_error_of_path_falls_as_noise_does(report):
    points = json.loads((report / "curves.json").read_text())["points"]
    mine = [p for p in points if p["method"] == "path"]
    slope = np.polyfit(
        np.log([p["iterations"] for p in mine]), np.log([p["relmse"] for p in mine]), 1
    )
    # Stratified samples converge a little faster than 1/n.
    assert -1.6 < slope[0] < -0.8


def test_the_json_says_what_was_done(report):
    found = json.loads((report / "curves.json").read_text())
    assert 0 < found["reference_relmse"] <= 5e-5
    assert found["circumstances"]["Resolution"] == "32 x 24"
    assert {(s["method"], s["repeat"], s["seed"]) for s in found["statistics"]} == {
        (m, r, r) for m in METHODS for r in (0, 1)
    }
    stages = found["points"][-1]["stages"], found["points"][0]["stages"]
    assert set(stages[0]) == {"sampling"}
    assert {"sampling", "clustering", "weights", "propagation", "gather"} <= set(stages[1])
    last = [p for p in found["points"] if p["method"] == "segment" and p["repeat"] == 0][-1]
    # The stages are the iteration, but for the engine's own estimate of the error now and then.
    assert 0.6 * last["seconds"] < sum(last["stages"].values()) < 1.01 * last["seconds"]


def test_the_table(report):
    text = (report / "table1.md").read_text()
    for method in METHODS:
        assert f"| {method} | sampling |" in text
    shares = re.findall(r"\| segment \| [\w ]+ \| [\d.]+ \| ([\d.]+) % \|", text)
    assert sum(map(float, shares)) == pytest.approx(100, abs=0.5)


def test_the_page_needs_no_other_file(report):
    text = (report / "index.html").read_text()
    sources = re.findall(r'(?:src|href|url)\s*[=(]\s*["\']?([^"\')>\s]{0,30})', text)
    assert len(sources) == 3
    assert all(s.startswith("data:image/png;base64,") for s in sources)
    assert not re.search(r"https?://|@import|<link|<script", text)
    for words in ("tiny.usda", "mvf", "relMSE", "bytes / segment"):
        assert words in text


@pytest.mark.parametrize("method", ["magic", "segment,magic"])
def test_an_unknown_method(stage, good_reference, tmp_path, capsys, method):
    arguments = ["converge", stage, "-o", tmp_path / "r", "--resolution", RESOLUTION, "--time", 1]
    assert run(*arguments, "--methods", method, "--reference", good_reference) == 2
    error = capsys.readouterr().err
    assert error.startswith("segue: method magic: ")
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["--reference", "gone.exr"], 3, "gone.exr"),
        (["--reference", "REF", "--resolution", "8x8"], 3, "the reference is 32 x 24"),
        (["--reference", "REF", "-o", "/nowhere/r"], 2, "/nowhere"),
        (["--reference", "REF", "--methods", ","], 2, "names nothing"),
        ([], 2, "--reference"),
        (["--reference", "REF", "--make-reference", "1"], 2, "not allowed"),
        (["--reference", "REF", "--time", "0"], 2, "not above 0"),
    ],
)
def test_wrong_arguments(stage, good_reference, tmp_path, capsys, arguments, status, words):
    given = ["converge", stage, "-o", tmp_path / "r", "--time", 0.1, "--methods", "path"]
    given += ["--resolution", RESOLUTION]
    assert run(*given, *(good_reference if a == "REF" else a for a in arguments)) == status
    assert words in capsys.readouterr().err


def test_a_reference_that_is_not_finite(stage, tmp_path, capsys):
    pixels = np.ones((24, 32, 3), np.float32)
    pixels[3, 4] = np.nan
    images.write_exr(tmp_path / "nan.exr", {"Combined": pixels}, {})
    arguments = ["converge", stage, "-o", tmp_path / "r", "--resolution", RESOLUTION]
    arguments += ["--time", 0.1, "--methods", "path"]
    assert run(*arguments, "--reference", tmp_path / "nan.exr") == 3
    assert "3 values of the reference are not finite" in capsys.readouterr().err
    assert run("compare", good := tmp_path / "nan.exr", good) == 3
    assert "3 values" in capsys.readouterr().err


def test_a_reference_is_made_on_the_way(stage, tmp_path):
    folder = tmp_path / "report"
    arguments = ["converge", stage, "-o", folder, "--resolution", RESOLUTION, "--quiet"]
    arguments += ["--methods", "path", "--time", 0.2, "--target-relmse", 1e-3]
    assert run(*arguments, "--make-reference", 0.01) == 0
    assert reference.known_error(str(folder / "reference.exr")) <= 1e-3
    found = json.loads((folder / "curves.json").read_text())
    assert found["reference_relmse"] == pytest.approx(
        reference.known_error(str(folder / "reference.exr"))
    )


def test_no_report_against_a_reference_that_was_not_reached(stage, tmp_path, capsys):
    folder = tmp_path / "report"
    arguments = ["converge", stage, "-o", folder, "--resolution", RESOLUTION]
    arguments += ["--methods", "path", "--time", 0.2, "--target-relmse", 1e-9]
    assert run(*arguments, "--make-reference", 0.0003) == 4
    assert "no reference" in capsys.readouterr().err
    assert not (folder / "reference.exr").exists()
    assert not (folder / "index.html").exists()


@pytest.mark.parametrize(
    ("seconds", "words", "files"),
    [(4.0, "not 1e-09", ["r.partial.exr"]), (0.001, "fewer than the 16", [])],
)
def test_a_target_that_is_not_reached(stage, tmp_path, capsys, seconds, words, files):
    arguments = ["reference", stage, "-o", tmp_path / "r.exr", "--resolution", RESOLUTION]
    assert run(*arguments, "--target-relmse", 1e-9, "--max-time", seconds) == 4
    error = capsys.readouterr().err
    assert "segue: no reference: " in error
    assert words in error
    assert [p.name for p in tmp_path.iterdir()] == files


def test_a_good_reference_is_not_replaced_by_a_bad_one(stage, tmp_path):
    path = tmp_path / "r.exr"
    arguments = ["reference", stage, "-o", path, "--resolution", RESOLUTION, "--quiet"]
    assert run(*arguments, "--target-relmse", 1e-2) == 0
    before = path.read_bytes()
    assert run(*arguments, "--target-relmse", 1e-9, "--max-time", 1) == 4
    assert path.read_bytes() == before


@pytest.mark.parametrize("integrator", ["path", "segment"])
def test_the_error_that_a_reference_tells_is_honest(stage, good_reference, integrator):
    """Against a reference of other seeds, whose own error counts too."""
    truth = images.read_rgb(str(good_reference))
    imported = usd.load(stage, resolution=(32, 24))
    # At half a pixel the segment method's kernel blurs far less than this noise.
    settings = {**imported.settings(), "integrator": integrator, "kernel_size": 0.5, "seed": 7}
    result = reference.make(imported.scene, settings, 1e-3, 30)
    assert result.refusal is None
    found = result.estimate
    assert found.renders >= reference.MIN_RENDERS
    true = metrics.errors(found.mean.astype(np.float32), truth)["relmse"]
    expected = found.relmse + reference.known_error(str(good_reference))
    assert 0.7 < expected / true < 1.4


def test_references_that_blur_are_announced(stage, tmp_path, capsys):
    arguments = ["reference", stage, "-o", tmp_path / "r.exr", "--resolution", RESOLUTION]
    assert run(*arguments, "--target-relmse", 1e-2, "--integrator", "segment") == 0
    assert "segment blurs" in capsys.readouterr().err


def interrupt_after(seconds):
    timer = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    return timer


def test_a_cancelled_measurement_is_reported(stage, good_reference, tmp_path):
    arguments = ["converge", stage, "-o", tmp_path, "--resolution", RESOLUTION, "--quiet"]
    timer = interrupt_after(2)
    assert run(*arguments, "--time", 20, "--reference", good_reference) == 130
    timer.join()
    points = json.loads((tmp_path / "curves.json").read_text())["points"]
    assert {p["method"] for p in points} == {"segment", "path"}
    assert (tmp_path / "index.html").exists()


def test_a_measurement_that_is_cancelled_at_once(
    stage, good_reference, tmp_path, monkeypatch, capsys
):
    class Cancelled(Cancellation):
        def __enter__(self):
            self.requested = True
            return super().__enter__()

    monkeypatch.setattr(converge, "Cancellation", Cancelled)
    arguments = ["converge", stage, "-o", tmp_path, "--resolution", RESOLUTION]
    assert run(*arguments, "--time", 100, "--reference", good_reference) == 130
    assert "before anything was measured" in capsys.readouterr().err


def test_a_cancelled_reference_is_none(stage, tmp_path, capsys):
    arguments = ["reference", stage, "-o", tmp_path / "r.exr", "--resolution", RESOLUTION]
    timer = interrupt_after(2)
    assert run(*arguments, "--target-relmse", 1e-9) == 130
    timer.join()
    assert "no reference" in capsys.readouterr().err
    assert not (tmp_path / "r.exr").exists()


HARNESS = """
import json, os, sys
sys.path.insert(0, {package!r})
import numpy as np
from pathlib import Path
from segue import images
scene, times = sys.argv[1], sys.argv[sys.argv.index("--time") + 1].split(",")
home = Path(__file__).parent / "results" / scene
home.mkdir(parents=True)
records = []
for t in map(float, times):
    path = home / f"{{t}}.exr"
    value = 0.5 + 0.1 / t
    images.write_exr(path, {{"Combined": np.full((24, 32, 3), value)}}, {{}})
    records.append(dict(peer=sys.argv[3], wall=t, cpu=2 * t, spp=8, exr=str(path)))
(home / "records.json").write_text(json.dumps(records))
"""


@pytest.fixture
def harness(tmp_path, monkeypatch):
    """A folder of shared inputs with a harness that knows the scene `tiny`."""
    folder = tmp_path / "shared" / "peers"
    (folder / "usd").mkdir(parents=True)
    (folder / "usd" / "tiny.usda").write_text(STAGE)
    package = str(peers.Path(peers.__file__).parents[2])
    (folder / "peers.py").write_text(HARNESS.format(package=package))
    monkeypatch.setenv("SEGUE_SHARED", str(folder.parent))
    return folder


def test_other_renderers_are_asked(harness, stage):
    found = peers.render(stage, ["mitsuba"], [1.0, 2.0], 0, np.full((24, 32, 3), 0.5, np.float32))
    assert [o.method for o in found] == ["mitsuba-path"]
    assert [p.seconds for p in found[0].points] == [1, 2]
    np.testing.assert_allclose([p.mape for p in found[0].points], [0.1 / 0.505, 0.05 / 0.505], 1e-5)
    assert not list(harness.glob("results"))


def test_a_harness_that_does_not_know_the_stage(harness, tmp_path):
    with pytest.raises(peers.PeersError, match="does not know a scene 'other'"):
        peers.render(tmp_path / "other.usda", ["mitsuba"], [1.0], 0, np.zeros((24, 32, 3)))


def test_without_other_renderers(stage, good_reference, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("SEGUE_SHARED", str(tmp_path / "gone"))
    arguments = ["converge", stage, "-o", tmp_path / "r", "--resolution", RESOLUTION, "--quiet"]
    arguments += ["--methods", "photon-filter", "--time", 0.1, "--reference", good_reference]
    assert run(*arguments, "--peers", "mitsuba") == 0
    assert "without other renderers: there is no" in capsys.readouterr().err


def test_a_harness_that_fails(harness, stage):
    (harness / "peers.py").write_text("import sys\nsys.exit('no such renderer')\n")
    with pytest.raises(peers.PeersError, match="no result: no such renderer"):
        peers.render(stage, ["mitsuba"], [1.0], 0, np.zeros((24, 32, 3), np.float32))
