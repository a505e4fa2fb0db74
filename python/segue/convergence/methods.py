"""What is compared: names of methods and the settings of the engine behind them."""

from __future__ import annotations

from typing import Any

#: Variants of the segment method. Any other name is an integrator's own.
SEGMENT_METHODS: dict[str, dict[str, Any]] = {
    "segment": {},
    "segment-fixed": {"kernel": "fixed"},
    # Without light paths: camera paths and next event alone, filtered at every vertex.
    "mvf": {"light_paths": 0},
    # Camera paths end at their first arrival, where light paths are gathered.
    "photon-filter": {"camera_paths": False},
}

#: Integrators whose noise averages out to the right picture, however few their samples.
UNBIASED = frozenset({"path", "light", "bdpt"})


def settings_of(method: str) -> dict[str, Any]:
    """The engine's settings of a method; whether there is such an integrator, the engine says."""
    if method in SEGMENT_METHODS:
        return {"integrator": "segment", **SEGMENT_METHODS[method]}
    return {"integrator": method}
