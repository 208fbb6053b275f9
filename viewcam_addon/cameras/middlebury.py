"""Middlebury's calibrations: the multi-view benchmark's par.txt, and calib.txt of its stereo pairs and ETH3D's.

    name k11 … k33 r11 … r33 t1 t2 t3                       the first line has the number of pictures; P = K [R | t]
    cam0=[f 0 cx; 0 f cy; 0 0 1]  cam1=…  baseline=…  width=…  height=…

World to camera, x right, y down, z into the view. Of a pair the second camera stands to the right of the first by the baseline,
which counts in millimeters, as Middlebury has it. Neither says from where it counts pixels: from the first one's center, as the
programs do by which such cameras are calibrated; a note says so.

Source: vision.middlebury.edu/mview/data and …/stereo/data/scenes2014.
"""

import re

import numpy as np

from ..errors import InputError
from . import axes, naming, opencv
from .camera import Camera, Options
from .source import Record, Source, flat, image_size, numbered_lines, table

TITLE = "Middlebury par.txt and calib.txt"

_WORDS = 22
_PAIR = re.compile(r"\s*cam0\s*=\s*\[")
_LINE = re.compile(r"^\s*(\w+)\s*=[ \t]*\[?([^\]\n]*)\]?[ \t]*$", re.MULTILINE)


def recognizes(source: Source) -> bool:
    if source.is_folder:
        return False
    if _PAIR.match(source.text[:200]):
        return True
    lines = source.text[:2000].lstrip().split("\n")
    return len(lines) > 1 and lines[0].strip().isdecimal() and len(lines[1].split()) == _WORDS


def read(source: Source, options: Options) -> list[Camera]:
    return _pair(source, options) if _PAIR.match(source.text[:200]) else _of_pictures(source, options)


def _of_pictures(source: Source, options: Options) -> list[Camera]:
    lines = numbered_lines(source)[1:]
    words = [line.split() for _, line in lines]
    if any(len(each) != _WORDS for each in words):
        number = next(number for (number, _), each in zip(lines, words, strict=True) if len(each) != _WORDS)
        raise InputError(f"line {number} of {source.name} is no name with 21 numbers, K, R and t: correct it")
    rows = table(source.name, [(number, line.split(maxsplit=1)[1]) for number, line in lines])
    paths = [each[0] for each in words]
    cameras = []
    for row, path, name in zip(rows, paths, naming.distinct(paths), strict=True):
        file = naming.near(path, source.path.parent) if source.path else None
        size = image_size(file) if file else None
        plane = opencv.plane_of_k(row[:9].tolist(), size or options.size_or_refuse(name), opencv.half_pixel(options), name)
        matrix = axes.from_world_to_camera(row[9:18].reshape(3, 3), row[18:].tolist(), name)
        pinhole, notes = axes.pinhole(matrix, plane, name)
        notes = (*opencv.told_of_half_pixel(options, "A calibration"), *notes)
        cameras.append(Camera(name, pinhole, size is not None, notes, path))
    return cameras


def _pair(source: Source, options: Options) -> list[Camera]:
    values = Record({match[1]: match[2].strip() for match in _LINE.finditer(source.text)}, source.name)
    stated = "width" in values and "height" in values
    size = (values.size("width"), values.size("height")) if stated else options.size_or_refuse(source.name)
    baseline = values.number("baseline", least=0.0) if "cam1" in values else 0.0
    cameras = []
    for key, place in (("cam0", 0.0), ("cam1", baseline)):
        if key in values:
            what = f"{key} of {source.name}"
            plane = opencv.plane_of_k(flat(what, values.text(key)), size, opencv.half_pixel(options), what)
            pinhole, _ = axes.pinhole(axes.from_world_to_camera(np.eye(3), (-place, 0.0, 0.0), what), plane, what)
            notes = opencv.told_of_half_pixel(options, "A calibration")
            cameras.append(Camera(key, pinhole, stated, notes, f"im{key[-1]}.png"))
    note = "cam0 stands at the origin and looks along z, y down; the baseline counts in millimeters"
    return [camera.noted(note) for camera in cameras]
