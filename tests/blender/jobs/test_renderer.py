"""Any .blend, by path: opened without its scripts, set to the request for a while, never saved; or one sentence why not."""

import os
import shutil

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import animation
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import export_geometry, images
from viewcam_addon.errors import InputError
from viewcam_addon.jobs.job import Job


@pytest.fixture
def blend(scene, camera_object, tmp_path):
    """A function that saves the open file and returns its path; it has a camera above a cube, enabled at (0, 0, 6)."""
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    group = camera_object.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (0, -0.5, 6), (0, 0, 0), (0, 1, 0), 180
    group.enabled = True
    bpy.ops.mesh.primitive_cube_add()

    def save(name="file.blend", **options):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / name), **options)
        return tmp_path / name

    return save


def fails(request, words):
    with pytest.raises(InputError) as caught:
        jobs.export(request)
    message = str(caught.value)
    assert words in message and "\n" not in message, message


@pytest.mark.parametrize("compress", [False, True])
def test_a_file_is_exported_as_it_is(blend, compress):
    path = blend(compress=compress)
    before = path.read_bytes()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    exported = jobs.export(Job(blend=path))
    assert [placed.name for placed in exported.objects] == ["Cube"]
    assert (exported.camera.width, exported.camera.height) == (160, 120)
    assert exported.stated_camera.eye == (0, -0.5, 6) and exported.stated_camera.distance == (180, 180)
    assert path.read_bytes() == before and [each.name for each in path.parent.iterdir()] == [path.name]


def test_scripts_of_a_file_do_not_run(blend, scene, tmp_path):
    witness = tmp_path / "witness"
    text = bpy.data.texts.new("virus.py")
    text.write(f"open({str(witness)!r}, 'w')")
    text.use_module = True
    bpy.data.objects["Cube"].driver_add("location", 0).driver.expression = f"open({str(witness)!r}, 'w') and 3"
    path = blend()
    witness.unlink(missing_ok=True)
    exported = jobs.export(Job(blend=path))
    assert not witness.exists() and exported.objects[0].matrix[0, 3] == 0


def test_another_camera_by_its_name(blend, add_camera, scene):
    other = add_camera("Other")
    other.location = (1, 2, 9)
    scene.camera = bpy.data.objects["Camera"]
    exported = jobs.export(Job(blend=blend(), camera="Other"))
    assert exported.camera.eye == (1, 2, 9) and exported.stated_camera is None


def test_the_camera_of_a_frames_marker(blend, add_camera, scene):
    other = add_camera("Other")
    other.location = (1, 2, 9)
    scene.camera = bpy.data.objects["Camera"]
    for name, frame in (("Camera", 1), ("Other", 20)):
        scene.timeline_markers.new(name, frame=frame).camera = bpy.data.objects[name]
    path = blend()
    assert jobs.export(Job(blend=path, frame=25)).camera.eye == (1, 2, 9)
    assert jobs.export(Job(blend=path, frame=5)).camera.eye[2] == 6
    assert jobs.export(Job(blend=path, frame=25, camera="Camera")).camera.eye[2] == 6


@pytest.mark.parametrize(("length", "frame", "is_others"), [(200, 39, False), (200, 40, True), (50, 9, False), (50, 10, True)])
def test_a_marker_is_met_in_the_time_that_the_scene_stretches(add_camera, scene, monkey, both_sides, length, frame, is_others):
    """Blender stretches time before it looks for markers."""
    other, own = add_camera("Other"), bpy.data.objects["Camera"]
    other.matrix_world = own.matrix_world.copy()
    other.location.x = 1
    for camera, at in ((own, 1), (other, 20)):
        scene.timeline_markers.new(camera.name, frame=at).camera = camera
    scene.render.frame_map_new = length
    sides = both_sides(frame=frame)
    sides.check()
    eye = sides.exported.camera.eye
    assert eye[0] == (1 if is_others else own.location.x), f"frame {frame} is seen from {eye}"


@pytest.mark.parametrize("by_marker", [False, True])
def test_the_camera_of_a_scene_may_be_in_another_one(add_camera, scene, monkey, both_sides, by_marker):
    elsewhere = add_camera("Elsewhere")
    elsewhere.matrix_world = bpy.data.objects["Camera"].matrix_world.copy()
    elsewhere.location.x = 1
    scene.collection.objects.unlink(elsewhere)
    bpy.data.scenes.new("Other").collection.objects.link(elsewhere)
    scene.camera = bpy.data.objects["Camera"] if by_marker else elsewhere
    if by_marker:
        scene.timeline_markers.new("Elsewhere", frame=1).camera = elsewhere
    sides = both_sides()
    sides.check()
    assert sides.exported.camera.eye[0] == 1, sides.exported.camera.eye


