"""Mitsuba's sensors, in a scene's XML or as a dictionary of Python.

**Pose.** `to_world` takes the camera's axes to the world: x to the **left** of the picture, y upwards, z into the view. In XML
its transforms apply in the order in which they stand, in Python those of a product from the right.

**Picture.** `fov` in degrees along `fov_axis` (x unless given), or `focal_length` in millimeters on the diagonal of 36 × 24, 50
unless given; both count on the whole film, 768 × 576 unless given. `principal_point_offset_x` moves the picture's middle by
that part of the width **from** the principal point, so the sign is against what the name suggests. `crop_…` keep a part.

Only what stands inside a sensor counts: emitters have a `lookat`, too. Sources: Mitsuba 3's src/render/sensor.cpp (parse_fov),
src/sensors/perspective.cpp, include/mitsuba/core/transform.h (look_at, has_scale), src/core/python/xml.py.
"""

import itertools
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from .. import checks, terminal
from ..errors import InputError, counted
from . import axes, naming, own, texts, tokens
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .expressions import Expressions, Unknown, numbers
from .source import Source
from .texts import turn

TITLE = "Mitsuba scene"
SUFFIX = ".xml"

_SIZE = (768, 576)
_MOST = 4_000
_DIAGONAL_OF_FILM = math.hypot(36, 24)  # mm
_XML = re.compile(r"<\s*(?:sensor|scene|lookat|transform)\b", re.IGNORECASE)
_PYTHON = re.compile(r"(?:to_world|type)['\"]\s*:|\blook_at\s*\(|\bload_dict\s*\(")
_SENSOR = re.compile(
    r"['\"]type['\"]\s*:\s*['\"](perspective|thinlens|orthographic|radiancemeter|distant|irradiancemeter|batch)['\"]"
)
_DEFAULT = re.compile(r"\$([^\s,$]{1,100})")
_LOOK = re.compile(r"\blook_at\s*\(")
_FOV_AXES = ("x", "y", "diagonal", "smaller", "larger")
_HARMLESS = {
    *("nearclip", "farclip", "shutteropen", "shutterclose", "focusdistance", "type", "id", "film", "sampler", "toworld"),
    *("fov", "fovaxis", "focallength", "principalpointoffsetx", "principalpointoffsety", "medium", "srf", "samplecount"),
}
_SCALED = 1e-3  # squared lengths, as Mitsuba's has_scale


class _Sensor:
    """The values of a sensor, keys without capitals and underscores: `values` texts or numbers, `film` likewise, `to_world`."""

    def __init__(self, kind: str, name: str, values: Mapping, film: Mapping | None, pose: "np.ndarray | _Look | None") -> None:
        self.kind, self.name, self.values, self.film, self.pose = kind, name, values, film, pose


class _Look:
    """A look-at that is all of a transform: its numbers stay."""

    def __init__(self, eye: tuple, target: tuple, up: tuple, mirrored: bool = False) -> None:
        self.eye, self.target, self.up, self.mirrored = eye, target, up, mirrored

    def matrix(self) -> np.ndarray:
        pose = texts.posed(self.eye, self.target, self.up, axes.view_plane(1.0, 1.0, 0.5, 0.5, (1, 1)))
        u, v, w = pose.basis()
        result = np.eye(4)
        result[:3, 0], result[:3, 1], result[:3, 2], result[:3, 3] = u if self.mirrored else -u, v, -w, self.eye
        return result


def recognizes(source: Source) -> bool:
    text = source.text
    return bool(_XML.search(text) and source_xml(source) is not None) or bool(_PYTHON.search(text) and _is_python(text))


def _is_python(text: str) -> bool:
    return bool(_SENSOR.search(text) or re.search(r"\blook_at\s*\(\s*(?:origin|target|up)\b|['\"]to_world['\"]", text))


def source_xml(source: Source) -> ElementTree.Element | None:
    """The XML, also of a part of a scene: then its elements are those of a root of our own."""
    text = source.text.strip()
    if not text.startswith("<"):
        return None
    if source.xml is not None:
        return source.xml
    return Source(f"<fragment>{text.partition('?>')[2] if text.startswith('<?xml') else text}</fragment>").xml


