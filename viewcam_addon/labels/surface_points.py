"""Points of the surfaces that many pictures' labels show, and which pictures see them.

A point is that of a pixel's center: the eye, and along the ray as far as the label Depth says. Its places in pictures are its
projections in double precision; what is not exact is whether another picture sees it, since labels know that picture at its
pixels' centers only. There the point counts as seen if

- the 4 × 4 pixels around its place show its instance in the state that the point belongs to; outlines are left out;
- their inverse depth bends smoothly: third differences, which are at least as large as any step among four pixels, are below
  a thousandth of it;
- the point's own inverse depth is theirs, interpolated between the four next to it. That is exact on a plane, whose inverse
  depth is linear in the picture, and elsewhere as good as half of the second differences, kinks included.

So what can't be told is an object that hides a point of itself by less than a thousandth of the depth, and whatever is thinner
than a pixel. Rejected: a tolerance between depth maps at the nearest pixel, which a slanted floor exceeds within half a pixel.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import cameras
from ..cameras import distortion
from ..errors import InputError
from ..image import BACKGROUND_DEPTH
from . import files
from .coco import Document

Array = NDArray[np.float64]

_STEP = 1e-3
_ROUNDING = 2.0**-22
"""The rounding of depths in float32, here and where the point comes from, 2⁻²⁴ each, for surfaces that are seen at an angle."""

# Powers of the plastic number, which fill the plane most evenly: multiples of these, wrapped, rank a grid's pixels so that the
# first n of them lie as far apart as n can.
EVENLY = 0.7548776662466927, 0.5698402909980532


class Sampled(NamedTuple):
    """Points, each array with as many rows.

    source : the picture that each point comes from.
    depth : the point's depth in that picture.
    state : see `planes`.
    """

    positions: Array
    source: NDArray[np.intp]
    depth: Array
    state: NDArray[np.int64]
    colors: NDArray[np.uint8]


def planes(
    path: Path, document: Document, states: dict[str, int], state_of: Callable[[Document], str]
) -> tuple[Array, NDArray[np.int64], NDArray[np.float32]]:
    """(height, width) each, rows from the top: depth; which instance in which state, −1 where nothing is; its id.

    states : the states in all pictures, numbered as they are met.
    state_of : the text of an instance's state.

    Raises InputError if the picture has no depth or masks.
    """
    passes = files.passes(path, document, ("Depth", "Instance"))
    if len(passes) < 2:
        missing = "depth" if "Depth" not in passes else "masks"
        raise InputError(f"{path} has no {missing}: render it with --labels depth,masks")
    depth, ids = (passes[name][..., 0] for name in ("Depth", "Instance"))
    known, places = np.unique(ids, return_inverse=True)
    of_ids = {each["id"]: states.setdefault(state_of(each), len(states)) for each in document["instances"]}
    numbers = np.array([of_ids[each] if each else -1 for each in known.astype(int).tolist()])
    state = np.where(depth < BACKGROUND_DEPTH, numbers[places.reshape(ids.shape)], -1)
    return depth.astype(np.float64), state, ids


def positions(view: cameras.Camera, rows: NDArray[np.intp], columns: NDArray[np.intp], depth: Array) -> Array:
    """The points that pixels' centers show: (..., 3), world space.

    rows : from the top.
    depth : along the axis, nan for nan.
    """
    camera = view.pinhole
    x, y = distortion.view_plane(camera, view.lens, columns + 0.5, camera.height - (rows + 0.5))
    u, v, w = camera.basis()
    return np.add(camera.eye, depth[..., None] * (x[..., None] * u + y[..., None] * v - w))


def sampled(
    number: int, view: cameras.Camera, depth: Array, state: NDArray[np.int64], colors: NDArray[np.uint8], points: int
) -> Sampled:
    """Points of a picture, as many as are asked for if it shows so much, evenly over what it shows.

    number : the picture's number.
    depth, state : see `planes`.
    colors : (height, width, 3), rows from the top.
    """
    rows, columns = np.nonzero(state >= 0)
    rank = (columns * EVENLY[0] + rows * EVENLY[1]) % 1.0
    chosen = np.sort(np.argsort(rank, kind="stable")[:points])
    rows, columns = rows[chosen], columns[chosen]
    z = depth[rows, columns]
    return Sampled(positions(view, rows, columns, z), np.full(len(z), number), z, state[rows, columns], colors[rows, columns])


def visible(
    sampled: Sampled, number: int, view: cameras.Camera, depth: Array, state: NDArray[np.int64]
) -> tuple[NDArray[np.intp], Array]:
    """The points that a picture shows, and their places: (n, 2), x to the right and y **down** from the picture's corner."""
    camera = view.pinhole
    column, row, z = distortion.project(camera, view.lens, sampled.positions)
    x, y = column - 0.5, camera.height - row - 0.5  # 0 at the first pixel's center
    with np.errstate(invalid="ignore"):
        inside = (x >= 1) & (x < camera.width - 2) & (y >= 1) & (y < camera.height - 2)
    which = np.flatnonzero(inside & (sampled.source != number))
    which = which[state[y[which].astype(int), x[which].astype(int)] == sampled.state[which]]
    left, top = x[which].astype(int), y[which].astype(int)
    around = np.arange(-1, 3)
    block = (top[:, None, None] + around[:, None], left[:, None, None] + around)
    alike = (state[block] == sampled.state[which, None, None]).all(axis=(1, 2))
    inverse = 1 / depth[block]
    across, along = x[which] - left, y[which] - top
    rows = inverse[:, 1:3, 1] * (1 - across)[:, None] + inverse[:, 1:3, 2] * across[:, None]
    between = rows[:, 0] * (1 - along) + rows[:, 1] * along
    bends, steps = (sum(np.abs(np.diff(inverse, order, axis=axis)).max(axis=(1, 2)) for axis in (1, 2)) for order in (2, 3))
    slack = bends / 2 + _ROUNDING * between * (1 + sampled.depth[which] / z[which])
    seen = alike & (steps <= _STEP * between) & (np.abs(between - 1 / z[which]) <= slack)
    which = np.union1d(which[seen], np.flatnonzero(sampled.source == number))
    return which, np.stack([column[which], camera.height - row[which]], axis=-1)
