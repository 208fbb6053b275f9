"""The lines of the text's figure of a pinhole: view plane, pixels, pyramid, axes, up and the line to the look-at point.

All of it is relative to the eye, so that a drawing in float32 keeps its shape far from the origin. Pixels have no length in the
world: the view plane is drawn at a share of the way to the look-at point, where its rectangle covers what the picture shows.
Rejected: d units from the eye (a kilometer away, for the usual 1000 pixels), and a length (every scene would need another one).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .pinhole import Pinhole, Triple

Array = NDArray[np.float64]

# Lengths, in distances to the drawn view plane. Up is longer than v, which it covers where the view is level.
_AXIS, _UP = 0.4, 0.6
# The length of an arrow's head, and how far its four barbs stand off, as shares of its own length.
_HEAD, _BARB = 0.12, 0.045
# At most so many pixels of the grid, along the picture's larger side.
_CELLS = 16


@dataclass(frozen=True)
class Diagram:
    """Points and lines, float64, world directions and units, relative to the eye; a line is its two ends.

    plane : (4, 3), the picture's corners: lower left, lower right, upper right, upper left.
    grid : (n, 2, 3), n ≤ 30, lines between pixels, those across columns first.
    pyramid : (4, 2, 3), from the eye to the corners.
    view : (2, 3), from the eye to the look-at point.
    axes : (3, 3), the tips of u, v and w.
    up : (3,), the tip of up.
    """

    plane: Array
    grid: Array
    pyramid: Array
    view: Array
    axes: Array
    up: Array

    def is_drawable(self) -> bool:
        """True if float32 holds it, squared. A d of 1e-30 puts the picture's corners beyond everything."""
        parts = (self.plane, self.grid, self.pyramid, self.view, self.axes, self.up)
        return all(bool((np.abs(part) < 1e18).all()) for part in parts)


def diagram(pinhole: Pinhole, up: Triple, share: float) -> Diagram:
    """The figure of a pinhole.

    up : the artist's up; the pinhole's own may have been turned by a roll.
    share : the view plane's place in the drawing, between the eye (0) and the look-at point (1).
    """
    towards = np.subtract(pinhole.look_at, pinhole.eye)
    depth = share * math.hypot(*towards.tolist())
    width, height, step = pinhole.width, pinhole.height, pixels_in_a_cell(pinhole.width, pinhole.height)
    corners = [(0, 0), (width, 0), (width, height), (0, height)]
    grid = [(column, row) for column in range(step, width, step) for row in (0, height)]
    grid += [(column, row) for row in range(step, height, step) for column in (0, width)]
    points = _in_plane(pinhole, np.array(corners + grid, dtype=np.float64), depth)
    plane, eye = points[:4], np.zeros(3)
    return Diagram(
        plane=plane,
        grid=points[4:].reshape(-1, 2, 3),
        pyramid=np.stack([np.broadcast_to(eye, plane.shape), plane], axis=1),
        view=np.stack([eye, towards]),
        axes=_AXIS * depth * np.array(pinhole.basis()),
        up=np.array(up_tip(pinhole.eye, pinhole.look_at, up, share)) - pinhole.eye,
    )


def up_tip(eye: Triple, look_at: Triple, up: Triple, share: float) -> Triple:
    """The tip of up's arrow, in world space; it starts at the eye, and its length says nothing. Parameters as in `diagram`."""
    length = _UP * share * math.dist(eye, look_at) / math.hypot(*up)
    x, y, z = (e + length * component for e, component in zip(eye, up, strict=True))
    return x, y, z


def arrow(tip: Array) -> Array:
    """(5, 2, 3): an arrow from the eye to `tip` (3,), relative to the eye: its shaft, and a head of four barbs about it."""
    with np.errstate(all="ignore"):
        across = np.cross(tip, np.eye(3)[np.argmin(np.abs(tip))])
        across *= _BARB * np.linalg.norm(tip) / np.linalg.norm(across)
        above = np.cross(tip, across) / np.linalg.norm(tip)
    ends = (1 - _HEAD) * tip + np.stack([across, -across, above, -above])
    return np.stack([np.broadcast_to(tip, (5, 3)), np.vstack([np.zeros(3), ends])], axis=1)


def pixels_in_a_cell(width: int, height: int) -> int:
    """The number of pixels between two lines of the grid: 1, 2, 5, 10, 20 …, so that there are not too many lines."""
    least = max(width, height) / _CELLS
    power = 10 ** max(math.floor(math.log10(least)), 0)
    return next(step for step in (power, 2 * power, 5 * power, 10 * power, 20 * power) if step >= least)


def _in_plane(pinhole: Pinhole, places: Array, depth: float) -> Array:
    """(n, 3): places (n, 2) of the picture, column and row, in the plane at `depth` before the eye, relative to the eye."""
    right, up, ahead = pinhole.picture_axes()
    x, y = pinhole.view_plane(places[:, 0], places[:, 1])
    with np.errstate(all="ignore"):
        return depth * (x[:, None] * right + y[:, None] * up + ahead)
