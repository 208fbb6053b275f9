"""Kernels of rays/crowd.py: all spheres that rays from anywhere may meet, asked for by Embree (spheres.py)."""

from collections.abc import Iterator

import numba
import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, gather
from ..compiled.library import LANES, pointer_of
from ..rays.balls import NEAR, Balls
from ..rays.crowd import Hits
from .packets import FARTHEST, aim, kernel, meet, met, new_packet
from .sorting import KEYS, RAYS, sort
from .spheres import OUTWARDS, RAY, REACH, SPHERE, UNIT, answer, new_rays, questions, ray_of, root, scene_of, table_of

# What is known of a sphere: its centre, one over its radius, the way into its object's space, and its number.
_CENTRE, _SCALE, _INVERSE, _NUMBER = SPHERE, SPHERE + 3, SPHERE + 4, SPHERE + 13
# Of a ray: where it starts, its direction, and the number of the sphere that it leaves.
_START, _WAY, _LEAVING = RAY, RAY + 3, RAY + 6


def crowd_of(balls, visible, unit):
    return _Crowd(balls, visible, unit)


class _Crowd:
    """As rays/crowd.Crowd."""

    def __init__(self, balls: Balls, visible: NDArray[np.bool_], unit: float) -> None:
        self._chosen, self._unit = np.flatnonzero(visible), unit
        self._table = _table(balls, self._chosen, unit)
        self._scene = scene_of(self._table, _meet.address)

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
    """What is known of each sphere, side by side."""
    axes, centres = gather(balls.axes, chosen), gather(balls.centres, chosen)
    table = table_of(centres, np.sqrt((axes * axes).sum(axis=0)), unit)
    table[:, _CENTRE:_SCALE] = centres.T
    table[:, _SCALE] = 1.0 / gather(balls.radii, chosen)
    table[:, _INVERSE:_NUMBER] = gather(balls.inverse, gather(balls.owner, chosen)).T
    table[:, _NUMBER] = gather(balls.number, chosen)
    return table


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
    tangent = centre_x * centre_x + centre_y * centre_y + centre_z * centre_z - 1.0
    if not tangent > 0:
        return np.inf
    return root(centre_x, centre_y, centre_z, way_x, way_y, way_z, tangent, NEAR)


@numba.cfunc("void(uintp)", cache=True)
def _meet(arguments):
    lanes, asked, ball, rays, packet = questions(arguments)
    for lane in range(lanes):
        ray = rays[ray_of(packet, lanes, lane)]
        if asked[lane] == 0 or ball[_NUMBER] == ray[_LEAVING]:
            continue
        distance = _distance(ball, ray)
        if distance < ray[REACH]:
            answer(arguments, packet, lanes, lane, ray, distance)


@kernel
def _trace(scene, unit, starts, directions, leaving, distances, found):
    """Which sphere rays meet nearer than `distances`, −1 for none, and how far off, into `distances`."""
    packet = new_packet(False)
    rays, _query = new_rays(packet)
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
                ray[REACH], ray[UNIT] = distances[which], unit
                ray[_START], ray[_START + 1], ray[_START + 2] = x, y, z
                ray[_WAY], ray[_WAY + 1], ray[_WAY + 2] = right, up, forward
                ray[_LEAVING] = leaving[which]
                length = np.float32(min(distances[which] * unit * OUTWARDS, FARTHEST))
                x, y, z = np.float32(x * unit), np.float32(y * unit), np.float32(z * unit)
                aim(packet, lane, x, y, z, np.float32(right), np.float32(up), np.float32(forward), length)
            meet(scene, packet, count)
            for lane in range(count):
                which = order[first + lane]
                found[which], distances[which] = met(packet, lane), rays[lane, REACH]
