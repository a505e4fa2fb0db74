"""Inputs of shader nodes: what feeds them, and their values whatever their authored type."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ._pxr import Usd, UsdShade
from .report import Report

#: A node and the name of its output.
Source = tuple[UsdShade.Shader, str]


def floats(found: Any, default: Sequence[float]) -> list[float] | None:
    """A value as as many numbers as the default has, or None if it holds no finite numbers.

    One number counts for all (but not for the alpha of four), missing ones come from the default.
    """
    try:
        given = [float(v) for v in np.atleast_1d(np.asarray(found, dtype=np.float64)).ravel()]
    except (TypeError, ValueError):
        return None
    if len(given) == 1:
        given *= min(len(default), 3)
    numbers = (given + list(default)[len(given) :])[: len(default)]
    return numbers if all(math.isfinite(v) for v in numbers) else None


class Inputs:
    """Reads inputs at one time and reports those that cannot be used."""

    def __init__(self, time: Usd.TimeCode, report: Report) -> None:
        self.time = time
        self.report = report

    def source(self, node: UsdShade.Shader, name: str) -> Source | Any:
        """What feeds an input: (node, output) if it is connected to one, else a value or None.

        Connections through node graphs and materials' interfaces are followed.
        """
        found = node.GetInput(name)
        if not found:
            return None
        for attribute in found.GetValueProducingAttributes():
            if not UsdShade.Output.IsOutput(attribute):
                return attribute.Get(self.time)
            feeding = UsdShade.Shader(attribute.GetPrim())
            if feeding:
                return feeding, UsdShade.Output(attribute).GetBaseName()
        return None

    def attribute(self, node: UsdShade.Shader, name: str) -> Usd.Attribute | None:
        """The attribute that holds an input's value: its own, or one of a material's interface."""
        found = node.GetInput(name)
        producers = found.GetValueProducingAttributes() if found else []
        return producers[0] if producers else None

    def value(self, node: UsdShade.Shader, name: str, default: Any) -> Any:
        """An input that cannot be connected to a texture: its value, or the default."""
        found = self.source(node, name)
        if is_node(found):
            self.report.unsupported(node.GetPrim(), f"a node on {name}", f"{default} is used")
            return default
        return default if found is None else found

    def floats(self, node: UsdShade.Shader, name: str, default: Sequence[float]) -> list[float]:
        """Numbers, as many as the default has."""
        return self.checked(node, name, self.value(node, name, default), default)

    def checked(
        self, node: UsdShade.Shader, name: str, found: Any, default: Sequence[float]
    ) -> list[float]:
        """A value as numbers; the default, with a warning, if it holds none."""
        numbers = floats(found, default)
        if numbers is None:
            used = default[0] if len(set(default)) == 1 else tuple(default)
            self.report.warning(
                node.GetPrim(), f"{name} = {found}, which is no finite number", f"{used} is used"
            )
            return list(default)
        return numbers


def is_node(found: Source | Any) -> bool:
    """Whether what feeds an input is a node rather than a value."""
    return isinstance(found, tuple) and len(found) == 2 and isinstance(found[0], UsdShade.Shader)
