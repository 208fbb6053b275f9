"""The commands that prove a camera: export, render, cycles, compare, and check and demo, which are all of these in one go.

What Blender does (export, Cycles) and what OpenEXR does (the tracer's pictures, the comparison) never share a process, because
Blender brings a copy of OpenEXR of its own: `check` does the first where Blender is and the second in the tracer's process
(jobs/tracing.py), in the shell and inside Blender alike. A check of many cameras or frames is a batch without pictures.
"""

import argparse
import dataclasses
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError, NotModelledError
from ..files import temporary_folder
from ..terminal import say, silent_libraries
from . import Result, blender_room

DEMO_SCENE = Path(__file__).parents[2] / "sample_scenes" / "studio.blend"


def export(options: argparse.Namespace) -> Result:
    from ..tracer.scene import scene_file

    if (status := _in_another_blender(options)) is not None:
        return status, {}
    with silent_libraries():
        scene = blender_room("jobs.renderer").export(_job(options))
    scene_file.write(scene, options.scene)
    say(*ledger_lines(_ledger_json(scene.ledger)))
    result = {"scene": str(options.scene), "ledger": _ledger_json(scene.ledger)}
    return 0, result | (_told_level(scene) if options.level != "geometry" else {})


def render(options: argparse.Namespace) -> Result:
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
    told = _told_level(scene) if options.level == "auto" else {}
    level = told.get("level", options.level)
    progress = Progress(options.events.tell, scene.camera.height)
    started = time.perf_counter()
    traced = api.render(scene, level, options.samples, options.seed, options.threads, options.error, progress)
    seconds = time.perf_counter() - started
    image.write(options.image, traced)
    say(f"traced {scene.camera.width} × {scene.camera.height} pixels in {seconds:.2f} s")
    if labels:
        from ..labels import files

        told["labels"] = [str(path) for path in files.write(options.image, labels, options.depth_steps)]
        say(f"labels: {told['labels'][-1]}")
    return 0, {"image": str(options.image), "seconds": seconds} | told


def cycles(options: argparse.Namespace) -> Result:
    if (status := _in_another_blender(options)) is not None:
        return status, {}
    with silent_libraries():
        ledger = blender_room("jobs.renderer").cycles(_job(options), options.image)
    say(*ledger_lines(_ledger_json(ledger)))
    return 0, {"image": str(options.image), "ledger": _ledger_json(ledger)}


def compare(options: argparse.Namespace) -> Result:
    from ..comparison.answer import exit_status
    from ..jobs.tracing import Written, compare_files

    report, difference = (path and str(path) for path in (options.report, options.difference))
    written = Written(report, difference, command=f"viewcam {options.words}")
    channels = dict(options.channels) if options.channels else None
    found = compare_files(options.reference, options.tests, options.scene, options.threads, channels, written)
    say(*ledger_lines(found["result"]["ledger"]), *found["lines"])
    return exit_status(found["answer"], options.strict), found["result"]


def check(options: argparse.Namespace) -> Result:
    job = _job(options)
    job.refuse_unchecked()
    if options.frames is not None or options.cameras is not None:
        return _check_many(options, job)
    for name in ("resume", "overwrite", "shard", "workers", "scheduler", "time_limit"):
        if getattr(options, name) not in (None, False):
            words = name.replace("_", "-")
            raise InputError(f"--{words} is for many checks: say which with --frames or --cameras, or leave it out")
    report, difference = (path and str(path) for path in (options.report, options.difference))
    return check_one(job, options, report=report, difference=difference, command=f"viewcam {options.words}")


def check_one(
    job: Any,
    options: argparse.Namespace,
    report: str | None = None,
    difference: str | None = None,
    sides: str | None = None,
    command: str = "",
) -> Result:
    """Check one job. report, difference, sides, command : as of tracing.Written; the report's folder keeps all pictures."""
    from ..comparison.answer import exit_status
    from ..jobs.plan import Plan
    from ..jobs.tracing import Written
    from . import carry_out

    reference = str(Path(report, "reference.exr")) if report else None
    written = Written(report, difference, sides, reference, command)
    plan = Plan(Path(), blend=Path(job.blend) if job.blend else None, trust=job.trust)
    with silent_libraries(), carry_out.opened(plan, options.events) as renderer:
        found = renderer.check(job, has_picture=False, written=written, keep=Path(report) if report else None)
    if "reason" in found:
        say(f"level {found['level']} is enough. {found['reason']}")
    seconds, (width, height) = found["seconds"], found["result"]["size"]
    engine = (job.engine or "Cycles").capitalize()
    say(f"exported and rendered with {engine} in {seconds['rendered']:.1f} s")
    say(f"traced {width} × {height} pixels in {seconds['traced']:.2f} s")
    say(*ledger_lines(found["result"]["ledger"]), *found["lines"])
    return exit_status(found["answer"], job.strict), found["result"]


