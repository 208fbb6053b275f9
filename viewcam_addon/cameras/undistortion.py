"""Photographs without their lens: the pinhole that is cut from what a lens shows, and its picture, masks and depth maps.

The pinhole's focal length and axis are the lens's own; its size is COLMAP's choice, by how much of the picture may stay empty.
Pixels are interpolated between the four nearest in float64; masks and depths are the nearest one, since what lies between two
objects is neither. OpenCV decodes and encodes files: 8 and 16 bits, colors and alpha as they are.

Rejected: `cv2.remap`, whose places are whole 32nds of a pixel.

Source: COLMAP's src/colmap/image/undistortion.cc and warp.cc.
"""

import dataclasses
import importlib
import importlib.util
import io
import math
import shutil
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np

from .. import npy
from ..errors import InputError, several
from ..files import read_bytes, written_whole
from ..pinhole import ViewPlane
from ..terminal import silent_libraries
from . import colmap, naming, transforms
from .camera import Camera
from .distortion import Lens
from .source import Source

FORMS = ("transforms", "colmap")
_SCALES = (0.2, 2.0)  # shares of the picture's sides, at least and at most: COLMAP's
_BAND = 2**20  # pixels that are computed at a time
_IN_CACHE = 2**13  # places that are computed again and again at once: twice as fast
_FOLDERS = {"mask_path": "masks", "depth_file_path": "depths"}  # by the keys of a frame


@lru_cache(maxsize=64)
def undistorted(lens: Lens, plane: ViewPlane, blank: float = 0.0) -> ViewPlane:
    """The view plane of the picture without the lens, as large as COLMAP makes it.

    plane : the photograph's view plane.
    blank : 0 to leave no pixel empty, 1 to cut off none of the photograph's; between them some of both.

    Raises InputError if the photograph's border shows nothing that lies before the camera.
    """
    (d_x, d_y), (c_x, c_yb), width, height = plane.distance, plane.principal_point, plane.width, plane.height
    c_y = height - c_yb
    columns, rows = np.arange(width) + 0.5, np.arange(height) + 0.5

    def border(x: Any, y: Any, along: int) -> tuple[float, float]:
        """The least and the largest x or y of the pinhole's points that one side of the photograph shows, in pixels."""
        points = np.stack(np.broadcast_arrays((x - c_x) / d_x, (y - c_y) / d_y), axis=-1)
        places = lens.undistort(points)[:, along] * (d_x, d_y)[along] + (c_x, c_y)[along]
        places = places[np.isfinite(places)]
        if not len(places):
            raise InputError("a side of the photograph shows nothing that lies before the camera: crop the photograph")
        return float(places.min()), float(places.max())

    scales = []
    sides = (
        (c_x, width, border(0.5, rows, 0), border(width - 0.5, rows, 0)),
        (c_y, height, border(columns, 0.5, 1), border(columns, height - 0.5, 1)),
    )
    for center, size, (first_least, first_most), (last_least, last_most) in sides:
        if not (first_most < center < last_least and 0 < center < size - 0.5):
            raise InputError("the photograph's middle lies outside of what its lens shows: no picture can be cut from it")
        whole = min(center / (center - first_least), (size - 0.5 - center) / (last_most - center))
        filled = max(center / (center - first_most), (size - 0.5 - center) / (last_least - center))
        scales.append(min(max(1 / (whole * blank + filled * (1 - blank)), _SCALES[0]), _SCALES[1]))
    new_width, new_height = (int(max(1.0, scale * size)) for scale, size in zip(scales, (width, height), strict=True))
    new_c_y = c_y * new_height / height
    return ViewPlane(plane.distance, (c_x * new_width / width, new_height - new_c_y), new_width, new_height)


@lru_cache(maxsize=1)
def places(lens: Lens, plane: ViewPlane, cut: ViewPlane) -> np.ndarray:
    """The places in the photograph at which the centers of the undistorted picture's pixels are seen.

    plane : the photograph's view plane.
    cut : the undistorted picture's view plane.

    Returns (rows, columns, 2), from the corner, y down; NaN where the lens shows none.
    """
    middle = np.array([plane.principal_point[0], plane.height - plane.principal_point[1]])
    columns = (np.arange(cut.width) + 0.5 - cut.principal_point[0]) / cut.distance[0]
    down = (np.arange(cut.height) + 0.5 - (cut.height - cut.principal_point[1])) / cut.distance[1]
    pixels = np.empty((cut.height, cut.width, 2))
    for rows in _bands(cut):
        points = np.stack(np.meshgrid(columns, down[rows]), axis=-1)
        pixels[rows] = lens.distort(points) * plane.distance + middle
        pixels[rows][lens.folds(points)] = np.nan
    return pixels


