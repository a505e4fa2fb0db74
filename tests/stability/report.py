"""Runs the whole stability suite and writes docs/stability.md with its plots.

Run: make stress
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import suite  # noqa: F401  (registers the cases)
from case import CASES, Case, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DOCS = Path(__file__).resolve().parents[2] / "docs"
HEAD = Path(__file__).with_name("report_head.md")


def table(rows: Sequence[Row]) -> list[str]:
    """Markdown rows."""
    lines = [
        "| parameter | expected | got | off | noise | allowed | verdict |",
        "| --- | ---: | ---: | ---: | ---: | ---: | --- |",
    ]
    for r in rows:
        verdict = "right" if r.is_right else "**wrong**"
        if r.refused:
            verdict += f", {r.refused} samples refused"
        if r.is_bound:
            lines.append(f"| {r.parameter} | < {r.expected:.6g} | {r.got:.6g} | | | | {verdict} |")
            continue
        lines.append(
            f"| {r.parameter} | {r.expected:.6g} | {r.got:.6g} | {r.off:+.2%} | {r.noise:.2%} "
            f"| {r.tolerance:.2%} | {verdict} |"
        )
    return lines


def deviations(axes: Axes, rows: Sequence[Row], label: str | None) -> None:
    """Draws deviations from the right value, what is allowed, and noise."""
    at, off = [r.at for r in rows], [100 * r.off for r in rows]
    axes.errorbar(at, off, [100 * r.noise for r in rows], marker="o", capsize=3, label=label)
    for sign in (-1, 1):
        allowed = [sign * 100 * r.tolerance for r in rows]
        axes.plot(at, allowed, color="grey", lw=0.8, ls=":")
    axes.axhline(0, color="black", lw=0.8)
    axes.set_ylabel("off, %")


def bounded(axes: Axes, rows: Sequence[Row], label: str | None) -> None:
    """Draws values that have a bound."""
    axes.plot([r.at for r in rows], [r.got for r in rows], marker="o", label=label)
    axes.set_yscale("log")


def plot(case: Case, rows: Sequence[Row]) -> str | None:
    """Draws rows over their parameter, if that is a number; the picture's name."""
    if any(r.at is None for r in rows):
        return None
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(6, 3), layout="constrained")
    draw = bounded if all(r.is_bound for r in rows) else deviations
    for line in dict.fromkeys(r.line for r in rows):
        draw(axes, [r for r in rows if r.line == line], line or None)
    axes.set_xscale("log")
    axes.set_xlabel(case.axis)
    axes.set_title(case.name, fontsize=9)
    if any(r.line for r in rows):
        axes.legend(fontsize=7)
    name = f"stability_{case.run.__name__}.png"
    figure.savefig(DOCS / "pictures" / name, dpi=110)
    pyplot.close(figure)
    return name


def main() -> int:
    """Runs all cases; 1 if a row is wrong."""
    text, wrong, count = [HEAD.read_text().rstrip()], 0, 0
    group = ""
    for case in CASES:
        start = time.monotonic()
        rows = list(case.run(True))
        bad = sum(not r.is_right for r in rows)
        count, wrong = count + len(rows), wrong + bad
        seconds = time.monotonic() - start
        print(
            f"{case.run.__name__}: {len(rows) - bad} of {len(rows)} right, {seconds:.0f} s",
            flush=True,
        )
        if case.group != group:
            group = case.group
            text += ["", f"## {group}"]
        text += ["", f"### {case.name}", "", f"The right value: {case.answer}.", "", *table(rows)]
        if name := plot(case, rows):
            text += ["", f"![{case.name}](pictures/{name})"]
    text[0] = text[0].replace("COUNT", str(count)).replace("WRONG", str(wrong))
    (DOCS / "stability.md").write_text("\n".join(text) + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
