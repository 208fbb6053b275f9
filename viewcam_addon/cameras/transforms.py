"""transforms.json: cameras as the original NeRF had them, and instant-ngp and nerfstudio made them more precise.

**Pose.** `transform_matrix` is the camera in the world, its columns the camera's axes, x right, y up, z away from the view: u,
v, w and the eye. It counts in whatever the scene counts in. `applied_transform` and `applied_scale` say what was done to the
world before; the cameras stay in the file's world unless `original_world` is chosen. What `Options` did to a world on reading
is written so, too.

**Picture.** `fl_x`, `fl_y` are the view-plane distance in pixel widths and heights, `cx`, `cy` the principal point from the
left and the top edge, where the first pixel's center is (0.5, 0.5), and `w`, `h` pixels. `camera_angle_x` = 2 atan(w / 2
fl_x), for readers that know nothing else, is the field of view if the principal point is the middle, which they take for
granted: it isn't `Pinhole.field_of_view` where the camera is shifted. The original NeRF shoots its rays through the pixels'
corners (bmild/nerf #24), which no file can mend; its files have no size either, which is then that of the picture beside it.

A bare list of frames, as nerfstudio's `ns-export cameras` writes it with `transform` in each, says no distance and no size:
both are asked for.

`virtual_pinhole`, which others pass over, has the values of which the matrix was made: so the camera comes back to the bit.

**Where they stand.** At the top if all pictures have the same, else in every frame, and always together: nerfstudio takes what
is at the top before it looks into a frame, and instant-ngp reads cx and w from the same object. Where both say something and
not the same, these two would take different cameras, so it is refused.

Sources: nerfstudio's docs/quickstart/data_conventions.md, nerfstudio/data/dataparsers/nerfstudio_dataparser.py,
cameras/cameras.py (get_image_coords, _generate_rays_from_coords) and scripts/exporter.py (ExportCameraPoses); instant-ngp's
docs/nerf_dataset_tips.md, src/nerf_loader.cu (read_lens, read_focal_length) and
include/neural-graphics-primitives/common_device.cuh (pixel_to_ray_pinhole).
"""

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import InputError
from ..pinhole import Pinhole, ViewPlane
from . import axes, distortion, naming, opencv, own
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source, image_size

TITLE = "transforms.json (NeRF, instant-ngp, nerfstudio)"
SUFFIX = ".json"
LENSES = True
FILE = "transforms.json"
AABB_SCALES = tuple(2**exponent for exponent in range(8))

_POSES = ("transform_matrix", "transform_matrix_start")
_TELLING = ("camera_angle_x", "fl_x")
_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "PERSPECTIVE")
_FISHEYES = ("OPENCV_FISHEYE", "FISHEYE")
_OTHER_CAMERAS = ("ftheta_p0", "latlong", "equirectangular", "orthographic")
_NOT_READ = ("k", "intrinsic", "intrinsics", "intrinsic_matrix", "camera_intrinsics", "camera_matrix", "cam_k")
_LENS = ("k1", "k2", "k3", "k4", "p1", "p2")  # the order of distortion_params, too
_AXES = ("opengl", "blender", "nerf", "nerfstudio")
_OTHER_AXES = ("from_mitsuba", "normal_mts_args", "from_na")
_TESTS = "test_frames"
_LEAST_ANGLE = 1e-9  # radians
_SAME_FOCAL = 1e-3  # relative: what camera_angle_x and fl_x may differ by for the few digits of one


def recognizes(source: Source) -> bool:
    return bool(_files(source))


def read(source: Source, options: Options) -> list[Camera]:
    return [camera for file in _files(source) for camera in _cameras(file, options)]


def notes_in(source: Source) -> list[str]:
    return [file.text for file in _files(source)]


def write(cameras: Sequence[Camera], options: Options) -> str:
    comment = {"comment": options.remembered} if options.remembered else {}
    return text(comment | document(cameras, more=_said_of_world(cameras)))


def text(content: dict[str, Any]) -> str:
    """A `document` as it stands in a file, one frame a line."""
    frames = ",\n".join(f"  {json.dumps(frame, allow_nan=False)}" for frame in content["frames"])
    rest = {key: value for key, value in content.items() if key != "frames"}
    head = "".join(f" {json.dumps(key)}: {json.dumps(value, allow_nan=False)},\n" for key, value in rest.items())
    return f'{{\n{head} "frames": [\n{frames}\n ]\n}}\n'


