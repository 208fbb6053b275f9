"""Where in and around its pixel a sample lies: the film's filter, by importance sampling.

Every sample has weight 1 and belongs to one pixel; how often a place is chosen is what the filter weighs it with. On each axis
a number u in [0, 1) becomes the place up to which the filter's mass is u: numbers that are spread evenly become places that are
spread evenly over the mass.

BOX is one pixel wide, whatever its width, as in Cycles. BLACKMAN_HARRIS of width f reaches f pixels to either side of the
centre: 0.35875 − 0.48829 cos θ + 0.14128 cos 2θ − 0.01168 cos 3θ, θ = π (x/f + 1) (Harris, Proceedings of the IEEE 66, 1978).

Its distribution is inverted exactly at 2¹⁶ + 1 numbers and linearly between them. Every such step has its exact mass, and
the filter is symmetric; only how the 2⁻¹⁶ of a step is spread over it differs, altogether by 3.6e-5 of the mass (the
total variation), nearly all of it in the outermost steps. No pixel is off by more than that part of its surroundings' contrast.

Cycles' table (intern/cycles/scene/film.cpp, 1,024 entries, of which the middle is the 511th of 0 … 1,023) has three faults.
u = ½, its first sample, misses the centre by half a step: 0.25/511 px for BOX, 3.5e-4 f for BLACKMAN_HARRIS. The last entry
is left at 0, so that one sample of 1,023 is spread evenly from the pixel's lower left corner to the filter's end: that makes
BOX exact, and moves the mean of BLACKMAN_HARRIS by (f/2 − ¼)/1,023 px, 4.9e-4 px at f = 1.5. And its outer steps are long.
An edge's pixel is off by no more than 5.8e-4 of the contrast for it (f = 1.5, edges at any angle), one of a smooth surface by
4.9e-4 px times the slope. The tracer's own noise of such a pixel, 0.35 N^−3/4 of the contrast, is larger up to 5,000 samples.

Rejected: weighting samples of several pixels (splatting), which makes neighbours' errors depend on one another and their
variance unknown; Newton's method on each number, whose sines cost ten times as much; and Cycles' table.
"""

import functools

import numpy as np

from ..arrays import Floats, gather
from ..compiled.standing import or_compiled
from ..scene.film import Film

_COEFFICIENTS = (0.35875, 0.48829, 0.14128, 0.01168)
_STEPS = 1 << 16


def offsets(film: Film, u: Floats) -> Floats:
    """(2, n) float64, pixels from a pixel's lower left corner: where samples lie, ½ being its centre.

    u : (2, n), in [0, 1).
    """
    if film.filter == "BOX":
        return u
    return spread(u, film.filter_width)


@or_compiled
def spread(u: Floats, width: float) -> Floats:
    """As `offsets`, by the Blackman-Harris filter of a width."""
    scaled = u * _STEPS
    step = scaled.astype(np.intp)
    scaled -= step
    places = inverse()
    begin = gather(places, step)
    step += 1
    offset = gather(places, step)
    offset -= begin
    offset *= scaled
    offset += begin
    offset *= width
    offset += 0.5
    return offset


def density(x: Floats) -> Floats:
    """The Blackman-Harris filter at x, in widths from the centre, −1 to 1; 1 at the centre."""
    theta = np.pi * (x + 1.0)
    a, b, c, d = _COEFFICIENTS
    return a - b * np.cos(theta) + c * np.cos(2 * theta) - d * np.cos(3 * theta)


def mass(x: Floats) -> Floats:
    """The part of the Blackman-Harris filter's mass that lies below x, in widths from the centre, −1 to 1."""
    theta = np.pi * (x + 1.0)
    a, b, c, d = _COEFFICIENTS
    return (a * theta - b * np.sin(theta) + c / 2 * np.sin(2 * theta) - d / 3 * np.sin(3 * theta)) / (2 * np.pi * a)


def reach(film: Film) -> float:
    """How far from a pixel's centre its samples lie at most, on each axis, in pixels."""
    return 0.5 if film.filter == "BOX" else film.filter_width


def beyond(film: Film, distance: float) -> float:
    """The part of the film's filter that lies beyond so many pixels to one side of the centre."""
    if film.filter == "BOX":
        return max(0.5 - distance, 0.0)
    return float(mass(-min(distance / film.filter_width, 1.0)))


def variance(film: Film) -> float:
    """Of where samples lie, on each axis, in pixels²: of a sum of cosines by its integral with x²."""
    if film.filter == "BOX":
        return 1 / 12
    a, *others = _COEFFICIENTS
    waves = sum((-1) ** k * value / k**2 for k, value in enumerate(others, start=1))
    return film.filter_width**2 * (1 / 3 + 2 / np.pi**2 * waves / a)


@functools.cache
def inverse() -> Floats:
    """Where each step of the mass begins, and the last one ends, in widths."""
    u = np.arange(_STEPS // 2 + 1) / _STEPS
    x = np.linspace(-1.0, 0.0, 8193)
    x = np.interp(u, mass(x), x)
    for _ in range(4):  # Newton's, from a start that is good to four digits
        x = np.clip(x - (mass(x) - u) * 2 * _COEFFICIENTS[0] / density(x), -1.0, 0.0)
    x[0], x[-1] = -1.0, 0.0
    return np.concatenate([x, -x[-2::-1]])
