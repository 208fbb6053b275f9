"""Tell what is wrong with a dataset's cameras, by its points or depth maps.

By points, depth maps, true cameras or the .blend that was rendered (cameras/audit.py).
"""

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .. import argument_types as types
from .. import cameras
from ..cameras import Camera, Options
from ..cameras.audit import Depths, Tracks, audit, tracks_through
from ..cameras.evidence import depths, tracks
from ..errors import InputError
from ..terminal import say, silent_libraries
from . import Result, blender_room
from . import _options as shared


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.add_argument(
        "dataset", metavar="DATASET", type=types.path, help="transforms.json, a COLMAP model, or the folder of one"
    )
    by = added.add_mutually_exclusive_group()
    by.add_argument("--points", metavar="COLMAP", type=types.path, help="a COLMAP model of the same pictures and world")
    by.add_argument("--against", metavar="CAMERAS", type=types.path, help="true cameras of the same pictures, in any format")
    text = "the file that was rendered, whose cameras are called as the pictures, or whose frames end their names"
    by.add_argument("--blend", metavar="FILE.blend", type=types.path, help=text)
    shared.add_of_job(added, "trust")
    added.add_argument("--size", type=types.size, metavar="WxH", help="pixels, where the file does not say")


def run(options: argparse.Namespace) -> Result:
    reading = Options(size=options.size, original_world=True)
    with silent_libraries():
        dataset: Sequence[Camera] = cameras.read(options.dataset, options=reading)
        dataset, evidence, by = _evidence(options, dataset, reading)
    verdict = audit(dataset, evidence)
    say(f"{options.dataset}: {verdict.sentence}")
    if verdict.kind != "unsure":
        say(f"Sure to e^{verdict.certainty:.0f} : 1 by {verdict.observations} observations of {by}")
    result: dict[str, Any] = {"dataset": str(options.dataset), "evidence": by, **dataclasses.asdict(verdict)}
    return (0 if verdict.kind in ("none", "unsure") else 1), result


def _evidence(
    options: argparse.Namespace, dataset: Sequence[Camera], reading: Options
) -> tuple[Sequence[Camera], Tracks | Depths, str]:
    """The cameras that there is evidence on, the evidence, and what it is."""
    if source := options.against or options.blend:
        if options.blend:
            names = [_called(camera) for camera in dataset]
            read = blender_room("dataset_cameras").of_pictures(names, options.blend, options.trust)
            for note in read[0].notes:
                options.events.tell("note", command=options.command, text=note)
        else:
            read = cameras.read(options.against, options=reading)
        true = {_called(camera): camera for camera in read}
        both = [camera for camera in dataset if _called(camera) in true]
        if not both:
            raise InputError(f"{source} names none of the pictures of {options.dataset}: give the same names")
        return both, tracks_through([true[_called(camera)] for camera in both]), str(source)
    if points := tracks(options.points or options.dataset, dataset):
        return dataset, points, "points"
    if options.points is None and (maps := depths(options.dataset, dataset)):
        return dataset, maps, "depth maps"
    raise InputError(
        f"{options.points or options.dataset} has no points with tracks and no depth maps: "
        "give a COLMAP model with --points, true cameras with --against, or the .blend that was rendered with --blend"
    )


def _called(camera: Camera) -> str:
    """The picture's name without folder and suffix, by which two files name the same."""
    return Path(camera.image or camera.name).stem
