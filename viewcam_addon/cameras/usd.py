"""USD: cameras of a stage, read by OpenUSD itself (`pxr`: in a Blender built with its Python modules, else usd-core of
the package index).

The camera's axes are x right, y up, z away from the view, whatever the stage's upAxis is; matrices are for row vectors. Lens,
apertures and their offsets count in tenths of a scene unit, of which only ratios decide the picture. A stage says no number of
pixels; what is written here has it as userProperties of the camera, and else it is given. Where the apertures' aspect is not
the picture's, the aperture grows to fit, which is UsdRender's rule. Written as text, so that writing needs no library; lens and
apertures are float32 there, by the schema.

Source: OpenUSD's pxr/usd/usdGeom/schema.usda, pxr/base/gf/camera.cpp and usdRender/schema.usda (aspectRatioConformPolicy).
"""

import json
import re
from collections.abc import Iterator, Sequence

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import ViewPlane
from . import axes, own
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Source

TITLE = "USD"
SUFFIX = ".usda"

_SIZE = "userProperties:viewcam_resolution"
_MOST_SAMPLES = 100_000
_Y_UP = "The stage's y points up: the numbers stay as they are unless the axes Y up → Z up are chosen"


def recognises(source: Source) -> bool:
    data = source.data
    zipped = source.path is not None and source.path.suffix.lower() == ".usdz"
    return data.startswith((b"#usda ", b"PXR-USDC")) or (zipped and data.startswith(b"PK"))


def read(source: Source, options: Options) -> list[Camera]:
    try:
        from pxr import Tf, Usd, UsdGeom
    except ImportError:
        raise InputError("USD is read by OpenUSD, which is not here: read it inside Blender, or pip install usd-core") from None
    try:
        stage = _stage(source, Usd)
    except (Tf.ErrorException, RuntimeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"{source.name} is no stage that USD can open ({reason}): export it again") from None
    y_up = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.y
    told = (_Y_UP,) if y_up and options.axes != "y_up" else ()
    left_out, found = LeftOut(InputError), []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Camera):
            with left_out.unless_pinhole(prim.GetDisplayName() or prim.GetName()):
                found += [camera.noted(*told) for camera in _cameras(prim, stage, options, Usd, UsdGeom)]
    return left_out.told(found)


def write(cameras: Sequence[Camera], options: Options) -> str:
    up = "Y" if options.axes == "y_up" else "Z"
    blocks, taken = [], set()
    for camera in cameras:
        blocks.append(_prim(camera, _identifier(camera.name, taken)))
    told = f'    doc = "{options.remembered}"\n' if options.remembered else ""
    return f'#usda 1.0\n(\n{told}    metersPerUnit = 1\n    upAxis = "{up}"\n)\n\n' + "\n".join(blocks)


def notes_in(source: Source) -> list[str]:
    if source.text:
        return [source.text]
    from pxr import Usd

    stage = _stage(source, Usd)
    notes = (prim.GetCustomDataByKey(own.KEY) for prim in stage.Traverse())
    return [stage.GetRootLayer().documentation, *(f"{own.KEY} {note}" for note in notes if note)]


def _stage(source: Source, usd):
    if source.path:
        return usd.Stage.Open(str(source.path))
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    if not layer.ImportFromString(source.text):
        raise RuntimeError("its text is not understood")
    return usd.Stage.Open(layer)


def _cameras(prim, stage, options: Options, usd, usd_geom) -> Iterator[Camera]:
    camera = usd_geom.Camera(prim)
    name = prim.GetDisplayName() or prim.GetName()
    times = {time for attribute in _attributes(prim, camera, usd_geom) for time in attribute.GetTimeSamples()[:_MOST_SAMPLES]}
    varying = sorted(times) or [0.0]
    for time in varying:
        code = usd.TimeCode(time) if len(varying) > 1 or time else usd.TimeCode.EarliestTime()
        called = f"{name} {time:g}" if len(varying) > 1 else name
        yield _camera(camera, called, code, time / stage.GetTimeCodesPerSecond() if len(varying) > 1 else None, options)


