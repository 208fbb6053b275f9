"""USD: cameras of a stage, read by OpenUSD itself (`pxr`: in a Blender built with its Python modules, else usd-core of
the package index), in a process of its own (usd_stage.py).

The camera's axes are x right, y up, z away from the view, whatever the stage's upAxis is; matrices are for row vectors. The
world is brought to z up and to meters by what the stage says of its own, as Blender's importer does it: a stage that says
nothing counts in centimeters and has y up. Lens,
apertures and their offsets count in tenths of a scene unit, of which only ratios decide the picture. A stage says no number of
pixels; what is written here has it as userProperties of the camera, and else it is given. Where the apertures' aspect is not
the picture's, the aperture grows to fit, which is UsdRender's rule. Written as text, so that writing needs no library; lens and
apertures are float32 there, by the schema.

Source: OpenUSD's pxr/usd/usdGeom/schema.usda, pxr/base/gf/camera.cpp and usdRender/schema.usda (aspectRatioConformPolicy).
"""

import dataclasses
import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import checks, usd_stage
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane
from . import axes, naming, own
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source, pixels

TITLE = "USD"
SUFFIX = ".usda"

_SIZE = "userProperties:viewcam_resolution"
_PINHOLE = "pinhole"
_SIDES = ("Horizontal", "Vertical")
_MOST_NAMED = 3


def recognizes(source: Source) -> bool:
    data = source.data
    zipped = source.path is not None and source.path.suffix.lower() == ".usdz"
    text = data[:100].removeprefix(b"\xef\xbb\xbf").lstrip()  # which OpenUSD refuses with the place
    return text.startswith(b"#usda ") or data.startswith(b"PXR-USDC") or (zipped and data.startswith(b"PK"))


def read(source: Source, options: Options) -> list[Camera]:
    stage = _stage(source)
    notes = _notes(stage)
    left_out, result = LeftOut(InputError), []
    for camera in stage["cameras"]:
        with left_out.unless_pinhole(camera["name"]):
            if "error" in camera:
                raise InputError(f"camera {checks.quoted(camera['name'])} can't be read ({camera['error']}): export it again")
            result += [_camera(camera["name"], sample, options).noted(*notes) for sample in camera["samples"]]
    names = [camera.name for camera in result]
    if len({*names}) < len(names):
        names = naming.numbered(names)
    return left_out.with_notes([dataclasses.replace(camera, name=name) for camera, name in zip(result, names, strict=True)])


def _notes(stage: dict[str, Any]) -> tuple[str, ...]:
    unit, notes = stage["meters_per_unit"], []
    if stage["y_up"] or unit != 1:
        turned = "y up was turned to z up" if stage["y_up"] else "its z points up"
        scaled = f"one unit of it is {unit:g} m" if unit != 1 else "it counts in meters"
        notes.append(f"The world was taken as the stage says it, as Blender's importer does: {turned}, {scaled}")
    if others := stage["left_out"]:
        names = ", ".join(map(checks.quoted, others[:_MOST_NAMED])) + (" …" if len(others) > _MOST_NAMED else "")
        notes.append(f"Not read, since nothing but layers in the file's own folder is: {names}")
    return tuple(notes)


def in_world(source: Source, options: Options) -> Options:
    """The options, with the axes and the unit that the stage says."""
    stage = _stage(source)
    unit = checks.number(f"metersPerUnit of {source.name}", stage["meters_per_unit"], 1e-12, 1e12)
    return dataclasses.replace(options, axes="y_up" if stage["y_up"] else options.axes, scale=options.scale * unit)


def write(cameras: Sequence[Camera], options: Options) -> str:
    up = "Y" if options.axes == "y_up" else "Z"
    taken: set[str] = set()
    blocks = [_prim(camera, _identifier(camera.name, taken)) for camera in cameras]
    doc = f'    doc = "{options.remembered}"\n' if options.remembered else ""
    return f'#usda 1.0\n(\n{doc}    metersPerUnit = 1\n    upAxis = "{up}"\n)\n\n' + "\n".join(blocks)


def notes_in(source: Source) -> list[str]:
    stage = _stage(source)
    return [stage["documentation"], *(f"{own.KEY} {note}" for note in stage["values"])]


def _stage(source: Source) -> dict[str, Any]:
    """The result of `usd_stage.read`, asked once."""
    if TITLE not in source.parsed:
        source.parsed[TITLE] = usd_stage.read(source.name, source.path, source.text, _SIZE, own.KEY)
    return source.parsed[TITLE]


