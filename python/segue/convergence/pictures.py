"""Pictures of all methods side by side, where they err and how much."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from .. import metrics, tonemapping
from .plots import DPI
from .running import Outcome

#: Crops, and their edge as a part of the picture's shorter one.
CROPS, CROP_PART = 2, 0.25
#: Limits of the scale of relative errors.
ERROR_RANGE = (0.003, 3.0)
_FRAMES = ("#FF3B30", "#34C759")


def crop_places(maps: Sequence[np.ndarray], edge: int) -> list[tuple[int, int]]:
    """Left and top of the squares where the methods' errors differ most, without overlap.

    Maps are (h, w) errors; what tells methods apart is the scatter of a square's logarithmic mean
    error among them, or, of a single method, the error itself.
    """
    means = np.array([_box_means(m, edge) for m in maps])
    score = means[0] if len(maps) == 1 else np.log(means + ERROR_RANGE[0]).std(axis=0)
    places: list[tuple[int, int]] = []
    for _ in range(CROPS):
        if not np.isfinite(score).any():
            break
        y, x = np.unravel_index(np.argmax(score), score.shape)
        places.append((int(x), int(y)))
        score = score.copy()
        score[max(0, y - edge + 1) : y + edge, max(0, x - edge + 1) : x + edge] = -np.inf
    return places


def _box_means(values: np.ndarray, edge: int) -> np.ndarray:
    """Mean of every square of that edge that lies inside."""
    sums = np.zeros((values.shape[0] + 1, values.shape[1] + 1))
    sums[1:, 1:] = np.minimum(values, ERROR_RANGE[1]).cumsum(0).cumsum(1)
    squares = sums[edge:, edge:] - sums[:-edge, edge:] - sums[edge:, :-edge] + sums[:-edge, :-edge]
    return np.maximum(squares, 0) / edge**2


def save_crops(
    folder: Path, outcomes: Sequence[Outcome], reference: np.ndarray, title: str
) -> None:
    """Writes `crops.png`: pictures, error maps and crops of the reference and of each method."""
    shown = [o for o in outcomes if o.repeat == 0 and o.points]
    if not shown:
        return
    maps = [metrics.error_map(o.picture, reference) for o in shown]
    height, width = reference.shape[:2]
    edge = max(4, round(CROP_PART * min(height, width)))
    places = crop_places(maps, min(edge, height, width))
    columns = 1 + len(shown)
    ratio = height / width
    with rc_context({"font.size": 9}):
        figure = Figure(
            figsize=(2.5 * columns + 0.9, 2.5 * (2 * ratio + 2 * len(places)) + 1.1),
            dpi=DPI,
            layout="constrained",
        )
        panels = figure.subplots(
            2 + 2 * len(places),
            columns,
            squeeze=False,
            height_ratios=[ratio, ratio] + [1.0] * (2 * len(places)),
        )
        heads = ["reference"] + [
            f"{o.method}\n{o.points[-1].seconds:.3g} s, MAPE {100 * o.points[-1].mape:.3g} %"
            for o in shown
        ]
        whole = (0, 0, width, height)
        windows = [whole] + [(x, y, min(edge, width), min(edge, height)) for x, y in places]
        for column, head in enumerate(heads):
            picture = reference if column == 0 else shown[column - 1].picture
            panels[0][column].set_title(head)
            for index, window in enumerate(windows):
                upper, lower = panels[2 * index][column], panels[2 * index + 1][column]
                _show(upper, tonemapping.to_srgb(tonemapping.neutral(_cut(picture, window))))
                if column == 0:
                    _show(lower, None)
                    lower.text(0.98, 0.5, "relative error", ha="right", va="center",
                               transform=lower.transAxes)  # fmt: skip
                else:
                    scale = _show_error(lower, _cut(maps[column - 1], window))
                if index:
                    _frame(upper, _FRAMES[(index - 1) % 2])
                    _frame(lower, _FRAMES[(index - 1) % 2], only_pictures=column == 0)
            for number, (x, y, w, h) in enumerate(windows[1:]):
                color = _FRAMES[number % 2]
                panels[0][column].add_patch(
                    Rectangle((x - 0.5, y - 0.5), w, h, fill=False, ec=color, lw=1.5)
                )
        figure.colorbar(
            scale,
            ax=panels[:, -1],
            label="|x - r| / (r + 0.01 m), mean over channels",
            extend="both",
            shrink=0.6,
            aspect=40,
        )
        figure.suptitle(title)
        figure.savefig(folder / "crops.png")


def _cut(values: np.ndarray, window: tuple[int, int, int, int]) -> np.ndarray:
    x, y, w, h = window
    return values[y : y + h, x : x + w]


def _show(axes: Axes, pixels: np.ndarray | None) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    if pixels is None:
        axes.set_axis_off()
    else:
        axes.imshow(pixels, interpolation="nearest")


def _show_error(axes: Axes, values: np.ndarray) -> object:
    axes.set_xticks([])
    axes.set_yticks([])
    clipped = np.clip(values, *ERROR_RANGE)
    return axes.imshow(clipped, cmap="inferno", norm=LogNorm(*ERROR_RANGE), interpolation="nearest")


def _frame(axes: Axes, color: str, only_pictures: bool = False) -> None:
    if only_pictures:
        return
    for spine in axes.spines.values():
        spine.set(color=color, linewidth=2)
