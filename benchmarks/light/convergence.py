"""The speed at which noise falls: error against samples, on integrals whose answers are known, and in pictures.

RMS error over many pixels, each with an integral of its own:

- an edge that crosses a pixel: how much of the pixel lies on its one side,
- the light of a rectangular lamp at a point, which is smooth,
- a soft shadow within a pixel: place on the film and place on the lamp together decide whether the lamp is seen.

Candidates: random numbers; one jittered number in each cell of a grid; Sobol's points, the same for all pixels but for a shift
(Cranley and Patterson); Owen's permutations in full, film and lamp padded, as Cycles does; and the sampler in use, which has
Owen's variance at a fraction of the work and dimensions that fit together.
"""

import functools
from collections.abc import Callable, Sequence
from itertools import product
from math import prod

import numpy as np
from numpy.typing import NDArray

from viewcam_addon.tracer import native

from ..charts import Chart, Curve

Array = NDArray[np.float64]
Numbers = Callable[[int, int, int], Array]
"""(pairs, pixels, samples) → (2 · pairs, pixels, samples) numbers from 0 to 1: a pair for the film, and one for a lamp."""
Integrand = Callable[[Array], Array]
"""Numbers of the samples → (pixels, samples)."""

OURS = "ours: Sobol' with a X + s"


def charts(quick: bool = False) -> tuple[Chart, ...]:
    samples = [4**power for power in range(1, 5 if quick else 7)]
    pixels = 256 if quick else 1024
    return tuple(
        _chart(name, title, *problem(pixels), pairs, samples, reading)
        for name, title, problem, pairs, reading in (
            (
                "edge",
                "An edge across a pixel",
                _edges,
                1,
                "all that is not random falls as N^-0.75; ours is Owen's permutations to the noise of the measurement.",
            ),
            (
                "lamp",
                "The light of a rectangular lamp",
                _lamps,
                1,
                "what is smooth gains most from scrambling each digit: a jittered grid and a shift fall as N^-1 only.",
            ),
            (
                "soft-shadow",
                "A soft shadow within a pixel, by film and lamp together",
                _shadows,
                2,
                "where four numbers matter together, padding ends as noise does, and dimensions that fit together go on.",
            ),
        )
    )


def slope(samples: Sequence[float], errors: Sequence[float]) -> float:
    """The exponent of the number of samples with which errors go, fitted."""
    return float(np.polyfit(np.log(samples), np.log(errors), 1)[0])


def _chart(name: str, title: str, integrand: Integrand, answers: Array, pairs: int, samples: list[int], reading: str) -> Chart:
    pixels = len(answers)
    curves = [
        Curve(
            method,
            samples,
            [_rms(integrand(numbers(pairs, pixels, count)).mean(axis=1) - answers) for count in samples],
            ours=method == OURS,
        )
        for method, numbers in METHODS.items()
    ]
    slopes = ", ".join(f"{curve.name} {slope(curve.x, curve.y):.2f}" for curve in curves)
    return Chart(
        f"convergence-{name}",
        title,
        "samples of each pixel",
        f"RMS error of {pixels} pixels",
        tuple(curves),
        f"Read how steeply errors fall: {reading} Powers of the samples: {slopes}.",
        tie=0.0,
    )


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors * errors)))


# Integrals of so many pixels, and their answers, (pixels,).


def _edges(pixels: int) -> tuple[Integrand, Array]:
    """Half-planes whose border crosses the pixel, at any angle."""
    rng = np.random.default_rng(1)
    angle = rng.random(pixels) * 2 * np.pi
    weights = np.array([np.cos(angle), np.sin(angle)])
    limit = (weights * rng.random((2, pixels))).sum(axis=0)
    return functools.partial(_cut, weights, limit), _cut_cube(weights, limit)


def _shadows(pixels: int) -> tuple[Integrand, Array]:
    """The border of a shadow: what of the lamp is seen changes over the pixel, by less than over the lamp."""
    rng = np.random.default_rng(2)
    angle = rng.random((2, pixels)) * 2 * np.pi
    weights = np.array([0.4 * np.cos(angle[0]), 0.4 * np.sin(angle[0]), np.cos(angle[1]), np.sin(angle[1])])
    limit = (weights * rng.random((4, pixels))).sum(axis=0)
    return functools.partial(_cut, weights, limit), _cut_cube(weights, limit)


def _cut(weights: Array, limit: Array, u: Array) -> Array:
    return (sum(weight[:, None] * row for weight, row in zip(weights, u, strict=True)) < limit[:, None]).astype(float)


def _cut_cube(weights: Array, limit: Array) -> Array:
    """The volume of the cube's part with weights · u < limit: a sum over its corners (Barrow and Smith, 1979)."""
    # Weights are made positive by looking at the cube from its other side.
    limit = limit - np.minimum(weights, 0.0).sum(axis=0)
    weights = np.abs(weights)
    dimensions = len(weights)
    volume = sum(
        (-1) ** sum(corner) * np.maximum(limit - np.tensordot(corner, weights, 1), 0.0) ** dimensions
        for corner in product((0, 1), repeat=dimensions)
    )
    return volume / (prod(range(1, dimensions + 1)) * weights.prod(axis=0))


