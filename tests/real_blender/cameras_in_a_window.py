"""Runs inside a real Blender with a window: other programs' cameras by the file browser, by drop and by paste; each undone.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python cameras_in_a_window.py -- FOLDER [PICTURES]

FOLDER : a folder that has COLMAP's model `sparse` of the eyes in `cameras_of_colmap.json`, and takes the fSpy project that is
    made here.
PICTURES : a folder for pictures of the window; without it none are taken.

Leaves with status 0, or 5 and a traceback.
"""

import json
import math
import struct
import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.append(str(Path(__file__).parent))
from hands import (
    NOWHERE,
    VIEWPORT,
    call,
    click,
    find,
    open_the_panels,
    photograph,
    press,
    push_undo,
    redo,
    region,
    settle,
    start,
    undo,
    until,
    window,
)

FOLDER, *PICTURES = map(Path, sys.argv[sys.argv.index("--") + 1 :])
PBRT = """Film "rgb" "integer xresolution" [960] "integer yresolution" [540]
LookAt 7 -6 4  0 0 1  0 0 1
Camera "perspective" "float fov" 30
"""


def state():
    """The names and numbers that an import or a paste may change, to the bit."""
    scene, data = bpy.context.scene, bpy.data
    result = {name: sorted(getattr(data, name).keys()) for name in ("objects", "cameras", "collections", "images", "actions")}
    result["scene"] = (scene.camera.name, scene.render.resolution_x, scene.render.resolution_y, scene.frame_current)
    for block in (block for block in scene.objects if block.type == "CAMERA"):
        lens = (block.data.lens, block.data.shift_x, block.data.shift_y, block.data.sensor_width)
        result[block.name] = (
            tuple(number for row in block.matrix_basis for number in row),
            lens,
            block.virtual_pinhole.enabled,
        )
    return result


def once_undone_and_redone(before, what):
    """Steps: one undo is `before`, one redo is as it was."""
    after = state()
    assert after != before, f"{what} changes nothing"
    yield from undo()
    yield from until(lambda: state() == before, f"one undo of {what}")
    yield from redo()
    yield from until(lambda: state() == after, f"the redo of {what}")
    yield from undo()
    yield from until(lambda: state() == before, f"the second undo of {what}")


def picture(name):
    if PICTURES:
        for _ in range(12):
            yield
        photograph((0, 0, window().width, window().height), PICTURES[0] / f"{name}.png", 60)


def import_colmap():
    """File › Import › Cameras, where the file browser shows the model's folder."""
    eyes = json.loads((FOLDER / "cameras_of_colmap.json").read_text())
    before = state()
    windows = bpy.context.window_manager.windows
    call(bpy.ops.viewcam.import_cameras)
    yield from until(lambda: len(windows) == 2, "the file browser")
    (area,) = windows[1].screen.areas
    yield from until(lambda: area.spaces.active.params is not None, "the file browser's folder")
    area.spaces.active.params.directory, area.spaces.active.params.filename = str(FOLDER / "sparse").encode(), ""
    yield from settle()
    part = next(part for part in area.regions if part.type == "WINDOW")
    with bpy.context.temp_override(window=windows[1], area=area, region=part):
        bpy.ops.file.execute()
    yield from until(lambda: len(bpy.data.cameras) == len(before["cameras"]) + len(eyes), "the import")
    yield from until(lambda: len(windows) == 1, "the file browser's end")
    yield from settle()
    (collection,) = [each for each in bpy.data.collections if each.name not in before["collections"]]
    blocks = [block for block in collection.objects if block.type == "CAMERA"]
    assert len(blocks) == len(eyes) == 100 and all(block.parent.type == "EMPTY" for block in blocks)
    for block in blocks:
        matrix, eye = np.array(block.matrix_world), np.array(eyes[block.name])
        np.testing.assert_allclose(matrix[:3, 3], eye, atol=9 * 2**-24 * 8)  # float32 of coordinates below 8
        np.testing.assert_allclose(-matrix[:3, 2], -eye / np.linalg.norm(eye), atol=17 * 2**-24)  # all look at the origin
    view, _ = region(*VIEWPORT)
    view.spaces.active.region_3d.view_distance = 22
    assert all(block.data.background_images for block in blocks), "pictures are missing"
    yield from picture("colmap")
    yield from once_undone_and_redone(before, "the import of COLMAP's cameras")


