"""Spheres as Embree's user geometry: Embree finds those whose boxes a ray enters, and has each tested here, in float64.

Embree knows a ray in float32 only, so boxes are wider than spheres by what that moves it. Whether it meets a sphere is told by
the ray as it is, which stands in a table of the packet's rays that Embree hands on from the caller.

Rejected: Embree's own spheres, which decide in float32 and know no ellipsoids; asking Embree only whether a ray meets any
sphere, which took longer than asking for the first.
"""

import ctypes
from collections.abc import Iterator

import numba
import numpy as np
from embreex.rtcore_scene import EmbreeScene
from numba.core import cgutils, types
from numba.extending import intrinsic
from numpy.typing import NDArray

from ..arrays import Floats, Indices, gather
from ..rays.balls import NEAR, Balls
from ..rays.crowd import Hits
from .library import ARGUMENTS, FAR, GEOMETRY, ID, LANES, PRIMITIVE, pointer_of, shared
from .packets import FARTHEST, aim, kernel, meet, met, new_packet
from .sorting import KEYS, RAYS, sort

_USER_GEOMETRY, _ROBUST = 120, 4

# By how much boxes are wider, in Embree's units, of which the largest coordinate has 2³⁰: sixteen units of float32's last
# place, for origin, direction times the way, and Embree's own products.
_MARGIN = 16 * 2.0**6
# Reaches are rounded to float32, outwards.
_OUTWARDS = 1 + 2.0**-22

# What is known of a sphere, in float64: its centre, one over its radius, the way into its object's space, its number, and its
# box in Embree's float32: the lower corner and one number more, the upper corner and one number more.
_CENTRE, _SCALE, _INVERSE, _NUMBER, _BOX, _BALL = 0, 3, 4, 13, 14, 18
# Of a ray: where it starts, its direction, the number of the sphere that it leaves, how far it reaches, and Embree's unit.
_START, _WAY, _LEAVING, _REACH, _UNIT, _RAY = 0, 3, 6, 7, 8, 9


def crowd_of(balls, visible, unit):
    return _Crowd(balls, visible, unit)


class _Crowd:
    """As rays/crowd.Crowd."""

    def __init__(self, balls: Balls, visible: NDArray[np.bool_], unit: float) -> None:
        self._chosen, self._unit = np.flatnonzero(visible), unit
        self._balls = _table(balls, self._chosen, unit)
        self._scene = _scene(self._balls)

    @property
    def is_empty(self) -> bool:
        return not len(self._chosen)

    def met(self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats) -> Iterator[Hits]:
        asked = np.flatnonzero(limits > 0)
        found, distances = np.empty(len(asked), np.intp), gather(limits, asked)
        rays = (gather(values, asked) for values in (starts, directions, leaving))
        _trace(pointer_of(self._scene), self._unit, *rays, distances, found)
        on = np.flatnonzero(found >= 0)
        yield self._chosen[found[on]], asked[on], distances[on]

    def any(self, starts: Floats, directions: Floats, leaving: Indices, limits: Floats) -> NDArray[np.bool_]:
        whether = np.zeros(len(limits), bool)
        for _, which, _ in self.met(starts, directions, leaving, limits):
            whether[which] = True
        return whether


def _table(balls: Balls, chosen: Indices, unit: float) -> Floats:
    """(n, _BALL): what is known of each sphere, side by side."""
    axes, centres = gather(balls.axes, chosen), gather(balls.centres, chosen)
    table = np.zeros((len(chosen), _BALL))
    table[:, _CENTRE:_SCALE] = centres.T
    table[:, _SCALE] = 1.0 / gather(balls.radii, chosen)
    table[:, _INVERSE:_NUMBER] = gather(balls.inverse, gather(balls.owner, chosen)).T
    table[:, _NUMBER] = gather(balls.number, chosen)
    reach = np.sqrt((axes * axes).sum(axis=0)) * unit + _MARGIN
    boxes = table[:, _BOX:].view(np.float32)
    boxes[:, 0:3], boxes[:, 4:7] = (centres * unit - reach).T, (centres * unit + reach).T
    return table


def _scene(table: Floats) -> EmbreeScene:
    """A scene of spheres, ready for any thread. `table` must live as long as it."""
    functions, pointer = shared(), ctypes.c_void_p
    scene = EmbreeScene(robust=True)
    own = pointer(pointer_of(scene))
    for name in ("rtcGetSceneDevice", "rtcNewGeometry"):
        getattr(functions, name).restype = pointer
    device = pointer(functions.rtcGetSceneDevice(own))
    geometry = pointer(functions.rtcNewGeometry(device, _USER_GEOMETRY))
    functions.rtcSetGeometryUserPrimitiveCount(geometry, len(table))
    functions.rtcSetGeometryUserData(geometry, pointer(table.ctypes.data))
    functions.rtcSetGeometryBoundsFunction(geometry, pointer(_bounds.address), pointer(table.ctypes.data))
    functions.rtcSetGeometryIntersectFunction(geometry, pointer(_meet.address))
    functions.rtcCommitGeometry(geometry)
    functions.rtcAttachGeometry(own, geometry)
    functions.rtcReleaseGeometry(geometry)
    functions.rtcReleaseDevice(device)
    functions.rtcSetSceneFlags(own, _ROBUST)
    functions.rtcCommitScene(own)
    scene.is_committed = 1
    return scene


@intrinsic
def _memory(_context, address):
    """What is at an address, for numba.carray."""

    def code(_context, builder, _signature, arguments):
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return types.voidptr(address), code