@lru_cache(maxsize=1)
def points(lens: Lens, plane: ViewPlane, place: tuple[float, float] = (0.5, 0.5)) -> np.ndarray:
    """The pinhole's points that the centers of the photograph's pixels show, or another place in each.

    plane : the photograph's view plane.
    place : the place in a pixel, from its upper left corner.

    Returns (rows, columns, 2), in the view plane at distance 1, y down, rows from the top; NaN where none is.
    """
    middle = np.array([plane.principal_point[0], plane.height - plane.principal_point[1]])
    result = np.empty((plane.height, plane.width, 2))
    columns, down = np.arange(plane.width) + place[0], np.arange(plane.height) + place[1]
    for rows in _bands(plane, _IN_CACHE):
        result[rows] = lens.undistort((np.stack(np.meshgrid(columns, down[rows]), axis=-1) - middle) / plane.distance)
    return result


def places_back(lens: Lens, plane: ViewPlane, cut: ViewPlane) -> np.ndarray:
    """The places in the pinhole's picture at which the centers of the photograph's pixels are seen.

    plane : the photograph's view plane.
    cut : the undistorted picture's view plane.

    Returns (rows, columns, 2), from the corner, y down; NaN where none is.
    """
    return points(lens, plane) * cut.distance + (cut.principal_point[0], cut.height - cut.principal_point[1])


