"""RealityCapture's XMP: a file beside each picture, or a folder of them.

Rotation is world to camera, x right, y down, z into the view; Position is the eye. The focal length is that of 36 mm along the
picture's longer side, the principal point counts from the middle in units of that side. An XMP has no size: it is that of the
picture beside it, or given. `DistortionCoeficients` is how the program spells it.

Source: exported files, and nerfstudio's realitycapture_utils.py. Other readers take 36 mm for the width, which differs for
upright pictures; a note says so.
"""

import numpy as np

from ..errors import InputError
from . import axes, distortion, naming
from .camera import Camera, LeftOut, NoPinholeError, Options
from .source import Source, flat, image_size, number

TITLE = "RealityCapture XMP"

_PICTURES = ("jpg", "jpeg", "png", "tif", "JPG", "JPEG", "PNG", "TIF")
_LENS = ("k1", "k2", "k3", "k4", "t1", "t2")


def recognizes(source: Source) -> bool:
    if source.is_folder:
        return any(map(recognizes, source.files("*.xmp")))
    return "capturingreality" in source.text[:2000].lower() and source.xml is not None


def read(source: Source, options: Options) -> list[Camera]:
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
    lens, note = distortion.settle(_lens(values.get("DistortionModel", ""), numbers), plane, what, options.without_distortion)
    turn, eye = flat(f"Rotation of {what}", values["Rotation"]), flat(f"Position of {what}", values["Position"])
    if len(turn) != 9 or len(eye) != 3:
        raise InputError(f"{what} has {len(turn)} numbers of a rotation and {len(eye)} of a position: it should have 9 and 3")
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
    for element in source.xml.iter():
        result |= element.attrib
        if text := (element.text or "").strip():
            result[element.tag] = text
    return result
