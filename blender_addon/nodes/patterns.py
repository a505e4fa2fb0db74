"""Procedural textures: what repeats or ends is a picture, and noise looks one up."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bpy
import numpy as np

from .coordinates import AS_IT_IS
from .places import looked_up, turned
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
    convert,
)

if TYPE_CHECKING:
    from .evaluate import Evaluator

# Row 0 is on top.
_SQUARES = Baked("Checker", np.array([[[1.0], [0.0]], [[0.0], [1.0]]], np.float32))

# Texels of a picture of one row.
_SIZE = 1024

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
    result = np.diag([scale, scale, scale, 1.0])
    result[:3, 3] = 1e-6
    return np.diag([0.999999] * 3 + [1.0]) @ result


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


def _shown(value: ImageValue, output: bpy.types.NodeSocket) -> Value:
    return convert(value, "color") if output.identifier == "Color" else value


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
    """Gradient Texture, but for the radial kinds."""
    if node.gradient_type not in _GRADIENTS:
        raise UnsupportedError(f"the {node.gradient_type.lower().replace('_', ' ')} gradient")
    curve, row = _GRADIENTS[node.gradient_type]
    # From the middle of the first texel to that of the last.
    along = np.array(row) * (_SIZE - 1) / _SIZE + np.array([0.0, 0.0, 0.0, 0.5 / _SIZE])
    place = _place(ev, node, stack)
    values = curve(np.linspace(0.0, 1.0, _SIZE))
    return _shown(_row(ev, node, place, along, values, "clamp"), output)


def wave(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Wave Texture of bands without distortion."""
    if node.wave_type != "BANDS":
        raise UnsupportedError("waves in rings")
    if ev.value(node.inputs["Distortion"], stack) != Constant.number(0.0):
        ev.simplify(node, "distortion", "even waves are used")
    steps = _steady(ev.number(node.inputs["Scale"], stack))
    phase = ev.number(node.inputs["Phase Offset"], stack)
    turns = np.array([*_BANDS[node.bands_direction], phase]) / (2.0 * np.pi)
    values = _PROFILES[node.wave_profile]((np.arange(_SIZE) + 0.5) / _SIZE)
    place = _place(ev, node, stack)
    return _shown(_row(ev, node, place, turns @ steps, values, "repeat"), output)


# What Blender's names of Voronoi features are, and how far each distance reaches, about, in cells.
_FEATURES = {
    "F1": ("f1", 1.5),
    "F2": ("f2", 2.0),
    "SMOOTH_F1": ("smooth_f1", 1.5),
    "DISTANCE_TO_EDGE": ("distance_to_edge", 1.0),
}

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
    feature, reach = _FEATURES[node.feature]
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
    place = _place(ev, node, stack)
    scale = ev.number(node.inputs["Scale"], stack)
    where: str | Value
    if isinstance(place, Coordinates):
        where = ev.textures.solid(place.scaled(scale))
    else:
        where = turned(ev, node, place, np.diag([scale, scale, scale, 1.0]))
    most = 1.0 if normalized else octaves if colored else reach * octaves
    kind, channel = ("color", "rgb") if colored else ("float", "r")
    return PatternValue("Voronoi", data, where, (0.0, most), kind, channel)


def noise(ev: Evaluator, node: bpy.types.Node, output: bpy.types.NodeSocket, stack: Stack) -> Value:
    """Noise Texture in three dimensions."""
    if node.noise_dimensions != "3D":
        raise UnsupportedError(f"noise in {node.noise_dimensions}")
    if getattr(node, "noise_type", "FBM") != "FBM":
        raise UnsupportedError(f"{node.noise_type.lower().replace('_', ' ')} noise")
    if not getattr(node, "normalize", True):
        raise UnsupportedError("noise that is not normalized")
    place = _place(ev, node, stack)
    scale = ev.number(node.inputs["Scale"], stack)
    colored = output.identifier == "Color"
    space = "colored noise" if colored else "noise"
    numbers = tuple(
        ev.number(node.inputs[name], stack)
        for name in ("Detail", "Roughness", "Lacunarity", "Distortion")
    )
    if isinstance(place, Coordinates):
        sampling = Sampling(space, numbers, ev.textures.solid(place.scaled(scale)), "clamp")
    else:
        scaled = turned(ev, node, place, np.diag([scale, scale, scale, 1.0]))
        sampling = Sampling(space, numbers, "", "clamp", at=scaled)
    ramp = Baked("Noise", np.linspace(0.0, 1.0, _SIZE, dtype=np.float32)[None, :, None])
    return ImageValue(ramp, sampling, *(("color", "rgb") if colored else ("float", "r")))
