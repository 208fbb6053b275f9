"""Bundler's bundle.out: R, t and a focal length for each picture, which is named in a list.txt beside it.

World to camera, x right, y up, z away from the view; pixels count from the picture's middle, whose size no file says. A focal
length of 0 marks a picture that was not placed.

Source: Bundler's README.md.
"""

from collections.abc import Iterator

import numpy as np

from ..errors import InputError
from . import axes, distortion, naming
from .camera import Camera, Options
from .source import Source, flat, image_size

TITLE = "Bundler"


def recognises(source: Source) -> bool:
    return source.text[:200].lstrip().startswith("# Bundle file")


def read(source: Source, options: Options) -> list[Camera]:
    lines = _numbers(source)
    header = next(lines, ())
    if len(header) != 2 or not header[0].is_integer() or header[0] < 0:
        raise InputError(f"{source.name} does not begin with the number of its cameras and points: export it again")
    blocks = []
    for index in range(int(header[0])):
        block = [next(lines, ()) for _ in range(5)]
        if [len(line) for line in block] != [3] * 5:
            raise InputError(f"camera {index} of {source.name} is not f k1 k2, three rows of R and t: export it again")
        blocks.append(block)
    listed = source.file("list.txt")
    paths = [line.split()[0] for line in listed.text.split("\n") if line.split()] if listed else []
    paths = paths if len(paths) == len(blocks) else [f"camera {index}" for index in range(len(blocks))]
    cameras, lost = [], 0
    for block, path, name in zip(blocks, paths, naming.distinct(paths), strict=True):
        (f, k1, k2), *turn, translation = block
        if f == 0:
            lost += 1
            continue
        if f < 0:
            raise InputError(f"{name} of {source.name} has the focal length {f:g}: give one above 0")
        size = image_size(source.path.parent / path) if source.path else None
        width, height = size or options.size_or_refuse(name)
        plane = axes.view_plane(f, f, width / 2, height / 2, (width, height))
        lens = {"k1": k1, "k2": k2}
        notes = distortion.settle(lens, distortion.opencv(lens), plane, name, options)
        turn = np.array(turn)
        turn[1:] *= -1  # from its axes to OpenCV's
        matrix = axes.from_world_to_camera(turn, (translation[0], -translation[1], -translation[2]), name)
        pinhole, more = axes.pinhole(matrix, plane, name)
        image = path if naming.has_suffix(path) else None
        cameras.append(Camera(name, pinhole, size is not None, (*notes, *more), image))
    if lost and not cameras:
        raise InputError(f"none of the {lost} cameras of {source.name} was placed: let Bundler place them first")
    return [camera.noted(*((f"{lost} cameras that were not placed were left out",) if lost else ())) for camera in cameras]


def _numbers(source: Source) -> Iterator[tuple[float, ...]]:
    for number, line in enumerate(source.text.split("\n"), start=1):
        if line.strip() and not line.lstrip().startswith("#"):
            yield flat(f"line {number} of {source.name}", line)
