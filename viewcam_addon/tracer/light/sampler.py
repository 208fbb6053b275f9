"""The numbers that choose: where a sample lies on the film, which lamp, which direction.

A sample of a pixel is a point in a cube of many dimensions: two for the film and eight for each scattering. The points of a
pixel are Sobol's, of which any 2ᵐ that follow one another fill the cube evenly, scrambled for each pixel and dimension: every
number is uniform, pixels are independent, and the error of what is smooth falls as N^−3/2.

**Scrambling.** X holds a number's binary digits in reverse, the first in the lowest bit. With any s and any odd a of 32 bits,
Y = a X + s mod 2³², reversed again, is the number scrambled. Of two numbers that agree in k digits and differ in the next, Y
does the same, since carries go upwards and a is odd; all further digits are independent, since a (X − X′)/2ᵏ takes every
odd value equally often, and s every value. That is the joint distribution of two numbers under Owen's nested permutations
(Annals of Statistics 25, 1997), and the variance of a mean depends on pairs only: it is Owen's, for a product and a sum.

**Dimensions.** Film and first scattering have ten of their own. Those that belong together, two of the film, of a lamp and of
a direction, are Sobol's first two, in the order of points that another of Sobol's dimensions gives. So each such pair is as
good as two dimensions can be, all ten are nearly so together, and what film and lamp do together converges too. Later
scatterings have the first one's dimensions, each in an order of its own, by a nested permutation of the points (padding:
Burley, JCGT 9, 2020).

Any number of samples may be taken. Beside a power of two the last points lack their partners: what is smooth is then off as
1/N; edges, off as N^−3/4, lose nothing.

Rejected: hashes that resemble Owen's permutations (Laine and Karras 2011; Burley), three or four multiplications instead of
one; his own, a tree of random bits for each dimension; an order of points for each pixel, which costs a matrix for each number;
padding from the start, as in Cycles, with which what film and lamp do together is off as N^−1/2; one shift for all points
of a pixel (Cranley and Patterson 1976), off as 1/N; blue noise over the picture, which makes pixels depend on one another.
benchmarks/light/convergence.py compares them.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from ..compiled.standing import or_compiled

Words = NDArray[np.uint32]
Samples = int | NDArray[np.integer]

FILM, SCATTERING = 2, 8
"""How many dimensions the film has, and each scattering."""

# Sobol's dimensions, as in Joe and Kuo's table: the degree of a primitive polynomial, its inner coefficients as bits, and the
# first direction numbers. Polynomials and the second dimension are theirs (SIAM J. Sci. Comput. 30, 2008). The other direction
# numbers are the best of some thousand random ones of each, by the t-values of all pairs of the ten dimensions, of film and
# lamp, film and direction, and so on as they meet in integrals; theirs are made for pairs alone, and not for pairs of pairs.
_SECOND = (1, 0, (1,))
_LAMP = (6, 22, (1, 3, 3, 9, 31, 21))
_DIRECTION = (5, 11, (1, 1, 3, 15, 29))
_EMITTER = (6, 13, (1, 3, 3, 15, 1, 19))
_COMPONENT = (5, 14, (1, 1, 3, 11, 7))
_ROULETTE = (5, 2, (1, 1, 5, 13, 11))
_SPARE = (6, 1, (1, 3, 7, 5, 19, 39))

# Of the hashes (the last is 2³² over the golden ratio), and of the reversal: which bits of a byte change places.
MIXERS = tuple(np.uint32(factor) for factor in (0x7FEB352D, 0x846CA68B, 0x9E3779B1))
_SWAPS = tuple((np.uint32(shift), np.uint32(mask)) for shift, mask in ((1, 0x55555555), (2, 0x33333333), (4, 0x0F0F0F0F)))
_1, _15, _16 = np.uint32(1), np.uint32(15), np.uint32(16)

_BITS = 24
_LOW = 16  # bits of a sample's number that its scattering's order changes, and for which there are tables


class Sampler:
    """Numbers for any pixel, sample and dimension: the same bits on every machine.

    seed : a whole number. samples : how many samples are taken of a pixel, 1 to 2²⁴.
    """

    def __init__(self, seed: int, samples: int) -> None:
        self._seeds = _mixed(np.array([seed & 0xFFFFFFFF, ~seed & 0xFFFFFFFF], np.uint32))
        self._first = np.arange(min(samples, 1 << _LOW), dtype=np.uint32)
        self._tables: dict[int, Words] = {}

    def numbers(self, pixels: NDArray[np.integer], samples: Samples, first: int, count: int) -> Floats:
        """(count, n) float64 in [0, 1): the dimensions from `first` on of samples of n pixels.

        pixels : (n,) from 0 to 2³² − 1. samples : (n,), or one for all, from 0.
        """
        return scrambled(self, pixels, samples, first, count)

    def grid(self, pixels: NDArray[np.integer], samples: NDArray[np.integer], first: int, count: int) -> Floats:
        """(count, n · s): the same for s samples of n pixels, pixel after pixel; the pixels' random words are made once."""
        return scrambled_grid(self, pixels, samples, first, count)

    def words(self, first: int, count: int) -> tuple[Words, Words, np.uint32] | None:
        """What makes the numbers of dimensions: the digits of all samples' points, (count, samples), the dimensions' random
        words and the seed's; None where there are too many samples, or dimensions of more than one scattering."""
        (scattering, row), (last, _) = _place(first), _place(first + count - 1)
        if scattering != last or len(self._first) == 1 << _LOW:
            return None
        keys = _mixed(np.arange(first, first + count, dtype=np.uint32) + self._seeds[1])
        return self._table(scattering)[row : row + count], keys, self._seeds[0]

    def hashed(self, pixels: NDArray[np.integer], keys: Words) -> tuple[Words, Words]:
        """Two random words for each key and pixel, (k, n) each; the first odd."""
        shift = _mixed(_mixed(pixels.astype(np.uint32) ^ self._seeds[0]) ^ _mixed(keys + self._seeds[1])[:, None])
        factor = shift * MIXERS[2]
        factor ^= factor >> _15
        factor |= _1
        return factor, shift

    def points(self, dimension: int, samples: NDArray[np.integer]) -> Words:
        """(n,): the digits of Sobol's points in a dimension, before they are scrambled."""
        scattering, row = _place(dimension)
        digits = np.take(self._table(scattering)[row], samples & (1 << _LOW) - 1, mode="clip")
        if len(self._first) == 1 << _LOW:
            digits ^= _transformed((samples >> _LOW).astype(np.uint32), _MATRICES[None, row, _LOW:])[0]
        return digits

    def _table(self, scattering: int) -> Words:
        """(FILM + SCATTERING, samples): the points' digits at a scattering, of all dimensions."""
        if scattering not in self._tables:
            self._tables[scattering] = _transformed(self._order(scattering), _MATRICES[:, :_LOW])
        return self._tables[scattering]

    def _order(self, scattering: int) -> Words:
        """Which of Sobol's points each of the first samples has at a scattering."""
        order = self._first.copy()
        if scattering > 0:
            keys = _mixed(np.arange(scattering * _LOW, (scattering + 1) * _LOW, dtype=np.uint32) + self._seeds[0])
            for bit, key in enumerate(keys):  # Owen's permutation: each bit is flipped, or not, by those above it
                order ^= (_mixed(self._first >> np.uint32(bit + 1) ^ key) & np.uint32(1)) << np.uint32(bit)
        return order


