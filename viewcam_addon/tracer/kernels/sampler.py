"""Kernels of light/sampler.py: the same bits, number by number."""

import numpy as np

from ..light import sampler as plain
from .packets import kernel
from .vectors import inlined

_FIRST, _SECOND, _GOLDEN = plain.MIXERS
_1, _15, _16 = np.uint32(1), np.uint32(15), np.uint32(16)
_2, _4, _8, _24 = np.uint32(2), np.uint32(4), np.uint32(8), np.uint32(24)
_ODD, _PAIRS, _HALVES, _BYTES = (np.uint32(mask) for mask in (0x55555555, 0x33333333, 0x0F0F0F0F, 0xFF00))


@inlined
def _times(word, factor):
    return np.uint32(np.uint64(word) * np.uint64(factor))


@inlined
def _mixed(word):
    word = _times(np.uint32(word ^ (word >> _16)), _FIRST)
    word = _times(np.uint32(word ^ (word >> _15)), _SECOND)
    return np.uint32(word ^ (word >> _16))


@inlined
def _reversed(word):
    word = np.uint32(((word >> _1) & _ODD) | ((word & _ODD) << _1))
    word = np.uint32(((word >> _2) & _PAIRS) | ((word & _PAIRS) << _2))
    word = np.uint32(((word >> _4) & _HALVES) | ((word & _HALVES) << _4))
    return np.uint32((word << _24) | ((word & _BYTES) << _8) | ((word >> _8) & _BYTES) | (word >> _24))


@inlined
def _factor(shift):
    factor = _times(shift, _GOLDEN)
    return np.uint32(factor ^ (factor >> _15)) | _1


@inlined
def _scrambled(digits, factor, shift):
    return _reversed(np.uint32(np.uint64(factor) * np.uint64(digits) + np.uint64(shift))) * 2.0**-32


@kernel
def _numbers(points, keys, seed, pixels, samples, into):
    for row in range(keys.size):
        key, table = keys[row], points[row]
        for path in range(pixels.size):
            shift = _mixed(_mixed(np.uint32(pixels[path]) ^ seed) ^ key)
            into[row, path] = _scrambled(table[samples[path]], _factor(shift), shift)


@kernel
def _grid(points, keys, seed, pixels, samples, into):
    for place in range(pixels.size):
        word = _mixed(np.uint32(pixels[place]) ^ seed)
        for row in range(keys.size):
            shift = _mixed(word ^ keys[row])
            factor = _factor(shift)
            for number in range(samples.size):
                into[row, place * samples.size + number] = _scrambled(points[row, samples[number]], factor, shift)


def scrambled(sampler, pixels, samples, first, count):
    words = sampler.words(first, count)
    if words is None:
        return plain.scrambled.plain(sampler, pixels, samples, first, count)
    into = np.empty((count, len(pixels)))
    samples = np.broadcast_to(samples, len(pixels)).copy() if np.size(samples) != len(pixels) else np.atleast_1d(samples)
    _numbers(*words, pixels, samples, into)
    return into


def scrambled_grid(sampler, pixels, samples, first, count):
    words = sampler.words(first, count)
    if words is None:
        return plain.scrambled_grid.plain(sampler, pixels, samples, first, count)
    into = np.empty((count, len(pixels) * len(samples)))
    _grid(*words, pixels, samples, into)
    return into
