"""Procedural textures.

What repeats or ends is a picture, noise looks one up, cells and bricks are patterns of the engine.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .coordinates import AS_IT_IS
from .places import as_value, length, looked_up, turned
from .tree import Stack
from .values import (
    Baked,
    Constant,
    Coordinates,
    ImageValue,
    PatternValue,
    Sampling,
    UnsupportedError,
    Value,
    component,
    convert,
    scaling,
)

if TYPE_CHECKING:
    from .evaluate import Evaluator

# Row 0 is on top.
_SQUARES = Baked("Checker", np.array([[[1.0], [0.0]], [[0.0], [1.0]]], np.float32))

# Texels of a picture of one row.
_SIZE = 1024

# Noise as it is.
_RAMP = Baked("Noise", np.linspace(0.0, 1.0, _SIZE, dtype=np.float32)[None, :, None])

# What gradients make of their coordinate from 0 to 1, and what that is of x, y, z and 1.
_GRADIENTS = {
    "LINEAR": (lambda x: x, (1.0, 0.0, 0.0, 0.0)),
    "QUADRATIC": (lambda x: x * x, (1.0, 0.0, 0.0, 0.0)),
    "EASING": (lambda x: x * x * (3.0 - 2.0 * x), (1.0, 0.0, 0.0, 0.0)),
    "DIAGONAL": (lambda x: x, (0.5, 0.5, 0.0, 0.0)),
}

# What waves make of their phase in turns, from 0 to 1.
_PROFILES = {
    "SIN": lambda t: 0.5 - 0.5 * np.cos(2.0 * np.pi * t),
    "SAW": lambda t: t,
    "TRI": lambda t: 1.0 - np.abs(2.0 * t - 1.0),
}

# Phase of bands, radians, by x, y and z.
_BANDS = {
    "X": (20.0, 0.0, 0.0),
    "Y": (0.0, 20.0, 0.0),
    "Z": (0.0, 0.0, 20.0),
    "DIAGONAL": (10.0, 10.0, 10.0),
}


def _place(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> Coordinates | Value:
    place = looked_up(ev, node, stack, "generated")
    if isinstance(place, Coordinates) and place.space == "environment":
        raise UnsupportedError("a texture of this kind in this place")
    return place


def _steady(scale: float) -> np.ndarray:
    """Scales, and moves as Cycles does it to keep whole numbers from flickering."""
    result = scaling(scale)
    result[:3, 3] = 1e-6
    return scaling(0.999999) @ result


def _row(
    ev: Evaluator,
    node: bpy.types.Node,
    place: Coordinates | Value,
    row: np.ndarray,
    values: np.ndarray,
    wrap: str,
) -> ImageValue:
    """A picture of one row, looked up by `row` (4) times x, y, z and 1."""
    picture = Baked("Pattern", values.astype(np.float32)[None, :, None])
    if isinstance(place, Coordinates):
        uv, transform = ev.textures.place(place.along(row))
        sampling = Sampling("uv", transform, uv, wrap)
    else:
        matrix = np.array([row, [0, 0, 0, 0.5], [0, 0, 0, 0], [0, 0, 0, 1]])
        sampling = Sampling("uv", AS_IT_IS, "", wrap, at=turned(ev, node, place, matrix))
    return ImageValue(picture, sampling, "float", "r")


def _shown(value: Value, output: bpy.types.NodeSocket) -> Value:
    return convert(value, "color") if output.identifier == "Color" else value


def _where(ev: Evaluator, node: bpy.types.Node, stack: Stack) -> str | Value:
    """The scaled place of a pattern: an attribute that holds it, or a value."""
    place = _place(ev, node, stack)
    scale = ev.number(node.inputs["Scale"], stack)
    if isinstance(place, Coordinates):
        return ev.textures.solid(place.scaled(scale))
    return turned(ev, node, place, scaling(scale))


def checker(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Checker Texture, as a picture of four texels for what is level in its third coordinate."""
    place = _place(ev, node, stack)
    if not isinstance(place, Coordinates):
        raise UnsupportedError("a checker by computed coordinates")
    steps = place.by(_steady(ev.number(node.inputs["Scale"], stack)))
    uv, transform = ev.textures.place(steps.scaled(0.5), in_layers=True)
    squares = ImageValue(_SQUARES, Sampling("uv", transform, uv, "repeat", "closest"), "float", "r")
    if output.identifier != "Color":
        return squares
    colors = ev.inputs(node, stack, "Color1", "Color2")
    return ev.combine(node, "color", lambda t, a, b: b + (a - b) * t, squares, *colors)


