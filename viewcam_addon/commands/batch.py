"""Render many shots of one file: opened once, each written whole, and continued after whatever ended it.

What is asked for becomes jobs, and these are carried out (_carry_out.py).
"""

import argparse
import dataclasses
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .. import argument_types as types
from .. import cameras
from .. import file_names as shot_names
from ..cameras import calibration as calibrations
from ..cameras import distortion
from ..cameras.calibration import Rig
from ..errors import InputError
from ..jobs import lists, makers
from ..jobs.folder import Outputs
from ..jobs.job import ENGINES, LEVELS, Job
from ..labels import KINDS
from . import Result
from . import _options as shared
from ._carry_out import add_machines, carry_out, plan_of
from .camera import add_reading_options, options_of

_EXAMPLES = """\
examples:
  {command}{file} shots.csv --out renders
      a list of shots: CSV, JSON or JSON Lines, one camera a row
  {command}{file} sparse/0 --out renders
      the cameras of a COLMAP model, or of any file that viewcam camera reads
  {command}{file} --orbit 36 --size 640x360 --out turntable
      around what the scene's camera looks at
  {command}{file} --frames 1..250 --out frames --resume
      an animation; what is there from the same settings is kept
  {command}{file} --cameras 'Cam*' --out views --check
      each camera so called, compared with the reference tracer
  {command}{file} --orbit 1000 --out truth --labels depth,masks --labels-only
      ground truth without pictures; without --labels-only beside them
  {command}{file} --orbit 200 --out nerf --transforms --labels depth,masks --test 8
      with transforms.json and COLMAP text for those who learn the scene, depth, masks and points
  {command}{file} shots.csv --out renders --workers 2
      on two processes; --scheduler tcp://host:8786 on a farm

exit status:
  0 all shots are there, and every check passed   1 a check failed
  2 bad input, nothing is rendered   4 shots failed or are left   130, 143 ended by SIGINT, SIGTERM
"""


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    shared.add_blend(added, blend_is_open)
    added.formatter_class = argparse.RawDescriptionHelpFormatter
    command, file = ("blender -b FILE.blend --command viewcam batch", "") if blend_is_open else ("viewcam batch", " FILE.blend")
    added.usage = f"{command}{file} (SHOTS | --orbit N | --frames A..B | --cameras GLOB) --out DIR [OPTION …]"
    added.epilog = _EXAMPLES.format(command=command, file=file)

    shots = added.add_argument_group("which shots: one of these")
    shots.add_argument(
        "shots", metavar="SHOTS", type=types.path, nargs="?", help="a list (.csv, .json, .jsonl …) or any cameras"
    )
    shots.add_argument("--orbit", type=types.positive, metavar="N", help="N views around the camera's look-at point")
    shots.add_argument("--frames", metavar="A..B", help="a shot of the camera at each frame (from -5 on: --frames=-5..3)")
    shots.add_argument(
        "--cameras", metavar="GLOB", help="a shot of each camera so called: with * ? [abc]; --transforms has _ for each space"
    )
    shots.add_argument("--shard", metavar="I/N", help="of all these, every N-th from the I-th on: for a farm's own manager")

    add_reading_options(added.add_argument_group("how cameras of another program are taken"), size=False)

    group = added.add_argument_group("what a shot does not say itself")
    group.add_argument("--camera", metavar="NAME", help="of --orbit and --frames: the camera (default: the scene's)")
    group.add_argument("--size", type=types.size, metavar="WxH", help="pixels of the picture (default: the scene's)")
    group.add_argument("--frame", type=types.frame, metavar="N", help="the frame (default: the file's current one)")
    group.add_argument("--engine", choices=ENGINES, help="who renders (default: the scene's)")
    group.add_argument("--samples", type=types.positive, metavar="N", help="samples a pixel (default: the scene's)")
    group.add_argument("--level", choices=LEVELS, help="how much VIEWCAM models (default: the scene's)")
    group.add_argument("--seed", type=types.seed, metavar="N", help="another noise for another number (default: the scene's)")

    words = (
        "a calibrated camera, by any file that viewcam camera reads: pictures and labels are as it takes them, by its lens, "
        "focal length and size; a shot says where from. Of several it is the one so named, or that of the shot's own name or "
        "its camera's"
    )
    group.add_argument("--distort", nargs="+", metavar=("FILE", "NAME"), help=words)

    written = added.add_argument_group("what is written")
    written.add_argument("--out", metavar="DIR", type=types.path, required=True, help="the folder of the pictures")
    kept = written.add_mutually_exclusive_group()
    kept.add_argument("--resume", action="store_true", help="keep the shots that are there from the same settings")
    known = "the same, unless what they were made from can't all be known: then render all of them anew"
    kept.add_argument("--resume-known", action="store_true", help=known)
    kept.add_argument("--overwrite", action="store_true", help="render all of them anew")
    words = f"ground truth beside each shot: all, or some of {','.join(KINDS)}"
    written.add_argument("--labels", type=types.names, metavar="LABELS", default=(), help=words)
    written.add_argument("--labels-only", action="store_true", help="no pictures: labels alone, and no engine renders")
    words = "steps of the labels' 16-bit depth in a scene unit (default: 1000, millimeters of meters)"
    written.add_argument("--depth-steps", type=types.above_zero, metavar="N", default=1000.0, help=words)
    written.add_argument("--check", action="store_true", help="compare each shot's geometry with the reference tracer")
    written.add_argument(
        "--transforms", choices=["png", "exr"], nargs="?", const="png", help="transforms.json and COLMAP text of the png or exr"
    )
    words = "of --transforms: hold out every N-th picture, or those so called, for tests (transforms_train.json and its like)"
    written.add_argument("--test", metavar="N|GLOB", help=words)

    add_machines(added)


