"""Options that several commands have, and the job that their words ask for.

An option of a job is declared at its field of `Job` (jobs/job.py), for the command line, Python, pytest and workers alike.
"""

import argparse
import dataclasses
import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import argument_types as types
from ..errors import InputError, NotModeledError, counted
from ..terminal import say
from ..tracer.scene.film import LEVELS, SAMPLES

if TYPE_CHECKING:
    from ..jobs.job import Job

_OF_SCENES = ("camera", "frame", "strict", "recenter", "clay")
"""Fields of a job that several commands have an option for."""


def of_checks() -> tuple[str, ...]:
    """The fields of a job that `viewcam check` alone has an option for."""
    return tuple(field.name for field in _optional() if field.name not in (*_OF_SCENES, "trust"))


def _optional() -> list[dataclasses.Field[Any]]:
    """The fields of a job that declare an option."""
    from ..jobs.job import Job  # here, since `viewcam render` starts without

    return [field for field in dataclasses.fields(Job) if field.metadata]


def add_blend(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    """Add FILE.blend, where none is open, and --trust."""
    if not blend_is_open:
        added.add_argument("blend", metavar="FILE.blend", type=types.path, help="any file that Blender opens")
    else:
        added.set_defaults(blend=None)
    add_of_job(added, "trust")


def add_of_job(added: argparse._ActionsContainer, *names: str) -> None:
    """Add the options of these fields of a job, as the fields declare them."""
    for field in _optional():
        if field.name in names:
            settings = {"action": "store_true"} if field.default is False else {"default": field.default}
            added.add_argument(f"--{field.name.replace('_', '-')}", **settings | dict(field.metadata))


def add_scene_choices(added: argparse.ArgumentParser) -> None:
    """Add what of a file is looked at, and how."""
    add_of_job(added, *_OF_SCENES)
    add_size(added)
    add_light(added)


def add_size(added: argparse._ActionsContainer) -> None:
    added.add_argument("--size", type=types.size, metavar="WxH", help="pixels of the picture (default: the scene's)")


def add_light(added: argparse.ArgumentParser, samples: argparse._ActionsContainer | None = None) -> None:
    """Add the level and its sampling. samples : the group that --samples stands in, if it excludes something."""
    added.add_argument(
        "--level",
        choices=[*LEVELS, "auto"],
        default="geometry",
        help="how much is modeled; auto is the least that shows the scene's light (default: %(default)s)",
    )
    words = f"samples a pixel, for light (default: {SAMPLES})"
    (samples or added).add_argument("--samples", type=types.positive, metavar="N", help=words)
    noise = "another noise for another number (default: 0)"
    added.add_argument("--seed", type=types.seed, metavar="N", default=0, help=noise)


def add_error(added: argparse._ActionsContainer, text: str) -> None:
    """Add the wanted error.

    text : the help's beginning, which says what takes the samples or stands in their place.
    """
    text = f"for light: {text} as many samples of each pixel as it takes for a standard error of E, in the picture's units"
    added.add_argument("--error", type=types.above_zero, metavar="E", help=text)


def add_report(added: argparse.ArgumentParser) -> None:
    """Add the files of a comparison."""
    added.add_argument("--report", metavar="DIR", type=types.path, help="write an HTML report there")
    added.add_argument("--difference", metavar="FILE.png", type=types.png, help="draw there what differs, pixel by pixel")
    added.add_argument("--junit", metavar="FILE.xml", type=types.path, help="write the result as a test's, for CI systems")
    added.set_defaults(writes=("report", "difference"))


def job_of(options: argparse.Namespace, *names: str) -> "Job":
    """The job that the words ask for.

    names : the names of further fields, for which only this command has an option.
    """
    from ..jobs.job import Job

    width, height = getattr(options, "size", None) or (None, None)
    shared = (*_OF_SCENES, "trust", "samples", "seed", "threads", "level", "error")
    stated = {name: value for name in (*shared, *names) if (value := getattr(options, name, None)) is not None}
    return Job(width=width, height=height, blend=options.blend, **{"engine": "CYCLES"} | stated)


def in_another_blender(options: argparse.Namespace) -> int | None:
    """Run the command in the Blender that VIEWCAM_BLENDER names, which tells and writes all there is; its exit status.

    None where none is named, or this is a Blender that has a file open.

    Raises InputError if it can't be started, or ends otherwise than the command does.
    """
    from ..jobs.served_renderer import BLENDER

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
    if status not in (0, InputError.exit_status, NotModeledError.exit_status):
        raise InputError(
            f"{program}, which {BLENDER} names, ended with status {status}: see that it is Blender 4.2 or newer with the "
            "extension Virtual Pinhole, and that it can open the file"
        )
    return status


def say_level(scene: Any) -> dict[str, str]:
    """Print the least level that models all of a scene's light, and why; both as --json has them."""
    from ..tracer.scene import least_level

    level, reason = least_level(scene)
    say(f"level {level} is enough. {reason}")
    return {"level": level, "reason": reason}


def ledger_lines(ledger: Sequence[dict[str, str]]) -> list[str]:
    """The ledger of a scene, for a terminal: what did not come whole, and what is said of the world.

    ledger : the entries as --json has them.
    """
    exported = sum(entry["status"] == "exported" for entry in ledger)
    rest = [
        f"  {entry['object']}: {entry['status']}, {entry['reason']}"
        for entry in ledger
        if entry["status"] != "exported" or entry["reason"].startswith("the world ")
    ]
    return [f"{exported} of {counted(len(ledger), 'object')} exported whole", *rest] if ledger else []


def ledger_json(ledger: Sequence[Any]) -> list[dict[str, str]]:
    """The ledger of a scene as --json has it."""
    return [dataclasses.asdict(entry) for entry in ledger]
