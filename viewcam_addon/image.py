"""EXR files: pass names, the one row flip, attributes, whole-or-nothing writing.

In memory a picture is a set of passes, each (height, width, channels) float32, its rows from the **bottom**, as the text counts
them; files store rows from the top, and the flip happens here and nowhere else. Passes are named as Blender 5 names them; the
names of older versions are read as the same passes. Channels are named as Cycles names them in a multilayer file
(`ViewLayer.Depth.Z`), so that Blender and any EXR viewer can open the tracer's files and this reader opens Cycles'.

The camera travels with the picture: as the standard attributes worldToCamera and worldToNDC (float32 matrices for row vectors,
as OpenEXR has them) and, in full precision, as JSON in our own attribute.

Files are compressed by run lengths (RLE). Of the 14 channels of a geometry picture of 1920 × 1080, 116 MB, that takes two cores
0.17 s of their time and leaves 30 MB; ZIP, Blender's choice, 0.37 s and 19 MB; PIZ 0.52 s and 17 MB; no compression 0.09 s, and
then the disk is waited for. Pictures of light are half as large again as with ZIP, in 0.4 times its time. Tracing a geometry
picture takes 0.2 s: compressing should not take longer.

OpenEXR is the format's own project. Rejected: imageio and OpenCV (no multi-part files, no attributes); the compressions that
OpenEXR learned last (HTJ2K, ZSTD), which Blender can't read. It is imported where it is needed, because Blender's own process
must not have a second copy of that library.
"""

import contextlib
import dataclasses
import difflib
import json
import math
import os
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import machine
from .errors import InputError, several
from .files import written_whole
from .pinhole import Pinhole, ViewPlane
from .terminal import silent_libraries


@dataclass(frozen=True)
class _Pass:
    """A pass as files and Blender have it.

    channels : the channels' names in the order of the pass's last axis, as Cycles names them.
    setting : the property of Blender's view layers that asks for it, of what is not the tracer's own; Combined is always there.
    older : its name in the files of Blender 4.
    """

    channels: str
    setting: str | None = None
    older: str | None = None


# Two are the tracer's own, by which a tolerance can be derived: Magnitude, that float32's relative rounding applies to at a
# hit, in world units (its largest coordinate, plus the distance times the slenderness of the triangle), and Facing, the cosine
# between ray and true normal. The core (integrators/geometry.h) numbers them in this order.
_GEOMETRY = {
    "Depth": _Pass("Z", "use_pass_z"),
    "Position": _Pass("XYZ", "use_pass_position"),
    "Normal": _Pass("XYZ", "use_pass_normal"),
    "UV": _Pass("UVA", "use_pass_uv"),
    "Object Index": _Pass("X", "use_pass_object_index", "IndexOB"),
    "Material Index": _Pass("X", "use_pass_material_index", "IndexMA"),
    "Magnitude": _Pass("X"),
    "Facing": _Pass("X"),
}
# Variance is the tracer's own: the estimated variance of Combined's color, which is a mean of samples. Here, too, the order is
# the core's (film/film.h).
_LIGHT = {
    "Combined": _Pass("RGBA"),
    "Emission": _Pass("RGB", "use_pass_emit", "Emit"),
    "Environment": _Pass("RGB", "use_pass_environment", "Env"),
    "Diffuse Direct": _Pass("RGB", "use_pass_diffuse_direct", "DiffDir"),
    "Diffuse Indirect": _Pass("RGB", "use_pass_diffuse_indirect", "DiffInd"),
    "Diffuse Color": _Pass("RGB", "use_pass_diffuse_color", "DiffCol"),
    "Variance": _Pass("RGB"),
}
_RENDERED = _LIGHT | _GEOMETRY
# The number of samples of each pixel, in a picture of a wanted error.
_OPTIONAL = {"Sample Count": "X"}
# Labels, beside some of these: docs/labels.md says what they hold. X and Y of a flow are pixels to the right and down.
_LABELS = {
    "Distance": "X",
    "Camera Normal": "XYZ",
    "Object Position": "XYZ",
    "Instance": "X",
    **{
        f"{to} {name}": channels
        for to in ("Forward", "Backward")
        for name, channels in (("Flow", "XY"), ("Motion", "XYZ"), ("Hidden", "X"))
    },
}
# Cryptomatte's layers: id and share of one object, and of another.
COVERAGE_PASSES = tuple(f"CryptoObject{number:02}" for number in range(17))
CHANNELS = {name: each.channels for name, each in _LIGHT.items()} | _OPTIONAL
CHANNELS |= {name: each.channels for name, each in _GEOMETRY.items()} | _LABELS | dict.fromkeys(COVERAGE_PASSES, "rgba")
OLDER_NAMES = {each.older: name for name, each in _RENDERED.items() if each.older}
SETTINGS = {name: each.setting for name, each in _RENDERED.items() if each.setting}
"""Pass name → the property of a view layer that asks Blender for it."""

