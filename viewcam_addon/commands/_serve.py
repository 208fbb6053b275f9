"""`viewcam serve`: for our own processes, and no command for people."""

import argparse
from pathlib import Path

from ..jobs import plan, served_renderer
from . import Result, blender_room, check
from ._carry_out import carry_out


def add_options(added: argparse.ArgumentParser, blend_is_open: bool) -> None:
    added.add_argument("what")
    added.set_defaults(json=None, log_json=True, writes=(), blend=None)


def run(options: argparse.Namespace) -> Result:
    """Do what another process wants.

    what : a handle, for a Blender that renders and checks the jobs of the process that started it; or a file of jobs and how
    they are carried out, as jobs.plan.write has written it.
    """
    if options.what.isdecimal():
        served_renderer.serve(options.what, blender_room("jobs.renderer").BlenderRenderer)
        return 0, {}
    jobs, wanted, files = plan.read(Path(options.what))
    if wanted is None:
        options.json = plan.result_of(Path(options.what))
        return check.check_one(jobs[0], options, **files)
    summary = carry_out(wanted, lambda _: jobs, options.events)
    return summary.exit_status, summary.to_json()
