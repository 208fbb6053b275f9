"""Hypothesis tests of noisy light: is a difference more than chance, in each pixel, each tile, along contours, in the whole?

The noise that a difference is held against is the larger of what a pixel or tile shows itself and what its 3 × 3 neighborhood
shows in the mean. By itself, a place that rare light has missed so far looks both darker and quieter than it is, and an edge
that crosses the corner of a pixel may have been missed by all of its samples. Where neighbors share their light, a tile shows
less noise than its sum has: then what the samples of its pixels tell counts as well. Only of pixels that show what shines,
alike in all samples of both sides, nothing was missed: there a lamp of a few pixels is compared as where there is no noise.

What is within rounding is no difference: a pixel's is taken beyond the largest tolerance, a tile's sum beyond that of the 99th
percentile of each pixel, since a mean of rounding errors can't exceed what nearly all of them stay below. Nor is what Cycles'
table of the Blackman-Harris filter does (core/film/filter.h): it shifts the picture by 4.9e-4 px to the right and up, and
changes a pixel by 0.21 % of the contrast around it at most. A shift changes only what passes a tile's border, so that its
effect is the sum of the slopes, in which noise cancels.

Contours: what blurs or sharpens a picture, as another filter does, takes as much from one side of each contour as it gives to
the other, and no tile tells. So the differences are summed with the picture's bend as weights: the mean of a pixel's four
neighbors less that of the eight a knight's move away, minus the Laplacian. All of these are squares of the other color of a
chessboard, so that a pixel's own noise is not in its weight, and given the black pixels the white ones' terms are independent.
The two colors share noise among them: the mean of their standard errors is beyond a limit only where one of them is.
Where neighbors share their light even that does not hold, and nothing is asked.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from . import noise, tolerances
from .mismatches import contrast
from .noise_free import Allowance
from .sides import CHANNEL_NAMES, Sides
from .tolerances import Array

PIXELS, BLOCKS, CONTOURS, WHOLE = 1, 32, -1, 0
SIZES = (PIXELS, 8, BLOCKS, CONTOURS, WHOLE)
"""Sides of the tiles, in pixels; 0 is one tile over all, and so is −1, of what is along contours."""

_NEARLY_ALL = tolerances.ROUNDINGS[tolerances.PERCENTILES.index(99.0)]
# The errors of the default filter, 1.5 px wide; twice the shift, for what the table does beside shifting.
_FILTER_SHIFT, _FILTER_CONTRAST = 2 * 4.9e-4, 0.0021
# The power to find the bias that is told: 99 cases in 100, by a normal distribution, since this tail is not far out.
POWER = 0.99
_POWER_ERRORS = 2.3263
# Standard errors of what has no noise at all: beyond any limit, and a number still.
_CERTAIN = 1e6
_TINY = np.finfo(float).tiny
_BESIDE = ((0, 1), (1, 0), (0, -1), (-1, 0))
_KNIGHTS_MOVES = tuple((i, j) for i in (-2, -1, 1, 2) for j in (-2, -1, 1, 2) if abs(i) != abs(j))


@dataclass(frozen=True)
class Place:
    """The place of a difference.

    columns, rows : first and last, rows from the bottom.
    channel : its name, empty where there is one only.
    reference, test : means there, in that channel.
    errors : the difference in standard errors, signed.
    """

    columns: tuple[int, int]
    rows: tuple[int, int]
    channel: str
    reference: float
    test: float
    errors: float


@dataclass(frozen=True, eq=False)
class HypothesisTest:
    """A test for differences in one quantity, over tiles of one size.

    size : one of SIZES.
    errors : (rows, columns, channels), each tile's difference in standard errors, signed; of contours negative where the test
        is softer.
    allowed : (rows, columns, channels) what chance allows.
    limit : that at the worst place.
    worst : the place that is farthest beyond it, or closest to it.
    findable : (rows, columns, channels) the least share of its light that a tile may be off and be found with the probability
        POWER; inf of contours, and where nothing would be.
    """

    size: int
    errors: Array
    allowed: Array
    limit: float
    worst: Place
    findable: Array

    @property
    def name(self) -> str:
        return {WHOLE: "whole picture", PIXELS: "pixels", CONTOURS: "contours"}.get(
            self.size, f"tiles of {self.size} × {self.size}"
        )

    @property
    def is_open(self) -> bool:
        """True if nobody knows an answer: of pixels whose noise is not known, that share it, or that do not differ."""
        return not self.errors.any()

    @property
    def failing(self) -> NDArray[np.bool_]:
        """(rows, columns) bool: tiles that differ in some channel."""
        return (np.abs(self.errors) > self.allowed).any(axis=-1)

    @property
    def ok(self) -> bool:
        return not self.failing.any()

    @property
    def typical_findable(self) -> float:
        """The bias that is found in half of the tiles that show any, in the channel that tells most; inf where none does."""
        of_tiles = self.findable.min(axis=-1)
        return float(np.median(of_tiles[np.isfinite(of_tiles)])) if np.isfinite(of_tiles).any() else math.inf

    @property
    def is_everywhere(self) -> bool:
        """True if half of the tiles differ, so that the place of the worst tells nothing."""
        return bool(self.failing.mean() > 0.5)

    def to_json(self) -> dict:
        return {
            "name": self.name,
            "size": self.size,
            "count": self.errors.size,
            "failing": int(self.failing.sum()),
            "allowed": self.limit,
            "findable": self.typical_findable if math.isfinite(self.typical_findable) else None,
            "worst": asdict(self.worst),
            "ok": self.ok,
        }


def run(sides: Sides, allowed: Allowance, freedom: tuple[int, int], level: float) -> tuple[HypothesisTest, ...]:
    """The tests over tiles of all sizes, so that chance makes any of them fail with the probability `level` at most.

    allowed : the allowance for rounding on these sides.
    freedom : the degrees of freedom of both sides' variances.
    level : shared out evenly over the sizes, and over the tiles and channels of each after Šidák.
    """
    share = level / len(SIZES)
    return tuple(_hypothesis_test(sides, *answer) for answer in _statistics(sides, allowed, freedom, share))


def least_findable(tests: Sequence[HypothesisTest]) -> float:
    """The least share that all light may be off and be found with the probability POWER; inf where nothing would be.

    The whole picture tells it, or where its light is that of too few pixels for their squares to tell, the one that tells most.
    """
    whole = tests[SIZES.index(WHOLE)].typical_findable
    return whole if math.isfinite(whole) else min(float(test.findable.min()) for test in tests)


def worst_channel(errors: Array) -> Array:
    """(rows, columns): of each tile's channels the one that differs most, with its sign."""
    return np.take_along_axis(errors, np.abs(errors).argmax(axis=-1)[..., None], axis=-1)[..., 0]


