"""Kernels of rays/visibility.py: eye rays in packets, which run side by side as pixels and samples follow one another."""

import numpy as np

from .library import LANES, pointer_of
from .packets import aim, kernel, meet, met, new_packet


@kernel
def _trace(scene, start, length, x, y, coherent, found):
    packet = new_packet(coherent)
    start, length, one = np.float32(start), np.float32(length), np.float32(1)
    for first in range(0, found.size, LANES):
        count = min(LANES, found.size - first)
        for lane in range(count):
            right, up = np.float32(x[first + lane]), np.float32(y[first + lane])
            aim(packet, lane, right * start, up * start, start, right, up, one, length)
        meet(scene, packet, count)
        for lane in range(count):
            found[first + lane] = met(packet, lane)


def first_triangles(embree, start, length, x, y):
    found = np.empty(len(x), np.intp)
    _trace(pointer_of(embree), float(start), float(length), x, y, True, found)
    return found
