"""Basalt's calibration (JSON): cameras on an IMU, at whose place and in whose axes the world is.

`value0` has T_imu_cam, each camera's place and quaternion (camera to IMU, x right, y down, z into the view); intrinsics, by
`camera_type`; and resolution, width first. Of its models pinhole, pinhole-radtan8 (OpenCV's k1 … k6 with p1, p2) and kb4
(OpenCV's fisheye) are read; ds, eucm and ucm are refused by their names. It counts from the first pixel's center, as its
corners of patterns do.

Source: basalt-headers' calibration.hpp, serialization/headers_serialization.h and camera/*.hpp.
"""

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, opencv
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source, pixels

TITLE = "Basalt's calibration"

_LENSES = {"pinhole": (), "pinhole-radtan8": ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), "kb4": ("k1", "k2", "k3", "k4")}


def recognizes(source: Source) -> bool:
    top = source.document.get("value0")
    return isinstance(top, dict) and {"T_imu_cam", "intrinsics"} <= top.keys()


def read(source: Source, options: Options) -> list[Camera]:
    top = Record(source.document, source.name).record("value0")
    poses, lenses = (top.records(key, f"{key} of camera") for key in ("T_imu_cam", "intrinsics"))
    sizes = top.get("resolution") or []
    if len(poses) != len(lenses) or not isinstance(sizes, list) or len(sizes) not in (0, len(poses)):
        raise InputError(f"{top.place} has not as many T_imu_cam, intrinsics and resolution: export it again")
    left_out, cameras = LeftOut(), []
    for number, (pose, lens) in enumerate(zip(poses, lenses, strict=True)):
        name = f"cam{number}"
        with left_out.unless_pinhole(name):
            size = tuple(sizes[number]) if sizes and isinstance(sizes[number], list) else options.size_or_refuse(name)
            cameras.append(_camera(name, pose, lens, size, bool(sizes), options))
    return left_out.with_notes(cameras)


def _camera(name: str, pose: Record, entry: Record, size: tuple, is_stated: bool, options: Options) -> Camera:
    kind, lens = entry.text("camera_type"), entry.record("intrinsics")
    if kind not in _LENSES:
        not_a_pinhole(name, f"of the model {checks.quoted(kind)}")
    if len(size) != 2:
        raise InputError(f"the resolution of {name} is {checks.quoted([*size])}: give its width and height")
    width, height = (pixels(f"the resolution of {name}", side) for side in size)
    k = [lens.number(key) for key in ("fx", "fy", "cx", "cy")]
    plane = opencv.plane_of_k(k, (width, height), opencv.half_pixel(options), name)
    numbers = {key: lens.number(key) for key in _LENSES[kind]}
    bent, notes = opencv.settled(numbers, kind == "kb4", plane, name, options)
    turn = axes.rotation_of([pose.number(key) for key in ("qw", "qx", "qy", "qz")], name)
    matrix = np.column_stack([turn, [pose.number(key) for key in ("px", "py", "pz")]])
    pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, name)
    notes = (*opencv.told_of_half_pixel(options, "Basalt"), *notes, *more)
    return Camera(name, pinhole, is_stated, notes, lens=bent)
