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

A point has the color that its picture shows there, if that is a PNG, and else that of its instance's id.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import cameras
from ..cameras import colmap, distortion
from ..errors import InputError
from ..files import folder_written_whole
from ..image import BACKGROUND_DEPTH
from ..png import decoded
from . import files
from .coco import Document, read_pictures

Array = NDArray[np.float64]

POINTS = 1000
"""Sampled in each picture, unless another number is chosen."""

_STEP = 1e-3
_ROUNDING = 2.0**-22
"""The rounding of depths in float32, here and where the point comes from, 2⁻²⁴ each, for surfaces that are seen at an angle."""

# Of the plastic number, whose powers fill the plane most evenly: multiples of these, wrapped, rank a grid's pixels so that the
# first n of them lie as far apart as n can.
_EVENLY = 0.7548776662466927, 0.5698402909980532


PLY = "points3D.ply"
"""The points beside the model, for those who begin with them: Gaussian splatting reads it there."""


class _Sampled(NamedTuple):
    """Points, each array with as many rows. source : which picture they come from. depth : there. state : as of `_planes`."""

    positions: Array
    source: NDArray[np.intp]
    depth: Array
    state: NDArray[np.int64]
    colors: NDArray[np.uint8]


def write(folder: Path, output: Path, points: int = POINTS, overwrite: bool = False) -> dict[str, int]:
    """Write a new folder of cameras.txt, images.txt, points3D.txt and points3D.ply, whole or not at all.

    folder : of label files that have depth and masks. output : must not be there yet, be empty, or hold a model of cameras
    alone, as a batch with --transforms writes it. points : how many are sampled in each picture, evenly over what it shows;
    those that no other picture sees are left out. overwrite : whether `output` may hold a model with points, too.

    Returns how many images, points and observations there are.

    Raises
    ------
    InputError
        if there are no label files, one lacks something or can't be read, a camera or picture is none that COLMAP can name, or
        the folder can't be written.
    """
    pictures, _ = read_pictures(folder)

    def may_replace(there: Path) -> bool:
        return _has_no_points(there) or (overwrite and files.holds(there, colmap.TEXTS, (*colmap.TEXTS, PLY)))

    with folder_written_whole(output, may_replace) as temporary:
        views = []
        for path, document in pictures:
            with files.understood(path):
                views.append(files.camera(path, document))
        tracks = tracks_of(pictures, views, points)
        for file, content in contents(views, tracks).items():
            (temporary / file).write_bytes(content)
    return {
        "images": len(views),
        "points": len(tracks.positions),
        "observations": sum(len(which) for which, _ in tracks.observations),
    }


def tracks_of(
    pictures: Sequence[tuple[Path, Document]], views: Sequence[cameras.Camera], points: int, longest: int | None = None
) -> colmap.Tracks:
    """Points of all pictures that two show at least, and where each shows them.

    pictures : label files that have depth and masks. views : their cameras. points : as of `write`. longest : how many of the
    pictures that see a point its track has at most, all if None. Raises InputError if one lacks something or can't be read.
    """
    states: dict[str, int] = {}
    pieces, visible = [], []
    for number, (view, (path, document)) in enumerate(zip(views, pictures, strict=True)):
        with files.understood(path):
            depth, state, ids = _planes(path, document, states)
            pieces.append(_sampled(number, view, depth, state, _colors(path, document, ids), points))
    sampled = _Sampled(*map(np.concatenate, zip(*pieces, strict=True)))
    for number, (view, (path, document)) in enumerate(zip(views, pictures, strict=True)):
        visible.append(_visible(sampled, number, view, *_planes(path, document, states)[:2]))
    if longest is not None:
        visible = _shortened(visible, longest)
    often = np.bincount(np.concatenate([which for which, _ in visible]), minlength=len(sampled.source)) > 1
    new = np.cumsum(often) - 1
    return colmap.Tracks(
        sampled.positions[often],
        sampled.colors[often],
        [(new[which[often[which]]], places[often[which]]) for which, places in visible],
    )


def _shortened(visible: list[tuple[NDArray[np.intp], Array]], longest: int) -> list[tuple[NDArray[np.intp], Array]]:
    """The places in each picture, of each point those in `longest` pictures at most, spread over those that see it."""
    point = np.concatenate([which for which, _ in visible])
    picture = np.repeat(np.arange(len(visible)), [len(which) for which, _ in visible])
    order = np.lexsort(((picture * _EVENLY[0] + point * _EVENLY[1]) % 1.0, point))
    first = np.flatnonzero(np.diff(point[order], prepend=-1))
    kept = np.zeros(len(point), bool)
    kept[order] = np.arange(len(point)) - np.repeat(first, np.diff(first, append=len(point))) < longest
    parts = np.split(kept, np.cumsum([len(which) for which, _ in visible])[:-1])
    return [(which[part], places[part]) for (which, places), part in zip(visible, parts, strict=True)]


