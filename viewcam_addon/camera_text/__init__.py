"""A camera as text: what one copies out of Blender, and the spellings in which other programs and people write a camera down.

`written` gives one line of JSON with the keys of a scene file. `read` understands that, a scene file or its camera, and

    eye=(7, -6, 4) look_at=0,0,1 up=[0 0 1] d=1200        in any order, spelling and punctuation; also a Python dict
    LookAt 7 -6 4  0 0 1  0 0 1    Camera "perspective" "float fov" 40                                      pbrt
    <lookat origin="7, -6, 4" target="0, 0, 1" up="0, 0, 1"/> <float name="fov" value="40"/>                Mitsuba 3
    look_at(origin=[7, -6, 4], target=[0, 0, 1], up=[0, 0, 1])                                              Mitsuba 3
    camera { location <7, 4, -6> look_at <0, 1, 0> sky <0, 1, 0> angle 40 }                                 POV-Ray

**What is converted.** A field of view becomes a distance once the picture's size is known (`CameraText.distance_in`). Points
and directions are those of the scene and stay as they are, y up or z up, for whoever brings the scene along brings it with the
same numbers. pbrt and POV-Ray see left-handed: the very same numbers give the mirror image there, unless they undo it
(`Scale -1 1 1` before LookAt; a `right` towards −x), and a note says so. Rejected: exchanging y and z, which suits one scene
and breaks the next, and a mirrored camera, which the four values can't state.

Sources: pbrt-v4's src/pbrt/util/transform.cpp (LookAt: right = up × direction) and file format (fov of the shorter side, 90°
where none is given); Mitsuba 3's src/render/sensor.cpp (parse_fov: fov_axis is x unless given; a focal length counts on the
diagonal of 36 × 24 mm); POV-Ray 3.7's reference (camera: angle is the horizontal one, the look-at turns the camera by `sky`,
which is y unless given, while `up` and `right` say the picture's format and handedness).

Rejected: a whole parser of each format, for the sake of one of its statements.
"""

import json
import math
from dataclasses import dataclass

from .. import checks
from ..errors import InputError
from ..intrinsics import Frame
from . import mitsuba, parsing, pbrt, pov_ray, scene_json
from .parsing import VECTORS, Values, Vector

_MOST_CHARACTERS = 10_000_000
_DIAGONAL_OF_FILM = math.hypot(36, 24)  # mm

# What a text must hold to be of a format, and who reads it from there; the first that fits counts.
_READERS = (
    (scene_json.PATTERN, scene_json.read),
    (mitsuba.XML, mitsuba.read_xml),
    (mitsuba.PYTHON, mitsuba.read_python),
    (pov_ray.PATTERN, pov_ray.read),
    (pbrt.PATTERN, pbrt.read),
)


@dataclass(frozen=True)
class CameraText:
    """What a text says of a camera; None for what it does not.

    eye, look_at, up : three floats, coordinates of the scene. distance : pixels, of a picture `width` pixels wide where the
    text tells its width, else of whatever picture. field_of_view : (radians, one of parsing.AXES), where there is no distance.
    notes : sentences on what was in the text and could not come along.
    """

    eye: Vector | None = None
    look_at: Vector | None = None
    up: Vector | None = None
    distance: float | None = None
    width: float | None = None
    field_of_view: tuple[float, str] | None = None
    notes: tuple[str, ...] = ()

    def distance_in(self, frame: Frame) -> float | None:
        """The view-plane distance in pixels of the frame's whole picture at 100 %, or None where the text says none."""
        if self.field_of_view is None:
            scale = frame.resolution_x / self.width if self.width else 1.0
            return None if self.distance is None else self.distance * scale
        angle, axis = self.field_of_view
        aspect = frame.pixel_aspect_x / frame.pixel_aspect_y
        width, height = frame.resolution_x * aspect, float(frame.resolution_y)
        side = {
            "x": width,
            "y": height,
            "diagonal": math.hypot(width, height),
            "smaller": min(width, height),
            "larger": max(width, height),
        }[axis]
        return side / 2 / math.tan(angle / 2) / aspect


def written(eye: Vector, look_at: Vector, up: Vector, distance: float) -> str:
    """One line of JSON that `read` gives back bit for bit.

    Raises
    ------
    InputError
        if a number is not finite.
    """
    vectors = {name: checks.vector(name, given, 3) for name, given in zip(VECTORS, (eye, look_at, up), strict=True)}
    return json.dumps(vectors | {"distance": checks.number("distance", distance)})


def read(text: str) -> CameraText:
    """What a text says of a camera.

    Raises
    ------
    InputError
        if the text says nothing of a camera, or something that is not understood; it shows the place.
    """
    text = text.strip().replace("−", "-")
    if not text:
        raise InputError("there is no text: copy a camera first")
    if len(text) > _MOST_CHARACTERS:
        raise InputError(f"the text has {len(text)} characters: copy the camera alone")
    for pattern, reader in _READERS:
        found = pattern.search(text)
        values = reader(text, found.start()) if found else None
        if values is not None:
            return _camera(values)
    return _camera(parsing.pairs(text))


def _camera(values: Values) -> CameraText:
    """What a reader found, checked."""
    if not values.keys() & {*VECTORS, "distance", "fov", "fov_x", "fov_y", "focal_length"}:
        raise InputError("the text says neither eye, look-at, up nor distance of a camera: copy one, or write eye=1,2,3")
    axis = values.pop("axis", None)
    angles = [(values.pop(key), along) for key, along in (("fov", axis), ("fov_x", "x"), ("fov_y", "y")) if key in values]
    if "focal_length" in values:
        length = checks.number("the focal length", values.pop("focal_length"), 1e-3, 1e9)
        angles.append((math.degrees(2 * math.atan(_DIAGONAL_OF_FILM / 2 / length)), "diagonal"))
    if len(angles) + ("distance" in values) > 1:
        raise InputError("the text says the field of view or distance more than once: leave one of them out")
    for angle, along in angles:
        if along is None:
            raise InputError(f"a field of view of {angle:g}° may be meant across or upwards: add axis=x or axis=y")
        if not 0 < angle < 180:
            raise InputError(f"the field of view is {angle:g}°: give an angle between 0 and 180")
        values["field_of_view"] = (math.radians(angle), along)
    for name in VECTORS:
        if name in values:
            values[name] = checks.vector(name, values[name], 3)
    if "distance" in values and checks.number("distance", values["distance"]) <= 0:
        raise InputError(f"distance is {values['distance']:g} pixels: the view plane must lie before the eye, give d > 0")
    return CameraText(**values)