@or_compiled
def scrambled(sampler: Sampler, pixels: NDArray[np.integer], samples: Samples, first: int, count: int) -> Floats:
    """As `Sampler.numbers`."""
    dimensions = range(first, first + count)
    digits, shift = sampler.hashed(pixels, np.array(dimensions, np.uint32))
    which = np.atleast_1d(samples)
    for row, dimension in zip(digits, dimensions, strict=True):
        row *= sampler.points(dimension, which)
    digits += shift
    return _reversed(digits) * 2.0**-32


@or_compiled
def scrambled_grid(
    sampler: Sampler, pixels: NDArray[np.integer], samples: NDArray[np.integer], first: int, count: int
) -> Floats:
    """As `Sampler.grid`."""
    dimensions = range(first, first + count)
    factor, shift = sampler.hashed(pixels, np.array(dimensions, np.uint32))
    digits = np.stack([sampler.points(dimension, samples) for dimension in dimensions])
    digits = digits[:, None] * factor[:, :, None]
    digits += shift[:, :, None]
    return _reversed(digits.reshape(count, -1)) * 2.0**-32


def _place(dimension: int) -> tuple[int, int]:
    """The scattering that a dimension belongs to, and its row in the tables."""
    return (0, dimension) if dimension < FILM else ((dimension - FILM) // SCATTERING, FILM + (dimension - FILM) % SCATTERING)


def _mixed(words: Words) -> Words:
    """A permutation of all words that looks random (Wellons, Prospecting for Hash Functions, 2018: lowbias32)."""
    higher = words >> _16
    words = words ^ higher
    words *= MIXERS[0]
    words ^= np.right_shift(words, _15, out=higher)
    words *= MIXERS[1]
    words ^= np.right_shift(words, _16, out=higher)
    return words


def _reversed(words: Words) -> Words:
    """The bits of contiguous words in reverse order; `words` is used up. Bytes are turned by NumPy, the bits in each here."""
    higher = np.empty_like(words)
    for shift, mask in _SWAPS:
        np.right_shift(words, shift, out=higher)
        higher &= mask
        words &= mask
        words <<= shift
        words |= higher
    return words.byteswap(inplace=True)


def _transformed(numbers: Words, matrices: Words) -> Words:
    """(d, n) products of d matrices and n vectors of bits. numbers : (n,). matrices : (d, bits), their columns."""
    products = np.zeros((len(matrices), len(numbers)), np.uint32)
    for bit, columns in enumerate(matrices.T):
        products ^= columns[:, None] * (numbers >> np.uint32(bit) & np.uint32(1))
    return products


def _sobol(degree: int, coefficients: int, start: tuple[int, ...]) -> Words:
    """(_BITS,): the columns of the matrix of one of Sobol's dimensions, their digits in reverse order.

    Its direction numbers follow from the first ones by the polynomial's recurrence (Bratley and Fox, ACM TOMS 14, 1988).
    """
    numbers = list(start)
    for k in range(degree, _BITS):
        number = numbers[k - degree] ^ numbers[k - degree] << degree
        for i in range(1, degree):
            if coefficients >> degree - 1 - i & 1:
                number ^= numbers[k - i] << i
        numbers.append(number)
    left = np.array([number << 31 - k for k, number in enumerate(numbers)], np.uint32)
    return _reversed(left)


def _matrices() -> Words:
    """(FILM + SCATTERING, _BITS): the columns of the matrices of all dimensions, their digits in reverse order."""
    first, second = np.uint32(1) << np.arange(_BITS, dtype=np.uint32), _sobol(*_SECOND)
    singles = [_sobol(*numbers) for numbers in (_EMITTER, _LAMP, _DIRECTION, _COMPONENT, _ROULETTE, _SPARE)]
    emitter, lamp, direction, component, roulette, spare = singles
    lamps, directions = _transformed(lamp, second[None])[0], _transformed(direction, second[None])[0]
    return np.stack([first, second, emitter, lamp, lamps, direction, directions, component, roulette, spare])


_MATRICES = _matrices()
