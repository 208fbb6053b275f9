"""The sub-commands of `viewcam`, a module each, of the command's name.

`add_options(parser, blend_is_open)` adds its options to a parser that has those of every command already; `run(options)`
returns the exit status and what --json writes. options.py has the options of several.
"""

import importlib
import importlib.util
from types import ModuleType
from typing import Any

from ..errors import InputError

Result = tuple[int, dict[str, Any]]


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
