"""The outlines of lamps that the eye sees, as strokes. Lamps hide nothing; what stands before them hides them."""

from collections.abc import Iterator

import numpy as np

from ..arrays import Floats, dot, gather
from ..scene.lamps import Area, Lamp, Point, Spot, Sun
from .marks import Strokes
from .rims import BULGE, Rims, circles, rims_seen_from
from .strokes import Canvas
from .view import View

# Beyond which no clip plane is, and nothing stands.
_FAR = 1e30


def has_size(lamp: Lamp) -> bool:
    """Whether rays can run into it, and its shadows have soft edges."""
    return isinstance(lamp, Area) or (lamp.angle if isinstance(lamp, Sun) else lamp.radius) > 0


def place_of(lamp: Point | Spot) -> Floats:
    """(3,), world space."""
    return lamp.matrix[:3, 3] if isinstance(lamp, Spot) else np.array(lamp.position)


def cone(lamp: Spot, view: View) -> Rims:
    """The rays along the rim of a spot's cone, camera space, of any length."""
    half = lamp.angle / 2
    rays = np.array([(0.0, 0.0, -np.cos(half)), (np.sin(half), 0.0, 0.0), (0.0, np.sin(half), 0.0)])
    return Rims(*(view.axes @ lamp.matrix[:3, :3] @ rays.T).T[:, :, None])


def lamps_seen(lamps: tuple[Lamp, ...], view: View, canvas: Canvas) -> Iterator[Strokes]:
    """canvas : the picture, without clip planes."""
    for lamp in lamps:
        if "camera" in lamp.hidden_from or lamp.is_dark or not has_size(lamp):
            continue
        if isinstance(lamp, Area) and not lamp.ellipse:
            yield _rectangle(lamp, view)
            continue
        for rims in _rims(lamp, view):
            which, starts, ends = rims.arcs(canvas)
            yield Strokes(starts, ends, gather(rims.middle, which), np.minimum(starts[2], ends[2]), BULGE)


def _rectangle(lamp: Area, view: View) -> Strokes:
    corners = view.points(_half(lamp), np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]))
    ends, across = (np.roll(corners, -step, axis=1) for step in (1, 2))
    return Strokes(corners, ends, across, np.full(4, corners[2].min()))


def _half(lamp: Area) -> Floats:
    """From the square or circle from −1 to 1 to world space."""
    return lamp.matrix @ np.diag([*np.divide(lamp.size, 2), 1, 1])


def _rims(lamp: Lamp, view: View) -> Iterator[Rims]:
    if isinstance(lamp, Area):
        middle, first, second = view.points(_half(lamp), np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])).T[:, :, None]
        yield Rims(middle, first - middle, second - middle)
    elif isinstance(lamp, Sun):
        towards, half = (view.axes @ np.array(lamp.towards))[:, None] * _FAR, lamp.angle / 2
        yield circles(towards * np.cos(half), towards, np.array([np.sin(half) * _FAR]))
    else:
        yield from _rims_of_ball(lamp, view)


def _rims_of_ball(lamp: Point | Spot, view: View) -> Iterator[Rims]:
    centre = view.axes @ (place_of(lamp) - view.eye)[:, None]
    distance = float(np.sqrt(dot(centre, centre))[0])
    if lamp.soft_falloff:
        yield circles(centre, centre, np.array([lamp.radius]))
    elif distance > lamp.radius:
        away = centre / lamp.radius
        yield rims_seen_from(lamp.radius * np.eye(3)[:, :, None], centre, away, dot(away, away) - 1)
    if isinstance(lamp, Spot) and distance > lamp.radius:
        # Where the eye leaves the cone: the same for all places of the lamp, and so as near as the nearest of them.
        rays = cone(lamp, view)
        nearest = (distance - lamp.radius) / np.abs(lamp.matrix[:3, :3]).sum()
        yield Rims(*(-nearest * part for part in (rays.middle, rays.cosine, rays.sine)))