def document(
    cameras: Iterable[Camera],
    aabb_scale: int | None = None,
    more: Mapping[str, Any] | None = None,
    of_frames: Iterable[Mapping[str, Any]] | None = None,
) -> dict[str, Any]:
    """The content of the file, frames in the order of the cameras.

    aabb_scale : the size, in unit cubes, of the box in which instant-ngp looks for the scene. Left out if None.
    more : further keys at the top.
    of_frames : further keys of each frame.

    Raises InputError if there is no camera, two have one picture, one is mirrored or some but not all have a fisheye, or if the
    scale is not one that instant-ngp takes.
    """
    cameras = naming.checked(cameras, FILE)
    if aabb_scale is not None and checks.whole("aabb_scale", aabb_scale) not in AABB_SCALES:
        raise InputError(f"aabb_scale is {aabb_scale}: give a power of two from 1 to {AABB_SCALES[-1]}")
    pictures = [_picture(camera.pinhole) | _said_of(camera) for camera in cameras]
    models = {str(picture.get("camera_model")): camera.name for picture, camera in zip(pictures, cameras, strict=True)}
    fisheye = models.pop(_FISHEYES[0], None)
    if fisheye is not None and models:
        raise InputError(
            f"{FILE} has one camera_model for all pictures, and {checks.quoted(fisheye)} has a fisheye's where "
            f"{checks.quoted(next(iter(models.values())))} has none: write each kind into a file of its own"
        )
    shared = all(picture == pictures[0] for picture in pictures)
    # At the top in any case: nerfstudio looks for it there alone.
    model = next((picture["camera_model"] for picture in pictures if "camera_model" in picture), None)
    return {
        **({} if model is None else {"camera_model": model}),
        **(pictures[0] if shared else {}),
        **({} if aabb_scale is None else {"aabb_scale": int(aabb_scale)}),
        **(more or {}),
        "frames": [
            {
                "file_path": naming.image_of(camera),
                **keys,
                **({} if shared else picture),
                "transform_matrix": axes.camera_to_world(camera.pinhole),
                own.KEY: own.document(camera.pinhole),
            }
            for camera, picture, keys in zip(cameras, pictures, of_frames or [{}] * len(cameras), strict=True)
        ],
    }


def _said_of_world(cameras: Sequence[Camera]) -> dict[str, Any]:
    """The keys for what was done to the world that the cameras were read in, as nerfstudio has them: p′ = scale (R p + t)."""
    worlds = {camera.world for camera in cameras}
    if len(worlds) != 1 or (world := worlds.pop()) is None:
        return {}
    rows = np.array(world)
    scale = float(np.cbrt(np.linalg.det(rows[:, :3])))
    keys = {"applied_transform": (rows / scale + 0.0).tolist()}
    return keys | ({} if abs(scale - 1) < 2.0**-40 else {"applied_scale": scale})


def _said_of(camera: Camera) -> dict[str, Any]:
    """The camera's lens, as nerfstudio has it, and by which key instant-ngp knows a fisheye, whose k3 is else taken for p1."""
    lens = camera.lens
    if lens is None:
        return {}
    numbers = dict(zip(("k1", "k2", "k3", "k4"), (*lens.radial, *[0.0] * 4), strict=False))
    tangential = dict(zip(("p1", "p2"), lens.tangential, strict=True))
    if lens == distortion.fisheye(numbers):
        return {"camera_model": _FISHEYES[0], "is_fisheye": True, **numbers}
    if lens == distortion.opencv(numbers | tangential | {"r8": numbers["k4"], "k4": 0.0}):
        return {"camera_model": "OPENCV", **numbers, **tangential}
    raise InputError(
        f"{FILE} has no model of the lens of {camera.name}: undistort the pictures, or choose to take it without distortion"
    )


def _picture(pinhole: Pinhole) -> dict[str, float]:
    (fl_x, _, cx), (_, fl_y, cy), _ = axes.intrinsics(pinhole)
    return {
        "camera_angle_x": 2 * math.atan2(pinhole.width / 2, fl_x),
        "camera_angle_y": 2 * math.atan2(pinhole.height / 2, fl_y),
        "fl_x": fl_x,
        "fl_y": fl_y,
        "cx": cx,
        "cy": cy,
        "w": pinhole.width,
        "h": pinhole.height,
    }


def _files(source: Source) -> list[Source]:
    """The file itself; of a folder its transforms.json, or the original NeRF's transforms_train.json and its like."""
    files = [source]
    if source.is_folder:
        files = [file] if (file := source.file(FILE)) else [*source.files("transforms_*.json")]
    return [file for file in files if _is_ours(file)]


def _document(source: Source) -> Mapping[str, Any]:
    """The JSON object; of a list of frames, as nerfstudio's `ns-export cameras` writes it, one with these."""
    if not isinstance(source.json, list):
        return source.document
    exported = {"transform": "transform_matrix"}
    return {
        "frames": [
            {exported.get(key, key): value for key, value in frame.items()} if isinstance(frame, dict) else frame
            for frame in source.json
        ]
    }


