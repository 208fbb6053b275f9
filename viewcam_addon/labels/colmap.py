"""A COLMAP model with points and their tracks, sampled from the surfaces that many pictures' labels show.

A point is that of a pixel's center: the eye, and along the ray as far as the label Depth says. Its places in pictures are its
projections in double precision; what is not exact is whether another picture sees it, since labels know that picture at its
pixels' centers only. There the point counts as seen if

- the 4 × 4 pixels around its place show its instance, which stands there as it did where the point comes from: what moves or
  changes its box from picture to picture is no part of one rigid scene, and outlines are left out;
- their inverse depth bends smoothly: third differences, which are at least as large as any step among four pixels, are below
  a thousandth of it;
- the point's own inverse depth is theirs, interpolated between the four next to it. That is exact on a plane, whose inverse
  depth is linear in the picture, and elsewhere as good as half of the second differences, kinks included.

So what can't be told is an object that hides a point of itself by less than a thousandth of the depth, and whatever is thinner
than a pixel. Rejected: a tolerance between depth maps at the nearest pixel, which a slanted floor exceeds within half a pixel.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import cameras
from ..cameras import colmap
from ..errors import InputError
from ..files import folder_written_whole
from ..image import BACKGROUND_DEPTH
from ..pinhole import Pinhole
from . import files
from .coco import Document, found

Array = NDArray[np.float64]

POINTS = 1000
"""Sampled in each picture, unless another number is chosen."""

_STEP = 1e-3
_ROUNDING = 2.0**-22
"""The rounding of depths in float32, here and where the point comes from, 2⁻²⁴ each, for surfaces that are seen at an angle."""

# Of the plastic number, whose powers fill the plane most evenly: multiples of these, wrapped, rank a grid's pixels so that the
# first n of them lie as far apart as n can.
_EVENLY = 0.7548776662466927, 0.5698402909980532


class _Sampled(NamedTuple):
    """Points, each array with as many rows. source : which picture they come from. depth : there. state : as of `_planes`."""

    positions: Array
    source: NDArray[np.intp]
    depth: Array
    state: NDArray[np.int64]
    ids: NDArray[np.float32]


def write(folder: Path, output: Path, points: int = POINTS) -> dict[str, int]:
    """Write a new folder of cameras.txt, images.txt and points3D.txt, whole or not at all.

    folder : of label files that have depth and masks. output : must not be there yet, be empty, or hold a model of cameras
    alone, as a batch with --transforms writes it. points : how many are sampled in each picture, evenly over what it shows;
    those that no other picture sees are left out.

    Returns how many images, points and observations there are.

    Raises
    ------
    InputError
        if there are no label files, one lacks something or can't be read, a camera or picture is none that COLMAP can name, or
        the folder can't be written.
    """
    pictures, _ = found(folder)
    states: dict[str, int] = {}
    with folder_written_whole(output, _has_no_points) as temporary:
        views, pieces = [], []
        for number, (path, told) in enumerate(pictures):
            with files.understood(path):
                name = files.picture(path, told)
                views.append(cameras.Camera(name, Pinhole(**told["camera"]), image=name))
                pieces.append(_sampled(number, views[-1].pinhole, *_planes(path, told, states), points))
        sampled = _Sampled(*map(np.concatenate, zip(*pieces, strict=True)))
        shown = [
            _shown(sampled, number, view.pinhole, *_planes(path, told, states)[:2])
            for number, (view, (path, told)) in enumerate(zip(views, pictures, strict=True))
        ]
        often = np.bincount(np.concatenate([which for which, _ in shown]), minlength=len(sampled.source)) > 1
        new = np.cumsum(often) - 1
        tracks = colmap.Tracks(
            sampled.positions[often],
            files.id_colours(sampled.ids[often]),
            [(new[which[often[which]]], places[often[which]]) for which, places in shown],
        )
        for file, text in colmap.texts(views, tracks).items():
            (temporary / file).write_text(text, encoding="utf-8", newline="\n")
    return {
        "images": len(views),
        "points": len(tracks.positions),
        "observations": sum(len(which) for which, _ in tracks.observations),
    }


def _planes(path: Path, told: Document, states: dict[str, int]) -> tuple[Array, NDArray[np.int64], NDArray[np.float32]]:
    """(height, width) each, rows from the top: depth; which instance in which state, −1 where nothing is; its id.

    states : of all pictures, numbered as they are met; an instance's matrix and box are its state.
    """
    passes = files.passes(path, told, ("Depth", "Instance"))
    if len(passes) < 2:
        missing = "depth" if "Depth" not in passes else "masks"
        raise InputError(f"{path} has no {missing}: render it with --labels depth,masks")
    depth, ids = (passes[name][..., 0] for name in ("Depth", "Instance"))
    known, places = np.unique(ids, return_inverse=True)
    of_ids = {
        each["id"]: states.setdefault(f"{each['id']} {each['object_to_world']} {each['box']}", len(states))
        for each in told["instances"]
    }
    numbers = np.array([of_ids[each] if each else -1 for each in known.astype(int).tolist()])
    state = np.where(depth < BACKGROUND_DEPTH, numbers[places.reshape(ids.shape)], -1)
    return depth.astype(np.float64), state, ids


def _has_no_points(folder: Path) -> bool:
    """True if a folder holds a text model that lacks nothing but points, and nothing else."""
    if {path.name for path in folder.iterdir()} != {*colmap.TEXTS}:
        return False
    with open(folder / "points3D.txt", encoding="utf-8", errors="replace") as lines:
        return not any(line.strip() and not line.startswith("#") for line in lines)


def _sampled(
    number: int, camera: Pinhole, depth: Array, state: NDArray[np.int64], ids: NDArray[np.float32], points: int
) -> _Sampled:
    rows, columns = np.nonzero(state >= 0)
    rank = (columns * _EVENLY[0] + rows * _EVENLY[1]) % 1.0
    chosen = np.sort(np.argsort(rank, kind="stable")[:points])
    rows, columns = rows[chosen], columns[chosen]
    x, y = camera.view_plane(columns + 0.5, camera.height - (rows + 0.5))
    u, v, w = camera.basis()
    z = depth[rows, columns]
    positions = np.array(camera.eye) + z[:, None] * (x[:, None] * u + y[:, None] * v - w)
    return _Sampled(positions, np.full(len(z), number), z, state[rows, columns], ids[rows, columns])


def _shown(
    sampled: _Sampled, number: int, camera: Pinhole, depth: Array, state: NDArray[np.int64]
) -> tuple[NDArray[np.intp], Array]:
    """The points that a picture shows, and their places: (n, 2), x to the right and y **down** from the picture's corner."""
    column, row, z = camera.project(sampled.positions)
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
