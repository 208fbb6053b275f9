"""View › Cameras › Virtual Pinhole, in the 3D viewport: all buttons of the panel once more.

Blender's search (F3) looks through menus; what stands in none is found by developers alone.
"""

import bpy

from . import baking, clipboard, dragging, moving, operators, photo_matching, scene_cameras, swipe


class VIEWCAM_MT_cameras(bpy.types.Menu):
    bl_idname = "VIEWCAM_MT_cameras"
    bl_label = "Virtual Pinhole"

    def draw(self, _context: bpy.types.Context) -> None:
        for group in (
            moving.CLASSES,
            operators.CLASSES,
            baking.CLASSES,
            clipboard.IN_MENUS,
            scene_cameras.OPERATORS,
            photo_matching.OPERATORS,
            swipe.CLASSES,
        ):
            for each in group:
                if each is moving.VIEWCAM_OT_drag_camera:
                    for kind, name in dragging.NAMES.items():
                        self.layout.operator(each.bl_idname, text=f"Drag: {name}").kind = kind
                else:
                    self.layout.operator(each.bl_idname)
            self.layout.separator()
        self.layout.menu(clipboard.VIEWCAM_MT_copy_camera_as.bl_idname)


def _draw(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.separator()
    menu.layout.menu(VIEWCAM_MT_cameras.bl_idname)


CLASSES = (VIEWCAM_MT_cameras,)


def register() -> None:
    bpy.types.VIEW3D_MT_view_cameras.append(_draw)


def unregister() -> None:
    bpy.types.VIEW3D_MT_view_cameras.remove(_draw)
