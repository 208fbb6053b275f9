"""A COLMAP model with points and their tracks, sampled from the surfaces that many pictures' labels show.

surface_points.py says which pictures see a point. An instance's state is its place and its box: what moves or changes its box
from picture to picture is no part of one rigid scene, and has no track from one to another.

A point has the color that its picture shows there, if that is a PNG, and else that of its instance's id.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import cameras
from ..cameras import colmap
from ..errors import InputError
from ..files import folder_written_whole
from ..png import decoded
from . import files, surface_points
from .coco import Document, read_pictures
from .surface_points import EVENLY

Array = NDArray[np.float64]

POINTS = 1000
"""Sampled in each picture, unless another number is chosen."""

PLY = "points3D.ply"
"""The points beside the model, for those who begin with them: Gaussian splatting reads it there."""


def write(folder: Path, output: Path, points: int = POINTS, overwrite: bool = False) -> dict[str, int]:
    """Write a new folder of cameras.txt, images.txt, points3D.txt and points3D.ply, whole or not at all.

    folder : a folder of label files that have depth and masks.
    output : a folder that is not there yet, is empty, or holds a model of cameras alone, as a batch with --transforms writes
        it.
    points : the number of points sampled in each picture, evenly over what it shows; those that no other picture sees are left
        out.
    overwrite : true if `output` may hold a model with points, too.

    Returns how many images, points and observations there are.

    Raises InputError if there are no label files, one lacks something or can't be read, a camera or picture is none that COLMAP
    can name, or the folder can't be written.
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

    pictures : label files that have depth and masks.
    views : their cameras.
    points : see `write`.
    longest : the most pictures in a point's track, all that see it if None.

    Raises InputError if one lacks something or can't be read.
    """
    states: dict[str, int] = {}
    pieces, visible = [], []
    for number, (view, (path, document)) in enumerate(zip(views, pictures, strict=True)):
        with files.understood(path):
            depth, state, ids = surface_points.planes(path, document, states, _state)
            colors = _colors(path, document, ids)
            pieces.append(surface_points.sampled(number, view, depth, state, colors, points))
    sampled = surface_points.Sampled(*map(np.concatenate, zip(*pieces, strict=True)))
    for number, (view, (path, document)) in enumerate(zip(views, pictures, strict=True)):
        depth, state, _ = surface_points.planes(path, document, states, _state)
        visible.append(surface_points.visible(sampled, number, view, depth, state))
    if longest is not None:
        visible = _shortened(visible, longest)
    often = np.bincount(np.concatenate([which for which, _ in visible]), minlength=len(sampled.source)) > 1
    new = np.cumsum(often) - 1
    return colmap.Tracks(
        sampled.positions[often],
        sampled.colors[often],
        [(new[which[often[which]]], places[often[which]]) for which, places in visible],
    )


def _state(instance: Document) -> str:
    return f"{instance['id']} {instance['object_to_world']} {instance['box']}"


def _shortened(visible: list[tuple[NDArray[np.intp], Array]], longest: int) -> list[tuple[NDArray[np.intp], Array]]:
    """The places in each picture, of each point those in `longest` pictures at most, spread over those that see it."""
    point = np.concatenate([which for which, _ in visible])
    picture = np.repeat(np.arange(len(visible)), [len(which) for which, _ in visible])
    order = np.lexsort(((picture * EVENLY[0] + point * EVENLY[1]) % 1.0, point))
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


def _has_no_points(folder: Path) -> bool:
    """True if a folder holds a text model that lacks nothing but points, and nothing else."""
    if not files.holds(folder, colmap.TEXTS, colmap.TEXTS):
        return False
    with open(folder / "points3D.txt", encoding="utf-8", errors="replace") as lines:
        return not any(line.strip() and not line.startswith("#") for line in lines)