GEOMETRY_PASSES = tuple(_GEOMETRY)
LIGHT_PASSES = tuple(_LIGHT)
"""The two kinds of passes of a picture: where things are, and what light comes from them."""

BACKGROUND_DEPTH = 1e10
"""The Depth pass where there is nothing: Cycles' value."""

# Pixel aspect is float32 in Blender and in files; of a camera it is the quotient of two distances that were made with it.
_ASPECT_ROUNDING = 4 * 2.0**-24

_LAYER = "ViewLayer"
_CAMERA_ATTRIBUTE = "virtualPinhole"

_MOST_NAMED = 30  # channels in a sentence: those of some passes

# All channels are read one by one, and then put together as passes.
_COPIES = 2


@dataclass(frozen=True, eq=False)
class Image:
    """Passes of one picture and the camera that took it.

    passes : name → (height, width, channels) float32, rows from the bottom.
    camera : the camera of the picture, or None where the file does not tell.
    attributes : further text attributes of the file.
    halves : the passes that the file holds in half floats, of 11 bits.
    lossy : the compression of the file, if it changes pixels; else empty.
    """

    passes: dict[str, NDArray[np.float32]]
    camera: Pinhole | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    source: str = "the image"
    halves: frozenset[str] = frozenset()
    lossy: str = ""

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        height, width, _ = next(iter(self.passes.values())).shape
        return width, height

    def __getitem__(self, name: str) -> NDArray[np.float32]:
        """A pass by its name. Raises InputError if the picture does not have it."""
        if name not in self.passes:
            raise InputError(
                f"{self.source} has no pass {name!r} but {', '.join(self.passes) or 'none'}: render it with that pass"
            )
        return self.passes[name]


def read(path: str | os.PathLike[str], only: Collection[str] | None = None) -> Image:
    """Read an EXR of Cycles (4.2 to 5.2) or of the tracer; of several view layers the first.

    only : names of the passes to keep, all by default.

    Raises InputError if there is no such file, if it is no EXR or a damaged one, if it holds no known pass, or, by its header,
    a part of a picture only, another size than its camera's, or more than there is memory for.
    """
    file = _pixels(Path(path))
    channels = {name: each for name, each in _passes(file.channels).items() if only is None or name in only}
    if not channels:
        wanted = ", ".join(only or (*LIGHT_PASSES, *GEOMETRY_PASSES))
        raise InputError(
            f"{path} holds none of the passes {wanted} but the channels {several(list(file.channels))}: render a multilayer "
            "EXR with them"
        )
    return _image(channels, file, path)


def read_channels(path: str | os.PathLike[str], named: Mapping[str, Sequence[str]]) -> Image:
    """Read an EXR of which it is told what its channels hold.

    named : pass → its channels, each by its whole name, also with its part's before it, or by how that ends, `Depth.Z` for
        `ViewLayer.Depth.Z`.

    Raises InputError as `read` does, and if there is no such channel, or more than one.
    """
    file = _pixels(Path(path))
    pixels = file.channels

    def channel(wanted: str) -> NDArray[Any]:
        whole = file.with_parts.get(wanted, wanted)
        names = [whole] if whole in pixels else [name for name in pixels if name.endswith(f".{wanted}")]
        if len(names) == 1:
            return pixels[names[0]]
        if names:
            raise InputError(f"{path} has several channels {wanted!r}: name one of {_chosen(wanted, names)}")
        raise InputError(f"{path} has no channel {wanted!r}: name some of {_chosen(wanted, pixels)}")

    channels = {name: [channel(wanted) for wanted in channels] for name, channels in named.items()}
    return _image(channels, file, path)


def _chosen(wanted: str, names: Collection[str]) -> str:
    """Names of channels in a sentence, of many the most alike ones first."""
    likely = names if len(names) <= _MOST_NAMED else sorted(names, key=lambda name: -_likeness(wanted, name))
    return several([*likely], _MOST_NAMED)


def _likeness(wanted: str, name: str) -> float:
    return difflib.SequenceMatcher(None, wanted.casefold(), name.casefold()).ratio()


def text_attribute(path: str | os.PathLike[str], name: str) -> str:
    """A text attribute of a file, "" where it has none; without a pixel being read. Raises as `read` does of a header."""
    value = _headers(Path(path))[0].get(name)
    return value if isinstance(value, str) else ""


