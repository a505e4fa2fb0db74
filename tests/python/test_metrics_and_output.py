"""Metrics, tone mapping, file names and exit statuses: what needs no engine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from segue import errors, metrics, tonemapping
from segue.cli import main, output
from segue.cli.progress import clock
from segue.cli.status import Status, UsageError, status_of


def test_metrics_by_hand():
    reference = np.array([[[1.0, 1, 1], [3, 3, 3]]])
    picture = np.array([[[2.0, 1, 1], [3, 0, 0]]])
    # m = 2, so the floor is 0.02. Differences: 1, 0, 0 | 0, 3, 3.
    found = metrics.errors(picture, reference)
    assert found["mape"] == pytest.approx((1 / 1.02 + 2 * 3 / 3.02) / 6)
    assert found["relmse"] == pytest.approx((1 / 1.0004 + 2 * 9 / 9.0004) / 6)
    assert found["smape"] == pytest.approx((2 / 3.02 + 2 * 6 / 3.02) / 6)
    assert found["mse"] == pytest.approx((1 + 9 + 9) / 6)


def test_metrics_of_equal_and_black_pictures():
    black = np.zeros((2, 2, 3))
    assert set(metrics.errors(black, black).values()) == {0.0}
    assert metrics.errors(black + 1, black)["mape"] == np.inf


def test_metrics_want_pictures_of_one_size_and_a_finite_reference():
    with pytest.raises(ValueError, match="2 x 4 x 3 against 4 x 2 x 3"):
        metrics.errors(np.zeros((4, 2, 3)), np.zeros((2, 4, 3)))
    with pytest.raises(ValueError, match="not finite"):
        metrics.errors(np.zeros((1, 1, 3)), np.full((1, 1, 3), np.inf))


@pytest.mark.parametrize(
    ("name", "frame", "many", "expected"),
    [
        ("a.exr", None, False, "a.exr"),
        ("a.exr", 7.0, False, "a.exr"),
        ("a.exr", 7.0, True, "a.0007.exr"),
        ("a.####.exr", 7.0, True, "a.0007.exr"),
        ("a.##.png", 123.0, True, "a.123.png"),
        ("a_%05d.exr", 7.0, False, "a_00007.exr"),
        ("a_%d.exr", -7.0, True, "a_-7.exr"),
    ],
)
def test_names_of_frames(name, frame, many, expected):
    assert output.frame_path(Path("dir") / name, frame, many) == Path("dir") / expected


def test_outputs_that_cannot_be_written(tmp_path):
    with pytest.raises(UsageError, match=r"a\.jpg"):
        output.check_path(tmp_path / "a.jpg")
    with pytest.raises(UsageError, match="does not exist"):
        output.check_path(tmp_path / "gone" / "a.exr")
    output.check_path(tmp_path / "a.exr")


def test_tone_mapping():
    dark = np.array([0.2, 0.3, 0.4])
    # Below the shoulder only the 4 % of Fresnel reflection are taken off.
    np.testing.assert_allclose(tonemapping.neutral(dark), dark - 0.04)
    greys = tonemapping.neutral(np.linspace(0, 1e4, 2000)[:, None].repeat(3, 1))
    assert greys.min() >= 0
    assert greys.max() < 1
    assert (np.diff(greys[:, 0]) > 0).all()
    hot = tonemapping.neutral(np.array([1e3, 1.0, 1.0]))
    assert hot.max() < 1
    assert hot[0] >= hot[1] > 0.5  # very bright red goes towards white
    assert np.isfinite(tonemapping.neutral(np.array([np.nan, np.inf, -1.0]))).all()


def test_srgb_curve():
    # IEC 61966-2-1: 18 % grey is 118, the joint is continuous.
    np.testing.assert_array_equal(
        tonemapping.to_srgb(np.array([0.0, 0.18, 0.5, 1.0, 7.0, -1.0])), [0, 118, 188, 255, 255, 0]
    )


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(None, "-:--"), (0.2, "0:00"), (65, "1:05"), (3661, "1:01:01"), (float("inf"), "-:--")],
)
def test_clock(seconds, text):
    assert clock(seconds) == text


def test_statuses():
    assert status_of(UsageError()) == 2
    assert status_of(errors.BadArgumentError()) == 2
    assert status_of(errors.BadSceneError()) == 3
    assert status_of(errors.OutputError()) == 1
    assert status_of(KeyError()) is None
    assert int(Status.CANCELLED) == 130


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["render"],
        ["render", "a.usda"],
        ["render", "a.usda", "-o", "a.exr", "--resolution", "12"],
        ["render", "a.usda", "-o", "a.exr", "--resolution", "0x4"],
        ["render", "a.usda", "-o", "a.exr", "--samples", "0"],
        ["render", "a.usda", "-o", "a.exr", "--samples", "4", "--time", "3"],
        ["render", "a.usda", "-o", "a.exr", "--time", "-3"],
        ["render", "a.usda", "-o", "a.exr", "--frames", "3"],
        ["render", "a.usda", "-o", "a.exr", "--frames", "3:1"],
        ["render", "a.usda", "-o", "a.exr", "--frame", "3", "--frames", "1:2"],
        ["render", "a.usda", "-o", "a.bmp"],
        ["render", "a.usda", "-o", "/nowhere/a.exr"],
        ["compare", "a.exr"],
        ["compare", "a.exr", "b.exr", "--metric", "ssim"],
        ["paint"],
    ],
)
def test_bad_usage(arguments, capsys):
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err


@pytest.mark.parametrize("arguments", [["--help"], ["render", "--help"], ["--version"]])
def test_help(arguments, capsys):
    assert main(arguments) == 0
    assert capsys.readouterr().out