def over_pixels(tiles: NDArray, shape: tuple[int, int], size: int) -> NDArray:
    """(height, width): each tile's value in all of its pixels."""
    for axis, length in enumerate(shape):
        tiles = np.repeat(tiles, np.diff([*noise.tile_starts(length, size), length]), axis=axis)
    return tiles


def _statistics(
    sides: Sides, allowed: Allowance, freedom: tuple[int, int], level: float
) -> Iterator[tuple[int, Array, Array, Array]]:
    """Tests by size: (size, errors, what is allowed, what is findable)."""
    difference, light = sides.difference, np.abs(sides.reference)
    most = allowed.most[..., None] + _FILTER_CONTRAST * contrast(sides.reference)
    variance, both = _pixel_variances(sides, freedom)
    errors = _errors(_beyond(difference, most), variance)
    critical = noise.student_critical(both, noise.sidak(level, errors.size))
    yield PIXELS, errors, critical, findable(light, most, variance, critical)
    rounding = np.repeat((_NEARLY_ALL * allowed.value + allowed.floor)[..., None], difference.shape[2], axis=2)
    shift = _FILTER_SHIFT + _NEARLY_ALL * float(allowed.shift.max())
    across = [np.gradient(sides.reference, axis=axis) for axis in (0, 1) if sides.reference.shape[axis] > 1]
    for size in SIZES[1:]:
        if size == CONTOURS:
            most = rounding + _FILTER_CONTRAST * contrast(sides.reference)
            errors = _contour_errors(sides, most, shift, across)
            critical = np.full(errors.shape, noise.sign_critical(noise.sidak(level, 2 * errors.size)))
            yield size, errors, critical, np.full(errors.shape, np.inf)
            continue
        total, square, allowance = (noise.tile_sums(values, size) for values in (difference, difference**2, rounding))
        allowance = allowance + shift * sum(np.abs(noise.tile_sums(slope, size)) for slope in across)
        square = np.maximum(square, noise.mean_around(square))
        square = np.maximum(square, noise.tile_sums(np.broadcast_to(sides.shared, difference.shape), size))
        errors = _errors(_beyond(total, allowance), square)
        critical = np.full(errors.shape, noise.sign_critical(noise.sidak(level, errors.size)))
        own = noise.tile_sums(np.square(light), size)
        yield size, errors, critical, findable(noise.tile_sums(light, size), allowance, square, critical, own)