def read(source: Source, options: Options) -> list[Camera]:
    root = source_xml(source) if source.text.lstrip().startswith("<") else None
    if source.text.lstrip().startswith("<") and root is None:
        raise InputError(f"{source.name} looks like XML and is none: copy whole elements")
    sensors = list(itertools.islice(_in_xml(root) if root is not None else _in_python(source.text), _MOST + 1))
    if len(sensors) > _MOST:
        raise InputError(f"{source.name} has more than {_MOST} sensors: copy those that are meant")
    if not sensors:
        raise InputError(f"{source.name} has no sensor, which is Mitsuba's word for a camera: copy the sensor")
    left_out, cameras = LeftOut(), []
    for sensor in sensors:
        with left_out.unless_pinhole(sensor.name):
            if sensor.kind != "perspective":
                not_a_pinhole(f"Mitsuba's sensor {sensor.name}", f"a {sensor.kind}")
            cameras.append(_camera(sensor, options))
    return left_out.with_notes(cameras)


def _camera(sensor: _Sensor, options: Options) -> Camera:
    values, what = sensor.values, f"Mitsuba's sensor {sensor.name}"
    notes = [f"{key} of {what} was not taken" for key in values if key not in _HARMLESS]
    film, crop = _film(sensor, options)
    says_lens = {"fov", "focallength"} & values.keys()
    if sensor.name == "fragment" and not says_lens and sensor.film is None:
        plane = options.plane_or_refuse(what)
    else:
        if len(says_lens) == 2:
            raise InputError(f"{what} has fov and focal_length, which Mitsuba refuses: take one out")
        if "fov" in values:
            axis = str(values.get("fovaxis", "x")).lower()
            if axis not in _FOV_AXES:
                raise InputError(f"fov_axis of {what} is {checks.quoted(axis)}: give one of {', '.join(_FOV_AXES)}")
            angle = math.radians(_number(values["fov"], f"fov of {what}"))
        else:
            stated = str(values.get("focallength", "50mm")).strip().removesuffix("mm")
            length = _number(stated, f"focal_length of {what}")
            if not 1e-6 < length < 1e6:
                raise InputError(f"focal_length of {what} is {length:g} mm: give a positive length")
            angle, axis = 2 * math.atan(_DIAGONAL_OF_FILM / 2 / length), "diagonal"
        plane = film.plane(angle, axis, f"fov of {what}")
        offsets = [_number(values.get(f"principalpointoffset{k}", 0.0), f"principal_point_offset_{k} of {what}") for k in "xy"]
        c_x, c_top = (side * (0.5 - part) for side, part in zip((film.width, film.height), offsets, strict=True))
        plane = axes.view_plane(*plane.distance, c_x, c_top, (film.width, film.height))
    pose = _Look((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)) if sensor.pose is None else sensor.pose
    if isinstance(pose, _Look):
        pinhole = texts.posed(pose.eye, pose.target, pose.up, plane, pose.mirrored)
    else:
        squares = np.array([pose[:3, :3] @ pose[:3, :3].T, pose[:3, :3].T @ pose[:3, :3]])
        if np.abs(np.diagonal(squares, axis1=1, axis2=2) - 1).max() > _SCALED:
            raise InputError(f"to_world of {what} scales, which Mitsuba refuses: take the scale out")
        to_camera = np.linalg.inv(pose[:3, :3])
        (d_x, d_y), c_top = plane.distance, plane.height - plane.principal_point[1]
        to_pixels = np.array([[-d_x, 0, plane.principal_point[0]], [0, -d_y, c_top], [0, 0, 1]]) @ to_camera
        pinhole, more = texts.projected(to_pixels, tuple(pose[:3, 3].tolist()), (plane.width, plane.height), what)
        notes += more
    if crop:
        x, y, width, height = crop
        pinhole = pinhole.cropped(x, film.height - y - height, width, height)
    return texts.mirroring(Camera(sensor.name, pinhole, film.is_stated, (*film.notes, *notes)), "Mitsuba's sensor")


