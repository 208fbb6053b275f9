"""Pixels in which strokes are seen, and those in which they are hidden: the rule of outlines.py.

**Hidden ones** don't count. A part of a stroke that lies in one pixel is seen if it lies nearer than what the pixel's centre
shows; else a ray beside its middle, on the side where its surface is not, meets nothing nearer than that surface. One place is
enough: if the part is seen elsewhere in the pixel, then between there and its middle something nearer begins to hide it, whose
own outline is seen in this pixel; and of all outlines that are seen in a pixel, the nearest is seen at its middle.

No ray is asked where an outline lies behind all of the object that the centre shows: on the way from the centre to where it is
seen, that object ends first, by an outline of its own or of something nearer.

Rejected: to compare with the depths at the centres around alone. A round surface falls off towards its own outline, so that
what is seen through a slit beside it lies behind all of these.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...image import BACKGROUND_DEPTH
from ..arrays import Floats, Indices, cross, dot, gather
from .strokes import Canvas, Pieces

# What is this much farther than the centre counts as not hidden, before any ray is asked.
_SLIGHTLY = 2.0**-10
# How much nearer than an outline's own surface something must be to hide it.
_NEARER = 2.0**-20
_FARTHEST = 1e-300  # one over it

Depths = Callable[[Floats, Floats], Floats]
"""How deep things are that are seen at columns and rows of the picture."""


@dataclass(frozen=True, eq=False)
class Strokes:
    """n strokes in camera space.

    starts, ends : (3, n) float64. within : (3, n) float64, a point of the surface that each is an outline of, on whose side
    of the stroke it is seen. nearest : (n,) float64, least depth of that surface, inf of what is infinitely far. bulge : pixels
    by which what they stand for may lie beside them.
    """

    starts: Floats
    ends: Floats
    within: Floats
    nearest: Floats
    bulge: float = 0.0

    def outwards(self, pieces: Pieces, some: Indices, distance: tuple[float, float]) -> Floats:
        """(2, k) unit vectors of the picture, across some of the pieces and away from their surfaces."""
        which, across = pieces.stroke[some], pieces.across(some)
        plane = cross(gather(self.starts, which), gather(self.ends, which))  # through the eye and the stroke
        inside = dot(plane, gather(self.within, which))
        turned = plane[0] * across[0] / distance[0] + plane[1] * across[1] / distance[1]
        return across * np.where(inside * turned > 0, -1.0, 1.0)


class Marks:
    """Pixels that strokes have been found to cross.

    depth : (height, width), of what is seen at the centres. depths : what is seen elsewhere. deepest : (height · width,), the
    greatest depth of the object that is seen at the centre, or None.
    """

    def __init__(self, canvas: Canvas, depth: NDArray, margin: float, depths: Depths, deepest: Floats | None) -> None:
        self._canvas, self._margin, self._depths, self._deepest = canvas, margin, depths, deepest
        flat = np.asarray(depth, np.float64).ravel()
        self._nearness = np.where(flat < BACKGROUND_DEPTH, 1.0 / flat, 0.0)
        self.mask = np.zeros(len(flat), bool)

    def add(self, strokes: Strokes) -> None:
        """Mark the pixels in which strokes are seen."""
        pieces = self._canvas.pieces(strokes.starts, strokes.ends, self._margin + strokes.bulge)
        nearest = gather(strokes.nearest, pieces.stroke)
        nearness = np.where(nearest < np.inf, pieces.nearness, 0.0)
        seen = nearness * (1 + _SLIGHTLY) >= gather(self._nearness, pieces.pixel)
        self.mask[pieces.pixel[seen]] = True
        asked = ~(seen | gather(self.mask, pieces.pixel))
        if self._deepest is not None:
            asked &= nearest * (1 - _SLIGHTLY) <= gather(self._deepest, pieces.pixel)
        asked = np.flatnonzero(asked)
        if len(asked):
            # Nearer than the outline's own surface, and than where it was computed to be.
            hides = np.minimum(nearest[asked], 1.0 / np.maximum(nearness[asked], _FARTHEST)) * (1 - _NEARER)
            aside = strokes.outwards(pieces, asked, self._canvas.distance) * (2 * self._margin + strokes.bulge)
            found = self._depths(*(pieces.places(asked) + aside))
            self.mask[pieces.pixel[asked[found >= hides]]] = True

    def fill(self, bounds: Floats, nearest: Floats) -> None:
        """Mark rectangles of the view plane where they are not hidden at the centres. bounds : as in `Ellipsoids`."""
        which, pixel = self._canvas.squares(bounds)
        seen = gather(self._nearness, pixel) <= (1 + _SLIGHTLY) / np.maximum(nearest[which], _FARTHEST)
        self.mask[pixel[seen]] = True
