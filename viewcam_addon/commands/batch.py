"""`viewcam batch`: what is asked for becomes shots, all of them are looked at, and then they are run, here or on a cluster.

Whatever is wrong with any shot is told before the first is rendered. Libraries are silent all the while: of a batch, its
events are heard.
"""

import argparse
import contextlib
import dataclasses
import functools
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import argument_types as types
from .. import cameras, crashes
from ..errors import InputError
from ..jobs import cluster, dataset, lists, makers, one, render_client, render_server
from ..jobs import run as running
from ..jobs.folder import Folder, Outputs
from ..jobs.interruption import Interruption
from ..jobs.names import one_file
from ..jobs.problems import ShotsError
from ..jobs.settings import settings_hash
from ..jobs.shards import shard
from ..jobs.shot import ENGINES, LEVELS, Shot
from ..jobs.summary import Summary
from ..labels import KINDS
from ..terminal import say, silent_libraries
from . import Result, blender_room
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
  {command}{file} --orbit 200 --out nerf --transforms
      with transforms.json and COLMAP text for those who learn the scene
  {command}{file} shots.csv --out renders --workers 2
      on two processes; --scheduler tcp://host:8786 on a farm

exit status:
  0 all shots are there, and every check passed   1 a check failed
  2 bad input, nothing is rendered   4 shots failed or are left   130, 143 ended by SIGINT, SIGTERM
"""

_MOST_NAMED = 5
_OPEN_TO_ALL = "whoever reaches {} can run any program on its workers: docs/farm.md says how TLS lets in only your own"


@dataclasses.dataclass(frozen=True)
class _Job:
    """shots : those of this run. all_shots : those of a dataset, or of this run. made_from : all but the shot that decides a
    picture; settings : the hash of what each of all_shots is made from, by its name."""

    all_shots: Sequence[Shot]
    shots: Sequence[Shot]
    made_from: Mapping[str, Any]
    settings: Mapping[str, str]


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    """Add the command's options to its parser, which has those of every command already."""
    added.formatter_class = argparse.RawDescriptionHelpFormatter
    command, file = ("blender -b FILE.blend --command viewcam batch", "") if blend_is_open else ("viewcam batch", " FILE.blend")
    added.usage = f"{command}{file} (SHOTS | --orbit N | --frames A..B | --cameras GLOB) --out DIR [OPTION …]"
    added.epilog = _EXAMPLES.format(command=command, file=file)

    shots = added.add_argument_group("which shots: one of these")
    shots.add_argument(
        "shots",
        metavar="SHOTS",
        type=Path,
        nargs="?",
        help="a list (.csv, .json, .jsonl …) or any cameras",
    )
    shots.add_argument("--orbit", type=types.positive, metavar="N", help="N views around the camera's look-at point")
    shots.add_argument("--frames", metavar="A..B", help="a shot of the camera at each frame (from -5 on: --frames=-5..3)")
    shots.add_argument(
        "--cameras", metavar="GLOB", help="a shot of each camera so called: with * ? [abc]; --transforms has _ for each space"
    )
    shots.add_argument("--shard", metavar="I/N", help="of all these, every N-th from the I-th on: for a farm's own manager")

    add_reading_options(added.add_argument_group("how cameras of another program are taken"), size=False)

    said = added.add_argument_group("what a shot does not say itself")
    said.add_argument("--camera", metavar="NAME", help="of --orbit and --frames: the camera (default: the scene's)")
    said.add_argument("--size", type=types.size, metavar="WxH", help="pixels of the picture (default: the scene's)")
    said.add_argument("--frame", type=int, metavar="N", help="the frame (default: the file's current one)")
    said.add_argument("--engine", choices=ENGINES, help="who renders (default: the scene's)")
    said.add_argument("--samples", type=types.positive, metavar="N", help="samples a pixel (default: the scene's)")
    said.add_argument("--level", choices=LEVELS, help="how much VIEWCAM models (default: the scene's)")
    said.add_argument("--seed", type=types.seed, metavar="N", help="another noise for another number (default: the scene's)")

    written = added.add_argument_group("what is written")
    written.add_argument("--out", metavar="DIR", type=Path, required=True, help="the folder of the pictures")
    kept = written.add_mutually_exclusive_group()
    kept.add_argument("--resume", action="store_true", help="keep the shots that are there from the same settings")
    known = "the same, unless what they were made from can't all be known: then render all of them anew"
    kept.add_argument("--resume-known", action="store_true", help=known)
    kept.add_argument("--overwrite", action="store_true", help="render all of them anew")
    words = f"ground truth beside each shot: all, or some of {','.join(KINDS)}"
    written.add_argument("--labels", type=types.names, metavar="LABELS", default=(), help=words)
    written.add_argument("--labels-only", action="store_true", help="no pictures: labels alone, and no engine renders")
    words = "steps of the labels' 16-bit depth in a scene unit (default: 1000, millimetres of metres)"
    written.add_argument("--depth-steps", type=types.above_zero, metavar="N", default=1000.0, help=words)
    written.add_argument("--check", action="store_true", help="compare each shot's geometry with the reference tracer")
    written.add_argument(
        "--transforms", choices=["png", "exr"], nargs="?", const="png", help="transforms.json and COLMAP text of the png or exr"
    )

    machines = added.add_argument_group("more than one process")
    limit = "seconds that a shot may take; then its Blender is ended, and the shot has failed"
    machines.add_argument("--time-limit", type=types.above_zero, metavar="SECONDS", help=limit)
    machines.add_argument("--workers", type=types.positive, metavar="N", help="render in N processes of this machine")
    where = "render on a Dask cluster, as tcp://host:8786 (without an address: on one of this machine)"
    machines.add_argument("--scheduler", metavar="ADDRESS", nargs="?", const="", type=_address, help=where)


