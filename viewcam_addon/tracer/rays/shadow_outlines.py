"""Which pixels the edge of a shadow crosses, of lamps without a size: of suns, points and spots.

Such edges are shadows of outlines: of the silhouettes, borders and spheres' outlines that the lamp sees, as the eye sees others
(outlines.py). From pieces of them a ray goes on, away from the lamp and close past the surface; what it meets gets the edge of
the shadow. On the plane of that triangle the shadow of the whole piece is known: a stroke, whose pixels are marked where the
eye can see it, and the lamp the piece. Pieces are cut until their shadows are short in the picture. The silhouettes themselves,
where they can be seen, are marked too: there the surface turns away from the light. So is the rim of a spot's cone.

**What is promised**: where the shadow of an outline falls on one thing, all of its edge is marked, but for as much at its ends
as half a step, `STEP` pixels. A thing that is met only between two rays, because it is narrower than the pieces are long, may
lack its edge: pieces are `COARSE` pixels long at most, at the depth behind which nine tenths of the picture lie.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, cross, dot, gather
from ..scene.lamps import Lamp, Spot, Sun
from .joints import Edges, Joints, corners_of
from .lamp_outlines import cone, place_of
from .marks import Strokes
from .points import Points, Surfaces
from .rims import BULGE, Rims, rims_lit_by_sun, rims_seen_from
from .space import Space
from .strokes import Canvas
from .triangles import Planes, Triangles
from .view import View

STEP, COARSE = 2.0, 16.0
"""Pixels: the longest shadow of a piece of an outline, and the longest piece."""

_MOST_AT_ONCE = 16  # pieces that one is cut into
_ROUNDS = 6
# How far past a surface a ray goes, relative to its largest coordinate: four times what Embree rounds it by.
_PAST = 2.0**-20
# How much nearer than a shadow something must be to hide it; what touches the surface does not.
_NEARER = 2.0**-8
# By how much the shadow of a piece is drawn longer, at both ends, so that it overlaps that of the next.
_OVERLAP = 0.25
# How far past the surface is asked again whether the lamp shines on a piece, of its length: where a fine mesh turns from the
# light, the pieces of its silhouette hide one another half.
_ASIDE = 0.5
_CIRCLE = 16  # pieces of a circle to begin with
_LAYERS = 16  # things without a shadow that light is followed through


@dataclass(frozen=True, eq=False)
class Light:
    """A lamp without a size in camera space.

    place : (3,), or of a sun the direction to it. is_sun, casts_shadow : as of the lamp.
    """

    place: Floats
    is_sun: bool
    casts_shadow: bool

    def ways(self, points: Floats) -> tuple[Floats, Floats]:
        """Unit directions (3, n) from the lamp to points, and how far, (n,)."""
        if self.is_sun:
            return np.broadcast_to(-self.place[:, None], points.shape), np.full(points.shape[1], np.inf)
        way = points - self.place[:, None]
        distance = np.sqrt(dot(way, way))
        return way / np.where(distance > 0, distance, 1.0), distance

    def rays(self, points: Floats) -> Floats:
        """(3, n) directions of any length, linear in the points."""
        return np.broadcast_to(-self.place[:, None], points.shape) if self.is_sun else points - self.place[:, None]

    def sides(self, triangles: Triangles, planes: Planes, handedness: float) -> Floats:
        """(m,) which side of triangles it shines on: positive where their corners run one way, negative where the other."""
        with np.errstate(all="ignore"):
            height = dot(planes.forms[:3], self.place) - (not self.is_sun)
            height *= planes.side
        edge_on = np.flatnonzero(~np.isfinite(height) | (planes.side == 0))
        if len(edge_on):  # as the eye sees them
            a, b, c = gather(triangles.vertices, triangles.corners[:, edge_on]).transpose(1, 0, 2)
            towards = self.place[:, None] - (0.0 if self.is_sun else a)
            height[edge_on] = dot(cross(b - a, c - a), towards) * -handedness
        return height


class Straight:
    """Edges of triangles as curves. starts, ends, third : (3, n), the third corners. largest : (n,), of their coordinates."""

    pieces, is_round, is_rim = 1, False, False

    def __init__(self, starts: Floats, ends: Floats, third: Floats) -> None:
        self._starts, self._ways, self._third = starts, ends - starts, third
        self.count = starts.shape[1]
        self._past = _PAST * np.maximum(np.abs(starts).max(axis=0, initial=0.0), np.abs(ends).max(axis=0, initial=0.0))
        self.primitives = np.full(self.count, -1)

    def at(self, which: Indices, part: Floats) -> Floats:
        return gather(self._starts, which) + part * gather(self._ways, which)

    def past(self, which: Indices, points: Floats, ahead: Floats, farther: Floats | float = 0.0) -> Floats:
        """Points just past the surface, seen along `ahead`, or farther past it."""
        aside = cross(ahead, gather(self._ways, which))
        length = np.sqrt(dot(aside, aside))
        aside /= np.where(length > 0, length, 1.0)
        inwards = dot(aside, gather(self._third, which) - points)
        return points - np.copysign(gather(self._past, which) + farther, inwards) * aside


class Round:
    """Outlines of spheres as curves. primitives : (n,) of the spheres."""

    pieces, is_round, is_rim = _CIRCLE, True, False

    def __init__(self, rims: Rims, centres: Floats, primitives: Indices) -> None:
        self._rims, self._centres, self.primitives = rims, centres, primitives
        self.count = rims.count

    def at(self, which: Indices, part: Floats) -> Floats:
        return self._rims.at(which, part)

    def past(self, which: Indices, points: Floats, ahead: Floats, farther: Floats | float = 0.0) -> Floats:
        """As of straight ones."""
        outward = points - gather(self._centres, which)
        return points + outward * ((_PAST * np.abs(points).max(axis=0) + farther) / np.sqrt(dot(outward, outward)))


class Rim(Round):
    """The rim of a spot's cone as a curve about the lamp, which is its centre."""

    is_rim = True

    def past(self, which: Indices, points: Floats, ahead: Floats, farther: Floats | float = 0.0) -> Floats:
        """Where its light comes from."""
        return gather(self._centres, which)


