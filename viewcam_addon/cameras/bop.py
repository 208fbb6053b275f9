"""BOP's scene_camera.json: K for each image of a scene and, where the scene has a world, its pose; and camera.json, K alone.

World to camera, x right, y down, z into the view, in **millimeters**, whose numbers stay unless a scale is chosen (0.001 makes
meters). BOP's toolkit puts (0, 0) at the center of the first pixel. The size is that of the pictures in rgb/ or gray/, of the
data set's camera.json, or given; those of scene_camera_cam1.json are in rgb_cam1/, gray_cam1/ or cam1/. Without a pose the
camera stands at the origin: BOP's objects are posed to the camera then.

Source: bop_toolkit's docs/bop_datasets_format.md and bop_toolkit_lib/misc.py (depth_im_to_dist_im).
"""

import json
from collections.abc import Sequence

import numpy as np

from . import axes, naming, opencv, own
from .camera import Camera, LeftOut, Options
from .source import Record, Source, image_size, pixels

TITLE = "BOP scene_camera.json and camera.json"
SUFFIX = ".json"
FILE = "scene_camera.json"

_FOLDERS = ("rgb", "gray")
_OF_SENSOR = {"fx", "fy", "cx", "cy", "width", "height", "depth_scale"}
_UNITS = "BOP counts in millimeters: a scale of 0.001 makes them meters"
_NO_WORLD = "The scene has no world: the camera stands at the origin and looks along z, y down"


def recognizes(source: Source) -> bool:
    return _document(source) is not None or source.document.keys() >= _OF_SENSOR


def read(source: Source, options: Options) -> list[Camera]:
    if source.document.keys() >= _OF_SENSOR:
        return [_of_sensor(source, options)]
    if (source_of_all := _document(source)) is None:
        return []
    source, left_out, cameras = source_of_all, LeftOut(), []
    for number, values in source.document.items():
        with left_out.unless_pinhole(str(number)):
            cameras.append(_of_image(source, number, Record(values, f"image {number}"), options))
    return left_out.with_notes(cameras)


def _of_image(source: Source, number: str, image: Record, options: Options) -> Camera:
    name, size, stated = _picture(source, number, image, options)
    plane = opencv.plane_of_k(image.numbers("cam_K", 9), size, opencv.half_pixel(options), image.place)
    notes = (*opencv.told_of_half_pixel(options, "BOP"), *(() if options.scale != 1 else (_UNITS,)))
    turn, translation = np.eye(3), (0.0, 0.0, 0.0)
    if "cam_R_w2c" in image or "cam_t_w2c" in image:
        turn = np.array(image.numbers("cam_R_w2c", 9)).reshape(3, 3)
        x, y, z = image.numbers("cam_t_w2c", 3)
        translation = x, y, z
    else:
        notes += (_NO_WORLD,)
    pinhole, more = axes.pinhole(axes.from_world_to_camera(turn, translation, image.place), plane, image.place)
    return Camera(str(number), pinhole, stated, (*notes, *more), name)


def notes_in(source: Source) -> list[str]:
    return [document.text] if (document := _document(source)) else []


def _of_sensor(source: Source, options: Options) -> Camera:
    values = Record(source.document, source.name)
    k = [values.number(key) for key in ("fx", "fy", "cx", "cy")]
    plane = opencv.plane_of_k(k, (values.size("width"), values.size("height")), opencv.half_pixel(options), source.name)
    matrix = axes.from_world_to_camera(np.eye(3), (0.0, 0.0, 0.0), source.name)
    pinhole, _ = axes.pinhole(matrix, plane, source.name)
    notes = (*opencv.told_of_half_pixel(options, "BOP"), _NO_WORLD)
    return Camera(source.path.stem if source.path else "camera", pinhole, True, notes)


def write(cameras: Sequence[Camera], options: Options) -> str:
    naming.refuse_mirrored(cameras, FILE)
    half = opencv.half_pixel(options)
    lines = []
    for number, camera in enumerate(cameras):
        (f_x, _, c_x), (_, f_y, c_y), _ = axes.intrinsics(camera.pinhole)
        rows = axes.world_to_camera(camera.pinhole)[:3]
        document = {
            "cam_K": [f_x, 0.0, c_x - half, 0.0, f_y, c_y - half, 0.0, 0.0, 1.0],
            "cam_R_w2c": [part for row in rows for part in row[:3]],
            "cam_t_w2c": [row[3] for row in rows],
            "depth_scale": 1.0,
            own.KEY: own.document(camera.pinhole),
        }
        lines.append(f' "{number}": {json.dumps(document)}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _document(source: Source) -> Source | None:
    file = source.file(FILE) if source.is_folder else source
    first = next(iter(file.document.values()), None) if file else None
    return file if isinstance(first, dict) and "cam_K" in first else None


def _picture(source: Source, number: str, image: Record, options: Options) -> tuple[str | None, tuple[int, int], bool]:
    if source.path and number.isdecimal():
        sensor = source.path.stem.removeprefix("scene_camera")
        for folder in (*(f"{each}{sensor}" for each in _FOLDERS), sensor[1:] or _FOLDERS[0]):
            for suffix in ("png", "jpg", "tif"):
                name = f"{folder}/{int(number):06d}.{suffix}"
                if size := image_size(source.path.parent / name):
                    return name, size, True
        for up in ("..", "../.."):
            of_all = source.file(*up.split("/"), "camera.json")
            if of_all and {"width", "height"} <= of_all.document.keys():
                width, height = (pixels(key, of_all.document[key]) for key in ("width", "height"))
                return None, (width, height), True
    return None, options.size_or_refuse(image.place), False
