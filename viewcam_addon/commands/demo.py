"""Check the studio still that comes with the project, and write the report."""

import argparse
from pathlib import Path

from .. import argument_types as types
from ..errors import InputError
from ..terminal import say
from . import Result
from . import _options as shared
from .check import check_one

SCENE = Path(__file__).parents[2] / "sample_scenes" / "studio.blend"


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.set_defaults(blend=SCENE, writes=("report",))
    shared.add_light(added)
    shared.add_error(added, "the tracer takes")
    where = "where the report goes (default: %(default)s)"
    added.add_argument("--report", metavar="DIR", type=types.path, default=Path("demo"), help=where)


def run(options: argparse.Namespace) -> Result:
    if not options.blend.is_file():
        raise InputError(f"{options.blend} is not here: run the demo in a clone of the project, where its sample scenes are")
    say(f"{options.blend.name}: a camera given by four values, rendered by Cycles and by the reference tracer")
    return check_one(shared.job_of(options), options, report=str(options.report), command=f"viewcam {options.words}")
