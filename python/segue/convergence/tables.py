"""The report's numbers as files: CSV, JSON and Markdown."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .running import Outcome, Point

#: Columns of the CSV: fields of `Point`.
COLUMNS = (
    "method", "repeat", "seconds", "cpu_seconds", "iterations", "mape", "relmse", "smape",
    "difference_of_means", "estimated_relmse", "bias",
)  # fmt: skip


def points_csv(points: Iterable[Point]) -> str:
    """One line for each measurement; what is not known is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for point in points:
        values = [getattr(point, name) for name in COLUMNS]
        writer.writerow(f"{v:.8g}" if isinstance(v, float) else v for v in values)
    return text.getvalue()


def points_json(description: Mapping[str, Any], outcomes: Sequence[Outcome]) -> str:
    """What was measured and under which circumstances; numbers that are not finite are null."""
    result = {
        **description,
        "points": [dataclasses.asdict(p) for o in outcomes for p in o.points],
        "statistics": [
            {"method": o.method, "repeat": o.repeat, **o.stats} for o in outcomes if o.stats
        ],
    }
    return json.dumps(_finite(result), indent=1) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def final_errors(outcomes: Sequence[Outcome]) -> list[list[str]]:
    """Rows, the heading first: each method's means over its repeats at the end."""
    rows = [
        ["method", "seconds", "CPU seconds", "iterations", "MAPE", "relMSE", "SMAPE", "mean"],
    ]
    for method in _methods(outcomes):
        last = [o.points[-1] for o in outcomes if o.method == method and o.points]
        if not last:
            continue

        def mean(name: str, points: Sequence[Point] = last) -> float:
            values = [getattr(p, name) for p in points]
            return math.nan if None in values else sum(values) / len(values)

        cpu = mean("cpu_seconds")
        rows.append(
            [
                method,
                f"{mean('seconds'):.1f}",
                "" if math.isnan(cpu) else f"{cpu:.1f}",
                f"{mean('iterations'):.4g}",
                f"{100 * mean('mape'):.3g} %",
                f"{mean('relmse'):.3g}",
                f"{100 * mean('smape'):.3g} %",
                f"{100 * mean('difference_of_means'):+.2f} %",
            ]
        )
    return rows


def stage_costs(outcomes: Sequence[Outcome]) -> list[list[str]]:
    """Rows, the heading first: time and storage of each stage in a mean iteration."""
    rows = [["method", "stage", "ms / iteration", "share", "MiB"]]
    for method in _methods(outcomes):
        runs = [o for o in outcomes if o.method == method and o.points and o.stats]
        iterations = sum(o.points[-1].iterations for o in runs)
        names = list(dict.fromkeys(n for o in runs for n in o.points[-1].stages))
        spent = {n: sum(o.points[-1].stages.get(n, 0.0) for o in runs) for n in names}
        whole = sum(spent.values())
        for name in sorted(names, key=lambda n: -spent[n]):
            held = max(o.stats["stages"].get(name, {}).get("bytes", 0) for o in runs)
            rows.append(
                [
                    method,
                    name,
                    f"{1e3 * spent[name] / iterations:.4g}",
                    f"{100 * spent[name] / whole:.1f} %",
                    f"{held / 2**20:.4g}",
                ]
            )
    return rows


def iteration_costs(outcomes: Sequence[Outcome]) -> list[list[str]]:
    """Rows, the heading first: what a mean iteration of each method is."""
    rows = [
        ["method", "iterations", "ms / iteration", "CPU ms / iteration", "segments",
         "bytes / segment", "rays / iteration"],
    ]  # fmt: skip
    for method in _methods(outcomes):
        runs = [o for o in outcomes if o.method == method and o.points and o.stats]
        if not runs:
            continue
        stats = runs[0].stats
        iterations = sum(o.stats["samples"] for o in runs)
        segments = stats["segments"]
        rows.append(
            [
                method,
                f"{iterations / len(runs):.4g}",
                f"{1e3 * sum(o.stats['seconds'] for o in runs) / iterations:.4g}",
                f"{1e3 * sum(o.stats['cpu_seconds'] for o in runs) / iterations:.4g}",
                f"{segments}" if segments else "",
                f"{stats['bytes_per_segment']:.1f}" if segments else "",
                f"{sum(o.stats['rays'] for o in runs) / iterations:.4g}",
            ]
        )
    return rows


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A table; all but the first two columns to the right."""
    heading, *body = rows
    ruler = ["---" if i < 1 else "---:" for i in range(len(heading))]
    lines = [heading, ruler, *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def table1(outcomes: Sequence[Outcome]) -> str:
    """Seconds and storage of an iteration, whole and by stage."""
    return (
        "Means over all iterations; storage is the most that a stage held, segments are those of "
        "the last iteration.\n\n"
        + markdown(iteration_costs(outcomes))
        + "\n"
        + markdown(stage_costs(outcomes))
    )


def _methods(outcomes: Sequence[Outcome]) -> list[str]:
    return list(dict.fromkeys(o.method for o in outcomes))
