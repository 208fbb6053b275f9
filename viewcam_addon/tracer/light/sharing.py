"""Light that changes slowly, shared among neighbouring pixels: each becomes the mean of the largest window that noise allows.

A window grows four times, to radius 1, 3, 7 and 15, along columns and then along rows: a pixel takes a quarter of those one gap
to either side, which have grown as often, and keeps a half. It takes only pairs that mirror one another, so that whatever
changes linearly cancels, and only if all is interior on the way to them, so that no edge is crossed: beside an edge windows are
thin rather than small. In the open they become tents. Boxes need twice as many sums, or running totals, which a single pixel as
bright as the sun spoils to the end of the picture.

Windows grow while what a step changes is what noise explains (after Lepski 1990; in pictures Katkovnik 1999, Kervrann and
Boulanger 2006). A single pixel can not tell noise from a bend of the same size, and one that strays far, as one in a hundred
does, would keep all its noise: so what steps change is added up round each pixel, as Rousselle and others (2012) do with the
errors of their filters. Penumbrae and contact shadows stay as sharp as noise shows them.

What bends less than that is flattened still: too little to be seen at a pixel, and yet several standard errors of the mean of
a whole wall. So what windows have added is spread over the largest of them, and taken back (twicing, Tukey 1977): the sums
over tiles of 32 × 32 pixels were off by 0.7 standard errors, 3 at most, and are by 0.25, and 1.5 where fireflies are.

How noisy pixels are is told by their samples, and too badly: a few that by chance all met the lamp claim no noise, and many
that share their pixel out among them (sampler.py) two to ten times too much. How neighbours bend (Immerkær 1996) tells it as
long as pixels are independent and the light is smooth. Of both, pooled, the smaller one counts.

Measured at 320 × 180, root mean square errors of interior pixels before and after: studio still at `direct`, 4 samples, 0.084
and 0.036; 16, 0.032 and 0.020; 64, 0.0133 and 0.0116, most of it in the shadows of leaves; Cornell box, 4 samples, 0.063 and
0.008; 64, 0.0073 and 0.0024; at `path`, 16 samples, 0.17 and 0.05, of which 0.03 are the reference's own.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..arrays import Float32s, Floats

Booleans = NDArray[np.bool_]

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
# Brighter light is not shared: float32 could not hold sums of its squares.
_LARGEST = 1e15


def shared(light: Floats, variance: Floats, interior: Booleans, tolerance: float) -> tuple[Floats, Floats]:
    """Light with less noise, and the variance that is left.

    light : (c, h, w) means of pixels, of the light that falls on surfaces, independent of one another. variance : (h, w), as
    its samples estimate it, the mean over the channels; not finite where they can not. interior : (h, w), no edge of geometry,
    material or sharp shadow is near. tolerance : the standard error that is wanted.

    Returns (c, h, w) and (h, w): the variance of the means, and the square of the last step as far as noise does not explain
    it, for the bias; infinite where neither samples nor neighbours tell it. Pixels that are not interior are returned as they
    are.
    """
    interior = interior & (np.abs(light).max(axis=0) < _LARGEST)
    inside = np.where(interior, light, 0.0).astype(np.float32)
    noise, pooled = _noise(inside, variance, interior)
    added, left = _added(inside, noise, pooled, interior, (_ENOUGH * tolerance) ** 2)
    return light + added, np.where(interior, left, variance)


def _added(light: Float32s, noise: Float32s, pooled: Float32s, interior: Booleans, enough: float) -> tuple[Float32s, Float32s]:
    """What windows add to the light, and the variance that is left.

    light : (c, h, w), 0 where it is not interior. noise, pooled : (h, w), what _noise tells. Light and noise change in place.
    enough : of variance.
    """
    added, left = np.zeros_like(light), pooled
    growing, grown = interior & (pooled > enough) & (pooled < np.inf), np.zeros_like(interior)
    growths = []
    for gap, kept, down, across in _growths(interior):
        if not growing.any():
            break
        growths.append((gap, down, across))
        before, known = light.copy(), noise.copy()
        reached = _grow(light, gap, down, across)
        # Of a variance the squares of the weights count, which are as 1 to 4 to 1.
        _grow(noise[None], gap, down, across, 1 / 6, kept)
        step, taken = light - before, known - noise
        square = _square(step)
        growing &= reached & (square <= _STRAY**2 * (pooled if gap == 1 else known))
        growing &= _around(np.where(growing, square - _EXPLAINED * taken, 0.0), 4 * gap - 1) <= 0.0
        grown |= growing
        step *= growing
        added += step
        left = np.where(growing, noise + np.maximum(square - taken, 0.0), left)
        growing &= noise > enough
    spread = _spread(added.copy(), growths) * grown
    return added - spread, np.where(grown, np.minimum(left + noise, pooled), left)


def _spread(light: Float32s, growths: list[tuple[int, Booleans, Booleans]]) -> Float32s:
    """Light in windows that have all grown wherever they can, as far as any has."""
    for growth in growths:
        _grow(light, *growth)
    return light


def _growths(interior: Booleans) -> Iterator[tuple[int, float, Booleans, Booleans]]:
    """Gap, what is left of the variance along an axis, and where all is interior from one gap before a pixel to one behind.

    The latter twice: (h − 2 gap, w) along columns, (h, w − 2 gap) along rows.
    """
    down, across = interior[:-1] & interior[1:], interior[:, :-1] & interior[:, 1:]
    for gap, kept in _GROWTHS:
        # Where all is interior from a pixel to one gap on, then to two.
        down, across = down[:-gap] & down[gap:], across[:, :-gap] & across[:, gap:]
        yield gap, kept, down, across


def _grow(planes: Float32s, gap: int, down: Booleans, across: Booleans, side: float = 0.25, kept: float = 1.0) -> Booleans:
    """Let windows grow along columns and along rows, in place; (h, w), which do.

    planes : (c, h, w). gap, down, across : see _growths. side : the weight of a pixel one gap away. kept : of the sum.
    """
    grown = np.zeros(planes.shape[1:], bool)
    for turned, reached, which in ((planes, down, grown), (planes.swapaxes(1, 2), across.T, grown.T)):
        which[gap:-gap] |= reached
        middle = turned[:, gap:-gap]
        bend = turned[:, : -2 * gap] + turned[:, 2 * gap :]
        bend -= middle
        bend -= middle
        bend *= reached * np.float32(side)
        middle += bend
        if kept != 1.0:
            middle *= np.where(reached, np.float32(kept), np.float32(1.0))
    return grown


def _noise(light: Float32s, variance: Floats, interior: Booleans) -> tuple[Float32s, Float32s]:
    """What is known of each pixel's variance, (h, w), and the same pooled, which is better known and may be infinite."""
    told = interior & (variance < _LARGEST**2)
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
    with np.errstate(invalid="ignore"):
        return np.where(told, np.where(own > 0, own * (pooled / by_samples), 0.0), bent), pooled


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
