"""The arithmetic of Blender's converter nodes on numpy arrays.

Every function takes and returns arrays whose last axis holds 1 (floats) or 3 (colours, vectors)
components; the axes before it are the picture, or 1 by 1 for a constant.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

Array = np.ndarray


def _safe_divide(a: Array, b: Array) -> Array:
    """Division where x / 0 is 0."""
    a, b = np.broadcast_arrays(a, b)
    return np.divide(a, b, out=np.zeros_like(a), where=b != 0)


def _safe_power(a: Array, b: Array) -> Array:
    """Powers; a negative base has one for whole exponents only, 0 otherwise."""
    a, b = np.broadcast_arrays(a, b)
    defined = (a >= 0) | (b == np.floor(b))
    return np.where(defined, np.sign(a) ** np.where(a < 0, b, 0) * np.abs(a) ** b, 0)


def _wrap(value: Array, high: Array, low: Array) -> Array:
    span = high - low
    return np.where(span != 0, value - span * np.floor(_safe_divide(value - low, span)), low)


def _ping_pong(value: Array, scale: Array) -> Array:
    return np.where(scale != 0, np.abs(_wrap(value - scale, scale, -scale)), 0)


def _smooth_min(a: Array, b: Array, distance: Array) -> Array:
    """Polynomial smooth minimum of width `distance`."""
    h = np.maximum(distance - np.abs(a - b), 0) * np.where(
        distance != 0, 1 / np.where(distance != 0, distance, 1), 0
    )
    return np.minimum(a, b) - h**3 * distance / 6


MATH: dict[str, Callable[[Array, Array, Array], Array]] = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: _safe_divide(a, b),
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: _safe_power(a, b),
    "LOGARITHM": lambda a, b, c: np.where((a > 0) & (b > 0), _safe_divide(np.log(a), np.log(b)), 0),
    "SQRT": lambda a, b, c: np.sqrt(np.maximum(a, 0)),
    "INVERSE_SQRT": lambda a, b, c: np.where(a > 0, 1 / np.sqrt(a), 0),
    "ABSOLUTE": lambda a, b, c: np.abs(a),
    "EXPONENT": lambda a, b, c: np.exp(a),
    "MINIMUM": lambda a, b, c: np.minimum(a, b),
    "MAXIMUM": lambda a, b, c: np.maximum(a, b),
    "LESS_THAN": lambda a, b, c: (a < b) * 1.0,
    "GREATER_THAN": lambda a, b, c: (a > b) * 1.0,
    "SIGN": lambda a, b, c: np.sign(a),
    "COMPARE": lambda a, b, c: (np.abs(a - b) <= np.maximum(c, 1e-5)) * 1.0,
    "SMOOTH_MIN": _smooth_min,
    "SMOOTH_MAX": lambda a, b, c: -_smooth_min(-a, -b, c),
    "ROUND": lambda a, b, c: np.floor(a + 0.5),
    "FLOOR": lambda a, b, c: np.floor(a),
    "CEIL": lambda a, b, c: np.ceil(a),
    "TRUNC": lambda a, b, c: np.trunc(a),
    "FRACT": lambda a, b, c: a - np.floor(a),
    "MODULO": lambda a, b, c: np.where(b != 0, np.fmod(a, np.where(b != 0, b, 1)), 0),
    "FLOORED_MODULO": lambda a, b, c: np.where(b != 0, np.mod(a, np.where(b != 0, b, 1)), 0),
    "WRAP": _wrap,
    "SNAP": lambda a, b, c: np.floor(_safe_divide(a, b)) * b,
    "PINGPONG": lambda a, b, c: _ping_pong(a, b),
    "SINE": lambda a, b, c: np.sin(a),
    "COSINE": lambda a, b, c: np.cos(a),
    "TANGENT": lambda a, b, c: np.tan(a),
    "ARCSINE": lambda a, b, c: np.where(np.abs(a) <= 1, np.arcsin(np.clip(a, -1, 1)), 0),
    "ARCCOSINE": lambda a, b, c: np.where(np.abs(a) <= 1, np.arccos(np.clip(a, -1, 1)), 0),
    "ARCTANGENT": lambda a, b, c: np.arctan(a),
    "ARCTAN2": lambda a, b, c: np.arctan2(a, b),
    "SINH": lambda a, b, c: np.sinh(a),
    "COSH": lambda a, b, c: np.cosh(a),
    "TANH": lambda a, b, c: np.tanh(a),
    "RADIANS": lambda a, b, c: a * (math.pi / 180.0),
    "DEGREES": lambda a, b, c: a * (180.0 / math.pi),
}

# Vector operations that work on each component alone have the meaning of `MATH`.
VECTOR_BY_COMPONENT = {
    "ADD": "ADD",
    "SUBTRACT": "SUBTRACT",
    "MULTIPLY": "MULTIPLY",
    "DIVIDE": "DIVIDE",
    "MULTIPLY_ADD": "MULTIPLY_ADD",
    "ABSOLUTE": "ABSOLUTE",
    "POWER": "POWER",
    "SIGN": "SIGN",
    "MINIMUM": "MINIMUM",
    "MAXIMUM": "MAXIMUM",
    "FLOOR": "FLOOR",
    "CEIL": "CEIL",
    "FRACTION": "FRACT",
    "MODULO": "MODULO",
    "WRAP": "WRAP",
    "SNAP": "SNAP",
    "SINE": "SINE",
    "COSINE": "COSINE",
    "TANGENT": "TANGENT",
}


def _length(a: Array) -> Array:
    return np.linalg.norm(a, axis=-1, keepdims=True)


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=-1, keepdims=True)


# Vector operations of their own kind; those of the second table give a float.
VECTOR: dict[str, Callable[[Array, Array, Array, Array], Array]] = {
    "CROSS_PRODUCT": lambda a, b, c, s: np.cross(a, b),
    "PROJECT": lambda a, b, c, s: b * _safe_divide(_dot(a, b), _dot(b, b)),
    "REFLECT": lambda a, b, c, s: (
        a - 2 * _dot(a, _safe_divide(b, _length(b))) * _safe_divide(b, _length(b))
    ),
    "SCALE": lambda a, b, c, s: a * s,
    "NORMALIZE": lambda a, b, c, s: _safe_divide(a, _length(a)),
}
VECTOR_TO_FLOAT: dict[str, Callable[[Array, Array, Array, Array], Array]] = {
    "DOT_PRODUCT": lambda a, b, c, s: _dot(a, b),
    "DISTANCE": lambda a, b, c, s: _length(a - b),
    "LENGTH": lambda a, b, c, s: _length(a),
}


def rgb_to_hsv(rgb: Array) -> Array:
    """Hue, saturation and value, the hue in turns."""
    high = rgb.max(axis=-1)
    span = high - rgb.min(axis=-1)
    r, g, b = (_safe_divide(high - rgb[..., i], span) for i in range(3))
    hue = (
        np.where(rgb[..., 0] == high, b - g, np.where(rgb[..., 1] == high, 2 + r - b, 4 + g - r))
        / 6
    )
    hue = np.where(span == 0, 0, hue - np.floor(hue))
    return np.stack([hue, _safe_divide(span, high), high], axis=-1)


def hsv_to_rgb(hsv: Array) -> Array:
    """Inverse of `rgb_to_hsv`."""
    h, s, v = hsv[..., 0] * 6, hsv[..., 1], hsv[..., 2]
    channels = [
        np.clip(np.abs(h - 3) - 1, 0, 1),
        np.clip(2 - np.abs(h - 2), 0, 1),
        np.clip(2 - np.abs(h - 4), 0, 1),
    ]
    return np.stack([((channel - 1) * s + 1) * v for channel in channels], axis=-1)


def rgb_to_hsl(rgb: Array) -> Array:
    """Hue, saturation and lightness, the hue in turns."""
    high, low = rgb.max(axis=-1), rgb.min(axis=-1)
    saturation = _safe_divide(high - low, 1 - np.abs(high + low - 1))
    return np.stack([rgb_to_hsv(rgb)[..., 0], saturation, (high + low) / 2], axis=-1)


def hsl_to_rgb(hsl: Array) -> Array:
    """Inverse of `rgb_to_hsl`."""
    hue = np.stack([hsl[..., 0], np.ones_like(hsl[..., 0]), np.ones_like(hsl[..., 0])], axis=-1)
    saturation, lightness = hsl[..., 1:2], hsl[..., 2:]
    return (hsv_to_rgb(hue) - 0.5) * (1 - np.abs(2 * lightness - 1)) * saturation + lightness


# The models of Separate Color and Combine Color beside RGB, in both directions.
COLOR_MODELS = {"HSV": (rgb_to_hsv, hsv_to_rgb), "HSL": (rgb_to_hsl, hsl_to_rgb)}


def hue_saturation(
    color: Array, hue: Array, saturation: Array, value: Array, factor: Array
) -> Array:
    """The Hue/Saturation/Value node; a hue of 0.5 changes nothing."""
    hsv = rgb_to_hsv(color)
    shifted = hsv[..., :1] + hue + 0.5
    changed = np.concatenate(
        np.broadcast_arrays(
            shifted - np.floor(shifted),
            np.clip(hsv[..., 1:2] * saturation, 0, 1),
            hsv[..., 2:] * value,
        ),
        axis=-1,
    )
    return np.maximum(color + (hsv_to_rgb(changed) - color) * factor, 0)


def _with_hsv(base: Array, top: Array, taken: tuple[int, ...]) -> Array:
    """`base` with some of hue, saturation and value taken from `top`."""
    base, top = np.broadcast_arrays(base, top)
    hsv, other = rgb_to_hsv(base), rgb_to_hsv(top)
    # A grey colour has no hue to give.
    keep = other[..., 1] == 0 if 0 in taken else np.zeros(other.shape[:-1], bool)
    for index in taken:
        hsv[..., index] = other[..., index]
    return np.where(keep[..., None], base, hsv_to_rgb(hsv))


def _overlay(a: Array, b: Array) -> Array:
    return np.where(a < 0.5, 2 * a * b, 1 - 2 * (1 - a) * (1 - b))


def _dodge(a: Array, b: Array) -> Array:
    return np.where(a == 0, 0, np.where(b >= 1, 1, np.minimum(_safe_divide(a, 1 - b), 1)))


def _burn(a: Array, b: Array) -> Array:
    return np.where(b <= 0, 0, np.clip(1 - _safe_divide(1 - a, b), 0, 1))


def _plain(blend: Callable[[Array, Array], Array]) -> Callable[[Array, Array, Array], Array]:
    """A blend mode that is mixed in by the factor."""
    return lambda t, a, b: a + (blend(a, b) - a) * t


MIX: dict[str, Callable[[Array, Array, Array], Array]] = {
    "MIX": _plain(lambda a, b: b),
    "ADD": _plain(lambda a, b: a + b),
    "SUBTRACT": _plain(lambda a, b: a - b),
    "MULTIPLY": _plain(lambda a, b: a * b),
    "DIVIDE": _plain(lambda a, b: np.where(b != 0, _safe_divide(a, b), a)),
    "DIFFERENCE": _plain(lambda a, b: np.abs(a - b)),
    "EXCLUSION": _plain(lambda a, b: np.maximum(a + b - 2 * a * b, 0)),
    "DARKEN": _plain(np.minimum),
    "LIGHTEN": _plain(np.maximum),
    "SCREEN": lambda t, a, b: 1 - (1 - t + t * (1 - b)) * (1 - a),
    "OVERLAY": _plain(_overlay),
    # Dodge and burn scale the upper colour by the factor first.
    "DODGE": lambda t, a, b: _dodge(a, t * b),
    "BURN": lambda t, a, b: _burn(a, 1 - t + t * b),
    "SOFT_LIGHT": _plain(lambda a, b: (1 - a) * b * a + a * (1 - (1 - b) * (1 - a))),
    "LINEAR_LIGHT": lambda t, a, b: a + t * (2 * b - 1),
    "HUE": _plain(lambda a, b: _with_hsv(a, b, (0,))),
    "SATURATION": _plain(lambda a, b: _with_hsv(a, b, (1,))),
    "COLOR": _plain(lambda a, b: _with_hsv(a, b, (0, 1))),
    "VALUE": _plain(lambda a, b: _with_hsv(a, b, (2,))),
}


def _step(t: Array) -> Array:
    return t * t * (3 - 2 * t)


def _smoother_step(t: Array) -> Array:
    return t * t * t * (t * (t * 6 - 15) + 10)


def map_range(kind: str, clamp: bool) -> Callable[..., Array]:
    """The Map Range node: value, the range it comes from, the one it goes to, and the steps."""

    def apply(
        value: Array, low: Array, high: Array, to_low: Array, to_high: Array, steps: Array
    ) -> Array:
        t = _safe_divide(value - low, high - low)
        if kind == "STEPPED":
            t = np.where(steps > 0, _safe_divide(np.floor(t * (steps + 1)), steps), 0)
        elif kind == "SMOOTHSTEP":
            t = _step(np.clip(t, 0, 1))
        elif kind == "SMOOTHERSTEP":
            t = _smoother_step(np.clip(t, 0, 1))
        result = to_low + t * (to_high - to_low)
        if clamp and kind in {"LINEAR", "STEPPED"}:
            result = np.clip(result, np.minimum(to_low, to_high), np.maximum(to_low, to_high))
        return result

    return apply


def bright_contrast(color: Array, brightness: Array, contrast: Array) -> Array:
    """The Brightness/Contrast node."""
    return np.maximum((1 + contrast) * color + brightness - contrast * 0.5, 0)


def gamma(color: Array, exponent: Array) -> Array:
    """The Gamma node: powers of the positive part."""
    return np.where(color > 0, np.abs(color) ** exponent, color)


def blackbody(temperature: float) -> tuple[float, float, float]:
    """Colour of a black body of unit luminance in linear Rec.709, at `temperature` kelvin.

    Planck's law times the fits to the CIE 1931 observer by Wyman, Sloan and Shirley (Simple
    Analytic Approximations to the CIE XYZ Color Matching Functions, 2013).
    """
    wavelengths = np.arange(380.0, 781.0, 5.0)

    def lobe(height: float, centre: float, left: float, right: float) -> Array:
        width = np.where(wavelengths < centre, left, right)
        return height * np.exp(-0.5 * ((wavelengths - centre) * width) ** 2)

    x = (
        lobe(0.362, 442.0, 0.0624, 0.0374)
        + lobe(1.056, 599.8, 0.0264, 0.0323)
        + lobe(-0.065, 501.1, 0.0490, 0.0382)
    )
    y = lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322)
    z = lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725)
    # Second radiation constant in nm K; the first one cancels.
    exponent = 1.438776877e7 / (wavelengths * np.clip(temperature, 800.0, 12000.0))
    spectrum = wavelengths**-5.0 / np.expm1(exponent)
    xyz = np.array([(spectrum * curve).sum() for curve in (x, y, z)])
    to_rgb = np.array(
        [
            [3.2404542, -1.5371385, -0.4985314],
            [-0.9692660, 1.8760108, 0.0415560],
            [0.0556434, -0.2040259, 1.0572252],
        ]
    )
    r, g, b = to_rgb @ (xyz / xyz[1])
    return float(r), float(g), float(b)
