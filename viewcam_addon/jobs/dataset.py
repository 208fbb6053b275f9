"""A finished batch as a dataset: transforms.json and a COLMAP model beside its pictures, from what their sidecars say.

Of labels it names what is there of all shots: depth and masks, and points of both. Where some pictures are held out for tests,
transforms.json names them, and the original NeRF's transforms_train.json, transforms_val.json and transforms_test.json have
each their own.

The cameras are those that took the pictures, as Blender has them, not those that were asked for; the sidecars have both. A
dataset is of all shots of the list or there is none: programs that learn from one take what is named in it for all there is.
"""

import fnmatch
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cameras import Camera, check_no_other_model, colmap, save, transforms
from ..cameras.distortion import Lens
from ..errors import InputError, counted, several
from ..files import check_writable, written_whole
from ..labels import colmap as labels
from ..labels import files as label_files
from ..pinhole import Pinhole
from .folder import Folder
from .job import Job

MODEL = ("sparse", "0")
"""The folder in which COLMAP and those who read its models look for one."""


SPLITS = ("train", "val", "test")
"""The splits that readers of the original NeRF's files and of nerfstudio's lists want: val has the pictures of test."""

_POINTS, _LONGEST_TRACK = 100_000, 10
"""Points at most, and pictures of each: as many as COLMAP finds in real pictures. All that see a point would be 200 MB of text
for 100 pictures of a room."""

_NGP_SCALE = 0.33
"""By which instant-ngp takes the world into its unit cube, whose middle is the origin."""


def refuse(shots: Sequence[Job], suffix: str, test: str | None = None) -> None:
    """Raise InputError for what no dataset could say, before any shot is rendered.

    suffix, test : see `write`.
    """
    colmap.check_names([f"{shot.name}.{suffix}" for shot in shots])
    place = Pinhole((0, 0, 1), (0, 0, 0), (0, 1, 0), 1, 1, 1)
    firsts = {shot.calibration: str(shot.name) for shot in reversed(shots)}
    cameras = [
        Camera(name, each.at(place) if each else place, image=name, lens=each.lens if each else None)
        for each, name in firsts.items()
    ]
    transforms.document(cameras)
    colmap.texts(cameras)
    if test is not None:
        if suffix != "png":
            raise InputError("--test writes the original NeRF's files, whose pictures are PNGs: give --transforms png")
        _held_out([shot.name for shot in shots], test)


def check_folder(folder: Folder) -> None:
    """Raise InputError if a dataset can't be written into the folder, as far as that is known before anything is rendered."""
    check_writable(folder.path / transforms.FILE)
    check_no_other_model(folder.path.joinpath(*MODEL), "colmap")
    for file in (*colmap.TEXTS, labels.PLY):
        check_writable(folder.path.joinpath(*MODEL, file))