def _address(text: str) -> str:
    if "://" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is no address of a Dask scheduler: write tcp://host:8786")
    return text


def run(options: argparse.Namespace) -> Result:
    _refuse_contradictions(options)
    outputs = _outputs(options)
    on_signal = functools.partial(options.events.tell, "stopping")
    with silent_libraries(), Interruption(on_signal, crashes.passed_on) as interruption, contextlib.ExitStack() as stack:
        renderer = stack.enter_context(_renderer(options))
        job = _job(options, renderer, outputs)
        if _on_cluster(options):
            blend, program = renderer.blend, renderer.program
            stack.close()  # the workers open the file themselves
            if (options.scheduler or "").startswith("tcp://"):
                options.events.tell("note", command=options.command, text=_OPEN_TO_ALL.format(options.scheduler))
            machines = stack.enter_context(cluster.opened(options.scheduler or None, options.workers, program))
        folder = Folder(options.out, options.shard.strip().replace("/", "-of-") if options.shard else "")
        if _on_cluster(options):
            about = (job.made_from, options.seed, options.threads, outputs, options.trust, options.time_limit)
            work = machines.work(blend, folder, job.settings, *about)
        else:
            work = one.in_turn(folder, renderer, job.settings, outputs)
        unknown = tuple(job.made_from.get("unknown", ()))
        anew = options.overwrite or bool(options.resume_known and unknown)
        how = {"resume": options.resume or options.resume_known, "overwrite": anew, "outputs": outputs}
        summary = running.run(job.shots, folder, job.settings, work, options.events, interruption=interruption, **how)
        words = dataset.write(folder, job.all_shots, job.settings, options.transforms) if options.transforms else ""
    _tell(options, summary, folder, unknown)
    if words:
        say(words)
    return summary.exit_status, summary.to_json()


def serve(options: argparse.Namespace) -> Result:
    """`viewcam serve`: a Blender that renders the shots of a batch for the process that started it. No command for people."""
    render_server.serve(options.handle, blender_room("jobs.renderer").BlenderRenderer)
    return 0, {}


def _refuse_contradictions(options: argparse.Namespace) -> None:
    given = {"SHOTS": options.shots, "--orbit": options.orbit, "--frames": options.frames, "--cameras": options.cameras}
    sources = [name for name, value in given.items() if value is not None]
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
    if options.scheduler and options.workers is not None:
        raise InputError("a scheduler with an address has its workers already: leave --workers out")


def _outputs(options: argparse.Namespace) -> Outputs:
    labels = KINDS if tuple(options.labels) == ("all",) else options.labels
    if unknown := [kind for kind in labels if kind not in KINDS]:
        raise InputError(f"there is no label {unknown[0]!r}: give all, or some of {', '.join(KINDS)}")
    kinds = tuple(kind for kind in KINDS if kind in labels)
    return Outputs(not options.labels_only, options.check, kinds, options.depth_steps)


def _refuse_names_of_labels(shots: Sequence[Shot]) -> None:
    """Labels of a shot a are called a.labels.exr and the like, and so would be the picture of a shot a.labels."""
    names = {one_file(shot.name): shot.name for shot in shots}
    for name in names:
        stem, _, rest = name.partition(".")
        while rest:
            if stem in names:
                other, shot = names[stem], names[name]
                raise InputError(f"the shots {other!r} and {shot!r} may have labels of one name: call one of them otherwise")
            more, _, rest = rest.partition(".")
            stem = f"{stem}.{more}"


