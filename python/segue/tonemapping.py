"""From linear colours to those that a screen shows."""

from __future__ import annotations

import numpy as np

#: What is done to linear colours on their way to a PNG.
TONEMAPPING = "Khronos PBR Neutral, then the sRGB curve"


def neutral(color: np.ndarray) -> np.ndarray:
    """The Khronos PBR Neutral tone mapper (2024 specification), linear Rec.709 to linear [0, 1].

    Colours up to about 0.8 stay as they are but for the 4 % that Fresnel reflection adds; above,
    the peak is compressed and the colour is drawn towards white.
    """
    start, desaturation = 0.8 - 0.04, 0.15
    color = np.maximum(np.nan_to_num(color, nan=0.0, posinf=1e6), 0.0)
    low = color.min(axis=-1, keepdims=True)
    offset = np.where(low < 0.08, low - 6.25 * low**2, 0.04)
    color = color - offset
    peak = color.max(axis=-1, keepdims=True)
    span = 1.0 - start
    compressed = 1.0 - span**2 / (np.maximum(peak, start) + span - start)
    scaled = color * compressed / np.maximum(peak, 1e-12)
    mix = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0)
    return np.where(peak < start, color, scaled * (1 - mix) + compressed * mix)


def to_srgb(color: np.ndarray) -> np.ndarray:
    """Linear [0, 1] to 8-bit sRGB (IEC 61966-2-1)."""
    color = np.clip(color, 0.0, 1.0)
    encoded = np.where(color <= 0.0031308, 12.92 * color, 1.055 * color ** (1 / 2.4) - 0.055)
    return np.round(encoded * 255.0).astype(np.uint8)