def _film(sensor: _Sensor, options: Options) -> tuple[texts.Film, tuple[int, int, int, int] | None]:
    """The film, and x, y, width, height of the part that is kept, from the top left."""
    if sensor.film is None:
        return texts.film(options, "Mitsuba", default=_SIZE), None
    what = f"the film of {sensor.name}"
    width, height = (
        _whole(sensor.film.get(key, usual), f"{key} of {what}") for key, usual in zip(("width", "height"), _SIZE, strict=True)
    )
    size = width, height
    film = texts.film(options, "Mitsuba", size=size)
    keys = ("cropoffsetx", "cropoffsety", "cropwidth", "cropheight")
    if not any(key in sensor.film for key in keys):
        return film, None
    x, y = (_whole(sensor.film.get(key, 0), f"{key} of {what}", 0) for key in keys[:2])
    width, height = (_whole(sensor.film.get(key, side), f"{key} of {what}") for key, side in zip(keys[2:], size, strict=True))
    if x + width > size[0] or y + height > size[1]:
        raise InputError(f"the crop of {what} ends at {x + width}, {y + height}, outside of its {size[0]} × {size[1]} pixels")
    return film, (x, y, width, height)


def _number(value: object, name: str) -> float:
    if isinstance(value, str):
        try:
            value = float(value.strip())
        except ValueError:
            raise InputError(f"{name} is {checks.quoted(value)}: give a number") from None
    if isinstance(value, Unknown):
        raise InputError(f"{name} is computed from what the text does not say: write the number")
    return checks.number(name, value, -1e300, 1e300)


def _whole(value: object, name: str, least: int = 1) -> int:
    number = _number(value, name)
    if not number.is_integer() or not least <= number < 2**31:
        raise InputError(f"{name} is {number:g}: give whole pixels")
    return int(number)


# ---- XML


def _in_xml(root: ElementTree.Element) -> Iterator[_Sensor]:
    defaults = {e.get("name", ""): e.get("value", "") for e in root.iter("default")}
    by_id = {e.get("id"): e for e in root.iter() if e.get("id")}

    def replacement(match: re.Match) -> str:  # the longest name that is one: $fovx may be $fov and an x
        name = next((name for end in range(len(match[1]), 0, -1) if (name := match[1][:end]) in defaults), None)
        return match[0] if name is None else defaults[name] + match[1][len(name) :]

    def text(value: str) -> str:
        if "$" not in value:
            return value
        value = _DEFAULT.sub(replacement, value)
        if "$" in value:
            raise InputError(f"{checks.quoted(value)} stands for a value that the text does not say: write the value")
        return value

    # An emitter's or a texture's transform is nobody's camera.
    sensors = [e for e in _elements(root, "sensor") if e.get("type")]
    if not sensors and not any(e.tag.lower() in ("emitter", "shape", "bsdf", "texture", "scene") for e in root.iter()):
        looks = [e for e in root.iter() if e.tag.lower() == "lookat"]
        sensors = [root] if looks or any(e.tag.lower() == "transform" for e in root.iter()) else []
    for number, element in enumerate(sensors):
        name = text(element.get("id") or (f"sensor {number + 1}" if len(sensors) > 1 else "sensor"))
        is_fragment = element is root and element.tag.lower() != "sensor"
        yield _sensor(
            element,
            "fragment" if is_fragment else name,
            "perspective" if is_fragment else text(element.get("type", "")),
            text,
            by_id,
        )


def _elements(root: ElementTree.Element, tag: str) -> list[ElementTree.Element]:
    """The elements with the tag; in a sensor, as in a batch, only the outer one."""
    if root.tag.lower() == tag:
        return [root]
    return [element for child in root for element in _elements(child, tag)]


