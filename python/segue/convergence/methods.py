"""What is compared: names of methods and the settings of the engine behind them."""

from __future__ import annotations

from typing import Any

#: Names that are more than an integrator's.
VARIANTS: dict[str, dict[str, Any]] = {
    "segment-progressive": {"integrator": "segment", "kernel": "progressive"},
    "segment-fixed": {"integrator": "segment", "kernel": "fixed"},
    "segment-bridge-power": {"integrator": "segment-bridge", "bridges": "power"},
    "segment-literal": {"integrator": "segment", "estimator": "literal"},
}

#: Integrators whose noise averages out to the right picture, however few their samples.
UNBIASED = frozenset({"path", "light", "bdpt"})


def settings_of(method: str) -> dict[str, Any]:
    """The engine's settings of a method; whether there is such an integrator, the engine says."""
    return VARIANTS.get(method, {"integrator": method})
