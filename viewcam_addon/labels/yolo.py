"""Boxes and keypoints of many pictures as YOLO's trainers read them: a line of text for each object, beside copies of pictures.

images/ has the pictures, labels/ a text of the same name for each: the class, from 0 on, the box's center and size as shares of
the picture's, and, where some category has keypoints, the places of all as shares and COCO's figure of what is seen.
`data.yaml` names the classes. All pictures are in one set, which a trainer splits.

Source: Ultralytics' documentation of its detect and pose datasets. Rejected: polygons, which can't say what masks do (holes,
parts); COCO's file has the masks.
"""

import json
import shutil
from pathlib import Path

from ..errors import InputError
from ..files import folder_written_whole
from . import files
from .coco import Document, category, keypoint_names, read_pictures, with_mask

_NAMES = ("images", "labels", "data.yaml")


def write(folder: Path, output: Path, overwrite: bool = False) -> dict[str, int]:
    """Write a new folder of pictures and what they show, whole or not at all.

    folder : a folder of label files with masks, and the PNG or JPEG of each.
    output : a folder that is not there yet, or is empty.
    overwrite : true if `output` may be a folder that was written so.

    Returns how many there are.

    Raises InputError if there are no label files, one has no masks, no picture or can't be read, or the folder can't be
    written.
    """
    pictures, categories = read_pictures(folder)
    points = list(dict.fromkeys(name for names in keypoint_names(pictures).values() for name in names))
    boxes = 0

    with folder_written_whole(output, lambda there: overwrite and files.holds(there, _NAMES, _NAMES)) as temporary:
        for name in ("images", "labels"):
            (temporary / name).mkdir()
        for path, document in pictures:
            if (photograph := files.photograph(path, document)) is None:
                raise InputError(f"{path} has no PNG or JPEG beside it: render the picture, too")
            lines = [
                _line(each, document, categories[category(each)] - 1, points) for each in with_mask("visible", path, document)
            ]
            shutil.copyfile(photograph, temporary / "images" / photograph.name)
            (temporary / "labels" / f"{photograph.stem}.txt").write_text("".join(lines), encoding="ascii", newline="\n")
            boxes += len(lines)
        text = "train: images\nval: images\n" + (f"kpt_shape: [{len(points)}, 3]\n" if points else "") + "names:\n"
        text += "".join(f"  {number - 1}: {json.dumps(name)}\n" for name, number in categories.items())
        text += f"# keypoints: {', '.join(map(json.dumps, points))}\n" if points else ""
        (temporary / "data.yaml").write_text(text, encoding="utf-8", newline="\n")
    return {"images": len(pictures), "boxes": boxes, "classes": len(categories), "keypoints": len(points)}


def _line(instance: Document, document: Document, number: int, names: list[str]) -> str:
    width, height = document["camera"]["width"], document["camera"]["height"]
    left, top, across, down = instance["visible"]["bbox"]
    numbers = [(left + across / 2) / width, (top + down / 2) / height, across / width, down / height]
    seen = {point["name"]: point for point in instance.get("keypoints", ()) if point["visible"]}
    words = [str(number), *(f"{value:.9g}" for value in numbers)]
    for name in names:
        point = seen.get(name, {"x": 0.0, "y": 0.0, "visible": 0})
        words += [f"{point['x'] / width:.9g}", f"{point['y'] / height:.9g}", str(point["visible"])]
    return " ".join(words) + "\n"
