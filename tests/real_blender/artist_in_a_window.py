"""Runs inside a real Blender with a window: an artist's first day, by mouse and keys, and what came of it.

blender --enable-event-simulate -p 0 0 1600 1000 --addons … --python artist_in_a_window.py -- FOLDER [PICTURES]

FOLDER : a folder for rendered pictures and reports.
PICTURES : a folder for pictures of the window; without it none are taken.

What each part of the add-on does beyond that day is in tour_in_a_window.py, handles_, proof_ and cameras_in_a_window.py.
Leaves with status 0, or 5 and a traceback.
"""

import importlib
import importlib.util
import math
import sys
import time
from pathlib import Path

import bpy
import numpy as np
from bpy_extras.object_utils import world_to_camera_view

sys.path.append(str(Path(__file__).parent))
import tour_step
from hands import (
    LEFT,
    NOWHERE,
    PROPERTIES,
    SCALE,
    SIDEBAR,
    VIEWPORT,
    WAITING,
    call,
    camera,
    click,
    drag,
    find,
    is_at_its_values,
    look,
    match_photo,
    move,
    open_the_panels,
    photograph,
    press,
    push,
    push_undo,
    redo,
    region,
    same,
    seen,
    settle,
    start,
    state,
    strike,
    strike_all,
    type_into,
    undo,
    unfold,
    until,
    values,
    window,
    write,
)

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


EMPTY_SCENE_LENS = 50.0
UNITS = ("MILLIMETERS", "HORIZONTAL", "VERTICAL", "DIAGONAL", "PIXELS")


def tick_the_box():
    assert camera().data.lens == EMPTY_SCENE_LENS
    yield from push("virtual_pinhole.enabled")
    assert values().enabled and values().lens_unit == "MILLIMETERS" and values().keeps == "FIELD_OF_VIEW"
    yield from picture("enabled", SIDEBAR)


def choose_the_unit():
    """The wheel over the unit: each has its field, which takes keyframes. A unit changes no lens."""
    lens = camera().data.lens
    place = yield from find("virtual_pinhole.focal_length")
    for unit in UNITS:
        assert values().lens_unit == unit and camera().data.lens == lens
        sides = {"HORIZONTAL": "horizontal_fov", "VERTICAL": "vertical_fov", "DIAGONAL": "diagonal_fov"}
        field = {"MILLIMETERS": "focal_length", "PIXELS": "distance", **sides}[unit]
        assert (yield from look(*place, SIDEBAR)) == f"virtual_pinhole.{field}"
        yield from picture(f"lens_{unit.lower()}", SIDEBAR)
        yield from look(*place, SIDEBAR)
        press("I", *place)
        yield
        yield
        keyed = [curve.data_path for curve in room("versions").action_curves(camera())]
        assert keyed == [f"virtual_pinhole.{field}"], f"I over the field has keyed {keyed}"
        yield from picture(f"lens_{unit.lower()}_keyed", SIDEBAR)
        camera().animation_data_clear()
        if unit != UNITS[-1]:
            unit_at = region(*SIDEBAR)[1].x + LEFT * region(*SIDEBAR)[1].width
            assert (yield from look(unit_at, place[1], SIDEBAR)) == "virtual_pinhole.lens_unit"
            window().event_simulate(type="WHEELDOWNMOUSE", value="PRESS", x=int(unit_at), y=int(place[1]), ctrl=True)
            yield
            yield
    values().lens_unit = "HORIZONTAL"
    yield
    yield from click(*place)
    yield from write("60")
    press("RET", *place)
    yield
    yield
    assert abs(np.degrees(camera().data.angle) - 60) < 1e-4, f"typed 60°, and Blender's is {np.degrees(camera().data.angle)}°"
    values().lens_unit = "MILLIMETERS"
    yield from type_into("virtual_pinhole.focal_length", "50")
    is_at_its_values()