class _File(NamedTuple):
    """The content of a file.

    channels : name → pixels, rows from the top.
    with_parts : a channel's name with its part's before it → its name in `channels`.
    lossy : see `Image`.
    """

    channels: dict[str, NDArray[Any]]
    with_parts: dict[str, str]
    camera: Pinhole | None
    attributes: dict[str, str]
    lossy: str


def _image(channels: Mapping[str, Sequence[NDArray[Any]]], file: _File, path: str | os.PathLike[str]) -> Image:
    passes = {name: _stacked(each) for name, each in channels.items()}
    halves = frozenset(name for name, each in channels.items() if any(channel.dtype == np.float16 for channel in each))
    return Image(passes, file.camera, file.attributes, str(path), halves, file.lossy)


def _stacked(channels: Sequence[NDArray[Any]]) -> NDArray[np.float32]:
    """(height, width, channels), rows from the bottom."""
    stacked: NDArray[np.float32] = np.stack([channel[::-1] for channel in channels], axis=-1).astype(np.float32, copy=False)
    return stacked


def _pixels(path: Path) -> _File:
    """The channels of a file, its camera and its text attributes."""
    import OpenEXR

    headers = _headers(path)
    camera = _camera(headers[0].get(_CAMERA_ATTRIBUTE), path)
    frame = _frame(headers, path)
    width, height = frame.size
    if camera is not None and (camera.width, camera.height) != frame.size:
        other = f"{camera.width} × {camera.height}"
        raise InputError(f"{path} has {width} × {height} pixels and its camera {other}: render it again")
    count = sum(len(header["channels"]) * math.prod(_size(header["dataWindow"])) for header in headers)
    machine.check(f"the pixels of {path}", _COPIES * 4 * count, "render it smaller")
    try:
        with silent_libraries():
            parts = OpenEXR.File(str(path), separate_channels=True).parts
    except Exception as error:
        raise _unreadable(path, error) from error
    if len(parts) < len(headers):  # a part whose pixels fail is left out
        raise InputError(f"{path} is cut short or damaged, its pixels can't be read: render it again")
    named = Counter(name for part in parts for name in part.channels)
    # The names of channels that several parts have, as one for each eye, begin with the part's.
    channels: dict[str, NDArray[Any]] = {}
    with_parts = {}
    for part in parts:
        for name, channel in part.channels.items():
            whole = f"{part.name()}.{name}"
            with_parts[whole] = name if named[name] == 1 else whole
            channels[with_parts[whole]] = channel.pixels[_displayed(part.header)]
    attributes = {
        key: value for key, value in headers[0].items() if isinstance(value, str) and key not in (_CAMERA_ATTRIBUTE, "name")
    }
    return _File(channels, with_parts, camera, attributes, next(filter(None, map(_loss, parts)), ""))


def _loss(part: Any) -> str:
    """The name of a part's compression, if it changes pixels: of floats, of half floats, or of colors."""
    name = part.header["compression"].name.removesuffix("_COMPRESSION")
    kinds = {channel.pixels.dtype for channel in part.channels.values()}
    loses = {"PXR24": np.float32, "B44": np.float16, "B44A": np.float16}.get(name)
    return name if name.startswith("DWA") or (loses is not None and np.dtype(loses) in kinds) else ""


def _size(window: Any) -> tuple[int, int]:
    (left, top), (right, bottom) = np.array(window, dtype=np.int64).tolist()
    return right - left + 1, bottom - top + 1


def _displayed(header: Mapping[str, Any]) -> tuple[slice, slice]:
    """The rows and columns of a part's pixels that are the picture's, without what is rendered around it."""
    (left, top), _ = np.array(header["displayWindow"], dtype=np.int64) - np.array(header["dataWindow"], dtype=np.int64)[0]
    width, height = _size(header["displayWindow"])
    return slice(top, top + height), slice(left, left + width)


@dataclass(frozen=True)
class FrameSize:
    """The size of a file's pixels, by its header alone.

    size : width and height in pixels.
    aspect : a pixel's width over its height.
    """

    size: tuple[int, int]
    aspect: float

    def __str__(self) -> str:
        width, height = self.size
        return f"{width} × {height} pixels" + (
            "" if self.aspect == 1 else f", each {self.aspect:g} times as wide as it is high"
        )


