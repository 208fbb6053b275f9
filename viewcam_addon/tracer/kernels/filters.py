"""The kernel of light/filters.py."""

import numpy as np

from ..light import filters as plain
from .packets import kernel


@kernel
def _interpolate(u, places, width, into):
    steps = places.size - 1
    for axis in range(2):
        for number in range(u.shape[1]):
            scaled = u[axis, number] * steps
            step = np.intp(scaled)
            into[axis, number] = ((places[step + 1] - places[step]) * (scaled - step) + places[step]) * width + 0.5


def spread(u, width):
    into = np.empty(u.shape)
    _interpolate(u, plain.inverse(), width, into)
    return into