def drag_the_fields():
    """Each goes as far as Blender's own field of the same kind."""
    yield from in_properties("DATA")
    ours = yield from pulled("virtual_pinhole.focal_length", SIDEBAR, lambda: values().focal_length)
    expected = yield from pulled("lens", PROPERTIES, lambda: camera().data.lens)
    print(f"{PULL} px: lens {ours:.2f} mm, Blender's {expected:.2f} mm", flush=True)
    assert expected > 50 and abs(ours - expected) < 1e-3 * expected
    values().lens_unit = "PIXELS"
    yield
    yield
    before = values().distance
    in_pixels = yield from pulled("virtual_pinhole.distance", SIDEBAR, lambda: values().distance)
    print(f"{PULL} px: d {in_pixels:.1f} px of {before:.1f}", flush=True)
    assert abs(in_pixels / expected / (1920 / 36) - 1) < 0.1, "not as far as in millimeters"
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


def grab_and_turn():
    """G X 1 and R Z 30 move the values and not only the camera; under a target the view stays on it, and Escape gives back
    every bit."""
    values().eye, values().look_at, values().up = (4, -6, 3.5), (0.5, 0.2, 1), (0, 0, 1)
    for each in window().view_layer.objects:
        each.select_set(each == camera())
    for target in (None, bpy.data.objects["Cube"]):
        values().look_at_target = target
        yield
        yield
        for typed, by in (("gx1", (1, 0, 0)), ("rz30", (0, 0, 0))):
            before = state()
            for key in ("ESC", "RET"):
                yield from strike_all(typed)
                press(key, *NOWHERE)
                yield
                yield
                assert key != "ESC" or same(state(), before), f"Escape leaves {state()} of {before}"
            moved = np.subtract(state()[0][0], before[0][0])
            np.testing.assert_allclose(moved, by, atol=1e-5, err_msg=f"the values are not where {typed} has put the camera")
            is_at_its_values()
            assert warnings() == [], f"after {typed} the panel warns"
            if target:
                assert values().numbers()[1] == (0, 0, 0), f"after {typed} the view has left the target"
    values().look_at_target = None
    values().eye[2] += 1
    is_at_its_values()
    np.testing.assert_allclose(values().numbers()[0], (6, -6, 4.5), atol=1e-5, err_msg="an edit has thrown the moves away")


