"""Runs inside a real Blender with a window: what an artist tries on the first day, by mouse and keys, and what came of it.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python artist_in_a_window.py -- FOLDER [PICTURES]

FOLDER : where rendered pictures go. PICTURES : where pictures of the window go; without it none are taken.
G, Lock Camera to View and walking are in panel_in_a_window.py, drags in the viewport in handles_in_a_window.py, the proof in
proof_in_a_window.py, a photo in photo_in_a_window.py. Leaves with status 0, or 5 and a traceback.
"""

import importlib
import math
import sys
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view

sys.path.append(str(Path(__file__).parent))
from panel_in_a_window import NOWHERE, camera, is_at_its_values, move, open_the_panels, press, region, start, values, window
from tour_hands import PROPERTIES, SIDEBAR, call, drag, find, photograph, push, settle, type_into, unfold, until

FOLDER, *PICTURES = map(Path, sys.argv[sys.argv.index("--") + 1 :])
ADDON = "bl_ext.user_default.virtual_pinhole"
PULL = 100  # pixels
EMPTY_SCENE_LENS = 50.0


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


def tick_the_box():
    assert camera().data.lens == EMPTY_SCENE_LENS
    yield from push("virtual_pinhole.enabled")
    assert values().enabled and values().lens_unit == "MILLIMETERS"
    yield from picture("enabled", SIDEBAR)


def drag_the_fields():
    """Each goes as far as Blender's own field of the same kind."""
    yield from in_properties("DATA")
    ours = yield from pulled("virtual_pinhole.focal_length", SIDEBAR, lambda: values().focal_length)
    theirs = yield from pulled("lens", PROPERTIES, lambda: camera().data.lens)
    print(f"{PULL} px: lens {ours:.2f} mm, Blender's {theirs:.2f} mm", flush=True)
    assert theirs > 50 and abs(ours - theirs) < 1e-3 * theirs
    values().lens_unit = "PIXELS"
    yield
    yield
    before = values().distance
    in_pixels = yield from pulled("virtual_pinhole.distance", SIDEBAR, lambda: values().distance)
    print(f"{PULL} px: d {in_pixels:.1f} px of {before:.1f}", flush=True)
    assert abs(in_pixels / theirs / (1920 / 36) - 1) < 0.1, "not as far as in millimeters"
    values().lens_unit = "MILLIMETERS"
    pinhole = [
        (yield from pulled("virtual_pinhole.roll", SIDEBAR, lambda: values().roll)),
        (yield from pulled("virtual_pinhole.eye[0]", SIDEBAR, lambda: values().eye[0])),
    ]
    yield from type_into("virtual_pinhole.roll", "12.3456")
    yield from picture("digits", SIDEBAR)
    yield from type_into("virtual_pinhole.roll", "0")
    yield from show("Item")
    item = [
        (yield from pulled("rotation_euler[2]", SIDEBAR, lambda: camera().rotation_euler[2])),
        (yield from pulled("location[0]", SIDEBAR, lambda: camera().location[0])),
    ]
    yield from show("Pinhole")
    print(f"{PULL} px: roll and eye {pinhole}, Blender's rotation and location {item}", flush=True)
    np.testing.assert_allclose(pinhole, item, rtol=1e-3)
    is_at_its_values()


def type_millimeters():
    """In our field and in Blender's; what is edited then does not throw them back."""
    yield from type_into("virtual_pinhole.focal_length", "85")
    assert abs(camera().data.lens - 85) < 85 * 2**-23, f"typed 85 mm, and the lens is {camera().data.lens}"
    yield from type_into("lens", "35", PROPERTIES)
    assert abs(values().focal_length - 35) < 35 * 2**-22, f"typed 35 mm in Blender's field, and ours is {values().focal_length}"
    yield from type_into("virtual_pinhole.eye[2]", "6")
    assert abs(camera().data.lens - 35) < 35 * 2**-22 and values().eye[2] == 6
    is_at_its_values()


def double_the_resolution():
    """A still of twice the size shows the same."""
    lens = camera().data.lens
    yield from in_properties("OUTPUT")
    for name, pixels in (("resolution_x", 3840), ("resolution_y", 2160)):
        yield from type_into(f"render.{name}", str(pixels), PROPERTIES)
    render = bpy.context.scene.render
    assert (render.resolution_x, render.resolution_y) == (3840, 2160)
    assert abs(camera().data.lens - lens) < lens * 2**-21, f"{lens} mm became {camera().data.lens}"
    render.resolution_x, render.resolution_y = 1920, 1080
    yield from in_properties("DATA")


def frame_the_cube():
    """It is in the middle of the picture then, and fills it but for the margin."""
    cube = bpy.data.objects["Cube"]
    cube.location = (1, 2, 0.5)
    cube.select_set(True)
    values().look_at = (-1, 0, 0)
    yield
    yield from unfold("viewcam.frame_selection(")
    for by in ("EYE", "DISTANCE"):
        yield from push(f"viewcam.frame_selection(camera=\"Camera\", by='{by}'")
        seen = [world_to_camera_view(bpy.context.scene, camera(), cube.matrix_world @ each.co) for each in cube.data.vertices]
        middle = world_to_camera_view(bpy.context.scene, camera(), cube.location)
        np.testing.assert_allclose(middle[:2], (0.5, 0.5), atol=1e-5, err_msg=f"framed by {by}")
        room = min(min(x, y, 1 - x, 1 - y) for x, y, _ in seen)
        assert abs(room - 0.05) < 1e-4, f"framed by {by}, the margin is {room:.5f} of the picture and not 5 %"
        is_at_its_values()
    cube.select_set(False)


