"""Pixels whose centre tells all: where nothing changes within the filter's reach but by what is smooth.

What the centres of neighbouring pixels show tells where an edge passes between them. Along a line of three centres a smooth
surface hardly bends, while an edge between two of them leaves its whole contrast c in the second difference. A filter that has
the part m of its mass on the other side of the edge changes its pixel by m c, so that pixels are interior whose surroundings
hold no second difference that could change them by more than a part of the wanted error. What is thinner than a pixel passes
between centres unseen: that is for outlines.py.

The filter is even. So the mean over it of what is smooth is the value at the centre, and half the filter's variance times
the sum of the second derivatives, which the second differences tell.
"""

import numpy as np
from numpy.typing import NDArray

from ...arrays import Floats
from ...compiled.standing import or_compiled
from ...scene.film import Film
from ..filters import beyond, reach, variance

Mask = NDArray[np.bool_]

# Of the wanted error, that an edge may change a pixel by unseen: at most, and half of that in the mean.
_UNSEEN = 1.0
CORRECTED = 0.5
"""Of the correction: by what part of it the corrected light may be off."""
_LINES = ((0, 1), (1, 0), (1, 1), (1, -1))


def interior(light: Floats, alone: Mask, film: Film, error: float) -> Mask:
    """(height, width): the pixels that need no sample but their centre's.

    light : (channels, height, width), at the centres. alone : (height, width), pixels within whose reach something may change
    unseen by the centres. error : that is wanted of a pixel.
    """
    bent = bends(light)
    doubtful = alone.copy()
    doubtful[[0, -1]] = doubtful[:, [0, -1]] = True  # what is beside the picture is not known
    for distance in range(int(np.ceil(reach(film)))):
        changed = bent * beyond(film, distance) > _UNSEEN * error
        doubtful |= widened(changed, distance)
    return ~doubtful


@or_compiled
def correction(values: Floats, film: Film) -> Floats:
    """(height, width): what the filter's mean is more than the centre's value, where all is smooth; 0 at the border."""
    correction = np.zeros_like(values)
    middle = correction[1:-1, 1:-1]
    np.multiply(values[1:-1, 1:-1], -4.0, out=middle)
    middle += values[:-2, 1:-1]
    middle += values[2:, 1:-1]
    middle += values[1:-1, :-2]
    middle += values[1:-1, 2:]
    middle *= variance(film) / 2
    return correction


def widened(mask: Mask, distance: int) -> Mask:
    """Pixels so many rows and columns from one of the mask's at most."""
    for axis in (0, 1):
        spread = mask.copy()
        for step in range(1, distance + 1):
            here, there = [slice(None)] * 2, [slice(None)] * 2
            here[axis], there[axis] = slice(step, None), slice(None, -step)
            spread[tuple(here)] |= mask[tuple(there)]
            spread[tuple(there)] |= mask[tuple(here)]
        mask = spread
    return mask


def within(mask: Mask, film: Film) -> Mask:
    """Pixels whose filter reaches into the square of one of the mask's."""
    return widened(mask, max(int(np.ceil(reach(film) - 0.5)), 0))


@or_compiled
def bends(light: Floats) -> Floats:
    """(height, width): the largest second difference through each pixel along rows, columns and diagonals, of any channel."""
    largest = np.zeros(light.shape[1:])
    middle = light[:, 1:-1, 1:-1]
    for down, across in _LINES:
        one, other = (
            light[:, 1 + side * down : light.shape[1] - 1 + side * down, 1 + side * across : light.shape[2] - 1 + side * across]
            for side in (1, -1)
        )
        np.maximum(largest[1:-1, 1:-1], np.abs(one + other - 2.0 * middle).max(axis=0), out=largest[1:-1, 1:-1])
    return largest