def orbit_and_walk_in_the_cameras_view():
    """*Lock Camera to View* by a drag of the middle mouse button, and walk navigation by W: the values go along."""
    area, part = region("VIEW_3D", "WINDOW")
    view = area.spaces.active
    view_before = view.region_3d.view_rotation.copy(), view.region_3d.view_location.copy(), view.region_3d.view_distance
    view.lock_camera, view.region_3d.view_perspective = True, "CAMERA"
    move(*NOWHERE)
    yield
    yield
    before = state()
    window().event_simulate(type="MIDDLEMOUSE", value="PRESS", x=NOWHERE[0], y=NOWHERE[1])
    for by in (20, 40, 60):
        yield
        move(NOWHERE[0] + by, NOWHERE[1] + by / 2)
    yield
    window().event_simulate(type="MIDDLEMOUSE", value="RELEASE", x=NOWHERE[0] + 60, y=NOWHERE[1] + 30)
    yield
    yield
    after = state()
    assert np.linalg.norm(np.subtract(after[0][0], before[0][0])) > 0.5, f"orbited, and the eye went from {before} to {after}"
    is_at_its_values()
    yield from picture("lock_to_view")
    view.lock_camera = False
    with bpy.context.temp_override(window=window(), area=area, region=part):
        assert bpy.ops.view3d.walk("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
    yield
    window().event_simulate(type="W", value="PRESS", x=NOWHERE[0], y=NOWHERE[1])
    for _ in range(6):
        yield
    window().event_simulate(type="W", value="RELEASE", x=NOWHERE[0], y=NOWHERE[1])
    yield
    press("RET", *NOWHERE)
    yield
    yield
    walked = np.subtract(state()[0][0], after[0][0])
    assert np.linalg.norm(walked) > 0.01, "walked, and the eye is where it was"
    is_at_its_values()
    view.region_3d.view_perspective = "PERSP"
    view.region_3d.view_rotation, view.region_3d.view_location, view.region_3d.view_distance = view_before
    yield


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


PATIENCE = 600  # seconds that a comparison or a rendering may take on a busy machine


def prove_two_cameras_during_playback():
    """Escape ends the playback and not the proof; a pass opens no window and touches no image; no report replaces another's."""
    scene, proof = bpy.context.scene, room("interface.proof")
    settings = bpy.context.window_manager.virtual_pinhole_proof
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    settings.folder = str(FOLDER / "reports")
    bpy.data.images.new("Viewer Node", 8, 8)
    other = bpy.data.objects.new("Close-Up", camera().data)
    scene.collection.objects.link(other)
    other.matrix_world = camera().matrix_world
    images = _of_all_images()
    for each in (camera(), other):
        window().view_layer.objects.active = each
        yield from settle()
        call(bpy.ops.viewcam.compare_with_cycles, camera=each.name)  # as Render › Compare with Cycles does
        yield from until(lambda: proof.background.running, f"the comparison of {each.name}")
        yield from _play_and_press_escape(proof)
        yield from until(lambda: not proof.background.running, f"the verdict on {each.name}", PATIENCE, WAITING)
        outcome = proof.background.latest
        assert outcome and outcome.answer == "same" and outcome.camera == each.name, outcome
        assert outcome.headline.startswith("Identical to ") and outcome.headline.endswith(" px"), outcome.headline
        assert len(bpy.context.window_manager.windows) == 1, "a pass opens a window"
        assert _of_all_images() == images, "a pass touches an image of the file's"
        assert (FOLDER / "reports") in outcome.report.parents and each.name in outcome.report.parent.name, outcome.report
        yield from settle()
    assert len(list((FOLDER / "reports").iterdir())) == 2, "the second camera's report has replaced the first's"
    yield from picture("proof")
    yield from _show_it(images)
    window().view_layer.objects.active = camera()
    bpy.data.objects.remove(other)
    scene.render.resolution_x, scene.render.resolution_y = 1920, 1080
    settings.property_unset("folder")
    yield


def _play_and_press_escape(proof):
    call(bpy.ops.screen.animation_play)
    yield
    assert window().screen.is_animation_playing and proof.background.running, (
        "the proof was over before Escape could be pressed"
    )
    press("ESC", *NOWHERE)
    yield from until(lambda: not window().screen.is_animation_playing, "the end of the playback")
    assert proof.background.running, "Escape during playback has canceled the proof"


def _show_it(images):
    """Show: Cycles, the tracer and what differs, in an image of their own."""
    call(bpy.ops.viewcam.show_difference)
    yield from until(lambda: len(bpy.context.window_manager.windows) == 2, "the window of Show")
    (area,) = bpy.context.window_manager.windows[1].screen.areas
    image = area.spaces.active.image
    assert image and image.name == "Virtual Pinhole Proof" and _of_all_images().items() >= images.items()
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[1], area=area, region=area.regions[-1]):
        bpy.ops.image.view_all()
    yield from settle()
    yield from picture("proof_shown")
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[1]):
        bpy.ops.wm.window_close()
    yield from settle()


def _of_all_images():
    return {each.name: (tuple(each.size), each.source, each.packed_file is None) for each in bpy.data.images}


def bake_and_turn_on_again():
    """One warning in plain words, and its button is the way back."""
    for frame, height in ((1, 3), (20, 6)):
        values().eye[2] = height
        values().keyframe_insert("eye", frame=frame)
    bpy.context.scene.frame_end = 20
    yield from push("viewcam.bake_camera(")
    yield from settle()
    press("RET", *NOWHERE)
    yield from until(lambda: not values().enabled and camera().animation_data.action, "the baked camera")
    yield from push("virtual_pinhole.enabled")
    yield
    yield from picture("baked", SIDEBAR)
    (warning,) = warnings()
    assert warning.remedy and "virtual_pinhole" not in warning.sentence, warning
    yield from push("viewcam.delete_keyframes(")
    yield from settle()
    assert len(warnings()) == 1, "keyframes are deleted before anybody is asked"
    press("RET", *NOWHERE)
    yield from until(lambda: warnings() == [], "the end of the warning")
    camera().animation_data_clear()
    camera().data.animation_data_clear()
    yield


