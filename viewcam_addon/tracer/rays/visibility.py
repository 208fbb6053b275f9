"""Which primitive each ray from the eye meets first: Embree's answer, or that of plain NumPy.

A primitive is a number, triangles first and spheres after them; −1 is none. Rays are points (x, y) of the view plane at
distance 1 (see view.py). Only depths within the clip range count: what lies before it is looked through.

**Spheres** are found in cards.py. Those that reach behind the eye's plane are tested by all rays of a tile that they touch.

**Wide triangles**, which reach a hundred times as far as they come near to the eye, as a ground plane does, are tested by all
rays in float64: Embree would round their distance with that of their corners, and show what stands behind them, or hides what
lies on them.

embreex knows no nearest distance, so a ray starts where the clip range does.

**Corners** of triangles may let a ray slip through that passes close by (corners.py). Then four rays round it are traced
too, and where three of them meet something before what the ray itself met, the nearest of that is what it meets.
"""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, gather
from ..compiled.standing import or_compiled
from .cards import cards_of
from .corners import REACH, Corners
from .edges import Edges
from .ellipsoids import Ellipsoids
from .embree import EmbreeScene, scene_of, unit_of
from .triangles import Planes, Triangles

# By how much bounds are widened, relative to 1 and themselves.
_MARGIN = 2.0**-20
_FAR = 1e37

# Where rays beside one that passes close by a corner go: eleven units of float32's last place away, twice as far as Embree was
# ever seen to err, and no farther than must be, since the mesh may be fine.
_AROUND = np.array([[-0.5, -0.5, 0.5, 0.5], [-0.5, 0.5, -0.5, 0.5]])[:, :, None] * REACH

# By how much wide triangles overlap those beside them, whose edges Embree sees rounded by 8 · 2⁻²⁴ of their corners' distances.
_OVERLAP = 2.0**-21


class Visibility(Protocol):
    def first(self, x: Floats, y: Floats, close: Indices | None = None, run: int | None = None) -> Indices:
        """The primitive that each ray meets first, or −1.

        x, y : (n,) float64. close : which of them `close` found, if these are rays of pixel centres. run : how many of them
        belong together, a row of pixels for example. Which of two triangles at the very same depth a ray meets can depend on
        the rays that it is traced with: on those of its run only, if that is given.
        """

    def close(self, x: Floats, y: Floats) -> Indices | None:
        """Which pixels want care, in order, counted along the rows, or None if that must be asked ray by ray.

        x : (width,) of the columns' centres. y : (height,) of the rows'.
        """


def visibility(triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids, clip: tuple[float, float]) -> Visibility:
    """Embree where there is its wheel, otherwise plain NumPy."""
    return (Plain if EmbreeScene is None else Embree)(triangles, planes, ellipsoids, clip)


