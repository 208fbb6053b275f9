"""OpenSfM's reconstruction.json, of Mapillary, OpenDroneMap and WebODM: cameras, and shots that were taken with them.

A shot's `rotation` is a vector along the axis, as long as the angle in radians, and with `translation` it takes the world to
the camera: x right, y down, z into the view. A camera counts in the longer side of its picture, from the middle: `focal`, or
`focal_x`, `focal_y`, `c_x`, `c_y`. Its lens is OpenCV's, or the fisheye's.

Source: OpenSfM's doc/source/geometry.rst, by which the middle is (w − 1)/2 from the first pixel's center, and opensfm/io.py
(camera_from_json, shot_from_json).
"""

from .. import checks
from ..errors import InputError
from ..pinhole import ViewPlane
from . import axes, distortion, naming, opencv
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Record, Source

TITLE = "reconstruction.json of OpenSfM (OpenDroneMap, Mapillary)"
FILE = "reconstruction.json"

_BROWN = ("k1", "k2", "k3", "p1", "p2")
_LENSES = {
    "perspective": ("k1", "k2"),
    "brown": _BROWN,
    "fisheye": ("k1", "k2"),
    "fisheye_opencv": ("k1", "k2", "k3", "k4"),
    "simple_radial": ("k1",),
    "radial": ("k1", "k2"),
}


def recognizes(source: Source) -> bool:
    return bool(_reconstructions(source))


def _reconstructions(source: Source) -> list[dict]:
    file = source.file(FILE) if source.is_folder else source
    entries = file.json if file and isinstance(file.json, list) else []
    return [each for each in entries if isinstance(each, dict) and {"cameras", "shots"} <= each.keys()]


def read(source: Source, options: Options) -> list[Camera]:
    reconstructions = _reconstructions(source)
    notes = (
        (f"Of {len(reconstructions)} reconstructions the first was taken: each has a world of its own",)
        if len(reconstructions) > 1
        else ()
    )
    top = Record(reconstructions[0], source.name)
    cameras = top.record("cameras")
    shots = top.record("shots")
    if not shots.values:
        raise InputError(f"{source.name} has no shots: let OpenSfM reconstruct it first")
    planes: dict[str, tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]] = {}
    left_out, result = LeftOut(), []
    for path, name in zip(shots.values, naming.distinct([*shots.values]), strict=True):
        shot = Record(shots.values[path], f"shot {checks.quoted(path)}")
        with left_out.unless_pinhole(name):
            key = shot.text("camera")
            if key not in planes:
                planes[key] = _plane(Record(cameras.needed(key), f"camera {checks.quoted(key)}"), options)
            plane, lens, of_lens = planes[key]
            turn = opencv.of_rotation_vector(shot.numbers("rotation", 3), shot.place)
            matrix = axes.from_world_to_camera(turn, shot.numbers("translation", 3), shot.place)
            pinhole, more = axes.pinhole(matrix, plane, shot.place)
            result.append(Camera(name, pinhole, True, (*notes, *of_lens, *more), path, lens=lens))
    return left_out.with_notes(result)


def _plane(camera: Record, options: Options) -> tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]:
    kind = camera.text("projection_type", "perspective")
    if kind not in _LENSES:
        not_a_pinhole(camera.place, f"of the type {checks.quoted(kind)}")
    width, height = size = camera.size("width"), camera.size("height")
    longer = max(size)
    f_x = camera.number("focal_x" if "focal_x" in camera else "focal", least=1e-9)
    f_y = camera.number("focal_y", f_x, 1e-9)
    c_x, c_y = camera.number("c_x", 0.0), camera.number("c_y", 0.0)
    plane = axes.view_plane(f_x * longer, f_y * longer, width / 2 + c_x * longer, height / 2 + c_y * longer, size)
    numbers = {name: camera.number(name, 0.0) for name in _LENSES[kind]}
    lens = distortion.fisheye(numbers) if kind.startswith("fisheye") else distortion.opencv(numbers)
    return plane, *distortion.settle(lens, plane, camera.place, options.without_distortion)
