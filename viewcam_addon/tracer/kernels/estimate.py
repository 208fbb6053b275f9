"""The kernel of light/adaptive/estimate.py: only round the pixels that are asked for."""

import numpy as np

from ..light.adaptive import estimate as plain
from .packets import kernel

_AROUND = plain.AROUND


@kernel
def mean_around(values, known, pixels):
    height, width = values.shape
    means = np.empty(pixels.size)
    for number in range(pixels.size):
        row, column = pixels[number] // width, pixels[number] % width
        total, count = 0.0, 0
        for i in range(max(row - _AROUND, 0), min(row + _AROUND + 1, height)):
            for j in range(max(column - _AROUND, 0), min(column + _AROUND + 1, width)):
                if known[i, j] and not (i == row and j == column):
                    total += values[i, j]
                    count += 1
        means[number] = total / max(count, 1)
    return means
