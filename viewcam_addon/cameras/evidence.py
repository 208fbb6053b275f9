"""The evidence that a dataset's files hold on its cameras: a COLMAP model's points and tracks, depth maps of transforms.json.

COLMAP's points are taken with the pixels at which pictures show them, by the names of the pictures. Depth maps are .npy, or PNG
of 16 bits, which Pillow decodes where it is installed; `depth_unit_scale_factor` (0.001 for PNG) makes them world units.
"""

import importlib.util
import io
import struct
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath

import numpy as np

from .. import checks, npy
from ..errors import InputError
from ..files import read_bytes
from . import clouds, colmap, transforms
from .audit import Depths, Tracks
from .camera import Camera
from .source import Record, Source

_DEPTH_KEYS = ("depth_file_path", "depth_path")
_NO_POINT = 2**64 - 1
_MOST_PIXELS = 2**25  # a depth map's, at 8K


def tracks(path: Path, cameras: Sequence[Camera]) -> Tracks | None:
    """The points of the COLMAP model at a path, as these cameras' pictures show them; None if there are none."""
    folder = path if path.is_dir() else path.parent
    try:
        model = colmap.model(Source(folder))
    except OSError:
        return None
    if model is None:
        return None
    parts, suffix = model
    where = folder.joinpath(*parts)
    points = where / f"points3D{suffix}"
    if not points.is_file():
        return None
    places = dict(clouds.of_colmap(points))
    numbers = {camera.image or camera.name: number for number, camera in enumerate(cameras)}
    short = {PurePosixPath(name).name: number for name, number in numbers.items()}
    which, seen, ids = [], [], []
    for name, observations in _binary_tracks(where / "images.bin") if suffix == ".bin" else _text_tracks(where / "images.txt"):
        number = numbers.get(name, short.get(PurePosixPath(name).name))
        if number is None:
            continue
        for x, y, point in observations:
            if point in places:
                which.append(number)
                seen.append((x, y))
                ids.append(point)
    if not which:
        return None
    return Tracks(np.array(which), np.array(seen), np.array([places[point] for point in ids]))


def _text_tracks(path: Path) -> Iterator[tuple[str, list[tuple[float, float, int]]]]:
    lines = [line for line in path.read_text(encoding="utf-8", errors="replace").splitlines() if not line.startswith("#")]
    while lines and not lines[0].strip():
        lines.pop(0)
    for head, points in zip(lines[::2], lines[1::2], strict=False):
        words = points.split()
        try:
            name = head.split(maxsplit=9)[9].strip()
            yield name, [(float(x), float(y), int(p)) for x, y, p in zip(words[::3], words[1::3], words[2::3], strict=True)]
        except (ValueError, IndexError):
            raise InputError(
                f"{path} has a line {checks.quoted(head)}: each image has two lines, the second X Y POINT3D_ID"
            ) from None


def _binary_tracks(path: Path) -> Iterator[tuple[str, list[tuple[float, float, int]]]]:
    data = path.read_bytes()
    try:
        (count,), at = struct.unpack_from("<Q", data), 8
        for _ in range(count):
            end = data.index(b"\0", at + 64)
            name = data[at + 64 : end].decode("utf-8", errors="replace")
            (many,) = struct.unpack_from("<Q", data, end + 1)
            if many > len(data) // 24:
                raise struct.error
            observations = [struct.unpack_from("<2dQ", data, end + 9 + 24 * i) for i in range(many)]
            at = end + 9 + 24 * many
            yield name, [each for each in observations if each[2] != _NO_POINT]
    except (struct.error, ValueError, OverflowError):
        raise InputError(f"{path} ends too early: copy it again") from None


def depths(path: Path, cameras: Sequence[Camera]) -> Depths | None:
    """The depth maps that transforms.json names, one for each camera; None if it names none."""
    source: Source | None = Source(path)
    if source and source.is_folder:
        source = source.file("transforms.json")
    if source is None or source.path is None:
        return None
    document = source.document
    frames = transforms.listed(document)
    if not isinstance(frames, list) or len(frames) != len(cameras):
        return None
    key = next((key for key in _DEPTH_KEYS if all(isinstance(frame, dict) and key in frame for frame in frames)), None)
    if key is None:
        return None
    scale = Record(document, source.name).number("depth_unit_scale_factor", 0.001, 1e-12, 1e12)
    has_scale = "depth_unit_scale_factor" in document
    maps = []
    for number, frame in enumerate(frames):
        file = source.path.parent / Record(frame, f"frame {number}").text(key)
        maps.append(_depth(file, scale, has_scale))
    return Depths(maps)


def _depth(path: Path, scale: float, has_scale: bool) -> np.ndarray:
    try:
        data = read_bytes(path)
        if path.suffix == ".npy":
            depth, scale = npy.read(data), scale if has_scale else 1.0
        else:
            depth = _pixels(data, path)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path} can't be read as a depth map ({error}): give .npy or PNG of 16 bits") from None
    if depth.size > _MOST_PIXELS:
        raise InputError(f"{path} has {depth.size} numbers: give depth in the pictures' size")
    depth = np.squeeze(np.asarray(depth, dtype=np.float64)) * scale
    if depth.ndim != 2:
        raise InputError(f"{path} has the shape {depth.shape}: a depth map has rows and columns only")
    return depth


def _pixels(data: bytes, path: Path) -> np.ndarray:
    """The numbers of a picture that Pillow decodes, once its head says that they are not too many."""
    if importlib.util.find_spec("PIL") is None:
        raise InputError(f"{path} needs Pillow to be read: pip install pillow, or give depth as .npy")
    from PIL import Image

    try:
        with warnings.catch_warnings():  # a picture may be a bomb
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(data)) as picture:
                if picture.width * picture.height > _MOST_PIXELS:
                    raise InputError(f"{path} has {picture.width} × {picture.height} pixels: give depth in the pictures' size")
                return np.asarray(picture)
    except InputError:
        raise
    except Image.DecompressionBombError:
        raise InputError(f"{path} has far too many pixels: give depth in the pictures' size") from None
    except Exception as error:  # each decoder has its own
        raise ValueError(error) from error
