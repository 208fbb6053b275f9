"""Export, trace, render with Cycles or another engine and compare, all in one go.

Many pictures are a batch without pictures. What Blender does (export, Cycles) and what OpenEXR does (the tracer's pictures, the
comparison) never share a process, because Blender brings a copy of OpenEXR of its own: the first is done where Blender is and
the second in the tracer's process (jobs/tracing.py), in the shell and inside Blender alike.
"""

import argparse
import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files import temporary_folder
from ..terminal import say, silent_libraries
from . import Result, _carry_out
from . import _options as shared


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    shared.add_blend(added, blend_is_open)
    shared.add_scene_choices(added)
    shared.add_of_job(added, *shared.of_checks())
    shared.add_error(added, "the tracer takes")
    shared.add_report(added)
    many = added.add_argument_group("many checks, a shot each; --report has their page and results")
    many.add_argument("--frames", metavar="A..B", help="the camera at each frame (from -5 on: --frames=-5..3)")
    many.add_argument("--cameras", metavar="GLOB", help="each camera so called: with * ? [abc]")
    many.add_argument("--shard", metavar="I/N", help="of all these, every N-th from the I-th on")
    kept = many.add_mutually_exclusive_group()
    kept.add_argument("--resume", action="store_true", help="keep the results that are there from the same settings")
    kept.add_argument("--overwrite", action="store_true", help="check all of them anew")
    _carry_out.add_machines(added)


def run(options: argparse.Namespace) -> Result:
    job = shared.job_of(options, *shared.of_checks())
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
    """Check one job.

    report, difference, sides, command : see tracing.Written; the report's folder keeps all pictures.
    """
    from ..comparison.answer import exit_status
    from ..jobs.plan import Plan
    from ..jobs.tracing import Written

    reference = str(Path(report, "reference.exr")) if report else None
    written = Written(report, difference, sides, reference, command)
    plan = Plan(Path(), blend=Path(job.blend) if job.blend else None, trust=job.trust)
    with silent_libraries(), _carry_out.opened(plan, options.events) as renderer:
        result = renderer.check(job, has_picture=False, written=written, keep=Path(report) if report else None)
    if "reason" in result:
        say(f"level {result['level']} is enough. {result['reason']}")
    seconds, (width, height) = result["seconds"], result["result"]["size"]
    engine = (job.engine or "Cycles").capitalize()
    say(f"exported and rendered with {engine} in {seconds['rendered']:.1f} s")
    say(f"traced {width} × {height} pixels in {seconds['traced']:.2f} s")
    say(*shared.ledger_lines(result["result"]["ledger"]), *result["lines"])
    return exit_status(result["answer"], job.strict), result["result"]


def _check_many(options: argparse.Namespace, job: Any) -> Result:
    """Checks of a range of frames or of several cameras, a shot each."""
    from ..jobs import makers
    from ..jobs.folder import Outputs

    _refuse_of_many(options)
    frames = None if options.frames is None else makers.frames(options.frames, options.camera)
    outputs = Outputs(picture=False, check=True, report=options.report is not None)

    def jobs_of(renderer: Any) -> Sequence[Any]:
        return makers.from_cameras(options.cameras, renderer.cameras) if frames is None else frames

    def complete(shot: Any) -> Any:
        stated = {"camera": shot.camera, "name": shot.name} | ({} if shot.frame is None else {"frame": shot.frame})
        return dataclasses.replace(job, **stated)

    with temporary_folder() as temporary:
        plan = _carry_out.plan_of(options, out=options.report or temporary, outputs=outputs)
        summary = _carry_out.carry_out(plan, jobs_of, options.events, complete)
    status = summary.exit_status or (3 if options.strict and summary.counts["not_all_modeled"] else 0)
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