def listed(document: Mapping[str, Any]) -> Any:
    """The frames as they stand there, with those that ScanNet++ keeps apart for tests."""
    frames, others = document.get("frames"), document.get(_TESTS)
    return [*frames, *others] if isinstance(frames, list) and isinstance(others, list) else frames


def _is_ours(source: Source) -> bool:
    document = _document(source)
    frames = document.get("frames")
    if isinstance(frames, list | dict) and any(key in document for key in _TELLING):
        return True  # whatever its frames lack is said
    first = frames[0] if isinstance(frames, list) and frames else None
    return isinstance(first, dict) and any(key in first for key in _POSES)


def _cameras(source: Source, options: Options) -> list[Camera]:
    document = _document(source)
    top = Record({key: value for key, value in document.items() if key != _TESTS} | {"frames": listed(document)}, source.name)
    frames = top.records("frames", "frame")
    paths = [frame.text("file_path", f"frame {i}").replace("\\", "/") for i, frame in enumerate(frames)]
    undone = _applied(top) if options.original_world else None
    world_notes = () if options.original_world else _told_of_world(top)
    planes: dict[object, tuple[ViewPlane, bool, distortion.Lens | None, tuple[str, ...]]] = {}
    left_out, cameras = LeftOut(), []
    for frame, path, name in zip(frames, paths, naming.distinct(paths), strict=True):
        both = _merged(top, frame)
        known = tuple((key, str(value)) for key, value in frame.values.items() if key not in ("file_path", own.KEY, *_POSES))
        key = known if "w" in both and "h" in both else (known, path)
        with left_out.unless_pinhole(name):
            if key not in planes:
                planes[key] = _plane(both, source, path, options)
            plane, stated, lens, notes = planes[key]
            matrix = _matrix(frame)
            pinhole, more = axes.pinhole(matrix if undone is None else undone(matrix), plane, frame.place)
            image = path if naming.has_suffix(path) or "file_path" not in frame else f"{path}.png"
            time = frame.number("time") if "time" in frame else None
            named = image if "file_path" in frame else None
            cameras.append(Camera(name, pinhole, stated, (*world_notes, *notes, *more), named, time=time, lens=lens))
    return left_out.with_notes(cameras)


def _merged(top: Record, frame: Record) -> Record:
    """The frame's keys and those at the top, which must not contradict each other."""
    for key in (*_INTRINSICS, *_LENS, "distortion_params", "camera_model", "is_fisheye", *_OTHER_CAMERAS):
        if key in top and key in frame and top.get(key) != frame.get(key):
            raise InputError(
                f"{key} is {checks.quoted(top.get(key))} at the top of the file and {checks.quoted(frame.get(key))} in "
                f"{frame.place}, and programs differ in which of them counts: take one out"
            )
    shared = {key: value for key, value in top.values.items() if key != "frames" and value is not None}
    return Record(shared | {key: value for key, value in frame.values.items() if value is not None}, frame.place)


_FOCAL = {"x": ("fl_x", "x_fov", "camera_angle_x"), "y": ("fl_y", "y_fov", "camera_angle_y")}
_INTRINSICS = ("w", "h", "cx", "cy", *_FOCAL["x"], *_FOCAL["y"])


def _plane(
    both: Record, source: Source, path: str, options: Options
) -> tuple[ViewPlane, bool, distortion.Lens | None, tuple[str, ...]]:
    """The view plane, whether its size is the file's, the lens, and notes."""
    for key in ("camera_model", "camera_type"):
        model = both.values.get(key)
        if model is not None and str(model).upper() not in (*_PINHOLES, *_FISHEYES):
            not_a_pinhole(both.place, f"of the {key.replace('_', ' ')} {checks.quoted(model)}")
    is_fisheye = any(str(both.values.get(key)).upper() in _FISHEYES for key in ("camera_model", "camera_type"))
    is_fisheye |= bool(both.values.get("is_fisheye"))
    if unread := next((key for key in both.values if key.lower() in _NOT_READ), None):
        raise InputError(
            f"{both.place} has {unread}, which programs read differently: write fl_x, fl_y, cx and cy in its place"
        )
    for key in _OTHER_CAMERAS:
        if both.values.get(key) or (both.values.get(key) == 0.0 and key == "ftheta_p0"):
            not_a_pinhole(both.place, f"a camera with {key}")
    convention = both.get("camera_convention")
    if convention is not None and str(convention).lower() not in _AXES:
        raise InputError(
            f"{both.place} has the camera_convention {checks.quoted(convention)}: write its matrices in opengl's axes"
        )
    for key in _OTHER_AXES:
        if both.values.get(key):
            raise InputError(
                f"{both.place} has {key}, by which the camera's axes are others: write its matrix in OpenGL's axes"
            )
    size, stated = _size(both, source, path, options)
    focal = {along: _focal(both, along, side) for along, side in zip("xy", size, strict=True)}
    f_x, f_y = focal["x"] or focal["y"], focal["y"] or focal["x"]
    if not f_x or not f_y:
        return options.plane_or_refuse(both.place), False, None, ()
    c_x, c_y = both.number("cx", size[0] / 2), both.number("cy", size[1] / 2)
    opencv.refuse_widths(f_x, f_y, c_x, c_y, size, both.place)
    plane = axes.view_plane(f_x, f_y, c_x, c_y, size)
    numbers = {key: both.number(key, 0.0) for key in _LENS}
    if "distortion_params" in both:
        numbers = dict(zip(_LENS, both.numbers("distortion_params", 6), strict=True))
    brown = numbers | {"k4": 0.0, "r8": numbers["k4"]}
    lens = distortion.fisheye(numbers) if is_fisheye else distortion.opencv(brown, numbers)
    return plane, stated, *distortion.settle(lens, plane, both.place, options.without_distortion)