def _sensor(element: ElementTree.Element, name: str, kind: str, text: Callable[[str], str], by_id: Mapping) -> _Sensor:
    values: dict[str, object] = {}
    film, pose = None, None
    children = [by_id.get(text(child.get("id", "")), child) if child.tag.lower() == "ref" else child for child in element]
    if element.tag.lower() in ("lookat", "transform"):
        children = [element]
    for child in children:
        tag, key = child.tag.lower(), texts.plain(child.get("name", ""))
        if tag == "transform" or (tag == "lookat" and name == "fragment"):
            if pose is not None:
                raise InputError(f"Mitsuba's sensor {name} has two transforms: leave one of them")
            pose = _transform([child] if tag == "lookat" else list(child), name, text)
        elif tag == "film":
            film = {texts.plain(each.get("name", "")): _read(each, text) for each in child if each.get("value") is not None}
        elif tag == "animation":
            raise InputError(f"Mitsuba's sensor {name} moves while the shutter is open: give one transform")
        elif tag == "ref":
            raise InputError(
                f"Mitsuba's sensor {name} refers to {checks.quoted(child.get('id'))}, which is not there: copy it as well"
            )
        elif child.get("value") is not None and key:
            values[key] = _read(child, text)
    return _Sensor(kind, name, values, film, pose)


def _read(element: ElementTree.Element, text: Callable[[str], str]) -> str:
    """The value; as it stands, and refused only where the camera needs it, if the command line says it."""
    value = element.get("value", "")
    try:
        return text(value)
    except InputError:
        return value


def _transform(steps: Sequence[ElementTree.Element], name: str, text: Callable[[str], str]) -> "np.ndarray | _Look":
    matrices = [_step(step, name, text) for step in steps if isinstance(step.tag, str)]  # and no comment
    return _multiplied(matrices[::-1])


def _multiplied(factors: Sequence["np.ndarray | _Look"]) -> "np.ndarray | _Look":
    """The product of transforms, of which the last comes first; a look-at stays one, alone or after a mirror."""
    first, *others = factors or (np.eye(4),)
    if isinstance(first, _Look) and not others:
        return first
    if isinstance(first, _Look) and len(others) == 1 and _is_mirror(others[0]):
        return _Look(first.eye, first.target, first.up, True)
    result = np.eye(4)
    for factor in factors:
        result = result @ (factor.matrix() if isinstance(factor, _Look) else factor)
    return result


def _is_mirror(factor: object) -> bool:
    return isinstance(factor, np.ndarray) and factor.tolist() == np.diag([-1.0, 1, 1, 1]).tolist()


def _step(step: ElementTree.Element, name: str, text: Callable[[str], str]) -> "np.ndarray | _Look":
    tag, what = step.tag.lower(), f"<{step.tag}> of Mitsuba's sensor {name}"

    def vector(key: str, usual: float | None = None) -> tuple[float, ...]:
        if usual is not None and step.get(key) is None:
            return tuple(_number(text(step.get(axis, str(usual))), f"{axis} of {what}") for axis in "xyz")
        parts = re.split(r"[\s,]+", text(step.get(key, "")).strip())
        if len(parts) == 1 and usual == 1.0:
            parts = parts * 3
        if len(parts) != 3:
            raise InputError(f"{key} of {what} is {checks.quoted(step.get(key, ''))}: give three numbers")
        return tuple(_number(part, f"{key} of {what}") for part in parts)

    result = np.eye(4)
    if tag == "lookat":
        return _Look(vector("origin"), vector("target"), vector("up"))
    if tag == "translate":
        result[:3, 3] = vector("value", 0.0)
    elif tag == "scale":
        result[:3, :3] = np.diag(vector("value", 1.0))
    elif tag == "rotate":
        axis = vector("value", 0.0)
        length = math.hypot(*axis)
        if not length:
            raise InputError(f"the axis of {what} is 0: give its x, y and z")
        result[:3, :3] = turn(_number(text(step.get("angle", "0")), f"angle of {what}"), [part / length for part in axis])
    elif tag == "matrix":
        parts = [_number(part, what) for part in re.split(r"[\s,]+", text(step.get("value", "")).strip())]
        if len(parts) == 16:
            result = np.array(parts).reshape(4, 4)
        elif len(parts) == 9:
            result[:3, :3] = np.array(parts).reshape(3, 3)
        else:
            raise InputError(f"{what} has {counted(len(parts), 'number')}: give 16, row by row")
        if result[3].tolist() != [0, 0, 0, 1]:
            raise InputError(f"the last row of {what} is {checks.quoted(result[3].tolist())}: it should be 0 0 0 1")
    else:
        raise InputError(f"{what} is no move of a camera that is known: give lookat, translate, rotate, scale or matrix")
    return result


# ---- Python