def _bands(cut: ViewPlane, at_once: int = _BAND) -> list[slice]:
    step = max(1, at_once // cut.width)
    return [slice(start, min(start + step, cut.height)) for start in range(0, cut.height, step)]


def st_maps(lens: Lens, plane: ViewPlane, cut: ViewPlane) -> tuple[np.ndarray, np.ndarray]:
    """The maps by which compositors take a lens off a photograph and put it on a pinhole's picture.

    plane : the photograph's view plane.
    cut : the undistorted picture's view plane.

    Returns two maps, (rows, columns, 4) float32, rows from the top. The first has the undistorted picture's size and says where
    in the photograph each pixel is, the second the other way round: s from the left and t from the **bottom**, 0 … 1 from edge
    to edge, then 0 and 1. All four are 0 where a pixel is not in the other picture; a margin of a pixel around that counts as
    in it, since sizes are whole numbers.
    """
    return _st(places(lens, plane, cut), plane), _st(places_back(lens, plane, cut), cut)


def _st(pixels: np.ndarray, other: ViewPlane) -> np.ndarray:
    """A map of places in another picture, in its pixels from the top left."""
    shares = pixels / (other.width, other.height)
    with np.errstate(invalid="ignore"):
        within = (np.abs(shares - 0.5) <= 0.5 + 1 / np.array([other.width, other.height])).all(axis=-1)
    result = np.zeros((*pixels.shape[:2], 4), np.float32)
    result[within, 0], result[within, 1], result[within, 3] = shares[within, 0], 1 - shares[within, 1], 1
    return result


def straight(cameras: Sequence[Camera], blank: float) -> list[Camera]:
    """The cameras as pinholes, whose pictures are as large as `undistorted` makes them."""
    result = []
    for camera in cameras:
        pinhole = camera.pinhole
        if camera.lens is not None:
            pinhole = dataclasses.replace(pinhole, **vars(undistorted(camera.lens, pinhole.plane, blank)))
        result.append(dataclasses.replace(camera, pinhole=pinhole, lens=None))
    return result


def of_screen(photograph: np.ndarray, lens: Lens, plane: ViewPlane, widest: int) -> np.ndarray:
    """The photograph as its pinhole shows it: the same focal length, axis and sides, but no more pixels than a screen has.

    photograph : rows from the top, of floats.
    plane : its own view plane.
    widest : pixels along the longer side, at most.
    """
    times = math.ceil(max(plane.width, plane.height) / widest)
    width, height = plane.width // times, plane.height // times
    blocks = photograph[: height * times, : width * times].reshape(height, times, width, times, -1)
    small = _smaller(plane, plane.width / times, plane.height / times, width, height)
    # The width is chosen whose height is nearest to a whole number: a picture is shown by its aspect.
    aspect = plane.height / plane.width
    cut_width = min(range(width, max(1, width * 3 // 4), -1), key=lambda across: abs(across * aspect - round(across * aspect)))
    cut_height = max(1, round(cut_width * aspect))
    return resampled(blocks.mean(axis=(1, 3)), lens, small, _smaller(plane, cut_width, cut_height, cut_width, cut_height))


def _smaller(plane: ViewPlane, across: float, down: float, width: int, height: int) -> ViewPlane:
    """The view plane whose picture has `across` × `down` pixels where this one has all of its own, cut to a size."""
    (d_x, d_y), (c_x, c_y) = plane.distance, plane.principal_point
    x, y = across / plane.width, down / plane.height
    return ViewPlane((d_x * x, d_y * y), (c_x * x, height - (plane.height - c_y) * y), width, height)


def resampled(photograph: np.ndarray, lens: Lens, plane: ViewPlane, cut: ViewPlane, nearest: bool = False) -> np.ndarray:
    """The picture without the lens, black where the photograph has nothing.

    photograph : (height, width) or (height, width, channels), rows from the top.
    nearest : true to take the nearest pixel's number, as for masks and depths.
    """
    picture = np.zeros((cut.height, cut.width, *photograph.shape[2:]), photograph.dtype)
    pixels = places(lens, plane, cut)
    for rows in _bands(cut):
        picture[rows] = looked_up(photograph, pixels[rows], nearest)
    return picture


def looked_up(photograph: np.ndarray, at: np.ndarray, nearest: bool = False) -> np.ndarray:
    """The picture's colors at places in it, of its own type; black beside it.

    photograph : see `resampled`.
    at : (..., 2), from the corner, y down; NaN is beside it.
    nearest : see `resampled`.
    """
    result = np.zeros((*at.shape[:-1], *photograph.shape[2:]), photograph.dtype)
    limits = np.array(photograph.shape[1::-1])
    at = at if nearest else at - 0.5
    with np.errstate(invalid="ignore"):
        seen = ((at >= 0) & (at < limits if nearest else at <= limits - 1)).all(axis=-1)
    x, y = at[seen].T
    if nearest:
        result[seen] = photograph[y.astype(int), x.astype(int)]
        return result
    left, top = (np.minimum(np.floor(each).astype(int), limit - 2) for each, limit in zip((x, y), limits, strict=True))
    across, down = ((each - least).reshape(-1, *[1] * (photograph.ndim - 2)) for each, least in ((x, left), (y, top)))
    upper, lower = ((1 - across) * photograph[row, left] + across * photograph[row, left + 1] for row in (top, top + 1))
    mixed = (1 - down) * upper + down * lower
    result[seen] = np.rint(mixed) if photograph.dtype.kind == "u" else mixed
    return result


def save(cameras: Sequence[Camera], dataset: Path, out: Path, form: str, blank: float = 0.0) -> list[Camera]:
    """Write the undistorted pictures of a data set, and its cameras as pinholes; returns these.

    dataset : the file or folder of which the cameras were read, near which their pictures are.
    out : a folder, new or empty.
    form : one of FORMS: transforms.json with masks and depth maps, or sparse/0 with COLMAP's points, beside images/.

    Raises InputError if OpenCV is missing, a picture is not there or of another size than its camera, or the folder is not
    empty.
    """
    if importlib.util.find_spec("cv2") is None:
        raise InputError("pictures are read and written by OpenCV: pip install opencv-python-headless")
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InputError(f"{out} is there and not an empty folder: give a new one")
    naming.checked(cameras, "a data set")
    try:
        return _save(cameras, dataset, out, form, blank)
    except BaseException:
        shutil.rmtree(out, ignore_errors=True)
        raise


def _save(cameras: Sequence[Camera], dataset: Path, out: Path, form: str, blank: float) -> list[Camera]:
    folder = dataset if dataset.is_dir() else dataset.parent
    beside = _beside(dataset, cameras)
    files = [naming.picture_of(camera, folder) for camera in cameras]
    if missing := [naming.image_of(camera) for camera, file in zip(cameras, files, strict=True) if file is None]:
        raise InputError(f"{several(missing)} can't be found beside {dataset} nor in images/: put the pictures there")
    written, frames = [], []
    for camera, pinhole, file, others in zip(cameras, straight(cameras, blank), files, beside, strict=True):
        name = naming.image_of(camera).removeprefix("images/")
        targets = {key: Path(_FOLDERS[key], name).with_suffix(other.suffix) for key, other in others.items()}
        for source, target in ((file, Path("images", name)), *((others[key], targets[key]) for key in others)):
            _convert(cast(Path, source), out / target, camera, pinhole.pinhole.plane, nearest=source is not file)
        frames.append({key: target.as_posix() for key, target in targets.items()})
        written.append(dataclasses.replace(pinhole, image=f"images/{name}" if form == "transforms" else name))
    if form == "transforms":
        document = transforms.document(written)
        if (scale := _depth_scale(dataset)) is not None:
            document = {"depth_unit_scale_factor": scale} | document
        document["frames"] = [frame | more for frame, more in zip(document["frames"], frames, strict=True)]
        texts = {transforms.FILE: transforms.text(document)}
    else:
        texts = {f"sparse/0/{name}": text for name, text in colmap.texts(written).items()}
        texts["sparse/0/points3D.txt"] += colmap.points_without_tracks(Source(dataset))
    for name, text in texts.items():
        with written_whole(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")
    return written


def _depth_scale(dataset: Path) -> float | None:
    """The scale of the depth maps that transforms.json says, None where it says none."""
    scale = _document(dataset).get("depth_unit_scale_factor")
    return scale if isinstance(scale, int | float) else None


def _document(dataset: Path) -> Mapping[str, Any]:
    """The content of the data set's transforms.json; empty where there is none."""
    file = dataset / transforms.FILE if dataset.is_dir() else dataset
    return Source(file).document if file.is_file() and file.suffix == ".json" else {}


def _beside(dataset: Path, cameras: Sequence[Camera]) -> list[dict[str, Path]]:
    """The masks and depth maps of the cameras' pictures, by the keys that transforms.json has for them.

    They are those that it names; of another data set the masks in masks/, called as the pictures, with .png added or in place
    of their suffix.
    """
    folder = dataset if dataset.is_dir() else dataset.parent
    listed = transforms.listed(_document(dataset))
    frames = {str(frame.get("file_path")): frame for frame in listed or () if isinstance(frame, dict)}
    result = []
    for camera in cameras:
        name = naming.inside(naming.image_of(camera))
        beside: dict[str, Path] = {}
        for key in _FOLDERS:
            path = frames.get(camera.image or "", {}).get(key)
            if isinstance(path, str):
                if (near := naming.near(path, folder)) is None:
                    raise InputError(f"{path} of {name} is not beside {dataset}: put it there, or take it out of the file")
                beside[key] = near
        masks = (naming.near(f"masks/{each}.png", folder) for each in (name, name.rpartition(".")[0]))
        if not frames and (mask := next(filter(None, masks), None)):
            beside["mask_path"] = mask
        result.append(beside)
    return result


def _convert(file: Path, target: Path, camera: Camera, cut: ViewPlane, nearest: bool) -> None:
    """Write the file's picture, numbers of .npy among them, without the camera's lens; a copy where there is none."""
    data = read_bytes(file)
    if camera.lens is not None:
        pixels = _decoded(data, file)
        plane = camera.pinhole.plane
        if pixels.shape[1::-1] != (plane.width, plane.height):
            sizes = f"{pixels.shape[1]} × {pixels.shape[0]} pixels and its camera {plane.width} × {plane.height}"
            raise InputError(f"{file} has {sizes}: give the pictures that the cameras were calibrated with")
        data = _encoded(resampled(pixels, camera.lens, plane, cut, nearest), file)
    with written_whole(target) as temporary:
        temporary.write_bytes(data)


def _decoded(data: bytes, file: Path) -> np.ndarray:
    if file.suffix.lower() == ".npy":
        try:
            pixels = npy.read(data)
        except ValueError as error:
            raise InputError(f"{file} is no array of numbers ({error}): write it again") from None
    else:
        cv2 = importlib.import_module("cv2")
        if data.startswith(b"\xff\xd8") and data.rfind(b"\xff\xd9") < data.rfind(b"\xff\xda"):  # which is gray from there on
            raise InputError(f"{file} is a JPEG that ends in the middle: copy it again")
        try:
            with silent_libraries():
                pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            pixels = None
    if pixels is None or pixels.ndim not in (2, 3) or min(pixels.shape[:2]) < 2:
        raise InputError(f"{file} is no picture that OpenCV reads: convert it to PNG")
    return pixels


def _encoded(pixels: np.ndarray, file: Path) -> bytes:
    if file.suffix.lower() == ".npy":
        packed = io.BytesIO()
        np.save(packed, pixels)
        return packed.getvalue()
    cv2 = importlib.import_module("cv2")
    try:
        is_encoded, data = cv2.imencode(file.suffix.lower(), pixels)
    except cv2.error:
        is_encoded = False
    if not is_encoded:
        raise InputError(f"OpenCV writes no {file.suffix} of {file.name}: convert the pictures to PNG")
    return data.tobytes()
