"""Jobs of one file carried out, here or on a cluster: what `viewcam batch` does, and `viewcam check` of many pictures.

Whatever is wrong with any job is told before the first is begun. Libraries are silent all the while: of a batch, its events
are heard.
"""

import argparse
import contextlib
import dataclasses
import functools
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .. import argument_types as types
from .. import crashes
from ..errors import InputError, counted
from ..events import Events
from ..file_names import one_file
from ..jobs import cluster, dataset, one, served_renderer
from ..jobs import run as running
from ..jobs.folder import Folder, settings_hash
from ..jobs.interruption import Interruption
from ..jobs.job import Job
from ..jobs.lists import ShotsError
from ..jobs.plan import Plan, shard
from ..jobs.summary import Summary
from ..terminal import say, silent_libraries
from . import blender_room

_MOST_NAMED = 5
_OPEN_TO_ALL = "whoever reaches {} can run any program on its workers: docs/farm.md says how TLS lets in only your own"


@dataclasses.dataclass(frozen=True)
class _WorkList:
    """The jobs to carry out, and the hashes of what they are made from.

    jobs : the jobs of this run.
    all_jobs : the jobs of a dataset, else those of this run.
    made_from : everything but the job that decides what a picture looks like.
    settings : the hash of what each of all_jobs is made from, by its name.
    """

    all_jobs: Sequence[Job]
    jobs: Sequence[Job]
    made_from: Mapping[str, Any]
    settings: Mapping[str, str]


def add_machines(added: argparse.ArgumentParser) -> None:
    """Add the options that have more than one process do the work."""
    machines = added.add_argument_group("more than one process")
    limit = "seconds that a shot may take; then its Blender is ended, and the shot has failed"
    machines.add_argument("--time-limit", type=types.above_zero, metavar="SECONDS", help=limit)
    machines.add_argument("--workers", type=types.positive, metavar="N", help="work in N processes of this machine")
    where = "work on a Dask cluster, as tcp://host:8786 (without an address: on one of this machine)"
    machines.add_argument("--scheduler", metavar="ADDRESS", nargs="?", const="", type=_address, help=where)


def _address(text: str) -> str:
    if "://" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is no address of a Dask scheduler: write tcp://host:8786")
    return text


def plan_of(options: argparse.Namespace, **others: Any) -> Plan:
    """The plan that the options of a command state, each called as its field is; and `others`, which no option says so."""
    stated = {field.name: getattr(options, field.name) for field in dataclasses.fields(Plan) if hasattr(options, field.name)}
    return Plan(**(stated | others))


def carry_out(
    plan: Plan,
    jobs_of: Callable[[Any], Sequence[Job]],
    events: Events,
    complete: Callable[[Job], Job] = lambda job: job,
    source: str = "",
) -> Summary:
    """Carry out jobs of one file, here or on a cluster, and tell what it came to.

    jobs_of : a renderer (BlenderRenderer) → the jobs.
    complete : gives each what it does not say itself.
    source : the list that they are from.

    Raises InputError if the file can't be opened or the folder not be written; ShotsError with all that is wrong with the jobs.
    """
    on_signal = functools.partial(events.tell, "stopping")
    with silent_libraries(), Interruption(on_signal, crashes.passed_on) as interruption, contextlib.ExitStack() as stack:
        renderer = stack.enter_context(opened(plan, events))
        work_list = _work_list(plan, jobs_of(renderer), complete, renderer, source)
        _refuse_to_replace(source, plan, work_list)
        if plan.is_on_cluster:
            blend, program = renderer.blend, renderer.program
            stack.close()  # the workers open the file themselves
            if (plan.scheduler or "").startswith("tcp://"):
                events.tell("note", command=plan.command, text=_OPEN_TO_ALL.format(plan.scheduler))
            count = plan.workers and min(plan.workers, max(len(work_list.jobs), 1))  # more of them have nothing to do
            machines = stack.enter_context(cluster.opened(plan.scheduler or None, count, program))
        folder = Folder(plan.out, plan.shard.strip().replace("/", "-of-") if plan.shard else "")
        if plan.transforms:
            dataset.check_folder(folder)
        if plan.is_on_cluster:
            about = (plan.outputs, plan.trust, plan.time_limit)
            work = machines.work(blend, folder, work_list.settings, work_list.made_from, *about)
        else:
            work = one.in_turn(folder, renderer, work_list.settings, plan.outputs)
        unknown = tuple(work_list.made_from.get("unknown", ()))
        overwrite = plan.overwrite or bool(plan.resume_known and unknown)
        summary = running.run(
            work_list.jobs,
            folder,
            work_list.settings,
            work,
            events,
            resume=plan.resume or plan.resume_known,
            overwrite=overwrite,
            outputs=plan.outputs,
            interruption=interruption,
        )
        words = ""
        if plan.transforms:
            words = dataset.write(folder, work_list.all_jobs, work_list.settings, plan.transforms, plan.test)
    _tell(plan, events, summary, folder, unknown)
    if words:
        say(words)
    return summary


