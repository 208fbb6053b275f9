"""The panel's camera, the way to the others, a new one.

Render All Cameras: its shots, a process beside Blender, the contact sheet, Cancel; and nothing of it in the file.
"""

import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, own_picture
from viewcam_addon.blender.interface import comparing, panel, render_all, scene_cameras
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import plan
from viewcam_addon.jobs.job import Job


def activate(block):
    bpy.context.view_layer.objects.active = block


def test_a_new_camera_is_enabled_selected_and_looks_at_the_cursor(scene):
    scene.cursor.location = (1, 2, 3)
    assert bpy.ops.viewcam.add_camera() == {"FINISHED"}
    added = bpy.context.active_object
    assert added.select_get() and scene.camera == added and added.virtual_pinhole.enabled
    assert tuple(added.virtual_pinhole.look_at) == (1, 2, 3)
    bpy.context.view_layer.update()
    assert cameras.check(added, cameras.stated(added, scene), scene) == []
    assert bpy.ops.viewcam.add_camera() == {"FINISHED"}
    assert scene.camera == added != bpy.context.active_object, "the scene's camera is changed where there was one"


def test_where_no_viewport_is_a_camera_from_view_is_refused_and_leaves_nothing(scene, monkeypatch):
    monkeypatch.setattr(scene_cameras.viewport, "area_in", lambda _context: None)
    with pytest.raises(RuntimeError, match="There is no 3D viewport in this window"):
        bpy.ops.viewcam.add_camera(from_view=True)
    assert len(bpy.data.cameras) == 0 and len(scene.objects) == 0


def test_a_broken_view_leaves_no_camera_behind(scene, monkeypatch):
    def refuse(*_):
        raise scene_cameras.InputError("the viewport is orthographic, no pinhole: switch it to perspective")

    monkeypatch.setattr(scene_cameras.viewport, "area_in", lambda _context: "an area")
    monkeypatch.setattr(scene_cameras.viewport, "pinhole_of", refuse)
    with pytest.raises(RuntimeError, match="The viewport is orthographic"):
        bpy.ops.viewcam.add_camera(from_view=True)
    assert len(bpy.data.cameras) == 0 and len(scene.objects) == 0


def test_next_and_previous_go_around_all_cameras_by_name(add_camera, scene):
    b, c, a = (add_camera(name) for name in "bca")
    activate(a)
    seen = []
    for step in (1, 1, 1, -1, -1):
        assert bpy.ops.viewcam.step_camera(step=step) == {"FINISHED"}
        seen.append(bpy.context.active_object)
        assert [each for each in scene.objects if each.select_get()] == [bpy.context.active_object]
    assert seen == [b, c, a, c, b] and scene.camera == a, "the scene's camera stays"


def test_make_active_is_the_scene_s_camera_and_nothing_else(add_camera, scene):
    first, second = add_camera("first"), add_camera("second")
    matrix = np.array(first.matrix_world)
    activate(second)
    assert bpy.ops.viewcam.make_camera_active(camera="first") == {"FINISHED"}
    assert scene.camera == first and bpy.context.active_object == second
    assert (np.array(first.matrix_world) == matrix).all()
    with pytest.raises(RuntimeError, match="has no camera 'third'"):
        bpy.ops.viewcam.make_camera_active(camera="third")


def test_the_list_has_the_cameras_and_chooses_by_a_click(add_camera, scene, empty):
    empty("between")
    first, second = add_camera("first"), add_camera("second")
    manager = bpy.context.window_manager
    activate(first)
    assert scene.objects[manager.virtual_pinhole_camera] == first
    manager.virtual_pinhole_camera = scene.objects.find("second")
    assert bpy.context.active_object == second
    listed = SimpleNamespace(filter_name="", bitflag_filter_item=1)
    flags = [1 if each.type == "CAMERA" else 0 for each in scene.objects]
    assert scene_cameras.VIEWCAM_UL_cameras.filter_items(listed, bpy.context, scene, "objects")[0] == flags
    listed.filter_name = "SEC"
    assert sum(scene_cameras.VIEWCAM_UL_cameras.filter_items(listed, bpy.context, scene, "objects")[0]) == 1


class Layout:
    """Keeps what is drawn in it; rows and columns are it."""

    def __init__(self):
        self.drawn = []

    def row(self, **_):
        return self

    column = row

    def label(self, text="", **_):
        self.drawn.append(text)

    def operator(self, name, **_):
        self.drawn.append(name)
        return SimpleNamespace()

    def prop(self, data, name, **_):
        self.drawn.append(f"{data.name}.{name}")


def drawing():
    """The context of a sidebar that is drawn."""
    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    region = SimpleNamespace(width=202)
    return SimpleNamespace(
        scene=bpy.context.scene, active_object=bpy.context.active_object, region=region, preferences=preferences
    )


