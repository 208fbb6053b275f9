"""An artist's first day: which camera the panel is about, what it warns of, and all cameras rendered by one click."""

import bpy
from artist_hands import FOLDER, choose_in_the_file_browser, picture, room, warnings
from hands_in_a_window import NOWHERE, SCALE, WAITING, camera, click, press, region, values, window
from tour_hands import SIDEBAR, VIEWPORT, call, drag, find, look, push, settle, strike, until


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
    (warning,) = warnings()
    assert warning.remedy and "virtual_pinhole" not in warning.sentence, warning
    yield from push("viewcam.delete_keyframes(")
    assert len(warnings()) == 1, "keyframes are deleted before anybody is asked"
    press("RET", *NOWHERE)
    yield
    yield
    assert warnings() == [], warnings()
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
    yield from until(lambda: render_all.background.running is None, "the pictures", 2000, WAITING)
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
    added = bpy.context.scene.camera
    assert added and added.virtual_pinhole.enabled and added.virtual_pinhole.keeps == "FIELD_OF_VIEW"
