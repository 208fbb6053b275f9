"""Spheres as Embree's user geometry: Embree finds those whose boxes a ray enters, and has each tested by a kernel, in float64.

Embree knows a ray in float32 only, so boxes are wider than spheres by what that moves it. Whether it meets a sphere is told by
the ray as it is, which stands in a table of the packet's rays that Embree hands on from the caller.

Rejected: Embree's own spheres, which decide in float32 and know no ellipsoids; asking Embree only whether a ray meets any
sphere, which took longer than asking for the first.
"""

import ctypes

import numba
import numpy as np
from embreex.rtcore_scene import EmbreeScene
from numba.core import cgutils, types
from numba.extending import intrinsic

from ..arrays import Floats
from ..compiled.library import ARGUMENTS, FAR, GEOMETRY, ID, LANES, PRIMITIVE, pointer_of, shared

_USER_GEOMETRY, _ROBUST = 120, 4

# By how much boxes are wider, in Embree's units, of which the largest coordinate has 2³⁰: sixteen units of float32's last
# place, for origin, direction times the way, and Embree's own products.
_MARGIN = 16 * 2.0**6

OUTWARDS = 1 + 2.0**-22
"""Reaches are rounded to float32, outwards."""

# A sphere's row of float64: its box in Embree's float32, the lower corner and one number more, the upper corner and one number
# more; and whatever its kernel needs.
_BOX, SPHERE, _ROW = 0, 4, 18
REACH, UNIT, RAY = 0, 1, 2
"""A ray's row: how far it reaches, in lengths of its direction, and Embree's unit; whatever the kernel needs stands behind."""
_RAY_ROW = 9


def table_of(centres: Floats, reach: Floats, unit: float) -> Floats:
    """(n, _ROW): the boxes of spheres; their other numbers, from `SPHERE` on, are yet to be filled in.

    centres, reach : (3, n), camera space.
    """
    table = np.zeros((centres.shape[1], _ROW))
    boxes, reach = table[:, _BOX:SPHERE].view(np.float32), reach * unit + _MARGIN
    boxes[:, 0:3], boxes[:, 4:7] = (centres * unit - reach).T, (centres * unit + reach).T
    return table


def scene_of(table: Floats, meet: int) -> EmbreeScene:
    """A scene of spheres, ready for any thread.

    table : of `table_of`, which must live as long as the scene. meet : where the kernel is that tests them.
    """
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
    functions.rtcSetGeometryIntersectFunction(geometry, pointer(meet))
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


@numba.cfunc("void(uintp)", cache=True)
def _bounds(arguments):
    """RTCBoundsFunction. arguments : of the spheres, the sphere (and a time step), and where its box is wanted."""
    words = numba.carray(_memory(arguments), 3, np.int64)
    box = numba.carray(_memory(words[0] + ((words[1] & 0xFFFFFFFF) * _ROW + _BOX) * 8), 8, np.float32)
    wanted = numba.carray(_memory(words[2]), 8, np.float32)
    for number in range(8):
        wanted[number] = box[number]


@numba.njit(error_model="numpy")
def new_rays(packet):
    """(LANES, …) the rays of a packet in float64, and what must live as long as the packet is traced."""
    rays = np.empty((LANES, _RAY_ROW))
    query = np.empty(2, np.int64)
    query[0], query[1] = -1, rays.ctypes.data  # RTCRayQueryContext, of no instance; and what `questions` reads
    packet.view(np.int64)[ARGUMENTS, 1] = query.ctypes.data
    return rays, query


@numba.njit(error_model="numpy")
def questions(arguments):
    """What a kernel is asked that is an RTCIntersectFunctionN: the number of lanes, which of them are asked, the sphere's row,
    all rays' rows, and the packet.

    arguments : of which lanes are asked, of the spheres, the sphere, the query, the lanes, how many lanes and the geometry.
    """
    words = numba.carray(_memory(arguments), 6, np.int64)
    lanes = words[5] & 0xFFFFFFFF
    asked = numba.carray(_memory(words[0]), lanes, np.int32)
    sphere = numba.carray(_memory(words[1] + (words[2] & 0xFFFFFFFF) * _ROW * 8), _ROW, np.float64)
    query = numba.carray(_memory(words[3]), 2, np.int64)
    rays = numba.carray(_memory(query[1]), (LANES, _RAY_ROW), np.float64)
    return lanes, asked, sphere, rays, numba.carray(_memory(words[4]), (GEOMETRY + 1) * lanes, np.int32)


@numba.njit(error_model="numpy")
def ray_of(packet, lanes, lane):
    """Which of the rays' rows a lane has."""
    return packet[ID * lanes + lane]


@numba.njit(error_model="numpy")
def answer(arguments, packet, lanes, lane, ray, distance):
    """The ray in a lane meets the sphere that was asked about, as far off as this, and reaches no farther."""
    words = numba.carray(_memory(arguments), 6, np.int64)
    ray[REACH] = distance
    packet.view(np.float32)[FAR * lanes + lane] = np.float32(distance * ray[UNIT] * OUTWARDS)
    packet[PRIMITIVE * lanes + lane] = words[2] & 0xFFFFFFFF
    packet[GEOMETRY * lanes + lane] = words[5] >> 32


@numba.njit(error_model="numpy")
def root(centre_x, centre_y, centre_z, way_x, way_y, way_z, tangent, near):
    """Where a ray from the origin first meets the unit sphere about a centre, or inf; as rays/balls.py has it.

    tangent : the squared distance of the centre less 1. near : below which of it the textbook's discriminant is taken.
    """
    squared = way_x * way_x + way_y * way_y + way_z * way_z
    along = centre_x * way_x + centre_y * way_y + centre_z * way_z
    if not along > 0:
        return np.inf
    foot = along / squared
    if tangent < near:
        discriminant = along * foot - tangent
    else:
        x, y, z = centre_x - foot * way_x, centre_y - foot * way_y, centre_z - foot * way_z
        discriminant = 1.0 - (x * x + y * y + z * z)
    if not discriminant >= 0:
        return np.inf
    return tangent / (along + np.sqrt(discriminant * squared))