def run(options: argparse.Namespace) -> Result:
    _refuse_contradictions(options)
    plan = plan_of(options, outputs=_outputs(options))
    rig = _rig(options) if options.distort else None
    complete = functools.partial(_completed, options=options, rig=rig)
    shots_of = functools.partial(_shots, options, rig)
    summary = carry_out(plan, shots_of, options.events, complete, str(options.shots or ""))
    return summary.exit_status, summary.to_json()


def _refuse_contradictions(options: argparse.Namespace) -> None:
    possible = {"SHOTS": options.shots, "--orbit": options.orbit, "--frames": options.frames, "--cameras": options.cameras}
    sources = [name for name, value in possible.items() if value is not None]
    if not sources:
        raise InputError("which shots is not said: give a list, cameras of any program, --orbit, --frames or --cameras")
    if len(sources) > 1:
        raise InputError(f"{' and '.join(sources)} say each which shots: give one of them")
    if options.camera is not None and sources[0] in ("SHOTS", "--cameras"):
        raise InputError(f"--camera is that of --orbit and --frames, and {sources[0]} says the cameras itself: leave it out")
    if options.frame is not None and sources[0] == "--frames":
        raise InputError("--frame and --frames say both which frame: leave one of them out")
    if options.labels_only and not options.labels:
        raise InputError("--labels-only leaves nothing to write: say which with --labels")
    if options.labels_only and options.transforms:
        raise InputError("--transforms names the pictures, and --labels-only makes none: leave one of them out")
    if options.test and not options.transforms:
        raise InputError("--test is of a dataset: add --transforms, or leave it out")
    if options.scheduler and options.workers is not None:
        raise InputError("a scheduler with an address has its workers already: leave --workers out")


def _outputs(options: argparse.Namespace) -> Outputs:
    labels = KINDS if tuple(options.labels) == ("all",) else options.labels
    if unknown := [kind for kind in labels if kind not in KINDS]:
        raise InputError(f"there is no label {unknown[0]!r}: give all, or some of {', '.join(KINDS)}")
    kinds = tuple(kind for kind in KINDS if kind in labels)
    return Outputs(not options.labels_only, options.check, kinds, options.depth_steps)


def _rig(options: argparse.Namespace) -> Rig:
    """The calibrated cameras of --distort, by their names and those that shots of them have."""
    file, *names = options.distort
    if len(names) > 1:
        raise InputError(f"--distort is of a file and one camera's name, and {' '.join(names)} are more: name one or none")
    conversion = dataclasses.replace(options_of(options), without_distortion=False)
    result = calibrations.of_cameras(cameras.read(Path(file), options=conversion), file, *names)
    for plane in {calibration.plane for calibration in result.by_name.values()} if options.size else ():
        if options.size != (plane.width, plane.height):
            sizes = (
                f"{options.size[0]} × {options.size[1]} and the camera of --distort has {plane.width} × {plane.height} pixels"
            )
            raise InputError(f"--size is {sizes}: leave --size out, or give the camera of such pictures")
    fit = dict(zip(shot_names.distinct(result.by_name), result.by_name.values(), strict=True))
    return dataclasses.replace(result, by_name=fit | dict(result.by_name))


def _shots(options: argparse.Namespace, rig: Rig | None, renderer: Any) -> Sequence[Job]:
    if options.shots is not None:
        if lists.is_list(options.shots):
            return lists.read(options.shots, renderer.cameras)
        read = cameras.read(options.shots, options=options_of(options))
        for note in dict.fromkeys(note for camera in read for note in camera.notes):
            options.events.tell("note", command=options.command, text=note)
        for camera in () if rig else read:
            distortion.refuse(camera.lens, camera.pinhole.plane, camera.name, "a render")
        return makers.from_pinholes((camera.name, camera.pinhole) for camera in read)
    if options.cameras is not None:
        return makers.from_cameras(options.cameras, renderer.cameras, spaces=not options.transforms)
    if options.orbit is not None:
        plane = rig and rig.of(options.camera).plane
        size = (plane.width, plane.height) if plane else options.size
        return makers.orbit(renderer.pinhole(options.camera, size, options.frame), options.orbit)
    if options.camera not in (None, *renderer.cameras) or renderer.scene_camera is None:
        wrong = "the scene has no camera" if options.camera is None else f"the file has no camera {options.camera!r}"
        raise InputError(f"{wrong}: name one with --camera, of {', '.join(renderer.cameras) or 'none'}")
    return makers.frames(options.frames, options.camera)


def _completed(job: Job, options: argparse.Namespace, rig: Rig | None) -> Job:
    """The job, with what the command line says where it says nothing itself.

    rig : the calibrated cameras of --distort.
    """
    width, height = options.size or (None, None)
    stated = {field: getattr(options, field) for field in ("frame", "engine", "samples", "level", "seed", "threads")}
    stated |= {"width": width, "height": height}
    missing = {field: value for field, value in stated.items() if getattr(job, field) is None}
    job = dataclasses.replace(job, trust=options.trust, **missing)
    if rig is None:
        return job
    calibration = rig.of(job.camera, job.name)
    size = calibration.plane.width, calibration.plane.height
    if job.size not in (None, size):
        sizes = "{} × {} pixels and the camera of --distort {} × {}".format(*job.size, *size)
        raise InputError(f"the shot {job.name} has {sizes}: leave its size out, or give the camera of such pictures")
    return makers.calibrated(job, calibration)
