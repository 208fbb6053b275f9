"""Triangles that all rays test, in float64, from wherever they come: the wide ones (triangles.py), or all without Embree.

Embree would round a ground plane, and the offset of the rays that leave it, by as much as its far corners are far.
"""

from collections.abc import Iterator

import numpy as np

from ..arrays import Floats, Indices, cross, dot, gather
from .triangles import Triangles


class Alone:
    """Some of the triangles.

    chosen : (k,) which.
    """

    def __init__(self, triangles: Triangles, chosen: Indices) -> None:
        self._chosen = chosen
        a, b, c = (triangles.vertices[:, corner] for corner in triangles.corners[:, chosen])
        first, second = b - a, c - a
        normal = cross(first, second)
        squared = dot(normal, normal)
        with np.errstate(all="ignore"):  # one without area is never met
            self._normals = normal / np.sqrt(squared)
            self._heights = dot(self._normals, a)
            self._gradients = [cross(second, normal) / squared, cross(normal, first) / squared]
        self._corners = a

    @property
    def is_empty(self) -> bool:
        return not len(self._chosen)

    def met(self, starts: Floats, directions: Floats, limits: Floats) -> Iterator[tuple[int, Indices, Floats]]:
        """Each triangle, which of n rays meet it nearer than their limits, and how far off; limits may shrink in between.

        starts, directions : (3, n), camera space. limits : (n,), in lengths of the directions.
        """
        for number, triangle in enumerate(self._chosen):
            normal = self._normals[:, number]
            with np.errstate(all="ignore"):  # a ray along the plane
                distance = (self._heights[number] - dot(normal, starts)) / dot(normal, directions)
                which = np.flatnonzero((distance > 0) & (distance < limits))
            distance = distance[which]
            inside = gather(starts, which) + distance * gather(directions, which) - self._corners[:, number, None]
            first, second = (dot(gradient[:, number], inside) for gradient in self._gradients)
            kept = np.flatnonzero((first >= 0) & (second >= 0) & (first + second <= 1))
            yield triangle, which[kept], distance[kept]
