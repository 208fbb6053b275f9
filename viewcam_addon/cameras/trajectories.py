"""Trajectories as evo and the benchmarks have them: TUM, KITTI, EuRoC, Replica, Redwood. Poses alone; how it sees is given.

    TUM     t tx ty tz qx qy qz qw      seconds, or nanoseconds as ORB-SLAM3 writes; camera to world
    KITTI   twelve numbers              3 × 4, row by row, camera to the world of the first one
    Replica sixteen numbers             4 × 4, the same with the row 0 0 0 1; seventeen in KITTI-360's, a frame first
    Redwood three numbers, then 4 × 4   five lines a pose: the .log of Open3D and of Tanks and Temples
    EuRoC   ns, p, q w x y z, …         of the body; a cam0/sensor.yaml of the data set says how the camera stands on it

Camera axes are x right, y down, z into the view. TUM's and KITTI's files do not say whether the poses are the camera's or a
body's; the first is their convention, and a note says that it was taken. Each pose becomes a camera with its time, so that
they make one animation.

Sources: the data sets' own pages, redwood-data.org/indoor/fileformat.html, Open3D's io/file_format/FileLOG.cpp, and evo's
file_interface.py for the order of numbers.
"""

import math
import re

import numpy as np

from ..errors import InputError
from ..pinhole import ViewPlane
from . import axes, opencv
from .camera import Camera, Options
from .distortion import Lens
from .source import Record, Source, numbered_lines, table

TITLE = "trajectories of TUM, KITTI, EuRoC, Replica and Redwood (.log)"

_MOST = 1_000_000
_WHOSE = "The file does not say whose poses it has: taken as the camera's, to the world, x right, y down, z into the view"
_W_FIRST = re.compile(r"^(?:#|\s*t).*\bq_?w\b.*\bq_?x\b", re.MULTILINE)
_HEAD = re.compile(r"\s*t(?:ime)?(?:_?stamp)?\w{0,8}(?:[\s,;]+(?:[tp]_?)?[xyz]){3}(?:[\s,;]+q_?[xyzw]){4}\s*")  # without #
_NANOSECONDS = 1e15  # as seconds these are 30 million years
_STEPS = {"KITTI": 0.1, "KITTI-360": 0.1, "Replica": 1 / 30, "Redwood": 1 / 30}  # seconds; pictures at 10 and 30 Hz
_PINNED = [0.0, 0.0, 0.0, 1.0]
_UNIT = 1e-3  # the error that the length of a quaternion of few digits may have


def recognizes(source: Source) -> bool:
    return _kind(source) is not None


def read(source: Source, options: Options) -> list[Camera]:
    kind = _kind(source)
    if kind == "chan":
        raise InputError(
            f"{source.name} is Nuke's chan, with angles whose order it does not say: import it with Blender's Nuke Animation "
            "Format, or export cameras in another format"
        )
    if kind == "bare":
        raise InputError(
            f"{source.name} has places and quaternions whose axes and times it does not say: write t tx ty tz qx qy qz qw in "
            "each line, as TUM's, camera to world, x right, y down, z into the view"
        )
    lines = [(number, line) for number, line in numbered_lines(source) if not _HEAD.fullmatch(line)]
    if kind == "Redwood":
        lines = [(number, " ".join(line for _, line in lines[at : at + 4])) for at, (number, _) in enumerate(lines)][1::5]
    rows = table(source.name, lines)
    if rows.shape[1] < 8:
        raise InputError(f"{source.name} has {rows.shape[1]} numbers in a line: a pose has at least 8")
    if len(rows) > _MOST:
        raise InputError(f"{source.name} has {len(rows)} poses: give at most {_MOST}")
    own = (np.eye(4), None, None, (_WHOSE,)) if kind != "EuRoC" else _sensor(source, options)
    mounted, plane, lens, notes = own
    plane = options.view_plane or plane or options.plane_or_refuse(source.name)
    stated = kind == "EuRoC" and options.view_plane is None
    whats = [f"pose {index}" for index in range(len(rows))]
    matrices = np.tile(np.eye(4), (len(rows), 1, 1))
    if kind in _STEPS:
        frames, rows = np.hsplit(rows, [1]) if kind == "KITTI-360" else (np.arange(len(rows)), rows)
        times = frames.ravel() * _STEPS[kind]
        for index in np.flatnonzero((rows[:, 12:] != _PINNED[: rows.shape[1] - 12]).any(axis=1)).tolist():
            axes.upper_rows(rows[index].reshape(4, 4), whats[index])
        matrices[:, :3] = rows[:, :12].reshape(-1, 3, 4)
    else:
        times = rows[:, 0] * (1 if kind == "TUM" and rows[0, 0] < _NANOSECONDS else 1e-9)
        w_stands_last = kind == "TUM" and not _W_FIRST.search(source.text[:2000])
        quaternions = rows[:, [7, 4, 5, 6] if w_stands_last else [4, 5, 6, 7]]  # w x y z
        matrices[:, :3, :3], matrices[:, :3, 3] = axes.rotations_of(quaternions, whats), rows[:, 1:4]
    placed = axes.pinholes(axes.of_opencv(matrices @ mounted)[:, :3], [plane] * len(rows), whats)
    digits = max(4, len(str(len(rows) - 1)))
    return [
        Camera(f"pose_{index:0{digits}d}", pinhole, stated, (*notes, *more), time=time, lens=lens)
        for index, ((pinhole, more), time) in enumerate(zip(placed, times.tolist(), strict=True))
    ]