Curves = Straight | Round


class ShadowOutlines:
    """The outlines of shadows.

    canvas : the picture. typical : a depth behind which most of it lies.
    """

    def __init__(self, view: View, surfaces: Surfaces, space: Space, joints: Joints, canvas: Canvas, typical: float) -> None:
        self._view, self._surfaces, self._space, self._joints = view, surfaces, space, joints
        self._canvas, self._pixel = canvas, typical / max(canvas.distance)
        shadowless = [thing.hidden_from("shadow") for thing in (surfaces.triangles, surfaces.balls)]
        self._shadowless = np.concatenate(shadowless)

    def of(self, lamp: Lamp) -> Iterator[Strokes]:
        """Where the light of one lamp may end."""
        light = _light(lamp, self._view)
        triangles, balls = self._surfaces.triangles, self._surfaces.balls
        curves: list[Curves] = []
        edges = self._edges(light)
        if len(edges):
            curves.append(Straight(*corners_of(triangles, edges)))
        if balls.count:
            curves.append(self._outlines_of_balls(light))
        for some in curves:
            yield from self._of(light, some)
        if isinstance(lamp, Spot):
            yield from self._of(light, self._rim(lamp, light))

    def _edges(self, light: Light) -> Edges:
        triangles, joints = self._surfaces.triangles, self._joints
        silhouettes = joints.silhouettes(light.sides(triangles, self._surfaces.planes, self._view.handedness))
        edges = np.concatenate([gather(joints.pairs[0], silhouettes), joints.borders])
        return edges[~gather(self._shadowless, edges >> 2)]

    def _outlines_of_balls(self, light: Light) -> Round:
        balls, count = self._surfaces.balls, self._surfaces.triangles.count
        shape = balls.axes.swapaxes(0, 1)
        lengths = (balls.axes * balls.axes).sum(axis=1)
        towards = light.place[:, None] if light.is_sun else balls.centres - light.place[:, None]
        away = np.stack([dot(axis, towards) for axis in balls.axes]) / lengths
        if light.is_sun:
            rims, kept = rims_lit_by_sun(shape, balls.centres, away), ~self._shadowless[count:]
        else:
            tangent = dot(away, away) - 1.0
            with np.errstate(all="ignore"):
                rims = rims_seen_from(shape, balls.centres, away, tangent)
            kept = ~self._shadowless[count:] & (tangent > 0)
        kept = np.flatnonzero(kept)
        rims = Rims(*(gather(part, kept) for part in (rims.middle, rims.cosine, rims.sine)))
        return Round(rims, gather(balls.centres, kept), count + kept)

    def _rim(self, lamp: Spot, light: Light) -> Rim:
        rays, place = cone(lamp, self._view), light.place[:, None]
        return Rim(Rims(place + rays.middle, rays.cosine, rays.sine), place, np.array([-1]))

    def _of(self, light: Light, curves: Curves) -> Iterator[Strokes]:
        """What one lamp makes of curves: where they lie themselves, and where their shadows do."""
        pieces = _Pieces.whole(curves)
        for last in [False] * _ROUNDS + [True]:
            pieces = pieces.some(self._may_matter(light, curves, pieces))
            if not len(pieces.which):
                return
            parts = [*self._own(curves, pieces), *self._shadows(light, curves, pieces)]
            cuts = np.ones(len(pieces.which), np.intp) if last else self._cuts(curves, pieces, parts)
            done = cuts == 1
            yield from self._lit(light, curves, pieces, [part.of(done) for part in parts])
            if done.all():
                return
            pieces = pieces.cut(np.flatnonzero(~done), cuts[~done])

    def _may_matter(self, light: Light, curves: Curves, pieces: "_Pieces") -> Indices:
        """The pieces that, or whose shadows, may lie in the picture, as far as its four sides tell."""
        start, end, middle = (curves.at(pieces.which, part) for part in (*pieces.ends(), pieces.first + pieces.width / 2))
        bulge = middle - (start + end) / 2
        begins = [np.broadcast_to(light.place[:, None], start.shape)] * 2 if curves.is_rim else [start, end]
        ways = [light.rays(start), light.rays(end)]
        outside = np.zeros(len(pieces.which), bool)
        for slack, *values in zip(*(self._canvas.planes(some)[:4] for some in (bulge, *begins, *ways)), strict=True):
            # What lies between the ends of an arc lies within twice its bulge of what lies between them on its chord.
            slack = 2 * np.abs(slack)
            begin, way = np.maximum(*values[:2]) + slack, np.maximum(*values[2:])
            outside |= (begin < 0) & (way + (0.0 if light.is_sun else slack) <= 0)
        return np.flatnonzero(~outside)

    def _starts(self, light: Light, curves: Curves, pieces: "_Pieces", farther: Floats | float = 0.0) -> tuple[Points, Floats]:
        """Where light goes on past the middles of pieces, and in which directions."""
        points = curves.at(pieces.which, pieces.first + pieces.width / 2)
        ahead, _ = light.ways(points)
        past = curves.past(pieces.which, points, ahead, farther)
        if not curves.is_rim:
            ahead, _ = light.ways(past)
        return _points(past, ahead, gather(curves.primitives, pieces.which)), ahead

    def _own(self, curves: Curves, pieces: "_Pieces") -> "list[_Part]":
        """Where pieces lie themselves."""
        if curves.is_rim:
            return []
        start, end, middle = (curves.at(pieces.which, part) for part in (*pieces.ends(), pieces.first + pieces.width / 2))
        return [_Part(np.arange(len(pieces.which)), start, end, middle, np.inf)]

    def _shadows(self, light: Light, curves: Curves, pieces: "_Pieces") -> "Iterator[_Part]":
        """Where their shadows lie."""
        if not (light.casts_shadow or curves.is_rim):
            return
        points, ahead = self._starts(light, curves, pieces)
        which = np.arange(points.count)
        ends = [curves.at(pieces.which, part) for part in pieces.ends(_OVERLAP)]
        ways = [light.ways(end)[0] for end in ends]
        if curves.is_rim:
            ends = [points.position, points.position]
        for _ in range(_LAYERS):
            some = points.at(which)
            found = self._space.found(some, gather(ahead, which), "camera")
            met = np.flatnonzero(found >= 0)
            if not len(met):
                return
            primitive, which = found[met], which[met]
            reached, _ = self._surfaces.met(primitive, gather(some.position, met), gather(ahead, which))
            start, end = (
                _on_planes(reached, gather(end, which), gather(way, which)) for end, way in zip(ends, ways, strict=True)
            )
            yield _Part(which, start, end, reached.position, STEP * (1 + 2 * _OVERLAP))
            goes_on = gather(self._shadowless, primitive) if light.casts_shadow else np.ones(len(met), bool)
            if not goes_on.any():
                return
            onwards = np.flatnonzero(goes_on)
            which = which[onwards]
            position = points.position.copy()
            position[:, which] = gather(reached.position, onwards)
            primitives, offsets = points.primitive.copy(), points.offset.copy()
            primitives[which], offsets[which] = reached.primitive[onwards], reached.offset[onwards]
            normals = points.normal.copy()
            normals[:, which] = gather(reached.normal, onwards)
            points = replace(points, position=position, normal=normals, primitive=primitives, offset=offsets)

    def _cuts(self, curves: Curves, pieces: "_Pieces", parts: "list[_Part]") -> Indices:
        """Into how many pieces each is to be cut."""
        cuts = pieces.lengths(curves) / (self._pixel * COARSE)
        for part in parts:
            stroke, first, last = self._canvas.clipped(part.starts, part.ends)
            way = last - first
            length = np.hypot(way[0], way[1])
            middle = self._canvas.place(gather(part.middles, stroke)) - first
            with np.errstate(all="ignore"):
                bulge = np.where(
                    length > BULGE, np.abs(middle[0] * way[1] - middle[1] * way[0]) / length, np.hypot(middle[0], middle[1])
                )
            # A half of an arc bulges a fourth.
            wanted = np.maximum(length / part.longest, np.sqrt(np.nan_to_num(bulge) / BULGE))
            np.maximum.at(cuts, part.which[stroke], wanted)
        return np.clip(np.ceil(np.minimum(cuts, _MOST_AT_ONCE)), 1, _MOST_AT_ONCE).astype(np.intp)

    def _lit(self, light: Light, curves: Curves, pieces: "_Pieces", parts: "list[_Part]") -> Iterator[Strokes]:
        """Those strokes that lie in the picture and whose pieces the lamp shines on."""
        shown = [part.at(self._canvas.clipped(part.starts, part.ends)[0]) for part in parts]
        asked = np.zeros(len(pieces.which), bool)
        for part in shown:
            asked[part.which] = True
        lit = np.ones(len(asked), bool)
        if light.casts_shadow and not curves.is_rim and asked.any():
            some = np.flatnonzero(asked)
            for farther in (0.0, _ASIDE):
                again = pieces.some(some)
                points, ahead = self._starts(light, curves, again, farther * again.lengths(curves))
                dark = self._space.blocked(points, -ahead, light.ways(points.position)[1])
                lit[some] = ~dark
                some = some[dark]
        for part in shown:
            part = part.of(lit)
            nearest = np.minimum(part.starts[2], part.ends[2]) * (1 - _NEARER)
            yield Strokes(part.starts, part.ends, part.starts, nearest, BULGE * curves.is_round)


