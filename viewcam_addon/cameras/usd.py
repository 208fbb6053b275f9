"""USD: cameras of a stage, read by OpenUSD itself (`pxr`: in a Blender built with its Python modules, else usd-core of
the package index), in a process of its own (usd_stage.py).

The camera's axes are x right, y up, z away from the view, whatever the stage's upAxis is; matrices are for row vectors. The
world is brought to z up and to meters by what the stage says of its own, as Blender's importer does it: a stage that says
nothing counts in centimeters and has y up. Lens,
apertures and their offsets count in tenths of a scene unit, of which only ratios decide the picture. A camera says no number of
pixels: what is written here has it as its userProperties, a RenderProduct or RenderSettings says it of the camera that it
renders, and else it is given. Where the apertures' aspect is not the picture's, the aperture grows to fit, unless
aspectRatioConformPolicy says otherwise. Written as text, so that writing needs no library; lens and apertures are float32
there, by the schema.

Source: OpenUSD's pxr/usd/usdGeom/schema.usda, pxr/base/gf/camera.cpp, usdRender/schema.usda and spec.cpp (aspect ratios).
"""

import dataclasses
import json
import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .. import checks, usd_stage
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane
from . import axes, own
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source, pixels

TITLE = "USD"
SUFFIX = ".usda"

_SIZE = "userProperties:viewcam_resolution"
_PINHOLE = "pinhole"
_SIDES = ("Horizontal", "Vertical")
_MOST_NAMED = 3
_KEEPS_WIDTH: dict[str, Callable[[bool], bool]] = {
    "expandAperture": lambda is_wider: is_wider,
    "cropAperture": lambda is_wider: not is_wider,
    "adjustApertureHeight": lambda is_wider: True,
    "adjustApertureWidth": lambda is_wider: False,
}
"""By UsdRender's policy: whether the width of an aperture that is wider than the picture, or not, stays."""


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
            picture, more = _picture(camera)
            each = [_camera(camera["name"], sample | picture, options) for sample in camera["samples"]]
            result += [read.noted(*notes, *more) for read in each]
    return left_out.with_notes(result)


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


def _picture(camera: dict[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The picture that the stage renders of a camera, if it is one alone; and notes."""
    pictures = camera["renders"]
    if len(pictures) < 2:
        return {"picture": pictures[0] if pictures else None}, ()
    sizes = ", ".join(" × ".join(map(str, picture["resolution"])) for picture in pictures[:_MOST_NAMED])
    return {"picture": None}, (
        f"The stage renders {camera['name']} in {len(pictures)} shapes, as {sizes}: none of them was taken",
    )


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
    size, picture = sample["size"], sample["picture"]
    stated = size is not None or picture is not None
    if size is not None:
        width, height = _size(size, f"{_SIZE} of {what}")
    elif picture is not None:
        width, height = _size(picture["resolution"], f"the resolution that the stage renders {what} in")
    else:
        width, height = options.size_or_refuse(what)
    notes: tuple[str, ...] = ()
    if size is None:
        across, upwards, notes = _conformed(across, upwards, width / height, picture, options, what)
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


def _conformed(
    across: float, upwards: float, shape: float, picture: dict[str, Any] | None, options: Options, what: str
) -> tuple[float, float, tuple[str, ...]]:
    """The apertures as they are made to fit the picture, and notes.

    shape : the picture's width over its height, in pixels.
    picture : its entry of the camera's `renders`; None where there is none.
    """
    policy, pixel_aspect = "expandAperture", options.pixel_aspect
    if picture is not None:
        policy = str(picture["aspectRatioConformPolicy"])
        pixel_aspect = checks.number(f"pixelAspectRatio of {what}", picture["pixelAspectRatio"], 1e-12, 1e12)
    aspect, own_aspect = shape * pixel_aspect, across / upwards
    if policy == "adjustPixelAspectRatio" or abs(own_aspect / aspect - 1) <= 1e-3:
        return across, upwards, ()
    if policy not in _KEEPS_WIDTH:
        raise InputError(f"the aspectRatioConformPolicy of {what} is {checks.quoted(policy)}: give one that UsdRender has")
    changed = "shrank" if policy == "cropAperture" else "grew" if policy == "expandAperture" else "was changed"
    notes = (f"{what} is made for an aspect of {own_aspect:.6g} and the picture's is {aspect:.6g}: it {changed} to fit",)
    keeps_width = _KEEPS_WIDTH[policy](own_aspect > aspect)
    return (across, across / aspect, notes) if keeps_width else (upwards * aspect, upwards, notes)


def _size(size: object, name: str) -> tuple[int, int]:
    if not isinstance(size, list) or len(size) != 2:
        raise InputError(f"{name} is {checks.quoted(size)}: it should be two numbers of pixels")
    width, height = (pixels(name, side) for side in size)
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
            "picture": None,
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
