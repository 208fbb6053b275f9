"""Render a .blend with Cycles so that it can be compared, and give every setting back."""

import argparse

from .. import argument_types as types
from ..terminal import say, silent_libraries
from . import Result, blender_room
from . import _options as shared


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    shared.add_blend(added, blend_is_open)
    added.add_argument("image", metavar="OUT.exr", type=types.path)
    added.set_defaults(writes=("image",))
    shared.add_scene_choices(added)


def run(options: argparse.Namespace) -> Result:
    if (status := shared.in_another_blender(options)) is not None:
        return status, {}
    with silent_libraries():
        ledger = shared.ledger_json(blender_room("jobs.renderer").cycles(shared.job_of(options), options.image))
    say(*shared.ledger_lines(ledger))
    return 0, {"image": str(options.image), "ledger": ledger}
