"""The sidecar of a picture, about its camera: the exact values, and what others would have to derive from them.

A batch writes one beside each picture (docs/datasets.md). Unlike a dataset's file it can say that a camera is mirrored: the
matrices then have a determinant of −1. Read back it is the same pinhole to the bit; of what the shot asked for (`stated`) and
what Blender made of it (`camera`) it is the second, which took the picture.
"""

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import InputError
from ..intrinsics import CameraData
from ..pinhole import Pinhole
from . import naming
from .axes import camera_to_world, intrinsics, world_to_camera
from .camera import Camera, Options
from .distortion import Lens, settle
from .source import Record, Source

TITLE = "the sidecars of a batch"
SUFFIX = ".json"
LENSES = True

_SAME = 1e-9  # they are written to the last digit; others may have read and written them

CONVENTION = (
    "K times the first three numbers of worldToCamera times (x, y, z, 1) is depth times (column, row, 1): column vectors; "
    "camera x right, y down, z into the view; pixels from the upper left corner of the picture, the first one's center at "
    "(0.5, 0.5). cameraToWorld: camera x right, y up, z away from the view, as Blender's matrix_world"
)


def record(pinhole: Pinhole, camera_data: CameraData | None = None, lens: Lens | None = None) -> dict[str, Any]:
    """The camera as JSON has it, every number a float64 to the bit.

    camera_data : lens, sensor and shift, where it is a Blender camera.
    lens : the lens that bends the picture.

    Returns `camera` (the keys and conventions of a scene file: `Pinhole(**record["camera"])` is the pinhole), `cameraToWorld`
    and `worldToCamera` (4 × 4), `K` (3 × 3), `convention` (what these mean, see axes.py), and `blender` (the fields of
    `CameraData`) and `lens` (those of `Lens`) if these are given.

    Raises InputError if the translation from the world's origin to the camera is beyond float64.
    """
    camera = {key: list(value) if isinstance(value, tuple) else value for key, value in dataclasses.asdict(pinhole).items()}
    return {
        "camera": camera,
        "cameraToWorld": camera_to_world(pinhole),
        "worldToCamera": world_to_camera(pinhole),
        "K": intrinsics(pinhole),
        "convention": CONVENTION,
        **({} if camera_data is None else {"blender": dataclasses.asdict(camera_data)}),
        **({} if lens is None else {"lens": lens.to_json()}),
    }


def recognizes(source: Source) -> bool:
    return _is_ours(source) or any(map(_is_ours, source.files("*.json")))


def read(source: Source, options: Options) -> list[Camera]:
    files = [source] if not source.is_folder else [file for file in source.files("*.json") if _is_ours(file)]
    return [_camera(file, options) for file in files]


def write(cameras: Sequence[Camera], _options: Options) -> dict[str, str]:
    return naming.files(cameras, SUFFIX, _text)


def _text(camera: Camera) -> str:
    document = {"name": camera.name, "image": camera.image} | record(camera.pinhole, lens=camera.lens)
    return json.dumps(document, indent=1) + "\n"


def _is_ours(source: Source) -> bool:
    return {"camera", "cameraToWorld", "worldToCamera", "K"} <= source.document.keys()


def _camera(source: Source, options: Options) -> Camera:
    document = Record(source.document, source.name)
    camera = document.record("camera")
    fields = {field.name for field in dataclasses.fields(Pinhole)}
    if unknown := camera.values.keys() - fields:
        raise InputError(f"the key {checks.quoted(min(unknown))} of {camera.place} is none of a camera: take it out")
    if missing := fields - camera.values.keys():
        raise InputError(f"{camera.place} has no {min(missing)}: it can't be a camera without")
    preview = next((document.get(key) for key in ("preview", "image") if isinstance(document.get(key), str)), None)
    name = naming.stem(preview) if preview else source.path.stem if source.path else "camera"
    if isinstance(document.get("name"), str):  # the key that a batch leaves out
        name = document.text("name")
    pinhole = Pinhole(**camera.values)
    for key, rows in record(pinhole).items():
        if key in ("cameraToWorld", "worldToCamera", "K"):
            numbers, others = np.ravel(rows), document.numbers(key, np.size(rows))
            if np.abs(numbers - others).max() > _SAME * (1 + np.abs(numbers).max()):
                raise InputError(f"{key} of {document.place} is not that of its camera: change both alike, or export it again")
    lens: Lens | None = None
    notes: tuple[str, ...] = ()
    if "lens" in document:
        stated = Lens.from_json(document.record("lens").values)
        lens, notes = settle(stated, pinhole.plane, camera.place, options.without_distortion)
    return Camera(name, pinhole, notes=notes, image=preview, lens=lens)
