"""How figures of a render are told to people."""

from __future__ import annotations

import math
from typing import Any


def error_text(report: dict[str, Any]) -> str:
    """The estimated error in a progress report or in statistics, and its parts where known.

    Root mean squared, relative: `error 2.1 % (noise 2, bias 0.5)`; the squares of the parts add up.
    """
    error = report.get("estimated_error")
    if error is None or not 0 < error < math.inf:
        return "error -"
    bias = report.get("estimated_bias")
    if bias is None:
        return f"error {_percent(error)} %"
    noise = max(error - bias, 0.0)
    return f"error {_percent(error)} % (noise {_percent(noise)}, bias {_percent(bias)})"


def _percent(square: float) -> str:
    percent = 100 * math.sqrt(square)
    return f"{percent:.2g}" if percent < 100 else f"{percent:.0f}"