def _check_many(options: argparse.Namespace, job: Any) -> Result:
    """Checks of a range of frames or of several cameras, a shot each."""
    from ..jobs import makers
    from ..jobs.folder import Outputs
    from ..jobs.plan import Plan
    from .carry_out import carry_out

    _refuse_of_many(options)
    outputs = Outputs(picture=False, check=True, report=options.report is not None)

    def jobs_of(renderer: Any) -> Sequence[Any]:
        if options.cameras is not None:
            return makers.from_cameras(options.cameras, renderer.cameras)
        return makers.frames(options.frames, options.camera)

    def complete(shot: Any) -> Any:
        stated = {"camera": shot.camera, "name": shot.name} | ({} if shot.frame is None else {"frame": shot.frame})
        return dataclasses.replace(job, **stated)

    with temporary_folder() as temporary:
        plan = Plan(
            out=options.report or temporary,
            outputs=outputs,
            blend=options.blend,
            trust=options.trust,
            resume=options.resume,
            overwrite=options.overwrite,
            shard=options.shard,
            time_limit=options.time_limit,
            workers=options.workers,
            scheduler=options.scheduler,
            command="check",
        )
        summary = carry_out(plan, jobs_of, options.events, complete)
    status = summary.exit_status or (3 if options.strict and summary.counts["not_all_modelled"] else 0)
    return status, {**summary.to_json(), "exit_status": status, "strict": options.strict}


def _refuse_of_many(options: argparse.Namespace) -> None:
    if options.frames is not None and options.cameras is not None:
        raise InputError("--frames and --cameras say each which pictures: give one of them")
    if options.cameras is not None and options.camera is not None:
        raise InputError("--camera is of one picture or of --frames, and --cameras says the cameras itself: leave it out")
    if options.frames is not None and options.frame is not None:
        raise InputError("--frame and --frames say both which frame: leave one of them out")
    if options.difference:
        raise InputError("--difference is a picture of one check: with --report each of many has its page")
    if options.scene:
        raise InputError("--scene is what one picture must show: leave it out of many checks")
    if (options.resume or options.overwrite) and not options.report:
        raise InputError("--resume and --overwrite are of results that are kept: name their folder with --report")
    if options.scheduler and options.workers is not None:
        raise InputError("a scheduler with an address has its workers already: leave --workers out")


def demo(options: argparse.Namespace) -> Result:
    if not options.blend.is_file():
        raise InputError(f"{options.blend} is not here: run the demo in a clone of the project, where its sample scenes are")
    say(f"{options.blend.name}: a camera given by four values, rendered by Cycles and by the reference tracer")
    return check(options)


def _in_another_blender(options: argparse.Namespace) -> int | None:
    """Run the command in the Blender that VIEWCAM_BLENDER names, which tells and writes all there is; its exit status.

    None where none is named, or this is a Blender that has a file open.

    Raises
    ------
    InputError
        if it can't be started, or ends otherwise than the command does.
    """
    from ..jobs.render_client import BLENDER

    program = os.environ.get(BLENDER)
    if not program or options.blend is None:
        return None
    words = shlex.split(options.words)
    words.pop(next(place for place, word in enumerate(words) if place and Path(word) == options.blend))
    scripts = "--enable-autoexec" if options.trust else "--disable-autoexec"
    command = [program, "-b", scripts, str(options.blend), "--command", "viewcam", *words]
    sys.stdout.flush()
    try:
        status = subprocess.run(command, check=False).returncode
    except OSError as error:
        raise InputError(f"{BLENDER} names {program}, which can't be started ({error.strerror}): correct it") from error
    if status not in (0, InputError.exit_status, NotModelledError.exit_status):
        raise InputError(
            f"{program}, which {BLENDER} names, ended with status {status}: see that it is Blender 4.2 or newer with the "
            "extension Virtual Pinhole, and that it can open the file"
        )
    return status


def _told_level(scene: Any) -> dict[str, str]:
    """The least level that models all of a scene's light, and why; said on the way."""
    from ..tracer.scene.levels import least_level

    level, reason = least_level(scene)
    say(f"level {level} is enough. {reason}")
    return {"level": level, "reason": reason}


def _job(options: argparse.Namespace) -> Any:
    """The job that the words ask for."""
    from ..jobs.job import Job

    width, height = options.size or (None, None)
    stated = {
        name: getattr(options, name, None) for name in ("camera", "frame", "samples", "seed", "threads", "level", "error")
    }
    flags = {name: getattr(options, name) for name in ("trust", "clay", "recenter", "strict")}
    engine, device = getattr(options, "engine", "CYCLES"), getattr(options, "device", "CPU")
    approved = getattr(options, "scene", None) if options.command in ("check", "demo") else None
    return Job(width=width, height=height, blend=options.blend, engine=engine, device=device, scene=approved, **stated, **flags)


def ledger_lines(ledger: Sequence[dict[str, str]]) -> list[str]:
    """The ledger of a scene, for a terminal. ledger : as --json has it."""
    exported = sum(entry["status"] == "exported" for entry in ledger)
    rest = [f"  {entry['status']}: {entry['object']}: {entry['reason']}" for entry in ledger if entry["status"] != "exported"]
    return [f"{exported} of {len(ledger)} objects exported whole", *rest] if ledger else []


def _ledger_json(ledger: Sequence[Any]) -> list[dict[str, str]]:
    return [dataclasses.asdict(entry) for entry in ledger]
