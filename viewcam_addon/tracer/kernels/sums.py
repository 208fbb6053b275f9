"""The kernel of light/sums.py: pixel by pixel, each sample in order."""

import numpy as np

from .packets import kernel


@kernel
def _add(values, shown, taken, batch_size, totals, firsts, differences, befores, squares):
    _, categories, count, samples = values.shape
    for channel in range(3):
        for pixel in range(count):
            for category in range(categories):
                total = totals[channel, category, pixel]
                for sample in range(samples):
                    total += values[channel, category, pixel, sample]
                totals[channel, category, pixel] = total
            first, difference = firsts[channel, pixel], differences[channel, pixel]
            before, square = befores[channel, pixel], squares[channel, pixel]
            for sample in range(samples):
                combined = 0.0
                for category in shown:
                    combined += values[channel, category, pixel, sample]
                if taken + sample == 0:
                    first = combined
                difference += combined - first
                if (taken + sample + 1) % batch_size == 0:
                    square += (difference - before) * (difference - before)
                    before = difference
            firsts[channel, pixel], differences[channel, pixel] = first, difference
            befores[channel, pixel], squares[channel, pixel] = before, square


@kernel
def _count(covered, totals):
    for pixel in range(totals.size):
        number = 0
        for sample in range(covered.shape[1]):
            number += covered[pixel, sample]
        totals[pixel] += number


def add_samples(sums, values, covered):
    shown = np.array(sums.shown, np.intp)
    parts = sums.totals, sums.first, sums.differences, sums.before, sums.squares
    _add(values, shown, sums.taken, sums.batch_size, *parts)
    _count(covered, sums.covered)
