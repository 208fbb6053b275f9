"""A camera in Blender's own Python: its location and rotation, lens and render size, as scripts set them, the console prints
them and lists of them in JSON have them.

    cam.location = (7.36, -6.93, 4.96); cam.rotation_euler = (math.radians(63.6), 0, math.radians(46.7))
    cam.data.lens = 35; scene.render.resolution_x = 1920; scene.render.resolution_y = 1080
    bpy.ops.object.camera_add(location=(7.36, -6.93, 4.96), rotation=(1.109, 0, 0.815))
    >>> C.object.rotation_euler
    Euler((1.109, 0.0, 0.815), 'XYZ')

Angles are in radians, about x first in the order XYZ, which is Blender's unless rotation_mode or an Euler that the console
shows says another. What a text sets to different values, steps, computes from what it does not say, or leaves to a constraint
or a parent is refused. Of what it does not say of the lens, what Blender makes a new camera with counts where it makes one.

Source: Blender's Python API (bpy.types.Object, bpy.types.Camera, mathutils). Rejected: running it.
"""

import bisect
import functools
import itertools
import math
import re
from typing import Any

import numpy as np

from .. import checks, rotation
from ..errors import InputError
from ..intrinsics import CameraData, Frame, view_plane
from . import axes, texts
from .camera import Camera, Options, not_a_pinhole
from .expressions import Expressions, Unknown, numbers
from .source import Source

TITLE = "Blender's Python (location, rotation_euler …)"

_MOST_CHARACTERS, _MOST_STATEMENTS = 2**20, 2_000
_LONGEST_PATH = 300
_ROTATIONS = {"rotation_euler": 3, "rotation_quaternion": 4, "rotation_axis_angle": 4}
_POSE = {"location": 3, **_ROTATIONS}
_LENS = ("lens", "angle", "sensor_width", "sensor_height", "sensor_fit", "shift_x", "shift_y", "type", "rotation_mode")
_RENDER = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y")
_SET = re.compile(
    rf"(?<!\w)({'|'.join((*_POSE, *_LENS, *_RENDER))})"
    r"['\"]?(?:\.xyz\b|\[:\])?(?:\.([wxyz])|\[([^\]\n]{1,40})\])?[ \t]*([-+*/]?=(?!=)|:|\n)[ \t]*"
)
_ADDED = re.compile(r"\bcamera_add\s*(?=\()")
_MADE = re.compile(r"\bcameras\.new\s*\(|\bcamera_add\s*\(")
_NAMED = re.compile(r"^[ \t]*(?:>>> )?([A-Za-z_]\w{0,60})[ \t]*=(?!=)[ \t]*(.*)$", re.MULTILINE)
_OTHERWISE = re.compile(
    r"TRACK_TO|to_track_quat|DAMPED_TRACK|constraints\.new|\.parent\s*=(?!=)|delta_(?:location|rotation)"
    r"|(?i:\bcam\w*)\.scale\b[^\n]*-|\brotation_(?:euler|quaternion)\.rotate|\bops\.transform\.\w"
)
_MATRIX = re.compile(r"\bmatrix_(?:world|basis|local)\s*=(?!=)")
_ANY_ADDED = re.compile(r"\b(\w+_add)\s*\(")
_ACTIVE = re.compile(r"(?:\bcontext|\bC)\.(?:active_)?object\b")
_NO_CAMERA = re.compile(r"target|empty|light|lamp|focus", re.IGNORECASE)
_IN_USE = re.compile(r"\.camera\s*=(?!=)\s*([A-Za-z_]\w{0,60})")
_MADE_OF = re.compile(r"\bobjects\.new\s*\([^()\n]{0,100},\s*(?:object_data\s*=\s*)?([A-Za-z_]\w{0,60})\s*\)")
_VALUE = re.compile(r"(?:mathutils\s*\.\s*)?(?:Euler|Quaternion)\s*(?=\()")
_PRINTED = re.compile(r"<(Vector|Euler|Quaternion) \(([^()\n]{0,200})\)(?:, order=('[XYZ]{3}'))?>")
_SHOWN = re.compile(r"rotation_euler['\"]?[ \t]*[:\n]\s*(?:mathutils\.)?Euler\(\([^()]{0,200}\), '(\w{0,20})'\)")
_COMMENT = r"#[^\n]*"
_BEGINNING = re.compile(r"(?:\A|\n|;[ \t]{0,8})\Z")
_COMMA, _END = re.compile(r"(?<![ \t])[ \t]*,[ \t]*(?=[-+.\w(])"), re.compile(r"(?<![ \t])[ \t]*(?:[\n;,}\])]|\Z)")