def _on_cluster(options: argparse.Namespace) -> bool:
    return options.scheduler is not None or options.workers is not None


def _renderer(options: argparse.Namespace) -> contextlib.AbstractContextManager:
    """Blender with the file open, in this process; but in one of its own where VIEWCAM_BLENDER names one, workers will, or time
    is limited.

    The bpy module puts folders on sys.path in which a worker's children, who get that path, would find half a bpy.
    """
    apart = os.environ.get(render_client.BLENDER) or _on_cluster(options) or options.time_limit
    if options.blend is not None and apart:
        return render_client.ServedRenderer(options.blend, options.seed, options.threads, options.trust, options.time_limit)
    if options.time_limit and not _on_cluster(options):
        raise InputError("--time-limit ends the Blender of a shot, and here that is this one: give --workers 1 as well")
    return blender_room("jobs.renderer").BlenderRenderer(options.blend, options.seed, options.threads, options.trust)


def _job(options: argparse.Namespace, renderer: Any, outputs: Outputs) -> _Job:
    """All that is to be rendered, once nothing is wrong with it."""
    listed = _shots(options, renderer)
    shots = [_completed(shot, options) for shot in (shard(listed, options.shard) if options.shard else listed)]
    all_shots = [_completed(shot, options) for shot in listed] if options.shard and options.transforms else shots
    if problems := renderer.problems(all_shots, outputs):
        raise ShotsError(str(options.shots or options.blend or renderer.blend), tuple(problems))
    if _on_cluster(options) and renderer.blend is None:
        raise InputError("this file is nowhere that workers could open it: save it first")
    if outputs.labels:
        _refuse_names_of_labels(all_shots)
    if options.transforms:
        dataset.refuse(all_shots, options.transforms)
    made_from = renderer.made_from()
    return _Job(all_shots, shots, made_from, {shot.name: settings_hash(shot, made_from) for shot in all_shots})


def _shots(options: argparse.Namespace, renderer: Any) -> Sequence[Shot]:
    if options.shots is not None:
        if lists.is_list(options.shots):
            return lists.read(options.shots, renderer.cameras)
        found = cameras.read(options.shots, options=options_of(options))
        for note in dict.fromkeys(note for camera in found for note in camera.notes):
            options.events.tell("note", command=options.command, text=note)
        return makers.from_pinholes((camera.name, camera.pinhole) for camera in found)
    if options.cameras is not None:
        return makers.from_cameras(options.cameras, renderer.cameras, spaces=not options.transforms)
    if options.orbit is not None:
        return makers.orbit(renderer.pinhole(options.camera, options.size, options.frame), options.orbit)
    camera = renderer.scene_camera if options.camera is None else options.camera
    if camera not in renderer.cameras:
        wrong = "the scene has no camera" if camera is None else f"the file has no camera {camera!r}"
        raise InputError(f"{wrong}: name one with --camera, of {', '.join(renderer.cameras) or 'none'}")
    return makers.frames(options.frames, options.camera)


def _completed(shot: Shot, options: argparse.Namespace) -> Shot:
    """The shot, with what the command line says where it says nothing itself."""
    width, height = options.size or (None, None)
    said = {field: getattr(options, field) for field in ("frame", "engine", "samples", "level")}
    said |= {"width": width, "height": height}
    return dataclasses.replace(shot, **{field: value for field, value in said.items() if getattr(shot, field) is None})


def _tell(options: argparse.Namespace, summary: Summary, folder: Folder, unknown: Sequence[str]) -> None:
    """In one line what the batch came to. unknown : what may have changed the pictures that were kept."""
    counts = summary.counts
    shots = "1 shot" if counts["shots"] == 1 else f"{counts['shots']} shots"
    if counts["failed"] or counts["left"]:
        what = f"of {shots}, {counts['failed']} failed and {counts['left']} are left"
        options.events.tell("error", command=options.command, text=f"{what}: the same command with --resume renders them")
        return
    kept = f", {summary.kept} of them kept" if summary.kept else ""
    say(f"{shots}{kept}, in {summary.seconds:.1f} s: {folder.contact_sheet}")
    if summary.kept and unknown:
        more = f" (and {len(unknown) - 1} more)" if len(unknown) > 1 else ""
        say(f"whether those that were kept are still right is not sure: --resume-known renders them. {unknown[0]}{more}")
    if unlike := [shot["name"] for shot in summary.shots if shot.get("passed") is False]:
        named = ", ".join(unlike[:_MOST_NAMED]) + (", …" if len(unlike) > _MOST_NAMED else "")
        say(f"{len(unlike)} are not what the reference tracer sees: {named}; {folder.summary} says how")