def use_a_camera_on_a_rig():
    """Before it is used its values are its own; what its constraint places is locked; one button takes the Track To over."""
    values().enabled = False
    camera().location, camera().rotation_euler = (6, -5, 4), (1, 0, 0.5)
    yield
    yield
    yield from picture("own_values", SIDEBAR)
    track = camera().constraints.new("TRACK_TO")
    track.target, track.track_axis, track.up_axis = bpy.data.objects["Cube"], "TRACK_NEGATIVE_Z", "UP_Y"
    yield
    yield from push("virtual_pinhole.enabled")
    yield
    assert values().enabled and warnings() == [], warnings()
    yield from picture("rig", SIDEBAR)
    yield from push("viewcam.convert_track_to(")
    yield
    assert values().look_at_target == bpy.data.objects["Cube"] and not camera().constraints, "the Track To is still there"
    assert warnings() == [], warnings()
    yield from picture("rig_converted", SIDEBAR)
    values().look_at_target = None
    yield


def convert_the_cameras_own_keyframes():
    """A keyed camera is followed without a warning; to convert it asks, and one step back brings the keyframes back."""
    for frame, x in ((1, 6.0), (20, -6.0)):
        camera().location.x = x
        camera().keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_end = 20
    bpy.context.scene.frame_set(10)
    bpy.ops.ed.undo_push(message="keyed")
    yield
    assert warnings() == [], warnings()
    yield from push("viewcam.convert_keyframes(")
    yield
    yield from picture("convert_keyframes", SIDEBAR)
    keyed = {curve.data_path for curve in room("versions").action_curves(camera())}
    assert keyed == {"location"}, f"before anybody was asked: {keyed}"
    press("RET", *NOWHERE)
    for _ in range(20):
        yield
    keyed = {curve.data_path for curve in room("versions").action_curves(camera())}
    assert keyed == {"virtual_pinhole.eye", "virtual_pinhole.look_at"}, f"converted: {keyed}"
    yield from picture("converted_keyframes", SIDEBAR)
    camera().animation_data_clear()
    yield


def step_to_the_next_camera():
    """The panel is about the active object, and its arrows make another camera that."""
    other = bpy.data.objects.new("Other", bpy.data.cameras.new("Other"))
    bpy.context.scene.collection.objects.link(other)
    yield
    yield
    _, sidebar = region(*SIDEBAR)
    _, y = yield from find("name")
    for name in ("Other", "Camera"):
        for share in (0.7, 0.74, 0.78):
            x = sidebar.x + sidebar.width * share
            if (yield from look(x, y, SIDEBAR)).startswith("viewcam.step_camera("):
                break
        yield from click(x, y)
        assert window().view_layer.objects.active.name == name
        yield from settle()
    bpy.data.objects.remove(other)
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


def tick_an_orthographic_camera():
    """The box does not tick where there is no pinhole, and can be unticked."""
    x, y = yield from find("virtual_pinhole.enabled")
    for kind, ticks in (("ORTHO", False), ("PERSP", True)):
        values().enabled, camera().data.type = False, kind
        yield
        yield
        yield from click(x, y)
        assert values().enabled == ticks, f"clicked where the camera is {kind}, and the box is {values().enabled}"
    camera().data.type = "ORTHO"
    yield from picture("orthographic", SIDEBAR)
    yield
    yield from click(x, y)
    assert not values().enabled, "the box of an orthographic camera can't be unticked"
    camera().data.type = "PERSP"
    values().enabled = True
    yield


