"""Camera space, in which everything is traced.

Its origin is the eye, its axes are right, up and forward: u, v and −w, or −u, v and −w where the camera is mirrored. A ray is
(x, y, 1) for the point (x, y) of `Pinhole.view_plane`. So the parameter t of a hit *is* its planar depth, and clipping is an
interval of t. Rounded to float32, a vertex moves in the picture by no more than 2⁻²³ of its distance from the principal point,
however long the lens and wherever in the world the camera stands.

Rejected: world axes with the origin at the eye, where the lens magnifies that rounding to 2⁻²⁴ · d pixels.
"""

import numpy as np

from ...pinhole import Pinhole
from ..arrays import Floats, dot, linear


class View:
    """The camera space of a pinhole camera.

    eye : (3,) float64, world space.
    axes : (3, 3) float64, world space: the rows right, up and forward.
    """

    def __init__(self, camera: Pinhole) -> None:
        u, v, w = camera.basis()
        self.eye: Floats = np.array(camera.eye)
        self.axes: Floats = np.stack([-u if camera.mirrored else u, v, -w])
        self.handedness = 1.0 if camera.mirrored else -1.0

    def is_same(self, other: "View") -> bool:
        """Whether this is the same space, to the last bit."""
        mine, others = ((view.eye.tobytes(), view.axes.tobytes(), view.handedness) for view in (self, other))
        return mine == others

    def points(self, matrix: Floats, points: Floats) -> Floats:
        """(3, n): points of an object's space in camera space.

        matrix : (4, 4) or (3, 4), object space to world space, or (3, 4, n), one for each point. points : (n, 3), object space.
        """
        points = np.ascontiguousarray(points.T)
        relative = [dot(row, points) + (row[3] - eye) for row, eye in zip(matrix[:3], self.eye, strict=True)]
        return np.stack([dot(axis, relative) for axis in self.axes])

    def world_position(self, depth: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """World coordinates, each (n,), of the points at (n,) planar depths on the rays (x, y, 1)."""
        return tuple(linear(axis, x, y) * depth + eye for axis, eye in zip(self.axes.T, self.eye, strict=True))
