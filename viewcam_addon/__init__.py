"""Virtual Pinhole: a camera from eye, look-at, up and view-plane distance, in Blender and in a reference tracer of its own.

Importing this package needs no Blender. `register` and `unregister` are what Blender calls.
"""


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