def gradient(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Gradient Texture, but for the radial kind."""
    if node.gradient_type in {"SPHERICAL", "QUADRATIC_SPHERE"}:
        power = 2.0 if node.gradient_type == "QUADRATIC_SPHERE" else 1.0
        distance = length(as_value(ev, _place(ev, node, stack)))

        def fall(r: np.ndarray) -> np.ndarray:
            return np.maximum(0.999999 - r, 0.0) ** power

        return _shown(ev.combine(node, "float", fall, distance), output)
    if node.gradient_type not in _GRADIENTS:
        raise UnsupportedError(f"the {node.gradient_type.lower().replace('_', ' ')} gradient")
    curve, row = _GRADIENTS[node.gradient_type]
    # From the middle of the first texel to that of the last.
    along = np.array(row) * (_SIZE - 1) / _SIZE + np.array([0.0, 0.0, 0.0, 0.5 / _SIZE])
    place = _place(ev, node, stack)
    values = curve(np.linspace(0.0, 1.0, _SIZE))
    return _shown(_row(ev, node, place, along, values, "clamp"), output)


def wave(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Wave Texture."""
    steps = _steady(ev.number(node.inputs["Scale"], stack))
    phase = ev.number(node.inputs["Phase Offset"], stack)
    values = _PROFILES[node.wave_profile]((np.arange(_SIZE) + 0.5) / _SIZE)
    place = _place(ev, node, stack)
    bent = ev.value(node.inputs["Distortion"], stack) != Constant.number(0.0)
    if node.wave_type == "BANDS" and not bent:
        turns = np.array([*_BANDS[node.bands_direction], phase]) / (2.0 * np.pi)
        return _shown(_row(ev, node, place, turns @ steps, values, "repeat"), output)
    # What has no attribute of its own is computed in place.
    at = turned(ev, node, as_value(ev, place), steps)
    if node.wave_type == "BANDS":
        matrix = np.zeros((4, 4))
        matrix[0, :3], matrix[3, 3] = _BANDS[node.bands_direction], 1.0
        along = component(turned(ev, node, at, matrix), 0)
    else:
        kept = np.diag([float(axis != node.rings_direction) for axis in "XYZ"] + [1.0])
        along = ev.combine(node, "float", lambda r: 20.0 * r, length(turned(ev, node, at, kept)))
    added = _distortion(ev, node, stack, at) if bent else Constant.number(0.0)
    turn = ev.combine(node, "float", lambda n, d: (n + d + phase) / (2.0 * np.pi), along, added)
    if isinstance(turn, Constant):
        raise UnsupportedError("waves in one place")
    picture = Baked("Waves", values.astype(np.float32)[None, :, None])
    # Of a single row the height does not matter.
    sampling = Sampling("uv", AS_IT_IS, "", "repeat", at=convert(turn, "vector"))
    return _shown(ImageValue(picture, sampling, "float", "r"), output)


def _distortion(ev: Evaluator, node: bpy.types.Node, stack: Stack, at: Value) -> Value:
    """What noise adds to the phase of waves."""
    scale = ev.number(node.inputs["Detail Scale"], stack)
    numbers = (
        ev.number(node.inputs["Detail"], stack),
        ev.number(node.inputs["Detail Roughness"], stack),
        *(2.0, 0.0),
    )
    place = turned(ev, node, at, scaling(scale))
    strength = ImageValue(_RAMP, Sampling("noise", numbers, "", "clamp", at=place), "float", "r")
    distortion = ev.value(node.inputs["Distortion"], stack)
    return ev.combine(node, "float", lambda d, n: d * (2.0 * n - 1.0), distortion, strength)


# What Blender's names of Voronoi features are, and how far each reaches along an axis, in cells.
_FEATURES = {
    "F1": ("f1", 1.0),
    "F2": ("f2", 1.5),
    "SMOOTH_F1": ("smooth_f1", 1.0),
    "DISTANCE_TO_EDGE": ("distance_to_edge", 1.0),
}

# The powers by which Blender's metrics measure.
_POWERS = {"EUCLIDEAN": 2.0, "MANHATTAN": 1.0, "CHEBYCHEV": np.inf}

# Inputs of Voronoi Texture; each feature and metric has those that it needs.
_CELL_INPUTS = ("Detail", "Roughness", "Lacunarity", "Smoothness", "Exponent", "Randomness")


def voronoi(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Voronoi Texture in three dimensions: distances and colours."""
    if node.voronoi_dimensions != "3D":
        raise UnsupportedError(f"cells in {node.voronoi_dimensions}")
    if node.feature not in _FEATURES or output.identifier not in {"Distance", "Color"}:
        raise UnsupportedError(f"the output '{output.name}'")
    feature, cells = _FEATURES[node.feature]
    entries = {name: node.inputs.get(name) for name in _CELL_INPUTS}
    numbers = {
        name.lower(): ev.number(entry, stack)
        for name, entry in entries.items()
        if entry is not None and entry.enabled
    }
    if feature == "distance_to_edge" and numbers.get("detail", 0.0) != 0.0:
        ev.simplify(node, "detail of edges", "it is left out")
    colored = output.identifier == "Color"
    normalized = bool(getattr(node, "normalize", False))
    octaves = 1.0 + numbers.get("detail", 0.0)
    if bpy.app.version < (5, 0, 0):
        ev.simplify(node, "the pattern of this Blender", "that of Blender 5.0 is used")
    data = {
        "type": "cells",
        "colored": colored,
        "cells": {
            "feature": feature,
            "metric": node.distance.lower(),
            "normalize": normalized,
            **numbers,
        },
    }
    where = _where(ev, node, stack)
    power = _POWERS.get(node.distance, max(numbers.get("exponent", 0.5), 0.01))
    reach = 1.0 if colored else cells * min(3.0 ** (1.0 / power), 100.0)
    most = 1.0 if normalized else reach * octaves
    kind, channel = ("color", "rgb") if colored else ("float", "r")
    return PatternValue("Voronoi", data, {"place": where}, (0.0, most), kind, channel)


def bricks(
    ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack
) -> Value:
    """Brick Texture."""
    numbers = {
        key: ev.number(node.inputs[name], stack)
        for key, name in (
            ("width", "Brick Width"),
            ("height", "Row Height"),
            ("mortar", "Mortar Size"),
            ("smooth", "Mortar Smooth"),
            ("bias", "Bias"),
        )
    }
    if min(numbers["width"], numbers["height"], node.squash) <= 0.0:
        raise UnsupportedError("a wall of bricks without size")
    data = {
        "type": "bricks",
        "bricks": {
            **numbers,
            "offset": node.offset,
            "offset_frequency": node.offset_frequency,
            "squash": node.squash,
            "squash_frequency": node.squash_frequency,
        },
    }
    where = {"place": _where(ev, node, stack)}
    mortar, tint = (
        PatternValue("Bricks", data, where, (0.0, 1.0), "float", channel) for channel in "rg"
    )
    if output.identifier != "Color":
        return mortar
    first, second, joint = ev.inputs(node, stack, "Color1", "Color2", "Mortar")

    def between(t: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return a + (b - a) * t

    brick = ev.combine(node, "color", between, tint, first, second)
    return ev.combine(node, "color", between, mortar, brick, joint)


def noise(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Noise Texture in three dimensions."""
    if node.noise_dimensions != "3D":
        raise UnsupportedError(f"noise in {node.noise_dimensions}")
    if getattr(node, "noise_type", "FBM") != "FBM":
        raise UnsupportedError(f"{node.noise_type.lower().replace('_', ' ')} noise")
    if not getattr(node, "normalize", True):
        raise UnsupportedError("noise that is not normalized")
    where = _where(ev, node, stack)
    colored = output.identifier == "Color"
    space = "colored noise" if colored else "noise"
    numbers = tuple(
        ev.number(node.inputs[name], stack)
        for name in ("Detail", "Roughness", "Lacunarity", "Distortion")
    )
    if isinstance(where, str):
        sampling = Sampling(space, numbers, where, "clamp")
    else:
        sampling = Sampling(space, numbers, "", "clamp", at=where)
    return ImageValue(_RAMP, sampling, *(("color", "rgb") if colored else ("float", "r")))
