"""RealEstate10K's and ACID's cameras: a video's address, if it is there, and a line of nineteen numbers for each picture.

    microseconds fx fy cx cy 0 0 and then 3 × 4, row by row, world to camera: x right, y down, z into the view

Focal lengths and the principal point are parts of the picture's width and height, whose pixels the file does not say. The two
zeros have no published meaning; where they are none, the file is refused.

Source: the data set's page, google.github.io/realestate10k/download.html.
"""

import numpy as np

from ..errors import InputError
from . import axes
from .camera import Camera, Options
from .source import Source, numbered_lines, table

TITLE = "RealEstate10K and ACID"

_COLUMNS = 19


def recognizes(source: Source) -> bool:
    if source.is_folder or source.is_binary:
        return False
    lines = [line.split() for line in source.text[:4000].split("\n") if line.strip()][:2]
    return len(lines) == 2 and (len(lines[0]) == 1 or _is_pose(lines[0])) and _is_pose(lines[1])


def _is_pose(words: list[str]) -> bool:
    try:
        return len([*map(float, words)]) == _COLUMNS
    except ValueError:
        return False


def read(source: Source, options: Options) -> list[Camera]:
    rows = table(source.name, [(number, line) for number, line in numbered_lines(source) if len(line.split()) > 1])
    if rows.shape[1] != _COLUMNS:
        raise InputError(f"{source.name} has {rows.shape[1]} numbers in a line: a camera of RealEstate10K has {_COLUMNS}")
    if rows[:, 5:7].any():
        raise InputError(
            f"{source.name} has numbers that are not 0 behind its principal points: what they mean is not published"
        )
    width, height = size = options.size_or_refuse(source.name)
    names = [f"{time:.0f}" for time in rows[:, 0]]
    whats = [f"the camera at {name} µs" for name in names]
    for what, (f_x, f_y) in zip(whats, rows[:, 1:3].tolist(), strict=True):
        if not min(f_x, f_y) > 0:
            raise InputError(f"{what} has the focal lengths {f_x:g} and {f_y:g}: give numbers above 0")
    planes = [
        axes.view_plane(f_x * width, f_y * height, c_x * width, c_y * height, size)
        for f_x, f_y, c_x, c_y in rows[:, 1:5].tolist()
    ]
    poses = rows[:, 7:].reshape(-1, 3, 4)
    matrices = axes.from_worlds_to_cameras(poses[:, :, :3], poses[:, :, 3], whats)
    placed = axes.pinholes(matrices, planes, whats)
    times = (rows[:, 0] / np.float64(1e6)).tolist()
    return [
        Camera(name, pinhole, False, notes, time=time)
        for name, (pinhole, notes), time in zip(names, placed, times, strict=True)
    ]
