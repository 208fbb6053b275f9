"""RealityCapture's and RealityScan's XMP, a file beside each picture or a folder of them, and its tables of cameras (CSV).

Rotation is world to camera, x right, y down, z into the view; Position is the eye. The focal length is that of 36 mm along the
picture's longer side, the principal point counts from the middle in units of that side. No file has a size: it is that of the
picture beside it, or given. `DistortionCoeficients` is how the program spells it.

    #name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2           RealityCapture's internal/external camera parameters
    #name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1, …            RealityScan's
    #name,x,y,z,heading,pitch,roll                                       poses alone; how the camera sees is given
    #name,tx,ty,tz,R00, …, R22,f_pix,px_pix,py_pix,k1,k2,t2,t1,k3,k4     OpenCV-compliant: R, t and pixels

In a table x, y, alt are the eye, and heading, pitch and roll turn a camera that looks down, the top of its picture north (y):
its axes in the world are Rz(−heading) Rx(pitch) Ry(roll). Columns of the lens and the principal point may be missing. A table
does not name the model of its lens: division has k1 alone, Brown's come with k2, and that is how they are told apart. Degrees
of longitude and latitude in place of x and y are refused.

Source: exported files; the vendor's formula of yaw, pitch and roll ("Registration export and camera orientations", forum of
RealityCapture) and its calibration.xml, in which the templates of these tables stand; nerfstudio's realitycapture_utils.py.
Other readers take 36 mm for the width of an upright picture in an XMP; a note says so.
"""

import csv
import math

import numpy as np

from .. import checks
from ..errors import InputError, counted
from ..pinhole import ViewPlane
from . import axes, distortion, naming, texts
from .camera import Camera, LeftOut, NoPinholeError, Options, not_a_pinhole
from .source import Source, flat, image_size, number

TITLE = "RealityCapture XMP and tables of cameras (CSV)"

_PICTURES = ("jpg", "jpeg", "png", "tif", "JPG", "JPEG", "PNG", "TIF")
_MODELS = ("perspective", "division", "brown")
_LENS = ("k1", "k2", "k3", "k4", "t1", "t2")
_NAMES = {"yaw": "heading", "z": "alt", "f_35mm": "f", "px_norm": "px", "py_norm": "py"}
_TURN = tuple(f"r{row}{column}" for row in range(3) for column in range(3))
_POSES = (("x", "y", "alt", "heading", "pitch", "roll"), ("tx", "ty", "tz", *_TURN))
_SPOT = 1e-3  # share of its distance from where the degrees begin, which 100 km are nearly anywhere
_LONGEST = 2000  # characters before the names of columns end


def recognizes(source: Source) -> bool:
    if source.is_folder:
        return any(map(recognizes, source.files("*.xmp")))
    if "capturingreality" in source.text[:2000].lower():
        return source.xml is not None
    return _columns(source) is not None


def read(source: Source, options: Options) -> list[Camera]:
    if columns := _columns(source):
        return _of_table(source, *columns, options)
    files = [file for file in source.files("*.xmp") if recognizes(file)] if source.is_folder else [source]
    left_out, cameras = LeftOut(), []
    for file in files:
        with left_out.unless_pinhole(naming.stem(file.path.stem) if file.path else "RealityCapture"):
            cameras.append(_camera(file, options))
    return left_out.with_notes(cameras)


def _camera(source: Source, options: Options) -> Camera:
    name = source.path.stem if source.path else "RealityCapture"
    what = f"the XMP of {name}"
    values = _values(source)
    for key in ("Rotation", "Position", "FocalLength35mm"):
        if not values.get(key):
            raise InputError(f"{what} has no {key}: export it with the camera's pose")
    size, image = None, None
    if source.path:
        for suffix in _PICTURES:
            path = source.path.with_suffix(f".{suffix}")
            if size := image_size(path):
                image = path.name
                break
    stated = size is not None
    width, height = size or options.size_or_refuse(what)
    longer = max(width, height)
    d = number(f"FocalLength35mm of {what}", values["FocalLength35mm"], 1e-6) / 36 * longer
    aspect = number(f"AspectRatio of {what}", values.get("AspectRatio") or "1", 1e-6)
    skew = number(f"Skew of {what}", values.get("Skew") or "0")
    if abs(skew) > 1e-9:
        raise NoPinholeError(f"{what} has a skew of {skew:g}, which no pinhole camera here has: undistort the pictures")
    right, down = (number(f"PrincipalPoint{side} of {what}", values.get(f"PrincipalPoint{side}") or "0") for side in "UV")
    plane = axes.view_plane(d, d * aspect, width / 2 + right * longer, height / 2 + down * longer, (width, height))
    notes: tuple[str, ...] = ()
    if height > width:
        notes += (f"{what} is of an upright picture: its focal length was taken for that of the longer side",)
    bent = flat(f"the distortion of {what}", values.get("DistortionCoeficients") or values.get("DistortionCoefficients") or "0")
    numbers = dict(zip(_LENS, bent, strict=False))
    model = values.get("DistortionModel") or "perspective"
    if not model.lower().startswith(_MODELS):
        not_a_pinhole(what, f"of the unknown DistortionModel {checks.quoted(model)}")
    lens, note = distortion.settle(_lens(model.lower(), numbers), plane, what, options.without_distortion)
    turn, eye = flat(f"Rotation of {what}", values["Rotation"]), flat(f"Position of {what}", values["Position"])
    if len(turn) != 9 or len(eye) != 3:
        has = f"{counted(len(turn), 'number')} of a rotation and {len(eye)} of a position"
        raise InputError(f"{what} has {has}: it should have 9 and 3")
    matrix = np.eye(4)
    matrix[:3, :3] = np.array(turn).reshape(3, 3).T
    matrix[:3, 3] = eye
    pinhole, more = axes.pinhole(axes.of_opencv(matrix), plane, what)
    return Camera(naming.stem(name), pinhole, stated, (*notes, *note, *more), image, lens=lens)


