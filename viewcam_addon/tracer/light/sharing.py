"""Light that changes slowly, shared among neighbouring pixels: each becomes the mean of the largest window that noise allows.

A window is a square round the pixel, of radius 1, 3, 7 or 15, all of it interior: symmetric, so that whatever changes
linearly cancels, and never across an edge. Radii grow while a mean agrees with the one before it within what noise explains
(after Lepski 1990; in pictures Katkovnik 1999, Kervrann and Boulanger 2006; in rendering Rousselle and others 2011, who
compare two filters at a time as well, but by their estimated error). Noise halves from one to the next, so that steps too
small to be told from it add up to no more than twice the first: a penumbra or a contact shadow stays as sharp as noise shows it.

Weights are tents rather than boxes: a tent is the one before it, [1 2 1] with wider gaps, four sums in all, while boxes of
every radius need twice as many sums or running totals, which a single pixel as bright as the sun spoils to the end of the
picture. At the same width a tent keeps a third more noise, and half the bias of what is curved.

Noise of few samples is told badly by each pixel, and best where it is least: a pixel that by chance met the lamp with all its
samples claims none. So variances are pooled over a window before they judge anything.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats

_LEVELS = 4
_POOLED = 3
# How many standard errors of the smaller window the larger one may be off. A single pixel outside them stays as it is, with all
# its noise, so that they must be many there.
_PIXEL, _WINDOW = 4.0, 2.5
# Of the tolerance: windows do not grow where less noise than that is left.
_ENOUGH = 0.25


def shared(light: Floats, variance: Floats, interior: NDArray[np.bool_], tolerance: float) -> tuple[Floats, Floats]:
    """Light with less noise, and the variance that is left.

    light : (c, h, w) means of pixels, of the light that falls on surfaces. variance : (h, w), estimates of its variance, mean
    over the channels; where it is not finite, nothing is shared. interior : (h, w), no edge of geometry, material or sharp
    shadow is near. tolerance : the standard error that is wanted.

    Returns (c, h, w) and (h, w): the pooled variance of what is shared, and the square of the last step as far as noise does
    not explain it, for the bias. Pixels that are not interior are returned as they are.
    """
    usable = interior & np.isfinite(variance)
    pooled = _pooled(variance, usable)
    result, left = light.copy(), np.where(usable, pooled, variance)
    planes = np.where(usable, np.concatenate([light, pooled[None]]), 0.0)
    enough = (_ENOUGH * tolerance) ** 2
    growing = usable & (pooled > enough)
    mean, noise, margin, errors = planes[:-1], pooled, 0, _PIXEL
    for (radius, weight, sums), (_, _, whole) in zip(_tents(planes, np.add), _tents(usable, np.logical_and), strict=True):
        step, margin = radius - margin, radius
        before, noise_before = _inner(mean, step), _inner(noise, step)
        sums *= weight
        mean, noise = sums[:-1], sums[-1] * _share(radius)
        moved = mean - before
        moved = np.einsum("chw,chw->hw", moved, moved) / len(mean)
        grown = _inner(growing, step) & whole & (moved <= errors**2 * noise_before)
        if not grown.any():
            break
        np.copyto(_inner(result, radius), mean, where=grown)
        np.copyto(_inner(left, radius), noise + np.maximum(moved - noise_before + noise, 0.0), where=grown)
        growing, errors = grown & (noise > enough), _WINDOW
    return result, left


def _pooled(variance: Floats, usable: NDArray[np.bool_]) -> Floats:
    """The mean of the usable variances round each pixel, (h, w)."""
    planes = np.stack([np.where(usable, variance, 0.0), usable])
    padded = np.pad(planes, ((0, 0), (_POOLED, _POOLED), (_POOLED, _POOLED)))
    total, weight = next(sums for radius, _, sums in _tents(padded, np.add) if radius == _POOLED)
    return total / np.maximum(weight, 1.0)


def _share(radius: int) -> float:
    """The sum of the squares of a tent's weights: what is left of the variance."""
    half = radius + 1
    return ((2 * half**2 + 1) / (3 * half**3)) ** 2


def _tents(planes: NDArray, join: np.ufunc) -> Iterator[tuple[int, float, NDArray]]:
    """Radius, weight and sums of all whole windows, (…, h − 2 r, w − 2 r); the mean is their product."""
    radius, gap, weight = 0, 1, 1.0
    for _ in range(_LEVELS):
        if min(planes.shape[-2:]) <= 2 * gap:
            return
        radius, weight = radius + gap, weight / 16
        for _ in range(2):
            planes = join(planes[..., :-gap], planes[..., gap:])
            planes = join(planes[..., :-gap, :], planes[..., gap:, :])
        yield radius, weight, planes
        gap *= 2


def _inner(planes: NDArray, margin: int) -> NDArray:
    """The last two axes without a margin."""
    return planes[..., margin : planes.shape[-2] - margin, margin : planes.shape[-1] - margin]