@dataclass(frozen=True, eq=False)
class _Part:
    """What pieces of curves make in the picture, themselves or their shadows.

    which : (n,) pieces. starts, ends, middles : (3, n). longest : pixels that it may be long.
    """

    which: Indices
    starts: Floats
    ends: Floats
    middles: Floats
    longest: float

    def at(self, some: Indices) -> "_Part":
        places = (gather(points, some) for points in (self.starts, self.ends, self.middles))
        return _Part(self.which[some], *places, self.longest)

    def of(self, pieces: NDArray[np.bool_]) -> "_Part":
        """What some of the pieces make. pieces : whether, for each."""
        return self.at(np.flatnonzero(pieces[self.which]))


@dataclass(frozen=True, eq=False)
class _Pieces:
    """n pieces of curves. which : (n,) curve. first, width : (n,) where on it they begin and how long they are, of 1."""

    which: Indices
    first: Floats
    width: Floats

    @staticmethod
    def whole(curves: Curves) -> "_Pieces":
        which = np.repeat(np.arange(curves.count), curves.pieces)
        first = np.tile(np.arange(curves.pieces) / curves.pieces, curves.count)
        return _Pieces(which, first, np.full(len(which), 1 / curves.pieces))

    def ends(self, overlap: float = 0.0) -> tuple[Floats, Floats]:
        return self.first - overlap * self.width, self.first + (1 + overlap) * self.width

    def lengths(self, curves: Curves) -> Floats:
        """(n,) in units of the world."""
        start, end = (curves.at(self.which, part) for part in self.ends())
        return np.sqrt(dot(end - start, end - start))

    def some(self, chosen: Indices) -> "_Pieces":
        return _Pieces(self.which[chosen], self.first[chosen], self.width[chosen])

    def cut(self, chosen: Indices, into: Indices) -> "_Pieces":
        """Some of them in so many parts each."""
        some, number = np.repeat(chosen, into), np.arange(into.sum()) - np.repeat(np.cumsum(into) - into, into)
        width = self.width[some] / np.repeat(into, into)
        return _Pieces(self.which[some], self.first[some] + number * width, width)


def _light(lamp: Lamp, view: View) -> Light:
    if isinstance(lamp, Sun):
        return Light(view.axes @ np.array(lamp.towards), True, lamp.casts_shadow)
    return Light(view.axes @ (place_of(lamp) - view.eye), False, lamp.casts_shadow)


def _points(position: Floats, ahead: Floats, primitives: Indices) -> Points:
    """Points from which rays start as they are."""
    count = position.shape[1]
    return Points(
        position=np.ascontiguousarray(position),
        normal=np.ascontiguousarray(ahead),
        shading=ahead,
        backside=np.zeros(count, bool),
        material=np.zeros(count, np.int32),
        primitive=primitives,
        offset=np.zeros(count),
        uv=None,
        vertex_colour=None,
    )


def _on_planes(reached: Points, starts: Floats, ways: Floats) -> Floats:
    """(3, n): where rays meet the planes that touch surfaces at points; those points where they never do."""
    with np.errstate(all="ignore"):
        distance = dot(reached.normal, reached.position - starts) / dot(reached.normal, ways)
        met = starts + distance * ways
    return np.where((distance > 0) & np.isfinite(distance), met, reached.position)