def _in_python(text: str) -> Iterator[_Sensor]:
    text = texts.without(r"#[^\n]*", text)
    starts = list(_SENSOR.finditer(text))
    if not starts:
        looks = list(_LOOK.finditer(text))
        if len(looks) != 1:
            raise InputError(f"the text has {len(looks)} look_at(…) and no sensor: copy one")
        values = {texts.plain(key): value for key, value in _FRAGMENT.findall(text)}
        yield _Sensor("perspective", "fragment", values, None, _product(text, _start_of(text, looks[0].start())))
        return
    for match in starts:
        opened = _enclosing(text, match.start())
        named = re.search(r"['\"](\w{1,60})['\"]\s*:\s*\Z|(\w{1,60})\s*=\s*\Z", text[max(0, opened - 90) : opened])
        name = next((part for part in named.groups() if part), "sensor") if named else "sensor"
        yield _dictionary(text, opened, match[1], name)


_FRAGMENT = re.compile(r"['\"](fov|fov_axis|focal_length)['\"]\s*:\s*['\"]?([^\s,'\"}]+)")
_ITEM = re.compile(r"\s*['\"](\w+)['\"]\s*:\s*")


def _enclosing(text: str, at: int) -> int:
    """The place where the innermost { before another opens."""
    depth = 0
    for place in range(at - 1, max(-1, at - 20_000), -1):
        if text[place] == "}":
            depth += 1
        elif text[place] == "{":
            if not depth:
                return place
            depth -= 1
    texts.fail(text, at, "give the whole dictionary of the sensor")


def _dictionary(text: str, opened: int, kind: str, name: str) -> _Sensor:
    end = texts.closing(text, opened, "{}")
    values: dict[str, object] = {}
    film, pose = None, None
    reader = Expressions(text)
    at = opened + 1
    while item := _ITEM.match(text, at):
        key = texts.plain(item[1])
        stop = _end_of_value(text, item.end(), end)
        if key == "toworld":
            pose = _product(text, item.end())
        elif text[item.end()] == "{":
            inside: Any
            inside, _ = reader.value(item.end())
            if not isinstance(inside, dict) and key == "film":
                texts.fail(text, item.end(), "give the film as a dictionary of numbers")
            if key == "film" or (isinstance(inside, dict) and str(inside.get("type", "")).endswith("film")):
                film = {texts.plain(each): value for each, value in inside.items()}
        elif key == "film":
            texts.fail(text, item.start(), "write the film out, as in {'type': 'hdrfilm', 'width': 640, 'height': 480}")
        else:
            values[key] = reader.value(item.end())[0]
        at = stop + 1 if text[stop : stop + 1] == "," else stop
    if text[at:end].strip():
        texts.fail(text, at, "give the sensor's dictionary as Python writes it")
    return _Sensor(kind, name, values, film, pose)


def _end_of_value(text: str, at: int, end: int) -> int:
    """The place of the comma after a value, or the end of its dictionary."""
    depth = 0
    for sign, place in tokens.outside_strings(text, at, end):
        if sign in "([{":
            depth += 1
        elif sign in ")]}":
            depth -= 1
        elif sign == "," and not depth:
            return place
    return end


def _start_of(text: str, at: int) -> int:
    """The beginning of the product of transforms in which a look_at stands: names, dots, @ and calls before it."""
    depth, start = 0, at
    for place in range(at - 1, max(-1, at - 400), -1):
        sign = text[place]
        if sign == "(" and not depth:
            break
        depth += (sign == ")") - (sign == "(")
        if depth:
            continue
        if not (sign.isalnum() or sign.isspace() or sign in "_.@()"):
            break
        start = start if sign.isspace() or sign == "@" else place
    return start


def _product(text: str, at: int) -> "np.ndarray | _Look":
    """A transform: calls of translate, rotate, scale, look_at or a matrix, in a chain with dots or a product with @."""
    factors: list = []
    reader = Expressions(text)
    while True:
        name = tokens.token(text, at)
        opened = tokens.token(text, name.end)
        if name.kind != "name" or opened.text not in (".", "("):
            texts.fail(text, at, "give to_world as look_at, translate, rotate, scale and matrices of numbers")
        at = opened.end
        if opened.text == ".":
            continue
        if (closed := tokens.token(text, at)).text == ")":
            at = closed.end
            factors += [np.eye(4)] if tokens.token(text, at).text != "." else []
        else:
            values, named, at = reader.arguments(opened.start)
            factors.append(_call(name.text, values, named, text, name.start))
        after = tokens.token(text, at)
        if after.text not in (".", "@"):
            break
        at = after.end
    return _multiplied(factors)


