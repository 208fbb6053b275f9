"""A COLMAP model: text and binary in; text out, and binary by colmap_binary.py; and a points3D without points where none are
known: labels/colmap.py knows some.

**Cameras.** One for each set of intrinsics that the pictures have: PINHOLE (fx, fy, cx, cy), the only one that Gaussian
splatting's reader of text takes; with a lens OPENCV or the first model that has its terms. The upper left corner of the picture
is (0, 0), its first pixel's center (0.5, 0.5).

**Images.** In text two lines each, the second one a list of image points, empty where there are none. The pose takes world
space to the camera's x right, y down, z into the view, as a unit quaternion (w first, Hamilton's) and a translation. All
numbers have as many digits as bring back the same float64. Comments before them have the values of which they were made; a
binary model, in which COLMAP leaves no room, has these in a file of their own beside it. Of text and binary in one folder the
binary one counts, as for COLMAP.

**Rigs.** Where the pictures of several cameras are called alike from their last number on, and the cameras keep their places to
one another, RIG_CONFIG beside the model says the rig, as `colmap rig_configurator` and pycolmap's apply_rig_config read it.
rigs and frames, new in COLMAP 3.12, are not written: without them each image is a frame of its own. With them the images repeat
the poses that they compose; COLMAP passes over those of the images, and all others over rigs and frames: where somebody has
changed one of the two alone, it is refused.

Sources: COLMAP's doc/format.rst, doc/database.rst (pixel centers), src/colmap/sensor/models.h (the lenses) and
src/colmap/scene/rig.cc (ReadRigConfig), reconstruction_io_text.cc and _binary.cc (what parts a line: a name ends at a space).
"""

import itertools
import json
import re
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, NamedTuple, NoReturn, cast

import numpy as np

from .. import checks
from ..errors import InputError, several
from ..pinhole import Pinhole, ViewPlane
from . import axes, distortion, naming, own
from .axes import intrinsics, quaternion, world_to_camera
from .camera import Camera, LeftOut, Options, not_a_pinhole
from .source import Source, flat, pixels

TITLE = "COLMAP model (cameras, images)"
SUFFIX = ""
LENSES = True

