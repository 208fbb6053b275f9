"""Write the scene of a .blend as the tracer reads it."""

import argparse

from .. import argument_types as types
from ..terminal import say, silent_libraries
from . import Result, blender_room
from . import _options as shared


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    shared.add_blend(added, blend_is_open)
    added.add_argument("scene", metavar="SCENE.json", type=types.path)
    added.set_defaults(writes=("scene",))
    shared.add_scene_choices(added)


def run(options: argparse.Namespace) -> Result:
    from ..tracer.scene import scene_file

    if (status := shared.in_another_blender(options)) is not None:
        return status, {}
    with silent_libraries():
        scene = blender_room("jobs.renderer").export(shared.job_of(options))
    scene_file.write(scene, options.scene)
    ledger = shared.ledger_json(scene.ledger)
    say(*shared.ledger_lines(ledger))
    result = {"scene": str(options.scene), "ledger": ledger}
    return 0, result | (shared.say_level(scene) if options.level != "geometry" else {})
