import dataclasses
import json
import os
import re
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender.interface import file_menu
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import import_geometry, import_scene
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
    found = scene_file.read(tmp_path / "scene.json")
    assert found.lamps == () and found.materials == {} and len(found.objects) == 1


def test_the_origin_may_be_the_eye(some_scene, tmp_path):
    export(tmp_path / "scene.json", recenter=True)
    found = scene_file.read(tmp_path / "scene.json")
    assert found.origin == pytest.approx((0.3, -7, 4), abs=1e-6)
    assert found.camera.eye == pytest.approx((0, 0, 0), abs=1e-6)


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


def blocks():
    """How many datablocks of each kind the open file has."""
    kinds = [prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION"]
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def settings_of(scene):
    """What an import could change of a scene."""
    render, cycles = scene.render, scene.cycles
    size = render.resolution_x, render.resolution_y, render.resolution_percentage, render.use_border
    film = render.film_transparent, cycles.filter_width, cycles.film_exposure, cycles.max_bounces
    return scene.camera, scene.world, size, (render.pixel_aspect_x, render.pixel_aspect_y), film


def import_(path, **options):
    return bpy.ops.viewcam.import_scene(filepath=str(path), **options)


HAND = """{"format": "virtual-pinhole-scene", "version": 1,
 "camera": {"eye": [0, -6, 2.5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 400, "width": 320, "height": 180},
 "geometries": {
  "floor": {"type": "plane", "corner": [-4, -4, 0], "edges": [[8, 0, 0], [0, 8, 0]]},
  "beads": {"type": "spheres", "centers": [[-1, 0, 0.5], [1, 0, 0.5]], "radii": [0.5, 0.25], "materials": [0, 1]},
  "bent": {"type": "mesh", "vertices": [[0, 0, 1], [1, 0, 1], [0, 1, 1]], "triangles": [[0, 1, 2], [0, 1, 1]]}
 },
 "objects": [
  {"name": "floor", "geometry": "floor", "object_index": 1, "materials": ["wall"]},
  {"name": "beads", "geometry": "beads", "material_indices": [3, 4], "scale": [1, 1, 1.5]},
  {"name": "bent", "geometry": "bent", "rotation": [0, 0, 30]}
 ],
 "materials": {"wall": {"diffuse": [0.5, 0.5, 0.5]}},
 "lamps": [{"type": "spot", "name": "lamp", "location": [0, 0, 4], "angle": 0.001}],
 "world": {"radiance": [0.25, 0.5, 1]}
}"""


@pytest.fixture
def hand_written(fresh_blender, tmp_path):
    """The path of a small scene file; a default file is open, whose scene has a camera of its own."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    path = tmp_path / "Hand.json"
    path.write_text(HAND)
    return path


def test_the_import_is_a_collection_of_its_own(hand_written, capfd):
    before = settings_of(bpy.context.scene)
    assert import_(hand_written) == {"FINISHED"}
    collection = bpy.data.collections["Hand"]
    assert sorted(block.name for block in collection.objects) == ["Hand", "beads", "beads.001", "bent", "floor", "lamp"]
    assert {block.data.materials[0].pass_index for block in collection.objects if block.type == "POINTCLOUD"} == {3, 4}
    assert settings_of(bpy.context.scene) == before, "the import changed the artist's settings"
    assert len(collection.objects["bent"].data.polygons) == 1, "a triangle without area is no face"
    values = collection.objects["Hand"].virtual_pinhole
    assert values.enabled and values.numbers()[:3] == ((0, -6, 2.5), (0, 0, 1), (0, 0, 1))
    assert set(bpy.context.selected_objects) == set(collection.objects) and bpy.context.object == collection.objects["Hand"]
    said = capfd.readouterr().out
    assert "Warning: Hand.json: 3 of 6 objects imported whole, 3 approximated" in said


def test_what_could_not_come_along_is_told(hand_written):
    imported = import_scene.import_scene(scene_file.read(hand_written), "Hand", bpy.context.scene)
    reasons = {entry.object: entry.reason for entry in imported.ledger if entry.status != "exported"}
    assert reasons == {
        "Hand": "its picture is 320 × 180 pixels and the scene's 1920 × 1080: it is as wide a view",
        "lamp": "its spot size is 0.001, and Blender makes it 0.0174533",
        "Scene": "the scene keeps its own world, film and bounces",
    }
    assert imported.camera.virtual_pinhole.numbers()[3] == 2400


def test_camera_resolution_world_and_film_come_along_if_wanted(hand_written):
    import_(hand_written, set_picture=True, set_surroundings=True)
    scene = bpy.context.scene
    assert scene.camera == bpy.data.objects["Hand"] and scene.world == bpy.data.worlds["Hand"]
    assert (scene.render.resolution_x, scene.render.resolution_y) == (320, 180)
    assert scene.camera.virtual_pinhole.numbers()[3] == 400


def test_a_scene_without_a_camera_takes_the_files(hand_written):
    bpy.data.objects.remove(bpy.context.scene.camera)
    import_(hand_written)
    assert bpy.context.scene.camera == bpy.data.objects["Hand"] and bpy.context.scene.render.resolution_x == 1920


def test_geometry_alone_leaves_the_world(hand_written):
    text = json.loads(HAND)
    for key in ("lamps", "world", "materials"):
        del text[key]
    del text["objects"][0]["materials"]
    hand_written.write_text(json.dumps(text))
    world = bpy.context.scene.world
    import_(hand_written, set_picture=True, set_surroundings=True)
    assert bpy.context.scene.world == world


def test_coordinates_that_count_from_elsewhere_are_told(hand_written):
    scene = dataclasses.replace(scene_file.read(hand_written), origin=(500000.25, 4e6, 0.0))
    imported = import_scene.import_scene(scene, "Hand", bpy.context.scene)
    assert "its coordinates count from the point 500000.25, 4000000, 0" in imported.ledger[0].reason


@pytest.mark.parametrize(
    ("wrong", "right", "sentence"),
    [
        ('"version": 1', '"version": 2', "Hand.json: 'version' of the scene is 2"),
        ('"distance": 400', '"distance": 1e300', "needs 1e+300, beyond Blender's numbers"),
        ('"width": 320', '"width": 3', "the camera's picture is 3 × 180 pixels"),
        ('"radii": [0.5, 0.25]', '"radii": [0.5, -1]', "radii not negative"),
        ('"name": "lamp"', r'"name": "\ud800"', "this is no JSON text"),
    ],
)
def test_a_bad_file_is_one_sentence_and_changes_nothing(hand_written, wrong, right, sentence):
    hand_written.write_text(HAND.replace(wrong, right))
    before = blocks(), settings_of(bpy.context.scene)
    with pytest.raises(RuntimeError, match=re.escape(sentence.removeprefix("the "))) as error:
        import_(hand_written, set_picture=True, set_surroundings=True)
    assert "Traceback" not in str(error.value)
    assert (blocks(), settings_of(bpy.context.scene)) == before


@pytest.mark.parametrize("step", ["points_from", "mesh_from", "_set_normals"])
def test_whatever_fails_half_way_leaves_nothing_behind(hand_written, step, monkeypatch):
    def fail(*_arguments):
        raise MemoryError

    text = json.loads(HAND)
    text["geometries"]["bent"]["corner_normals"] = [[[0, 0, 1]] * 3] * 2
    hand_written.write_text(json.dumps(text))
    before = blocks(), settings_of(bpy.context.scene)
    monkeypatch.setattr(import_geometry, step, fail)
    with pytest.raises(MemoryError):
        import_scene.import_scene(scene_file.read(hand_written), "Hand", bpy.context.scene, True, True)
    assert (blocks(), settings_of(bpy.context.scene)) == before


@pytest.mark.parametrize("name", ["", "x" * 300, "a\nb", "😀", "Hand"])
def test_things_may_have_any_name(hand_written, name):
    hand_written.write_text(
        HAND.replace('"name": "lamp"', f'"name": {json.dumps(name)}').replace('"wall"', json.dumps(name or "-"))
    )
    assert import_(hand_written) == {"FINISHED"}


def test_a_file_may_have_any_name(hand_written):
    odd = Path(os.fsdecode(os.fsencode(str(hand_written.parent)) + b"/\xff.json"))
    hand_written.rename(odd)
    scene = scene_file.read(odd)
    assert scene.objects[0].name == "floor"
    assert import_(odd) == {"FINISHED"}
    assert "?" in bpy.data.collections
    odd.write_text("{")
    with pytest.raises(RuntimeError, match=r"\\udcff\.json: line 1 is not JSON"):
        import_(odd)


def test_it_imports_in_edit_mode(hand_written):
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    bpy.ops.object.mode_set(mode="EDIT")
    assert import_(hand_written) == {"FINISHED"}
    assert bpy.context.mode == "EDIT_MESH" and "Hand" in bpy.data.objects


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
    assert file_menu.summary([LedgerEntry("", status) for status in statuses], "exported") == line


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