def _call(name: str, values: list, named: dict, text: str, at: int) -> "np.ndarray | _Look":
    result = np.eye(4)

    def argument(place: int, key: str, count: int) -> tuple[float, ...]:
        value = named.get(key, values[place] if place < len(values) else None)
        parsed = numbers(value, count)
        if parsed is None:
            texts.fail(text, getattr(value, "at", at) or at, f"give {count} numbers for {key} of {name}")
        return parsed

    if name == "look_at":
        return _Look(argument(0, "origin", 3), argument(1, "target", 3), argument(2, "up", 3))
    if name == "translate":
        result[:3, 3] = argument(0, "v", 3)
    elif name == "scale":
        value = named.get("v", values[0] if values else None)
        result[:3, :3] *= value if isinstance(value, float) else 1.0
        if not isinstance(value, float):
            result[:3, :3] = np.diag(argument(0, "v", 3))
    elif name == "rotate":
        angle = named.get("angle", values[1] if len(values) > 1 else None)
        axis = argument(0, "axis", 3)
        if not isinstance(angle, float) or not any(axis):
            texts.fail(text, at, "give rotate an axis and an angle in degrees")
        result[:3, :3] = turn(float(angle), [part / math.hypot(*axis) for part in axis])
    elif len(values) == 1 and (rows := _rows(values[0])) is not None:
        result = rows
    else:
        texts.fail(text, at, "give to_world as look_at, translate, rotate, scale and matrices of numbers")
    return result


def _rows(value: object) -> np.ndarray | None:
    rows = [numbers(row, 4) for row in value] if isinstance(value, tuple) and len(value) == 4 else [None]
    if None in rows or rows[3] != (0, 0, 0, 1):
        return None
    return np.array(rows)


# ---- out


def write(cameras: Sequence[Camera], options: Options) -> str:
    """A scene with a sensor for each camera. Raises InputError if the pixels of one are not square, which Mitsuba can't say."""
    names = naming.numbered([camera.name for camera in cameras])  # ids, of which Mitsuba takes none twice
    return "\n".join(['<scene version="3.0.0">', *map(_written, cameras, names), "</scene>", ""])


def _written(camera: Camera, name: str) -> str:
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y) = pinhole.distance, pinhole.principal_point
    if abs(d_x / d_y - 1) > 2.0**-23:
        raise InputError(
            f"the pixels of {camera.name} have the aspect {d_y / d_x:.6g}, and Mitsuba knows square ones only: change it"
        )
    width, height = pinhole.width, pinhole.height
    offset_x, offset_y = (width / 2 - c_x) / width, (height / 2 - (height - c_y)) / height
    offsets = [
        f'        <float name="principal_point_offset_{axis}" value="{texts.shortest(offset)}"/>'
        for axis, offset in (("x", offset_x), ("y", offset_y))
        if offset
    ]
    mirror = ['            <scale value="-1, 1, 1"/>'] if pinhole.mirrored else []
    e, l, up = (texts.listed(vector, ", ") for vector in texts.look(pinhole))
    return "\n".join(
        [
            f"    <!-- {own.comment(pinhole)} -->",
            f'    <sensor type="perspective" id={quoteattr(terminal.plain(name))}>',
            f'        <float name="fov" value="{texts.shortest(math.degrees(2 * math.atan(width / 2 / d_x)))}"/>',
            '        <string name="fov_axis" value="x"/>',
            *offsets,
            '        <transform name="to_world">',
            *mirror,
            f'            <lookat origin="{e}" target="{l}" up="{up}"/>',
            "        </transform>",
            '        <film type="hdrfilm">',
            f'            <integer name="width" value="{width}"/>',
            f'            <integer name="height" value="{height}"/>',
            "        </film>",
            "    </sensor>",
        ]
    )
