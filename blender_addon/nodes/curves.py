"""Curves drawn by hand, as tables: RGB Curves and Float Curve."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .tree import Stack
from .values import Value

if TYPE_CHECKING:
    from .evaluate import Evaluator

_TABLE_SIZE = 1024


class _Curve:
    """Curves of a mapping, one after the other, over the range in which any curve has points."""

    def __init__(self, mapping: bpy.types.CurveMapping, *indices: int) -> None:
        mapping.initialize()
        ends = [
            (curve.points[0].location[0], curve.points[-1].location[0]) for curve in mapping.curves
        ]
        self.x = np.linspace(min(end[0] for end in ends), max(end[1] for end in ends), _TABLE_SIZE)
        values = self.x
        for index in indices:
            curve = mapping.curves[index]
            values = [mapping.evaluate(curve, float(value)) for value in values]
        self.y = np.array(values)
        self.extrapolated = mapping.extend == "EXTRAPOLATED"

    def __call__(self, t: np.ndarray) -> np.ndarray:
        result = np.interp(t, self.x, self.y)
        if not self.extrapolated:
            return result
        step = self.x[1] - self.x[0]
        first, last = (self.y[1] - self.y[0]) / step, (self.y[-1] - self.y[-2]) / step
        return result + first * np.minimum(t - self.x[0], 0) + last * np.maximum(t - self.x[-1], 0)


def rgb_curves(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """RGB Curves: the combined curve first, then that of each channel."""
    curves = [_Curve(node.mapping, 3, channel) for channel in range(3)]

    def apply(factor: np.ndarray, color: np.ndarray) -> np.ndarray:
        curved = np.stack([curves[i](color[..., i]) for i in range(3)], axis=-1)
        return color + (curved - color) * factor

    return ev.combine(node, "color", apply, *ev.inputs(node, stack, "Fac", "Color"))


def float_curve(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Float Curve."""
    curve = _Curve(node.mapping, 0)
    return ev.combine(
        node,
        "float",
        lambda factor, value: value + (curve(value) - value) * factor,
        *ev.inputs(node, stack, "Factor", "Value"),
    )
