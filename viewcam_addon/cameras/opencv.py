"""K, R or rvec, and t: OpenCV's FileStorage as YAML, JSON or XML, and plain JSON, YAML or NPZ with the same names.

The pose takes world space to the camera's x right, y down, z into the view: R X + t, as `solvePnP` gives it. Names are those
that people give (K, camera_matrix, cameraMatrix, intrinsic_matrix …; R, rvec; t, tvec; T_cw, extrinsic …). OpenCV itself has no
file of a pose, so a file may hold K alone, which stands at the origin and looks along +z, as it would for `projectPoints`; a
note says so. What is written has K, R, rvec, t, a distortion of zeros and the size, and NPZ is read only.

So do the files that are like OpenCV's: of `stereoCalibrate` (M1 or K1, D1, M2, D2, and R and T from the first to the second, in
the same file or in extrinsics.yml beside it), whose first camera stands at the origin; those of ORB-SLAM (Camera.fx …) and VINS
(projection_parameters); fx, fy, cx, cy by name, as of RealSense; arrays of K and of poses, one a picture, in NPZ and NPY.

**Pixels.** OpenCV puts (0, 0) at the center of the first pixel (`remap`, `undistort`, calibration), so half a pixel lies
between its K and ours, and a note says that it was added; `pixel = "corner"` takes K as it stands, for files of tools that mean
the corner.

Rejected: PyYAML, which refuses FileStorage's first line and tags, is not in Blender, and would be asked for three kinds of
lines; K that means the corner where it is exactly half the size: the middle of a picture does not tell by which rule it is so.

Source: OpenCV's modules/core/src/persistence_yml.cpp and calib3d's projectPoints.
"""

import contextlib
import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import InputError, counted
from ..pinhole import ViewPlane
from . import axes, distortion, naming, own
from .camera import POSES, Camera, LeftOut, NoPinholeError, Options, not_a_pinhole
from .source import Record, Source, flat, number, pixels

TITLE = "OpenCV K, R, t (FileStorage YAML, JSON or XML; NPZ)"
SUFFIX = ".yml"
SEVERAL = "a folder"

_K = ("k", "cameramatrix", "intrinsicmatrix", "intrinsics", "intrinsic", "mtx", "cammatrix", "camk", "kmatrix")
_R = ("r", "rot", "rotation", "rmat", "rotationmatrix", "rw2c")
_SAYS_K = re.compile(r"(?:[km][12lr]?|matrix_?\w{0,5}|intrinsics?|mtx|fx)[\s_$\"'-]*:", re.IGNORECASE)  # each of these
_PARTS_OF_K = (("fx",), ("fy",), ("cx", "ppx", "u0", "px"), ("cy", "ppy", "v0", "py"))
_OF_CAMERA = re.compile(r"^camera1?(?=(?:[fc][xy]|[kp]\d|width|height|type)$)")  # ORB-SLAM's
_INNER = ("projectionparameters", "distortionparameters", "distortion", *_K)
_LISTS = ("cameras", "Cameras", "views")  # CMU Panoptic's calibrations, and many programs' own
_STEREO = (("1", "2"), ("left", "right"), ("l", "r"))
_OF_ONE = ("m", *_K)
_BESIDE = "extrinsics.yml", "extrinsics.yaml", "extrinsics.xml"
_WHOLE_TURN = 2 * math.pi * 1.01  # with room for what was found by fitting
_RVEC = ("rvec", "rodrigues", "rotationvector", "rvecs")
_T = ("t", "tvec", "tvecs", "translation", "translationvector", "trans", "tw2c")
_EXTRINSIC = (
    "extrinsic", "extrinsics", "rt", "worldtocamera", "worldtocam", "world2camera", "world2cam", "w2c", "tcw",
    "extrinsicmatrix", "tcamworld", "tcameraworld",
)  # fmt: skip
_DISTORTION = (
    "distortioncoefficients", "distcoeffs", "dist", "distortion", "distcoef", "distcoeff", "d", "distortioncoeffs", "dist0",
    "coeffs",
)  # fmt: skip
_OTHER_DISTORTION = re.compile(r"dist(?!ance)|radial|tangential|^kc$|^[kp][1-6]$")
_FISHEYE = re.compile(r"^(?:opencv_?)?fisheye|equidistant|kannala|^kb4?$")
_KNOWN_LENS = re.compile(
    r"^\s*$|^(?:none|null|no|opencv|perspective|pinhole|standard|ideal|rectified|kb4?)$|plumb|rad|brown|conrady|poly|rational"
    r"|distort|equi|fisheye|kannala"
)
"""The names of distortion models with OpenCV's coefficients, or with none."""
_OTHER_LENS = re.compile(r"fisheye|omni|mei|u?cm$|kb\d|spherical|ortho|fov|division|double|^ds$|theta|equirect|panoram|cylind")
# Parts of names that may mean a pose in words that nobody knows; Kalibr's T_cam_imu is none.
_MAY_BE_POSE = re.compile(r"pose|extrin|rotation|rot$|transf|transl|2cam|2world|toworld|tocam|w2|c2|rvec|tvec|position|quat")
_NO_POSE = ("tcamimu", "timushift", "rectificationmatrix", "projectionmatrix", "p")
_BLENDERS = ("matrixworld",)
_ON_BODY = ("tbs", "timucam")  # EuRoC's and OpenVINS', of a camera on its body
_OTHER_POSE = (
    *("pose", "c2w", "cam2world", "camera2world", "cameratoworld", "camtoworld", "twc", "camerapose", "transform"),
    *("transformmatrix", "tworldcam", "tworldcamera", *_BLENDERS, *_ON_BODY, "quaternion", "q", "qvec"),
)
_WIDTH = ("imagewidth", "width", "w", "resx")
_HEIGHT = ("imageheight", "height", "h", "resy")
_SIZE = ("imagesize", "size", "resolution", "imgsize", "imagesizewh")
NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tx", "ty")
"""The names of the distortion's coefficients, in OpenCV's order."""
_WINDOW = ("roi", "binningx", "binningy")
_MAY_CUT = re.compile(r"crop|binning|roi|resiz|downs(?:ample|cale)")
"""Beginnings of names of what may have been done to the pictures since."""