def test_cameras_of_one_name_are_told_apart_by_their_library(blend, add_camera, link_object, scene):
    other = add_camera("Other")
    other.location = (1, 2, 9)
    library = blend("library.blend", copy=True)
    scene.camera = bpy.data.objects["Camera"]
    bpy.data.objects.remove(other)
    link_object(library, "Other")
    add_camera("Other")
    for name, z in (("Other [library.blend]", 9), ("Other", 0)):
        exported = jobs.export(Job(blend=blend(), camera=name))
        assert exported.camera.eye[2] == z, f"{name} is at {exported.camera.eye}"
    scene = bpy.context.scene
    scene.camera = next(each for each in scene.objects if each.name == "Other" and each.library)
    assert jobs.export(Job(blend=blend())).camera.eye[2] == 9


@pytest.mark.parametrize("size", [(320, 240), (80, 60), (200, 60), (60, 200)])
def test_another_size_shows_the_same_and_is_stated_so(blend, scene, size):
    path = blend()
    exported = jobs.export(Job(blend=path, width=size[0], height=size[1]))
    camera, stated = exported.camera, exported.stated_camera
    assert (camera.width, camera.height) == (stated.width, stated.height) == size
    assert camera.distance == pytest.approx((180 * max(size) / 160,) * 2, rel=1e-6)
    assert stated.distance == pytest.approx(camera.distance, rel=1e-6)
    scene = bpy.context.scene
    group = scene.camera.virtual_pinhole
    assert (scene.render.resolution_x, scene.render.resolution_y, group.distance) == (160, 120, 180)
    assert group.keeps == "FIELD_OF_VIEW"
    assert tuple(group.picture) == tuple(group.counted_in) == (160, 120, 100, 1, 1)
    assert group.precision() == 2.0**-53 if group.exact else 2.0**-24


@pytest.mark.parametrize("keeps", ["PIXELS", "FIELD_OF_VIEW"])
def test_another_size_of_a_keyed_zoom_and_distance_shows_the_same(blend, both_sides, keeps):
    group = bpy.data.objects["Camera"].virtual_pinhole
    group.keeps = keeps
    for frame, distance in ((1, 100), (11, 300)):
        group.distance, group.zoom = distance, distance / 200
        group.keyframe_insert("distance", frame=frame)
        group.keyframe_insert("zoom", frame=frame)
    both = both_sides(blend=blend(), frame=11, width=80, height=60)
    both.check()
    exported = both.exported
    assert exported.camera.distance == pytest.approx((225, 225), rel=1e-6)
    assert exported.stated_camera.distance == pytest.approx(exported.camera.distance, rel=1e-6)


@pytest.mark.parametrize("size", [None, (80, 60)])
def test_a_camera_that_keyframes_move_and_zoom_is_stated_where_it_is_at_each_frame(blend, size):
    camera_object = bpy.data.objects["Camera"]
    lens, (x, _, _) = camera_object.data.lens, camera_object.location
    for frame, share in ((1, 0), (11, 1)):
        camera_object.location.x, camera_object.data.lens = x + share, lens * (1 + share)
        camera_object.keyframe_insert("location", frame=frame)
        camera_object.data.keyframe_insert("lens", frame=frame)
    bpy.context.scene.frame_set(1)
    width, height = size or (None, None)
    exported = jobs.export(Job(blend=blend(), frame=11, width=width, height=height))
    camera, stated = exported.camera, exported.stated_camera
    assert camera.eye[0] == pytest.approx(1) and camera.distance[0] == pytest.approx(2 * 180 * camera.width / 160)
    assert stated.eye == pytest.approx(camera.eye) and stated.distance == pytest.approx(camera.distance, rel=1e-6)
    np.testing.assert_allclose(stated.basis(), camera.basis(), atol=1e-6)  # float32 storage, a few times over


@pytest.mark.parametrize("way", ["by hand", "by a constraint"])
def test_a_camera_that_was_moved_where_the_add_on_is_not_is_stated_where_its_values_say(blend, way):
    """A check is of the values that the file states: to read them off the camera would find nothing."""
    camera_object = bpy.data.objects["Camera"]
    bpy.context.view_layer.update()
    animation.unregister()
    try:
        if way == "by hand":
            camera_object.location.z = 5
        else:
            limit = camera_object.constraints.new("LIMIT_LOCATION")
            limit.use_max_z, limit.max_z = True, 5
        path = blend()
    finally:
        animation.register()
    for job in (Job(blend=path), Job(blend=path, width=80, height=60)):
        exported = jobs.export(job)
        assert exported.camera.eye[2] == 5 and exported.stated_camera.eye == (0, -0.5, 6)


def test_another_size_than_the_percentage_of_the_scene(blend, scene):
    scene.render.resolution_percentage = 33
    exported = jobs.export(Job(blend=blend(), width=160, height=120))
    assert exported.stated_camera.distance == pytest.approx((180, 180), rel=1e-6)
    assert bpy.context.scene.render.resolution_percentage == 33


