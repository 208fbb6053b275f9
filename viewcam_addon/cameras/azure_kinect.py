"""Azure Kinect's raw calibration (JSON), as its SDK gives it and its recordings hold it: a depth camera and one of color.

A camera's `ModelParameters` are cx, cy, fx, fy, as parts of its sensor's width and height from the corner, then k1 … k6, the
center of distortion (0) and p2, p1: OpenCV's, of the Brown-Conrady model. `Rt` takes meters from the depth camera to it, row
after row, x right, y down, z into the view. The picture is that of the whole sensor, of which the SDK's modes show parts: 16:9
is the middle of the color camera's 4:3.

Source: the Azure Kinect Sensor SDK's calibration.c, mode_specific_calibration.c, intrinsic_transformation.c and, for `Rt`,
extrinsic_transformation.c.
"""

import numpy as np

from .. import checks
from ..errors import InputError
from . import axes, opencv
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source

TITLE = "Azure Kinect's calibration"

_BROWN = "CALIBRATION_LensDistortionModelBrownConrady"
_NAMES = ("k1", "k2", "k3", "k4", "k5", "k6", "codx", "cody", "p2", "p1")


def recognizes(source: Source) -> bool:
    top = source.document.get("CalibrationInformation")
    return isinstance(top, dict) and isinstance(top.get("Cameras"), list)


def read(source: Source, options: Options) -> list[Camera]:
    entries = Record(source.document, source.name).record("CalibrationInformation").records("Cameras", "camera")
    left_out, cameras = LeftOut(), []
    for number, entry in enumerate(entries):
        name = entry.text("Location", f"camera_{number}").removeprefix("CALIBRATION_CameraLocation")
        with left_out.unless_pinhole(name):
            cameras.append(_camera(name, entry, options))
    return left_out.with_notes(cameras)


def _camera(name: str, entry: Record, options: Options) -> Camera:
    what = f"camera {checks.quoted(name)}"
    size = width, height = entry.size("SensorWidth"), entry.size("SensorHeight")
    intrinsics, pose = entry.record("Intrinsics"), entry.record("Rt")
    model = intrinsics.text("ModelType", _BROWN)
    if model != _BROWN:
        not_a_pinhole(what, f"of the model {checks.quoted(model)}")
    c_x, c_y, f_x, f_y, *rest = intrinsics.numbers("ModelParameters", 14)
    if not min(f_x, f_y) > 0:
        raise InputError(f"{what} has the focal lengths {f_x:g} and {f_y:g}: give numbers above 0")
    plane = axes.view_plane(f_x * width, f_y * height, c_x * width, c_y * height, size)
    numbers = dict(zip(_NAMES, rest, strict=True))
    if numbers.pop("codx") or numbers.pop("cody"):
        not_a_pinhole(what, "a camera with a center of distortion beside its axis")
    lens, notes = opencv.settled(numbers, False, plane, what, options)
    turn = np.array(pose.numbers("Rotation", 9)).reshape(3, 3)
    matrix = axes.from_world_to_camera(turn, pose.numbers("Translation", 3), what)
    pinhole, more = axes.pinhole(matrix, plane, what)
    note = f"{what} has the whole of its sensor, {width} × {height}, of which its pictures may be a part"
    return Camera(name, pinhole, True, (note, *notes, *more), lens=lens)