def _lens(model: str, numbers: dict[str, float]) -> distortion.Lens:
    if model == "division" and "k1" in numbers:
        return distortion.division(numbers["k1"], "k1") if numbers["k1"] else distortion.opencv({})
    return distortion.opencv(
        {
            **{name: numbers.get(name, 0.0) for name in ("k1", "k2", "k3")},
            "r8": numbers.get("k4", 0.0),
            "p1": numbers.get("t2", 0.0),
            "p2": numbers.get("t1", 0.0),
        },
        numbers,
    )


def _values(source: Source) -> dict[str, str]:
    """Attributes and child elements by name, wherever in the XMP."""
    result: dict[str, str] = {}
    for element in source.xml.iter() if source.xml is not None else ():
        result |= element.attrib
        if text := (element.text or "").strip():
            result[element.tag] = text
    return result


def _columns(source: Source) -> tuple[list[str], int] | None:
    """The names of a table's columns, RealityCapture's, and the number of their line; None if it is none."""
    for index, line in enumerate(source.text[:_LONGEST].split("\n")[:-1][:10]):
        names = [_NAMES.get(name, name) for name in line.strip().lower().lstrip("# ").split(",")]
        if names[0] == "name" and any({*pose} <= {*names} for pose in _POSES):
            return names, index
    return None


def _of_table(source: Source, columns: list[str], head: int, options: Options) -> list[Camera]:
    lines = source.text.split("\n")
    rows = [
        (index, row)
        for index, row in enumerate(csv.reader(lines[head + 1 :]), start=head + 2)
        if "".join(row).strip() and not row[0].startswith("#")
    ]
    names = naming.distinct([row[0] for _, row in rows])
    cameras = []
    for (index, row), name in zip(rows, names, strict=True):
        what = f"line {index} of {source.name}"
        if len(row) != len(columns):
            raise InputError(f"{what} has {counted(len(row), 'column')} and their names are {len(columns)}: export it again")
        values = {
            column: number(f"{column} of {what}", value)
            for column, value in zip(columns[1:], row[1:], strict=True)
            if value.strip()
        }
        cameras.append(_of_row(name, row[0], values, source, options, what))
    _refuse_degrees(np.array([camera.pinhole.eye for camera in cameras]).reshape(-1, 3), source)
    return cameras


def _of_row(name: str, path: str, values: dict[str, float], source: Source, options: Options, what: str) -> Camera:
    pose = next((pose for pose in _POSES if {*pose} <= values.keys()), None)
    if pose is None:
        raise InputError(f"{what} has no whole pose: export it with the cameras' positions and orientations")
    if pose[0] == "tx":
        turn = np.array([values[key] for key in _TURN]).reshape(3, 3)
        matrix = axes.from_world_to_camera(turn, [values[key] for key in ("tx", "ty", "tz")], what)
    else:
        matrix = np.eye(4)
        degrees = -values["heading"], values["pitch"], values["roll"]
        about_z, about_x, about_y = map(texts.turn, degrees, ((0, 0, 1), (1, 0, 0), (0, 1, 0)))
        matrix[:3, :3] = about_z @ about_x @ about_y
        matrix[:3, 3] = [values[key] for key in ("x", "y", "alt")]
    plane, stated = _plane(values, path, source, options, what)
    numbers = {key: values[key] for key in _LENS if key in values}
    model = "division" if {key for key, value in numbers.items() if value} == {"k1"} else "brown"
    lens, note = distortion.settle(_lens(model, numbers), plane, what, options.without_distortion)
    if lens:
        note += (f"The table does not name the lens's model: its terms were taken for those of RealityCapture's {model}",)
    pinhole, more = axes.pinhole(matrix, plane, what)
    return Camera(name, pinhole, stated, (*note, *more), path, lens=lens)


def _plane(values: dict[str, float], path: str, source: Source, options: Options, what: str) -> tuple[ViewPlane, bool]:
    """The view plane of a row, and whether its size is the picture's."""
    if "f" not in values and "f_pix" not in values:
        return options.plane_or_refuse(what), False
    file = naming.near(path, source.path.parent) if source.path else None
    size = image_size(file) if file else None
    width, height = size or options.size_or_refuse(what)
    longer = max(width, height)
    if "f_pix" in values:
        f, c_x, c_y = values["f_pix"], values.get("px_pix", width / 2), values.get("py_pix", height / 2)
    else:
        f = values["f"] / 36 * longer
        c_x, c_y = width / 2 + values.get("px", 0.0) * longer, height / 2 + values.get("py", 0.0) * longer
    if f <= 0:
        raise InputError(f"{what} has the focal length {f:g}: give one above 0")
    return axes.view_plane(f, f, c_x, c_y, (width, height)), size is not None


def _refuse_degrees(eyes: np.ndarray, source: Source) -> None:
    """Raise InputError where x and y are longitude and latitude: a spot on the globe, small against its place there."""
    if len(eyes) < 2:
        return
    at, extent = eyes[:, :2].mean(axis=0), np.ptp(eyes[:, :2], axis=0)
    if abs(at[0]) <= 180 and abs(at[1]) <= 90 and 0 < math.hypot(*extent) < math.hypot(*at) * _SPOT:
        raise InputError(
            f"x and y in {source.name} seem to be degrees of longitude and latitude: export it in a local or projected "
            "coordinate system"
        )
