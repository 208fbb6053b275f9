"""Virtual Pinhole: a camera from eye, look-at, up and view-plane distance, in Blender and in a reference tracer of its own.

Importing this package needs no Blender, and each name of `__all__` is imported when it is first asked for, since Blender's
start shall not wait for a tracer. `register` and `unregister` are what Blender calls.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import cameras as cameras
    from .api import compare as compare
    from .api import label as label
    from .api import read_scene as read_scene
    from .api import render as render
    from .errors import InputError as InputError
    from .image import Image as Image
    from .jobs.check import Check as Check
    from .jobs.check import check as check
    from .labels.scene_labels import Labels as Labels
    from .pinhole import Pinhole as Pinhole
    from .tracer.scene import Scene as Scene

_HOMES = {
    "Pinhole": "pinhole",
    "Scene": "tracer.scene",
    "Image": "image",
    "Check": "jobs.check",
    "InputError": "errors",
    "cameras": "cameras",
    "read_scene": "api",
    "render": "api",
    "label": "api",
    "Labels": "labels.scene_labels",
    "compare": "api",
    "check": "jobs.check",
}
__all__ = [
    "Check",
    "Image",
    "InputError",
    "Labels",
    "Pinhole",
    "Scene",
    "cameras",
    "check",
    "compare",
    "label",
    "read_scene",
    "render",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = importlib.import_module(f".{_HOMES[name]}", __name__)
    return home if name == _HOMES[name] else getattr(home, name)


def register() -> None:
    """Add the panel, the properties and, where Blender runs in the shell, the command `viewcam`."""
    from . import blender

    blender.register()
    blender.register_command("viewcam", _run_command)


def unregister() -> None:
    """Take all of it away again."""
    from . import blender

    blender.unregister_command()
    blender.unregister()


def _run_command(arguments: list[str]) -> int:
    from . import cli

    return cli.main(arguments, blend_is_open=True)
