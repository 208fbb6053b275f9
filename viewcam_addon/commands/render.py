"""Trace a scene file into an EXR.

The ground truth is written beside it.
"""

import argparse
import dataclasses
import time
from typing import Any

from .. import argument_types as types
from ..errors import InputError
from ..terminal import say
from ..tracer.scene.film import SAMPLES
from . import Result
from . import _options as shared


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.add_argument("scene", metavar="SCENE.json", type=types.path)
    added.add_argument("image", metavar="OUT.exr", type=types.path)
    added.set_defaults(writes=("image",))
    shared.add_size(added)
    added.add_argument("--stated", action="store_true", help="trace the four values as stated, not as Blender stored them")
    spent = added.add_mutually_exclusive_group()
    shared.add_light(added, spent)
    shared.add_error(spent, "in place of --samples")
    kinds = "write ground truth beside the picture: some of depth,normals,position,masks,amodal,flow,coverage"
    added.add_argument("--labels", type=types.names, metavar="LABELS", help=kinds)
    for other in ("previous", "next"):
        words = f"the {other} frame, for --labels flow"
        added.add_argument(f"--{other}", metavar="SCENE.json", type=types.path, help=words)
    words = "steps of the labels' 16-bit depth in a scene unit (default: 1000, millimeters of meters)"
    added.add_argument("--depth-steps", type=types.above_zero, metavar="N", default=1000.0, help=words)


def run(options: argparse.Namespace) -> Result:
    from .. import api, image
    from ..tracer.tiles import Progress

    scene = api.read_scene(options.scene)
    if options.stated:
        if scene.stated_camera is None:
            raise InputError(
                f"{options.scene} has no stated_camera: leave --stated out, or enable the Virtual Pinhole in Blender"
            )
        scene = dataclasses.replace(scene, camera=scene.stated_camera)
    others = {name: api.read_scene(path) for name in ("previous", "next") if (path := getattr(options, name))}
    if others and "flow" not in (options.labels or ()):
        raise InputError(f"--{next(iter(others))} is for flow: add --labels flow")
    if options.size:
        scene, *resized = (
            dataclasses.replace(each, camera=each.camera.resized(*options.size)) for each in (scene, *others.values())
        )
        others = dict(zip(others, resized, strict=True))
    labels = api.label(scene, options.labels, **others, threads=options.threads) if options.labels else None
    result: dict[str, Any] = shared.say_level(scene) if options.level == "auto" else {}
    level = result.get("level", options.level)
    progress = Progress(options.events.tell, scene.camera.height)
    started = time.perf_counter()
    traced = api.render(scene, level, options.samples or SAMPLES, options.seed, options.threads, options.error, progress)
    seconds = time.perf_counter() - started
    image.write(options.image, traced)
    say(f"traced {scene.camera.width} × {scene.camera.height} pixels in {seconds:.2f} s")
    if labels:
        from ..labels import files

        result["labels"] = [str(path) for path in files.write(options.image, labels, options.depth_steps)]
        say(f"labels: {result['labels'][-1]}")
    return 0, {"image": str(options.image), "seconds": seconds} | result