def contents(views: Sequence[cameras.Camera], tracks: colmap.Tracks) -> dict[str, bytes]:
    """The files of a model with points, by name. Raises InputError for what COLMAP can't name."""
    texts = {name: text.encode("utf-8") for name, text in colmap.texts(views, tracks).items()}
    return {**texts, PLY: _ply(tracks)}


def _ply(tracks: colmap.Tracks) -> bytes:
    """The points as Gaussian splatting reads them: with normals, which are 0, or it takes none of them."""
    types = [
        *((name, "<f4") for name in ("x", "y", "z", "nx", "ny", "nz")),
        *((name, "u1") for name in ("red", "green", "blue")),
    ]
    vertices = np.zeros(len(tracks.positions), types)
    for names, columns in (("x", "y", "z"), tracks.positions), (("red", "green", "blue"), tracks.colors):
        for name, column in zip(names, np.transpose(columns), strict=True):
            vertices[name] = column
    kinds = {"<f4": "float", "u1": "uchar"}
    head = "".join(f"property {kinds[kind]} {name}\n" for name, kind in types)
    return (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{head}end_header\n".encode()
        + vertices.tobytes()
    )


def _colors(path: Path, document: Document, ids: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(height, width, 3): the picture beside a label file, if it is a PNG, or else its ids."""
    picture = files.photograph(path, document)
    if picture is None or picture.suffix != ".png":
        return files.id_colors(ids)
    try:
        pixels = decoded(picture.read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(f"{picture} is no PNG of 8 or 16 bits that can be read: render it again, or move it away") from error
    colors = pixels[..., :3] if pixels.shape[-1] > 2 else np.repeat(pixels[..., :1], 3, axis=-1)
    return (colors >> 8 * (colors.dtype.itemsize - 1)).astype(np.uint8)


def _planes(path: Path, document: Document, states: dict[str, int]) -> tuple[Array, NDArray[np.int64], NDArray[np.float32]]:
    """(height, width) each, rows from the top: depth; which instance in which state, −1 where nothing is; its id.

    states : of all pictures, numbered as they are met; an instance's matrix and box are its state.
    """
    passes = files.passes(path, document, ("Depth", "Instance"))
    if len(passes) < 2:
        missing = "depth" if "Depth" not in passes else "masks"
        raise InputError(f"{path} has no {missing}: render it with --labels depth,masks")
    depth, ids = (passes[name][..., 0] for name in ("Depth", "Instance"))
    known, places = np.unique(ids, return_inverse=True)
    of_ids = {
        each["id"]: states.setdefault(f"{each['id']} {each['object_to_world']} {each['box']}", len(states))
        for each in document["instances"]
    }
    numbers = np.array([of_ids[each] if each else -1 for each in known.astype(int).tolist()])
    state = np.where(depth < BACKGROUND_DEPTH, numbers[places.reshape(ids.shape)], -1)
    return depth.astype(np.float64), state, ids


def _has_no_points(folder: Path) -> bool:
    """True if a folder holds a text model that lacks nothing but points, and nothing else."""
    if not files.holds(folder, colmap.TEXTS, colmap.TEXTS):
        return False
    with open(folder / "points3D.txt", encoding="utf-8", errors="replace") as lines:
        return not any(line.strip() and not line.startswith("#") for line in lines)


def _sampled(
    number: int, view: cameras.Camera, depth: Array, state: NDArray[np.int64], colors: NDArray[np.uint8], points: int
) -> _Sampled:
    rows, columns = np.nonzero(state >= 0)
    rank = (columns * _EVENLY[0] + rows * _EVENLY[1]) % 1.0
    chosen = np.sort(np.argsort(rank, kind="stable")[:points])
    rows, columns = rows[chosen], columns[chosen]
    camera = view.pinhole
    x, y = distortion.view_plane(camera, view.lens, columns + 0.5, camera.height - (rows + 0.5))
    u, v, w = camera.basis()
    z = depth[rows, columns]
    positions = np.array(camera.eye) + z[:, None] * (x[:, None] * u + y[:, None] * v - w)
    return _Sampled(positions, np.full(len(z), number), z, state[rows, columns], colors[rows, columns])


def _visible(
    sampled: _Sampled, number: int, view: cameras.Camera, depth: Array, state: NDArray[np.int64]
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