def findable(light: Array, allowance: Array, variance: Array, critical: Array, own: Array | float = 0.0) -> Array:
    """The least share b of the light by which a tile may be off and still be found with the probability POWER.

    A test of a difference D beyond the allowance a, with the variance q, finds b·light + D where b·light − a − z √q is more
    than critical · √(q + b² own), for z errors of bad luck: a bias adds to the squares of a tile's differences, too. That is a
    quadratic equation, and its larger root is b. Where the squares grow as fast as the sum does, nothing is ever found: inf.

    own : the sum of the squares of the light of a tile's pixels; 0 of a single one, whose variance its samples tell.
    """
    leading = light**2 - critical**2 * own
    known = (leading > 0.0) & np.isfinite(variance)
    variance = np.where(known, variance, 0.0)
    unlucky = allowance + _POWER_ERRORS * np.sqrt(variance)
    root = critical * np.sqrt(np.maximum(own * unlucky**2 + leading * variance, 0.0))
    return np.divide(light * unlucky + root, leading, out=np.full(light.shape, np.inf), where=known)


def _pixel_variances(sides: Sides, freedom: tuple[int, int]) -> tuple[Array, Array]:
    """The variance of each pixel's difference, inf where it is not known, and Welch's degrees of freedom."""
    variances = [
        np.where(sides.certain, 0.0, np.maximum(variance, noise.mean_around(variance)))
        for variance in (sides.variance, sides.test_variance)
    ]
    total = variances[0] + variances[1]
    known = np.isfinite(total) & (total > 0.0)
    share = np.divide(variances[0], total, out=np.full(total.shape, 0.5), where=known)
    both = 1.0 / (share**2 / freedom[0] + (1.0 - share) ** 2 / freedom[1])
    return total, both


def _contour_errors(sides: Sides, rounding: Array, shift: float, across: Sequence[Array]) -> Array:
    """(1, 1, channels): how much sharper the test is, in standard errors; 0 where nobody knows."""
    height, width, channels = sides.reference.shape
    if min(height, width) < 5 or np.any(sides.shared):
        return np.zeros((1, 1, channels))
    bend = _mean_at(sides.reference, _BESIDE) - _mean_at(sides.reference, _KNIGHTS_MOVES)
    inner = (slice(2, -2), slice(2, -2))
    terms, allowances = bend * sides.difference[inner], np.abs(bend) * rounding[inner]
    is_white = np.add.outer(np.arange(height - 4), np.arange(width - 4)) % 2 == 1
    errors = []
    for color in (is_white, ~is_white):
        allowance = allowances[color].sum(axis=0)
        allowance = allowance + shift * sum(np.abs((bend * slope[inner])[color].sum(axis=0)) for slope in across)
        errors.append(_errors(_beyond(terms[color].sum(axis=0), allowance), (terms[color] ** 2).sum(axis=0)))
    return np.mean(errors, axis=0)[None, None]


def _mean_at(values: Array, places: Sequence[tuple[int, int]]) -> Array:
    """(height − 4, width − 4, channels): of each inner pixel, the mean of the values at so many rows and columns from it."""
    height, width = values.shape[:2]
    total: Array = np.sum([values[2 + i : height - 2 + i, 2 + j : width - 2 + j] for i, j in places], axis=0)
    return total / len(places)


def _errors(differences: Array, variances: Array) -> Array:
    errors = differences / np.sqrt(np.maximum(variances, _TINY))
    return np.clip(errors, -_CERTAIN, _CERTAIN)


def _beyond(values: Array, allowance: Array) -> Array:
    """The part of the values that is beyond ± the allowance."""
    return np.sign(values) * np.maximum(np.abs(values) - allowance, 0.0)


def _hypothesis_test(sides: Sides, size: int, errors: Array, allowed: Array, findable: Array) -> HypothesisTest:
    index = np.unravel_index(np.argmax(np.abs(errors) / allowed), errors.shape)
    row, column, channel = (int(i) for i in index)
    (bottom, top), (left, right) = (
        _extent(length, max(size, WHOLE), i) for length, i in zip(sides.reference.shape[:2], (row, column), strict=True)
    )
    there = (slice(bottom, top + 1), slice(left, right + 1), channel)
    reference, test = (float(side[there].mean()) for side in (sides.reference, sides.test))
    name = CHANNEL_NAMES[channel] if errors.shape[2] == len(CHANNEL_NAMES) else ""
    return HypothesisTest(
        size,
        errors,
        allowed,
        float(allowed[index]),
        Place((left, right), (bottom, top), name, reference, test, float(errors[index])),
        findable,
    )


def _extent(length: int, size: int, i: int) -> tuple[int, int]:
    starts = [*noise.tile_starts(length, size), length]
    return int(starts[i]), int(starts[i + 1]) - 1
