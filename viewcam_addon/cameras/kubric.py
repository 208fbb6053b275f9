"""Kubric's metadata.json, as of MOVi: one camera, with its place at every frame.

`camera` has `positions` and `quaternions` (w, x, y, z), camera to world with x right, y up, z away from the view, world z up,
and `focal_length` and `sensor_width` in the same unit. The sensor's width is that of the picture whatever its shape, since
Kubric sets Blender's sensor fit so; pixels are square and nothing is shifted. `metadata` has `resolution`, width first, and
`frame_rate`. The pictures are rgba_00000.png and so on, beside the file.

Source: kubric's core/cameras.py, renderer/blender.py (sensor_fit) and core/scene.py.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..errors import InputError
from . import axes
from .camera import Camera, Options
from .source import Record, Source, pixels

TITLE = "Kubric metadata.json"
FILE = "metadata.json"

_KEYS = {"positions", "quaternions", "focal_length", "sensor_width"}


def recognizes(source: Source) -> bool:
    return _document(source) is not None


def read(source: Source, options: Options) -> list[Camera]:
    top = Record(_document(source), source.name)
    camera, scene = top.record("camera"), Record(top.get("metadata") or {}, "metadata")
    if stated := "resolution" in scene:
        width, height = (pixels("resolution of metadata", side) for side in scene.numbers("resolution", 2))
    else:
        width, height = options.size_or_refuse(source.name)
    d = camera.number("focal_length", least=1e-9) / camera.number("sensor_width", least=1e-9) * width
    plane = axes.view_plane(d, d, width / 2, height / 2, (width, height))
    rate = scene.number("frame_rate", least=1e-3, most=1e6) if "frame_rate" in scene else None
    positions, quaternions = camera.needed("positions"), camera.needed("quaternions")
    if not isinstance(positions, list) or not isinstance(quaternions, list) or len(positions) != len(quaternions):
        raise InputError("positions and quaternions of camera are to be lists of one length: export the file again")
    cameras = []
    for number, place in enumerate(zip(positions, quaternions, strict=True)):
        frame = Record(dict(zip(("position", "quaternion"), place, strict=True)), f"frame {number} of the camera")
        turn = axes.rotation_of(frame.numbers("quaternion", 4), frame.place)
        matrix = np.column_stack([turn, frame.numbers("position", 3)])
        pinhole, notes = axes.pinhole(matrix, plane, frame.place)
        time = None if rate is None else number / rate
        cameras.append(Camera(f"{number:05d}", pinhole, stated, notes, f"rgba_{number:05d}.png", time=time))
    return cameras


def _document(source: Source) -> Mapping[str, Any] | None:
    file = source.file(FILE) if source.is_folder else source
    camera = file.document.get("camera") if file else None
    return file.document if file and isinstance(camera, dict) and camera.keys() >= _KEYS else None
