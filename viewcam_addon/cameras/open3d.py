"""Open3D's PinholeCameraParameters and PinholeCameraTrajectory: what its viewer saves with P, and what people write by them.

A PinholeCameraIntrinsic alone, as its examples' camera_primesense.json, stands at the origin.

`extrinsic` is world to camera, x right, y down, z into the view, and `intrinsic_matrix` K, both **column after column**.
(0, 0) is the center of the first pixel: its viewer puts the principal point at (w − 1)/2.

Source: Open3D's cpp/open3d/camera/PinholeCameraParameters.cpp, PinholeCameraIntrinsic.cpp and utility/IJsonConvertible.cpp
(EigenMatrix4dToJsonArray); visualization/visualizer/ViewControl.cpp (ConvertToPinholeCameraParameters).
"""

import numpy as np

from . import axes, opencv
from .camera import Camera, Options
from .source import Record, Source

TITLE = "camera parameters and trajectories of Open3D (JSON)"

_ONE, _SEVERAL = "PinholeCameraParameters", "PinholeCameraTrajectory"


def recognizes(source: Source) -> bool:
    return source.document.get("class_name") in (_ONE, _SEVERAL) or _is_intrinsic(source)


def _is_intrinsic(source: Source) -> bool:
    """True if all that is said is Open3D's intrinsic, whose K is one list of its columns."""
    k = source.document.get("intrinsic_matrix")
    return source.document.keys() == {"width", "height", "intrinsic_matrix"} and isinstance(k, list) and k[6:7] != [0]


def read(source: Source, options: Options) -> list[Camera]:
    top = Record(source.document, source.name)
    if _is_intrinsic(source):
        top = Record({"intrinsic": dict(source.document), "extrinsic": np.eye(4).ravel().tolist()}, source.name)
    records = top.records("parameters", "camera") if top.get("class_name") == _SEVERAL else [top]
    cameras = []
    for number, record in enumerate(records):
        intrinsic = record.record("intrinsic")
        size = intrinsic.size("width"), intrinsic.size("height")
        k = np.array(intrinsic.numbers("intrinsic_matrix", 9)).reshape(3, 3).T
        plane = opencv.plane_of_k(k.ravel().tolist(), size, opencv.half_pixel(options), intrinsic.place)
        extrinsic = np.array(record.numbers("extrinsic", 16)).reshape(4, 4).T
        matrix = axes.from_world_to_camera(extrinsic[:3, :3], extrinsic[:3, 3].tolist(), record.place)
        pinhole, notes = axes.pinhole(matrix, plane, record.place)
        notes = (*opencv.told_of_half_pixel(options, "Open3D"), *notes)
        cameras.append(Camera(f"{number:05d}", pinhole, True, notes))
    return cameras
