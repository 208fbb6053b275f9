"""Bundler's bundle.out: R, t and a focal length for each picture, which is named in a list.txt beside it.

World to camera, x right, y up, z away from the view; pixels count from the picture's middle, whose size no file says. A focal
length of 0 marks a picture that was not placed.

Source: Bundler's README.md.
"""

import numpy as np

from ..errors import InputError, counted
from ..pinhole import ViewPlane
from . import axes, distortion, naming
from .camera import Camera, Options
from .source import Source, flat, image_size, numbered_lines, table

TITLE = "Bundler"

_OPENCV = np.array([1.0, -1.0, -1.0])


def recognizes(source: Source) -> bool:
    return source.text[:200].lstrip().startswith("# Bundle file")


def read(source: Source, options: Options) -> list[Camera]:
    lines = numbered_lines(source)
    header = flat(f"the beginning of {source.name}", lines[0][1]) if lines else ()
    if len(header) != 2 or not header[0].is_integer() or header[0] < 0:
        raise InputError(f"{source.name} does not begin with the number of its cameras and points: export it again")
    count = int(header[0])
    rows = table(source.name, lines[1 : 1 + 5 * count])
    if rows.shape != (5 * count, 3) and count:
        raise InputError(f"{source.name} has not {count} cameras of f k1 k2, three rows of R and t each: export it again")
    blocks = rows.reshape(-1, 5, 3)
    listed = source.file("list.txt")
    paths = [line.split()[0] for line in listed.text.split("\n") if line.split()] if listed else []
    paths = paths if len(paths) == len(blocks) else [f"camera_{index}" for index in range(len(blocks))]
    names = naming.distinct(paths)
    placed = [index for index, (f, _, _) in enumerate(blocks[:, 0].tolist()) if f]
    lenses = {index: _lens(blocks[index, 0].tolist(), source, paths[index], names[index], options) for index in placed}
    turns, translations = blocks[[*lenses], 1:4] * _OPENCV[:, None], blocks[[*lenses], 4] * _OPENCV
    matrices = axes.from_worlds_to_cameras(turns, translations, [names[index] for index in lenses])
    poses = axes.pinholes(matrices, [plane for plane, *_ in lenses.values()], [names[index] for index in lenses])
    cameras = [
        Camera(
            names[index], pinhole, stated, (*notes, *more), paths[index] if naming.has_suffix(paths[index]) else None, lens=lens
        )
        for (index, (_, stated, lens, notes)), (pinhole, more) in zip(lenses.items(), poses, strict=True)
    ]
    lost = len(blocks) - len(placed)
    if lost and not placed:
        raise InputError(f"none of {counted(lost, 'camera')} of {source.name} was placed: let Bundler place them first")
    lost_note = (f"{counted(lost, 'camera')} not placed: left out",) if lost else ()
    return [camera.noted(*lost_note) for camera in cameras]


def _lens(
    numbers: list[float], source: Source, path: str, name: str, options: Options
) -> tuple[ViewPlane, bool, distortion.Lens | None, tuple[str, ...]]:
    """The view plane, whether its size is the picture's, the lens, and notes. numbers : f, k1, k2."""
    f, k1, k2 = numbers
    if f < 0:
        raise InputError(f"{name} of {source.name} has the focal length {f:g}: give one above 0")
    size = image_size(source.path.parent / path) if source.path else None
    width, height = size or options.size_or_refuse(name)
    plane = axes.view_plane(f, f, width / 2, height / 2, (width, height))
    lens = distortion.opencv({"k1": k1, "k2": k2})
    return plane, size is not None, *distortion.settle(lens, plane, name, options.without_distortion)