def test_the_job_on_the_open_file_leaves_it_as_it_was(blend, scene):
    scene.frame_set(3, subframe=0.25)
    jobs.export(Job(frame=8, width=64, height=64))
    assert (scene.frame_current, scene.frame_subframe, scene.render.resolution_x) == (3, 0.25, 160)


def test_a_border_is_cropped_to_on_both_sides(blend, scene, both_sides):
    render = scene.render
    render.use_border, render.use_crop_to_border = True, False
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.3, 0.8, 0.1, 0.7
    sides = both_sides()
    sides.check()
    assert sides.cycles["Depth"].shape[:2] == (72, 80) and not render.use_crop_to_border


def test_a_file_saved_in_edit_mode_is_seen_as_in_a_render(blend, both_sides):
    bpy.ops.object.mode_set(mode="EDIT")
    sides = both_sides()
    sides.check()
    assert len(next(iter(sides.exported.geometries.values())).triangles) == 12


def test_a_file_saved_in_sculpt_mode_has_the_normals_of_a_mesh_on_both_sides(blend, both_sides):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_cone_add(vertices=5, depth=1)  # around each vertex are angles of other sizes
    bpy.ops.object.shade_smooth()
    bpy.ops.object.mode_set(mode="SCULPT")
    sides = both_sides(blend=blend())
    sides.check()


@pytest.mark.parametrize("shader", ["ShaderNodeBsdfPrincipled", "ShaderNodeSubsurfaceScattering"])
def test_a_scaled_mesh_with_light_below_its_surface_has_the_normals_of_any_other(blend, both_sides, shader):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_cone_add(vertices=5, depth=1)
    bpy.ops.object.shade_smooth()
    bpy.context.object.scale = (1.2, 0.6, 1.0)
    material = bpy.data.materials.new("Skin")
    material.use_nodes = True
    tree = material.node_tree
    node = tree.nodes.new(shader)
    if "Subsurface Weight" in node.inputs:
        node.inputs["Subsurface Weight"].default_value = 1.0
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    bpy.context.object.data.materials.append(material)
    sides = both_sides(blend=blend())
    sides.check()
    assert not sides.exported.ledger or all(entry.status == "exported" for entry in sides.exported.ledger), (
        sides.exported.ledger
    )


def test_linked_objects_are_exported_and_numbered(blend, camera_object, both_sides, link_object):
    material = bpy.data.materials.new("Shared")
    bpy.data.objects["Cube"].data.materials.append(material)
    library = blend("library.blend", copy=True)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.data.materials.remove(material)
    link_object(library, "Cube")
    path = blend("linking.blend")
    sides = both_sides(blend=path)
    sides.check()
    assert sides.exported.objects[0].object_index > 0 and sides.exported.objects[0].material_indices[0] > 0
    assert not any(block.pass_index for block in bpy.data.objects)


def test_a_missing_library_is_told(blend, link_object):
    library = blend("library.blend", copy=True)
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    link_object(library, "Cube")
    path = blend("linking.blend")
    library.unlink()
    (entry,) = [entry for entry in jobs.export(Job(blend=path)).ledger if entry.status == "skipped"]
    assert entry.object == "library.blend" and "is missing" in entry.reason


def test_bad_files_and_cameras_are_one_sentence(blend, scene, camera_object, tmp_path):
    path = blend()
    fails(Job(blend=tmp_path / "none.blend"), "does not exist")
    fails(Job(blend=tmp_path), "is no file: check the name")
    (tmp_path / "text.blend").write_text("not a blend")
    fails(Job(blend=tmp_path / "text.blend"), "is not a .blend file")
    (tmp_path / "empty.blend").touch()
    fails(Job(blend=tmp_path / "empty.blend"), "is not a .blend file")
    (tmp_path / "short.blend").write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    fails(Job(blend=tmp_path / "short.blend"), "can't be opened")
    fails(Job(blend=path, camera="Nobody"), "has no camera 'Nobody': choose from Camera")
    fails(Job(blend=path, camera="Cube"), "has no camera 'Cube'")


def test_a_file_without_a_camera_is_one_sentence(blend, scene, camera_object):
    scene.collection.objects.unlink(camera_object)
    scene.camera = None
    fails(Job(blend=blend()), "scene 'Scene' has no camera: add one, or give another file")


@pytest.mark.parametrize(("kind", "words"), [("ORTHO", "orthographic"), ("PANO", "panoramic")])
def test_cameras_that_are_no_pinholes_are_one_sentence(blend, camera_object, kind, words):
    camera_object.data.type = kind
    fails(Job(blend=blend()), words)


