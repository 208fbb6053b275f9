"""Kernels of rays/visibility.py: eye rays in packets, which run side by side as pixels and samples follow one another."""

import numpy as np

from ..compiled.library import LANES, pointer_of
from .packets import aim, kernel, meet, met, new_packet


@kernel
def _trace(scene, start, length, x, y, run, found):
    packet = new_packet(run > 1)
    start, length, one = np.float32(start), np.float32(length), np.float32(1)
    first = 0
    while first < found.size:
        count = min(LANES, found.size - first, run - first % run)
        for lane in range(count):
            right, up = np.float32(x[first + lane]), np.float32(y[first + lane])
            aim(packet, lane, right * start, up * start, start, right, up, one, length)
        meet(scene, packet, count)
        for lane in range(count):
            found[first + lane] = met(packet, lane)
        first += count


def first_triangles(embree, start, length, x, y, run):
    found = np.empty(len(x), np.intp)
    _trace(pointer_of(embree), float(start), float(length), x, y, run, found)
    return found
