"""OpenMVG's sfm_data as JSON: views, intrinsics and extrinsics as the cereal library writes them.

An extrinsic has the rotation from world to camera (x right, y down, z into the view), row by row, and the eye. cereal names a
type where it first appears and numbers it from then on. From where OpenMVG counts pixels is said nowhere: the principal point
is taken as it stands, from the picture's corner, and a note says so.

Source: OpenMVG's src/openMVG/sfm/sfm_data_io_cereal.hpp and cameras/Camera_*_io.hpp.
"""

import numpy as np

from .. import checks
from ..errors import InputError, counted
from ..pinhole import ViewPlane
from . import axes, distortion, naming, opencv
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source

TITLE = "OpenMVG sfm_data.json"

_NONE = str(2**32 - 1)
_LENSES = {"disto_k1": ("k1",), "disto_k3": ("k1", "k2", "k3"), "disto_t2": ("k1", "k2", "k3", "p1", "p2")}
_FISHEYE = ("k1", "k2", "k3", "k4")
_PINHOLES = ("pinhole", "pinhole_radial_k1", "pinhole_radial_k3", "pinhole_brown_t2", "fisheye")


def recognizes(source: Source) -> bool:
    return {"sfm_data_version", "views", "intrinsics"} <= source.document.keys()


def read(source: Source, options: Options) -> list[Camera]:
    document = Record(source.document, source.name)
    poses = {str(each.values.get("key")): each.record("value") for each in document.records("extrinsics", "extrinsic")}
    kinds: dict[int, str] = {}
    intrinsics = {}
    for each in document.records("intrinsics", "intrinsic"):
        value = each.record("value")
        number = value.values.get("polymorphic_id")
        number = number & 0x3FFFFFFF if isinstance(number, int) else -1
        kinds.setdefault(number, str(value.values.get("polymorphic_name") or "pinhole"))
        intrinsics[str(each.values.get("key"))] = (kinds[number], value.record("ptr_wrapper").record("data"))
    root = document.values.get("root_path")
    result, lost = [], 0
    for each in document.records("views", "view"):
        view = each.record("value").record("ptr_wrapper").record("data")
        pose_id, intrinsic_id = str(view.values.get("id_pose")), str(view.values.get("id_intrinsic"))
        if pose_id not in poses or intrinsic_id not in intrinsics or intrinsic_id == _NONE:
            lost += 1
            continue
        path = "/".join(part for part in (str(view.get("local_path") or ""), str(view.get("filename") or "")) if part)
        result.append((path or f"view {view.get('id_view')}", poses[pose_id], *intrinsics[intrinsic_id]))
    if not result:
        raise InputError(f"none of {counted(lost, 'view')} of {source.name} has a pose: let OpenMVG reconstruct it first")
    note: tuple[str, ...] = (f"{counted(lost, 'view')} without a pose: left out",) if lost else ()
    if not options.pixel:
        note += ("OpenMVG does not say from where it counts pixels: the principal point was taken from the picture's corner",)
    planes: dict[int, tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]] = {}
    left_out, cameras = LeftOut(), []
    for (path, pose, kind, data), name in zip(result, naming.distinct([path for path, *_ in result]), strict=True):
        with left_out.unless_pinhole(name):
            if id(data) not in planes:
                planes[id(data)] = _plane(data, kind, options)
            plane, lens, notes = planes[id(data)]
            matrix = np.eye(4)
            matrix[:3, :3] = np.array(pose.numbers("rotation", 9)).reshape(3, 3).T
            matrix[:3, 3] = pose.numbers("center", 3)
            pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, f"view {checks.quoted(name)}")
            image = f"{root}/{path}" if isinstance(root, str) and root else path
            cameras.append(Camera(name, pinhole, True, (*note, *notes, *more), image, lens=lens))
    return left_out.with_notes(cameras)


def _plane(data: Record, kind: str, options: Options) -> tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]:
    if kind not in _PINHOLES:
        not_a_pinhole(data.place, f"of the type {checks.quoted(kind)}")
    inner = data.record("value0") if "value0" in data and "focal_length" not in data else data
    f = inner.number("focal_length", least=1e-9)
    c_x, c_y = inner.numbers("principal_point", 2)
    half = opencv.half_pixel(options, "corner")
    plane = axes.view_plane(f, f, c_x + half, c_y + half, (inner.size("width"), inner.size("height")))
    if kind == "fisheye" or "fisheye" in data:
        lens = distortion.fisheye(dict(zip(_FISHEYE, data.numbers("fisheye", len(_FISHEYE)), strict=True)))
        return plane, *distortion.settle(lens, plane, data.place, options.without_distortion)
    key = next((key for key in _LENSES if key in data), None)
    if key is None:
        return plane, None, ()
    numbers = dict(zip(_LENSES[key], data.numbers(key, len(_LENSES[key])), strict=True))
    return plane, *distortion.settle(distortion.opencv(numbers), plane, data.place, options.without_distortion)