def test_the_sidebar_names_its_camera_and_says_so_where_it_is_not_the_active_object(add_camera, scene, empty):
    camera_object = add_camera("Hero")
    activate(camera_object)
    layout = Layout()
    scene_cameras.draw_header(layout, camera_object, drawing())
    assert "Hero.name" in layout.drawn and "viewcam.make_camera_active" not in layout.drawn
    activate(empty("Cube"))
    layout = Layout()
    scene_cameras.draw_header(layout, datablocks.camera_in(bpy.context), drawing())
    assert "Hero.name" in layout.drawn and "The scene's camera; Cube is active" in " ".join(layout.drawn)


def test_without_a_camera_the_sidebar_stays_and_offers_one(scene):
    assert panel.VIEWCAM_PT_sidebar.poll(bpy.context)
    layout = Layout()
    panel.VIEWCAM_PT_sidebar.draw(SimpleNamespace(layout=layout), bpy.context)
    assert layout.drawn == ["There is no camera", "viewcam.add_camera", "viewcam.add_camera"]
    panel.VIEWCAM_PT_sidebar.draw_header(SimpleNamespace(layout=None), bpy.context)


def test_add_camera_stands_in_blender_s_menu_and_goes_with_the_add_on(registered_addon):
    entries = bpy.types.VIEW3D_MT_camera_add._dyn_ui_initialize
    assert scene_cameras._draw_add_menu in entries()
    registered_addon.unregister()
    try:
        assert scene_cameras._draw_add_menu not in entries()
        assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_camera")
    finally:
        registered_addon.register()


def test_an_added_camera_shows_the_same_in_a_larger_picture(scene):
    bpy.ops.viewcam.add_camera()
    added, render = bpy.context.object, scene.render
    before = added.data.lens
    render.resolution_x, render.resolution_y = 2 * render.resolution_x, 2 * render.resolution_y
    bpy.context.view_layer.update()
    assert added.virtual_pinhole.keeps == "FIELD_OF_VIEW" and added.data.lens == pytest.approx(before, rel=2.0**-21)


# In place of `viewcam batch`: it makes a picture, tells so, and waits until it may make the other and the contact sheet.
STAND_IN = """
import json, pathlib, sys, time
written, status = json.loads(pathlib.Path(sys.argv[1]).read_text()), int(sys.argv[2])
folder, names = pathlib.Path(written["plan"]["out"]), [job["name"] for job in written["jobs"]]
(folder / (names[0] + ".exr")).write_text("x")
while not (folder.parent / "go").exists():
    time.sleep(0.01)
for name in names:
    (folder / (name + ".exr")).write_text("x")
(folder / "contact-sheet.html").write_text("x")
sys.exit(status)
"""


@pytest.fixture(autouse=True)
def nothing_left():
    yield
    render_all.background.end()
    render_all._sheet = None


@pytest.fixture
def two(add_camera, scene):
    """Two cameras, one of which has its own picture; the other is the scene's."""
    own = add_camera("Hero: close")
    add_camera("Wide")
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 100, 60, 50
    scene.frame_end = 3
    own.virtual_pinhole_picture.use = True
    own.virtual_pinhole_picture.resolution_x = 40
    own.virtual_pinhole_picture.frame_start = own.virtual_pinhole_picture.frame_end = 7
    return scene


@pytest.fixture
def stand_in(monkeypatch):
    """A function that says with which status the child shall end."""

    def use_command(status):
        def command(_copy, _scene, written):
            return [sys.executable, "-c", STAND_IN, str(written), str(status)]

        monkeypatch.setattr(comparing, "command", command)

    use_command(0)
    return use_command


def test_every_camera_is_a_shot_in_its_own_picture(two):
    rows = render_all.shots(two, animation=False)
    assert rows == [
        Job("Hero_ close", camera="Hero: close", width=20, height=30, frame=1),
        Job("Wide", camera="Wide", width=50, height=30, frame=1),
    ]
    two.camera = two.objects["Hero: close"]
    own_picture.switch(two)
    assert render_all.shots(two, animation=False) == rows, "whichever is active"


def test_an_animation_has_each_camera_s_own_frames(two):
    rows = render_all.shots(two, animation=True)
    assert [(job.name, job.frame) for job in rows] == [
        ("Hero_ close_0007", 7),
        ("Wide_0001", 1),
        ("Wide_0002", 2),
        ("Wide_0003", 3),
    ]


def test_names_that_are_one_file_are_kept_apart_and_hidden_cameras_left_out(add_camera, scene):
    for name in ("a:b", "A?b", "hidden"):
        add_camera(name).hide_render = name == "hidden"
    assert [job.name for job in render_all.shots(scene, False)] == ["A_b", "a_b_2"]
    for each in scene.objects:
        each.hide_render = True
    with pytest.raises(InputError, match="has no camera that is rendered"):
        render_all.shots(scene, False)


def test_pixels_of_another_shape_are_refused_by_the_camera_s_name(two):
    two.objects["Hero: close"].virtual_pinhole_picture.pixel_aspect_x = 2
    with pytest.raises(InputError, match="camera 'Hero: close' has pixels of another shape"):
        render_all.shots(two, False)


