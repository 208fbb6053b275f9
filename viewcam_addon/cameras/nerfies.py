"""Nerfies' and HyperNeRF's cameras (JSON), a file for each picture, in the data set's folder `camera` or of a path.

`orientation` takes the world to the camera's x right, y down, z into the view; `position` is the eye. `focal_length` counts in
pixels across, and times `pixel_aspect_ratio` upwards; `principal_point` from the picture's corner; `image_size` has the width
first. The lens is OpenCV's k1, k2, k3, p1 and p2.

Source: nerfies/camera.py (from_json, pixels_to_rays, get_pixel_centers).
"""

import numpy as np

from ..errors import InputError
from . import axes, opencv
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source, pixels

TITLE = "Nerfies and HyperNeRF"

_KEYS = {"orientation", "position", "focal_length", "principal_point", "image_size"}


def recognizes(source: Source) -> bool:
    return bool(_files(source))


def _files(source: Source) -> list[Source]:
    if not source.is_folder:
        return [source] if _is_ours(source) else []
    places = ([*source.files(pattern)] for pattern in ("camera/*.json", "*.json"))
    files = next((each for each in places if each and _is_ours(each[0])), [])
    return [file for file in files if _is_ours(file)]


def _is_ours(source: Source) -> bool:
    return source.document.keys() >= _KEYS


def read(source: Source, options: Options) -> list[Camera]:
    left_out, cameras = LeftOut(), []
    for file in _files(source):
        name = file.path.stem if file.path else "camera"
        with left_out.unless_pinhole(name):
            cameras.append(_camera(name, Record(file.document, name), options))
    return left_out.with_notes(cameras)


def _camera(name: str, values: Record, options: Options) -> Camera:
    width, height = (pixels(values.called("image_size"), side) for side in values.numbers("image_size", 2))
    f_x = values.number("focal_length")
    f_y = f_x * values.number("pixel_aspect_ratio", 1.0)
    if not min(f_x, f_y) > 0:
        raise InputError(f"{name} has the focal lengths {f_x:g} and {f_y:g}: give numbers above 0")
    if values.number("skew", 0.0):
        not_a_pinhole(name, "a camera with skew")
    c_x, c_y = values.numbers("principal_point", 2)
    plane = axes.view_plane(f_x, f_y, c_x, c_y, (width, height))
    numbers = dict.fromkeys(opencv.NAMES[:5], 0.0)
    tangential = "tangential_distortion" if "tangential_distortion" in values else "tangential"
    for key, terms in (("radial_distortion", ("k1", "k2", "k3")), (tangential, ("p1", "p2"))):
        if key in values:
            numbers |= dict(zip(terms, values.numbers(key, len(terms)), strict=True))
    lens, notes = opencv.settled(numbers, False, plane, name, options)
    turn = np.array(values.numbers("orientation", 9)).reshape(3, 3)
    matrix = np.column_stack([turn.T, values.numbers("position", 3)])
    pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, name)
    return Camera(name, pinhole, True, (*notes, *more), f"{name}.png", lens=lens)
