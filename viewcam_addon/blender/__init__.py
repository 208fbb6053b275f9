"""Everything that touches Blender. Importing this package needs no Blender; its modules do."""


def register() -> None:
    """Classes, properties and handlers, in this order: a panel needs its operators, an operator its properties."""
    import bpy

    from . import animation, operators, panel, properties

    properties.register()
    for each in (*operators.CLASSES, *panel.CLASSES):
        bpy.utils.register_class(each)
    animation.register()


def unregister() -> None:
    """The same, in reverse."""
    import bpy

    from . import animation, operators, panel, properties

    animation.unregister()
    for each in reversed((*operators.CLASSES, *panel.CLASSES)):
        bpy.utils.unregister_class(each)
    properties.unregister()
