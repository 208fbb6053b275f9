"""What a command needs that is not in its own process for certain: Blender, and a second process."""

import importlib
import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType

from .. import children
from ..errors import InputError
from ..events import Events


def blender_room(name: str) -> ModuleType:
    """The module of blender/ with this name.

    Raises
    ------
    InputError
        where there is no Blender.
    """
    if importlib.util.find_spec("bpy") is None:
        raise InputError(
            "this needs Blender: install it as a module (pip install bpy), or run blender -b FILE.blend --command viewcam"
        )
    return importlib.import_module(f"..blender.{name}", __package__)


def run_beside(*arguments: str | Path, tell_on: Events | None = None) -> int:
    """Run a sub-command in a Python process of its own, with the same modules in reach as here; its exit status.

    tell_on : whom its events are told, with --log-json; else it prints what there is to say itself.
    """
    sys.stdout.flush()
    command, variables = children.viewcam(*arguments), children.environment()
    if tell_on is None:
        return subprocess.run(command, env=variables, check=False).returncode
    with subprocess.Popen([*command, "--log-json"], env=variables, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as child:
        for line in child.stdout:
            event = json.loads(line)
            if event["event"] not in ("started", "finished"):
                tell_on.tell(**event)
    return child.returncode