def look_for_copy_read_out():
    """In no menu, and so not in the search: its button gives it its text, and without one it would empty the clipboard."""
    manager = bpy.context.window_manager
    manager.clipboard = "kept"
    press("F3", *NOWHERE)
    yield from settle()
    for character in "copy read-out":
        strike(character)
    yield from settle()
    yield from picture("search")
    press("RET", *NOWHERE)
    yield from settle()
    press("ESC", *NOWHERE)
    yield from settle()
    assert manager.clipboard == "kept", f"the clipboard has {manager.clipboard!r}"


def look_straight_down():
    """The preset of the text's figure, of a camera that looks down: it warns of nothing."""
    call(bpy.ops.viewcam.execute_preset, shipped="Z Up, Looking Down")
    yield
    yield
    eye, look_at, _, _ = values().numbers()
    assert (eye, look_at) == ((0, 0, 10), (0, 0, 0)), values().numbers()
    assert warnings() == [], warnings()
    yield from picture("looking_down", SIDEBAR)
    values().eye, values().look_at, values().up = (4, -6, 3.5), (0, 0, 1), (0, 0, 1)
    yield


def draw_on_light_and_dark():
    """The diagram, its letters and its handles; and the sidebar as narrow as it gets before Blender hides it."""
    view, _ = region("VIEW_3D", "WINDOW")
    shading, region_3d = view.spaces.active.shading, view.spaces.active.region_3d
    values().eye, values().look_at, values().up = (4, -6, 3.5), (0.5, 0.5, 0.5), (0, 0, 1)
    region_3d.view_location, region_3d.view_distance = (1.5, -2, 1.5), 16
    shading.background_type = "VIEWPORT"
    for name, gray in (("light", 0.9), ("middle", 0.2), ("dark", 0.0)):
        shading.background_color = (gray,) * 3
        yield from picture(f"diagram_on_{name}", VIEWPORT)
    shading.background_type = "THEME"
    _, sidebar = region(*SIDEBAR)
    yield from drag((sidebar.x + 1, sidebar.y + 300 * SCALE), (90 * SCALE, 0))
    yield from picture("narrow", SIDEBAR)
    print(f"the sidebar is {region(*SIDEBAR)[1].width} pixels wide", flush=True)
    yield from drag((region(*SIDEBAR)[1].x + 1, sidebar.y + 300 * SCALE), (-90 * SCALE, 0))


def render_two_formats():
    """Both cameras by one click, each in its own picture."""
    scene, render_all = bpy.context.scene, room("interface.render_all")
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    other = bpy.data.objects.new("Portrait", bpy.data.cameras.new("Portrait"))
    scene.collection.objects.link(other)
    other.matrix_world = camera().matrix_world
    own = other.virtual_pinhole_picture
    own.use, own.resolution_x, own.resolution_y = True, 30, 40
    yield
    yield from choose_in_the_file_browser(bpy.ops.viewcam.render_all_cameras, FOLDER)
    yield from until(lambda: render_all.background.running or render_all._sheet, "the rendering's start")
    yield from until(lambda: render_all.background.running is None, "the pictures", PATIENCE, WAITING)
    (folder,) = [each for each in FOLDER.iterdir() if "all cameras" in each.name]
    sheet = (folder / "contact-sheet.html").read_text(encoding="utf-8")
    assert {path.stem for path in folder.glob("*.exr")} == {"Camera", "Portrait"}
    assert "64 × 36" in sheet and "30 × 40" in sheet, sheet
    assert (scene.render.resolution_x, scene.render.resolution_y) == (64, 36), "the scene's own picture has changed"
    yield from picture("all_cameras")
    press("ESC", *NOWHERE)
    yield
    bpy.data.objects.remove(other)