MODELS: dict[str, tuple[int, tuple[str, ...]]] = {
    "SIMPLE_PINHOLE": (0, ("f", "cx", "cy")),
    "PINHOLE": (1, ("fx", "fy", "cx", "cy")),
    "SIMPLE_RADIAL": (2, ("f", "cx", "cy", "k1")),
    "RADIAL": (3, ("f", "cx", "cy", "k1", "k2")),
    "OPENCV": (4, ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")),
    "OPENCV_FISHEYE": (5, ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4")),
    "FULL_OPENCV": (6, ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
    "FOV": (7, ("fx", "fy", "cx", "cy", "omega")),
    "SIMPLE_RADIAL_FISHEYE": (8, ("f", "cx", "cy", "k")),
    "RADIAL_FISHEYE": (9, ("f", "cx", "cy", "k1", "k2")),
    "THIN_PRISM_FISHEYE": (10, ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1")),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        11,
        ("fx", "fy", "cx", "cy", "k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"),
    ),
    "SIMPLE_DIVISION": (12, ("f", "cx", "cy", "k")),
    "DIVISION": (13, ("fx", "fy", "cx", "cy", "k")),
    "SIMPLE_FISHEYE": (14, ("f", "cx", "cy")),
    "FISHEYE": (15, ("fx", "fy", "cx", "cy")),
    "EUCM": (16, ("fx", "fy", "cx", "cy", "alpha", "beta")),
    "EQUIRECTANGULAR": (17, ("w", "h")),
}
"""Name → its number in binary files, and its parameters."""

_STRAIGHT = ("f", "fx", "fy", "cx", "cy")
FILES = ("cameras", "images")
_RIGS = ("rigs", "frames")
_SENSORS = {"CAMERA": 0, "IMU": 1}
_AS_THE_RIG = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # the pose in it of a rig's first sensor
_SAME_POSE = 1e-5  # relative: what two poses of one image may differ by for the six digits of one

_MOMENT = re.compile(r"(?P<prefix>.*?)(?P<moment>[0-9]+[^0-9]*)", re.DOTALL)
_ROUNDINGS = 16 * 2.0**-24  # float32 in two of Blender's matrices and those of their parents, relative to the farthest eye

TEXTS = ("images.txt", "cameras.txt", "points3D.txt")
"""The files of a model that is written."""
RIG_CONFIG = "rig_config.json"
NOTES = "virtual_pinhole.txt"
FORMS_OF_RIGS = tuple(f"{name}{suffix}" for name in _RIGS for suffix in (".txt", ".bin"))
NOT_BESIDE = (*FORMS_OF_RIGS, "cameras.bin", "images.bin", "points3D.bin")
"""Files of another model that count before those that are written: for COLMAP binary ones do, and rigs have the poses."""
_FOLDERS = ((), ("0",), ("sparse", "0"), ("sparse",), ("colmap", "sparse", "0"))

_Model = tuple[tuple[str, ...], str]  # the folder's parts below the source, and the files' suffix


class _Intrinsics(NamedTuple):
    """The entry of cameras.txt about one camera."""

    model: str
    width: int
    height: int
    parameters: tuple[float, ...]


class _Image(NamedTuple):
    number: int
    name: str
    quaternion: tuple[float, ...]
    translation: tuple[float, ...]
    camera: int


class Tracks(NamedTuple):
    """Points in world space, and where pictures show them.

    positions : the points' places, (n, 3).
    colors : the points' colors, (n, 3), 0 … 255.
    observations : (numbers, places) for each picture: the numbers of the points that it shows, (m,) from 0, and their places,
        (m, 2): x to the right and y down from the picture's corner.
    """

    positions: np.ndarray
    colors: np.ndarray
    observations: Sequence[tuple[np.ndarray, np.ndarray]]


def recognizes(source: Source) -> bool:
    return model(source) is not None


def read(source: Source, options: Options) -> list[Camera]:
    folder, suffix = cast(_Model, model(source))
    files = _files(source, folder, suffix)
    if suffix == ".bin":
        intrinsic, images = _binary_cameras(files[0]), [*_binary_images(files[1])]
    else:
        intrinsic, images = _text_cameras(files[0]), [*_text_images(files[1])]
    if rigs := _files(source, folder, suffix, _RIGS):
        _refuse_other_poses(images, _poses_of_frames(*((_Reader if suffix == ".bin" else _Words)(each) for each in rigs)), rigs)
    has_texts = suffix == ".bin" and _files(source, folder, ".txt")
    notes = ("The folder has the model as text, too: the binary one counts",) if has_texts else ()
    planes: dict[int, tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]] = {}
    left_out, taken = LeftOut(), []
    for image, name in zip(images, naming.distinct([image.name for image in images]), strict=True):
        if image.camera not in intrinsic:
            raise InputError(
                f"{source.name}: image {checks.quoted(image.name)} is of camera {image.camera}, which is not there"
            )
        with left_out.unless_pinhole(name):
            if image.camera not in planes:
                planes[image.camera] = _plane(intrinsic[image.camera], f"camera {image.camera}", options)
            taken.append((image, name))
    poses = _poses([image for image, _ in taken], planes)
    cameras = [
        Camera(name, pinhole, True, (*notes, *planes[image.camera][2], *more), image.name, lens=planes[image.camera][1])
        for (image, name), (pinhole, more) in zip(taken, poses, strict=True)
    ]
    return left_out.with_notes(cameras)


def _poses(images: Sequence[_Image], planes: dict) -> list[tuple[Pinhole, tuple[str, ...]]]:
    whats = [f"image {checks.quoted(image.name)}" for image in images]
    numbers = [
        checks.vector(f"the pose of {what}", (*image.quaternion, *image.translation), 7)
        for image, what in zip(images, whats, strict=True)
    ]
    poses = np.array(numbers).reshape(-1, 7)
    matrices = axes.from_worlds_to_cameras(axes.rotations_of(poses[:, :4], whats), poses[:, 4:], whats)
    return axes.pinholes(matrices, [planes[image.camera][0] for image in images], whats)


def notes_in(source: Source) -> list[str]:
    folder, suffix = cast(_Model, model(source))
    file = source.file(*folder, NOTES if suffix == ".bin" else f"{FILES[1]}{suffix}")
    return [file.text] if file else []


def model(source: Source) -> _Model | None:
    """The place of the model in a folder, part by part, and the suffix of its files; None if there is none."""
    if not source.is_folder:
        path = source.path
        if path is None or path.stem not in (*FILES, *_RIGS, "points3D") or path.suffix not in (".txt", ".bin"):
            return None
        return ((), path.suffix) if _files(source, (), path.suffix) else None
    for folder in _FOLDERS:
        for suffix in (".bin", ".txt"):
            if _files(source, folder, suffix):
                if source.path and folder[-1:] == ("0",):
                    models = source.path.joinpath(*folder[:-1])
                    if numbers := [other.name for other in models.iterdir() if other.name.isdigit() and other.name != "0"]:
                        raise InputError(
                            f"{models} has {len(numbers) + 1} models, each a world of its own: give one of the folders"
                        )
                return folder, suffix
    return None


def _files(source: Source, folder: Sequence[str], suffix: str, names: Sequence[str] = FILES) -> list[Source]:
    """The files of cameras and images; none if one is not there."""
    files = [file for name in names if (file := source.file(*folder, f"{name}{suffix}")) is not None]
    return files if len(files) == len(names) else []


def _plane(intrinsic: _Intrinsics, what: str, options: Options) -> tuple[ViewPlane, distortion.Lens | None, tuple[str, ...]]:
    names = MODELS[intrinsic.model][1]
    if intrinsic.model == "EQUIRECTANGULAR":
        not_a_pinhole(what, f"of the camera model {intrinsic.model}")
    if len(intrinsic.parameters) != len(names):
        raise InputError(
            f"{what} is {intrinsic.model} with {len(intrinsic.parameters)} parameters: it should have {len(names)}"
        )
    values = dict(zip(names, intrinsic.parameters, strict=True))
    f_x, f_y = (values[name] if name in values else values["f"] for name in ("fx", "fy"))
    if not (f_x > 0 and f_y > 0):
        raise InputError(f"{what} has the focal length {min(f_x, f_y):g}: give one above 0")
    plane = axes.view_plane(f_x, f_y, values["cx"], values["cy"], (intrinsic.width, intrinsic.height))
    bent = {name: value for name, value in values.items() if name not in _STRAIGHT}
    return plane, *distortion.settle(
        _lens(intrinsic.model, bent), plane, f"{what} ({intrinsic.model})", options.without_distortion
    )


def _lens(model: str, values: dict[str, float]) -> distortion.Lens:
    """The lens of a model's coefficients, by their names in MODELS."""
    terms, numbers = tuple(values.items()), tuple(values.values())
    match model:
        case "FOV":
            return distortion.Lens(terms, "fov", numbers) if values["omega"] else distortion.opencv({})
        case "SIMPLE_DIVISION" | "DIVISION":
            return distortion.division(values["k"])
        case "EUCM":
            return distortion.Lens(terms, "eucm", numbers)
        case "THIN_PRISM_FISHEYE":
            k1, k2, p1, p2, k3, k4, s1, s3 = numbers
            prism = (s1, 0.0, s3, 0.0)
            return distortion.Lens(terms, "equidistant", radial=(k1, k2, k3, k4), tangential=(p1, p2), prism=prism)
        case "RAD_TAN_THIN_PRISM_FISHEYE":  # whose p0 and p1 are OpenCV's p2 and p1
            radial, (p2, p1, s1, s2, s3, s4) = numbers[:6], numbers[6:]
            return distortion.Lens(
                terms, "equidistant", radial=radial, tangential=(p1, p2), prism=(s1, s2, s3, s4), radial_first=True
            )
    if "FISHEYE" in model:
        return distortion.Lens(terms, "equidistant", radial=numbers)
    return distortion.opencv(values)


def _lines(source: Source) -> list[str]:
    return source.text.split("\n")


def _text_cameras(source: Source) -> dict[int, _Intrinsics]:
    result = {}
    for number, line in enumerate(_lines(source), start=1):
        if not (words := line.split()) or words[0].startswith("#"):
            continue
        place = f"line {number} of {source.name}"
        if len(words) < 5 or not words[0].isdecimal():
            raise InputError(f"{place} is {checks.quoted(line)}: it should be CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]")
        if words[1] not in MODELS:
            raise InputError(f"{place}: the camera model {checks.quoted(words[1])} is unknown: convert it to PINHOLE")
        width, height = (pixels(f"{what} of {place}", word) for what, word in zip(("width", "height"), words[2:4], strict=True))
        if (camera := _id(words[0], place)) in result:
            raise InputError(f"{place} is another camera {camera}: give each a number of its own")
        result[camera] = _Intrinsics(words[1], width, height, flat(f"parameters of {place}", words[4:]))
    return result


def _text_images(source: Source) -> Iterator[_Image]:
    lines = enumerate(_lines(source), start=1)
    for number, line in lines:
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        place = f"line {number} of {source.name}"
        if len(words) < 10 or not words[0].isdecimal():
            raise InputError(f"{place} is {checks.quoted(line)}: it should be IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")
        pose = flat(f"the pose in {place}", words[1:8])
        yield _Image(
            _id(words[0], place), re.split(r"\s+", line.strip(), maxsplit=9)[9], pose[:4], pose[4:], _id(words[8], place)
        )
        for number, points in itertools.islice(lines, 1):
            parts = points.split()
            if (len(parts) % 3 or (parts and not parts[-1].removeprefix("-").isdecimal())) and parts[0][0] != "#":
                raise InputError(
                    f"line {number} of {source.name} is no list of image points, X Y POINT3D_ID: each image has two lines, "
                    "the second of which may be empty"
                )


def _id(word: str, place: str) -> int:
    if not word.isdecimal() or len(word) > 20:
        raise InputError(f"{place} has {checks.quoted(word)} where a number of a camera or image should be: correct it")
    return int(word)


def _poses_of_frames(rigs: "_Reader | _Words", frames: "_Reader | _Words") -> dict[int, tuple[float, ...]]:
    """Number of an image → the pose of its rig in the world, and that of its camera in the rig, one after the other."""
    in_rig: dict[tuple[int, ...], tuple[float, ...]] = {}
    for _ in range(rigs.count()):
        rig, sensors = rigs.numbers("2I")
        for place in range(sensors):
            sensor = rigs.numbers("iI")
            if place == 0:
                in_rig[rig, *sensor] = _AS_THE_RIG
            elif rigs.numbers("B")[0]:
                in_rig[rig, *sensor] = rigs.numbers("7d")
    poses = {}
    for _ in range(frames.count()):
        _, rig, *pose, taken = frames.numbers("2I7dI")
        for _ in range(taken):
            kind, number, image = frames.numbers("iIQ")
            if kind == _SENSORS["CAMERA"] and (rig, kind, number) in in_rig:
                poses[image] = (*pose, *in_rig[rig, kind, number])
    return poses


def _refuse_other_poses(images: Sequence[_Image], poses: dict[int, tuple[float, ...]], rigs: Sequence[Source]) -> None:
    """Raise InputError if an image has another pose than its rig gives it."""
    images = [image for image in images if image.number in poses]
    whats = [f"image {checks.quoted(image.name)}" for image in images]
    rows = [
        checks.vector(f"the pose of {what}", (*image.quaternion, *image.translation, *poses[image.number]), 21)
        for what, image in zip(whats, images, strict=True)
    ]
    numbers = np.array(rows).reshape(-1, 3, 7)
    turn, of_rig, in_rig = (axes.rotations_of(numbers[:, i, :4], whats) for i in range(3))
    place, of_rigs_place, in_rigs_place = (numbers[:, i, 4:] for i in range(3))
    carried = np.einsum("nij,nj->ni", in_rig, of_rigs_place) + in_rigs_place
    reach = np.abs(numbers[:, :, 4:]).max(axis=(1, 2), initial=0.0)
    differ = np.abs(turn - in_rig @ of_rig).max(axis=(1, 2), initial=0.0) > _SAME_POSE
    differ |= np.abs(place - carried).max(axis=1, initial=0.0) > _SAME_POSE * reach
    if differ.any():
        raise InputError(
            f"the pose of {several([what for what, other in zip(whats, differ, strict=True) if other])} is another by "
            f"{' and '.join(file.name for file in rigs)}, and programs differ in which of them counts: take these two files "
            "out, or write the model again"
        )


class _Words:
    """Numbers of a text of a model, one after another, as `_Reader` has them of a binary one."""

    def __init__(self, source: Source) -> None:
        self._source = source
        self._lines = [words for line in _lines(source) if (words := line.split()) and not words[0].startswith("#")]
        self._words = itertools.chain.from_iterable(self._lines)

    def count(self) -> int:
        return len(self._lines)

    def numbers(self, form: str) -> tuple:
        kinds = "".join(kind * int(count or 1) for count, kind in re.findall(r"(\d*)(\D)", form))
        words = [*itertools.islice(self._words, len(kinds))]
        of_kind: dict[str, Callable[[str], float]] = {"d": float, "i": _SENSORS.__getitem__}
        try:
            return tuple(of_kind.get(kind, int)(word) for kind, word in zip(kinds, words, strict=True))
        except (ValueError, KeyError):
            raise InputError(f"{self._source.name} ends in the middle, or is no COLMAP file: copy it again") from None


class _Reader:
    """Little-endian numbers of a file, one after another."""

    def __init__(self, source: Source) -> None:
        self._source, self._at = source, 0

    def count(self) -> int:
        return self.numbers("Q")[0]

    def numbers(self, form: str) -> tuple:
        try:
            numbers = struct.unpack_from(f"<{form}", self._source.data, self._at)
        except struct.error:
            self._ended()
        self._at += struct.calcsize(f"<{form}")
        return numbers

    def skip(self, count: int) -> None:
        self._at += count
        if self._at > len(self._source.data):
            self._ended()

    def text(self) -> str:
        end = self._source.data.find(b"\0", self._at)
        if end < 0:
            self._ended()
        text_bytes = self._source.data[self._at : end].decode("utf-8", errors="replace")
        self._at = end + 1
        return text_bytes

    def _ended(self) -> NoReturn:
        raise InputError(f"{self._source.name} ends in the middle, or is no COLMAP file: copy it again")


def _binary_cameras(source: Source) -> dict[int, _Intrinsics]:
    names = {number: name for name, (number, _) in MODELS.items()}
    reader, result = _Reader(source), {}
    for _ in range(reader.numbers("Q")[0]):
        number, model, width, height = reader.numbers("IiQQ")
        if model not in names:
            raise InputError(f"camera {number} of {source.name} is of the unknown model {model}: convert it to PINHOLE")
        width, height = (pixels(f"{side} of camera {number}", value) for side, value in (("width", width), ("height", height)))
        name = names[model]
        if number in result:
            raise InputError(f"{source.name} has two cameras {number}: give each a number of its own")
        result[number] = _Intrinsics(name, width, height, reader.numbers(f"{len(MODELS[name][1])}d"))
    return result


def _binary_images(source: Source) -> Iterator[_Image]:
    reader = _Reader(source)
    for _ in range(reader.numbers("Q")[0]):
        number, *pose, camera = reader.numbers("I7dI")
        name = reader.text()
        reader.skip(24 * reader.numbers("Q")[0])
        yield _Image(number, name, tuple(pose[:4]), tuple(pose[4:]), camera)


def write(cameras: Sequence[Camera], options: Options) -> dict[str, str]:
    head = f"# {options.remembered}\n" if options.remembered else ""
    return {name: head + text if name in TEXTS else text for name, text in texts(cameras).items()}


def check_names(files: Iterable[str]) -> None:
    """Raise InputError if a picture's name holds a space, of any width, since some readers part there, too."""
    parted = [file for file in files if any(map(str.isspace, file))]
    if parted:
        raise InputError(f"a COLMAP model can't name a picture with a space, as {several(parted)}: rename it")


def texts(cameras: Iterable[Camera], tracks: Tracks | None = None) -> dict[str, str]:
    """Name of the file → what it holds; cameras, images and points are numbered from 1, in their order.

    tracks : the points of the cameras' pictures, in the cameras' order; without them there are none.

    Raises InputError if there is no camera, two have one picture, one is mirrored, or the name of a picture holds a space.
    """
    cameras = naming.checked(cameras, "a COLMAP model")
    check_names(map(naming.image_of, cameras))
    numbers: dict[str, int] = {}
    places, points = _points(tracks, len(cameras))
    images = []
    for number, (camera, line) in enumerate(zip(cameras, places, strict=True), start=1):
        intrinsic = numbers.setdefault(_camera(camera), len(numbers) + 1)
        images.append(f"{number} {_spaced(*pose_of(camera.pinhole))} {intrinsic} {naming.image_of(camera)}\n{line}\n")
    return {
        "images.txt": "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# POINTS2D[] as X Y POINT3D_ID\n"
        + comments(cameras)
        + "".join(images),
        "cameras.txt": "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n"
        + "".join(f"{number} {camera}\n" for camera, number in numbers.items()),
        "points3D.txt": "# POINT3D_ID X Y Z R G B ERROR TRACK[] as IMAGE_ID POINT2D_IDX\n" + points,
        **({RIG_CONFIG: json.dumps(rig, indent=1) + "\n"} if (rig := rig_config(cameras)) else {}),
    }


def rig_config(cameras: Sequence[Camera]) -> list[dict[str, Any]]:
    """The rig of the cameras by which these pictures were taken, as COLMAP reads it; empty where they are none."""
    rig: dict[str, dict[str, Camera]] = {}
    for camera in cameras:
        if not (name := _MOMENT.fullmatch(naming.image_of(camera))):
            return []
        rig.setdefault(name["prefix"], {})[name["moment"]] = camera
    reference, *others = rig.values()
    moments = reference.keys()
    if not others or len(moments) < 2 or any(other.keys() != moments for other in others):
        return []
    if any(b.startswith(a) for a, b in itertools.permutations(rig, 2)):
        return []
    off = _ROUNDINGS * max(1.0, *(abs(part) for camera in cameras for part in camera.pinhole.eye))
    listed: list[dict[str, Any]] = []
    for prefix, taken in rig.items():
        if len({*map(_camera, taken.values())}) > 1:
            return []
        places = np.array([_place_in_rig(taken[moment].pinhole, reference[moment].pinhole) for moment in moments])
        if np.abs(places - places[0]).max() > off:
            return []
        model, _, _, parameters = intrinsics_of((first := next(iter(taken.values()))).pinhole, first.lens)
        pose: dict[str, Any] = {"ref_sensor": True}
        if taken is not reference:
            turn, shift = quaternion(places[0, :, :3].tolist()), places[0, :, 3].tolist()
            pose = {"cam_from_rig_rotation": [*turn], "cam_from_rig_translation": shift}
        listed.append({"image_prefix": prefix, **pose, "camera_model_name": model, "camera_params": [*parameters]})
    return [{"cameras": listed}]


def _place_in_rig(pinhole: Pinhole, reference: Pinhole) -> np.ndarray:
    """(3, 4) from the axes of the rig's first camera to those of this one."""
    return (np.array(world_to_camera(pinhole)) @ np.linalg.inv(world_to_camera(reference)))[:3]


def _points(tracks: Tracks | None, images: int) -> tuple[list[str], str]:
    """The second line of each image, and the lines of points3D.txt. Their error is 0: places are projections."""
    if tracks is None:
        return images * [""], ""
    shown_in: list[list[str]] = [[] for _ in tracks.positions]
    lines = []
    for image, (points, places) in enumerate(tracks.observations, start=1):
        observed = list(zip(points.tolist(), places.tolist(), strict=True))
        lines.append(" ".join(f"{_spaced(*place)} {point + 1}" for point, place in observed))
        for index, (point, _) in enumerate(observed):
            shown_in[point].append(f"{image} {index}")
    rows = zip(tracks.positions.tolist(), tracks.colors.tolist(), shown_in, strict=True)
    return lines, "".join(
        f"{number} {_spaced(*position)} {_spaced(*color)} 0.0 {' '.join(track)}\n"
        for number, (position, color, track) in enumerate(rows, start=1)
    )


def points_without_tracks(source: Source) -> str:
    """The lines of points3D.txt of a model's points, for pictures in which they are elsewhere; empty where there are none."""
    if (sparse_model := model(source)) is None:
        return ""
    folder, suffix = sparse_model
    file = source.file(*folder, f"points3D{suffix}")
    if file is None:
        return ""
    if suffix == ".txt":
        rows = [line.split()[:8] for line in _lines(file) if line.strip() and not line.startswith("#")]
        if any(len(row) < 8 for row in rows):
            raise InputError(f"{file.name} has a line that is not POINT3D_ID X Y Z R G B ERROR …: export it again")
        return "".join(f"{' '.join(row)}\n" for row in rows)
    reader, lines = _Reader(file), []
    for _ in range(reader.numbers("Q")[0]):
        number, x, y, z, *color, error, tracked = reader.numbers("Q3d3BdQ")
        reader.skip(8 * tracked)
        lines.append(f"{number} {_spaced(x, y, z, *color, error)}\n")
    return "".join(lines)


def comments(cameras: Iterable[Camera]) -> str:
    """A comment for each camera: its values."""
    return "".join(f"# {own.comment(camera.pinhole)}\n" for camera in cameras)


def intrinsics_of(pinhole: Pinhole, lens: distortion.Lens | None = None) -> _Intrinsics:
    """The entry of cameras.txt about a camera. Raises InputError if its lens is none of COLMAP's."""
    (f_x, _, c_x), (_, f_y, c_y), _ = intrinsics(pinhole)
    model, bent = ("PINHOLE", ()) if lens is None else _model_of(lens)
    return _Intrinsics(model, pinhole.width, pinhole.height, (f_x, f_y, c_x, c_y, *bent))


def _model_of(lens: distortion.Lens) -> tuple[str, tuple[float, ...]]:
    """The first of COLMAP's models that is this lens, and its coefficients in their order."""
    k1, k2, k3, k4, *higher = (*lens.radial, *[0.0] * 6)[:6]
    (p1, p2), (s1, s2, s3, s4) = lens.tangential, lens.prism
    coefficients = {
        "OPENCV": (k1, k2, p1, p2),
        "FULL_OPENCV": (k1, k2, p1, p2, k3, *(*lens.divisor, *[0.0] * 3)[:3]),
        "OPENCV_FISHEYE": (k1, k2, k3, k4),
        "THIN_PRISM_FISHEYE": (k1, k2, p1, p2, k3, k4, s1, s3),
        "RAD_TAN_THIN_PRISM_FISHEYE": (k1, k2, k3, k4, *higher, p2, p1, s1, s2, s3, s4),
        lens.projection.upper(): lens.parameters,
    }
    for model, numbers in coefficients.items():
        names = [name for name in MODELS.get(model, (0, ()))[1] if name not in _STRAIGHT]
        if len(names) == len(numbers) and _lens(model, dict(zip(names, numbers, strict=True))) == lens:
            return model, numbers
    raise InputError("COLMAP has no model of this lens: undistort the pictures, or choose to take it without distortion")


def _camera(camera: Camera) -> str:
    model, width, height, parameters = intrinsics_of(camera.pinhole, camera.lens)
    return f"{model} {width} {height} {_spaced(*parameters)}"


def pose_of(pinhole: Pinhole) -> tuple[float, ...]:
    """The pose that images.txt has of it: the quaternion, w first, and the translation."""
    *rows, _ = world_to_camera(pinhole)
    return (*quaternion(rows), *(row[3] for row in rows))


def _spaced(*numbers: float) -> str:
    return " ".join(map(repr, numbers))
