"""Kernels of rays/space.py: scattered rays and shadow rays, from the surface they leave to Embree's answer, in packets.

Rays to lights are sorted by direction, some thousand at a time, so that those of a packet keep together. Scattered rays are
not: it pays in some scenes as much as it costs in others.
"""

import numpy as np

from ..compiled.library import FAR, LANES, pointer_of
from ..rays import offset
from .packets import FARTHEST, aim, block, blocked, kernel, meet, met, new_packet
from .sorting import KEYS, RAYS, sort

_UNIT_OF_FLOAT32, _ROUNDING, _SLACK = offset.FLOAT32, offset.ROUNDING, offset.ARITHMETIC + offset.ENDING


@kernel
def _rise(normals, directions, ray):
    return normals[0, ray] * directions[0, ray] + normals[1, ray] * directions[1, ray] + normals[2, ray] * directions[2, ray]


@kernel
def _aim(packet, lane, unit, positions, normals, offsets, directions, ray):
    """Put a ray into a lane that leaves a surface: offset.start."""
    off = np.copysign(offsets[ray], _rise(normals, directions, ray))
    aim(
        packet,
        lane,
        np.float32((off * normals[0, ray] + positions[0, ray]) * unit),
        np.float32((off * normals[1, ray] + positions[1, ray]) * unit),
        np.float32((off * normals[2, ray] + positions[2, ray]) * unit),
        np.float32(directions[0, ray]),
        np.float32(directions[1, ray]),
        np.float32(directions[2, ray]),
        FARTHEST,
    )


@kernel
def _aim_at_light(packet, lane, unit, positions, normals, offsets, directions, distance, ray):
    """Put a ray into a lane that leaves a surface and ends before a light: offset.start and offset.shadow_rays."""
    off = np.copysign(offsets[ray], _rise(normals, directions, ray))
    x = np.float32((off * normals[0, ray] + positions[0, ray]) * unit)
    y = np.float32((off * normals[1, ray] + positions[1, ray]) * unit)
    z = np.float32((off * normals[2, ray] + positions[2, ray]) * unit)
    light_x = (positions[0, ray] + directions[0, ray] * distance) * unit
    light_y = (positions[1, ray] + directions[1, ray] * distance) * unit
    light_z = (positions[2, ray] + directions[2, ray] * distance) * unit
    right, up, forward = light_x - x, light_y - y, light_z - z
    apart = np.sqrt(right * right + up * up + forward * forward)
    largest = max(abs(light_x), abs(light_y), abs(light_z))
    slack = _UNIT_OF_FLOAT32 * (_ROUNDING * largest + _SLACK * apart)
    length = max(apart - slack, 0.0) / (apart if apart > 0 else 1.0)
    aim(packet, lane, x, y, z, np.float32(right), np.float32(up), np.float32(forward), np.float32(length))


@kernel
def _trace(scene, unit, positions, normals, offsets, directions, distances, whether, found):
    """What rays meet, −1 for nothing; with `whether` only if they do, 0 for something. distances : to lights, or none."""
    to_lights = distances.size > 0
    packet = new_packet(to_lights)
    keys, places, order = np.empty(RAYS, np.int32), np.empty(KEYS + 1, np.int32), np.empty(RAYS, np.int32)
    for begin in range(0, found.size, RAYS):
        end = min(begin + RAYS, found.size)
        if to_lights:
            sort(directions, begin, end, keys, places, order)
        else:
            order[: end - begin] = np.arange(begin, end)
        for first in range(0, end - begin, LANES):
            count = min(LANES, end - begin - first)
            for lane in range(count):
                ray = order[first + lane]
                if to_lights:
                    _aim_at_light(packet, lane, unit, positions, normals, offsets, directions, distances[ray], ray)
                else:
                    _aim(packet, lane, unit, positions, normals, offsets, directions, ray)
            if whether:
                block(scene, packet, count)
                for lane in range(count):
                    found[order[first + lane]] = 0 if blocked(packet, lane) else -1
            else:
                meet(scene, packet, count)
                for lane in range(count):
                    found[order[first + lane]] = met(packet, lane)


@kernel
def _measure(unit, positions, normals, offsets, directions, distances, lengths):
    packet = new_packet(True)
    for ray in range(lengths.size):
        _aim_at_light(packet, 0, unit, positions, normals, offsets, directions, distances[ray], ray)
        lengths[ray] = packet[FAR, 0]


def _traced(scene, unit, points, directions, distances, whether):
    found = np.empty(points.count, np.intp)
    _trace(pointer_of(scene), unit, points.position, points.normal, points.offset, directions, distances, whether, found)
    return found


_NO_LIGHTS = np.empty(0)


def first_triangles(scene, unit, points, directions):
    return _traced(scene, unit, points, directions, _NO_LIGHTS, whether=False)


def any_triangle(scene, unit, points, directions):
    return _traced(scene, unit, points, directions, _NO_LIGHTS, whether=True) >= 0


def triangle_before(scene, unit, points, directions, distances):
    return _traced(scene, unit, points, directions, distances, whether=True) >= 0


def shadow_lengths(unit, points, directions, distances):
    lengths = np.empty(points.count, np.float32)
    _measure(unit, points.position, points.normal, points.offset, directions, distances, lengths)
    return lengths
