"""A scene of BOP's: cameras, objects' poses, what of them is seen, depth and masks, of many pictures.

    scene_camera.json     K, the pose (cameras/bop.py) and depth_scale, PNG to millimeters
    scene_gt.json         of each instance its object's number, R and t from the model to the camera; our instance_id beside
    scene_gt_info.json    its boxes and counts of pixels
    objects.json          what BOP has no place for: which object each number is, and the matrix that makes the model of it
    depth/ mask/ mask_visib/ rgb/

Lengths are millimeters, of a scene whose unit is a meter; (0, 0) is the center of the first pixel; boxes are [x, y, w, h] with
w = greatest − least column, one less than COCO's; all as BOP's toolkit has it. A picture shows no more of a whole object than
lies within: px_count_all, bbox_obj and visib_fract end there, too.

**Models.** A pose is a rotation, so that an object's scale belongs to its model: A = R S, S symmetric, is unique (the polar
decomposition), and what has the same name, box and S is the same object. Where A mirrors, S does. The models themselves are not
written: labels have no meshes.

Sources: bop_toolkit: docs/bop_datasets_format.md, calc_gt_info and calc_2d_bbox.
"""

import itertools
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import cameras
from ..errors import InputError
from ..files import folder_written_whole
from ..pinhole import Pinhole
from ..png import encoded
from . import files, masks
from .coco import Document, category, found, with_mask

_MILLIMETRES = 1000.0
"""In a meter."""

_SAME = 1e-6
"""The tolerance of one object's figures from picture to picture: float32's rounding of a matrix, and a little more."""


def write(folder: Path, output: Path) -> dict[str, int]:
    """Write a new folder of all pictures' labels, whole or not at all.

    folder : of label files that have depth, masks and amodal masks, and pictures as PNG or JPEG beside them, if there are any.
    output : must not be there yet, or be empty.

    Returns how many images, instances and objects there are, and how many of the images have a picture in rgb.

    Raises
    ------
    InputError
        if there are no label files, one lacks something or can't be read, or the folder can't be written.
    """
    pictures, _ = found(folder)
    objects = _Objects(pictures)
    scene: dict[str, dict[str, Any]] = {"scene_camera": {}, "scene_gt": {}, "scene_gt_info": {}}
    with folder_written_whole(output) as temporary:
        for kind in ("depth", "mask", "mask_visib"):
            (temporary / kind).mkdir()
        for number, (path, told) in enumerate(pictures):
            with files.understood(path):
                values = _picture(path, told, objects, temporary, number)
            for name, each in zip(scene, values, strict=True):
                scene[name][str(number)] = each
        for name, values in {**scene, "objects": objects.told()}.items():
            (temporary / f"{name}.json").write_text(_lines(values), encoding="utf-8", newline="\n")
        shown = sum(_copy_rgb(path, told, temporary, number) for number, (path, told) in enumerate(pictures))
    count = sum(len(poses) for poses in scene["scene_gt"].values())
    return {"images": len(pictures), "instances": count, "objects": len(objects.told()), "rgb": shown}


def _picture(path: Path, told: Document, objects: "_Objects", output: Path, number: int) -> tuple[Any, Any, Any]:
    """The entries of a picture in the three files; its depth and masks are written."""
    depth = files.passes(path, told, ("Depth",))
    if not depth:
        raise InputError(f"{path} has no depth: render it with --labels depth")
    with_mask("visible", path, told)
    levels = files.depth_levels(depth["Depth"][..., 0], told["depth_png_steps"])
    (output / "depth" / f"{number:06d}.png").write_bytes(encoded(levels))
    poses, seen = [], []
    for place, each in enumerate(with_mask("amodal", path, told)):
        whole, visible = (_mask(each[kind], levels.shape) for kind in ("amodal", "visible"))
        for kind, mask in (("mask", whole), ("mask_visib", visible)):
            (output / kind / f"{number:06d}_{place:06d}.png").write_bytes(encoded(np.uint8(255) * mask))
        poses.append({"obj_id": objects.number(each), **_pose(each), "instance_id": each["id"]})
        seen.append(_seen(each, int((levels[whole] > 0).sum())))
    return {**_camera(told), "depth_scale": _MILLIMETRES / told["depth_png_steps"]}, poses, seen


class _Objects:
    """The objects of all pictures, numbered from 1: in the order of their names, and those of one name as they appear."""

    def __init__(self, pictures: list[tuple[Path, Document]]) -> None:
        self._named: dict[str, list[tuple[int, dict[str, Any], NDArray]]] = {}
        alike: dict[str, list[tuple[dict[str, Any], NDArray]]] = {}
        for path, told in pictures:
            with files.understood(path):
                for each in told["instances"]:
                    known = alike.setdefault(category(each["name"]), [])
                    box, stretch = each["box"], _turned_and_stretched(each)[1]
                    if not any(_is_one(box, stretch, *other) for other in known):
                        known.append((box, stretch))
        numbers = itertools.count(1)
        for name in sorted(alike):
            self._named[name] = [(next(numbers), *each) for each in alike[name]]

    def number(self, instance: Document) -> int:
        box, stretch = instance["box"], _turned_and_stretched(instance)[1]
        return next(number for number, *other in self._named[category(instance["name"])] if _is_one(box, stretch, *other))

    def told(self) -> dict[str, Any]:
        return {
            str(number): {"name": name, "box": box, "object_to_model": (_MILLIMETRES * stretch).tolist()}
            for name, alike in self._named.items()
            for number, box, stretch in alike
        }


def _is_one(box: dict[str, Any], stretch: NDArray, its_box: dict[str, Any], its_stretch: NDArray) -> bool:
    return _are_same(stretch, its_stretch) and _are_same([box["min"], box["max"]], [its_box["min"], its_box["max"]])


def _are_same(some: Any, others: Any) -> bool:
    some, others = np.array(some), np.array(others)
    return bool(np.abs(some - others).max() <= _SAME * np.abs(some).max())


def _turned_and_stretched(instance: Document) -> tuple[NDArray, NDArray]:
    """R and S of the matrix from the object to the camera, A = R S."""
    matrix = np.array(instance["object_to_camera"])[:3, :3]
    left, _, right = np.linalg.svd(matrix)
    turn = left @ right
    turn *= np.sign(np.linalg.det(turn))
    return turn, turn.T @ matrix


def _pose(instance: Document) -> Document:
    place = _MILLIMETRES * np.array(instance["object_to_camera"])[:3, 3]
    return {"cam_R_m2c": _turned_and_stretched(instance)[0].ravel().tolist(), "cam_t_m2c": place.tolist()}


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


def _mask(told: Document | None, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    return masks.decoded(told["segmentation"]) if told else np.zeros(shape, bool)


def _camera(told: Document) -> Document:
    camera = cameras.Camera(told["picture"], Pinhole(**told["camera"]), image=told["picture"])
    return json.loads(cameras.write([camera], "bop", cameras.Options(scale=1 / _MILLIMETRES)))["0"]


def _copy_rgb(path: Path, told: Document, output: Path, number: int) -> bool:
    """True if there is a picture."""
    picture = files.photograph(path, told)
    if picture is None:
        return False
    (output / "rgb").mkdir(exist_ok=True)
    shutil.copyfile(picture, output / "rgb" / f"{number:06d}{picture.suffix.replace('jpeg', 'jpg')}")
    return True


def _lines(values: dict[str, Any]) -> str:
    """JSON, a line for each key."""
    return "{\n" + ",\n".join(f' "{key}": {json.dumps(value)}' for key, value in values.items()) + "\n}\n"
