"""All files of a report, in one folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from . import pictures, plots, tables
from .page import page
from .running import Outcome

_DEFINITIONS = (
    "relMSE: mean of (x - r)² / (r² + (0.01 m)²). MAPE: mean of |x - r| / (r + 0.01 m). "
    "SMAPE: mean of 2 |x - r| / (|x| + r + 0.01 m). x is the picture, r the reference, m its mean."
)


def write(
    folder: Path,
    name: str,
    facts: Sequence[tuple[str, str]],
    outcomes: Sequence[Outcome],
    reference: np.ndarray,
    known_relmse: float | None,
) -> None:
    """Writes tables, figures and the page.

    Args:
        folder: where to; it exists.
        name: of what was rendered.
        facts: names and values of the circumstances.
        outcomes: what came of each render.
        reference: (h, w, 3) linear colours.
        known_relmse: error of the reference itself.
    """
    points = [p for o in outcomes for p in o.points]
    description = {
        "circumstances": dict(facts),
        "reference_relmse": known_relmse,
    }
    (folder / "curves.csv").write_text(tables.points_csv(points))
    (folder / "curves.json").write_text(tables.points_json(description, outcomes))
    (folder / "table1.md").write_text(f"# {name}\n\n{tables.table1(outcomes)}")
    plots.save_curves(folder, outcomes, name, known_relmse)
    plots.save_stages(folder, outcomes, name)
    pictures.save_crops(folder, outcomes, reference, name)
    sections = [
        (
            "Error against time",
            [],
            folder / "curves.png",
            f"{_DEFINITIONS} Bands reach from the least to the greatest of the repeats.",
        ),
        (
            "At the end",
            [tables.final_errors(outcomes)],
            None,
            "Means over the repeats. The last column is how much brighter the picture is than the "
            "reference on the whole: noise averages out of it, bias does not.",
        ),
        (
            "Pictures",
            [],
            folder / "crops.png",
            "Below each picture its error. The crops are where the methods differ most.",
        ),
        ("Time by stage", [], folder / "stages.png", "Of the first repeat."),
        (
            "An iteration",
            [tables.iteration_costs(outcomes), tables.stage_costs(outcomes)],
            None,
            "Means over all iterations; storage is the most that a stage held, segments are those "
            "of the last iteration.",
        ),
    ]
    (folder / "index.html").write_text(page(f"Convergence: {name}", facts, sections))
