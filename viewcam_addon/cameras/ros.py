"""ROS camera_info as YAML, as camera_calibration writes it and drivers read it.

K is of the raw picture, P of the rectified one; without distortion and rectification they are one camera, and where P differs
the raw picture's K counts, since its pixels are those that exist. It has no pose, which ROS keeps in tf: the camera stands at
the origin and looks along z (the optical frame), and a note says so. Pixels count from the first one's center, as OpenCV's.
K, P and the size are those of the whole sensor; `roi` and `binning_x`, `binning_y` say which of its pixels the pictures are.

Source: sensor_msgs/CameraInfo.msg.
"""

import json
from collections.abc import Sequence

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, naming, opencv
from .camera import Camera, Options
from .source import Record, Source

TITLE = "ROS camera_info"
SUFFIX = ".yaml"
SEVERAL = "a folder"

_KEYS = {"image_width", "image_height", "camera_matrix", "distortion_model"}


def recognizes(source: Source) -> bool:
    return "camera_matrix" in source.text and source.yaml.keys() >= _KEYS


def read(source: Source, options: Options) -> list[Camera]:
    opencv.refuse_twice(source)
    document = Record(source.yaml, source.name)
    name = str(document.values.get("camera_name") or "camera")
    what = f"camera {checks.quoted(name)}"
    is_fisheye = opencv.says_fisheye(document.values, what)
    k = document.record("camera_matrix").numbers("data", 9)
    if k[0] == 0:
        raise InputError(f"{what} is not calibrated, its K[0] is 0: calibrate it")
    size = (document.size("image_width"), document.size("image_height"))
    plane = opencv.plane_of_k(k, size, opencv.half_pixel(options), what)
    plane, windowed = opencv.of_window(plane, document.values, what)
    notes = opencv.told_of_half_pixel(options, "ROS") + windowed
    if "distortion_coefficients" in document:
        inner = document.record("distortion_coefficients")
        numbers = inner.get("data") if "data" in inner else []
        numbers = Record({"data": numbers}, what).numbers("data", len(numbers))
        if is_fisheye and any(numbers[4:]):
            raise InputError(f"{what} has {len(numbers)} distortion coefficients: a fisheye has four")
        lens, note = opencv.settled(numbers[:4] if is_fisheye else numbers, is_fisheye, plane, what, options)
        notes += note
    else:
        lens = None
        opencv.refuse_unknown_distortion(document.values, what)
    if "rectification_matrix" in document:
        turn = np.array(document.record("rectification_matrix").numbers("data", 9)).reshape(3, 3)
        if np.abs(turn - np.eye(3)).max() > 1e-9:
            notes += (f"{what} is one of a rectified pair: this is the raw picture's camera, not the rectified one's",)
    notes += (f"{what} has no pose, which ROS keeps in tf: it stands at the origin and looks along z, y down",)
    notes += opencv.told_of_pair({opencv.plain(key): value for key, value in document.values.items()}, what)
    pinhole, more = axes.pinhole(axes.from_world_to_camera(np.eye(3), (0, 0, 0), what), plane, what)
    return [Camera(name, pinhole, True, (*notes, *more), lens=lens)]


def write(cameras: Sequence[Camera], options: Options) -> str | dict[str, str]:
    naming.refuse_mirrored(cameras, "ROS camera_info")
    return naming.a_file_each(cameras, SUFFIX, lambda camera: _text(camera, options))


def _text(camera: Camera, options: Options) -> str:
    (f_x, _, c_x), (_, f_y, c_y), _ = axes.intrinsics(camera.pinhole)
    half = opencv.half_pixel(options)
    k = [f_x, 0.0, c_x - half, 0.0, f_y, c_y - half, 0.0, 0.0, 1.0]
    p = [*k[:3], 0.0, *k[3:6], 0.0, *k[6:], 0.0]
    lines = [f"# {options.remembered}"] if options.remembered else []
    lines += [f"image_width: {camera.pinhole.width}", f"image_height: {camera.pinhole.height}"]
    lines += [f"camera_name: {json.dumps(camera.name)}", *_matrix("camera_matrix", 3, k), "distortion_model: plumb_bob"]
    lines += [*_matrix("distortion_coefficients", 5, [0.0] * 5)]
    lines += [*_matrix("rectification_matrix", 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])]
    return "\n".join([*lines, *_matrix("projection_matrix", 4, p)]) + "\n"


def _matrix(name: str, columns: int, data: Sequence[float]) -> list[str]:
    rows = len(data) // columns
    return [f"{name}:", f"  rows: {rows}", f"  cols: {columns}", f"  data: [{', '.join(map(repr, data))}]"]
