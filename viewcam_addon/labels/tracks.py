"""Point tracks of a sequence: where points of its surfaces are in each picture, and which pictures show them.

One .npz as PointOdyssey's anno.npz has them, of T pictures in the order of their names and N points:

    trajs_2d (T, N, 2) trajs_3d (T, N, 3) visibs valids (T, N) intrinsics (T, 3, 3) extrinsics (T, 4, 4)

Pixels count from the picture's corner, x right and y down; extrinsics lead from the world to the camera, x right, y down, z
forward. A point goes with its object: the place that it has in the object's coordinates, where its picture shows it, by the
object's matrix in each picture. Where the object is not there, or has another box, since it deforms, or the point does not lie
before the camera, `valids` is false and the places are 0. `visibs` is true where surface_points.py can tell that the picture
shows the point, so within two pixels of an outline it is false.

Source: Zheng et al., PointOdyssey, ICCV 2023, and the loader that its authors publish. Rejected: TAP-Vid's pickles, which
nobody should open from a stranger; the same arrays, with x and y as shares, make one.
"""

from pathlib import Path

import numpy as np

from .. import npy
from ..cameras import axes
from ..errors import InputError
from ..files import written_whole
from . import files, surface_points
from .coco import Document, read_pictures

POINTS = 2048
"""Sampled in all pictures together, unless another number is chosen."""


def write(folder: Path, output: Path, points: int = POINTS) -> dict[str, int]:
    """Write the tracks of points that each picture shows, whole or not at all.

    folder : a folder of label files that have depth and masks, their pictures in the order of their names.
    output : the .npz to write.
    points : the number of points, an equal share of each picture, evenly over what it shows; fewer where pictures show less.

    Returns how many pictures and points there are, and how often a picture shows one.

    Raises InputError if there are no label files, one lacks something or can't be read, is seen through a lens, or the file
    can't be written.
    """
    pictures, _ = read_pictures(folder)
    share = -(-points // len(pictures))
    states: dict[str, int] = {}
    views, pieces = [], []
    for number, (path, document) in enumerate(pictures):
        with files.understood(path):
            view = files.camera(path, document)
            if view.lens:
                raise InputError(f"{path} is seen through a lens, which intrinsics can't say: render it without --distort")
            depth, state, ids = surface_points.planes(path, document, states, _state)
            colors = np.zeros((*ids.shape, 3), np.uint8)
            pieces.append(surface_points.sampled(number, view, depth, state, colors, share))
            views.append(view)
    sampled = surface_points.Sampled(*map(np.concatenate, zip(*pieces, strict=True)))
    shape = len(pictures), len(sampled.source)
    at_home = np.zeros((shape[1], 4))
    for number, (_, document) in enumerate(pictures):
        own = sampled.source == number
        for kept, matrix in _matrices(document, states):
            which = own & (sampled.state == kept)
            positions = np.column_stack([sampled.positions[which], np.ones(which.sum())])
            at_home[which] = positions @ np.linalg.pinv(matrix).T  # a scale may be 0
    trajs_2d, trajs_3d = np.zeros((*shape, 2), np.float32), np.zeros((*shape, 3), np.float32)
    visibs, valids = np.zeros(shape, bool), np.zeros(shape, bool)
    for number, (view, (path, document)) in enumerate(zip(views, pictures, strict=True)):
        there = np.full((shape[1], 3), np.nan)
        for kept, matrix in _matrices(document, states):
            which = sampled.state == kept
            there[which] = (at_home[which] @ matrix.T)[:, :3]
        known = np.isfinite(there).all(axis=1)
        placed = sampled._replace(positions=np.where(known[:, None], there, np.array(view.pinhole.eye)))
        column, row, depth_there = view.pinhole.project(placed.positions)
        places = np.concatenate([np.stack([column, view.pinhole.height - row], axis=-1), there], axis=-1)
        # A place that float32 can't hold is no place, like one behind the camera.
        valid = valids[number] = known & (depth_there > 0) & (np.abs(places) <= np.finfo(np.float32).max).all(axis=1)
        trajs_2d[number, valid], trajs_3d[number, valid] = places[valid, :2], places[valid, 2:]
        depth, state, _ = surface_points.planes(path, document, states, _state)
        which, _ = surface_points.visible(placed, number, view, depth, state)
        visibs[number, which] = True
    visibs &= valids
    arrays = {
        "trajs_2d": trajs_2d,
        "trajs_3d": trajs_3d,
        "visibs": visibs,
        "valids": valids,
        "intrinsics": np.array([axes.intrinsics(view.pinhole) for view in views]),
        "extrinsics": np.array([axes.world_to_camera(view.pinhole) for view in views]),
    }
    with written_whole(output) as temporary:
        npy.write_archive(temporary, arrays, is_compressed=True)
    return {"pictures": shape[0], "points": shape[1], "places": int(visibs.sum())}


def _state(instance: Document) -> str:
    """The text of what stays while an instance moves and keeps its form."""
    return f"{instance['id']} {instance['box']}"


def _matrices(document: Document, states: dict[str, int]) -> list[tuple[int, np.ndarray]]:
    """The state and the matrix of each instance of a picture."""
    return [(states[_state(each)], np.array(each["object_to_world"], float)) for each in document["instances"]]
