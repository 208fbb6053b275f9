"""A COLMAP model in its binary form, out; it is read in colmap.py, which tells of both. Little endian, without padding."""

import struct
from collections.abc import Sequence

from . import naming
from .camera import Camera, Options
from .colmap import FORMS_OF_RIGS, MODELS, NOTES, TEXTS, check_names, comments, intrinsics_of, pose_of

TITLE = "COLMAP model, binary"
SUFFIX = ""
LENSES = True
NOT_BESIDE = (*FORMS_OF_RIGS, *TEXTS)  # text counts before it for nerfstudio


def write(cameras: Sequence[Camera], options: Options) -> dict[str, str | bytes]:
    cameras = naming.checked(cameras, "a COLMAP model")
    check_names(map(naming.image_of, cameras))
    numbers: dict[bytes, int] = {}
    images = [struct.pack("<Q", len(cameras))]
    for number, camera in enumerate(cameras, start=1):
        intrinsic = numbers.setdefault(_intrinsics(camera), len(numbers) + 1)
        images.append(struct.pack("<I7dI", number, *pose_of(camera.pinhole), intrinsic))
        images.append(naming.image_of(camera).encode("utf-8") + b"\0" + struct.pack("<Q", 0))
    return {
        "images.bin": b"".join(images),
        "cameras.bin": struct.pack("<Q", len(numbers)) + b"".join(struct.pack("<I", i) + each for each, i in numbers.items()),
        "points3D.bin": struct.pack("<Q", 0),
        NOTES: (f"# {options.remembered}\n" if options.remembered else "") + comments(cameras),
    }


def _intrinsics(camera: Camera) -> bytes:
    model, width, height, parameters = intrinsics_of(camera.pinhole, camera.lens)
    return struct.pack(f"<iQQ{len(parameters)}d", MODELS[model][0], width, height, *parameters)
