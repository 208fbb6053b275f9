"""Packets of sixteen rays through Embree, from loops that numba compiles: the ground on which the other kernels stand.

The rays of a packet are traced together, so it pays when they run side by side: the samples of one pixel, or shadow rays from
neighbours to one lamp. A packet is one array, `new_packet()`. A loop puts rays into lanes with `aim`, has `meet` or `block`
trace the first `count` of them, and reads `met` or `blocked` lane by lane. `intersect` and `occluded` do that for whole arrays.

Answers are those of `EmbreeScene.run`, ray by ray: Embree computes the same in lanes as one by one. Only which of two triangles
is met whose depths are the same to the last bit of float32, as on an edge of both, depends on the other rays of the packet.

A kernel's machine code is kept in numba's cache, beside the module or in the user's cache folder; numba looks only at the file
the kernel itself stands in, so after a change here the kernels that call these must be changed or their cache emptied.
"""

from collections.abc import Callable

import llvmlite.binding
import numba
import numpy as np
from numba.core import types

from ..compiled.library import (
    ALIGNMENT,
    ARGUMENTS,
    COHERENT,
    DIRECTION,
    FAR,
    FLAGS,
    FUNCTIONS,
    GEOMETRY,
    ID,
    INSTANCE,
    INSTANCE_PRIMITIVE,
    LANES,
    MASK,
    NEAR,
    ORIGIN,
    PRIMITIVE,
    ROWS,
    TIME,
    VALID,
    addresses,
)

FARTHEST = np.float32(1e37)
"""embreex's limit for rays without one."""

# Kernels refer to the functions by name, since an address would not survive in a cache.
for _name, _address in addresses().items():
    llvmlite.binding.add_symbol(f"viewcam_{_name}", _address)
_arguments = types.void(types.uintp, types.uintp, types.uintp, types.uintp)
_intersect16, _occluded16 = (types.ExternalFunction(f"viewcam_{name}", _arguments) for name in FUNCTIONS)


def kernel(function: Callable) -> Callable:
    """The function compiled, at its first call with new types; kept in a cache where one can be written."""
    try:
        return numba.njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:  # no folder that numba could write to
        return numba.njit(nogil=True, error_model="numpy")(function)


@kernel
def new_packet(coherent):
    """(ROWS, LANES) float32, aligned as Embree wants it, no rays in it.

    coherent : whether rays run side by side, as those of one pixel or to one lamp do: they are then traced as a beam, in a
    third of the time. Others take longer so.
    """
    memory = np.zeros((ROWS + 1) * LANES, np.float32)
    offset = (ALIGNMENT - memory.ctypes.data % ALIGNMENT) % ALIGNMENT // 4
    packet = memory[offset : offset + ROWS * LANES].reshape(ROWS, LANES)
    bits = packet.view(np.int32)
    bits[MASK] = -1
    bits[ARGUMENTS, 0], bits[ARGUMENTS, 1] = COHERENT if coherent else 0, -1
    return packet


@kernel
def aim(packet, lane, x, y, z, right, up, forward, length):
    """Put a ray into a lane: its origin, its direction, and how many times that it reaches; float32."""
    packet[ORIGIN, lane], packet[ORIGIN + 1, lane], packet[ORIGIN + 2, lane] = x, y, z
    packet[DIRECTION, lane], packet[DIRECTION + 1, lane], packet[DIRECTION + 2, lane] = right, up, forward
    packet[FAR, lane] = length


@kernel
def meet(scene, packet, count):
    """What the first `count` rays meet first: `met` tells. scene : library.pointer_of."""
    bits = packet.view(np.int32)
    for lane in range(LANES):
        bits[VALID, lane] = -1 if lane < count else 0
        packet[NEAR, lane], packet[TIME, lane] = 0, 0
        bits[ID, lane], bits[FLAGS, lane] = lane, 0
        bits[PRIMITIVE, lane], bits[GEOMETRY, lane] = -1, -1
        bits[INSTANCE, lane], bits[INSTANCE_PRIMITIVE, lane] = -1, -1
    _intersect16(packet.ctypes.data + VALID * ALIGNMENT, scene, packet.ctypes.data, packet.ctypes.data + ARGUMENTS * ALIGNMENT)


@kernel
def block(scene, packet, count):
    """Whether the first `count` rays meet anything: `blocked` tells."""
    bits = packet.view(np.int32)
    for lane in range(LANES):
        bits[VALID, lane] = -1 if lane < count else 0
        packet[NEAR, lane], packet[TIME, lane] = 0, 0
        bits[ID, lane], bits[FLAGS, lane] = lane, 0
    _occluded16(packet.ctypes.data + VALID * ALIGNMENT, scene, packet.ctypes.data, packet.ctypes.data + ARGUMENTS * ALIGNMENT)


@kernel
def met(packet, lane):
    """The triangle that a ray met, or −1."""
    return packet.view(np.int32)[PRIMITIVE, lane]


@kernel
def blocked(packet, lane):
    """Whether a ray met anything."""
    return packet[FAR, lane] < 0


@kernel
def intersect(scene, origins, directions, lengths, coherent, found):
    """What n rays meet first, or −1, into `found`, (n,) of integers.

    scene : library.pointer_of. origins, directions : (3, n) float32. lengths : (n,) float32, FARTHEST for no limit.
    """
    packet = new_packet(coherent)
    for start in range(0, found.size, LANES):
        count = min(LANES, found.size - start)
        _aim_all(packet, start, count, origins, directions, lengths)
        meet(scene, packet, count)
        for lane in range(count):
            found[start + lane] = met(packet, lane)


@kernel
def occluded(scene, origins, directions, lengths, coherent, found):
    """Whether n rays meet anything, into `found`, (n,) bool; as `intersect`."""
    packet = new_packet(coherent)
    for start in range(0, found.size, LANES):
        count = min(LANES, found.size - start)
        _aim_all(packet, start, count, origins, directions, lengths)
        block(scene, packet, count)
        for lane in range(count):
            found[start + lane] = blocked(packet, lane)


@kernel
def _aim_all(packet, start, count, origins, directions, lengths):
    for lane in range(count):
        ray = start + lane
        x, y, z = origins[0, ray], origins[1, ray], origins[2, ray]
        aim(packet, lane, x, y, z, directions[0, ray], directions[1, ray], directions[2, ray], lengths[ray])
