"""The sub-commands of `viewcam`: each module here whose name begins with no underscore is the command of its name.

Its docstring begins with a line that --help shows; `add_options(parser, blend_is_open)` adds its options to a parser that has
those of every command already; `run(options)` returns the exit status and what --json writes. _options.py has the options of
several, _serve.py is a command for our own processes.
"""

import importlib
import importlib.util
import pkgutil
from types import ModuleType
from typing import Any

from ..errors import InputError

Result = tuple[int, dict[str, Any]]


def names() -> list[str]:
    """The names of all commands, in the alphabet's order."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__) if not module.name.startswith("_"))


def summary(name: str) -> str:
    """The first line of a command's module, read from its source: it takes no time, as importing all of them would."""
    module = f"{__name__}.{name}"
    spec: Any = importlib.util.find_spec(module)
    return (spec.loader.get_source(module) or '""""""').split('"""', 2)[1].partition("\n")[0]


def blender_room(name: str) -> ModuleType:
    """The module of blender/ with this name. Raises InputError where there is no Blender."""
    if importlib.util.find_spec("bpy") is None:
        raise InputError(
            "this needs Blender: install it as a module (pip install bpy), or run blender -b FILE.blend --command viewcam"
        )
    return importlib.import_module(f"..blender.{name}", __package__)
