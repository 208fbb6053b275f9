"""Open3D's PinholeCameraParameters and PinholeCameraTrajectory: what its viewer saves with P, and what people write by them.

A PinholeCameraIntrinsic alone, as its examples' camera_primesense.json, stands at the origin. A ViewTrajectory is the view that
Ctrl C copies in its viewer: `front` points from `lookat` to the eye, which is as far away as half of the picture's height is
`zoom` times the longest side of the bounding box, at the `field_of_view`, degrees across that height; it says no size.

`extrinsic` is world to camera, x right, y down, z into the view, and `intrinsic_matrix` K, both **column after column**.
(0, 0) is the center of the first pixel: its viewer puts the principal point at (w − 1)/2.

Source: Open3D's cpp/open3d/camera/PinholeCameraParameters.cpp, PinholeCameraIntrinsic.cpp and utility/IJsonConvertible.cpp
(EigenMatrix4dToJsonArray); visualization/visualizer/ViewControl.cpp (ConvertToPinholeCameraParameters and
SetProjectionParameters) and ViewTrajectory.cpp.
"""

import math

import numpy as np

from ..errors import InputError
from ..pinhole import Pinhole
from . import axes, opencv
from .camera import Camera, LeftOut, Options
from .source import Record, Source

TITLE = "camera parameters, trajectories and views of Open3D (JSON)"

_ONE, _SEVERAL, _VIEWS = "PinholeCameraParameters", "PinholeCameraTrajectory", "ViewTrajectory"
_LEAST_FOV, _MOST_FOV = 5.0, 90.0  # degrees, of Open3D's viewer: at the least it draws an orthographic picture


def recognizes(source: Source) -> bool:
    return source.document.get("class_name") in (_ONE, _SEVERAL, _VIEWS) or _is_intrinsic(source)


def _is_intrinsic(source: Source) -> bool:
    """True if all that is said is Open3D's intrinsic, whose K is one list of its columns."""
    k = source.document.get("intrinsic_matrix")
    return source.document.keys() == {"width", "height", "intrinsic_matrix"} and isinstance(k, list) and k[6:7] != [0]


def read(source: Source, options: Options) -> list[Camera]:
    top = Record(source.document, source.name)
    if top.get("class_name") == _VIEWS:
        return [_view(view, number, options) for number, view in enumerate(top.records("trajectory", "view"))]
    if _is_intrinsic(source):
        top = Record({"intrinsic": dict(source.document), "extrinsic": np.eye(4).ravel().tolist()}, source.name)
    records = top.records("parameters", "camera") if top.get("class_name") == _SEVERAL else [top]
    left_out, cameras = LeftOut(), []
    for number, record in enumerate(records):
        with left_out.unless_pinhole(f"{number:05d}"):
            cameras.append(_camera(record, f"{number:05d}", options))
    return left_out.with_notes(cameras)


def _camera(record: Record, name: str, options: Options) -> Camera:
    intrinsic = record.record("intrinsic")
    size = intrinsic.size("width"), intrinsic.size("height")
    k = np.array(intrinsic.numbers("intrinsic_matrix", 9)).reshape(3, 3).T
    plane = opencv.plane_of_k(k.ravel().tolist(), size, opencv.half_pixel(options), intrinsic.place)
    extrinsic = np.array(axes.upper_rows(np.array(record.numbers("extrinsic", 16)).reshape(4, 4).T, record.place))
    matrix = axes.from_world_to_camera(extrinsic[:3, :3], extrinsic[:3, 3].tolist(), record.place)
    pinhole, notes = axes.pinhole(matrix, plane, record.place)
    notes = (*opencv.told_of_half_pixel(options, "Open3D"), *notes)
    return Camera(name, pinhole, True, notes)


def _view(view: Record, number: int, options: Options) -> Camera:
    width, height = options.size_or_refuse(view.place)
    fov = view.number("field_of_view", None, _LEAST_FOV, _MOST_FOV)
    if fov == _LEAST_FOV:
        raise InputError(f"{view.place} is orthographic, no pinhole: widen its field_of_view in Open3D's viewer")
    low, high = (view.numbers(f"boundingbox_{end}", 3) for end in ("min", "max"))
    front, look_at = view.numbers("front", 3), view.numbers("lookat", 3)
    d = height / 2 / math.tan(math.radians(fov) / 2)
    away = view.number("zoom", least=1e-9) * max(map(abs, (a - b for a, b in zip(high, low, strict=True)))) * d / (height / 2)
    step = away / (math.hypot(*front) or 1.0)
    eye = tuple(a + step * b for a, b in zip(look_at, front, strict=True))
    return Camera(f"{number:05d}", Pinhole(eye, look_at, view.numbers("up", 3), d, width, height), False)
