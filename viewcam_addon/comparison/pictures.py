"""Pixels for the report: shaded passes, errors on a color scale, PNG data.

Pictures here are (height, width, 3 or 4) uint8 with rows from the top, as PNG and screens have them, or (height, width)
levels of the color scale.

The color scale is computed in Oklab rather than copied as a table: lightness rises in even steps, so that equal steps
of the error look equal, in print and to the color-blind too.
"""

import base64

import numpy as np
from numpy.typing import NDArray

from ..image import BACKGROUND_DEPTH, Image
from ..png import encoded
from .mismatches import Mismatches

Picture = NDArray[np.uint8]

# A wider picture is reduced in the report: no screen shows more of it.
_WIDEST = 1920

LEVELS = 64
"""Colors of the scale: steps too fine to see, and a third of the bytes of 256."""

# Oklab to linear sRGB (B. Ottosson, A perceptual color space for image processing, 2020).
_OKLAB_TO_CONES = np.array(
    [[1.0, 0.3963377774, 0.2158037573], [1.0, -0.1055613458, -0.0638541728], [1.0, -0.0894841775, -1.2914855480]]
)
_CONES_TO_RGB = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)


def png_uri(picture: Picture, scale: NDArray[np.uint8] | None = None) -> str:
    """The picture as a data: URI of a PNG."""
    return "data:image/png;base64," + base64.b64encode(png(picture, scale)).decode("ascii")


def png(picture: Picture, scale: NDArray[np.uint8] | None = None) -> bytes:
    """The picture as a PNG file; a (height, width) one holds levels of a scale (color_scale by default), 0 for none."""
    if picture.ndim == 3:
        return encoded(picture)
    return encoded(picture, b"\0\0\0" + (color_scale() if scale is None else scale).tobytes())


def shaded(image: Image) -> Picture:
    """Depth (and, where they are there, Normal and Object Index) as a clay model: a key light, a sky, darker where one thing
    stands behind another."""
    depth = image["Depth"][..., 0].astype(np.float64)
    hit = depth < BACKGROUND_DEPTH
    tint = _tints(image.passes.get("Object Index", np.zeros((*depth.shape, 1), np.float32))[..., 0])
    light = np.ones(depth.shape)
    if "Normal" in image.passes:
        normal = np.nan_to_num(image["Normal"].astype(np.float64))
        key = np.array([-0.45, -0.55, 0.70])
        light = 0.16 + 0.28 * (normal[..., 2] + 1) / 2 + 0.62 * np.maximum(normal @ (key / np.linalg.norm(key)), 0.0)
    linear = tint * (light * _depth_cue(depth, hit))[..., None]
    sky = np.linspace(0.70, 0.50, depth.shape[0])[:, None, None] * np.array([0.88, 0.94, 1.0])
    return _to_screen(np.where(hit[..., None], linear, sky))


def brightness(color: NDArray) -> float:
    """The value that is shown just below white: the 98th percentile of the largest of each pixel's channels."""
    return max(float(np.percentile(np.nan_to_num(color.astype(np.float64)).max(axis=-1), 98)), 1e-12)


def on_screen(color: NDArray, bright: float) -> NDArray[np.float64]:
    """Light (height, width, 3) as sRGB from 0 to 1, `bright` just below white."""
    return _encoded(_exposed(color, bright))


def tone_mapped(color: NDArray, bright: float | None = None) -> Picture:
    """Light (height, width, 3), rows from the bottom, as a screen shows it. bright : its own `brightness` by default."""
    return _to_screen(_exposed(color, bright or brightness(color)))


def _exposed(color: NDArray, bright: float) -> NDArray[np.float64]:
    return np.clip(np.nan_to_num(color.astype(np.float64)) / bright * 0.9, 0.0, 1.0)


