"""`viewcam serve`: a Blender that renders the shots of a batch for the process that started it. No command for people."""

import argparse

from ..batch import render_server
from . import Result
from .processes import blender_room


def run(options: argparse.Namespace) -> Result:
    render_server.serve(options.handle, blender_room("batch.renderer").BlenderRenderer)
    return 0, {}
