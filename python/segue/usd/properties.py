"""Schema attributes: the value, or the schema's fallback where there is none that can be used."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._pxr import Usd
from .report import Report


class Properties:
    """Reads attributes at one time and reports those that cannot be used."""

    def __init__(self, time: Usd.TimeCode, report: Report) -> None:
        self.time = time
        self.report = report

    def get(self, attribute: Usd.Attribute) -> Any:
        """The value, or, with a warning, the schema's fallback where it is blocked or odd.

        Numbers of any width stand for each other; so do vectors of one length.
        """
        value = attribute.Get(self.time)
        prim, name = attribute.GetPrim(), attribute.GetName()
        fallback = prim.GetPrimDefinition().GetAttributeFallbackValue(name)
        if fallback is None or _fits(value, fallback, attribute):
            return value
        what = (
            f"{name} has no value" if value is None else f"{name} = {value}, which cannot be used"
        )
        self.report.warning(prim, what, f"its fallback {fallback} is used")
        return fallback

    def named(self, prim: Usd.Prim, name: str) -> Any:
        """The value of an attribute of the prim's schemas, by name."""
        return self.get(prim.GetAttribute(name))


def _fits(value: Any, fallback: Any, attribute: Usd.Attribute) -> bool:
    """Whether a value can stand where the schema's fallback stands."""
    if isinstance(fallback, str):
        allowed = attribute.GetMetadata("allowedTokens") or ()
        return isinstance(value, str) and (not len(allowed) or value in allowed)
    if isinstance(fallback, (bool, int, float)):
        return isinstance(value, (bool, int, float))
    wanted, given = np.asarray(fallback), np.asarray(value)
    if wanted.dtype.kind not in "fiu":
        return type(value) is type(fallback)
    is_array = type(fallback).__name__.endswith("Array")
    return given.dtype.kind in "fiu" and (is_array or given.shape == wanted.shape)
