"""A scene of BOP's: cameras, objects' poses, what of them is seen, depth and masks, of many pictures.

    scene_camera.json     K, the pose (cameras/bop.py) and depth_scale, PNG to millimeters
    scene_gt.json         of each instance its object's number, R and t from the model to the camera; our instance_id beside
    scene_gt_info.json    its boxes and counts of pixels
    objects.json          what BOP has no place for: which object each number is, and the matrix that makes the model of it
    depth/ mask/ mask_visib/ rgb/

Lengths are millimeters, of a scene whose unit is a meter; (0, 0) is the center of the first pixel; boxes are [x, y, w, h] with
w = greatest − least column, one less than COCO's; all as BOP's toolkit has it. A picture shows no more of a whole object than
lies within: px_count_all, bbox_obj and visib_fract end there, too. Each instance has both masks, of what is hidden an empty
one, since the toolkit opens all of them.

**Models.** A pose is a rotation, so that an object's scale belongs to its model: A = R S, S symmetric, is unique (the polar
decomposition), and what has the same name, box and S is the same object. Where A mirrors, S does. The models themselves are not
written: labels have no meshes.

Sources: bop_toolkit: docs/bop_datasets_format.md, calc_gt_info and calc_2d_bbox; load_masks of bop_scenewise and calc_gt_coco.
"""

import json
import shutil
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import cameras, machine
from ..errors import InputError
from ..files import folder_written_whole
from ..pinhole import Pinhole
from ..png import encoded
from . import files, masks
from .coco import Document, category, read_pictures, with_mask

_SCENE = ("scene_camera", "scene_gt", "scene_gt_info")
_FILES = ("depth", "mask", "mask_visib", "objects.json", *(f"{name}.json" for name in _SCENE))

_MILLIMETERS = 1000.0
"""In a meter."""

_SAME = 1e-6
"""The tolerance of one object's figures from picture to picture: float32's rounding of a matrix, and a little more."""


def write(
    folder: Path, output: Path, progress: Callable[[float], None] = lambda share: None, overwrite: bool = False
) -> dict[str, int]:
    """Write a new folder of all pictures' labels, whole or not at all.

    folder : a folder of label files that have depth, masks and amodal masks, and pictures as PNG or JPEG beside them, if there
        are any.
    output : a folder that is not there yet, or is empty.
    progress : called with the share of the pictures that are written.
    overwrite : true if `output` may be a scene that was written so.

    Returns how many images, instances and objects there are, and how many of the images have a picture in rgb.

    Raises InputError if there are no label files, one lacks something or can't be read, or the folder can't be written.
    """
    progress(0.0)
    pictures, _ = read_pictures(folder)
    objects = _Objects(pictures)
    scene: dict[str, dict[str, Any]] = {name: {} for name in _SCENE}

    with (
        folder_written_whole(output, lambda there: overwrite and files.holds(there, _FILES, (*_FILES, "rgb"))) as temporary,
        ThreadPoolExecutor(machine.cores()) as threads,
    ):
        for kind in ("depth", "mask", "mask_visib"):
            (temporary / kind).mkdir()
        for number, (path, document) in enumerate(pictures):
            with files.understood(path):
                parts = _picture(path, document, objects, temporary, number, threads)
            for name, each in zip(scene, parts, strict=True):
                scene[name][str(number)] = each
            progress((number + 1) / len(pictures))
        for name, values in {**scene, "objects": objects.to_json()}.items():
            (temporary / f"{name}.json").write_text(_lines(values), encoding="utf-8", newline="\n")
        copied = sum(_copy_rgb(path, document, temporary, number) for number, (path, document) in enumerate(pictures))
    count = sum(len(poses) for poses in scene["scene_gt"].values())
    return {"images": len(pictures), "instances": count, "objects": len(objects.to_json()), "rgb": copied}


def _picture(
    path: Path, document: Document, objects: "_Objects", output: Path, number: int, threads: ThreadPoolExecutor
) -> tuple[Any, Any, Any]:
    """The entries of a picture in the three files; its depth and masks are written."""
    depth = files.passes(path, document, ("Depth",))
    if not depth:
        raise InputError(f"{path} has no depth: render it with --labels depth")
    with_mask("visible", path, document)
    levels = files.depth_levels(depth["Depth"][..., 0], document["depth_png_steps"])
    (output / "depth" / f"{number:06d}.png").write_bytes(encoded(levels))
    instances = with_mask("amodal", path, document)
    nothing = encoded(np.zeros(levels.shape, np.uint8))

    def write_masks(place: int) -> int:
        """Write the masks of an instance; returns how many pixels of the whole one have a depth."""
        each, name = instances[place], f"{number:06d}_{place:06d}.png"
        whole = masks.decoded(each["amodal"]["segmentation"])
        visible = encoded(_levels(masks.decoded(each["visible"]["segmentation"]))) if each["visible"] else nothing
        (output / "mask" / name).write_bytes(encoded(_levels(whole)))
        (output / "mask_visib" / name).write_bytes(visible)
        return int(np.count_nonzero(levels[whole]))

    valid = threads.map(write_masks, range(len(instances)))
    matrices = np.array([each["object_to_camera"] for each in instances]).reshape(-1, 4, 4)
    turns, _ = _turned_and_stretched(matrices[:, :3, :3])
    poses = [
        {
            "obj_id": objects.number(each),
            "cam_R_m2c": turn.ravel().tolist(),
            "cam_t_m2c": (_MILLIMETERS * matrix[:3, 3]).tolist(),
            "instance_id": each["id"],
        }
        for each, turn, matrix in zip(instances, turns, matrices, strict=True)
    ]
    seen = [_seen(each, pixels) for each, pixels in zip(instances, valid, strict=True)]
    return {**_camera(document), "depth_scale": _MILLIMETERS / document["depth_png_steps"]}, poses, seen