def test_it_tells_how_far_it_is_and_ends_with_the_contact_sheet(two, stand_in, tmp_path):
    before = own_picture._numbers(two), two.camera, bpy.data.is_dirty
    rendering = render_all.Rendering(two, tmp_path)
    ends = time.monotonic() + 60
    while rendering.progress()[0] == 0 and time.monotonic() < ends:
        time.sleep(0.01)
    assert rendering.progress() == (0.5, "Rendering picture 2 of 2") and rendering.poll() is None
    (tmp_path / "go").touch()
    rendering.wait()
    assert rendering.poll() == (True, f"2 pictures in {rendering.folder}")
    assert rendering.sheet.is_file() and rendering.folder.name.startswith("untitled all cameras 2")
    assert not rendering._temporary.exists()
    assert (own_picture._numbers(two), two.camera, bpy.data.is_dirty) == before


def test_canceled_it_leaves_the_pictures_that_are_there_and_no_process(two, stand_in, tmp_path):
    rendering = render_all.Rendering(two, tmp_path)
    ends = time.monotonic() + 60
    while rendering.progress()[0] == 0 and time.monotonic() < ends:
        time.sleep(0.01)
    render_all.background.running = rendering
    assert not bpy.ops.viewcam.render_all_cameras.poll(), "two at a time"
    assert bpy.ops.viewcam.cancel_render_all() == {"FINISHED"}
    assert render_all.background.running is None and rendering._process.status() is not None
    assert [path.suffix for path in rendering.folder.iterdir()] == [".exr"] and not rendering._temporary.exists()


def test_by_script_it_waits_and_says_where_the_sheet_is(two, stand_in, tmp_path):
    (tmp_path / "go").touch()
    assert not bpy.ops.viewcam.open_contact_sheet.poll()
    assert bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path)) == {"FINISHED"}
    assert bpy.ops.viewcam.open_contact_sheet.poll() and render_all._sheet.is_file()
    stand_in(4)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "go").touch()
    with pytest.raises(RuntimeError, match="the contact sheet says what went wrong"):
        bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path / "other"))


def test_after_a_run_without_a_contact_sheet_none_of_an_earlier_run_is_opened(two, stand_in, monkeypatch, tmp_path):
    (tmp_path / "go").touch()
    assert bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path)) == {"FINISHED"}
    assert bpy.ops.viewcam.open_contact_sheet.poll()
    last_line = (
        '{"event": "error", "text": "shots.json: one problem, nothing is rendered", "problems": ["camera A: no graphics"]}'
    )
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", f"print({last_line!r}); raise SystemExit(2)"])
    time.sleep(1.1)  # its folder is named by the second
    with pytest.raises(RuntimeError, match="Camera A: no graphics"):
        bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path))
    assert not bpy.ops.viewcam.open_contact_sheet.poll()


@pytest.mark.parametrize("check", [False, True])
def test_a_proof_of_each_picture_is_asked_for_by_one_box(two, stand_in, tmp_path, monkeypatch, check):
    (tmp_path / "go").touch()
    asked, stood_in = [], comparing.command
    monkeypatch.setattr(
        comparing, "command", lambda *arguments: asked.append(plan.read(arguments[2])[1]) or stood_in(*arguments)
    )
    assert bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path), check=check) == {"FINISHED"}
    assert [plan_read.outputs.check for plan_read in asked] == [check]


def test_without_a_folder_it_is_refused_and_a_child_that_dies_leaves_no_folder(two, monkeypatch, tmp_path):
    with pytest.raises(RuntimeError, match="There is no folder for the pictures"):
        bpy.ops.viewcam.render_all_cameras()
    monkeypatch.setattr(comparing, "command", lambda *_: [sys.executable, "-c", "print('out of memory'); raise SystemExit(9)"])
    with pytest.raises(RuntimeError, match="out of memory"):
        bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path))
    assert list(Path(tmp_path).iterdir()) == []


def test_the_render_menu_is_as_before_without_the_add_on(registered_addon):
    entries = bpy.types.TOPBAR_MT_render._dyn_ui_initialize
    assert render_all._draw_render_menu in entries()
    registered_addon.unregister()
    try:
        assert render_all._draw_render_menu not in entries()
    finally:
        registered_addon.register()


@pytest.mark.exhaustive
def test_two_cameras_of_two_formats_are_rendered_by_one_click(two, monkey, tmp_path):
    two.render.engine, two.cycles.samples = "CYCLES", 1
    assert bpy.ops.viewcam.render_all_cameras(directory=str(tmp_path), check=True) == {"FINISHED"}
    (folder,) = tmp_path.iterdir()
    sheet = (folder / "contact-sheet.html").read_text(encoding="utf-8")
    assert "20 × 30" in sheet and "50 × 30" in sheet and "untitled.blend" in sheet
    assert sheet.count("identical") == 3 and "not checked" not in sheet
    assert {path.name for path in folder.glob("*.exr")} == {"Hero_ close.exr", "Wide.exr", "Camera.exr"}
