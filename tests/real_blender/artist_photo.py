"""An artist's first day: a photo of a known camera, matched by dragging along the edges of a box in it."""

import math

import bpy
import numpy as np
from artist_hands import FOLDER, picture, room
from hands_in_a_window import NOWHERE, press, region, window
from tour_hands import match_photo, push_undo, seen, settle, undo

LENS = 42.0
BOX = (1.5, 1.0, 0.75)  # half its sides
# (axis, start, end) in units of BOX.
EDGES = (
    ("X", (-1, -1, 1), (1, -1, 1)),
    ("X", (-1, 1, 1), (1, 1, 1)),
    ("X", (-1, -1, -1), (1, -1, -1)),
    ("Y", (1, -1, 1), (1, 1, 1)),
    ("Y", (-1, -1, 1), (-1, 1, 1)),
    ("Y", (1, -1, -1), (1, 1, -1)),
)


_photo = []  # camera, its matrix while the photo was taken, the edges as it shows them, and what it is now


def make_a_photo():
    """A box, rendered through a camera that is then turned away and given another lens."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield
    scene = bpy.context.scene
    cube = bpy.data.objects["Cube"]
    cube.scale = BOX
    camera = bpy.data.objects["Camera"]
    camera.location, camera.rotation_euler = (5.5, -6.5, 4.5), (math.radians(61), 0.02, math.radians(40))
    camera.data.lens = LENS
    scene.render.engine, scene.render.filepath = "BLENDER_WORKBENCH", str(FOLDER / "photo.png")
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    bpy.context.view_layer.update()
    with bpy.context.temp_override(window=window()):
        bpy.ops.render.render(write_still=True)
    yield
    matrix = np.array(camera.matrix_world)
    edges = seen(camera, [(axis, *(np.multiply(end, BOX) for end in ends)) for axis, *ends in EDGES])
    camera.rotation_euler, camera.data.lens = (math.radians(70), 0, math.radians(25)), 85.0
    background = camera.data.background_images.new()
    background.image = bpy.data.images.load(scene.render.filepath)
    camera.data.show_background_images, background.alpha = True, 1.0
    cube.hide_set(True)
    window().view_layer.objects.active = camera
    bpy.context.view_layer.update()
    region("VIEW_3D", "WINDOW")[0].spaces.active.region_3d.view_perspective = "CAMERA"
    yield from settle()
    push_undo("before")
    _photo[:] = matrix, edges, room("interface.kept").state(camera)


def _is_as_before():
    return room("interface.kept").state(bpy.data.objects["Camera"]) == _photo[2]


def escape_from_a_match():
    yield from make_a_photo()
    yield from match_photo(_photo[1])
    yield from picture("photo_match")
    press("ESC", *NOWHERE)
    yield
    yield
    assert room("interface.photo_matching")._drawn is None and _is_as_before(), "Escape leaves something"


def match_a_photo():
    """The lens and the view come back within three of the errors that are told; one step of undo."""
    matching, _ = yield from match_photo(_photo[1])
    result = matching.result
    assert result is not None, matching.sentence
    press("RET", *NOWHERE)
    yield
    yield
    bpy.context.view_layer.update()
    camera, matrix = bpy.data.objects["Camera"], _photo[0]
    low, high = result.distance_between
    off = np.degrees(np.arccos(np.clip((np.array(camera.matrix_world)[:3, 2] @ matrix[:3, 2]), -1, 1)))
    print(f"{camera.data.lens:.2f} mm of {LENS:g}, {off:.3f}° off, d from {low:.1f} to {high:.1f} px", flush=True)
    true = LENS / 36.0 * 960
    assert abs(result.pinhole.distance[0] - true) < 3 * (high - low) / 2, "the lens is beyond three of its errors"
    assert off < 3 * math.degrees(result.pixels["look_at"] / true), "the view is beyond three of its errors"
    yield from undo()
    assert _is_as_before(), "one undo does not take it back"
