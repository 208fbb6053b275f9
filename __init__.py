"""The root of the Blender extension: Blender wants an `__init__.py` beside blender_manifest.toml.

Nothing is imported at module level, on purpose: pytest imports this file as well, from folders whose name is no identifier.
"""


def register():
    from . import viewcam_addon

    viewcam_addon.register()


def unregister():
    from . import viewcam_addon

    viewcam_addon.unregister()