_WIDEST = 50  # widths of the picture to a focal length, which are 177.7°
_UNSAID = f"whose axes it means and which way it goes is not said: give --pose, one of {', '.join(POSES)}"
_UNREAD = "of which no pose is read: write R and t, world to camera, or a matrix of 4 × 4"
_POSE_BY_NUMBER: tuple[tuple[str, ...], ...] = (("qw", "qx", "qy", "qz"), ("tx", "ty", "tz"), ("roll", "pitch", "yaw"))
_WAY = "R and t were taken as from world to camera, x right, y down, z into the view"


def recognizes(source: Source) -> bool:
    return any(True for _ in _cameras_in(source)) or _is_pose_alone(source)


def read(source: Source, options: Options) -> list[Camera]:
    if _is_pose_alone(source):
        raise InputError(
            f"{source.name} has R and T and no K: give the file that has it, as intrinsics.yml with this one beside it"
        )
    refuse_twice(source)
    left_out, cameras, before = LeftOut(), [], np.eye(4)
    named = [*_cameras_in(source)]
    if any("tcncnm1" in values for _, values in named):  # writers of YAML sort cam10 before cam2
        named.sort(key=lambda camera: [int(digits) for digits in re.findall(r"[0-9]{1,9}", camera[0])])
    for name, values in named:
        if "tcncnm1" in values:  # Kalibr's: from the camera before to this one
            before = _four_rows(values["tcncnm1"], f"T_cn_cnm1 of camera {checks.quoted(name)}") @ before
            values |= {"r": before[:3, :3].tolist(), "t": before[:3, 3].tolist()}
        with left_out.unless_pinhole(name):
            cameras.append(camera(name, values, options))
    return left_out.with_notes(cameras)


def refuse_twice(source: Source) -> None:
    """Raise InputError if YAML has something of a camera twice, with other values."""
    if source.is_folder or source.npz or source.document or source.text.lstrip().startswith(("<", "[", "{")):
        return
    if twice := [key for key in source.yaml_twice if is_known(plain(key))]:
        raise InputError(
            f"{source.name} has the key {checks.quoted(twice[0])} twice, with other values or in a list: leave one out"
        )


def _four_rows(value: Any, name: str) -> np.ndarray:
    numbers = _numbers(name, value)
    if len(numbers) != 16 or numbers[12:] != (0, 0, 0, 1):
        raise InputError(f"{name} is not 4 × 4 with the last row 0 0 0 1: correct it")
    return np.array(numbers).reshape(4, 4)


def write(cameras: Sequence[Camera], options: Options) -> str | dict[str, str]:
    naming.refuse_mirrored(cameras, "OpenCV's R, t")
    return naming.a_file_each(cameras, SUFFIX, lambda camera: _text(camera, options))


def half_pixel(options: Options, habit: str = "center") -> float:
    """The amount to add to a format's principal point to count it from the picture's corner.

    habit : the format's habit, one of PIXELS.
    """
    return 0.5 if (options.pixel or habit) == "center" else 0.0


def told_of_half_pixel(options: Options, program: str) -> tuple[str, ...]:
    """The note that half a pixel was added."""
    if options.pixel:
        return ()
    return (f"{program} counts pixels from the first one's center: half a pixel was added to the principal point",)


def _text(camera: Camera, options: Options) -> str:
    (f_x, _, c_x), (_, f_y, c_y), _ = axes.intrinsics(camera.pinhole)
    half = half_pixel(options)
    rows = axes.world_to_camera(camera.pinhole)[:3]
    turn = [row[:3] for row in rows]
    lines = [
        "%YAML:1.0",
        "---",
        *([f"# {options.remembered}"] if options.remembered else []),
        *own.beginning(camera, "#"),
        f"image_width: {camera.pinhole.width}",
        f"image_height: {camera.pinhole.height}",
        _matrix("camera_matrix", [[f_x, 0.0, c_x - half], [0.0, f_y, c_y - half], [0.0, 0.0, 1.0]]),
        _matrix("distortion_coefficients", [[0.0]] * 5),
        _matrix("R", turn),
        _matrix("rvec", [[number] for number in rotation_vector(turn)]),
        _matrix("t", [[row[3]] for row in rows]),
    ]
    return "\n".join(lines) + "\n"


