"""VisualSFM's NVM: the cameras of its first model, with R as a quaternion and the eye.

    NVM_V3 [FixedK fx cx fy cy …]           the principal point is the picture's middle, unless the calibration is fixed
    number of cameras
    name f  w x y z  eye x y z  d  0        NVM_V3_R9T: R, row by row, and t in their place

World to camera, x right, y down, z into the view; a blank in a picture's name is written as ". The size is the pictures', or
given. The one term of the lens, d, is of the **photograph's** radius: the pinhole's is r (1 + d r²), both at the distance 1.
What COLMAP and Bundler call k1 is of the pinhole's radius, and so it is −d in the first order only. Each model of a file has a
world of its own; of several the first is read, and a note says so.

Source: VisualSFM's documentation (ccwu.me/vsfm/doc.html#nvm); Multicore Bundle Adjustment's util.h (LoadNVM) and
DataInterface.h (SetNormalizedMeasurementDistortion).
"""

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import ViewPlane
from . import axes, distortion, naming
from .camera import Camera, Options
from .source import Source, flat, image_size, numbered_lines, table

TITLE = "VisualSFM NVM"

_BEGINS = ("NVM_V3", "NVM_V3_R9T")


def recognizes(source: Source) -> bool:
    return source.text[:20].split()[:1] in ([name] for name in _BEGINS)


def read(source: Source, options: Options) -> list[Camera]:
    lines = numbered_lines(source)
    kind, *calibration = lines[0][1].split()
    count, after = _count(source, lines, 1)
    if not count:
        return []
    cameras_of_file = [line.split() for _, line in lines[after : after + count]]
    length = 16 if kind == "NVM_V3_R9T" else 11
    if len(cameras_of_file) < count or any(len(words) != length for words in cameras_of_file):
        raise InputError(f"{source.name} has not {count} cameras of {length - 1} numbers each: export it again")
    paths = [words[0].replace('"', " ") for words in cameras_of_file]
    names = naming.distinct(paths)
    numbers = [(number, " ".join(words[1:])) for (number, _), words in zip(lines[after:], cameras_of_file, strict=False)]
    rows = table(source.name, numbers)
    planes = [_plane(row[0], calibration, path, source, options) for row, path in zip(rows.tolist(), paths, strict=True)]
    if kind == "NVM_V3_R9T":
        matrices = axes.from_worlds_to_cameras(rows[:, 1:10].reshape(-1, 3, 3), rows[:, 10:13], names)
    else:
        turns = axes.rotations_of(_of_length_1(rows[:, 1:5]), names)
        matrices = axes.of_opencv(np.concatenate([turns.swapaxes(1, 2), rows[:, 5:8, None]], axis=2))
    posed = axes.pinholes(matrices, [plane for plane, _ in planes], names)
    cameras = []
    for index, ((pinhole, notes), (plane, stated)) in enumerate(zip(posed, planes, strict=True)):
        measured = distortion.measured(rows[index, -2], "d") if rows[index, -2] else distortion.opencv({})
        lens, note = distortion.settle(measured, plane, names[index], options.without_distortion)
        cameras.append(Camera(names[index], pinhole, stated, (*note, *notes), paths[index], lens=lens))
    return [camera.noted(*_others(source, lines, after + count)) for camera in cameras]


def _count(source: Source, lines: list[tuple[int, str]], at: int) -> tuple[int, int]:
    """The number of cameras of a model, and the place behind it."""
    try:
        count = int(lines[at][1])
    except (IndexError, ValueError):
        count = -1
    if not 0 <= count <= len(lines):
        raise InputError(f"{source.name} has no number of cameras after its first line: export it again")
    return count, at + 1


def _of_length_1(quaternions: np.ndarray) -> np.ndarray:
    """The quaternions as VisualSFM takes them, of whatever length that is not 0."""
    lengths = np.sqrt((quaternions * quaternions).sum(axis=-1, keepdims=True))
    return quaternions / np.where(lengths > 0, lengths, 1)


def _plane(f: float, calibration: list[str], path: str, source: Source, options: Options) -> tuple[ViewPlane, bool]:
    """The view plane of a camera, and whether its size is the picture's."""
    file = naming.near(path, source.path.parent) if source.path else None
    size = image_size(file) if file else None
    what = f"the camera {checks.quoted(path)}"
    width, height = size or options.size_or_refuse(what)
    if f <= 0:
        raise InputError(f"{what} has the focal length {f:g}: give one above 0")
    if calibration[:1] != ["FixedK"]:
        return axes.view_plane(f, f, width / 2, height / 2, (width, height)), size is not None
    numbers = flat(f"FixedK of {source.name}", calibration[1:])
    if len(numbers) < 4 or numbers[0] <= 0 or numbers[2] <= 0:
        raise InputError(f"FixedK of {source.name} has no fx cx fy cy with focal lengths above 0: export it again")
    f_x, c_x, f_y, c_y = numbers[:4]
    return axes.view_plane(f, f * f_y / f_x, c_x, c_y, (width, height)), size is not None


def _others(source: Source, lines: list[tuple[int, str]], at: int) -> tuple[str, ...]:
    """The note on models behind the first, whose points begin at a line."""
    points = lines[at][1] if at < len(lines) else "0"
    at += 1 + int(points) if points.isdecimal() and len(points) < 10 else len(lines)
    behind = lines[at][1] if at < len(lines) else "0"
    if behind.isdecimal() and len(behind) < 10 and int(behind):
        return (f"{source.name} has more models, each in a world of its own: the first was read",)
    return ()
