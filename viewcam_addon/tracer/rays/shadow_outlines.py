"""Which pixels the edge of a shadow crosses, of lamps without a size: of suns, points and spots.

Such edges are shadows of outlines: of the silhouettes, borders and spheres' outlines that the lamp sees, as the eye sees others
(outlines.py). From pieces of them a ray goes on, away from the lamp and close past the surface; what it meets gets the edge of
the shadow. On the plane of that triangle the shadow of the whole piece is known: a stroke, whose pixels are marked where the
eye can see it, and the lamp the piece. Pieces are cut until their shadows are short in the picture. The silhouettes themselves,
where they can be seen, are marked too: there the surface turns away from the light. So is the rim of a spot's cone.

**What is promised**: where the shadow of an outline falls on one thing, all of its edge is marked, but for as much at its ends
as half a step, `STEP` pixels. A thing that is met only between two rays, because it is narrower than the pieces are long, may
lack its edge: pieces are `COARSE` pixels long at most, at the depth behind which 49 of 50 parts of the picture lie. So may the
shadow of where two things penetrate one another, which is no outline of either. Of six Suzannes in the sun on a floor, 64 rays
a pixel find 5,095 pixels with an edge: 9 of these are not marked, mostly where light grazes, and pixels beside them are.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats, Indices, dot, gather
from ..scene.lamps import Lamp, Spot
from .casters import Curves, Light, Pieces, Rim, Round, Straight, light_of
from .joints import Edges, Joints, corners_of
from .lamp_outlines import cone
from .marks import Strokes
from .points import Points, Surfaces
from .rims import BULGE, Rims, rims_lit_by_sun, rims_seen_from
from .space import Space
from .strokes import Canvas
from .view import View

STEP, COARSE = 2.0, 4.0
"""Pixels: the longest shadow of a piece of an outline, and the longest piece."""

_MOST_AT_ONCE = 16  # pieces that one is cut into
_ROUNDS = 6
_PIECES = 1 << 17  # at a time
# How much nearer than a shadow something must be to hide it, of its depth: what touches the surface does not; and in pixels: a
# round surface bends away from the stroke that stands for the shadow on it.
_NEARER, _PIXELS_NEARER = 2.0**-8, 4.0
# By how much the shadow of a piece is drawn longer, at both ends, so that it overlaps that of the next.
_OVERLAP = 0.25
# How far past the surface is asked again whether the lamp shines on a piece, of its length: where a fine mesh turns from the
# light, the pieces of its silhouette hide one another half.
_ASIDE = 0.5
_NEXT_TO = 1e-6  # of the farthest: what is nearer to a lamp throws no larger shadows
_LAYERS = 16  # things without a shadow that light is followed through


class ShadowOutlines:
    """The outlines of shadows.

    canvas : the picture. typical : a depth behind which most of it lies.
    """

    def __init__(self, view: View, surfaces: Surfaces, space: Space, joints: Joints, canvas: Canvas, typical: float) -> None:
        self._view, self._surfaces, self._space, self._joints = view, surfaces, space, joints
        self._canvas, self._typical, self._pixel = canvas, typical, typical / max(canvas.distance)
        self._not_nearer = max(1 - _NEARER - _PIXELS_NEARER / min(canvas.distance), 0.0)
        shadowless = [thing.hidden_from("shadow") for thing in (surfaces.triangles, surfaces.balls)]
        self._shadowless = np.concatenate(shadowless)

    def of(self, lamp: Lamp) -> Iterator[Strokes]:
        """Where the light of one lamp may end."""
        light = light_of(lamp, self._view)
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

    def _of(self, light: Light, curves: Curves, pieces: Pieces | None = None, cut: int = 0) -> Iterator[Strokes]:
        """What one lamp makes of curves: where they lie themselves, and where their shadows do.

        pieces : of them, all if it is None. cut : how many times they have been.
        """
        pieces = Pieces.whole(curves) if pieces is None else pieces
        for first in range(0, len(pieces.which), _PIECES):
            some = pieces.some(slice(first, first + _PIECES))
            some = some.some(self._may_matter(light, curves, some))
            if not len(some.which):
                continue
            parts = [*self._own(curves, some), *self._shadows(light, curves, some)]
            cuts = self._cuts(light, curves, some, parts) if cut < _ROUNDS else np.ones(len(some.which), np.intp)
            done = cuts == 1
            yield from self._lit(light, curves, some, [part.of(done) for part in parts])
            if not done.all():
                del parts
                yield from self._of(light, curves, some.cut(np.flatnonzero(~done), cuts[~done]), cut + 1)

    def _may_matter(self, light: Light, curves: Curves, pieces: Pieces) -> Indices:
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

    def _starts(self, light: Light, curves: Curves, pieces: Pieces, farther: Floats | float = 0.0) -> tuple[Points, Floats]:
        """Where light goes on past the middles of pieces, and in which directions."""
        points = curves.at(pieces.which, pieces.first + pieces.width / 2)
        ahead, _ = light.ways(points)
        past = curves.past(pieces.which, points, ahead, farther)
        if not curves.is_rim:
            ahead, _ = light.ways(past)
        return _points(past, ahead, gather(curves.primitives, pieces.which)), ahead

    def _own(self, curves: Curves, pieces: Pieces) -> "list[_Part]":
        """Where pieces lie themselves."""
        if curves.is_rim:
            return []
        start, end, middle = (curves.at(pieces.which, part) for part in (*pieces.ends(), pieces.first + pieces.width / 2))
        return [_Part(np.arange(len(pieces.which)), start, end, middle, np.inf)]

    def _shadows(self, light: Light, curves: Curves, pieces: Pieces) -> "Iterator[_Part]":
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

    def _cuts(self, light: Light, curves: Curves, pieces: Pieces, parts: "list[_Part]") -> Indices:
        """Into how many pieces each is to be cut."""
        cuts = self._spread(light, curves, pieces) / (self._pixel * COARSE)
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

    def _spread(self, light: Light, curves: Curves, pieces: Pieces) -> Floats:
        """(n,) how long the shadows of pieces are at the depth that is typical, if they don't fall aslant."""
        lengths = pieces.lengths(curves)
        if light.is_sun:
            return lengths
        _, distance = light.ways(curves.at(pieces.which, pieces.first + pieces.width / 2))
        farthest = np.sqrt(dot(light.place, light.place)) + self._typical
        return lengths * np.maximum(farthest / np.maximum(distance, _NEXT_TO * farthest), 1.0)

    def _lit(self, light: Light, curves: Curves, pieces: Pieces, parts: "list[_Part]") -> Iterator[Strokes]:
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
            nearest = np.minimum(part.starts[2], part.ends[2]) * self._not_nearer
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