def on_scale(errors: NDArray[np.float32], low: float, high: float) -> Picture:
    """Errors as levels of the color scale, logarithmic from `low` to `high`.

    errors : (height, width), rows from the bottom. Of pixels that are reduced to one the largest error shows.

    Returns (height, width) uint8, rows from the top: 1 to LEVELS, and 0, see-through, where nothing was compared.
    """
    step = _step(errors.shape[1])
    height, width = (size // step * step for size in errors.shape)
    blocks = errors[:height, :width].reshape(height // step, step, width // step, step).transpose(0, 2, 1, 3)
    worst = np.where(np.isnan(blocks), -1.0, blocks).max(axis=(2, 3))[::-1]
    position = np.log10(np.clip(worst, low, high) / low) / np.log10(high / low)
    return np.where(worst < 0, 0, 1 + np.round(position * (LEVELS - 1))).astype(np.uint8)


def signed(values: NDArray[np.float32], limit: float) -> Picture:
    """Values as levels of the signed scale, linear from −limit to limit; as `on_scale`, the farthest from 0 shows."""
    step = _step(values.shape[1])
    height, width = (size // step * step for size in values.shape)
    blocks = values[:height, :width].reshape(height // step, step, width // step, step).transpose(0, 2, 1, 3)
    blocks = blocks.reshape(height // step, width // step, step * step)
    farthest = np.take_along_axis(blocks, np.abs(np.nan_to_num(blocks)).argmax(axis=-1)[..., None], axis=-1)[::-1, :, 0]
    position = (np.clip(np.nan_to_num(farthest) / limit, -1.0, 1.0) + 1.0) / 2.0
    return np.where(np.isnan(farthest), 0, 1 + np.round(position * (LEVELS - 1))).astype(np.uint8)


def stain(mismatches: Mismatches, size: tuple[int, int]) -> Picture:
    """Every mismatch as a colored pixel, for pictures that have more of them than marks can show: red where unexplained."""
    step = _step(size[0])
    picture = np.zeros((-(-size[1] // step), -(-size[0] // step), 4), np.uint8)
    for chosen, color in ((mismatches.explained, (20, 184, 200, 200)), (~mismatches.explained, (255, 59, 107, 170))):
        picture[(size[1] - 1 - mismatches.rows[chosen]) // step, mismatches.columns[chosen] // step] = color
    return picture


def color_scale() -> NDArray[np.uint8]:
    """(LEVELS, 3) uint8 sRGB, from near black over violet and orange to a light yellow; lightness rises in even steps."""
    t = np.linspace(0.0, 1.0, LEVELS)
    hue = np.radians(280.0 + 185.0 * t)
    chroma = 0.16 * np.sin(np.pi * np.minimum(t * 0.9 + 0.08, 1.0)) ** 0.7
    return np.round(255 * _encoded(_in_gamut(0.14 + 0.82 * t, chroma, hue))).astype(np.uint8)


def signed_scale() -> NDArray[np.uint8]:
    """(LEVELS, 3) uint8 sRGB for signed values: blue below 0, orange above, near black at 0; lightness tells the size."""
    t = np.linspace(-1.0, 1.0, LEVELS)
    hue = np.radians(np.where(t < 0, 250.0, 62.0))
    return np.round(255 * _encoded(_in_gamut(0.16 + 0.72 * np.abs(t), 0.15 * np.abs(t) ** 0.6, hue))).astype(np.uint8)


def crop(picture: Picture, full_size: tuple[int, int], column: int, row: int, size: int = 15) -> Picture:
    """The surroundings of one pixel of the full picture, (size, size); column and row from its lower left corner."""
    step = _step(full_size[0])
    half = size // 2
    padded = np.pad(picture, ((half, half), (half, half), (0, 0)), mode="edge")
    top = min((full_size[1] - 1 - row) // step, picture.shape[0] - 1)
    left = min(column // step, picture.shape[1] - 1)
    return padded[top : top + size, left : left + size]


def reduced(linear: NDArray) -> NDArray:
    """Light, rows from the bottom, with its rows from the top, and no wider than a screen; what is no number is black."""
    step = _step(linear.shape[1])
    return np.nan_to_num(linear[::-1][::step, ::step], posinf=0.0, neginf=0.0)


def _step(width: int) -> int:
    return -(-width // _WIDEST)


def _tints(index: NDArray[np.float32]) -> NDArray[np.float64]:
    """(height, width, 3) linear: a pale color for each object index, neighboring numbers far apart in hue."""
    hue = 2.0 * np.pi * np.modf(index * 0.6180339887)[0] + 0.7
    return _in_gamut(np.full(index.shape, 0.86), np.full(index.shape, 0.055), hue)


def _depth_cue(depth: NDArray[np.float64], hit: NDArray[np.bool_]) -> NDArray[np.float64]:
    """(height, width) factor: darker where a pixel lies behind its surroundings (unsharp masking of the depth buffer)."""
    if not hit.any():
        return np.ones(depth.shape)
    nearness = np.zeros(depth.shape)
    nearness[hit] = np.median(depth[hit]) / np.maximum(depth[hit], np.finfo(float).tiny)
    nearness = np.minimum(nearness, 4.0)
    radius = max(depth.shape[1] // 60, 1)
    behind = np.maximum(_blurred(nearness, radius) - nearness, 0.0)
    return 1.0 - np.minimum(1.6 * behind, 0.45)


def _blurred(values: NDArray[np.float64], radius: int) -> NDArray[np.float64]:
    for axis in (0, 1):
        padded = np.pad(values, [(radius + 1, radius) if i == axis else (0, 0) for i in (0, 1)], mode="edge")
        summed = np.cumsum(padded, axis=axis)
        span, size = 2 * radius + 1, values.shape[axis]
        values = (np.take(summed, np.arange(span, span + size), axis) - np.take(summed, np.arange(size), axis)) / span
    return values


def _in_gamut(lightness: NDArray, chroma: NDArray, hue: NDArray) -> NDArray[np.float64]:
    """Oklch to linear sRGB; where a color does not exist on screens, its chroma is reduced until it does."""
    for _ in range(12):
        lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=-1)
        linear = (lab @ _OKLAB_TO_CONES.T) ** 3 @ _CONES_TO_RGB.T
        outside = ((linear < 0.0) | (linear > 1.0)).any(axis=-1)
        if not outside.any():
            break
        chroma = np.where(outside, chroma * 0.85, chroma)
    return np.clip(linear, 0.0, 1.0)


def _to_screen(linear: NDArray[np.float64]) -> Picture:
    """Linear light, rows from the bottom, to a picture that is no wider than a screen."""
    return np.round(255 * _encoded(np.clip(reduced(linear), 0.0, 1.0))).astype(np.uint8)


def _encoded(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
