"""Which spheres stand before the eye: found through cards.

Each sphere hides behind a rectangle that covers its outline and stands before it, parallel to the view plane. Embree gives the
first card, float64 the exact sphere behind it, and the ray goes on behind that card until the next one stands behind the best
hit. Since cards are parallel and no two share a depth, all rays meet them in the same order and step over none.

Rejected: closed boxes round the spheres, where a ray that continues behind one's entry skips, by float32's rounding, the
entries of others. With numba Embree asks for each sphere itself, and there are no cards.
"""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices
from ..compiled.standing import or_compiled
from .ellipsoids import Ellipsoids
from .embree import EmbreeScene, embree_scene

# Cards overlap the outline by 16 units of float32's last place, more than card and ray are rounded by, and follow one another
# as far apart in depth, so that a ray that starts half-way between two has one surely behind it and the other before it.
_MARGIN = 2.0**-20
_SPACING = 2.0**-20
_FAR = 1e37


@or_compiled
def cards_of(ellipsoids: Ellipsoids, first: int, unit: float) -> "Cards":
    """The spheres from `first` on; the arguments are those of `Cards`."""
    return Cards(ellipsoids, first, unit)


class Cards:
    """Spheres that stand wholly before the eye's plane.

    first : they are the ellipsoids from this number on. unit : Embree's units in one of the world.
    """

    def __init__(self, ellipsoids: Ellipsoids, first: int, unit: float) -> None:
        self._ellipsoids, self._first, self._unit = ellipsoids, first, unit
        self._cards, self._depths = _cards(ellipsoids, first, unit)

    def before(self, nearest: Floats, start: float, x: Floats, y: Floats) -> Indices:
        """The sphere that each ray (x, y, 1) meets first, −1 for none, (n,); counted as the ellipsoids.

        nearest : (n,) depths that are seen already; those of the spheres are put in. start : the depth from which on anything
        is seen.
        """
        found = np.full(len(x), -1, np.intp)
        directions = np.stack([x, y, np.ones_like(x)], axis=1).astype(np.float32)
        rays, origin = np.arange(len(x)), np.zeros(len(x), np.float32)  # origins in Embree's unit
        while len(rays):
            ahead = directions[rays]
            limits = np.minimum(nearest[rays] * self._unit - origin, _FAR).astype(np.float32)
            card = self._cards.run(ahead * origin[:, None], ahead, dists=limits) >> 1
            behind = np.flatnonzero(card >= 0)
            rays, card = rays[behind], card[behind].astype(np.intp)
            sphere = card + self._first
            depth = self._ellipsoids.depth(sphere, x[rays], y[rays])
            nearer = (depth < nearest[rays]) & (depth >= start)
            nearest[rays[nearer]], found[rays[nearer]] = depth[nearer], sphere[nearer]
            origin = self._depths[card] * np.float32(1 + _SPACING / 2)
            onwards = np.flatnonzero(origin < nearest[rays] * self._unit)
            rays, origin = rays[onwards], origin[onwards]
        return found


def _cards(ellipsoids: Ellipsoids, first: int, unit: float) -> tuple["EmbreeScene", NDArray[np.float32]]:
    """A card of two triangles before each sphere, and the cards' depths, in Embree's unit."""
    nearest = ellipsoids.nearest[first:] * unit
    place = np.arange(len(nearest)) * _SPACING
    # The greatest depths that are not behind the spheres and grow by the spacing from card to card.
    depth = np.exp(np.minimum.accumulate((np.log(nearest) - place)[::-1])[::-1] + place) * (1 - _SPACING)
    depth = depth.astype(np.float32)
    x0, x1, y0, y1 = ellipsoids.bounds[:, first:]
    margin = _MARGIN * (1 + np.abs([x0, x1, y0, y1]).max(axis=0))
    x0, x1, y0, y1 = x0 - margin, x1 + margin, y0 - margin, y1 + margin
    vertices = np.empty((len(depth), 4, 3))
    vertices[:, :, 0] = np.stack([x0, x1, x1, x0], axis=1) * depth[:, None]
    vertices[:, :, 1] = np.stack([y0, y0, y1, y1], axis=1) * depth[:, None]
    vertices[:, :, 2] = depth[:, None]
    corners = np.array([[0, 1, 2], [0, 2, 3]]) + 4 * np.arange(len(depth))[:, None, None]
    return embree_scene(vertices.reshape(-1, 3), corners.reshape(-1, 3).astype(np.int32)), depth