def _lamps(pixels: int) -> tuple[Integrand, Array]:
    """The irradiance, over π, of a lamp of 2 × 1 and radiance 1 that faces a floor from above, at points of the floor."""
    rng = np.random.default_rng(3)
    x, y, height = rng.uniform(-2, 2, pixels), rng.uniform(-1, 1, pixels), 1.5

    def integrand(u: Array) -> Array:
        across, along = 2 * u[0] - 1 - x[:, None], u[1] - 0.5 - y[:, None]
        return 2 * height**2 / (np.pi * np.square(across * across + along * along + height**2))

    corners = [(sx * sy, sx - x, sy / 2 - y) for sx, sy in product((-1, 1), repeat=2)]
    return integrand, sum(sign * _corner_share(a / height, b / height) for sign, a, b in corners)


def _corner_share(a: Array, b: Array) -> Array:
    """The share of a floor's hemisphere that a rectangle of sides a and b fills, one corner straight above (Howell, C-11)."""
    far, wide = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
    return (a / far * np.arctan(b / far) + b / wide * np.arctan(a / wide)) / (2 * np.pi)


# Methods.


def _white(pairs: int, pixels: int, samples: int) -> Array:
    return np.random.default_rng(samples).random((2 * pairs, pixels, samples))


def _jittered(pairs: int, pixels: int, samples: int) -> Array:
    """Each pair has a number in each cell of a square grid, in an order of its own."""
    rng = np.random.default_rng(samples)
    side = round(samples**0.5)
    cells = [rng.permuted(np.tile(np.arange(samples), (pixels, 1)), axis=1) for _ in range(pairs)]
    places = np.concatenate([[cell // side, cell % side] for cell in cells])
    return (places + rng.random(places.shape)) / side


def _shifted(pairs: int, pixels: int, samples: int) -> Array:
    rng = np.random.default_rng(samples)
    points = [_sobol(rng.permutation(samples) if pair else np.arange(samples)) for pair in range(pairs)]
    return (np.concatenate(points)[:, None] * 2.0**-32 + rng.random((2 * pairs, pixels, 1))) % 1


def _padded(pairs: int, pixels: int, samples: int) -> Array:
    """Owen's permutations of each pixel's numbers, and of the order in which each pair has them."""
    rng = np.random.default_rng(samples)
    index = np.tile(np.arange(samples, dtype=np.uint32), (pixels, 1))
    bits = samples.bit_length() - 1
    orders = [_nested(index, bits, rng) for _ in range(pairs)]
    digits = [_nested(row, 32, rng) for order in orders for row in _sobol(order)]
    return np.array(digits) * 2.0**-32


def _ours(pairs: int, pixels: int, samples: int) -> Array:
    """The core's: the place in the pixel, and the place on a lamp at the first scattering."""
    pixel, sample = np.repeat(np.arange(pixels, dtype=np.uint32), samples), np.tile(np.arange(samples, dtype=np.uint32), pixels)
    return np.concatenate([native.sobol(1, samples, pixel, sample, first, 2).T for first in (0, 3)[:pairs]]).reshape(
        2 * pairs, pixels, samples
    )


def _sobol(index: NDArray[np.integer]) -> NDArray[np.uint32]:
    """Sobol's first two dimensions, 32 digits each (Kollig and Keller, 2002)."""
    index = index.astype(np.uint32)
    points = np.zeros((2, *index.shape), np.uint32)
    second = 1 << 31
    for bit in range(int(index.max()).bit_length()):
        chosen = index >> np.uint32(bit) & np.uint32(1)
        points[0] ^= chosen << np.uint32(31 - bit)
        points[1] ^= chosen * np.uint32(second)
        second ^= second >> 1
    return points


def _nested(numbers: NDArray[np.uint32], bits: int, rng: np.random.Generator) -> NDArray[np.uint32]:
    """Each digit of (pixels, n) numbers is flipped, or not, by those before it: Owen's permutation, another for each pixel.

    A multiplication by a random odd number of 64 bits, of which the highest is taken, tells which.
    """
    flipped = numbers.copy()
    for bit in range(bits):
        before = (numbers >> np.uint32(bit + 1)).astype(np.uint64) if bit < 31 else np.zeros(numbers.shape, np.uint64)
        keys = rng.integers(0, 2**63, (2, len(numbers), 1)).astype(np.uint64)
        hashed = (before * (keys[0] | np.uint64(1)) + keys[1]) * np.uint64(0x9E3779B97F4A7C15)
        hashed ^= hashed >> np.uint64(32)
        hashed *= keys[0] | np.uint64(1)
        flipped ^= (hashed >> np.uint64(63)).astype(np.uint32) << np.uint32(bit)
    return flipped


METHODS: dict[str, Numbers] = {
    "random numbers": _white,
    "jittered grid": _jittered,
    "Sobol', shifted for each pixel": _shifted,
    "Owen's permutations, padded": _padded,
    OURS: _ours,
}
