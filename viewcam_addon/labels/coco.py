"""The labels of many pictures as one file of COCO's: instances (boxes and masks) or panoptic (segments of color pictures).

Both are plain JSON of what `labels.json` files tell, so that nothing is traced again and a dataset may grow. A category is what
the object's custom property says, or else its name without Blender's number behind it (Chair of Chair.001). Keypoints count
from the first pixel's center, as COCO's do, and boxes from the picture's edge.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from . import files, masks

Document = dict[str, Any]


def instances(folder: Path, amodal: bool = False) -> Document:
    """COCO's instances, as in instances_train2017.json.

    amodal : true for masks and boxes of whole objects, not of what is visible.

    folder : a folder of label files; `file_name` is the name of the picture that they belong to.

    Raises InputError as `read_pictures` does.
    """
    pictures, categories = read_pictures(folder)
    kind, names = "amodal" if amodal else "visible", keypoint_names(pictures)
    annotations: list[Document] = []
    for number, (path, document) in enumerate(pictures, start=1):
        for each in with_mask(kind, path, document):
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": number,
                    "category_id": categories[category(each)],
                    **each[kind],
                    "segmentation": masks.compressed(each[kind]["segmentation"]),
                    "iscrowd": 0,
                    "instance_id": each["id"],
                    **_keypoints(each, names.get(category(each), [])),
                }
            )
    of_points = {name: {"keypoints": names[name], "skeleton": _skeleton(pictures, name, names[name])} for name in names}
    numbered = [each | of_points.get(each["name"], {}) for each in _categories(categories)]
    return {"images": _images(pictures), "annotations": annotations, "categories": numbered}


def panoptic(folder: Path) -> Document:
    """COCO's panoptic segments, of the instances.png beside each label file. Raises InputError as `read_pictures` does."""
    pictures, categories = read_pictures(folder)
    annotations = []
    for number, (path, document) in enumerate(pictures, start=1):
        segments = [
            {
                "id": each["id"],
                "category_id": categories[category(each)],
                "area": each["visible"]["area"],
                "bbox": each["visible"]["bbox"],
                "iscrowd": 0,
            }
            for each in with_mask("visible", path, document)
        ]
        file_name = files.of_picture(Path(document["picture"]), "instances.png").name
        annotations.append({"image_id": number, "file_name": file_name, "segments_info": segments})
    listed = [{**each, "isthing": 1, "color": _color(each["id"])} for each in _categories(categories)]
    return {"images": _images(pictures), "annotations": annotations, "categories": listed}


def category(instance: Document) -> str:
    """The category that an instance has, or Chair of Chair.001: Blender's names of copies."""
    return str(instance.get("category") or re.sub(r"\.\d{3,}$", "", instance["name"]))


def keypoint_names(pictures: Sequence[tuple[Path, Document]]) -> dict[str, list[str]]:
    """The names of the keypoints of each category that has some, in the order in which they are first met."""
    names: dict[str, dict[str, None]] = {}
    for _, document in pictures:
        for each in document["instances"]:
            for point in each.get("keypoints", ()):
                names.setdefault(category(each), {})[point["name"]] = None
    return {name: [*points] for name, points in names.items()}


def _skeleton(pictures: Sequence[tuple[Path, Document]], of_category: str, names: Sequence[str]) -> list[list[int]]:
    """The pairs of keypoints of a category of which one hangs on the other, numbered from 1."""
    points = (
        point
        for _, document in pictures
        for each in document["instances"]
        if category(each) == of_category
        for point in each.get("keypoints", ())
    )
    pairs = dict.fromkeys((point["parent"], point["name"]) for point in points if point.get("parent") in names)
    return [[names.index(end) + 1 for end in pair] for pair in pairs]


def _keypoints(instance: Document, names: Sequence[str]) -> Document:
    """The keys of an annotation for the keypoints of its category; none where that has none."""
    if not names:
        return {}
    points = {point["name"]: point for point in instance.get("keypoints", ())}
    numbers: list[float] = []
    for name in names:
        point = points.get(name)
        numbers += [point["x"] - 0.5, point["y"] - 0.5, point["visible"]] if point and point["visible"] else [0, 0, 0]
    return {"keypoints": numbers, "num_keypoints": sum(visible > 0 for visible in numbers[2::3])}


def read_pictures(folder: Path) -> tuple[list[tuple[Path, Document]], dict[str, int]]:
    """The label files of a folder in the order of their names, and the categories, numbered from 1 in the order of theirs.

    Raises InputError if there is none, or one can't be read.
    """
    paths = sorted(folder.glob("*.labels.json"))
    if not paths:
        raise InputError(f"{folder} has no label files, *.labels.json: write some with viewcam render --labels masks")
    pictures = [(path, files.read(path)) for path in paths]
    names = sorted({category(each) for _, document in pictures for each in document["instances"]})
    return pictures, {name: number for number, name in enumerate(names, start=1)}


def with_mask(kind: str, path: Path, document: Document) -> Sequence[Document]:
    """The instances that have such a mask."""
    label = "masks" if kind == "visible" else kind
    if any(kind not in each for each in document["instances"]):
        raise InputError(f"{path} has no {kind} masks: render it with --labels {label}")
    return [each for each in document["instances"] if each[kind] is not None]


def _images(pictures: list[tuple[Path, Document]]) -> list[Document]:
    return [
        {
            "id": number,
            "width": document["camera"]["width"],
            "height": document["camera"]["height"],
            "file_name": files.picture(path, document),
        }
        for number, (path, document) in enumerate(pictures, start=1)
    ]


def _categories(categories: dict[str, int]) -> list[Document]:
    return [{"id": number, "name": name, "supercategory": "object"} for name, number in categories.items()]


def _color(number: int) -> list[int]:
    """The color of a category: neighbors far apart, by steps around each channel that share no divisor with 256."""
    return [number * step % 256 for step in (67, 149, 211)]
