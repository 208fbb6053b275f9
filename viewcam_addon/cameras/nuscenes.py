"""nuScenes' tables (JSON): calibrated_sensor, ego_pose and sample_data, in one folder.

A sensor's translation and rotation (a quaternion, w first) place it on the vehicle, and ego_pose places that in the world at
each picture; the camera looks along its z, x to the right and y down, and a `camera_intrinsic` of 3 × 3 is K in its pixels. Of
calibrated_sensor alone the cameras stand on the vehicle. Lidars and radars, which have no camera_intrinsic, are no cameras.

Source: the nuScenes devkit's docs/schema_nuscenes.md, and map_pointcloud_to_image of its nuscenes.py.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from . import axes, naming, opencv
from .camera import Camera, LeftOut, Options
from .source import Record, Source

TITLE = "nuScenes"

_SENSORS, _POSES, _PICTURES = (f"{name}.json" for name in ("calibrated_sensor", "ego_pose", "sample_data"))
_KEYS = {"translation", "rotation", "camera_intrinsic"}
_MOST = 100_000


def recognizes(source: Source) -> bool:
    rows = _rows(source.file(_SENSORS) if source.is_folder else source)
    return bool(rows) and isinstance(rows[0], dict) and rows[0].keys() >= _KEYS


def _rows(source: Source | None) -> Sequence[Any]:
    return source.json if source is not None and isinstance(source.json, list) else ()


def read(source: Source, options: Options) -> list[Camera]:
    sensors = {}
    for number, row in enumerate(_rows(source.file(_SENSORS) if source.is_folder else source)):
        sensor = Record(row, f"sensor {number}")
        if sensor.get("camera_intrinsic"):
            sensors[sensor.text("token", f"{number}")] = sensor
    if not sensors:
        raise InputError(f"{source.name} has no sensor with a camera_intrinsic: give the tables of a vehicle with cameras")
    pictures = _rows(source.file(_PICTURES)) if source.is_folder else ()
    left_out, cameras = LeftOut(), []
    if not pictures:
        size = options.size_or_refuse(source.name)
        note = f"Where the vehicle was is said by {_POSES} and {_PICTURES}, which are not here: it stands at the origin"
        for token, sensor in sensors.items():
            with left_out.unless_pinhole(token):
                cameras.append(_camera(token, sensor, np.eye(4), size, options).noted(note))
        return left_out.with_notes(cameras)
    poses = {row["token"]: row for row in _rows(source.file(_POSES)) if isinstance(row, dict) and "token" in row}
    rows = [Record(row, f"picture {number}") for number, row in enumerate(pictures)]
    rows = [row for row in rows if row.get("calibrated_sensor_token") in sensors]
    if len(rows) > _MOST:
        raise InputError(f"{source.name} has {len(rows)} pictures: give at most {_MOST}")
    paths = [row.text("filename") for row in rows]
    for row, path, name in zip(rows, paths, naming.distinct(paths), strict=True):
        with left_out.unless_pinhole(name):
            ego = row.text("ego_pose_token")
            if ego not in poses:
                raise InputError(f"{row.place} has an ego_pose_token that is not in {_POSES}: give the tables of one version")
            vehicle = _matrix(Record(poses[ego], f"the ego_pose of {row.place}"))
            sensor = sensors[row.text("calibrated_sensor_token")]
            camera = _camera(name, sensor, vehicle, (row.size("width"), row.size("height")), options, path)
            cameras.append(camera)
    return left_out.with_notes(cameras)


def _matrix(row: Record) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = axes.rotation_of(row.numbers("rotation", 4), row.place)
    result[:3, 3] = row.numbers("translation", 3)
    return result


def _camera(
    name: str, sensor: Record, vehicle: np.ndarray, size: tuple[int, int], options: Options, path: str | None = None
) -> Camera:
    plane = opencv.plane_of_k(sensor.numbers("camera_intrinsic", 9), size, opencv.half_pixel(options), sensor.place)
    pinhole, notes = axes.pinhole(axes.of_opencv(vehicle @ _matrix(sensor)), plane, sensor.place)
    return Camera(name, pinhole, path is not None, (*opencv.told_of_half_pixel(options, "nuScenes"), *notes), path)