def test_no_camera_and_impossible_values_are_one_sentence(blend, scene, camera_object):
    group = camera_object.virtual_pinhole
    group.look_at = group.eye
    fails(Job(blend=blend()), "the same point")
    scene = bpy.context.scene
    scene.camera = None
    fails(Job(blend=blend()), "has no camera")


def test_a_sheared_camera_is_one_sentence(blend, scene):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.scale = (1, 3, 1)
    camera = scene.camera
    camera.virtual_pinhole.enabled = False
    camera.parent, camera.rotation_euler = parent, (0.5, 0.6, 0.7)
    fails(Job(blend=blend()), "oblique")


def test_a_folder_that_can_not_be_written_leaves_nothing(blend, tmp_path):
    path = blend()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="can't be written"):
        jobs.cycles(Job(blend=path), tmp_path / "file" / "picture.exr")


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0 or not shutil.which("mount"),
    reason="needs to mount a tmpfs; tests/test_cli.py tests the same without",
)
def test_a_full_disk_leaves_no_partial_file(blend, scene, tmp_path):
    scene.render.resolution_x, scene.render.resolution_y = 1280, 960
    path, small = blend(), tmp_path / "small"
    small.mkdir()
    if os.system(f"mount -t tmpfs -o size=16k none {small}"):
        pytest.skip("no right to mount a file system here; tests/test_cli.py fills no disk and tests the same")
    try:
        with pytest.raises(InputError) as caught:
            jobs.cycles(Job(blend=path), small / "picture.exr")
        assert "\n" not in str(caught.value) and not list(small.iterdir()), caught.value
    finally:
        os.system(f"umount {small}")


@pytest.mark.parametrize("name", ["plain.exr", "Ä ö.exr", "a#b####.exr", "{a}{{b.exr", "folder/deep {x} ##/picture.exr"])
def test_a_picture_of_any_name_relative_to_the_working_folder(blend, tmp_path, monkeypatch, name):
    path = blend()
    monkeypatch.chdir(tmp_path)
    jobs.cycles(Job(blend=path), name)
    assert (tmp_path / name).stat().st_size > 1000
    assert {each.name for each in (tmp_path / name).parent.iterdir()} <= {(tmp_path / name).name, path.name}


def test_render_and_export_tell_the_same(blend, camera_object, tmp_path):
    camera_object.data.dof.use_dof = True
    bpy.data.objects["Cube"].is_shadow_catcher = True
    path = blend()
    entries = jobs.cycles(Job(blend=path), tmp_path / "picture.exr")
    assert entries == jobs.export(Job(blend=path)).ledger
    assert {entry.object: entry.status for entry in entries} == {"Camera": "approximated", "Cube": "approximated"}
    assert (tmp_path / "picture.exr").stat().st_size > 1000


def paint(cube, lit_by):
    """Give the cube a material with an image, and light by the surface, a lamp or nothing."""
    material = bpy.data.materials.new("Painted")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    texture, output = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader = tree.nodes.new("ShaderNodeEmission" if lit_by == "surface" else "ShaderNodeBsdfDiffuse")
    texture.image = bpy.data.images.new("Image", 4, 4)
    tree.links.new(texture.outputs["Color"], shader.inputs["Color"])
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    cube.data.materials.append(material)
    if lit_by == "lamp":
        bpy.ops.object.light_add(type="SUN")


@pytest.mark.parametrize("recenter", [False, True])
@pytest.mark.parametrize(("lit_by", "level"), [("", "geometry"), ("surface", "direct"), ("lamp", "path")])
def test_for_the_least_level_a_scene_is_exported_once(blend, monkeypatch, lit_by, level, recenter):
    paint(bpy.data.objects["Cube"], lit_by)
    path = blend()
    wanted = jobs.export(Job(blend=path, level=level, recenter=recenter))
    read = []
    for module, name in ((export_geometry, "mesh_of"), (images, "picture_of")):
        function = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *arguments, f=function, name=name: read.append(name) or f(*arguments))
    exported = jobs.export(Job(blend=path, level="auto", recenter=recenter))
    assert sorted(read) == ["mesh_of"] + ["picture_of"] * (level != "geometry"), read
    assert (exported.ledger, list(exported.materials), len(exported.lamps)) == (
        wanted.ledger,
        list(wanted.materials),
        len(wanted.lamps),
    )


def test_what_is_flattened_so_that_cycles_does_not_draw_it_gives_no_light(blend, scene, tmp_path):
    cube = bpy.data.objects["Cube"]
    paint(cube, "surface")
    cube.scale.z = 0
    scene.collection.objects.link(cube.copy())
    request = Job(blend=blend(), level="auto")
    exported = jobs.export(request)
    assert not exported.materials and not exported.objects and not exported.geometries
    assert {entry.reason for entry in exported.ledger} == {"flattened by its scale, and Cycles does not draw it"}
    assert jobs.cycles(request, tmp_path / "picture.exr") == exported.ledger