def write(folder: Folder, shots: Sequence[Job], settings: Mapping[str, str], suffix: str, test: str | None = None) -> str:
    """Write transforms.json and sparse/0 into the folder, each file whole or not at all, if all shots are there.

    shots : all of the list, whose order the dataset has.
    settings : the hash of what each is made from, by its name.
    suffix : "png" for the previews as pictures, "exr" for the pictures themselves.
    test : the pictures to hold out, as `--test` says: "8" for every eighth from the first on, or names with * ? [abc].

    Returns a sentence: that it is written, or which shots are missing.

    Raises InputError if a camera is mirrored or a name holds a space, which these formats can't say, or if the files can't be
    written; FullDiskError if the disk is full.
    """
    finished = {shot.name: folder.finished(shot.name, settings[shot.name]) for shot in shots}
    records = {name: record for name, record in finished.items() if record is not None}
    missing = [name for name in finished if name not in records]
    if missing:
        return f"no dataset is written, since {len(missing):,} of {counted(len(shots), 'shot')} are missing: {several(missing)}"
    cameras = [replace(_camera(folder, name, record), image=f"{name}.{suffix}") for name, record in records.items()]
    top, frames = _labeled(records)
    model, points = folder.path.joinpath(*MODEL), 0
    if {"depth_file_path", "mask_path"} <= frames[0].keys():
        files_of_labels = [(path, label_files.read(path)) for path in (folder.path / f"{name}.labels.json" for name in records)]
        tracks = labels.tracks_of(
            files_of_labels, cameras, max(1, min(labels.POINTS, _POINTS // len(files_of_labels))), _LONGEST_TRACK
        )
        points = len(tracks.positions)
        for name, content in labels.contents(cameras, tracks).items():
            with written_whole(model / name) as temporary:
                temporary.write_bytes(content)
        top |= {"ply_file_path": "/".join((*MODEL, labels.PLY)), "aabb_scale": _aabb_scale(tracks.positions)}
    else:
        save(cameras, model, "colmap")
    files = {transforms.FILE: (cameras, top, frames)}
    if test is not None:
        held_out = _held_out([*records], test)
        of_split = {split: [(name in held_out) == (split != "train") for name in records] for split in SPLITS}
        for split, chosen in of_split.items():
            top[f"{split}_filenames"] = [camera.image for camera in itertools.compress(cameras, chosen)]
            # The original NeRF adds .png, as does whoever reads its files.
            bare = [replace(camera, image=camera.name) for camera in itertools.compress(cameras, chosen)]
            files[f"transforms_{split}.json"] = (bare, {}, [{}] * len(bare))
    for file, (views, more, of_frames) in files.items():
        with written_whole(folder.path / file) as temporary:
            text = transforms.text(transforms.document(views, more=more, of_frames=of_frames))
            temporary.write_text(text, encoding="utf-8", newline="\n")
    of_points = f" and {points:,} points" if points else ""
    return f"dataset of {counted(len(cameras), 'picture')}{of_points}: {folder.path / transforms.FILE} and {model}"


def _labeled(records: Mapping[str, Mapping[str, Any]]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The keys at the top of transforms.json and those of each frame that say which labels all shots have."""
    labels_of = {name: record.get("labels", {}) for name, record in records.items()}
    steps = {each["depth_steps"] for each in labels_of.values() if each}
    top: dict[str, Any] = {}
    keys: dict[str, str] = {}
    if all(f"{name}.depth.png" in each.get("files", ()) for name, each in labels_of.items()):
        if len(steps) > 1:
            raise InputError(
                "the shots' depths have different steps, and a dataset says one: write them again, with --overwrite"
            )
        unit = 1 / steps.pop()
        top = {"depth_unit_scale_factor": unit, "integer_depth_scale": unit}  # nerfstudio's and instant-ngp's
        keys = {"depth_file_path": "depth.png", "depth_path": "depth.png"}
    if all(f"{name}.mask.png" in each.get("files", ()) for name, each in labels_of.items()):
        keys["mask_path"] = "mask.png"
    return top, [{key: f"{name}.{ending}" for key, ending in keys.items()} for name in records]


def _aabb_scale(points: NDArray[np.float64]) -> int:
    """The least power of two by which instant-ngp's cube, of side 1 / 0.33 about the origin, holds all points; its most if
    none does."""
    farthest = float(np.abs(points).max(initial=0.0))
    scales = transforms.AABB_SCALES
    return next((scale for scale in scales if farthest * _NGP_SCALE <= scale / 2), scales[-1])


def _held_out(names: Sequence[str], test: str) -> set[str]:
    """The pictures that are held out for tests. Raises InputError where these are none or all."""
    if test.isdecimal() and int(test) > 0:
        result = {*names[:: int(test)]}
    else:
        result = {name for name in names if fnmatch.fnmatchcase(name, test)}
    if not result or len(result) == len(names):
        what = "none" if not result else "all"
        raise InputError(f"--test {test} holds out {what} of the {counted(len(names), 'picture')}: give another number or name")
    return result


def _camera(folder: Folder, name: str, record: Mapping[str, Any]) -> Camera:
    try:
        lens = Lens.from_json(record["lens"]) if "lens" in record else None
        return Camera(name, Pinhole(**record["camera"]), lens=lens)
    except (KeyError, TypeError, InputError) as error:
        raise InputError(
            f"{folder.sidecar(name)} has no camera that can be read: render the shot again, with --overwrite"
        ) from error
