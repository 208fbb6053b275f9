"""Kernels of light/paths.py."""

import numpy as np

from .packets import kernel

_ALL, _NO_WEIGHT = np.empty(0, np.intp), np.empty((3, 0))


@kernel
def _add(flat, places, which, bright, hidden, radiance, factor, colour, weight):
    for number in range(hidden.size):
        if hidden[number]:
            continue
        point = bright[number] if bright.size else number
        path = which[point] if which.size else point
        for channel in range(3):
            value = radiance[channel, point] * factor[point] * colour[channel, path]
            if weight.size:
                value *= weight[channel, path]
            flat[channel, places[path]] += value


def add_received(light, places, which, bright, hidden, radiance, factor, colour, weight):
    which, bright = (_ALL if isinstance(some, slice) else some for some in (which, bright))
    colour, weight = np.ascontiguousarray(colour), _NO_WEIGHT if weight is None else np.ascontiguousarray(weight)
    _add(light.flat, places, which, bright, hidden, radiance, factor, colour, weight)
