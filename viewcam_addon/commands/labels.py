"""`viewcam labels`: the labels of many pictures as a dataset: one file, or a folder."""

import argparse
import json

from ..errors import InputError
from ..files import written_whole
from ..labels import bop, coco, colmap, kitti
from ..terminal import say
from . import Result

_FOLDERS = {"bop": bop, "kitti": kitti}


def run(options: argparse.Namespace) -> Result:
    if options.amodal and options.to != "coco":
        raise InputError("--amodal is for COCO's instances: other formats have a place for either mask, or for one")
    if options.points and options.to != "colmap":
        raise InputError("--points are those of a COLMAP model: add --to colmap, or leave it out")
    if options.to == "colmap":
        counts = colmap.write(options.folder, options.output, options.points or colmap.POINTS)
    elif options.to in _FOLDERS:
        counts = _FOLDERS[options.to].write(options.folder, options.output)
    else:
        document = coco.panoptic(options.folder) if options.to == "panoptic" else coco.instances(options.folder, options.amodal)
        with written_whole(options.output) as temporary:
            temporary.write_text(json.dumps(document) + "\n", encoding="utf-8", newline="\n")
        counts = {name: len(document[name]) for name in ("images", "annotations", "categories")}
    say(f"{options.output}: " + ", ".join(f"{count:,} {name}" for name, count in counts.items()))
    return 0, {"output": str(options.output), **counts}
