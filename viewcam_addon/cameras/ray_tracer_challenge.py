"""The camera of a scene of The Ray Tracer Challenge: `- add: camera` in YAML.

    - add: camera
      width: 640
      height: 360
      field-of-view: 0.785          radians, of the longer side
      from: [7, -6, 4]
      to: [0, 0, 1]
      up: [0, 0, 1]

The first pixel's ray goes towards positive x where the camera looks along −z with y up: seen from a right-handed world its
picture is mirrored.

Source: Buck, The Ray Tracer Challenge, chapter 7: its tests of view_transform and ray_for_pixel.
"""

import math
import re

from ..errors import InputError
from ..pinhole import Triple
from . import texts, yaml
from .camera import Camera, Options
from .source import Record, Source

TITLE = "camera of The Ray Tracer Challenge (YAML)"

_CAMERA = re.compile(r"^([ \t]*)-[ \t]+add:[ \t]*camera\b[^\n]*\n", re.MULTILINE)


def recognizes(source: Source) -> bool:
    return not source.is_binary and bool(_CAMERA.search(source.text + "\n"))


def read(source: Source, options: Options) -> list[Camera]:
    text = source.text + "\n"
    matches = list(_CAMERA.finditer(text))
    if len(matches) > 1:
        raise InputError(f"{source.name} adds {len(matches)} cameras: keep one of them")
    lines = []
    for line in text[matches[0].end() :].split("\n"):
        if line.strip() and len(line) - len(line.lstrip()) <= len(matches[0][1]):
            break
        lines.append(line)
    values = Record(yaml.read("\n".join(lines))[0], "the camera")
    size = values.size("width"), values.size("height")
    eye, look_at, up = (_vector(values, key) for key in ("from", "to", "up"))
    angle = values.number("field-of-view")
    if not 0 < angle < math.pi:
        raise InputError(f"field-of-view of the camera is {angle:g}: give radians between 0 and π")
    film = texts.film(options, "the camera", size)
    pinhole = texts.posed(eye, look_at, up, film.plane(angle, "larger"), mirrored=True)
    return [texts.mirroring(Camera("Camera", pinhole), "The Ray Tracer Challenge")]


def _vector(values: Record, key: str) -> Triple:
    x, y, z = values.numbers(key, 3)
    return x, y, z