def opened(plan: Plan, events: Events) -> contextlib.AbstractContextManager:
    """Blender with the file open, in this process; but in one of its own where VIEWCAM_BLENDER names one, workers will, or time
    is limited.

    The bpy module puts folders on sys.path in which a worker's children, who get that path, would find half a bpy.
    """
    apart = os.environ.get(served_renderer.BLENDER) or plan.is_on_cluster or plan.time_limit
    if plan.blend is not None and apart:
        return served_renderer.ServedRenderer(plan.blend, plan.trust, plan.time_limit, events)
    if plan.time_limit and not plan.is_on_cluster:
        raise InputError("--time-limit ends the Blender of a shot, and here that is this one: give --workers 1 as well")
    return blender_room("jobs.renderer").BlenderRenderer(plan.blend, plan.trust, events)


def _work_list(plan: Plan, listed: Sequence[Job], complete: Callable[[Job], Job], renderer: Any, source: str) -> _WorkList:
    """All that is to be rendered, once nothing is wrong with it."""
    jobs = [complete(job) for job in (shard(listed, plan.shard) if plan.shard else listed)]
    all_jobs = [complete(job) for job in listed] if plan.shard and plan.transforms else jobs
    if problems := renderer.problems(all_jobs, plan.outputs):
        raise ShotsError(source or str(plan.blend or renderer.blend), tuple(problems))
    if plan.is_on_cluster and renderer.blend is None:
        raise InputError("this file is nowhere that workers could open it: save it first")
    if plan.outputs.labels:
        _refuse_names_of_labels(all_jobs)
    if plan.transforms:
        dataset.refuse(all_jobs, plan.transforms, plan.test)
    made_from = renderer.made_from()
    settings = {job.name: settings_hash(job, made_from) for job in all_jobs}
    return _WorkList(all_jobs, jobs, made_from, settings)


def _refuse_to_replace(source: str, plan: Plan, work_list: _WorkList) -> None:
    """Refuse a list, or a file of cameras, in whose place a file of the batch itself would stand."""
    if not source or os.path.dirname(os.path.realpath(source)) != os.path.realpath(plan.out):
        return
    name, own = one_file(os.path.basename(source)), ["summary.json", *["transforms.json"][: bool(plan.transforms)]]
    if name in own or name in (one_file(f"{job.name}.json") for job in work_list.jobs):
        raise InputError(f"{source} is what the batch would write over: give another folder for --out")


def _refuse_names_of_labels(shots: Sequence[Job]) -> None:
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


def _tell(plan: Plan, events: Events, summary: Summary, folder: Folder, unknown: Sequence[str]) -> None:
    """In one line what the batch came to.

    unknown : sentences on what may have changed in the pictures that were kept.
    """
    counts = summary.counts
    shots = counted(counts["shots"], "shot")
    if counts["failed"] or counts["left"]:
        what = f"of {shots}, {counts['failed']} failed and {counts['left']} are left"
        events.tell("error", command=plan.command, text=f"{what}: the same command with --resume renders them")
        return
    kept = f", {summary.kept} of them kept" if summary.kept else ""
    say(f"{shots}{kept}, in {summary.seconds:.1f} s: {folder.contact_sheet}")
    if summary.kept and unknown:
        more = f" (and {len(unknown) - 1} more)" if len(unknown) > 1 else ""
        say(f"whether those that were kept are still right is not sure: --resume-known renders them. {unknown[0]}{more}")
    if unlike := [shot["name"] for shot in summary.shots if shot.get("passed") is False]:
        named = ", ".join(unlike[:_MOST_NAMED]) + (", …" if len(unlike) > _MOST_NAMED else "")
        say(f"{len(unlike)} different: {named}; {folder.summary} says how")
