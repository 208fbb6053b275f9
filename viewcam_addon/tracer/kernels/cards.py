"""The kernel of rays/cards.py: spheres that the eye may see, asked for by Embree (spheres.py)."""

import numba
import numpy as np

from ..arrays import Floats, Indices
from ..compiled.library import LANES, pointer_of
from ..rays.ellipsoids import NEAR, Ellipsoids
from .packets import FARTHEST, aim, kernel, meet, met, new_packet
from .spheres import OUTWARDS, RAY, REACH, SPHERE, UNIT, answer, new_rays, questions, ray_of, root, scene_of, table_of

# What is known of a sphere: the way into its own space, where its radius is 1, its centre there, and the squared tangent to it.
_INVERSE, _CENTRE, _TANGENT = SPHERE, SPHERE + 9, SPHERE + 12
# Of a ray: where it goes, and from which depth on anything is seen.
_X, _Y, _START = RAY, RAY + 1, RAY + 2


def cards_of(ellipsoids, first, unit):
    return _Cards(ellipsoids, first, unit)


class _Cards:
    """As rays/cards.Cards, but without cards."""

    def __init__(self, ellipsoids: Ellipsoids, first: int, unit: float) -> None:
        self._first, self._unit = first, unit
        positions = ellipsoids.positions[:, first:]
        self._table = table_of(positions, np.broadcast_to(ellipsoids.reach[first:], positions.shape), unit)
        self._table[:, _INVERSE:_CENTRE] = ellipsoids.inverse[:, first:].T
        self._table[:, _CENTRE:_TANGENT] = ellipsoids.centres[:, first:].T
        self._table[:, _TANGENT] = ellipsoids.tangent[first:]
        self._scene = scene_of(self._table, _meet.address)

    def before(self, nearest: Floats, start: float, x: Floats, y: Floats) -> Indices:
        found = np.empty(len(x), np.intp)
        _trace(pointer_of(self._scene), self._unit, x, y, float(start), nearest, found)
        found[found >= 0] += self._first
        return found


@numba.cfunc("void(uintp)", cache=True)
def _meet(arguments):
    """Ellipsoids.depth of each ray that is asked for."""
    lanes, asked, sphere, rays, packet = questions(arguments)
    for lane in range(lanes):
        if asked[lane] == 0:
            continue
        ray = rays[ray_of(packet, lanes, lane)]
        x, y = ray[_X], ray[_Y]
        way_x = sphere[_INVERSE] * x + sphere[_INVERSE + 3] * y + sphere[_INVERSE + 6]
        way_y = sphere[_INVERSE + 1] * x + sphere[_INVERSE + 4] * y + sphere[_INVERSE + 7]
        way_z = sphere[_INVERSE + 2] * x + sphere[_INVERSE + 5] * y + sphere[_INVERSE + 8]
        centre_x, centre_y, centre_z = sphere[_CENTRE], sphere[_CENTRE + 1], sphere[_CENTRE + 2]
        depth = root(centre_x, centre_y, centre_z, way_x, way_y, way_z, sphere[_TANGENT], NEAR)
        if ray[_START] <= depth < ray[REACH]:
            answer(arguments, packet, lanes, lane, ray, depth)


@kernel
def _trace(scene, unit, x, y, start, nearest, found):
    """Which sphere rays meet nearer than `nearest` but not before `start`, −1 for none, and how deep, into `nearest`."""
    packet = new_packet(True)
    rays, _query = new_rays(packet)
    zero, one = np.float32(0), np.float32(1)
    for first in range(0, found.size, LANES):
        count = min(LANES, found.size - first)
        for lane in range(count):
            which = first + lane
            ray = rays[lane]
            ray[REACH], ray[UNIT], ray[_X], ray[_Y], ray[_START] = nearest[which], unit, x[which], y[which], start
            length = np.float32(min(nearest[which] * unit * OUTWARDS, FARTHEST))
            aim(packet, lane, zero, zero, zero, np.float32(x[which]), np.float32(y[which]), one, length)
        meet(scene, packet, count)
        for lane in range(count):
            found[first + lane], nearest[first + lane] = met(packet, lane), rays[lane, REACH]
