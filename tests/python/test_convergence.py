"""What of measuring convergence needs no engine: metrics, estimates of error, tables, figures."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("OpenImageIO")

from segue import images, metrics
from segue.convergence import methods, page, pictures, plots, reference, running, tables


def by_formula(x, r):
    """The metrics, value by value."""
    x, r = np.float64(x).ravel(), np.float64(r).ravel()
    e = 0.01 * sum(r) / len(r)
    pairs = list(zip(x, r))
    return {
        "mape": sum(abs(a - b) / (b + e) for a, b in pairs) / len(r),
        "relmse": sum((a - b) ** 2 / (b * b + e * e) for a, b in pairs) / len(r),
        "smape": sum(2 * abs(a - b) / (a + b + e) for a, b in pairs) / len(r),
        "mse": sum((a - b) ** 2 for a, b in pairs) / len(r),
    }


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_metrics_are_their_formulas(seed, dtype):
    random = np.random.default_rng(seed)
    x, r = (random.lognormal(0, 2, (9, 14, 3)).astype(dtype) for _ in range(2))
    x[random.random(x.shape) < 0.3] = 0
    r[random.random(r.shape) < 0.3] = 0
    found = metrics.errors(x, r)
    for name, expected in by_formula(x, r).items():
        assert found[name] == pytest.approx(expected, rel=1e-10), name
    assert metrics.error_map(x, r).mean() == pytest.approx(found["mape"], rel=1e-10)
    assert metrics.difference_of_means(x, r) == pytest.approx(
        np.float64(x).mean() / np.float64(r).mean() - 1
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_metrics_refuse_what_is_not_finite(bad):
    good, broken = np.ones((2, 3, 3)), np.ones((2, 3, 3))
    broken[1, 2, 0] = broken[0, 0, 1] = bad
    for call in (metrics.errors, metrics.error_map, metrics.difference_of_means):
        with pytest.raises(ValueError, match="the picture has 2 values"):
            call(broken, good)
        with pytest.raises(ValueError, match="the reference has 2 values"):
            call(good, broken)


def test_difference_of_means_of_black():
    black = np.zeros((2, 2, 3))
    assert metrics.difference_of_means(black, black) == 0
    assert metrics.difference_of_means(black + 1, black) == math.inf


def test_methods_are_settings():
    assert methods.settings_of("segment") == {"integrator": "segment"}
    assert methods.settings_of("segment-fixed") == {"integrator": "segment", "kernel": "fixed"}
    progressive = methods.settings_of("segment-progressive")
    assert progressive == {"integrator": "segment", "kernel": "progressive"}
    assert methods.settings_of("vcm") == {"integrator": "vcm"}


def test_times_are_spaced_evenly_and_end_at_the_total():
    times = running.measure_times(60.0, 1.0)
    assert times[-1] == 60
    assert 1 <= times[0] < running.RATIO
    ratios = np.array(times[1:]) / times[:-1]
    np.testing.assert_allclose(ratios, running.RATIO)


@pytest.mark.parametrize(
    ("total", "iteration", "length"), [(64, 0.01, 1), (64, 0.5, 2), (64, 100, 16), (1, 0, 1 / 64)]
)
def test_slices_hold_some_iterations(total, iteration, length):
    assert running.slice_length(total, iteration) == length


class Painter:
    """Stands for a render whose slices should take a second, but may take longer."""

    _length = 1.0

    def __init__(self, log, method, takes=1.0):
        self.log, self.method, self.takes = log, method, takes
        self.points, self.stats = [], {"seconds": 0.0}

    is_before = running.Contestant.is_before

    def run_slice(self, cancelled):
        self.log.append(self.method)
        self.stats["seconds"] += self.takes

    def measure(self, reference):
        self.points.append(self.stats["seconds"])


def test_methods_take_turns():
    log = []
    contestants = [Painter(log, "a"), Painter(log, "b", takes=3.0)]
    running.race(contestants, [1, 2, 6], np.zeros((1, 1, 3)), lambda: False)
    assert log == ["a", "b", "a", "a", "b", "a", "a", "a"]
    assert contestants[0].points == [1, 2, 6]
    assert contestants[1].points == [3, 3, 6]


def test_a_cancelled_race_is_measured():
    log = []
    contestants = [Painter(log, "a"), Painter(log, "b")]
    running.race(contestants, [5], np.zeros((1, 1, 3)), lambda: len(log) >= 3)
    assert log == ["a", "b", "a"]
    assert [c.points for c in contestants] == [[2.0], [1.0]]


def renders(random, count, noise, samples=lambda k: 1 + k % 3):
    made = reference.Renders(SHAPE)
    for k in range(count):
        n = samples(k)
        made.add(1 + noise(random, n), n)
    return made


SHAPE = (24, 32, 3)


def gaussian(random, samples):
    return random.normal(0, 0.1 / math.sqrt(samples), SHAPE)


def spikes(random, samples):
    """2000 in one of 20000 samples, less their mean."""
    return 0.1 * (random.binomial(samples, 1 / 20000, SHAPE) / samples * 20000 - 1)


def test_the_estimated_error_of_a_mean_is_its_true_error():
    random = np.random.default_rng(1)
    found = renders(random, 40, gaussian).estimate()
    assert found.renders == 40
    assert found.samples == sum(1 + k % 3 for k in range(40))
    # 2304 values with 38 degrees of freedom each: known to within 0.5 %.
    assert found.relmse == pytest.approx(0.01 / found.samples / 1.0001, rel=0.02)
    assert metrics.errors(found.mean, np.ones(SHAPE))["relmse"] == pytest.approx(
        found.relmse, rel=0.15
    )
    np.testing.assert_allclose(np.mean(found.variance), 0.01 / found.samples, rtol=0.02)
    assert found.is_reliable


def test_spikes_do_not_hide_in_the_pixels_that_they_make_bright():
    random = np.random.default_rng(6)
    found = [renders(random, 24, spikes, lambda _: 4).estimate() for _ in range(20)]
    # The mean is 1, its variance 0.1^2 * 20000 over 96 samples; relative to the mean that holds the
    # spikes it would be 0.005. Most pixels are at 0.9, which makes the estimate larger.
    true = np.mean([metrics.errors(f.mean, np.ones(SHAPE))["relmse"] for f in found])
    assert true == pytest.approx(200 / 96, rel=0.3)
    assert 0.9 < np.mean([f.relmse for f in found]) / true < 1.4


def test_rare_bright_samples_make_an_estimate_unreliable():
    def fireflies(random, samples):
        return gaussian(random, samples) + 50 * (random.random(SHAPE) < 2e-5)

    random = np.random.default_rng(2)
    found = [renders(random, 16, fireflies).estimate() for _ in range(40)]
    truth = [metrics.errors(f.mean, np.ones(SHAPE))["relmse"] for f in found]
    met = [f for f, t in zip(found, truth) if t > 2 * 0.01 / 31]
    assert len(met) > 10
    # Halves that met few of them met unlike numbers of them, most of the time.
    assert sum(f.is_reliable for f in met) < 0.25 * len(met)


def test_few_renders_tell_nothing():
    random = np.random.default_rng(3)
    assert renders(random, reference.MIN_RENDERS - 1, gaussian).estimate() is None
    result = reference.Result(None, 1e-3, 2.5, 0, False)
    assert "fewer than the 16 independent renders" in result.refusal


def test_references_keep_their_error(tmp_path):
    found = renders(np.random.default_rng(4), 20, gaussian).estimate()
    path = tmp_path / "r.exr"
    reference.write(path, reference.Result(found, 1.0, 1.0, 0, False), {"segue:stage": "s"})
    assert [p.name for p in tmp_path.iterdir()] == ["r.exr"]
    np.testing.assert_allclose(images.read_rgb(str(path)), found.mean, rtol=1e-6)
    assert reference.known_error(str(path)) == pytest.approx(found.relmse)
    import OpenImageIO

    file = OpenImageIO.ImageInput.open(str(path))
    names = list(file.spec().channelnames)
    assert set(names) == {f"{layer}.{c}" for layer in ("Combined", "Variance") for c in "RGB"}
    pixels = np.asarray(file.read_image("float")).reshape(24, 32, 6)
    file.close()
    variance = pixels[:, :, [names.index(f"Variance.{c}") for c in "RGB"]]
    np.testing.assert_allclose(variance, found.variance, rtol=1e-6)


def outcome(method, repeat=0, slope=-1.0, stages=("sampling", "areas")):
    points = [
        running.Point(
            method,
            repeat,
            seconds=t * (1 + 0.1 * repeat),
            cpu_seconds=2 * t,
            iterations=10 * t,
            mape=0.5 * t ** (slope / 2),
            relmse=t**slope,
            smape=0.4 * t ** (slope / 2),
            difference_of_means=0.01,
            stages={name: 0.1 * t * (i + 1) for i, name in enumerate(stages)},
        )
        for t in running.measure_times(16.0, 1.0)
    ]
    stats = {
        "samples": 160.0, "seconds": 16.0, "cpu_seconds": 32.0, "rays": 1600, "segments": 500,
        "bytes_per_segment": 30.0, "stages": {n: {"seconds": 1.0, "bytes": 2**20} for n in stages},
    }  # fmt: skip
    return running.Outcome(method, repeat, points, np.full(SHAPE, 0.5, np.float32), stats)


def test_the_csv_holds_every_point():
    outcomes = [outcome("segment"), outcome("segment", 1), outcome("path")]
    rows = list(
        csv.DictReader(io.StringIO(tables.points_csv(p for o in outcomes for p in o.points)))
    )
    assert len(rows) == sum(len(o.points) for o in outcomes)
    assert {(r["method"], r["repeat"]) for r in rows} == {
        ("segment", "0"), ("segment", "1"), ("path", "0"),
    }  # fmt: skip
    assert rows[0]["bias"] == ""
    assert float(rows[0]["relmse"]) == pytest.approx(outcomes[0].points[0].relmse, rel=1e-6)


def test_json_has_no_numbers_that_json_has_not():
    broken = outcome("path")
    broken.stats["bytes_per_segment"] = math.inf
    text = tables.points_json({"a": 1}, [broken])
    parsed = json.loads(text, parse_constant=pytest.fail)
    assert parsed["statistics"][0]["bytes_per_segment"] is None
    assert parsed["a"] == 1
    assert len(parsed["points"]) == len(broken.points)


def test_tables_add_up():
    text = tables.table1([outcome("segment"), outcome("segment", 1)])
    # 0.1 and 0.2 s a second, 10 iterations a second.
    assert "| segment | areas | 20 | 66.7 % | 1 |" in text
    assert "| segment | sampling | 10 | 33.3 % | 1 |" in text
    assert "| segment | 160 | 100 | 200 | 500 | 30.0 | 10 |" in text


def test_bands_are_read_off_between_points():
    # Both follow t^-1, at times of their own: the band has no width.
    times = [np.array([1.0, 2, 4, 8]), np.array([1.5, 3.5, 9])]
    curves = [np.stack([t, 1 / t], axis=1) for t in times]
    at, middle, low, high = plots.band(curves)
    assert (at[0], at[-1]) == (1.5, 8)
    for values in (middle, low, high):
        np.testing.assert_allclose(values, 1 / at)
    curves[1][:, 1] *= 4
    _, middle, low, high = plots.band(curves)
    np.testing.assert_allclose([low * at, middle * at, high * at], [[1] * 4, [2] * 4, [4] * 4])


def test_stage_steps_are_means_between_measurements():
    iterations, heights = plots.stage_steps(outcome("segment").points, ["sampling", "areas"])
    assert (np.diff(iterations) > 0).all()
    np.testing.assert_allclose(heights, [[0.01] * len(iterations), [0.02] * len(iterations)])


def test_crops_are_where_methods_differ():
    quiet, loud = np.full((40, 60), 0.1), np.full((40, 60), 0.1)
    loud[20:30, 40:50] = 2.0
    loud[0:10, 0:10] = 1.0
    assert pictures.crop_places([quiet, loud], 10) == [(40, 20), (0, 0)]
    assert pictures.crop_places([loud], 10) == [(40, 20), (0, 0)]


@pytest.mark.parametrize("shape", [SHAPE, (1, 1, 3), (5, 200, 3)])
def test_figures_of_any_shape(tmp_path, shape):
    random = np.random.default_rng(5)
    outcomes = [outcome("segment"), outcome("path", stages=("sampling",))]
    for o in outcomes:
        o.picture = random.random(shape)
    pictures.save_crops(tmp_path, outcomes, random.random(shape), "stage")
    assert images.read(str(tmp_path / "crops.png")).pixels.std() > 10


def test_figures_without_differences(tmp_path):
    same = np.full(SHAPE, 0.5)
    flat = [running.Outcome("path", 0, outcome("path").points[:1], same, outcome("path").stats)]
    pictures.save_crops(tmp_path, flat, same, "stage")
    plots.save_curves(tmp_path, flat, "stage", None)
    plots.save_stages(tmp_path, flat, "stage")
    assert {p.name for p in tmp_path.iterdir()} == {
        "crops.png", "curves.png", "curves.svg", "stages.png",
    }  # fmt: skip


def test_a_perfect_picture_has_no_curve(tmp_path):
    exact = outcome("path")
    exact.points = [
        dataclasses.replace(p, mape=0.0, relmse=0.0, smape=0.0, estimated_relmse=None)
        for p in exact.points
    ]
    plots.save_curves(tmp_path, [exact], "stage", None)
    assert images.read(str(tmp_path / "curves.png")).pixels.std() > 5


def test_the_page_escapes(tmp_path):
    text = page.page("<b>", [("a&b", "<script>")], [("h", [[["x"], ["<y>"]]], None, "r > s")])
    assert "<script>" not in text
    assert "<y>" not in text
    assert "&lt;b&gt;" in text