def taken_back(steps, what, is_scenes_edit=True):
    """Steps that do something, and fail unless one Ctrl Z takes it back, and Ctrl Shift Z brings it again, to the bit.

    is_scenes_edit : false for what leaves the scene as it is, before which a value is typed: that alone is taken back.
    """
    push_undo("before")
    yield
    before = tour_step.state()
    if not is_scenes_edit:
        yield from type_into("virtual_pinhole.eye[2]", "6.5")
    edited = tour_step.state()
    yield from steps
    move(*NOWHERE)
    yield from settle()
    after = tour_step.state()
    assert (after == edited) != is_scenes_edit, f"{what} changes {tour_step.differing(edited, after)}"
    yield from undo()
    assert not (lost := tour_step.differing(before, tour_step.state())), f"undone, {what} leaves {lost}"
    yield from redo()
    assert not (lost := tour_step.differing(after, tour_step.state())), f"done again, {what} lacks {lost}"
    yield from undo()


def undo_what_is_pasted():
    """The camera and the scene's size are one step."""
    bpy.context.window_manager.clipboard = "eye=3,-5,2.5 look_at=0,0,1 up=0,0,1 d=900 width=640 height=480"
    yield from taken_back(_paste_with_its_size(), "a paste")


def _paste_with_its_size():
    call(bpy.ops.viewcam.paste_camera, camera=camera().name, set_size=True)
    yield from settle()
    render = bpy.context.scene.render
    assert (values().numbers()[0], render.resolution_x, render.resolution_y) == ((3, -5, 2.5), 640, 480)


def undo_what_is_converted():
    """Keyframes that became values, and those that are deleted, come back with all of their curves."""
    for frame, x, lens in ((1, 6.0, 35.0), (20, -6.0, 85.0)):
        camera().location.x, camera().data.lens = x, lens
        camera().keyframe_insert("location", frame=frame)
        camera().data.keyframe_insert("lens", frame=frame)
    bpy.context.scene.frame_end = 20
    bpy.context.scene.frame_set(10)
    yield
    for operator in (bpy.ops.viewcam.convert_keyframes, bpy.ops.viewcam.delete_keyframes):
        yield from taken_back(_confirmed(operator), operator.idname_py())
    for block in (camera(), camera().data):
        block.animation_data_clear()
    bpy.context.scene.frame_set(1)
    yield


def _confirmed(operator):
    """Steps that run an operator which asks, and confirm it."""
    move(*NOWHERE)
    yield
    call(operator, camera=camera().name)
    yield from settle()
    press("RET", *NOWHERE)
    yield from settle()
    yield from settle()


def undo_after_a_proof():
    """A proof is no edit: Ctrl Z takes back what was done before it, and the verdict stays on show."""
    scene, proof = bpy.context.scene, room("interface.proof")
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    values().eye, values().look_at, values().up = (4, -6, 3.5), bpy.data.objects["Cube"].location, (0, 0, 1)
    yield
    yield from taken_back(_proven(proof), "a proof", is_scenes_edit=False)
    assert proof.background.latest, "undo has taken the verdict away"


def _proven(proof):
    call(bpy.ops.viewcam.compare_with_cycles, camera=camera().name)
    yield from until(lambda: proof.background.running is None, "the verdict", PATIENCE, WAITING)
    assert proof.background.latest.answer == "same", proof.background.latest.verdict


def undo_after_render_all_cameras():
    """Nor are pictures of all cameras one: Ctrl Z takes back what was done before them, also while they are on their way."""
    scene, render_all = bpy.context.scene, room("interface.render_all")
    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    scene.render.resolution_x, scene.render.resolution_y = 64, 36
    folder = FOLDER / "undone"
    folder.mkdir()
    yield
    yield from taken_back(_all_rendered(render_all, folder), "rendering all cameras", is_scenes_edit=False)
    (rendered,) = [each for each in folder.iterdir() if "all cameras" in each.name]
    assert {path.stem for path in rendered.glob("*.exr")} == {"Camera"}, "undo has taken the pictures away"


