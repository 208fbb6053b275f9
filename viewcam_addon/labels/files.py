"""Labels as files beside a picture: one EXR of all passes, PNGs and .flo for who wants those, a JSON that says what is what.

Each appears whole, and the JSON last: where it stands, so do the others. An older one goes first.
"""

import contextlib
import json
import struct
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Never

import numpy as np
from numpy.typing import NDArray

from .. import image
from ..cameras import Camera
from ..cameras.distortion import Lens
from ..cameras.source import image_size
from ..errors import InputError
from ..files import check_writable, is_replaced, read_bytes, written_whole
from ..image import BACKGROUND_DEPTH
from ..pinhole import Pinhole
from ..png import encoded
from . import DEPTH_STEPS, FILES, endings
from .scene_labels import Labels

_FORMAT, _VERSION = "virtual-pinhole-labels", 1

_LARGEST = 1e100
"""The largest number of a label file: nobody can compute with larger ones, and float32 holds none."""

_LARGEST_ID = 2**24 - 1

_ARE_VALUES: dict[str, Callable[[NDArray[np.float32]], NDArray[np.bool_]]] = {
    "Depth": lambda depth: depth > 0,
    "Instance": lambda ids: (ids >= 0) & (ids <= _LARGEST_ID) & (ids == np.rint(ids)),
}
"""The numbers that a pass may hold, of those that would be an index or a divisor; nan is none."""

_UNKNOWN_FLOW = 1e10
"""The mark of Middlebury's format where no flow is known; everything above 1e9 counts as that."""


def of_picture(path: Path, ending: str) -> Path:
    """The label file that belongs to a picture: shot.exr → shot.labels.json."""
    return path.with_name(f"{path.stem}.{ending}")


def write(path: Path, labels: Labels, depth_steps: float = DEPTH_STEPS) -> list[Path]:
    """Write the labels of a picture beside it.

    path : the picture's path.
    depth_steps : the steps of the 16-bit PNG in a scene unit; what is nearer than half a step or farther than 65535 of them is
        0, as is a pixel that shows nothing.

    Returns the files, the JSON last.

    Raises InputError if they can't be written.
    """
    if not is_replaced(path):
        raise InputError(f"{path} is no file beside which labels could stand: give the name of one")
    passes = labels.image.passes
    *others, told_in = (of_picture(path, ending) for ending in endings(passes))
    check_writable(told_in)
    if is_replaced(told_in):
        told_in.unlink(missing_ok=True)
    for each in others:
        if each.suffix == ".exr":
            image.write(each, labels.image, is_bent=labels.lens is not None)
            continue
        ending = each.name.removeprefix(f"{path.stem}.")
        content = _content(ending, passes[FILES[ending]][::-1], depth_steps)
        with written_whole(each) as temporary:
            temporary.write_bytes(content)
    with written_whole(told_in) as temporary:
        document = _document(path, labels, [each.name for each in others], depth_steps)
        temporary.write_text(json.dumps(document, allow_nan=False) + "\n", encoding="utf-8", newline="\n")
    return [*others, told_in]


def _content(ending: str, values: NDArray[np.float32], depth_steps: float) -> bytes:
    """The bytes of one of `FILES`.

    values : the values of its pass, rows from the top.
    """
    if ending == "depth.png":
        return encoded(depth_levels(values[..., 0], depth_steps))
    if ending == "instances.png":
        return encoded(id_colors(values[..., 0]))
    return middlebury(values) if ending.endswith(".flo") else encoded(np.uint8(255) * (values[..., 0] != 0).astype(np.uint8))


def read(path: Path) -> dict[str, Any]:
    """The content of a label file, with the keys that docs/labels.md names.

    Raises InputError if it can't be read, or is no such file.
    """
    try:
        result = json.loads(read_bytes(path), parse_constant=_refused)
        is_one = (result["format"], result["version"]) == (_FORMAT, _VERSION)
        if is_one:
            _check(result)
    except OSError as error:
        raise InputError(f"{path} can't be read ({error.strerror or error}): give the folder of label files") from error
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path} is no label file that can be read: write it again with viewcam render --labels") from error
    if not is_one:
        raise InputError(f"{path} is of another version or format: write it again with viewcam render --labels")
    return result


