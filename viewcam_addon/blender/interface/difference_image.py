"""The image of what differs between both sides of a comparison, and the Image Editor that shows it.

It is one datablock, packed: a file that is saved while an editor shows it keeps it, and names no folder that ends with Blender.
Rejected: turning an area of the artist's layout into an Image Editor, and `render.view_show`, which makes a Render Result.
"""

import bpy

from .comparing import Outcome

NAME = "Virtual Pinhole Difference"


def load(outcome: Outcome) -> bpy.types.Image:
    """The image of what differs: one datablock, packed, whose content is that of the outcome."""
    image = bpy.data.images.get((NAME, None))
    if image is None:
        image = bpy.data.images.load(str(outcome.difference))
        image.name = NAME
    else:
        if image.packed_file:
            image.unpack(method="REMOVE")
        image.filepath = str(outcome.difference)
        image.reload()
    image.pack()
    return image


def show(outcome: Outcome, context: bpy.types.Context, anyway: bool = False) -> None:
    """Show the difference in an Image Editor that is open and free for it, else in a new window.

    anyway : open one even where Blender's preferences say that a render opens none.
    """
    if not outcome.difference:
        return
    image = load(outcome)
    if bpy.app.background:
        return
    space = _free_image_editor(context.window_manager)
    if space is None and (anyway or context.preferences.view.render_display_type != "NONE"):
        space = _new_image_editor(context)
    if space:
        space.image = image


def _free_image_editor(manager: bpy.types.WindowManager) -> bpy.types.SpaceImageEditor | None:
    """One that shows the difference already, else one that is neither pinned nor painted in."""
    areas = [area for window in manager.windows for area in window.screen.areas if area.ui_type == "IMAGE_EDITOR"]
    spaces = [area.spaces.active for area in areas]
    free = [space for space in spaces if not space.use_image_pin and space.mode == "VIEW"]
    return next((space for space in spaces if space.image and space.image.name == NAME), free[0] if free else None)


def _new_image_editor(context: bpy.types.Context) -> bpy.types.SpaceImageEditor:
    windows = context.window_manager.windows
    with context.temp_override(window=context.window or windows[0]):
        bpy.ops.wm.window_new()
    area = windows[-1].screen.areas[0]
    area.ui_type = "IMAGE_EDITOR"
    return area.spaces.active
