"""The tools that the parts of an artist's first day share: pictures of the window, tabs, fields that are dragged."""

import importlib
import sys
from pathlib import Path

import bpy
from hands_in_a_window import NOWHERE, camera, move, region, window
from tour_hands import PROPERTIES, SIDEBAR, call, drag, find, photograph, settle, until

FOLDER, *PICTURES = map(Path, sys.argv[sys.argv.index("--") + 1 :])
PULL = 100  # pixels


def room(name):
    """A module of viewcam_addon.blender."""
    return importlib.import_module(f"bl_ext.user_default.virtual_pinhole.viewcam_addon.blender.{name}")


def warnings():
    """The warnings of the panel."""
    bpy.context.view_layer.update()
    return room("interface.panel").notices(camera(), bpy.context.scene)


def picture(name, where=None, mouse=NOWHERE):
    """Steps that take a picture of the window, or of a region of it, with the mouse out of the way."""
    if PICTURES:
        move(*mouse)
        for _ in range(12):
            yield
        part = region(*where)[1] if where else None
        place = (part.x, part.y, part.width, part.height) if part else (0, 0, window().width, window().height)
        photograph(place, PICTURES[0] / f"{name}.png", 100 if part else 60)


def show(tab):
    """Steps to a tab of the sidebar."""
    view, sidebar = region(*SIDEBAR)
    sidebar.active_panel_category = tab
    view.tag_redraw()
    yield
    yield


def in_properties(tab):
    """Steps to a tab of the Properties editor, from its top on."""
    area, part = region(*PROPERTIES)
    area.spaces.active.context = tab
    yield
    with bpy.context.temp_override(window=window(), area=area, region=part):
        for _ in range(20):
            bpy.ops.view2d.scroll_up(deltay=100)
    yield
    yield


def pulled(button, where, read):
    """Steps that drag a field to the right, and end with by how much its value went up."""
    before = read()
    place = yield from find(button, where)
    yield from drag(place, (PULL, 0))
    return read() - before


def choose_in_the_file_browser(operator, folder):
    """Steps that begin an operator which asks for a folder, and give it one."""
    windows = bpy.context.window_manager.windows
    call(operator)
    yield from until(lambda: len(windows) == 2, "the file browser")
    (area,) = windows[1].screen.areas
    yield from until(lambda: area.spaces.active.params is not None, "the file browser's folder")
    area.spaces.active.params.directory = str(folder).encode()
    yield from settle()
    part = next(part for part in area.regions if part.type == "WINDOW")
    with bpy.context.temp_override(window=windows[1], area=area, region=part):
        bpy.ops.file.execute()
