"""Make a dataset of the labels of a folder's pictures."""

import argparse
import functools
import json

from .. import argument_types as types
from ..errors import InputError
from ..files import written_whole
from ..labels import bop, coco, colmap, files, kitti, stereo, tracks, yolo
from ..terminal import say
from . import Result


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.set_defaults(writes=("output",))
    added.add_argument("folder", metavar="FOLDER", type=types.path, help="where viewcam render --labels has written")
    added.add_argument(
        "output", metavar="OUT", type=types.path, help="a file of COCO's or of tracks; of another format a new folder"
    )
    words = (
        "COCO's instances (default) or panoptic; YOLO's boxes; BOP's scene; COLMAP's points and tracks; KITTI's depth, flow "
        "and stereo; Middlebury's stereo; PointOdyssey's tracks of points"
    )
    forms = ["coco", "panoptic", "yolo", "colmap", "bop", "kitti", "middlebury", "tracks"]
    added.add_argument("--to", choices=forms, default="coco", help=words)
    words = "for stereo: what tells the names of a pair's two pictures apart (Middlebury's: left right)"
    added.add_argument("--pair", nargs=2, metavar=("LEFT", "RIGHT"), help=words)
    added.add_argument("--amodal", action="store_true", help="whole objects, in place of what is visible of them")
    words = "for COLMAP: points that are sampled in each picture (default: 1000); for tracks: of all pictures (default: 2048)"
    added.add_argument("--overwrite", action="store_true", help="replace a folder of the same format, and nothing else")
    added.add_argument("--points", type=types.positive, metavar="N", help=words)


def run(options: argparse.Namespace) -> Result:
    if options.amodal and options.to != "coco":
        raise InputError("--amodal is for COCO's instances: other formats have a place for either mask, or for one")
    if options.points and options.to not in ("colmap", "tracks"):
        raise InputError("--points are those of a COLMAP model or of tracks: add --to colmap or --to tracks, or leave it out")
    if options.pair and options.to not in ("kitti", "middlebury"):
        raise InputError("--pair is for stereo: add --to kitti or --to middlebury, or leave it out")
    files.refuse_own(options.folder, options.output)
    if options.to == "colmap":
        counts = colmap.write(options.folder, options.output, options.points or colmap.POINTS, options.overwrite)
    elif options.to == "bop":
        progress = functools.partial(options.events.tell, "progress", work="written")
        counts = bop.write(options.folder, options.output, lambda share: progress(share=share), options.overwrite)
    elif options.to == "yolo":
        counts = yolo.write(options.folder, options.output, options.overwrite)
    elif options.to == "kitti":
        counts = kitti.write(options.folder, options.output, options.overwrite, options.pair)
    elif options.to == "tracks":
        counts = tracks.write(options.folder, options.output, options.points or tracks.POINTS)
    elif options.to == "middlebury":
        counts = stereo.write(options.folder, options.output, options.overwrite, options.pair or stereo.WORDS)
    else:
        document = coco.panoptic(options.folder) if options.to == "panoptic" else coco.instances(options.folder, options.amodal)
        with written_whole(options.output) as temporary:
            temporary.write_text(json.dumps(document) + "\n", encoding="utf-8", newline="\n")
        counts = {name: len(document[name]) for name in ("images", "annotations", "categories")}
    say(f"{options.output}: " + ", ".join(f"{count:,} {name}" for name, count in counts.items()))
    return 0, {"output": str(options.output), **counts}
