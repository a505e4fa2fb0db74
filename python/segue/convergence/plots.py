"""Error against time, and time by stage, as figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from .running import Outcome, Point

#: Colours of Okabe and Ito (2008), which eyes of all kinds tell apart, then grey.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
MARKERS = "os^Dv<>P"
#: Pixels an inch of the PNGs.
DPI = 110
#: The errors that are shown: field of `Point`, title with unit, and what a unit is.
ERRORS = (("relmse", "relMSE", 1.0), ("mape", "MAPE (%)", 0.01), ("smape", "SMAPE (%)", 0.01))
#: Stages in the order in which an iteration runs them; unknown ones come last.
STAGES = ("sampling", "clustering", "areas", "weights", "propagation", "gather")
_SETTINGS = {"svg.hashsalt": "segue", "font.size": 10, "axes.axisbelow": True}


def colors(methods: Sequence[str]) -> dict[str, str]:
    """A colour for each method."""
    return {m: COLORS[i % len(COLORS)] for i, m in enumerate(methods)}


def save_curves(
    folder: Path, outcomes: Sequence[Outcome], title: str, known_relmse: float | None
) -> None:
    """Writes `curves.png` and `curves.svg`: error against seconds, both logarithmic.

    Args:
        folder: where to.
        outcomes: what came of each render.
        title: of the figure.
        known_relmse: error of the reference itself, below which nothing can be told.
    """
    methods = list(dict.fromkeys(o.method for o in outcomes))
    colored = colors(methods)
    with rc_context(_SETTINGS):
        figure = Figure(figsize=(4.6 * len(ERRORS), 4.6), dpi=DPI, layout="constrained")
        for axes, (name, label, unit) in zip(figure.subplots(1, len(ERRORS)), ERRORS):
            for index, method in enumerate(methods):
                series = [o.points for o in outcomes if o.method == method and o.points]
                marker = MARKERS[index % len(MARKERS)]
                _draw_curve(axes, series, name, unit, method, colored[method], marker)
            if name == "relmse" and known_relmse:
                axes.axhline(known_relmse, color="0.4", ls=":", lw=1.2)
                axes.annotate(
                    "error of the reference",
                    (0.02, known_relmse),
                    xycoords=("axes fraction", "data"),
                    xytext=(0, 3),
                    textcoords="offset points",
                    color="0.35",
                    fontsize=8,
                )
            _log_log(axes)
            axes.set_xlabel("seconds of rendering")
            axes.set_title(label)
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))
        figure.suptitle(title)
        figure.savefig(folder / "curves.png")
        figure.savefig(folder / "curves.svg", metadata={"Date": None})


def _draw_curve(
    axes: Axes,
    series: list[list[Point]],
    name: str,
    unit: float,
    label: str,
    color: str,
    marker: str,
) -> None:
    curves = [
        np.array([(p.seconds, getattr(p, name) / unit) for p in points if _is_drawable(p, name)])
        for points in series
    ]
    curves = [c for c in curves if len(c)]
    if not curves:
        return
    style = {"color": color, "marker": marker, "ms": 4, "lw": 1.5, "label": label}
    times, middle, low, high = band(curves)
    axes.plot(times, middle, **style)
    if len(curves) > 1:
        axes.fill_between(times, low, high, color=color, alpha=0.2, lw=0)


def _is_drawable(point: Point, name: str) -> bool:
    value = getattr(point, name)
    return bool(np.isfinite(value)) and value > 0


def band(curves: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Times, geometric mean, least and greatest value of curves of (time, value) rows.

    The curves have times of their own: each is read off between its points, logarithmically, at
    the times of the first one that all of them reach.
    """
    begin, end = max(c[0, 0] for c in curves), min(c[-1, 0] for c in curves)
    times = curves[0][:, 0]
    times = times[(times >= begin) & (times <= end)]
    if len(curves) > 1:
        times = np.unique(np.concatenate([[min(begin, end)], times, [max(begin, end)]]))
    logs = np.array([np.interp(np.log(times), np.log(c[:, 0]), np.log(c[:, 1])) for c in curves])
    return times, np.exp(logs.mean(0)), np.exp(logs.min(0)), np.exp(logs.max(0))


def _log_log(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.grid(True, which="major", color="0.85", lw=0.8)
    axes.grid(True, which="minor", color="0.93", lw=0.5)
    plain = FuncFormatter(lambda v, _: f"{v:g}")
    for axis, limits in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        # Within few decades the powers of ten alone leave an axis without numbers.
        narrow = limits[1] / limits[0] < 300
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if narrow else (1,)))
        axis.set_major_formatter(plain)
        axis.set_minor_formatter(NullFormatter())


def save_stages(folder: Path, outcomes: Sequence[Outcome], title: str) -> None:
    """Writes `stages.png`: how long each stage of an iteration takes as the render goes on.

    Of every method that tells stages (the first repeat), or of all where none does.
    """
    first = [o for o in outcomes if o.repeat == 0 and o.points and o.stats]
    shown = [o for o in first if len(o.points[-1].stages) > 1] or first
    if not shown:
        return
    found = dict.fromkeys(n for o in shown for n in o.points[-1].stages)
    names = sorted(found, key=lambda n: STAGES.index(n) if n in STAGES else len(STAGES))
    with rc_context(_SETTINGS):
        figure = Figure(figsize=(4.2 * len(shown) + 1.6, 4.2), dpi=DPI, layout="constrained")
        panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
        for axes, outcome in zip(panels, shown):
            iterations, heights = stage_steps(outcome.points, names)
            axes.stackplot(
                iterations,
                1e3 * heights,
                labels=names,
                colors=[COLORS[i % len(COLORS)] for i in range(len(names))],
                step="pre",
                lw=0,
            )
            axes.set_xscale("log")
            axes.set_xlim(iterations[0], iterations[-1])
            axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.grid(True, axis="y", color="0.85", lw=0.8)
            axes.set_xlabel("iteration")
            axes.set_title(outcome.method)
        panels[0].set_ylabel("milliseconds per iteration")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles[::-1], labels[::-1], loc="outside right center", title="stage")
        figure.suptitle(title)
        figure.savefig(folder / "stages.png")


def stage_steps(points: Sequence[Point], names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Iterations at which steps end, the first beginning, and (stages, iterations) seconds.

    A step is what lies between two measurements; its height is the mean over its iterations.
    """
    counts = np.array([0.0, *(p.iterations for p in points)])
    spent = np.array([[0.0, *(p.stages.get(n, 0.0) for p in points)] for n in names])
    heights = np.diff(spent, axis=1) / np.diff(counts)
    begin = min(1.0, 0.5 * counts[1])
    return np.array([begin, *counts[1:]]), np.concatenate([heights[:, :1], heights], axis=1)
