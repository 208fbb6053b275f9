"""Runs inside a real Blender with a window: takes the pictures of docs/artists.md that no step of the tour (tour.py) takes.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python pictures_in_a_window.py -- FOLDER PHOTO

FOLDER : docs/images. PHOTO : that of photo_of_a_room.py. test_tour.py runs this.
Leaves with status 0, or 5 and a traceback.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector

sys.path.append(str(Path(__file__).parent))
from panel_in_a_window import NOWHERE, move, press, region, start, window
from tour_hands import VIEWPORT, call, hide_the_sidebar, photograph, settle
from tour_step import room

FOLDER, PHOTO = map(Path, sys.argv[sys.argv.index("--") + 1 :])
STUDIO = Path(__file__).resolve().parent.parent.parent / "sample_scenes" / "studio.blend"
LISTED = 222  # pixels of the file browser's list
# (axis, start, end) of edges of the room, world space.
EDGES = (
    ("X", (-0.1, 0.8, 0.78), (1.3, 0.8, 0.78)),
    ("X", (-0.6, 2.6, 0.0), (1.9, 2.6, 0.0)),
    ("Y", (2.6, 1.0, 0.0), (2.6, 2.55, 0.0)),
    ("Y", (1.3, 0.8, 0.78), (1.3, 1.6, 0.78)),
    ("Y", (-0.1, 0.8, 0.78), (-0.1, 1.6, 0.78)),
    ("Z", (2.6, 2.6, 0.1), (2.6, 2.6, 2.2)),
    ("Z", (0.0, 0.9, 0.02), (0.0, 0.9, 0.66)),
)


def photo_match():
    """Edges of the room, dragged over its picture, by a camera that looks elsewhere."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield
    scene, camera = bpy.context.scene, bpy.data.objects["Camera"]
    for name in ("Cube", "Light"):
        bpy.data.objects.remove(bpy.data.objects[name])
    photo = bpy.data.images.load(str(PHOTO))
    scene.render.resolution_x, scene.render.resolution_y = photo.size
    values = camera.virtual_pinhole
    values.enabled = True
    values.eye, values.look_at, values.up, values.distance = (-1.7, -1.9, 1.75), (0.75, 1.3, 0.95), (0, 0, 1), 800
    bpy.context.view_layer.update()
    seen = [[world_to_camera_view(scene, camera, Vector(end))[:2] for end in edge[1:]] for edge in EDGES]
    values.look_at, values.distance = (0.0, 0.0, 1.5), 1100
    background = camera.data.background_images.new()
    background.image, background.alpha = photo, 1.0
    camera.data.show_background_images = True
    view, part = region(*VIEWPORT)
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    yield from hide_the_sidebar()
    yield from settle()
    call(bpy.ops.view3d.view_center_camera)
    yield from settle()
    matching = room("interface.photo_matching")
    call(bpy.ops.viewcam.match_photo)
    yield from settle()
    left, bottom, right, top = matching._drawn.frame
    for (axis, *_), ends in zip(EDGES, seen, strict=True):
        (x0, y0), (x1, y1) = [(part.x + left + u * (right - left), part.y + bottom + v * (top - bottom)) for u, v in ends]
        press(axis, *NOWHERE)
        yield
        move(x0, y0)
        yield
        window().event_simulate(type="LEFTMOUSE", value="PRESS", x=int(x0), y=int(y0))
        yield
        for share in (0.5, 1.0):
            move(x0 + share * (x1 - x0), y0 + share * (y1 - y0))
            yield
        window().event_simulate(type="LEFTMOUSE", value="RELEASE", x=int(x1), y=int(y1))
        yield
    yield from settle()
    assert matching._drawn.result, matching._drawn.sentence
    _, part = region(*VIEWPORT)
    photograph((part.x, part.y, part.width, part.height), FOLDER / "photo-match.png", 60, (x1, y1))
    press("ESC", *NOWHERE)
    yield from settle()


def export():
    """The file browser with its options, without the empty middle of its list."""
    bpy.ops.wm.open_mainfile(filepath=str(STUDIO), load_ui=False)
    yield
    bpy.context.preferences.view.filebrowser_display_type = "SCREEN"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch, "shots")
        folder.mkdir()
        call(bpy.ops.viewcam.export_scene, filepath=str(folder / STUDIO.with_suffix(".json").name))
        yield from settle()
        area, files = region("FILE_BROWSER", "WINDOW")
        _, name = region("FILE_BROWSER", "EXECUTE")
        right, top = area.x + area.width, files.y + files.height
        parts = [(files.x, top - LISTED, right - files.x, LISTED), (name.x, name.y, right - name.x, name.height)]
        pictures = [Path(scratch, f"{number}.png") for number in range(2)]
        for where, picture in zip(parts, pictures, strict=True):
            photograph(where, picture, 60)
        subprocess.run(["convert", *pictures, "-append", FOLDER / "artists" / "export.png"], check=True)
        with bpy.context.temp_override(window=window(), area=area, region=files):
            bpy.ops.file.cancel()
        yield from settle()


def preferences():
    """The add-on's own, without the folder that it is installed in."""
    package = room("preferences").PACKAGE
    bpy.ops.preferences.addon_enable(module=package)  # Blender lists what was enabled there, not from the command line
    view, _ = region(*VIEWPORT)
    view.type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "Virtual Pinhole"
    with bpy.context.temp_override(window=window(), area=view):
        bpy.ops.preferences.addon_expand(module=package)
    yield from settle()
    picture = FOLDER / "artists" / "preferences.png"
    height = 0.46 * view.height  # below it is nothing
    photograph((view.x, view.y + view.height - height, view.width, height), picture, 60)
    over_the_folder = ("-fill", "rgb(40,39,38)", "-draw", "rectangle 110,127 775,141")
    subprocess.run(["convert", picture, *over_the_folder, picture], check=True)
    view.type = "VIEW_3D"
    yield from settle()


def steps():
    yield
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    yield from photo_match()
    yield from preferences()
    yield from export()
    print("done: the pictures", flush=True)


start(steps, interval=0.01)
