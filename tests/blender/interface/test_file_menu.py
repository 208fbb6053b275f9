import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender.interface import file_menu
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer.scene import LedgerEntry, scene_file


def export(path, **options):
    return bpy.ops.viewcam.export_scene(filepath=str(path), **options)


@pytest.fixture
def some_scene(monkey, camera, add_lamp, scene):
    """Suzanne under a lamp, and a camera."""
    add_lamp("POINT", energy=500)
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    return scene


def test_the_menu_writes_what_the_command_writes(some_scene, tmp_path, capfd):
    assert export(tmp_path / "scene.json") == {"FINISHED"}
    scene_file.write(jobs.export(Job(level="path")), tmp_path / "command.json")
    written = (tmp_path / "scene.json").read_text().replace("scene.npz", "command.npz")
    assert written == (tmp_path / "command.json").read_text()
    assert len(scene_file.read(tmp_path / "scene.json").lamps) == 1
    assert "scene.json: 2 of 2 objects exported whole" in capfd.readouterr().out


def test_without_light_there_is_geometry_alone(some_scene, tmp_path):
    export(tmp_path / "scene.json", light=False)
    cameras_read = scene_file.read(tmp_path / "scene.json")
    assert cameras_read.lamps == () and cameras_read.materials == {} and len(cameras_read.objects) == 1


def test_the_origin_may_be_the_eye(some_scene, tmp_path):
    export(tmp_path / "scene.json", recenter=True)
    cameras_read = scene_file.read(tmp_path / "scene.json")
    assert cameras_read.origin == pytest.approx((0.3, -7, 4), abs=1e-6)
    assert cameras_read.camera.eye == pytest.approx((0, 0, 0), abs=1e-6)


def test_a_name_without_suffix_gets_one(some_scene, tmp_path):
    export(tmp_path / "scene")
    assert (tmp_path / "scene.json").is_file()


def test_what_does_not_come_along_is_a_warning(some_scene, add, tmp_path, capfd):
    add(bpy.data.volumes.new("Smoke"))
    export(tmp_path / "scene.json")
    entries = scene_file.read(tmp_path / "scene.json").ledger
    assert [entry.object for entry in entries if entry.status == "skipped"] == ["Smoke"]
    assert "Warning: scene.json: 2 of 3 objects exported whole, 1 skipped" in capfd.readouterr().out


def test_nothing_of_the_open_file_changes(some_scene, tmp_path):
    def state():
        return {
            key: len(getattr(bpy.data, key)) for key in ("objects", "meshes", "texts", "scenes", "materials", "collections")
        }

    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    before = state()
    export(tmp_path / "scene.json", recenter=True)
    assert state() == before


def test_it_works_in_edit_mode(some_scene, tmp_path):
    bpy.ops.object.mode_set(mode="EDIT")
    export(tmp_path / "scene.json")
    assert bpy.context.object.mode == "EDIT"
    assert len(scene_file.read(tmp_path / "scene.json").objects) == 1


def test_errors_are_one_sentence_and_leave_no_file(some_scene, camera, tmp_path):
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(RuntimeError, match="is a folder: give the name of a file"):
        export(tmp_path / "folder.json")
    with pytest.raises(RuntimeError, match="The scene has no file name"):
        export(str(tmp_path) + "/")
    camera.data.type = "ORTHO"
    with pytest.raises(RuntimeError, match="is orthographic, no pinhole") as error:
        export(tmp_path / "scene.json")
    assert "Traceback" not in str(error.value)
    assert [path.name for path in tmp_path.iterdir()] == ["folder.json"]


def test_without_a_camera_it_is_off(fresh_blender):
    assert not bpy.ops.viewcam.export_scene.poll()


def test_the_popup_tells_the_first_dozen_and_how_many_more():
    entries = [LedgerEntry(f"Object {i}", "skipped" if i else "approximated", "a reason " * 12) for i in range(15)]
    lines = file_menu.popup_lines(entries)
    assert lines[0][0].startswith("Object 0: approximated, a reason") and lines[0][1] == "ERROR"
    assert [icon for _, icon in lines].count("CANCEL") == 11
    assert lines[-1] == ("and 3 more", "BLANK1")
    assert [icon for _, icon in file_menu.popup_lines(entries[:1])] == ["ERROR", "BLANK1"]


@pytest.mark.parametrize(
    ("statuses", "line"),
    [
        ([], "0 of 0 objects exported whole"),
        (["exported"], "1 of 1 object exported whole"),
        (["skipped", "approximated", "approximated", "exported"], "1 of 4 objects exported whole, 2 approximated, 1 skipped"),
    ],
)
def test_the_report_counts_the_ledger(statuses, line):
    assert file_menu.summary([LedgerEntry("", status) for status in statuses]) == line


@pytest.mark.parametrize(("menu", "entry"), [("export", "_draw_export"), ("import", "_draw_import")])
def test_the_menu_entry_goes_with_the_add_on(registered_addon, menu, entry):
    functions = getattr(bpy.types, f"TOPBAR_MT_file_{menu}")._dyn_ui_initialize
    count = len(functions())
    assert getattr(file_menu, entry) in functions()
    try:
        for _ in range(3):
            viewcam_addon.unregister()
            assert len(functions()) == count - 1
            viewcam_addon.register()
            assert len(functions()) == count
    finally:
        if not hasattr(bpy.types.Object, "virtual_pinhole"):
            viewcam_addon.register()