def import_fspy():
    """A project of a rendered cube, as dropped: its camera and its picture are the cube's again."""
    scene, camera = bpy.context.scene, bpy.data.objects["Camera"]
    scene.render.engine, scene.render.filepath = "BLENDER_WORKBENCH", str(FOLDER / "cube.png")
    with bpy.context.temp_override(window=window()):
        bpy.ops.render.render(write_still=True)
    yield
    matrix, lens = np.array(camera.matrix_world), camera.data.lens
    image_names = {
        "principalPoint": {"x": 0, "y": 0},
        "cameraTransform": {"rows": matrix.tolist()},
        "relativeFocalLength": 2 * lens / 36,  # the longer side, of 36 mm, is from −1 to 1
        "imageWidth": 960,
        "imageHeight": 540,
    }
    document = json.dumps(
        {"cameraParameters": image_names, "calibrationSettingsBase": {"referenceDistanceUnit": "No unit"}}
    ).encode()
    image = (FOLDER / "cube.png").read_bytes()
    (FOLDER / "cube.fspy").write_bytes(b"fspy" + struct.pack("<III", 1, len(document), len(image)) + document + image)
    push_undo("before fSpy")
    before = state()
    call(bpy.ops.viewcam.import_cameras, filepath=str(FOLDER / "cube.fspy"))  # as a drop does
    yield from settle()
    press("RET", *NOWHERE)  # the options as they are
    yield from until(lambda: len(bpy.data.cameras) == len(before["cameras"]) + 1, "the import")
    yield from settle()
    (name,) = set(bpy.data.objects.keys()) - set(before["objects"])
    camera_object = bpy.data.objects[name]
    np.testing.assert_allclose(np.array(camera_object.matrix_world), matrix, atol=17 * 2**-24 * 8)
    np.testing.assert_allclose(camera_object.data.lens, lens, rtol=4 * 2**-24)
    (background,) = camera_object.data.background_images
    assert tuple(background.image.size) == (960, 540) and background.image.packed_file, "the picture does not come along"
    view, _ = region(*VIEWPORT)
    scene.camera, background.alpha, background.display_depth = camera_object, 1.0, "FRONT"
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    yield from picture("fspy")
    view.spaces.active.region_3d.view_perspective = "PERSP"
    bpy.context.scene.camera = bpy.data.objects["Camera"]
    yield from once_undone_and_redone(before, "the import of an fSpy project")


def paste_pbrt():
    """The Paste button of the panel."""
    push_undo("before the paste")
    before = state()
    x, y = yield from find("viewcam.paste_camera(")
    bpy.context.window_manager.clipboard = PBRT
    yield from click(x, y)
    yield from until(lambda: bpy.data.objects["Camera"].virtual_pinhole.enabled, "the paste")
    yield from settle()
    camera = bpy.data.objects["Camera"]
    eye, look_at, _, distance = camera.virtual_pinhole.numbers()
    assert tuple(eye) == (7, -6, 4), eye
    ahead = np.subtract(look_at, eye)
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), np.array([-7, 6, -3]) / math.sqrt(94), atol=1e-15)
    assert abs(distance / (270 / math.tan(math.radians(15))) - 1) < 1e-6, (
        distance
    )  # fov is of the shorter side; float32 in pbrt
    mirrored = np.linalg.det(np.array(camera.matrix_world)[:3, :3]) < 0
    assert mirrored, "LookAt alone is left-handed in pbrt: its picture is mirrored"
    yield from picture("pbrt")
    yield from once_undone_and_redone(before, "the paste of pbrt's camera")


def steps():
    yield
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield
    preferences = bpy.context.preferences
    preferences.view.filebrowser_display_type, preferences.system.viewport_aa = "WINDOW", "OFF"  # drawn in software
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 960, 540
    window().view_layer.objects.active = bpy.data.objects["Camera"]
    yield from open_the_panels()
    push_undo("before")
    yield
    for part in (import_colmap, import_fspy, paste_pbrt):
        yield from part()
        print(f"done: {part.__name__}", flush=True)


start(steps, interval=0.02)