def check_same_frames(paths: Sequence[str | os.PathLike[str]]) -> None:
    """Refuse files that can't be pictures of one camera, before any pixel of them is read.

    Raises InputError as `read` does of a header, or if they differ in their size, or in the shape of their pixels where both
    state one.
    """
    first, *others = (Path(path) for path in paths)
    expected = _frame(_headers(first), first)
    for path in others:
        frame = _frame(_headers(path), path)
        # Blender up to 4.2 writes 1 whatever its pixels are.
        stated = 1 not in (frame.aspect, expected.aspect)
        if frame.size != expected.size or (
            stated and not math.isclose(frame.aspect, expected.aspect, rel_tol=_ASPECT_ROUNDING)
        ):
            raise InputError(f"{path} has {frame} and {first} has {expected}: compare pictures of the same size")


def _headers(path: Path) -> list[dict[str, Any]]:
    """The header of each part."""
    import OpenEXR

    if not path.is_file():
        raise InputError(f"{path} {'is no file' if path.exists() else 'does not exist'}: check the name of the EXR file")
    try:
        with silent_libraries():
            headers = [part.header for part in OpenEXR.File(str(path), header_only=True).parts]
        if not headers:
            raise ValueError("it has no part")
        return headers
    except Exception as error:  # OpenEXR raises what its C++ raised, of no common class
        raise _unreadable(path, error) from error


_OTHERS = {b"\x89PNG": "a PNG", b"\xff\xd8\xff": "a JPEG", b"II*\0": "a TIFF", b"MM\0*": "a TIFF", b"#?RA": "Radiance's HDR"}
"""The beginnings of pictures that have no passes, and what they are."""


def _unreadable(path: Path, error: Exception) -> InputError:
    with contextlib.suppress(OSError), path.open("rb") as file:
        head = file.read(4)
        if kind := next((kind for begin, kind in _OTHERS.items() if head.startswith(begin)), None):
            return InputError(f"{path} is {kind}, which has no passes: render an EXR")
    return InputError(f"{path} can't be read as an EXR file ({_first_line(error)}): render it again")


def _frame(headers: Sequence[dict[str, Any]], path: Path) -> FrameSize:
    """The frame of all parts. What is not stored pixel by pixel, and the whole picture, is refused.

    A part of a picture (a data window that does not cover its display window) would have to be put in its place, with something
    around it that nobody rendered. What is rendered beyond the picture is left out.
    """
    import OpenEXR

    frames = set()
    for header in headers:
        data, display = (np.array(header[name], dtype=np.int64).tolist() for name in ("dataWindow", "displayWindow"))
        if header["type"] not in (OpenEXR.scanlineimage, OpenEXR.tiledimage):
            raise InputError(f"{path} holds several depths in each pixel: render it as an EXR that is not deep")
        if any((channel.xSampling, channel.ySampling) != (1, 1) for channel in header["channels"]):
            raise InputError(f"{path} has channels of less than all pixels: render it again")
        (left, top), (right, bottom) = display
        if not (data[0][0] <= left <= right <= data[1][0] and data[0][1] <= top <= bottom <= data[1][1]):
            raise InputError(
                f"{path} holds the pixels from {tuple(data[0])} to {tuple(data[1])} of a picture from {tuple(display[0])} to "
                f"{tuple(display[1])}: render all of it"
            )
        frames.add(FrameSize((right - left + 1, bottom - top + 1), float(header["pixelAspectRatio"])))
    if len(frames) > 1:
        raise InputError(f"{path} holds passes of different sizes: render it again")
    return frames.pop()


def write(path: str | os.PathLike[str], image: Image, is_bent: bool = False) -> None:
    """Write a 32-bit multilayer EXR, whole or not at all.

    is_bent : true if a lens bends the picture: then it has no worldToNDC and no camera of its own, which would be the
        pinhole's, but worldToCamera alone.

    Raises InputError if the folder can't be written or the disk is full.
    """
    channels = {
        f"{_LAYER}.{name}.{letter}": np.ascontiguousarray(array[::-1, :, i])
        for name, array in image.passes.items()
        for i, letter in enumerate(CHANNELS[name])
    }
    attributes: dict[str, Any] = dict(image.attributes)
    if image.camera is not None:
        attributes |= _camera_attributes(image.camera)
    if is_bent:
        attributes = {name: value for name, value in attributes.items() if name not in ("worldToNDC", _CAMERA_ATTRIBUTE)}
    _save(path, attributes, channels)


def write_rgba(path: str | os.PathLike[str], pixels: NDArray[np.float32]) -> None:
    """Write a plain 32-bit EXR of one picture. pixels : (height, width, 4), rows from the **top**. Raises as `write` does."""
    _save(path, {}, {letter: np.ascontiguousarray(pixels[..., i]) for i, letter in enumerate("RGBA")})


