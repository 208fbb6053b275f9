"""Everything that touches Blender. Importing this package needs no Blender; its modules do."""

from collections.abc import Callable
from types import ModuleType

_command = None


def _rooms() -> list[ModuleType]:
    """Modules with CLASSES for Blender or more to tell it: in order, as a panel needs operators, an operator properties."""
    from . import animation, own_picture, preferences, properties, render_settings, resolution
    from .interface import (
        baking,
        clipboard,
        converting,
        file_menu,
        gizmos,
        labels,
        moving,
        operators,
        overlay,
        panel,
        photo_matching,
        presets,
        proof,
        render_all,
        render_panels,
        scene_cameras,
        swipe,
    )
    from .rendering import engine

    buttons = [operators, moving, clipboard, baking, converting, presets]
    interface = [panel, scene_cameras, photo_matching, swipe, proof, render_all, labels, overlay, gizmos]
    followers = [animation, resolution, own_picture]
    return [preferences, properties, render_settings, *buttons, *interface, engine, render_panels, file_menu, *followers]


def register() -> None:
    """Classes, properties, menu entries and handlers."""
    import bpy

    for room in _rooms():
        for each in getattr(room, "CLASSES", ()):
            bpy.utils.register_class(each)
        if hasattr(room, "register"):
            room.register()


def ensure_registered() -> None:
    """Register unless that is done: the bpy module knows no add-ons."""
    import bpy

    if not hasattr(bpy.types.Object, "virtual_pinhole"):
        register()


def unregister() -> None:
    """Take away what `register` added, in reverse."""
    import bpy

    for room in reversed(_rooms()):
        if hasattr(room, "unregister"):
            room.unregister()
        for each in reversed(getattr(room, "CLASSES", ())):
            bpy.utils.unregister_class(each)


def register_command(name: str, run: Callable[[list[str]], int]) -> None:
    """Add `blender --command NAME ARGUMENT…`; `run` takes the arguments and returns the exit status."""
    global _command
    import bpy

    _command = bpy.utils.register_cli_command(name, run)


def unregister_command() -> None:
    """Take the command away again."""
    global _command
    import bpy

    bpy.utils.unregister_cli_command(_command)
    _command = None
