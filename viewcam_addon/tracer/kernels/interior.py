"""Kernels of light/adaptive/interior.py: one pass over a picture's second differences."""

import numpy as np

from ..light.filters import variance
from .packets import kernel


@kernel
def bends(light):
    channels, height, width = light.shape
    largest = np.zeros((height, width))
    for row in range(1, height - 1):
        for channel in range(channels):
            below, here, above = light[channel, row - 1], light[channel, row], light[channel, row + 1]
            for column in range(1, width - 1):
                twice = 2.0 * here[column]
                upright = abs(below[column] + above[column] - twice)
                level = abs(here[column - 1] + here[column + 1] - twice)
                rising = abs(below[column - 1] + above[column + 1] - twice)
                falling = abs(below[column + 1] + above[column - 1] - twice)
                largest[row, column] = max(largest[row, column], upright, level, rising, falling)
    return largest


@kernel
def _correct(values, factor):
    height, width = values.shape
    correction = np.zeros((height, width))
    for row in range(1, height - 1):
        below, here, above = values[row - 1], values[row], values[row + 1]
        for column in range(1, width - 1):
            around = here[column] * -4.0 + below[column] + above[column] + here[column - 1] + here[column + 1]
            correction[row, column] = around * factor
    return correction


def correction(values, film):
    return _correct(values, variance(film) / 2)
