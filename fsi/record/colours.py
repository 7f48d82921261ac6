"""A perceptually even colour map, computed."""

from __future__ import annotations

import numpy as np

# OKLab to linear sRGB (B. Ottosson, "A perceptual color space for image processing", 2020).
_LMS = np.array([[1, 0.3963377774, 0.2158037573], [1, -0.1055613458, -0.0638541728], [1, -0.0894841775, -1.2914855480]])
_RGB = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)


def colour_map(size: int = 256) -> np.ndarray:
    """Colours (size, 3) uint8 from dark blue over green to light yellow, even in lightness and hue."""
    s = np.linspace(0, 1, size)
    lightness = 0.30 + 0.62 * s
    hue = np.radians(275 - 170 * s)
    chroma = 0.13 + 0.02 * np.sin(np.pi * s)
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=1)
    linear = np.clip((lab @ _LMS.T) ** 3 @ _RGB.T, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)


def packed(colours: np.ndarray) -> np.ndarray:
    """Colours (n, 3) uint8 as (n,) uint32 of the form 0xRRGGBBAA, opaque."""
    r, g, b = colours.astype(np.uint32).T
    return (r << 24) | (g << 16) | (b << 8) | 0xFF