def _refused(constant: str) -> Never:
    raise ValueError(f"{constant} is no number of JSON")


def _check(document: dict[str, Any]) -> None:
    """Raise ValueError, LookupError, TypeError or AttributeError for what the writers of datasets could not use.

    So that they ask for no more memory than the picture has pixels, and write no file that nobody can read.
    """
    camera, _ = Pinhole(**document["camera"]), lens(document)
    size = camera.height, camera.width
    texts = [document["picture"], *document.get("passes", ())]
    if len({each["id"] for each in document["instances"]}) < len(document["instances"]):
        raise ValueError("two instances have one id")
    for each in document["instances"]:
        texts += [each["name"], each.get("category", "")]
        for point in each.get("keypoints", ()):
            texts += [point["name"], point.get("parent", "")]
            _check_numbers([point["x"], point["y"]], (2,))
            if point["visible"] not in (0, 1, 2):
                raise ValueError("a keypoint is seen, hidden or not there")
        if type(each["id"]) is not int or not 0 < each["id"] <= _LARGEST_ID:
            raise ValueError("an id is none")
        for name in ("object_to_world", "object_to_camera"):
            _check_numbers(each[name], (4, 4))
        for name in ("min", "max"):
            _check_numbers(each["box"][name], (3,))
        _check_numbers(each.get("visible_fraction", 0.0), ())
        for kind in ("visible", "amodal"):
            if (mask := each.get(kind)) is not None:
                _check_mask(mask, size)
    _check_numbers(steps := document["depth_png_steps"], ())
    if steps <= 0 or document["picture"] != Path(document["picture"]).name:
        raise ValueError("steps of depth are above 0, and the picture is beside its labels")
    for text in texts:
        text.encode("utf-8")


def _check_numbers(values: Any, shape: tuple[int, ...]) -> None:
    array = np.array(values)
    if array.shape != shape or array.dtype.kind not in "if" or not (np.abs(array) <= _LARGEST).all():
        raise ValueError(f"no {shape} numbers")


def _check_mask(mask: dict[str, Any], size: tuple[int, int]) -> None:
    counts, box = mask["segmentation"]["counts"], mask["bbox"]
    whole = [*box, mask["area"], *counts]
    if {*map(type, whole)} != {int} or min(whole) < 0 or len(box) != 4 or tuple(mask["segmentation"]["size"]) != size:
        raise ValueError("a mask is no mask of the picture")
    if sum(counts) != size[0] * size[1] or sum(counts[1::2]) != mask["area"] or mask["area"] == 0:
        raise ValueError("a mask's runs don't fill the picture")
    if box[0] + box[2] > size[1] or box[1] + box[3] > size[0]:
        raise ValueError("a mask's box is not within the picture")


@contextlib.contextmanager
def understood(path: Path) -> Iterator[None]:
    """A context that turns what a label file lacks into the sentence of `read`."""
    try:
        yield
    except InputError:
        raise
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        raise InputError(f"{path} is no label file that can be read: write it again with viewcam render --labels") from error


def refuse_own(folder: Path, output: Path) -> None:
    """Refuse an output that is one of the label files of a folder, or of their pictures; InputError."""
    if not output.is_file() or not folder.is_dir() or not output.parent.samefile(folder):
        return
    for path in folder.glob("*.labels.json"):
        ending = output.name.removeprefix(f"{name(path)}.")
        if ending in ("labels.json", "labels.exr", *FILES, "exr", "png", "jpg", "jpeg") and ending != output.name:
            raise InputError(f"{output} belongs to a picture of {folder}: give another name")


def name(path: Path) -> str:
    """The name of a label file's picture and of all that belongs to it: shot of shot.labels.json."""
    return path.name.removesuffix(".labels.json")


def lens(document: dict[str, Any]) -> Lens | None:
    """The lens that bends a label file's picture. Raises InputError for one that is none."""
    return Lens.from_json(document["lens"]) if "lens" in document else None