def _size(both: Record, source: Source, path: str, options: Options) -> tuple[tuple[int, int], bool]:
    if "w" in both and "h" in both:
        return (both.size("w"), both.size("h")), True
    if source.path:
        for name in (path, f"{path}.png", f"{path}.jpg"):
            if size := image_size(source.path.parent / name):
                return size, True
    size = options.size_or_refuse(both.place)
    for key, side in zip("wh", size, strict=True):
        if key in both and both.size(key) != side:
            raise InputError(
                f"{both.place} has {key} {both.get(key)} and the size is given as {size[0]} × {size[1]}: give its own"
            )
    return size, False


def _focal(both: Record, along: str, side: int) -> float | None:
    """The distance in pixels; all that say it must agree."""
    length, degrees, radians = _FOCAL[along]
    focal: dict[str, float] = {}
    if length in both:
        focal[length] = both.number(length, least=1e-9)
    for key, factor in ((degrees, math.pi / 180), (radians, 1.0)):
        if key in both:
            angle = both.number(key) * factor
            if not _LEAST_ANGLE < angle < math.pi:
                raise InputError(f"{key} of {both.place} is {both.get(key)}: give an angle between 0 and half a turn")
            focal[key] = side / 2 / math.tan(angle / 2)
    values = [*focal.values()]
    if values and max(values) > min(values) * (1 + _SAME_FOCAL):
        sentence = " and ".join(f"{key} means {value:.6g} pixels" for key, value in focal.items())
        raise InputError(f"{both.place} contradicts itself: {sentence}; take the wrong one out, or give the right w and h")
    return values[0] if values else None


def _matrix(frame: Record) -> np.ndarray:
    start, end = frame.values.get("transform_matrix_start"), frame.values.get("transform_matrix_end")
    if start is not None and end is not None and start != end:
        not_a_pinhole(frame.place, "a camera that moves while it exposes (transform_matrix_start and _end)")
    key = next(key for key in (*_POSES, "transform_matrix") if key in frame or key == "transform_matrix")
    rows = frame.needed(key)
    numbers = checks.array(frame.called(key), rows)
    if numbers.shape not in ((4, 4), (3, 4)):
        raise InputError(f"{frame.called(key)} has the shape {numbers.shape}: give four rows of four numbers")
    if any(isinstance(each, bool) for row in rows for each in row):
        raise InputError(f"{frame.called(key)} is {checks.quoted(rows)}: give numbers, not true or false")
    return numbers


def _told_of_world(top: Record) -> tuple[str, ...]:
    if "applied_transform" not in top and "applied_scale" not in top:
        return ()
    return ("The file says that its world was turned or scaled before (applied_transform): it was left so",)


def _applied(top: Record) -> Callable[[np.ndarray], np.ndarray]:
    """The function that takes a matrix back into the world before `applied_transform` and `applied_scale`."""
    applied = np.eye(4)
    if "applied_transform" in top:
        rows = top.values["applied_transform"]
        numbers = np.array(top.numbers("applied_transform", 16 if isinstance(rows, list) and len(rows) in (4, 16) else 12))
        applied[:3] = numbers.reshape(-1, 4)[:3]
    if abs(np.linalg.det(applied)) < 1e-12:
        raise InputError("the applied_transform can't be undone: its determinant is 0")
    scale, inverse = top.number("applied_scale", 1.0, 1e-12), np.linalg.inv(applied)

    def undone(matrix: np.ndarray) -> np.ndarray:
        matrix = np.vstack([matrix[:3], [0, 0, 0, 1]])
        matrix[:3, 3] /= scale
        return inverse @ matrix

    return undone