def _attributes(prim, camera, usd_geom) -> Iterator:
    """The attributes on which the picture depends: the camera's own, and the transforms of all above it."""
    for name in ("FocalLength", "HorizontalAperture", "VerticalAperture", "HorizontalApertureOffset", "VerticalApertureOffset"):
        yield getattr(camera, f"Get{name}Attr")()
    while prim and not prim.IsPseudoRoot():
        if prim.IsA(usd_geom.Xformable):
            for operation in usd_geom.Xformable(prim).GetOrderedXformOps():
                yield operation.GetAttr()
        prim = prim.GetParent()


def _camera(camera, name: str, code, seconds: float | None, options: Options) -> Camera:
    what = f"camera {checks.shown(name)}"
    if camera.GetProjectionAttr().Get(code) == "orthographic":
        not_a_pinhole(what, "orthographic")
    focal, across, upwards, right, up = (
        checks.number(f"{key} of {what}", getattr(camera, f"Get{key}Attr")().Get(code))
        for key in (
            "FocalLength",
            "HorizontalAperture",
            "VerticalAperture",
            "HorizontalApertureOffset",
            "VerticalApertureOffset",
        )
    )
    if min(focal, across, upwards) <= 0:
        raise InputError(f"{what} has a focal length or aperture that is not above 0: correct it")
    said = camera.GetPrim().GetAttribute(_SIZE).Get() if camera.GetPrim().HasAttribute(_SIZE) else None
    stated = said is not None
    width, height = (int(said[0]), int(said[1])) if stated else options.size_or_refuse(what)
    notes: tuple[str, ...] = ()
    aspect = width / height * options.pixel_aspect
    if not stated and abs(across / upwards / aspect - 1) > 1e-3:
        notes += (f"{what} is made for an aspect of {across / upwards:.6g} and the picture's is {aspect:.6g}: it grew to fit",)
        across, upwards = (across, across / aspect) if across / upwards > aspect else (upwards * aspect, upwards)
    if camera.GetFStopAttr().Get(code):
        notes += (f"{what} has depth of field, which was left out",)
    plane = ViewPlane(
        (focal / across * width, focal / upwards * height),
        (width / 2 - right / across * width, height / 2 - up / upwards * height),
        width,
        height,
    )
    matrix = np.array(camera.ComputeLocalToWorldTransform(code)).T
    pinhole, more = axes.pinhole(matrix, plane, what, scaled=True)
    return Camera(name, pinhole, stated, (*notes, *more), time=seconds)


def _identifier(name: str, taken: set[str]) -> str:
    found = re.sub(r"\W", "_", name, flags=re.ASCII)
    found = f"_{found}" if not found or found[0].isdigit() else found
    result, number = found, 1
    while result in taken:
        result, number = f"{found}_{number}", number + 1
    taken.add(result)
    return result


def _prim(camera: Camera, identifier: str) -> str:
    pinhole = camera.pinhole
    (d_x, d_y), (c_x, c_y), width, height = pinhole.distance, pinhole.principal_point, pinhole.width, pinhole.height
    across = 36.0
    focal = across * d_x / width
    upwards = focal * height / d_y
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
        f"    float focalLength = {focal!r}",
        f"    float horizontalAperture = {across!r}",
        f"    float verticalAperture = {upwards!r}",
        f"    float horizontalApertureOffset = {(width / 2 - c_x) / width * across!r}",
        f"    float verticalApertureOffset = {(height / 2 - c_y) / height * upwards!r}",
        f"    custom int2 {_SIZE} = ({width}, {height})",
        f"    matrix4d xformOp:transform = ( {rows} )",
        '    uniform token[] xformOpOrder = ["xformOp:transform"]',
        "}",
    ]
    return "\n".join(lines) + "\n"