def _kind(source: Source) -> str | None:
    """The kind of trajectory, by its first lines that are none of comments; "chan" if it is Nuke's, which looks alike."""
    if source.is_folder or source.is_binary or source.text[:1] in "{[<%":
        return None
    if re.match(r"\s*#\s*timestamp.*p_(?:RS_)?R_?", source.text[:400]):
        return "EuRoC"
    counts: set[tuple[int, bool]] = set()
    rows: list[list[float]] = []
    for line in source.text[:20000].split("\n")[:-1][:20] or [source.text[:20000]]:
        if line.strip() and not line.lstrip().startswith("#") and not _HEAD.fullmatch(line):
            words = re.split(r"[\s,]+", line.strip())
            if not all(re.fullmatch(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", word) for word in words):
                return None
            counts.add((len(words), "," in line))
            rows.append([*map(float, words)])
    has_head = _HEAD.match(source.text[:200]) is not None
    if counts <= {(7, False), (8, False)} and rows and (_is_named_chan(source) or all(map(_is_of_chan, rows))):
        return "chan"
    if [len(row) for row in rows[:5]] == [3, 4, 4, 4, 4]:
        return "Redwood" if rows[4] == _PINNED else None
    if counts == {(16, False)}:
        return "Replica" if all(row[12:] == _PINNED for row in rows) else None
    if counts == {(17, False)}:
        return "KITTI-360" if all(row[0].is_integer() and row[13:] == _PINNED for row in rows) else None
    if counts <= {(7, False), (7, True)} and rows:
        return "bare" if all(abs(math.hypot(*row[3:]) - 1) < _UNIT for row in rows) else None
    kinds = {(8, False): "TUM", (8, has_head): "TUM", (12, False): "KITTI"}
    return kinds.get(counts.pop()) if len(counts) == 1 else None


def _is_named_chan(source: Source) -> bool:
    return source.path is not None and source.path.suffix.lower() == ".chan"


def _is_of_chan(row: list[float]) -> bool:
    """True if it is a frame, a position, three angles and the field of view in degrees, where a pose has a quaternion."""
    return len(row) == 8 and row[0].is_integer() and math.hypot(*row[4:]) > 1.1 and 1.1 < row[7] < 180


def _sensor(source: Source, options: Options) -> tuple[np.ndarray, ViewPlane | None, Lens | None, tuple[str, ...]]:
    """The pose of EuRoC's cam0 on the body, and how it sees."""
    file = next((path for up in ("..", "../..") if (path := source.file(*up.split("/"), "cam0", "sensor.yaml"))), None)
    if file is None:
        raise InputError(
            f"{source.name} has poses of the body, not of a camera: put it where ../cam0/sensor.yaml of the data set is found"
        )
    values = Record(file.yaml, str(file.path))
    beside = source.file("sensor.yaml")
    own = Record(beside.yaml, str(beside.path)) if beside else None
    is_fisheye = opencv.says_fisheye(values.values, "cam0")
    mounted = np.array(values.record("T_BS").numbers("data", 16)).reshape(4, 4)
    axes.upper_rows(mounted, str(file.path))
    if own and "T_BS" in own:  # where what was tracked, as a Vicon marker, stands on the body
        tracked = np.array(own.record("T_BS").numbers("data", 16)).reshape(4, 4)
        turn, at = np.hsplit(np.array(axes.upper_rows(tracked, own.place)), [3])
        back = np.eye(4)
        back[:3] = np.hstack([turn.T, -turn.T @ at])
        mounted = back @ mounted
    if options.view_plane or "intrinsics" not in values:
        return mounted, None, None, ()
    f_x, f_y, c_x, c_y = values.numbers("intrinsics", 4)
    width, height = (int(side) for side in values.numbers("resolution", 2))
    half = opencv.half_pixel(options)
    plane = axes.view_plane(f_x, f_y, c_x + half, c_y + half, (width, height))
    numbers = values.numbers("distortion_coefficients", 4) if "distortion_coefficients" in values else ()
    lens, notes = opencv.settled(numbers, is_fisheye, plane, "cam0", options)
    return mounted, plane, lens, (*notes, *opencv.told_of_half_pixel(options, "EuRoC"))
