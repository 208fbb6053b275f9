"""Everything that touches Blender. Importing this package needs no Blender; its modules do."""

from collections.abc import Callable

_command = None


def register() -> None:
    """Classes, properties and handlers, in this order: a panel needs its operators, an operator its properties."""
    import bpy

    from . import (
        animation,
        clipboard,
        engine,
        file_menu,
        moving,
        operators,
        panel,
        properties,
        render_panels,
        render_settings,
        view_menu,
    )

    properties.register()
    render_settings.register()
    for each in (*operators.CLASSES, *moving.CLASSES, *clipboard.CLASSES, *panel.CLASSES, *engine.CLASSES):
        bpy.utils.register_class(each)
    render_panels.register()
    file_menu.register()
    view_menu.register()
    animation.register()


def ensure_registered() -> None:
    """Register unless that is done: the bpy module knows no add-ons."""
    import bpy

    if not hasattr(bpy.types.Object, "virtual_pinhole"):
        register()


def unregister() -> None:
    """The same, in reverse."""
    import bpy

    from . import (
        animation,
        clipboard,
        engine,
        file_menu,
        moving,
        operators,
        panel,
        properties,
        render_panels,
        render_settings,
        view_menu,
    )

    animation.unregister()
    view_menu.unregister()
    file_menu.unregister()
    render_panels.unregister()
    for each in reversed((*operators.CLASSES, *moving.CLASSES, *clipboard.CLASSES, *panel.CLASSES, *engine.CLASSES)):
        bpy.utils.unregister_class(each)
    render_settings.unregister()
    properties.unregister()


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