def dolly_by_a_button():
    """A click takes hold of the camera, the mouse moves it, a click lets it go."""
    button = "viewcam.drag_camera(camera=\"Camera\", kind='DOLLY')"
    yield from unfold("viewcam.drag_camera(")
    x, y = yield from find(button)
    eye, look_at = tuple(values().eye), tuple(values().look_at)
    yield from push(button)
    for by in (30, 60, PULL):
        move(x - by, y)
        yield
    yield from picture("dolly", mouse=(x - PULL, y))
    press("LEFTMOUSE", x - PULL, y)
    yield
    yield
    moved = math.dist(eye, values().eye) / math.dist(eye, look_at)
    assert moved > 0.3 and tuple(values().look_at) == look_at, f"dolly moved the eye by {100 * moved:.1f} %"
    is_at_its_values()


def bake_and_turn_on_again():
    """One warning in plain words, and its button is the way back."""
    for frame, height in ((1, 3), (20, 6)):
        values().eye[2] = height
        values().keyframe_insert("eye", frame=frame)
    bpy.context.scene.frame_end = 20
    yield from push("viewcam.bake_camera(")
    press("RET", *NOWHERE)
    for _ in range(20):
        yield
    assert not values().enabled and camera().animation_data.action, "nothing is baked"
    yield from push("virtual_pinhole.enabled")
    yield
    yield from picture("baked", SIDEBAR)
    yield from push("viewcam.delete_keyframes(")
    bpy.context.view_layer.update()
    found = importlib.import_module(f"{ADDON}.viewcam_addon.blender.interface.panel").notices(camera(), bpy.context.scene)
    assert found == [], found
    camera().animation_data_clear()
    camera().data.animation_data_clear()
    yield


def another_object_is_active():
    """The panel names the camera that it is about, and says that it is not the active object."""
    window().view_layer.objects.active = bpy.data.objects["Cube"]
    yield
    yield
    yield from find("virtual_pinhole.eye[0]")
    yield from picture("cube_is_active", SIDEBAR)
    window().view_layer.objects.active = camera()
    yield


def draw_on_light_and_dark():
    """The diagram, its letters and its handles; and the sidebar as narrow as it gets before Blender hides it."""
    view, _ = region("VIEW_3D", "WINDOW")
    shading, shown = view.spaces.active.shading, view.spaces.active.region_3d
    values().eye, values().look_at, values().up = (4, -6, 3.5), (0.5, 0.5, 0.5), (0, 0, 1)
    shown.view_location, shown.view_distance = (1.5, -2, 1.5), 16
    shading.background_type = "VIEWPORT"
    for name, grey in (("light", 0.9), ("middle", 0.2), ("dark", 0.0)):
        shading.background_color = (grey,) * 3
        yield from picture(f"diagram_on_{name}", ("VIEW_3D", "WINDOW"))
    shading.background_type = "THEME"
    _, sidebar = region(*SIDEBAR)
    yield from drag((sidebar.x + 1, sidebar.y + 300), (90, 0))
    yield from picture("narrow", SIDEBAR)
    print(f"the sidebar is {region(*SIDEBAR)[1].width} pixels wide", flush=True)
    yield from drag((region(*SIDEBAR)[1].x + 1, sidebar.y + 300), (-90, 0))


def render_two_formats():
    """Both cameras by one click, each in its own picture."""
    scene, render_all = bpy.context.scene, importlib.import_module(f"{ADDON}.viewcam_addon.blender.interface.render_all")
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    other = bpy.data.objects.new("Portrait", bpy.data.cameras.new("Portrait"))
    scene.collection.objects.link(other)
    other.matrix_world = camera().matrix_world
    own = other.virtual_pinhole_picture
    own.use, own.resolution_x, own.resolution_y = True, 30, 40
    yield
    windows = bpy.context.window_manager.windows
    call(bpy.ops.viewcam.render_all_cameras)
    yield from until(lambda: len(windows) == 2, "the file browser")
    (area,) = windows[1].screen.areas
    yield from until(lambda: area.spaces.active.params is not None, "the file browser's folder")
    area.spaces.active.params.directory = str(FOLDER).encode()
    yield from settle()
    part = next(part for part in area.regions if part.type == "WINDOW")
    with bpy.context.temp_override(window=windows[1], area=area, region=part):
        bpy.ops.file.execute()
    yield from until(lambda: render_all._running or render_all._latest, "the rendering's start")
    yield from until(lambda: render_all._running is None, "the pictures", 2000)
    (folder,) = [each for each in FOLDER.iterdir() if "all cameras" in each.name]
    sheet = (folder / "contact-sheet.html").read_text(encoding="utf-8")
    assert {path.stem for path in folder.glob("*.exr")} == {"Camera", "Portrait"}
    assert "64 × 36" in sheet and "30 × 40" in sheet, sheet
    assert (scene.render.resolution_x, scene.render.resolution_y) == (64, 36), "the scene's own picture has changed"
    yield from picture("all_cameras")
    press("ESC", *NOWHERE)
    yield
    bpy.data.objects.remove(other)


def add_a_camera_where_there_is_none():
    bpy.data.objects.remove(camera())
    yield
    yield
    yield from picture("no_camera", SIDEBAR)
    yield from push("viewcam.add_camera(")
    assert bpy.context.scene.camera and bpy.context.scene.camera.virtual_pinhole.enabled


def steps():
    yield
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    yield from open_the_panels()
    for part in (
        tick_the_box,
        drag_the_fields,
        type_millimeters,
        double_the_resolution,
        frame_the_cube,
        dolly_by_a_button,
        bake_and_turn_on_again,
        another_object_is_active,
        draw_on_light_and_dark,
        render_two_formats,
        add_a_camera_where_there_is_none,
    ):
        yield from part()
        print(f"done: {part.__name__}", flush=True)


if __name__ == "__main__":
    start(steps, interval=0.01)
