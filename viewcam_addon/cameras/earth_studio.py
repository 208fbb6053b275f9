"""Google Earth Studio's tracking data (JSON): its *3D Camera Export*, a camera for each frame.

`position` is in meters along the Earth's own axes, from its center or, exported with a local origin, from that: z to the north
pole, x to longitude 0 at the equator. `rotation` has the degrees of Rx Ry Rz, camera to Earth with x right, y down, z into the
view. `fovVertical` is the degrees of the height. Neither the axes nor six million meters are of use elsewhere: so the cameras
are turned to x east, y north, z up at the first camera's `coordinate`, and those that count from the Earth's center moved to
the point below the first one, altitude 0. A file without coordinates stays as it is, and so does all with `original_world`.

No document says how rotations count: two published frames, one looking straight down and one with heading 270.12° and pitch
−44.61°, are this and nothing else of the orders and axes there are.

Source: stackoverflow.com/questions/68705448 and community.cesium.com/t/43144 (the frames); BungeeNeRF's README.md and
GES2pose.py.
"""

import math

import numpy as np

from ..rotation import from_euler
from . import axes
from .camera import Camera, Options
from .source import Record, Source

TITLE = "Google Earth Studio's tracking data (JSON)"

_KEYS = {"position", "rotation", "fovVertical"}
_GLOBAL = 1e6  # meters from the origin, which is then the Earth's center
_LOCAL = "The world was turned to x east, y north, z up at the first camera"
_BELOW = "its origin is the point below the first camera at altitude 0"


def recognizes(source: Source) -> bool:
    frames = source.document.get("cameraFrames")
    return isinstance(frames, list) and bool(frames) and isinstance(frames[0], dict) and frames[0].keys() >= _KEYS


def read(source: Source, options: Options) -> list[Camera]:
    top = Record(source.document, source.name)
    size = top.size("width"), top.size("height")
    rate = _rate(top)
    frames = top.records("cameraFrames", "frame")
    turn, origin, notes = _world(frames[0]) if not options.original_world else (np.eye(3), np.zeros(3), ())
    cameras = []
    for number, frame in enumerate(frames):
        d = size[1] / 2 / math.tan(math.radians(frame.number("fovVertical", least=1e-6, most=180 - 1e-6)) / 2)
        plane = axes.view_plane(d, d, size[0] / 2, size[1] / 2, size)
        matrix = np.column_stack([turn @ _rotation(frame), turn @ (_point(frame, "position") - origin)])
        pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, frame.place)
        time = None if rate is None else number / rate
        cameras.append(Camera(f"{number:05d}", pinhole, True, (*notes, *more), time=time))
    return cameras


def _rate(top: Record) -> float | None:
    """Frames a second; None where the file does not say."""
    if "frameRate" in top:
        return top.number("frameRate", least=1e-3, most=1e6)
    if "numFrames" in top and "durationSeconds" in top:
        return top.number("numFrames", least=1) / top.number("durationSeconds", least=1e-6)
    return None


def _world(frame: Record) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """(3, 3) from the Earth's axes to east, north, up at a frame's coordinate, the origin (3) along the Earth's, and notes."""
    if "coordinate" not in frame:
        return np.eye(3), np.zeros(3), ("The file says no coordinates: the world's axes are the Earth's",)
    coordinate = frame.record("coordinate")
    lat, lon = (math.radians(coordinate.number(key, least=-360, most=360)) for key in ("latitude", "longitude"))
    east = (-math.sin(lon), math.cos(lon), 0.0)
    north = (-math.sin(lat) * math.cos(lon), -math.sin(lat) * math.sin(lon), math.cos(lat))
    up = (math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat))
    place = _point(frame, "position")
    if math.hypot(*place) < _GLOBAL:
        return np.array([east, north, up]), np.zeros(3), (_LOCAL,)
    below = place - coordinate.number("altitude") * np.array(up)
    return np.array([east, north, up]), below, (f"{_LOCAL}; {_BELOW}",)


def _point(frame: Record, key: str) -> np.ndarray:
    point = frame.record(key)
    return np.array([point.number(axis) for axis in "xyz"])


def _rotation(frame: Record) -> np.ndarray:
    """(3, 3) Rx Ry Rz of the frame's degrees."""
    return from_euler(np.radians(_point(frame, "rotation")).tolist(), "ZYX")