def _camera(name: str, sample: dict[str, Any], options: Options) -> Camera:
    name = name if sample["time"] is None else f"{name} {sample['time']:g}"
    what = f"camera {checks.quoted(name)}"
    values = Record(sample, what)
    if str(sample["model"] or _PINHOLE).lower() != _PINHOLE:
        not_a_pinhole(what, f"of the model {checks.quoted(sample['model'])}")
    if sample["Projection"] == "orthographic":
        not_a_pinhole(what, "orthographic")
    focal, across, upwards, right, up = (
        values.number(key)
        for key in ("FocalLength", *(f"{side}Aperture{which}" for which in ("", "Offset") for side in _SIDES))
    )
    if min(focal, across, upwards) <= 0:
        raise InputError(f"{what} has a focal length or aperture that is not above 0: correct it")
    stated = sample["size"] is not None
    width, height = _size(sample["size"], what) if stated else options.size_or_refuse(what)
    notes: tuple[str, ...] = ()
    aspect = width / height * options.pixel_aspect
    if not stated and abs(across / upwards / aspect - 1) > 1e-3:
        notes += (f"{what} is made for an aspect of {across / upwards:.6g} and the picture's is {aspect:.6g}: it grew to fit",)
        across, upwards = (across, across / aspect) if across / upwards > aspect else (upwards * aspect, upwards)
    if sample["FStop"]:
        notes += (f"{what} has depth of field, which was left out",)
    plane = ViewPlane(
        (focal / across * width, focal / upwards * height),
        (width / 2 - right / across * width, height / 2 - up / upwards * height),
        width,
        height,
    )
    matrix = np.array(sample["matrix"]).reshape(4, 4).T
    pinhole, more = axes.pinhole(matrix, plane, what, scaled=True)
    return Camera(name, pinhole, stated, (*notes, *more), time=sample["seconds"])


def _size(size: object, what: str) -> tuple[int, int]:
    if not isinstance(size, list) or len(size) != 2:
        raise InputError(f"{_SIZE} of {what} is {checks.quoted(size)}: it should be two numbers of pixels")
    width, height = (pixels(f"{_SIZE} of {what}", side) for side in size)
    return width, height


def _identifier(name: str, taken: set[str]) -> str:
    identifier = re.sub(r"\W", "_", name, flags=re.ASCII)
    identifier = f"_{identifier}" if not identifier or identifier[0].isdigit() else identifier
    result, number = identifier, 1
    while result in taken:
        result, number = f"{identifier}_{number}", number + 1
    taken.add(result)
    return result


def read_again(cameras: Sequence[Camera], options: Options) -> list[Camera]:
    """The cameras that `read` makes of these once they are written, without OpenUSD."""
    result = []
    for camera in cameras:
        lens, pinhole = _lens(camera.pinhole), camera.pinhole
        sample: dict[str, Any] = {key: float(np.float32(value)) for key, value in lens.items()}
        matrix = [number for column in zip(*axes.camera_to_world(pinhole), strict=True) for number in column]
        sample |= {
            "Projection": "perspective",
            "FStop": 0.0,
            "model": None,
            "size": [pinhole.width, pinhole.height],
            "matrix": matrix,
        }
        result.append(_camera(camera.name, sample | {"time": None, "seconds": None}, options))
    return result


def _lens(pinhole: Pinhole) -> dict[str, float]:
    """The attributes of the lens by the schema's names, which are float32 there."""
    (d_x, d_y), (c_x, c_y), width, height = pinhole.distance, pinhole.principal_point, pinhole.width, pinhole.height
    across = 36.0
    focal = across * d_x / width
    upwards = focal * height / d_y
    return {
        "FocalLength": focal,
        "HorizontalAperture": across,
        "VerticalAperture": upwards,
        "HorizontalApertureOffset": (width / 2 - c_x) / width * across,
        "VerticalApertureOffset": (height / 2 - c_y) / height * upwards,
    }


def _prim(camera: Camera, identifier: str) -> str:
    pinhole = camera.pinhole
    columns = zip(*axes.camera_to_world(pinhole), strict=True)
    rows = ", ".join(f"({', '.join(map(repr, column))})" for column in columns)
    lines = [
        f'def Camera "{identifier}" (',
        "    customData = {",
        f"        string {own.KEY} = '{json.dumps(own.document(pinhole))}'",
        "    }",
        f"    displayName = {json.dumps(camera.name, ensure_ascii=False)}",
        ")",
        "{",
        '    token projection = "perspective"',
        *(f"    float {key[0].lower()}{key[1:]} = {value!r}" for key, value in _lens(pinhole).items()),
        f"    custom int2 {_SIZE} = ({pinhole.width}, {pinhole.height})",
        f"    matrix4d xformOp:transform = ( {rows} )",
        '    uniform token[] xformOpOrder = ["xformOp:transform"]',
        "}",
    ]
    return "\n".join(lines) + "\n"
