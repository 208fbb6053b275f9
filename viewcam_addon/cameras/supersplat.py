"""SuperSplat's cameras: document.json in a project (.ssproj, a ZIP), and settings.json of its viewer's pages.

A pose has `position`, `target` and `fov`, the degrees of the picture's longer side; y is up and nothing rolls. A project's
stand in `poseSets`, each at a `frame` of `timeline`; the viewer's in `animTracks`, whose times are frames, too, or, if nothing
is animated, in `cameras` or, of older settings, `camera`. Neither says a size. SuperSplat flies through the keyframes along a
spline.

It shows a splat turned by 180° about z: the world of the PLY is (−x, −y, z), and that is the one of `original_world`.

Source: SuperSplat's src/camera-poses.ts, src/camera.ts (setPose, horizontalFov), src/splat-serialize.ts (ExperienceSettings),
and its src/file-handler.ts (loadCameraPoses), for the turn.
"""

import io
import math
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

from .. import checks
from ..pinhole import Pinhole, Triple
from .camera import Camera, Options
from .source import Record, Source

TITLE = "SuperSplat (project, settings.json of its viewer)"

_VIEWS = ("cameras", "camera")
_FILE = "document.json"
_MOST_BYTES = 2**24  # for this part of a project
_FOV, _RATE = 60.0, 30.0  # SuperSplat's, where a file says none
_FOVS = 1e-6, 180 - 1e-6  # degrees from which on and up to which it is one
_TURNED = "SuperSplat shows a splat turned by 180° about z, and its y is up: the original world is that of the .ply"
_SPLINE = "These are the path's keyframes: SuperSplat itself flies through them along a spline"


def recognizes(source: Source) -> bool:
    document = _document(source)
    if isinstance(document.get("poseSets"), list):
        return True
    return isinstance(document.get("animTracks"), list) and any(isinstance(document.get(key), dict | list) for key in _VIEWS)


def read(source: Source, options: Options) -> list[Camera]:
    width, height = size = options.size_or_refuse(source.name)
    sign = -1.0 if options.original_world else 1.0
    top = Record(_document(source), source.name)
    poses: list[tuple[Record, float | None]] = [*_keyframes(top)]
    notes = (*(() if options.original_world else (_TURNED,)), *((_SPLINE,) if len(poses) > 1 else ()))
    cameras: list[Camera] = []
    for pose, time in poses or [(view, None) for view in _views(top)]:
        eye, target = (_turned(pose.numbers(key, 3), sign) for key in ("position", "target"))
        d = max(size) / 2 / math.tan(math.radians(pose.number("fov", _fov(top), *_FOVS)) / 2)
        pinhole = Pinhole(eye, target, (0.0, sign, 0.0), d, width, height)
        name = str(pose.get("name") or f"{len(cameras):05d}")
        cameras.append(Camera(name, pinhole, False, notes, time=time))
    return cameras


def _document(source: Source) -> Mapping[str, Any]:
    """The document; of a project that in its ZIP."""
    if source.data[:4] != b"PK\x03\x04":
        return source.document
    if TITLE not in source.parsed:
        source.parsed[TITLE] = {}
        try:
            with zipfile.ZipFile(io.BytesIO(source.data)) as archive, archive.open(_FILE) as file:
                source.parsed[TITLE] = Source(file.read(_MOST_BYTES)).document
        except (LookupError, ValueError, OSError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error):
            pass
    document: Mapping[str, Any] = source.parsed[TITLE]
    return document


def _fov(top: Record) -> float:
    """The degrees of a pose that says none."""
    camera = top.get("camera")
    return Record(camera, "camera").number("fov", _FOV, *_FOVS) if isinstance(camera, dict) else _FOV


def _keyframes(top: Record) -> Iterator[tuple[Record, float]]:
    """The poses of a path, in order, with their seconds."""
    if "poseSets" in top:
        timeline = top.get("timeline")
        rate = Record(timeline, "timeline").number("frameRate", _RATE, 1e-3, 1e6) if isinstance(timeline, dict) else _RATE
        poses = [pose for poses in top.records("poseSets", "pose set") for pose in poses.records("poses", "pose")]
        timed = [(pose, pose.number("frame", number * rate) / rate) for number, pose in enumerate(poses)]
        yield from sorted(timed, key=lambda pose: pose[1])
        return
    for track in top.records("animTracks", "track"):
        keys = track.record("keyframes")
        values, rate = keys.record("values"), track.number("frameRate", _RATE, 1e-3, 1e6)
        times = keys.needed("times")
        count = len(times) if isinstance(times, list) else 0
        position, target = (values.numbers(key, 3 * count) for key in ("position", "target"))
        fov = values.numbers("fov", count) if "fov" in values else (_fov(top),) * count
        for i, frame in enumerate(keys.numbers("times", count)):
            pose = {"position": position[3 * i : 3 * i + 3], "target": target[3 * i : 3 * i + 3], "fov": fov[i]}
            yield Record({key: [*v] if isinstance(v, tuple) else v for key, v in pose.items()}, f"keyframe {i}"), frame / rate


def _views(top: Record) -> Iterator[Record]:
    """The views that a page starts with."""
    if "cameras" in top:
        for camera in top.records("cameras", "camera"):
            yield camera.record("initial")
    else:
        yield top.record("camera")


def _turned(point: Triple | tuple[float, ...], sign: float) -> Triple:
    x, y, z = checks.vector("a point", point, 3)
    return sign * x, sign * y, z
