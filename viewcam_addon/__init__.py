"""Virtual Pinhole: a camera from eye, look-at, up and view-plane distance, in Blender and in a reference tracer of its own.

Importing this package needs no Blender. `register` and `unregister` are what Blender calls.
"""

_command = None


def register() -> None:
    """Add the panel, the properties and, where Blender runs in the shell, the command `viewcam`."""
    global _command
    import bpy

    from . import blender

    blender.register()
    _command = bpy.utils.register_cli_command("viewcam", _run_command)


def unregister() -> None:
    global _command
    import bpy

    from . import blender

    bpy.utils.unregister_cli_command(_command)
    _command = None
    blender.unregister()


def _run_command(arguments: list[str]) -> int:
    from . import cli

    return cli.main(arguments)