class Embree:
    """Embree finds triangles and spheres in float32; depths are compared in float64."""

    def __init__(self, triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids, clip: tuple[float, float]) -> None:
        self._planes, self._ellipsoids = planes, ellipsoids
        self._start, self._end = clip
        self._triangle_count = triangles.count
        self._unit = _embree_unit(triangles, ellipsoids)
        self._corners = Corners(triangles.vertices)
        hidden = triangles.hidden_from("camera")
        self._wide = planes.wide[~hidden[planes.wide]]
        self._wide_edges = Edges(triangles, self._wide)
        self._wide_edges.overlap(_OVERLAP)
        hidden[planes.wide] = True  # from Embree
        self._triangles = scene_of(triangles, hidden, self._unit)
        self._without_card = int(np.count_nonzero(np.isinf(ellipsoids.bounds[0])))
        behind_cards = ellipsoids.count > self._without_card
        self._cards = cards_of(ellipsoids, self._without_card, self._unit) if behind_cards else None

    def close(self, x: Floats, y: Floats) -> Indices | None:
        return self._corners.near_pixels(x, y)

    def first(self, x: Floats, y: Floats, close: Indices | None = None, run: int | None = None) -> Indices:
        if self._triangles is None:
            found = np.full(len(x), -1, np.intp)
        else:
            found = self._first_triangle(x, y, run or len(x))
            if close is None:
                close = self._corners.near(x, y)
            if len(close):
                found[close] = self._without_slips(found[close], x[close], y[close])
        if len(self._wide):
            self._wide_before(found, x, y)
        if self._ellipsoids.count:
            self._spheres_before(found, x, y)
        return found

    def _first_triangle(self, x: Floats, y: Floats, run: int) -> Indices:
        length = min((self._end - self._start) * self._unit, _FAR)
        return first_triangles(self._triangles, self._start * self._unit, length, x, y, run)

    def _without_slips(self, found: Indices, x: Floats, y: Floats) -> Indices:
        """What rays that pass close by a corner meet, from what they found and what four rays round each of them find.

        A ray slipped through if what it found lies farther behind three of the four than they do behind one another.
        """
        distance = np.maximum(np.abs(x), np.abs(y))
        aside = distance * np.maximum(distance, 1.0)
        around = (x + _AROUND[0] * aside).ravel(), (y + _AROUND[1] * aside).ravel()
        beside = self._first_triangle(*around, run=1)
        depths = self._depth(beside, *around).reshape(4, -1)
        nearest, _, third, _ = np.sort(depths, axis=0)
        with np.errstate(invalid="ignore"):  # where three see nothing, it is no slip
            slips = np.flatnonzero(self._depth(found, x, y) > third + (third - nearest))
        if len(slips):
            found[slips] = beside.reshape(4, -1)[depths[:, slips].argmin(axis=0), slips]
        return found

    def _wide_before(self, found: Indices, x: Floats, y: Floats) -> None:
        """Put wide triangles into `found` where they stand before the triangle there."""
        nearest = self._depth(found, x, y)
        for number, triangle in enumerate(self._wide):
            met = np.flatnonzero(self._wide_edges.inside(np.array([number]), x, y))
            depth = self._planes.depth(np.array([triangle]), x[met], y[met])
            nearer = (depth < nearest[met]) & (depth > 0) & (depth >= self._start) & (depth <= self._end)
            nearest[met[nearer]], found[met[nearer]] = depth[nearer], triangle

    def _depth(self, found: Indices, x: Floats, y: Floats) -> Floats:
        """Depths of the triangles that were found, inf where none was."""
        return np.where(found >= 0, self._planes.depth(found, x, y), np.inf)

    def _spheres_before(self, found: Indices, x: Floats, y: Floats) -> None:
        """Put spheres into `found` where they stand before the triangle there."""
        nearest = np.full(len(x), self._end, np.float64)
        met = np.flatnonzero(found >= 0)
        nearest[met] = self._planes.depth(found[met], x[met], y[met])
        for sphere in _touching(self._ellipsoids, self._without_card, x, y):
            depth = self._ellipsoids.depth(np.array([sphere]), x, y)
            nearer = (depth < nearest) & (depth >= self._start)
            nearest[nearer], found[nearer] = depth[nearer], self._triangle_count + sphere
        if self._cards is not None:
            spheres = self._cards.before(nearest, self._start, x, y)
            met = np.flatnonzero(spheres >= 0)
            found[met] = self._triangle_count + spheres[met]


@or_compiled
def first_triangles(embree: "EmbreeScene", start: float, length: float, x: Floats, y: Floats, run: int) -> Indices:
    """The triangle that each ray (x, y, 1) meets first, or −1, from the depth `start` on as far as `length` behind it.

    run : as in `Visibility.first`. Here each ray is traced by itself.
    """
    directions = _directions(x, y)
    return embree.run(directions * np.float32(start), directions, dists=length).astype(np.intp)


def _directions(x: Floats, y: Floats) -> NDArray[np.float32]:
    directions = np.empty((len(x), 3), np.float32)
    directions[:, 0], directions[:, 1], directions[:, 2] = x, y, 1
    return directions


def _embree_unit(triangles: Triangles, ellipsoids: Ellipsoids) -> float:
    """Embree's units in one of the world."""
    extents = np.abs(ellipsoids.positions).max(axis=0, initial=0.0) + ellipsoids.reach
    return unit_of(max(triangles.extent, extents.max(initial=0.0)))


