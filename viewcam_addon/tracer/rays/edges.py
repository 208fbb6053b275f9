"""On which sides of triangles' edges rays pass, in float64.

The side of an edge V, W that a ray d passes on is the sign of d·(V × W); a ray that passes on the same side of all three meets
the triangle. What is closer to an edge than rounding can tell counts as inside on both sides of it, so that nothing passes
between triangles.
"""

import numpy as np

from ..arrays import Floats, Indices, cross, dot, gather, linear
from .triangles import WIDE, Triangles

_EDGES = ((1, 2), (2, 0), (0, 1))

# The nine products and eight sums of d·(V × W) are rounded by less than this times |V| |W| |d| in all.
_ROUNDING = 2.0**-50


class Edges:
    """The edges of all triangles, or of some.

    corners : (3, 3, k) float64: [corner, axis, triangle], camera space.
    """

    def __init__(self, triangles: Triangles, chosen: Indices | slice = slice(None)) -> None:
        self._ends = triangles.corners[:, chosen]
        self.corners: Floats = gather(triangles.vertices, self._ends).transpose(1, 0, 2)
        self._normals = np.stack([cross(self.corners[j], self.corners[k]) for j, k in _EDGES])
        length = np.sqrt(dot(self.corners.swapaxes(0, 1), self.corners.swapaxes(0, 1)))
        self._size = np.stack([length[j] * length[k] for j, k in _EDGES])
        self._rounding = _ROUNDING * self._size

    def overlap(self, rounding: float) -> None:
        """Let rays pass beside edges by this times |V| |W|: those at which other, not so wide triangles may stand.

        They don't at edges that two of these triangles share, nor at edges that come nearer to the eye than such triangles.
        """
        ends = np.sort(np.stack([self._ends[[j, k]] for j, k in _EDGES]), axis=1)
        _, edge, users = np.unique(ends.transpose(0, 2, 1).reshape(-1, 2), axis=0, return_inverse=True, return_counts=True)
        apart = np.sqrt(dot(self._normals.swapaxes(0, 1), self._normals.swapaxes(0, 1)))
        beside_others = (users[edge.reshape(3, -1)] == 1) & (apart * WIDE >= self._size)
        self._rounding = np.where(beside_others, rounding * self._size, self._rounding)

    def inside(self, some: Indices, x: Floats, y: Floats) -> np.ndarray:
        """Whether rays (x, y, 1) pass through these triangles; all broadcast."""
        sides = [linear(normal, x, y) for normal in gather(self._normals, some)]
        length = np.sqrt(x * x + y * y + 1.0)
        rounding = [size * length for size in gather(self._rounding, some)]
        left = np.logical_and.reduce([side >= -error for side, error in zip(sides, rounding, strict=True)])
        right = np.logical_and.reduce([side <= error for side, error in zip(sides, rounding, strict=True)])
        return left | right
