"""Camera space, in which everything is traced.

Its origin is the eye, its axes are right, up and forward: u, v and −w, or −u, v and −w where the camera is mirrored. A ray is
(x, y, 1) for the point (x, y) of `Pinhole.view_plane`. So the parameter t of a hit *is* its planar depth, and clipping is an
interval of t. Rounded to float32, a vertex moves in the picture by no more than 2⁻²³ of its distance from the principal point,
however long the lens and wherever in the world the camera stands.

Rejected: world axes with the origin at the eye, where the lens magnifies that rounding to 2⁻²⁴ · d pixels.
"""

import numpy as np

from ...pinhole import Pinhole
from ..arrays import Floats, linear


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

    def points(self, matrix: Floats, points: Floats) -> tuple[Floats, Floats]:
        """Points of an object's space in camera space, and how large their world coordinates are.

        matrix : (4, 4), object space to world space. points : (n, 3), object space.

        Returns (3, n) camera space and (n,) the largest |coordinate| in world space, of the points or of their object: what is
        far from its object's own origin is the small difference of large numbers.
        """
        relative = matrix[:3, :3] @ points.T
        relative += (matrix[:3, 3] - self.eye)[:, None]
        return self.axes @ relative, np.abs(relative + self.eye[:, None]).max(axis=0, initial=np.abs(matrix[:3, 3]).max())

    def world_position(self, depth: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """World coordinates, each (n,), of the points at (n,) planar depths on the rays (x, y, 1)."""
        return tuple(linear(axis, x, y) * depth + eye for axis, eye in zip(self.axes.T, self.eye, strict=True))