class Plain:
    """Every ray against every primitive near it, in float64: slow, and watertight by what rounding could lose."""

    _RAYS, _CANDIDATES = 256, 2048  # at a time: some arrays of 4 MB

    def __init__(self, triangles: Triangles, planes: Planes, ellipsoids: Ellipsoids, clip: tuple[float, float]) -> None:
        self._planes, self._ellipsoids = planes, ellipsoids
        self._start, self._end = clip
        self._triangle_count = triangles.count
        self._edges = Edges(triangles)
        self._bounds = np.concatenate([_triangle_bounds(self._edges.corners, planes), ellipsoids.bounds], axis=1)
        hidden = np.flatnonzero(triangles.hidden_from("camera"))
        self._bounds[0::2, hidden], self._bounds[1::2, hidden] = np.inf, -np.inf
        self._bounds += np.array([[-1], [1], [-1], [1]]) * _MARGIN * (1 + np.nan_to_num(np.abs(self._bounds), posinf=0.0))

    def close(self, x: Floats, y: Floats) -> None:
        """None wants care."""

    def first(self, x: Floats, y: Floats, close: Indices | None = None, run: int | None = None) -> Indices:
        found = np.full(len(x), -1, np.intp)
        nearest = np.full(len(x), np.inf)
        near_all = self._candidates(np.arange(self._bounds.shape[1]), x, y)
        for start in range(0, len(x), self._RAYS):
            part = slice(start, start + self._RAYS)
            near = self._candidates(near_all, x[part], y[part])
            for first in range(0, len(near), self._CANDIDATES):
                some = near[first : first + self._CANDIDATES]
                depth = self._depths(some, x[part, None], y[part, None])
                best = depth.argmin(axis=1)
                best_depth = np.take_along_axis(depth, best[:, None], axis=1)[:, 0]
                nearer = best_depth < nearest[part]
                nearest[part] = np.where(nearer, best_depth, nearest[part])
                found[part] = np.where(nearer, some[best], found[part])
        return found

    def _candidates(self, primitives: Indices, x: Floats, y: Floats) -> Indices:
        if not len(x):
            return primitives[:0]
        x0, x1, y0, y1 = gather(self._bounds, primitives)
        return primitives[(x0 <= x.max()) & (x1 >= x.min()) & (y0 <= y.max()) & (y1 >= y.min())]

    def _depths(self, primitives: Indices, x: Floats, y: Floats) -> Floats:
        """(n, k) depths at which n rays meet k primitives, inf where they don't or where the depth is clipped."""
        split = np.searchsorted(primitives, self._triangle_count)
        triangles, spheres = primitives[:split], primitives[split:] - self._triangle_count
        inside = self._edges.inside(triangles, x, y)
        depth = np.concatenate(
            [np.where(inside, self._planes.depth(triangles, x, y), np.inf), self._ellipsoids.depth(spheres, x, y)], axis=1
        )
        return np.where((depth > 0) & (depth >= self._start) & (depth <= self._end), depth, np.inf)


def _triangle_bounds(corners: Floats, planes: Planes) -> Floats:
    """(4, m) bounds of triangles in the view plane, as in `Ellipsoids`; empty where a triangle can't be seen."""
    least, greatest = planes.span
    with np.errstate(all="ignore"):
        across = corners[:, :2] / corners[:, 2:]
    bounds = np.stack([across[:, 0].min(axis=0), across[:, 0].max(axis=0), across[:, 1].min(axis=0), across[:, 1].max(axis=0)])
    wide = ~(least > 2.0**-10 * greatest)
    bounds[0::2, wide], bounds[1::2, wide] = -np.inf, np.inf
    unseen = (greatest <= 0) | ~(planes.distance > 0)
    bounds[0::2, unseen], bounds[1::2, unseen] = np.inf, -np.inf
    return bounds


def _touching(ellipsoids: Ellipsoids, count: int, x: Floats, y: Floats) -> Indices:
    """Which of the first `count` spheres reach into the pyramid of the rays, by the balls round them."""
    (right, up, forward), reach = ellipsoids.positions[:, :count], ellipsoids.reach[:count]
    touching = np.ones(count, bool)
    for across, least, greatest in ((right, x.min(), x.max()), (up, y.min(), y.max())):
        touching &= across - least * forward >= -reach * np.hypot(1, least)
        touching &= greatest * forward - across >= -reach * np.hypot(1, greatest)
    return np.flatnonzero(touching)
