"""Light that changes slowly, shared among neighbouring pixels: each becomes the mean of the largest window that noise allows.

A window grows four times, to radius 1, 3, 7 and 15, along columns and then along rows: a pixel takes a quarter of those one gap
to either side, which have grown as often, and keeps a half. It takes only pairs that mirror one another, so that whatever
changes linearly cancels, and only if all is interior on the way to them, so that no edge is crossed: beside an edge windows are
thin rather than small. In the open they become tents. Boxes need twice as many sums, or running totals, which a single pixel as
bright as the sun spoils to the end of the picture.

Windows grow while what a step changes is what noise explains (after Lepski 1990; in pictures Katkovnik 1999, Kervrann and
Boulanger 2006). A single pixel can not tell noise from a bend of the same size, and one that strays far, as one in a hundred
does, would keep all its noise: so what steps change is added up round each pixel, as Rousselle and others (2012) do with the
errors of their filters. Noise halves with every step, so that bends too slight to be told from it add up to no more than twice
the first: penumbrae and contact shadows stay as sharp as noise shows them.

How noisy pixels are is told by their samples, and too badly: a few that by chance all met the lamp claim no noise, and many
that share their pixel out among them (sampler.py) two to ten times too much. How neighbours bend (Immerkær 1996) tells it as
long as pixels are independent and the light is smooth. Of both, pooled, the smaller one counts.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Float32s, Floats

# The gap of each growth, and what it leaves of the variance along its axis: that of a tent over that of one half as wide.
_GROWTHS = ((1, 0.375), (2, 0.4583), (4, 0.4886), (8, 0.4971))
# The square of a step may be so many times the variance that it takes away; noise alone makes it 0.6 to 0.75 times.
_EXPLAINED = 2.0
# A pixel so many standard errors beside its neighbours is no noise, whatever is round it.
_STRAY = 5.0
# The radius over which variances are pooled. Steps are over twice that of the window.
_POOL = 3
# Windows do not grow where this part of the tolerance is all the noise that is left.
_ENOUGH = 0.25


def shared(light: Floats, variance: Floats, interior: NDArray[np.bool_], tolerance: float) -> tuple[Floats, Floats]:
    """Light with less noise, and the variance that is left.

    light : (c, h, w) means of pixels, of the light that falls on surfaces, independent of one another. variance : (h, w), as
    its samples estimate it, the mean over the channels; not finite where they can not. interior : (h, w), no edge of geometry,
    material or sharp shadow is near. tolerance : the standard error that is wanted.

    Returns (c, h, w) and (h, w): the variance of the means, and the square of the last step as far as noise does not explain
    it, for the bias. Pixels that are not interior are returned as they are.
    """
    # Numbers beyond float32 are shared with no one: nothing that is compared with them holds.
    with np.errstate(over="ignore", invalid="ignore"):
        inside = np.where(interior, light, 0.0).astype(np.float32)
        noise, pooled = _noise(inside, variance, interior)
        added, left = _grown(np.concatenate([inside, noise[None]]), pooled, interior, (_ENOUGH * tolerance) ** 2)
    return light + added, np.where(interior, left, variance)


def _grown(planes: Float32s, known: Float32s, interior: NDArray[np.bool_], enough: float) -> tuple[Float32s, Float32s]:
    """What windows add to the light, and the variance that is left.

    planes : (c + 1, h, w), light and its variance, changed in place. known : (h, w), the variance pooled. enough : of variance.
    """
    added, left = np.zeros_like(planes[:-1]), known
    growing = interior & (known > enough) & (known < np.inf)
    # Whether all is interior from a pixel to that one gap on.
    down, across = interior[:-1] & interior[1:], interior[:, :-1] & interior[:, 1:]
    for gap, kept in _GROWTHS:
        if not growing.any():
            break
        # From one gap before a pixel to one behind: what it needs now, and at the next growth the one that begins there.
        down, across = down[:-gap] & down[gap:], across[:, :-gap] & across[:, gap:]
        before, grown = planes.copy(), np.zeros_like(interior)
        _grow(planes, down, gap, kept)
        _grow(planes.swapaxes(1, 2), across.T, gap, kept)
        grown[gap:-gap] |= down
        grown[:, gap:-gap] |= across
        step = planes[:-1] - before[:-1]
        square, taken = _square(step), before[-1] - planes[-1]
        growing &= grown & (square <= _STRAY**2 * known)
        growing &= _around(np.where(growing, square - _EXPLAINED * taken, 0.0), 4 * gap - 1) <= 0.0
        known = planes[-1].copy()
        step *= growing
        added += step
        left = np.where(growing, known + np.maximum(square - taken, 0.0), left)
        growing &= known > enough
    return added, left


def _grow(planes: Float32s, reached: NDArray[np.bool_], gap: int, kept: float) -> None:
    """Let windows grow along the columns, in place.

    planes : (c + 1, h, w), light and its variance. reached : (h − 2 gap, w), which pixels can.
    """
    middle = planes[:, gap:-gap]
    bend = planes[:, : -2 * gap] + planes[:, 2 * gap :]
    bend -= middle
    bend -= middle
    bend *= reached * np.float32(0.25)
    # Of a variance the squares of the weights count, which are as 1 to 4 to 1.
    bend[-1] *= np.float32(2 / 3)
    middle += bend
    middle[-1] *= np.where(reached, np.float32(kept), np.float32(1.0))


def _noise(light: Float32s, variance: Floats, interior: NDArray[np.bool_]) -> tuple[Float32s, Float32s]:
    """What is known of each pixel's variance, (h, w), and the same pooled, which is better known and may be infinite."""
    told = interior & np.isfinite(variance)
    smooth, bent = np.zeros_like(interior), np.zeros(interior.shape, np.float32)
    if min(interior.shape) > 2:
        rows = interior[:-2] & interior[1:-1] & interior[2:]
        smooth[1:-1, 1:-1] = rows[:, :-2] & rows[:, 1:-1] & rows[:, 2:]
        # 36 is the sum of the squares of (1, −2, 1) × (1, −2, 1).
        bent[1:-1, 1:-1] = _square(np.diff(np.diff(light, n=2, axis=1), n=2, axis=2)) / 36
    own = np.where(told, variance, 0.0).astype(np.float32)
    total, number, bends, places = _around(np.stack([own, told, np.where(smooth, bent, 0.0), smooth]), _POOL)
    by_samples = np.where(number > 0, total / np.maximum(number, 1.0), np.inf)
    by_neighbours = np.where(2 * places > number, bends / np.maximum(places, 1.0), np.inf)
    pooled = np.minimum(by_samples, by_neighbours)
    return np.where(told, own * np.where(total > 0, pooled / by_samples, 0.0), bent), pooled


def _square(values: Float32s) -> Float32s:
    """The mean of the squares over the channels."""
    return np.einsum("chw,chw->hw", values, values) / len(values)


def _around(planes: Float32s, radius: int) -> Float32s:
    """The sums of (…, h, w) round each pixel, weighted by a tent. radius : 2ⁿ − 1."""
    margins = [(0, 0)] * (planes.ndim - 2) + [(radius, radius)] * 2
    sums, gap = np.pad(planes, margins), 1
    while gap <= radius:
        for _ in range(2):
            sums = sums[..., :-gap, :] + sums[..., gap:, :]
            sums = sums[..., :-gap] + sums[..., gap:]
        gap *= 2
    return sums