class _Objects:
    """The objects of all pictures, numbered from 1: in the order of their names, and those of one name as they appear."""

    def __init__(self, pictures: list[tuple[Path, Document]]) -> None:
        alike: dict[str, list[_Object]] = {}
        self._object_of: dict[tuple[Any, ...], _Object] = {}
        for path, document in pictures:
            with files.understood(path):
                for each in document["instances"]:
                    if (key := self._key(each)) not in self._object_of:
                        self._object_of[key] = _object_of(each, alike.setdefault(category(each), []))
        self._every = [(name, each) for name in sorted(alike) for each in alike[name]]
        self._numbers = {id(each): number for number, (_, each) in enumerate(self._every, start=1)}

    def number(self, instance: Document) -> int:
        return self._numbers[id(self._object_of[self._key(instance)])]

    def to_json(self) -> dict[str, Any]:
        return {
            str(number): {"name": name, "box": each.box, "object_to_model": (_MILLIMETERS * each.stretch).tolist()}
            for number, (name, each) in enumerate(self._every, start=1)
        }

    @staticmethod
    def _key(instance: Document) -> tuple[Any, ...]:
        """All that decides which object an instance is; what stands still has one in all pictures."""
        box, rows = instance["box"], instance["object_to_world"][:3]
        return category(instance), *box["min"], *box["max"], *(number for row in rows for number in row[:3])


class _Object(NamedTuple):
    """An object by which instances are told to be of one model.

    box : the bounding box of the label.
    stretch : the stretch S of the object's matrix.
    figures : a row of nine figures for the box, and one for the stretch.
    """

    box: dict[str, Any]
    stretch: NDArray
    figures: NDArray


def _object_of(instance: Document, known: list[_Object]) -> _Object:
    """The object that an instance is, of those known; which a new one joins."""
    box = instance["box"]
    stretch = _turned_and_stretched(np.array(instance["object_to_world"])[:3, :3])[1]
    new = _Object(box, stretch, np.array([[*box["min"], *box["max"], 0, 0, 0], stretch.ravel()]))
    if known:
        off = np.abs(np.array([each.figures for each in known]) - new.figures).max(axis=-1)
        alike = (off <= _SAME * np.abs(new.figures).max(axis=-1)).all(axis=-1)
        if alike.any():
            return known[int(alike.argmax())]
    known.append(new)
    return new


def _turned_and_stretched(matrices: NDArray) -> tuple[NDArray, NDArray]:
    """R and S of each matrix, A = R S: (..., 3, 3)."""
    left, _, right = np.linalg.svd(matrices)
    turns = left @ right
    turns *= np.sign(np.linalg.det(turns))[..., None, None]
    return turns, turns.swapaxes(-1, -2) @ matrices


def _levels(mask: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """A mask as a picture of 0 and 255."""
    return np.uint8(255) * mask


def _seen(instance: Document, valid: int) -> Document:
    whole, visible = instance["amodal"], instance["visible"]
    return {
        "bbox_obj": _box(whole if visible else None),
        "bbox_visib": _box(visible),
        "px_count_all": whole["area"],
        "px_count_valid": valid,
        "px_count_visib": visible["area"] if visible else 0,
        "visib_fract": instance["visible_fraction"],
    }


def _box(mask: Document | None) -> list[int]:
    x, y, width, height = mask["bbox"] if mask else (-1, -1, 0, 0)
    return [x, y, width - 1, height - 1]


def _camera(document: Document) -> Document:
    picture = document["picture"]
    camera = cameras.Camera(picture, Pinhole(**document["camera"]), image=picture, lens=files.lens(document))
    text = cameras.write([camera], "bop", cameras.Options(scale=1 / _MILLIMETERS))
    assert isinstance(text, str)
    return json.loads(text)["0"]


def _copy_rgb(path: Path, document: Document, output: Path, number: int) -> bool:
    """True if there is a picture."""
    picture = files.photograph(path, document)
    if picture is None:
        return False
    (output / "rgb").mkdir(exist_ok=True)
    shutil.copyfile(picture, output / "rgb" / f"{number:06d}{picture.suffix.replace('jpeg', 'jpg')}")
    return True


def _lines(values: dict[str, Any]) -> str:
    """JSON, a line for each key."""
    return "{\n" + ",\n".join(f' "{key}": {json.dumps(value)}' for key, value in values.items()) + "\n}\n"