_DATA = ("Vector", "Denoising Depth", "Denoising Normal", "Crypto")
"""The beginnings of names of Blender's further passes that are no colors."""


def rewrite(path: str | os.PathLike[str], change: Callable[[NDArray[Any], bool], NDArray[Any]], plane: ViewPlane) -> None:
    """Write an EXR anew, with other pixels in the same channels; its texts stay, and what it says of its camera does not.

    change : a function: pixels (height, width, channels), rows from the **top**, and whether these are data, between which
        nothing may be interpolated → the new ones.
    plane : the new pixels' view plane, whose pixel aspect the file says.

    Raises InputError as `read` and `write` do.
    """
    file = _pixels(Path(path))
    channels, attributes = file.channels, file.attributes
    result: dict[str, NDArray[Any]] = {}
    for is_data in (False, True):
        names = [name for name in channels if _is_data(name) == is_data]
        if names:
            pixels = change(np.stack([channels[name] for name in names], axis=-1), is_data)
            result |= {name: np.ascontiguousarray(pixels[..., i]) for i, name in enumerate(names)}
    aspect = {"pixelAspectRatio": plane.distance[1] / plane.distance[0]}
    _save(path, attributes | aspect, {name: result[name] for name in channels})


def _is_data(channel: str) -> bool:
    """True if what lies between two numbers of a channel is neither, as of depths and indices."""
    *_, name, _ = ("", "", *channel.split("."))[-3:]
    return OLDER_NAMES.get(name, name) in _GEOMETRY or name.startswith(_DATA)


def _save(path: str | os.PathLike[str], attributes: Mapping[str, Any], channels: Mapping[str, NDArray[np.float32]]) -> None:
    import OpenEXR

    header = {"compression": OpenEXR.RLE_COMPRESSION, "type": OpenEXR.scanlineimage, **attributes}
    if hasattr(OpenEXR, "set_global_thread_count"):  # which is 0: it would compress in this thread alone
        OpenEXR.set_global_thread_count(machine.cores())
    with written_whole(path) as temporary:
        try:
            with silent_libraries():
                OpenEXR.File(header, dict(channels)).write(str(temporary))
        except RuntimeError as error:
            raise OSError(_first_line(error)) from error


def _passes(channels: dict[str, NDArray[Any]]) -> dict[str, list[NDArray[Any]]]:
    """The known passes of the first view layer, each as its channels in order."""
    components: dict[str, dict[str, dict[str, NDArray[Any]]]] = defaultdict(lambda: defaultdict(dict))
    for full_name, pixels in channels.items():
        layer, _, rest = full_name.rpartition(".")[0].rpartition(".")
        components[layer][OLDER_NAMES.get(rest, rest)][full_name.rpartition(".")[2]] = pixels
    for passes in components.values():
        complete = {
            name: [passes[name][letter] for letter in letters]
            for name, letters in CHANNELS.items()
            if name in passes and set(letters) <= set(passes[name])
        }
        if complete:
            return complete
    return {}


def _camera(text: str | None, path: Path) -> Pinhole | None:
    if text is None:
        return None
    try:
        return Pinhole(**json.loads(text))
    except (TypeError, ValueError, RecursionError) as error:
        raise InputError(f"{path} has a camera attribute that can't be read ({_first_line(error)}): render it again") from error


def _camera_attributes(camera: Pinhole) -> dict[str, Any]:
    """The exact camera, the shape of its pixels, and its matrices unless they are beyond float32."""
    to_camera, to_ndc = np.eye(4), np.zeros((4, 4))
    to_camera[:3, :3] = camera.picture_axes().T * (1, 1, -1)
    (d_x, d_y), (c_x, c_y) = camera.distance, camera.principal_point
    with np.errstate(all="ignore"):
        to_camera[3, :3] = -np.array(camera.eye) @ to_camera[:3, :3]
        # x and y of normalized device coordinates run over [−1, 1] across the picture; z is −1 at infinity, as OpenGL has it.
        to_ndc[0, 0], to_ndc[1, 1] = 2 * d_x / camera.width, 2 * d_y / camera.height
        to_ndc[2] = [1 - 2 * c_x / camera.width, 1 - 2 * c_y / camera.height, -1, -1]
        matrices = {"worldToCamera": to_camera, "worldToNDC": to_camera @ to_ndc}
        matrices = {name: matrix.astype(np.float32) for name, matrix in matrices.items()}
    finite = {name: matrix for name, matrix in matrices.items() if np.isfinite(matrix).all()}
    return {**finite, "pixelAspectRatio": d_y / d_x, _CAMERA_ATTRIBUTE: json.dumps(dataclasses.asdict(camera))}


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]