def _all_rendered(render_all, folder):
    """Steps that render all cameras, and undo and redo meanwhile."""
    yield from choose_in_the_file_browser(bpy.ops.viewcam.render_all_cameras, folder)
    yield from until(lambda: render_all.background.running, "the rendering's start")
    edited = tour_step.state()
    yield from undo()
    assert tour_step.state() != edited and render_all.background.running, "Ctrl Z takes nothing back while cameras render"
    yield from redo()
    assert not (lost := tour_step.differing(edited, tour_step.state())), f"done again while cameras render, {lost} differs"
    yield from until(lambda: render_all.background.running is None, "the pictures", PATIENCE, WAITING)
    yield from settle()
    press("ESC", *NOWHERE)  # closes what tells of them
    yield from settle()


def render_by_workbench():
    """The Blender that tries whether there is a graphics driver leaves the wheels of the user's extensions where they are."""
    scene, render_all = bpy.context.scene, room("interface.render_all")
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "BLENDER_WORKBENCH", 64, 36
    folder = FOLDER / "workbench"
    folder.mkdir()
    yield from choose_in_the_file_browser(bpy.ops.viewcam.render_all_cameras, folder)
    yield from until(lambda: render_all.background.running, "the rendering's start")
    yield from until(lambda: render_all.background.running is None, "the pictures", PATIENCE, WAITING)
    assert len(list(folder.glob("*/contact-sheet.html"))) == 1, "there is no contact sheet"
    importlib.invalidate_caches()
    lost = [name for name in ("viewcam_core", "OpenEXR", "jinja2") if importlib.util.find_spec(name) is None]
    assert not lost, f"the wheels are gone of {lost}"
    yield from settle()
    press("ESC", *NOWHERE)
    yield from settle()


def add_a_camera_where_there_is_none():
    bpy.data.objects.remove(camera())
    yield
    yield
    yield from picture("no_camera", SIDEBAR)
    yield from push("viewcam.add_camera(")
    added = bpy.context.scene.camera
    assert added and added.virtual_pinhole.enabled and added.virtual_pinhole.keeps == "FIELD_OF_VIEW"


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
    _photo[:] = matrix, edges, room("interface.dragging").state(camera)


def _is_as_before():
    return room("interface.dragging").state(bpy.data.objects["Camera"]) == _photo[2]


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


# Things that would send an artist away again if they failed, and the steps that try them. Each part goes on where the one
# before it has ended.
DAY = {
    "The lens can be set in the panel": (tick_the_box, choose_the_unit),
    "Fields go as far as Blender's own": (drag_the_fields,),
    "Whatever moves the camera moves its values": (
        type_millimeters,
        grab_and_turn,
        orbit_and_walk_in_the_cameras_view,
    ),
    "A larger picture shows the same": (double_the_resolution,),
    "Framed is in the middle, and a drag goes with the mouse": (frame_the_cube, dolly_by_a_button),
    "A proof that passes looks like one": (prove_two_cameras_during_playback,),
    "The panel knows its camera, and warns of what is wrong alone": (
        bake_and_turn_on_again,
        use_a_camera_on_a_rig,
        convert_the_cameras_own_keyframes,
        step_to_the_next_camera,
        another_object_is_active,
        tick_an_orthographic_camera,
        look_for_copy_read_out,
        look_straight_down,
    ),
    "What is drawn can be read": (draw_on_light_and_dark,),
    "All cameras are rendered by one click": (render_two_formats, render_by_workbench),
    "One undo takes back one edit, whatever ran since": (
        undo_what_is_pasted,
        undo_what_is_converted,
        undo_after_a_proof,
        undo_after_render_all_cameras,
    ),
    "There is always a way to a camera": (add_a_camera_where_there_is_none,),
    "A photo gives its camera": (escape_from_a_match, match_a_photo),
}


def steps():
    yield
    bpy.context.preferences.system.viewport_aa = "OFF"  # drawn in software
    yield from open_the_panels()
    for promise, parts in DAY.items():
        for part in parts:
            started = time.process_time()
            yield from part()
            print(f"done: {part.__name__} in {time.process_time() - started:.1f} CPU s", flush=True)
        print(f"kept: {promise}", flush=True)
    print("done: the day", flush=True)


start(steps)