@numba.njit(error_model="numpy")
def _distance(ball, ray):
    """Balls.distance: where the ray, from outside, first meets the sphere, or inf."""
    scale = ball[_SCALE]
    x = (ball[_CENTRE] - ray[_START]) * scale
    y = (ball[_CENTRE + 1] - ray[_START + 1]) * scale
    z = (ball[_CENTRE + 2] - ray[_START + 2]) * scale
    right, up, forward = ray[_WAY] * scale, ray[_WAY + 1] * scale, ray[_WAY + 2] * scale
    a, b, c = ball[_INVERSE], ball[_INVERSE + 3], ball[_INVERSE + 6]
    centre_x, way_x = a * x + b * y + c * z, a * right + b * up + c * forward
    a, b, c = ball[_INVERSE + 1], ball[_INVERSE + 4], ball[_INVERSE + 7]
    centre_y, way_y = a * x + b * y + c * z, a * right + b * up + c * forward
    a, b, c = ball[_INVERSE + 2], ball[_INVERSE + 5], ball[_INVERSE + 8]
    centre_z, way_z = a * x + b * y + c * z, a * right + b * up + c * forward
    squared = way_x * way_x + way_y * way_y + way_z * way_z
    along = centre_x * way_x + centre_y * way_y + centre_z * way_z
    tangent = centre_x * centre_x + centre_y * centre_y + centre_z * centre_z - 1.0
    if not (along > 0 and tangent > 0):
        return np.inf
    foot = along / squared
    if tangent < NEAR:
        discriminant = along * foot - tangent
    else:
        x, y, z = centre_x - foot * way_x, centre_y - foot * way_y, centre_z - foot * way_z
        discriminant = 1.0 - (x * x + y * y + z * z)
    if not discriminant >= 0:
        return np.inf
    return tangent / (along + np.sqrt(discriminant * squared))


@numba.cfunc("void(uintp)", cache=True)
def _bounds(arguments):
    """RTCBoundsFunction. arguments : of the spheres, the sphere (and a time step), and where its box is wanted."""
    words = numba.carray(_memory(arguments), 3, np.int64)
    boxes = numba.carray(_memory(words[0] + ((words[1] & 0xFFFFFFFF) * _BALL + _BOX) * 8), 8, np.float32)
    wanted = numba.carray(_memory(words[2]), 8, np.float32)
    for number in range(8):
        wanted[number] = boxes[number]


@numba.cfunc("void(uintp)", cache=True)
def _meet(arguments):
    """RTCIntersectFunctionN.

    arguments : of which lanes are asked, of the spheres, the sphere, the query, the lanes, how many lanes and the geometry.
    """
    words = numba.carray(_memory(arguments), 6, np.int64)
    lanes, sphere = words[5] & 0xFFFFFFFF, words[2] & 0xFFFFFFFF
    asked = numba.carray(_memory(words[0]), lanes, np.int32)
    ball = numba.carray(_memory(words[1] + sphere * _BALL * 8), _BALL, np.float64)
    query = numba.carray(_memory(words[3]), 2, np.int64)
    rays = numba.carray(_memory(query[1]), (LANES, _RAY), np.float64)
    bits = numba.carray(_memory(words[4]), (GEOMETRY + 1) * lanes, np.int32)
    packet = numba.carray(_memory(words[4]), (GEOMETRY + 1) * lanes, np.float32)
    for lane in range(lanes):
        if asked[lane] == 0:
            continue
        ray = rays[bits[ID * lanes + lane]]
        if ball[_NUMBER] == ray[_LEAVING]:
            continue
        distance = _distance(ball, ray)
        if distance < ray[_REACH]:
            ray[_REACH] = distance
            packet[FAR * lanes + lane] = np.float32(distance * ray[_UNIT] * _OUTWARDS)
            bits[PRIMITIVE * lanes + lane] = sphere
            bits[GEOMETRY * lanes + lane] = words[5] >> 32


@kernel
def _trace(scene, unit, starts, directions, leaving, distances, found):
    """Which sphere rays meet nearer than `distances`, −1 for none, and how far off, into `distances`."""
    packet = new_packet(False)
    rays = np.empty((LANES, _RAY))
    query = np.empty(2, np.int64)
    query[0], query[1] = -1, rays.ctypes.data  # RTCRayQueryContext, of no instance; and what `_test` reads
    packet.view(np.int64)[ARGUMENTS, 1] = query.ctypes.data
    rays[:, _UNIT] = unit
    keys, places, order = np.empty(RAYS, np.int32), np.empty(KEYS + 1, np.int32), np.empty(RAYS, np.int32)
    for begin in range(0, found.size, RAYS):
        end = min(begin + RAYS, found.size)
        sort(directions, begin, end, keys, places, order)
        for first in range(0, end - begin, LANES):
            count = min(LANES, end - begin - first)
            for lane in range(count):
                which = order[first + lane]
                x, y, z = starts[0, which], starts[1, which], starts[2, which]
                right, up, forward = directions[0, which], directions[1, which], directions[2, which]
                ray = rays[lane]
                ray[_START], ray[_START + 1], ray[_START + 2] = x, y, z
                ray[_WAY], ray[_WAY + 1], ray[_WAY + 2] = right, up, forward
                ray[_LEAVING], ray[_REACH] = leaving[which], distances[which]
                length = np.float32(min(distances[which] * unit * _OUTWARDS, FARTHEST))
                x, y, z = np.float32(x * unit), np.float32(y * unit), np.float32(z * unit)
                aim(packet, lane, x, y, z, np.float32(right), np.float32(up), np.float32(forward), length)
            meet(scene, packet, count)
            for lane in range(count):
                which = order[first + lane]
                found[which], distances[which] = met(packet, lane), rays[lane, _REACH]