def camera(path: Path, document: dict[str, Any]) -> Camera:
    """The camera that a label file tells of, called as its picture. Raises InputError as `photograph` does."""
    picture_name = picture(path, document)
    return Camera(picture_name, Pinhole(**document["camera"]), image=picture_name, lens=lens(document))


def photograph(path: Path, document: dict[str, Any]) -> Path | None:
    """The PNG or JPEG of what a label file tells of, if one stands beside it. Raises InputError if it has another size."""
    candidates = (path.with_name(f"{name(path)}{suffix}") for suffix in (".png", ".jpg", ".jpeg"))
    for picture, size in ((each, image_size(each)) for each in candidates):
        if size == (document["camera"]["width"], document["camera"]["height"]):
            return picture
        if size:
            raise InputError(f"{picture} has {size[0]} × {size[1]} pixels and its labels have others: render both anew")
    return None


def picture(path: Path, document: dict[str, Any]) -> str:
    """The name of the picture that a label file tells of: of the PNG or JPEG beside it, or else of the EXR."""
    return (photograph(path, document) or Path(document["picture"])).name


def passes(path: Path, document: dict[str, Any], wanted: Sequence[str]) -> dict[str, NDArray[np.float32]]:
    """The passes of a label file's EXR that it has, of those wanted: (height, width, channels), rows from the **top**.

    Raises InputError if they can't be read, or are of another picture.
    """
    chosen = [each for each in wanted if each in document.get("passes", ())]
    if not chosen:
        return {}
    read = image.read(path.with_name(f"{name(path)}.labels.exr"), chosen)
    if read.size != (document["camera"]["width"], document["camera"]["height"]):
        raise InputError(f"{path} is of another picture than {read.source}: write both again with viewcam render --labels")
    for each, is_one in _ARE_VALUES.items():
        if each in chosen and not is_one(read[each]).all():
            raise InputError(f"{read.source} has numbers in {each} that are none of it: write it with viewcam render --labels")
    return {each: read[each][::-1] for each in chosen}


def _document(path: Path, labels: Labels, names: list[str], depth_steps: float) -> dict[str, Any]:
    return {
        "format": _FORMAT,
        "version": _VERSION,
        "picture": path.name,
        "camera": labels.image.camera and asdict(labels.image.camera),
        **({} if labels.lens is None else {"lens": labels.lens.to_json()}),
        "files": names,
        "passes": list(labels.image.passes),
        "depth_png_steps": depth_steps,
        "lost": labels.lost,
        "instances": labels.instances,
    }


def holds(folder: Path, least: Collection[str], most: Collection[str]) -> bool:
    """True if a folder holds all of the names `least`, and nothing but `most`: then it may be replaced by its like."""
    return {*least} <= {path.name for path in folder.iterdir()} <= {*most}


def depth_levels(depth: NDArray[np.float32], steps: float) -> NDArray[np.uint16]:
    """Depths in steps, to the nearest; 0 where nothing is, or what 16 bits can't hold: nothing wraps and nothing is clipped."""
    with np.errstate(over="ignore"):
        levels = np.rint(depth.astype(np.float64) * steps)
    return np.where((depth < BACKGROUND_DEPTH) & (levels <= 65535), levels, 0).astype(np.uint16)


def id_colors(ids: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Ids as COCO's panoptic PNG has them: R + 256 G + 65536 B; 0 where nothing is."""
    whole = ids.astype(np.uint32)
    return np.stack([whole & 255, whole >> 8 & 255, whole >> 16], axis=-1).astype(np.uint8)


def middlebury(flow: NDArray[np.float32]) -> bytes:
    """A .flo file. flow : (height, width, 2), rows from the top, pixels right and down, nan where unknown."""
    height, width, _ = flow.shape
    values = np.where(np.isfinite(flow).all(axis=-1, keepdims=True), flow, _UNKNOWN_FLOW).astype("<f4")
    return b"PIEH" + struct.pack("<ii", width, height) + values.tobytes()