def recognizes(source: Source) -> bool:
    if source.is_binary or source.is_folder or len(source.text) > _MOST_CHARACTERS:
        return False
    if not any(name in source.text for name in (*_ROTATIONS, "camera_add")) or _MATRIX.search(source.text):
        return False
    script = _script(source.text)
    return "location" in script.set_at and any(name in script.set_at for name in _ROTATIONS)


def read(source: Source, options: Options) -> list[Camera]:
    script = _script(source.text)
    for place, advice in script.problems:
        texts.fail(script.text, place, advice)
    key, order, notes = script.turned()
    turn = script.vector(key)
    if key == "rotation_euler":
        matrix = rotation.from_euler(turn, order)
    elif key == "rotation_quaternion":
        matrix = rotation.from_quaternion(turn)
    else:
        matrix = texts.turn(math.degrees(turn[0]), [part / (math.hypot(*turn[1:]) or 1) for part in turn[1:]])
    plane, stated, more = script.plane(options)
    pinhole, of_pose = axes.pinhole(np.column_stack([matrix, script.vector("location")]), plane, "the text's camera")
    return [Camera("Camera", pinhole, stated, (*notes, *more, *of_pose))]


@functools.lru_cache(maxsize=1)
def _script(text: str) -> "_Script":
    """The script, of which what is recognized is then read."""
    return _Script(text)


def _written(match: re.Match) -> str:
    """A vector that is printed, as it is written."""
    numbers = re.sub(r"[wxyz]=", "", match[2])
    return f"{match[1]}(({numbers}){f', {match[3]}' if match[3] else ''})"