def _matrix(name: str, rows: Sequence[Sequence[float]]) -> str:
    data = ", ".join(repr(float(number)) for row in rows for number in row)
    return f"{name}: !!opencv-matrix\n   rows: {len(rows)}\n   cols: {len(rows[0])}\n   dt: d\n   data: [ {data} ]"


def rotation_vector(turn: Sequence[Sequence[float]]) -> tuple[float, float, float]:
    """Axis times angle in radians, at most π, of a rotation."""
    w, *axis = axes.quaternion(turn)
    sine = math.hypot(*axis)
    angle = 2 * math.atan2(sine, w)
    x, y, z = (angle * part / sine if sine else 0.0 for part in axis)
    return x, y, z


def of_rotation_vector(vector: Sequence[float], what: str) -> np.ndarray:
    """(3, 3) of axis times angle, Rodrigues'."""
    vector = checks.vector(f"the rotation vector of {what}", vector, 3)
    angle = math.hypot(*vector)
    if angle > _WHOLE_TURN:
        raise InputError(
            f"the rotation vector of {what} has the length {angle:g}: give an angle in radians, within a whole turn"
        )
    sine = math.sin(angle / 2) / angle if angle else 0.5
    return axes.rotation_of((math.cos(angle / 2), *(sine * part for part in vector)), what)


def plain(key: str) -> str:
    """A name in small letters and digits alone."""
    return re.sub(r"[^a-z0-9]", "", key.lower()[:60])


def _by_name(values: Mapping[str, Any]) -> dict[str, Any]:
    return {plain(key): value for key, value in values.items() if isinstance(key, str) and value is not None}


def _first(values: Mapping[str, Any], names: Sequence[str]) -> Any:
    return next((values[name] for name in names if name in values), None)


def says_intrinsics(values: Mapping[str, Any]) -> bool:
    """True if one of the values is K, whether its numbers are known or not."""
    k = _first(values, _K)
    return k is not None and (not isinstance(k, list | dict) or _is_camera(values))


def is_of_pose(name: str) -> bool:
    """True if a plain name is that of a pose, or of a part of one."""
    return name in (*_R, *_RVEC, *_T, *_EXTRINSIC, *_OTHER_POSE)


def is_size(name: str) -> bool:
    """True if a plain name is that of the picture's size, or of one side."""
    return name in (*_WIDTH, *_HEIGHT, *_SIZE)


def is_distortion(name: str) -> bool:
    """True if a plain name is that of all of a lens's coefficients."""
    return name in _DISTORTION


def is_known(name: str) -> bool:
    """True if a plain name is that of anything that a camera has."""
    return is_of_pose(name) or is_size(name) or is_distortion(name) or name in _K


def _is_camera(values: Mapping[str, Any]) -> bool:
    k = _first(values, _K)
    if k is None or len(values.keys() & {"frames", "poses", "object"}):
        return False
    try:
        return len(_numbers("K", k)) in (4, 9, 12, 16)
    except InputError:
        return isinstance(k, dict) and {"rows", "cols", "data"} <= k.keys()  # a matrix, and what is wrong is said


def _cameras_in(source: Source) -> Iterator[tuple[str, dict[str, Any]]]:
    """(name, values by plain name) of each camera in the file."""
    document = _document(source)
    by_name = _with_k(_by_name(document))
    if pair := _stereo(by_name, source):
        yield from pair
        return
    if _is_camera(by_name) or "mirrorparameters" in by_name:  # VINS' MEI is refused by its name
        yield from _of_pictures(source.path.stem if source.path else "camera", by_name)
        return
    shared = {name: value for name, value in by_name.items() if not isinstance(value, dict)}
    for name, value in document.items():
        inner = _with_k(_by_name(value)) if isinstance(value, dict) else {}
        if _is_camera(inner) or {"cameramodel", "intrinsics", "resolution"} <= inner.keys():  # Kalibr's, of any model
            yield str(name), {**shared, **inner}
        for i, each in enumerate(value if isinstance(value, list) and name in _LISTS else ()):
            if isinstance(each, dict) and _is_camera(inner := _with_k(_by_name(each))):
                yield str(each.get("name") or f"camera_{i}"), inner


