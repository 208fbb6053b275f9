"""Meshroom's and AliceVision's .sfm, .json or .abc's text sister: views, intrinsics and poses as JSON, all numbers as texts.

A pose has the eye and the rotation from world to camera (x right, y down, z into the view), listed column by column. The focal
length is in millimeters of the sensor's width; the principal point counts from the picture's middle since version 1.2.1, from
its corner before. Pixels that are not square divided the other way before 1.2.11.

Source: AliceVision's src/aliceVision/sfmDataIO/jsonIO.cpp and camera/IntrinsicScaleOffset.cpp.
"""

import numpy as np

from .. import checks
from ..errors import InputError, counted
from ..pinhole import ViewPlane
from . import axes, distortion, naming
from .camera import Camera, LeftOut, NoPinholeError, Options, not_a_pinhole
from .source import Record, Source, number

TITLE = "Meshroom and AliceVision .sfm"

_PINHOLES = ("pinhole", "radial1", "radial3", "brown")
_LENSES = {
    "none": (),
    "radialk1": ("k1",),
    "radial1": ("k1",),
    "radialk3": ("k1", "k2", "k3"),
    "radial3": ("k1", "k2", "k3"),
    "brown": ("k1", "k2", "k3", "p1", "p2"),
}


def recognizes(source: Source) -> bool:
    document = source.document
    return isinstance(document.get("views"), list) and "intrinsics" in document and _first_view_is_ours(document["views"])


def _first_view_is_ours(views: list) -> bool:
    return bool(views) and isinstance(views[0], dict) and "viewId" in views[0]


def read(source: Source, options: Options) -> list[Camera]:
    document = Record(source.document, source.name)
    version = _version(document)
    poses = {_key(pose, "poseId"): pose for pose in document.records("poses", "pose")} if "poses" in document else {}
    intrinsics = {_key(each, "intrinsicId"): each for each in document.records("intrinsics", "intrinsic")}
    views = document.records("views", "view")
    placed = [view for view in views if str(view.get("poseId")) in poses and str(view.get("intrinsicId")) in intrinsics]
    if not placed:
        raise InputError(
            f"none of {counted(len(views), 'view')} of {source.name} has a pose: let Meshroom run StructureFromMotion first"
        )
    lost = len(views) - len(placed)
    lost_note = (f"{counted(lost, 'view')} without a pose: left out",) if lost else ()
    paths = [str(view.get("path") or f"view {view.get('viewId')}") for view in placed]
    planes: dict[str, tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]] = {}
    left_out, cameras = LeftOut(), []
    for view, path, name in zip(placed, paths, naming.distinct(paths), strict=True):
        with left_out.unless_pinhole(name):
            intrinsic = str(view.get("intrinsicId"))
            if intrinsic not in planes:
                planes[intrinsic] = _plane(intrinsics[intrinsic], version, options)
            plane, lens, notes = planes[intrinsic]
            if "rigId" in view and str(view.get("isPoseIndependant")).lower() in ("false", "0"):
                raise InputError(
                    f"view {checks.quoted(name)} is of a rig, on whose pose its cameras stand: give each a pose of its own"
                )
            pose = poses[str(view.get("poseId"))].record("pose").record("transform")
            matrix = np.eye(4)
            matrix[:3, :3] = np.array(pose.numbers("rotation", 9)).reshape(
                3, 3
            )  # column by column is its transpose, row by row
            matrix[:3, 3] = pose.numbers("center", 3)
            pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, f"view {checks.quoted(name)}")
            cameras.append(Camera(name, pinhole, True, (*lost_note, *notes, *more), path, lens=lens))
    return left_out.with_notes(cameras)


def _key(record: Record, key: str) -> str:
    return str(record.needed(key))


def _version(document: Record) -> tuple[int, ...]:
    numbers = document.values.get("version") or ["1", "2", "11"]
    parts = numbers if isinstance(numbers, list) else str(numbers).split(".")
    return tuple(int(number(document.called("version"), part, 0, 1e6)) for part in parts)


def _plane(
    intrinsic: Record, version: tuple[int, ...], options: Options
) -> tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]:
    kind = str(intrinsic.get("type") or "pinhole")
    if kind not in _PINHOLES:
        not_a_pinhole(intrinsic.place, f"of the type {checks.quoted(kind)}")
    width, height = intrinsic.size("width"), intrinsic.size("height")
    ratio = intrinsic.number("pixelRatio", 1.0, 1e-6)
    if "pxFocalLength" in intrinsic:
        focal = intrinsic.values["pxFocalLength"]
        f_x, f_y = (
            intrinsic.numbers("pxFocalLength", 2) if isinstance(focal, list) else (intrinsic.number("pxFocalLength"),) * 2
        )
    else:
        f = intrinsic.number("focalLength", least=1e-9) / intrinsic.number("sensorWidth", least=1e-9) * width
        if version >= (1, 2, 11):
            f_x, f_y = f / ratio, f
        elif version >= (1, 2, 5):
            f_x, f_y = f, f * ratio
        else:  # then the ratio was f_x / f_y
            f_x, f_y = f, f / ratio
    if not (f_x > 0 and f_y > 0):
        raise InputError(f"{intrinsic.place} has the focal length {min(f_x, f_y):g}: let Meshroom estimate it first")
    c_x, c_y = intrinsic.numbers("principalPoint", 2) if "principalPoint" in intrinsic else (0.0, 0.0)
    if version >= (1, 2, 1):
        c_x, c_y = width / 2 + c_x, height / 2 + c_y
    plane = axes.view_plane(f_x, f_y, c_x, c_y, (width, height))
    notes: tuple[str, ...] = ()
    if height > width and "pxFocalLength" not in intrinsic:
        notes = (f"{intrinsic.place} is of upright pictures: its focal length was taken for that of the sensor's width",)
    lens, note = _of_lens(intrinsic, kind, plane, options)
    return plane, lens, notes + note


def _of_lens(
    intrinsic: Record, kind: str, plane: ViewPlane, options: Options
) -> tuple[distortion.Lens | None, tuple[str, ...]]:
    undone = intrinsic.values.get("undistortionParams") or []
    if isinstance(undone, list) and undone and any(intrinsic.numbers("undistortionParams", len(undone))):
        return _of_unknown_model(intrinsic, str(intrinsic.get("undistortionType") or "none"), options)
    parameters = intrinsic.values.get("distortionParams") or []
    numbers = intrinsic.numbers("distortionParams", len(parameters)) if isinstance(parameters, list) and parameters else ()
    if not any(numbers):
        return None, ()
    model = str(intrinsic.get("distortionType") or kind)
    if model not in _LENSES:
        return _of_unknown_model(intrinsic, model, options)
    values = dict(zip(_LENSES[model], numbers, strict=False))
    return distortion.settle(distortion.opencv(values), plane, intrinsic.place, options.without_distortion)


def _of_unknown_model(intrinsic: Record, model: str, options: Options) -> tuple[None, tuple[str, ...]]:
    reason = f"{intrinsic.place} has lens distortion of the unknown model {checks.quoted(model)}"
    if options.without_distortion:
        return None, (f"{reason}, which was left out",)
    raise NoPinholeError(f"{reason}, which no pinhole has: undistort the pictures, or choose to take it without distortion")