class _Script:
    """The statements of a text.

    set_at : key → the coordinate, or None for all, and the place of each value that it gets.
    problems : the places that make it another camera than is read, each with what to do.
    """

    def __init__(self, text: str) -> None:
        self.text = texts.without(_COMMENT, _PRINTED.sub(_written, text))
        self.set_at: dict[str, list[tuple[int | None, int]]] = {}
        self._named: dict[str, list[re.Match]] = {}
        for match in _NAMED.finditer(self.text):
            self._named.setdefault(match[1], []).append(match)
        self.problems = [
            (match.start(), "this moves the camera by other means, write its matrix_world")
            for match in _OTHERWISE.finditer(self.text)
        ]
        self._following: set[str] = set()
        self._reader = Expressions(self.text, self._number)
        self._whose: dict[str, str] = {}
        # The scene's camera, its data, and what is made of a camera's: objects.new("…", data).
        data_of = {
            name: {data for each in stated for data in _MADE_OF.findall(each[2])} for name, stated in self._named.items()
        }
        data_of_cameras = {name for name, stated in self._named.items() if any("cameras.new" in each[2] for each in stated)}
        in_use = {*_IN_USE.findall(self.text)}
        self._of_cameras = in_use.union(*(data_of.get(name, ()) for name in in_use))
        self._of_cameras |= {name for name, data in data_of.items() if data & data_of_cameras}
        self._added = [(match.start(), match[1]) for match in _ANY_ADDED.finditer(self.text)]
        statements = [*itertools.islice(_SET.finditer(self.text), _MOST_STATEMENTS)]
        if len(statements) == _MOST_STATEMENTS:
            self.problems.append((statements[-1].start(), "the text says too many things of cameras, copy one camera"))
        bare = []
        for match in statements:
            path = self._path(match)
            if path is None and match[4] == "=" and _BEGINNING.search(self.text, max(0, match.start() - 9), match.start()):
                bare.append(match)
            if match[1] in _RENDER or (path is not None and self._is_camera(path, match.start())):
                self._take(match, path or "")
        for match in itertools.islice(_ADDED.finditer(self.text), _MOST_STATEMENTS):
            _, named, _ = self._reader.arguments(match.end())
            for name, key in (("location", "location"), ("rotation", "rotation_euler")):
                if name in named and (at := re.compile(rf"\b{name}\s*=\s*").search(self.text, match.end())):
                    self.set_at.setdefault(key, []).insert(0, (None, at.end()))
        for match in bare if "location" not in self.set_at else ():  # else these are names of what a camera is then set to
            self._take(match, "")

    def _path(self, match: re.Match) -> str | None:
        """The text before a key, whose attribute it is; None where it is no statement."""
        first = max(0, match.start() - _LONGEST_PATH)
        start = max(first, *(self.text.rfind(sign, first, match.start()) + 1 for sign in "\n;{"))
        before = self.text[start : match.start()].strip()
        is_printed = before.startswith(">>>")
        if match[4] == "\n" and not is_printed:
            return None
        if match[4] == ":":  # JSON, or a dictionary
            return "" if before[-1:] in ("'", '"', "") else None
        return before.removeprefix(">>>").strip() if before.endswith(".") else None

    def _is_camera(self, path: str, at: int) -> bool:
        """True if a path is a camera's or its data's, by its words or by what its first name was set to."""
        if _NO_CAMERA.search(path):
            return False
        if not path or "cam" in path.lower():
            return True
        root = re.match(r"\w+", path)
        stated = self._named.get(root[0], []) if root else []
        last = bisect.bisect(stated, at, key=re.Match.start) - 1
        if root and root[0] in self._of_cameras:
            return True
        if last >= 0 and "cam" in stated[last][2].lower():
            return True
        place = stated[last].start(2) if last >= 0 else at
        if not _ACTIVE.search(stated[last][2] if last >= 0 else path):
            return False
        before = bisect.bisect(self._added, place, key=lambda added: added[0])
        return not before or self._added[before - 1][1] == "camera_add"

    def _take(self, match: re.Match, path: str) -> None:
        key, coordinate = match[1], match[2] or match[3]
        if coordinate and coordinate not in "wxyz" and not re.fullmatch("[0-3]", coordinate):
            self.problems.append((match.start(), "this is one coordinate of many, write the whole of it in plain numbers"))
            return
        if match[4] not in ("=", ":", "\n"):
            self.problems.append((match.start(), "this moves the camera from where it was, write where it is then"))
        elif key in _POSE and self._whose.setdefault(key, path) != path:
            self.problems.append((match.start(), "this is another camera, copy one"))
        names = "wxyz" if _POSE.get(key) == 4 else "xyz"
        which = None if coordinate is None else int(coordinate) if coordinate.isdigit() else names.index(coordinate)
        self.set_at.setdefault(key, []).append((which, match.end()))

    def _number(self, path: str) -> object:
        """The value of a name: the one that it is given."""
        stated = self._named.get(path, [])
        if len(stated) != 1 or path in self._following or len(self._following) > 8:
            return None
        self._following.add(path)
        value = self._value(stated[0].start(2), listed=True)
        self._following.discard(path)
        return value

    def _value(self, at: int, listed: bool = False) -> object:
        """The value at a place, an `Unknown` where something more is done with it.

        listed : true if numbers with commas between them are one value.
        """
        constructor = _VALUE.match(self.text, at)
        if constructor:
            values, _, end = self._reader.arguments(constructor.end())
            value = values[0] if values else None
        else:
            value, end = self._reader.value(at)
            parts = [value]
            while listed and isinstance(value, float) and (comma := _COMMA.match(self.text, end)):
                part, end = self._reader.value(comma.end())
                parts.append(part)
            value = tuple(parts) if len(parts) > 1 else value
        return value if _END.match(self.text, end) else Unknown(at)

    def vector(self, key: str) -> tuple[float, ...]:
        count = _POSE[key]
        result: list[float | None] = [None] * count
        for which, at in self.set_at[key]:
            value = self._value(at, listed=which is None)
            parts = numbers(value, count) if which is None else numbers((value,), 1)
            if parts is None or (which or 0) >= count or not all(map(math.isfinite, parts)):
                texts.fail(self.text, at, f"give {key} in plain numbers")
            before = result if which is None else [result[which]]
            if which is None and None not in before and [*parts] != before:
                texts.fail(self.text, at, f"{key} is something else before, copy one camera")
            if which is None:
                result = [*parts]
            else:
                result[which] = parts[0]
        known = [number for number in result if number is not None]
        if len(known) < count:
            texts.fail(self.text, self.set_at[key][0][1], f"give all numbers of {key}")
        return tuple(known)

    def _single(self, key: str, kind: Any, usual: Any) -> Any:
        """The one value of a key, a number or a text; the usual one where it is not said."""
        result: Any = None
        for _, at in self.set_at.get(key, ()):
            value: Any = self._value(at)
            if not isinstance(value, kind):
                texts.fail(self.text, at, f"give {key} as a plain {'number' if kind is float else 'text'}")
            if result not in (None, value):
                texts.fail(self.text, at, f"{key} is something else before, copy one camera")
            result = float(value) if kind is float else value  # angles that say their unit, too
        return usual if result is None else result

    def turned(self) -> tuple[str, str, tuple[str, ...]]:
        """The key of the rotation that counts, the order of Euler angles, and notes."""
        mode = self._single("rotation_mode", str, "")
        if not mode and (of_console := _SHOWN.search(self.text)):  # an Euler that is set passes on its numbers alone
            mode = of_console[1]
        stated = [key for key in _ROTATIONS if key in self.set_at]
        by_angles = mode not in ("QUATERNION", "AXIS_ANGLE")
        if by_angles and sorted(mode or "XYZ") != [*"XYZ"]:
            raise InputError(
                f"the text's camera has the rotation_mode {checks.quoted(mode)}: give XYZ or another that Blender has"
            )
        key = f"rotation_{mode.lower()}" if not by_angles else "rotation_euler" if mode else stated[0]
        if key not in self.set_at:
            raise InputError(f"the text's camera turns by its {key}, which the text does not say: write it")
        others = ", ".join(each for each in stated if each != key)
        notes: tuple[str, ...] = (f"The camera turns by its {key}: {others} was left out",) if others else ()
        if key == "rotation_euler" and max(map(abs, self.vector(key))) > 2 * math.pi:
            notes += ("Its angles are radians, as Blender takes them, and more than a whole turn: are they degrees?",)
        if key == "rotation_euler" and not mode:
            notes += ("The text does not say in which order its camera turns: in Blender's own, XYZ",)
        return key, mode or "XYZ", notes

    def plane(self, options: Options) -> tuple[Any, bool, tuple[str, ...]]:
        """The view plane, whether its size is stated, and notes."""
        if (kind := self._single("type", str, "")) in ("ORTHO", "PANO", "CUSTOM"):
            not_a_pinhole("the text's camera", f"of the type {kind}")
        says_lens = {"lens", "angle"} & self.set_at.keys()
        if not says_lens and not _MADE.search(self.text):
            return options.plane_or_refuse("the text"), False, ()
        notes = () if says_lens else ("The text says no lens: it is a new camera's, 50 mm",)
        stated = {"resolution_x", "resolution_y"} <= self.set_at.keys()
        width, height = (
            [int(self._single(key, float, 0)) for key in ("resolution_x", "resolution_y")]
            if stated
            else options.size_or_refuse("the text")
        )
        aspect = self._single("pixel_aspect_x", float, 1.0), self._single("pixel_aspect_y", float, 1.0)
        if not {"pixel_aspect_x", "pixel_aspect_y"} & self.set_at.keys():
            aspect = (options.pixel_aspect, 1.0)
        percentage = int(self._single("resolution_percentage", float, 100.0)) if stated else 100
        sides = self._single("sensor_width", float, 36.0), self._single("sensor_height", float, 24.0)
        fit = self._single("sensor_fit", str, "AUTO")
        lens = self._single("lens", float, 50.0)
        if "angle" in self.set_at:
            if "lens" in self.set_at:
                raise InputError("the text's camera has both a lens and an angle: leave one of them out")
            angle = self._single("angle", float, 0.0)
            if not 0 < angle < math.pi:
                raise InputError(f"the angle of the text's camera is {angle:g}: give radians between 0 and π")
            lens = sides[fit == "VERTICAL"] / 2 / math.tan(angle / 2)
        shift = self._single("shift_x", float, 0.0), self._single("shift_y", float, 0.0)
        plane = view_plane(CameraData(lens, *sides, fit, *shift), Frame(width, height, percentage, *aspect))
        return plane, stated, notes