def _of_pictures(name: str, values: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The camera, or one for each picture where there is an rvec and a tvec of each, as `calibrateCamera` finds them."""
    turns, places = (_first(values, names) for names in (_RVEC, _T))
    table = values.get("extrinsicparameters")  # rvec and tvec a row, of the program that OpenCV's manual calibrates with
    if turns is None and isinstance(table, dict) and table.get("cols") in (6, "6"):
        rows = np.array(_numbers("extrinsic_parameters", table)).reshape(-1, 6).tolist()
        turns, places = ([row[part] for row in rows] for part in (slice(3), slice(3, 6)))
        values = {key: value for key, value in values.items() if key != "extrinsicparameters"}
        if len(rows) == 1:
            yield name, {**values, "rvec": turns[0], "t": places[0]}
            return
    if isinstance(turns, list) and isinstance(places, list):
        with contextlib.suppress(InputError):
            numbers = [np.array(flat("a vector", value)) for value in (turns, places)]
            if len(numbers[0]) == len(numbers[1]) > 3 and len(numbers[0]) % 3 == 0:
                for i, (turn, place) in enumerate(zip(*(each.reshape(-1, 3).tolist() for each in numbers), strict=True)):
                    rest = {key: value for key, value in values.items() if key not in (*_RVEC, *_T)}
                    yield f"{i:05d}", {**rest, "rvec": turn, "t": place}
                return
    yield name, values


def _with_k(values: dict[str, Any]) -> dict[str, Any]:
    """The values, with K and distortion that stand number by number, or in an object of their own, at their usual names."""
    unread = [name for name in (*_RVEC, *_T) if isinstance(values.get(name), list) and any(map(_is_text, values[name]))]
    values = {_OF_CAMERA.sub("", name): value for name, value in values.items() if name not in unread}
    for name in (*_INNER, *_SIZE):
        if isinstance(inner := values.get(name), dict) and "data" not in inner:
            values = {**{key: value for key, value in values.items() if key != name}, **_by_name(inner)}
    if "mu" in values and "mv" in values:  # VINS' name for OpenCV's fisheye, whose k1 … k4 are k2 … k5 there
        names = {"mu": "fx", "mv": "fy", **{f"k{i + 1}": f"k{i}" for i in range(1, 5)}}
        values = {names.get(key, key): value for key, value in values.items()}
    parts = [_first(values, names) for names in _PARTS_OF_K]
    if _first(values, _K) is None and all(isinstance(part, int | float) for part in parts):
        used = {name for names in _PARTS_OF_K for name in names}
        values = {**{key: value for key, value in values.items() if key not in used}, "k": parts}
    return values


def _is_text(value: Any) -> bool:
    """True for what YAML has of a matrix in a list, as of all rvecs of a calibration: its tag alone."""
    return isinstance(value, str) and value.startswith("!!")


def _stereo(values: dict[str, Any], source: Source) -> list[tuple[str, dict[str, Any]]]:
    """The two cameras that OpenCV's stereoCalibrate finds: (name, values) each; none where there are none."""
    for names in _STEREO:
        sides = [_of_side(values, name) for name in names]
        if all(_is_camera(side) for side in sides):
            near = [beside for name in _BESIDE if (beside := source.file(name)) is not None]
            between = next(filter(None, map(_rotation_between, (values, *(_by_name(_storage(each)) for each in near)))), None)
            if between is not None:
                sides[0] |= {"r": np.eye(3).tolist(), "t": [0.0, 0.0, 0.0]}
                sides[1] |= between
            stem = f"{source.path.stem}_" if source.path else "camera_"
            return [(stem + name, side) for name, side in zip(names, sides, strict=True)]
    return []


def _is_pose_alone(source: Source) -> bool:
    """True if OpenCV's FileStorage has R and T and no K, as stereo_calib's extrinsics.yml."""
    is_storage = not source.is_folder and ("opencv-matrix" in source.text[:2000] or "<opencv_storage>" in source.text[:2000])
    return (
        is_storage and _rotation_between(_by_name(_storage(source))) is not None and not any(True for _ in _cameras_in(source))
    )


def _of_side(values: dict[str, Any], name: str) -> dict[str, Any]:
    """The values of one camera of two, by their names without its own, and the picture's size. Its R and P rectify it."""
    side = {key: value for key, value in values.items() if is_size(key)}
    for key, value in values.items():
        root = key.removeprefix(name) if len(name) > 1 and key.startswith(name) else key.removesuffix(name)
        if root != key and isinstance(value, list | dict) and (root in _OF_ONE or root in _DISTORTION):
            side["k" if root in _OF_ONE else "distcoeffs"] = value
    return side


def _rotation_between(values: Mapping[str, Any]) -> dict[str, Any] | None:
    """R and T from the first camera to the second; None where they are not said."""
    turn, translation = _first(values, _R), _first(values, _T)
    return None if turn is None or translation is None else {"r": turn, "t": translation}


def _document(source: Source) -> Mapping[str, Any]:
    if source.is_folder:
        return {}
    if source.npz:
        return _arrays(source.npz)
    if source.document:
        return source.document
    if (k := _k_alone(source)) is not None:
        return {"k": k}
    if isinstance(source.json, list):
        return {f"camera_{i}": value for i, value in enumerate(source.json)}
    return _storage(source) if source.text.lstrip()[:1] == "<" or _SAYS_K.search(source.text) else {}


def _storage(source: Source) -> Mapping[str, Any]:
    return _xml(source) if source.text.lstrip()[:1] == "<" else source.yaml


def _is_stack(array: np.ndarray, name: str) -> bool:
    """True if there is one K, pose or part of a pose for each of several pictures, and not one alone."""
    if name in (*_RVEC, *_T):
        return array.ndim > 1 and array.size == 3 * len(array)
    return array.ndim == 3 and (name in _K or is_of_pose(name))


def _k_alone(source: Source) -> list[list[float]] | None:
    """The rows of K, which is all that the source holds, as an array, a list of JSON or three lines; else None."""
    try:
        if source.npy is not None:
            rows = source.npy.tolist()
        elif isinstance(source.json, list):
            rows = source.json
        elif source.is_binary or len(source.text) > 1000:
            return None
        else:
            rows = [[float(word) for word in re.split(r"[\s,]+", line.strip())] for line in source.text.strip().split("\n")]
        matrix = np.array(rows, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    is_k = (
        matrix.shape == (3, 3) and matrix[2].tolist() == [0, 0, 1] and matrix[1, 0] == 0 and min(matrix[0, 0], matrix[1, 1]) > 2
    )
    return rows if is_k else None


def _arrays(arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The arrays by their names; where there is one for each of several pictures, a camera for each."""
    names = {name: plain(name) for name in arrays}
    names = {
        name: each[:-1] if each[:-1] in (*_K, *_R, *_RVEC, *_T, *_EXTRINSIC, *_OTHER_POSE) else each
        for name, each in names.items()
    }
    stacked = {name: len(arrays[name]) for name, each in names.items() if _is_stack(arrays[name], each)}
    if len({*stacked.values()}) != 1:
        return {name: array.tolist() for name, array in arrays.items()}
    (count,) = {*stacked.values()}
    return {
        f"{i:05d}": {each: (arrays[name][i] if name in stacked else arrays[name]).tolist() for name, each in names.items()}
        for i in range(count)
    }


def _xml(source: Source) -> dict[str, Any]:
    root = source.xml
    if root is None or root.tag != "opencv_storage":
        return {}
    result: dict[str, Any] = {}
    for child in root:
        inner = {each.tag: (each.text or "").strip() for each in child}
        value = inner if inner else (child.text or "").strip()
        if child.tag != "_" and result.setdefault(child.tag, value) != value:  # _ is an item of a list
            raise InputError(f"{source.name} has the key {checks.quoted(child.tag)} twice, with other values: leave one out")
    return result


def _numbers(name: str, value: Any) -> tuple[float, ...]:
    """The numbers of a matrix: FileStorage's object with rows, cols and data, a list of lists, or a text."""
    if isinstance(value, dict):
        rows, columns = (value.get(key) for key in ("rows", "cols"))
        result = flat(name, value.get("data", []))
        if rows is not None and columns is not None:
            rows, columns = pixels(f"rows of {name}", rows), pixels(f"cols of {name}", columns)
            if len(result) != rows * columns:
                raise InputError(f"{name} has {counted(len(result), 'number')}: its rows and cols say {rows} × {columns}")
        return result
    return flat(name, value)


def matrix_of_k(values: Sequence[float], what: str) -> tuple[float, float, float, float]:
    """(fx, fy, cx, cy) of nine numbers, row after row, of a 3 × 4 or 4 × 4 that adds nothing, or of these four themselves.

    Raises InputError if it has no last row 0 0 1, or a focal length that is not above 0; NoPinholeError if it has skew.
    """
    if len(values) == 4:
        f_x, f_y, c_x, c_y = values
    else:
        if len(values) in (12, 16):
            if any(values[3:12:4]) or [*values[12:]] not in ([], [0, 0, 0, 1]):
                raise InputError(f"K of {what} has more than K in its fourth row or column: give nine numbers")
            values = [values[i] for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
        if len(values) != 9:
            raise InputError(f"K of {what} has {counted(len(values), 'number')}: give nine")
        f_x, skew, c_x, lower, f_y, c_y, *last = values
        if [lower, *last[:2]] != [0, 0, 0] or last[2] != 1:
            hint = "transpose it" if [values[1], values[2], values[5]] == [0, 0, 0] else "its last row should be 0 0 1"
            raise InputError(f"K of {what} is {checks.quoted([*values])}: {hint}")
        if abs(skew) > 1e-9 * abs(f_x):
            raise NoPinholeError(
                f"K of {what} has a skew of {skew:g} pixels, which no pinhole camera here has: rectify the pictures"
            )
    if not (f_x > 0 and f_y > 0):
        raise InputError(f"K of {what} has the focal lengths {f_x:g} and {f_y:g}: give numbers above 0")
    return f_x, f_y, c_x, c_y


def plane_of_k(values: Sequence[float], size: tuple[int, int], half: float, what: str) -> ViewPlane:
    """The view plane of K's numbers.

    half : the amount to add to its principal point.

    Raises InputError as `matrix_of_k` does, or if K can't count in pixels.
    """
    f_x, f_y, c_x, c_y = matrix_of_k(values, what)
    refuse_widths(f_x, f_y, c_x, c_y, size, what)
    return axes.view_plane(f_x, f_y, c_x + half, c_y + half, size)


def refuse_widths(f_x: float, f_y: float, c_x: float, c_y: float, size: tuple[int, int], what: str) -> None:
    """Raise InputError if K's numbers can't count in pixels."""
    if max(f_x, f_y) < max(size) / _WIDEST and max(abs(c_x), abs(c_y)) < 2:
        raise InputError(
            f"K of {what} has the focal length {f_x:g} and the principal point {c_x:g}, {c_y:g}, which seem to count in widths "
            "of the picture: multiply its rows by the width and the height"
        )


def of_window(plane: ViewPlane, values: Mapping[str, Any], what: str) -> tuple[ViewPlane, tuple[str, ...]]:
    """The view plane of the pixels that a ROS driver sends, of that of the whole sensor which it calibrates; and notes.

    values : `roi` of ROS' camera_info, a window of the sensor in its own pixels (0 × 0: all of it), and `binning_x` and
    `binning_y`, how many of these are one of the picture (0: one), with underscores or without.
    """
    record = Record({plain(key): value for key, value in values.items()}, what)
    x, y = (record.number(f"binning{side}", 1.0, 0, 1e4) or 1.0 for side in "xy")
    roi = record.record("roi") if "roi" in record else Record({}, f"roi of {what}")
    left, top, width, height = (roi.number(key, 0.0, 0, 1e9) for key in ("x_offset", "y_offset", "width", "height"))
    if (x, y, left, top, width, height) == (1, 1, 0, 0, 0, 0):
        return plane, ()
    if not all(map(float.is_integer, (x, y, left, top, width, height))):
        raise InputError(f"the roi or binning of {what} is no whole number of pixels: correct it")
    size = int((width or plane.width) // x), int((height or plane.height) // y)
    if min(size) < 1:
        raise InputError(f"the roi of {what} has no pixel left once {x:g} × {y:g} are one: correct it")
    (f_x, f_y), (c_x, c_y) = plane.distance, plane.principal_point
    cut = axes.view_plane(f_x / x, f_y / y, (c_x - left) / x, (plane.height - c_y - top) / y, size)
    notes = (
        f"{what} shows the window of its sensor from {left:g}, {top:g} on, {x:g} × {y:g} of its pixels as one: K was taken so"
    )
    return cut, (f"{notes}, in a picture of {size[0]} × {size[1]}",)


def told_of_pair(values: Mapping[str, Any], what: str) -> tuple[str, ...]:
    """The note that a camera is the second of a rectified pair, by the place that ROS' P says with its fourth column.

    values : by plain names; P is p or projection_matrix.
    """
    p = _first(values, ("p", "projectionmatrix"))
    numbers = _numbers(f"P of {what}", p) if isinstance(p, list | dict) else ()
    if len(numbers) != 12 or numbers[0] == 0 or not any((numbers[3], numbers[7])):
        return ()
    right, down = -numbers[3] / numbers[0], -numbers[7] / numbers[0]
    return (f"{what} stands {right + 0.0:g} right and {down + 0.0:g} down of its pair's first camera by P: that was left out",)


def coefficients(numbers: Sequence[float], what: str) -> dict[str, float]:
    """OpenCV's distortion coefficients by name. Raises InputError if they are more than OpenCV has."""
    if len(numbers) not in (0, 1, 2, 3, 4, 5, 8, 12, 14):
        raise InputError(f"{what} has {len(numbers)} distortion coefficients: OpenCV has 4, 5, 8, 12 or 14")
    return dict(zip(NAMES, numbers, strict=False))


def settled(
    numbers: Sequence[float] | dict[str, float], is_fisheye: bool, plane: ViewPlane, what: str, options: Options
) -> tuple[distortion.Lens | None, tuple[str, ...]]:
    """The lens of OpenCV's coefficients, in its order or by name, and notes.

    is_fisheye : true if they are those of `cv2.fisheye`, k1 … k4.

    Raises InputError if there are more than the model has.
    """
    if not isinstance(numbers, dict):
        numbers = dict(zip(("k1", "k2", "k3", "k4"), numbers, strict=False)) if is_fisheye else coefficients(numbers, what)
    if is_fisheye and not numbers.keys() <= {"k1", "k2", "k3", "k4"}:
        raise InputError(f"{what} has {', '.join(numbers)}: OpenCV's fisheye has k1, k2, k3 and k4")
    lens = distortion.fisheye(numbers) if is_fisheye else distortion.opencv(numbers)
    return distortion.settle(lens, plane, what, options.without_distortion)


def camera(name: str, values: Mapping[str, Any], options: Options) -> Camera:
    """The camera of values by their plain names; without K it sees as the options say.

    Raises InputError if they are no camera, or leave open what it is.
    """
    what = f"camera {checks.quoted(name)}"
    is_fisheye = says_fisheye(values, what)
    if {"t", "hw"} <= values.keys():
        return _of_infinigen(name, values, what, options)
    if (k := _first(values, _K)) is None:
        matrix, more = _pose(values, what, options)
        pinhole, more_of_pose = axes.pinhole(matrix, options.plane_or_refuse(what), what)
        return Camera(name, pinhole, False, (*more, *more_of_pose))
    size, stated = _size(values, what, options)
    plane = plane_of_k(_numbers(f"K of {what}", k), size, half_pixel(options), what)
    plane, windowed = of_window(plane, values, what)
    windowed += tuple(
        f"{what} has {name}, which was not taken: K counts in a picture of {size[0]} × {size[1]}"
        for name, value in values.items()
        if _MAY_CUT.match(name) and name not in _WINDOW and value not in (0, 1, [], {}, "", False)
    )
    bent = _coefficients(values, what, is_fisheye)
    if "inverse" in str(values.get("model", "")).lower() and any(
        bent.values() if isinstance(bent, dict) else bent
    ):  # RealSense's
        not_a_pinhole(what, f"of the model {checks.quoted(values['model'])}")
    lens, note = settled(bent, is_fisheye, plane, what, options)
    notes = told_of_half_pixel(options, "OpenCV") + windowed + note
    if options.base and not _says_pose(values):
        standing = axes.moved_back(Camera(name, options.base), options).pinhole
        pinhole = dataclasses.replace(standing, **vars(plane))
        return Camera(name, pinhole, stated, (*notes, "The text does not say where the camera stands: where it did"), lens=lens)
    matrix, more = _pose(values, what, options)
    if _first(values, (*_T, *_EXTRINSIC, *_OTHER_POSE)) is None:
        more += told_of_pair(values, what)
    pinhole, more_of_pose = axes.pinhole(matrix, plane, what)
    return Camera(name, pinhole, stated, (*notes, *more, *more_of_pose), lens=lens)


def _of_infinigen(name: str, values: Mapping[str, Any], what: str, options: Options) -> Camera:
    """Infinigen's K, T (camera to world, OpenCV's axes) and HW, whose principal point counts from the corner."""
    height, width = (pixels(f"HW of {what}", side) for side in checks.vector(f"HW of {what}", flat("HW", values["hw"]), 2))
    plane = plane_of_k(_numbers("K", _first(values, _K)), (width, height), half_pixel(options, "corner"), what)
    pinhole, notes = axes.pinhole(axes.of_opencv(_four_rows(values["t"], f"T of {what}")), plane, what)
    note = f"K, T and HW of {what} were taken as Infinigen's: T from the camera to the world, x right, y down, z into the view"
    return Camera(name, pinhole, True, (note, *notes))


def says_fisheye(values: Mapping[str, Any], what: str) -> bool:
    """True if a model that the values name is OpenCV's fisheye.

    Raises InputError if one of them is none that is known, whatever its coefficients are.
    """
    models = [
        value
        for key, value in values.items()
        if plain(key) in ("cameramodel", "distortionmodel", "model", "modeltype", "type", "distortiontype")
        and isinstance(value, str)
    ]
    named = values.get("distortionmodel", values.get("distortion_model"))
    if isinstance(named, str) and not _KNOWN_LENS.search(named.lower()) and not _OTHER_LENS.search(named.lower()):
        not_a_pinhole(what, f"of the unknown distortion model {checks.quoted(named)}")
    is_fisheye = [bool(_FISHEYE.search(model.lower())) for model in models]
    for model, known in zip(models, is_fisheye, strict=True):
        if not known and _OTHER_LENS.search(model.lower()):
            not_a_pinhole(what, f"of the model {checks.quoted(model)}")
    return any(is_fisheye)


def refuse_unknown_distortion(values: Mapping[str, Any], what: str) -> None:
    """Raise InputError if there is a distortion in words that nobody knows."""
    _coefficients(_by_name(values), what, False)


def _coefficients(values: Mapping[str, Any], what: str, is_fisheye: bool) -> Sequence[float] | dict[str, float]:
    """The distortion, in a list or as keys of their own. Raises InputError if there is one in words that nobody knows."""
    stated = _first(values, _DISTORTION)
    listed = _numbers("the distortion", stated) if stated is not None else ()
    if is_fisheye and len(listed) > 4:
        raise InputError(f"{what} has {len(listed)} distortion coefficients: OpenCV's fisheye has four")
    result: dict[str, float] = {}
    for name, value in values.items():
        if name in _DISTORTION or not _OTHER_DISTORTION.search(name) or isinstance(value, str) or value is None:
            continue
        numbers = [value] if isinstance(value, int | float) else list(_numbers(name, value))
        if name in NAMES and stated is None:
            result[name] = number(f"{name} of {what}", value)
        elif any(numbers):
            raise InputError(
                f"{what} says {name}, which may be lens distortion: call it distortion_coefficients, in OpenCV's order"
            )
    return result if stated is None else listed


def _size(values: Mapping[str, Any], what: str, options: Options) -> tuple[tuple[int, int], bool]:
    record = Record(dict(values), what)
    width, height = (next((name for name in names if name in values), None) for names in (_WIDTH, _HEIGHT))
    if width and height:
        return (record.size(width), record.size(height)), True
    if (both := _first(values, _SIZE)) is not None:
        numbers = _numbers(f"the size of {what}", both)
        if len(numbers) != 2:
            raise InputError(f"the size of {what} has {counted(len(numbers), 'number')}: give the width and the height")
        across, up = (pixels(f"the size of {what}", number) for number in numbers)
        return (across, up), True
    return options.size_or_refuse(what), False


def may_be_pose(name: str) -> bool:
    """True if a plain name may mean a pose in words that nobody knows."""
    return name not in _NO_POSE and _MAY_BE_POSE.search(name) is not None


def _says_pose(values: Mapping[str, Any]) -> bool:
    return any(is_of_pose(name) or may_be_pose(name) for name in values)


def _pose(values: Mapping[str, Any], what: str, options: Options) -> tuple[np.ndarray, tuple[str, ...]]:
    """Camera to world, 4 × 4 with columns u, v, w and the eye; and notes."""
    whole = next((name for name in (*_EXTRINSIC, *_OTHER_POSE, *_T) if _is_whole(name, values)), None)
    turn, vector, translation = (_first(values, names) for names in (_R, _RVEC, _T))
    if turn is not None and translation is None and "p" in values:  # ROS: a stereo pair's rectification
        turn = None
    if whole is not None and (whole not in _EXTRINSIC or (turn is None and vector is None)):
        ways = dict.fromkeys(_EXTRINSIC, "w2c_opencv") | dict.fromkeys(_BLENDERS, "c2w_opengl")
        way = options.pose or (ways | dict.fromkeys(_ON_BODY, "c2w_opencv")).get(whole)
        if way is None:
            raise InputError(f"{what} has {whole}, and {_UNSAID}")
        matrix, notes = _four_columns(_numbers(f"{whole} of {what}", values[whole]), f"{whole} of {what}")
        return _to_world(matrix, way, what), (_told_of(way), *notes)
    if turn is None and vector is None and translation is None:
        for name, value in values.items():
            if isinstance(value, list | dict) and may_be_pose(name):
                if options.pose is None:
                    raise InputError(f"{what} has {name}, and {_UNSAID}")
                numbers = _numbers(f"{name} of {what}", value)
                if len(numbers) not in (12, 16) or name.startswith("stereo"):  # from one camera to another
                    raise InputError(f"{what} has {name}, {_UNREAD}")
                matrix, notes = _four_columns(numbers, f"{name} of {what}")
                return _to_world(matrix, options.pose, what), (_told_of(options.pose), *notes)
        for names in _POSE_BY_NUMBER:
            if {*names} <= values.keys():
                raise InputError(f"{what} has {', '.join(names)}, {_UNREAD}")
        return axes.of_opencv(np.eye(4)), (f"{what} has no pose: it stands at the origin and looks along z, y down",)
    if (turn is None and vector is None) or translation is None:
        raise InputError(f"{what} has only a part of its pose: give R or rvec, and t")
    translation = checks.vector(f"t of {what}", _numbers(f"t of {what}", translation), 3)
    numbers = _numbers(f"R of {what}", turn if turn is not None else vector)
    if len(numbers) == 9:
        matrix = np.array(numbers).reshape(3, 3)
    elif len(numbers) == 3 and turn is None:
        matrix = of_rotation_vector(numbers, what)
    else:
        raise InputError(
            f"R of {what} has {counted(len(numbers), 'number')}: give nine, or as rvec the three of a rotation vector"
        )
    if turn is not None and vector is not None and len(numbers) == 9:
        both = _numbers(f"rvec of {what}", vector)
        if len(both) == 3 and np.abs(of_rotation_vector(both, what) - matrix).max() > 1e-3:
            raise InputError(f"R and rvec of {what} are different rotations: take one out")
    way = options.pose or "w2c_opencv"
    return _to_world(np.column_stack([matrix, translation]), way, what), (_told_of(way),)


def _is_whole(name: str, values: Mapping[str, Any]) -> bool:
    """True if a name has a whole pose, if it may have, and not a translation alone."""
    if name not in _T:
        return name in values
    value = values.get(name)
    return isinstance(value, list | dict) and len(_numbers(name, value)) in (12, 16)


def _told_of(way: str) -> str:
    return _WAY if way == "w2c_opencv" else f"The pose was taken as: {POSES[way]}"


def _four_columns(numbers: Sequence[float], name: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """(3, 4) of twelve numbers or of sixteen, whose rows or columns come first as the 0 0 0 1 tells; and notes."""
    if len(numbers) == 12:
        return np.array(numbers).reshape(3, 4), ()
    matrix = np.array(numbers).reshape(4, 4) if len(numbers) == 16 else np.zeros((4, 4))
    by_rows, by_columns = (last.tolist() == [0, 0, 0, 1] for last in (matrix[3], matrix[:, 3]))
    if by_rows:
        return matrix[:3], ()
    if not by_columns:
        raise InputError(f"{name} is not 3 × 4 or 4 × 4 with the last row 0 0 0 1: correct it")
    return matrix.T[:3], (f"{name} has 0 0 0 1 as its last column: its columns were taken as rows",)


def _to_world(matrix: np.ndarray, way: str, what: str) -> np.ndarray:
    """Camera to world with columns u, v, w and the eye, of (3, 4) that is one of POSES."""
    if way.startswith("c2w"):
        whole = np.vstack([matrix, [0.0, 0.0, 0.0, 1.0]])
        return axes.of_opencv(whole) if way == "c2w_opencv" else whole
    rows = matrix if way == "w2c_opencv" else matrix * [[1.0], [-1.0], [-1.0]] + 0.0
    return axes.from_world_to_camera(rows[:, :3], tuple(rows[:, 3].tolist()), what)
