import json
import math
import re
import struct

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import cameras as formats
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import camera_files
from viewcam_addon.cameras import Camera, Options, naming
from viewcam_addon.pinhole import Pinhole


def around(count, size=(640, 360), mirrored=False):
    """Cameras on a circle, each shifted differently."""
    angles = [2 * math.pi * i / count for i in range(count)]
    eyes = [(7 * math.cos(angle), 7 * math.sin(angle), 3.0) for angle in angles]
    points = [(size[0] / 2 + i, size[1] / 2 - i) for i in range(count)]
    pinholes = [
        Pinhole(eye, (0, 0, 1), (0, 0, 1), 600, *size, point, mirrored) for eye, point in zip(eyes, points, strict=True)
    ]
    return [Camera(f"view_{i:03}", pinhole, image=f"view_{i:03}.png") for i, pinhole in enumerate(pinholes)]


def import_(path, **options):
    return bpy.ops.viewcam.import_cameras(filepath=str(path), **options)


def assert_same(actual, wanted, points=((0, 0, 0), (1, 2, 1), (-2, 1, 2))):
    """The picture of both, within what float32 makes of a pose, a lens and a shift."""
    assert (actual.width, actual.height, actual.mirrored) == (wanted.width, wanted.height, wanted.mirrored)
    projected, expected = (np.array(each.project(np.array(points, dtype=float)))[:2] for each in (actual, wanted))
    # 24 bits of coordinates up to 10 seen from 5, times a distance of 600 pixels, a few roundings.
    assert np.abs(projected - expected).max() < 16 * 600 * 2.0**-24 * 2


def write_picture(path, size=(8, 4)):
    image = bpy.data.images.new("made", *size)
    image.filepath_raw, image.file_format = str(path), "PNG"
    image.save()
    bpy.data.images.remove(image)


def imported(name):
    """The cameras of a collection, without the empty that carries them."""
    return [block for block in bpy.data.collections[name].objects if block.type == "CAMERA"]


def counts():
    kinds = ("objects", "cameras", "collections", "images", "actions")
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def test_a_folder_of_cameras_becomes_one_collection_and_each_sees_what_the_file_says(scene, tmp_path):
    cameras_around = around(7)
    formats.save(cameras_around, tmp_path / "sparse", "colmap")
    assert import_(tmp_path / "sparse", set_size=True) == {"FINISHED"}
    objects = imported("sparse")
    assert [each.name for each in objects] == [camera.name for camera in cameras_around]
    assert (scene.render.resolution_x, scene.render.resolution_y) == (640, 360)
    for block, camera in zip(objects, cameras_around, strict=True):
        assert block.virtual_pinhole.enabled
        assert_same(cameras.read(block, scene), camera.pinhole)
    assert scene.camera == objects[0]


def test_a_world_that_knows_no_up_is_leveled_by_its_cameras_or_by_the_ground_that_its_points_have(scene, tmp_path):
    lying = [
        Camera(each.name, Pinhole((x, z, -y), (0, 1, 0), (0, 1, 0), 600, 640, 360), image=each.image)
        for each in around(4)
        for x, y, z in [each.pinhole.eye]
    ]
    formats.save(lying, tmp_path / "sparse", "colmap")
    import_(tmp_path / "sparse", set_size=True, up_from="cameras")
    for block in imported("sparse"):
        assert abs(block.matrix_world.translation.z - 3) < 1e-6 and block.matrix_world.to_3x3().col[1].z > 0.5
    with pytest.raises(RuntimeError, match="no points to find the ground by"):
        import_(tmp_path / "sparse", up_from="ground")


@pytest.mark.parametrize("import_as", ["EACH", "FLIGHT"])
def test_the_empty_of_an_import_turns_and_scales_all_of_its_cameras(scene, tmp_path, import_as):
    formats.save(around(3), tmp_path / "sparse", "colmap")
    import_(tmp_path / "sparse", set_size=True, import_as=import_as)
    blocks, (empty,) = imported("sparse"), [block for block in bpy.data.objects if block.type == "EMPTY"]
    assert empty.name == "sparse World" and all(block.parent == empty for block in blocks)
    empty.scale, empty.rotation_euler = (2, 2, 2), (0, 0, math.pi / 2)
    bpy.context.view_layer.update()
    for i, camera in enumerate(around(3)):
        scene.frame_set(1 + i * (import_as == "FLIGHT"))
        eye, pinhole = camera.pinhole.eye, cameras.read(blocks[i * (import_as == "EACH")], scene)
        assert pinhole.eye == pytest.approx((-2 * eye[1], 2 * eye[0], 2 * eye[2]), abs=1e-5)
        assert pinhole.distance == pytest.approx(camera.pinhole.distance, rel=2.0**-20)


def test_without_being_asked_the_scene_keeps_size_and_camera_and_is_told_what_differs(camera_object, scene, tmp_path, capfd):
    formats.save(around(2, (640, 480)), tmp_path / "transforms.json", "transforms")
    import_(tmp_path / "transforms.json")
    assert (scene.render.resolution_x, scene.camera) == (1920, camera_object)
    assert "The camera is for 640 × 480 pixels and the scene renders 1920 × 1080" in capfd.readouterr().out


def test_a_mirrored_camera_has_a_negative_scale_unless_it_is_left(scene, tmp_path, capfd):
    formats.save(around(1, mirrored=True), tmp_path / "one.json", "text")
    import_(tmp_path / "one.json", set_size=True)
    camera_object = scene.camera
    assert camera_object.scale[0] < 0 and cameras.read(camera_object, scene).mirrored
    import_(tmp_path / "one.json", unmirrored=True)
    (other,) = [each for each in bpy.data.objects if each != camera_object]
    assert not cameras.read(other, scene).mirrored
    assert "is mirrored, and was taken without that" in capfd.readouterr().out


def test_pictures_are_backgrounds_where_they_are_found_and_told_where_not(scene, tmp_path, capfd):
    formats.save(around(3), tmp_path / "sparse" / "0", "colmap")
    (tmp_path / "images").mkdir()
    for i in (0, 2):
        write_picture(tmp_path / "images" / f"view_{i:03}.png")
    import_(tmp_path / "sparse" / "0")
    image_names = [[each.image.name for each in block.data.background_images] for block in imported("0")]
    assert image_names == [["view_000.png"], [], ["view_002.png"]]
    assert "1 of 3 pictures were not found" in capfd.readouterr().out


def test_no_file_makes_blender_open_a_picture_that_is_elsewhere(scene, tmp_path):
    secret = tmp_path / "secret" / "picture.png"
    secret.parent.mkdir()
    write_picture(secret)
    (camera,) = around(1)
    for path in (str(secret), "../secret/picture.png"):
        other = Camera(camera.name, camera.pinhole, image=path)
        assert naming.picture_of(other, tmp_path / "given") is None


def test_polycams_picture_is_found_from_whichever_folder_is_imported(tmp_path):
    folder = tmp_path / "keyframes" / "images"
    for each in (folder, tmp_path / "keyframes" / "cameras"):
        each.mkdir(parents=True)
    (folder / "123.jpg").touch()
    (camera,) = around(1)
    camera = Camera(camera.name, camera.pinhole, image="keyframes/images/123.jpg")
    for path in (tmp_path, tmp_path / "keyframes", tmp_path / "keyframes" / "cameras"):
        assert naming.picture_of(camera, path) == folder / "123.jpg"


def test_an_fspy_project_brings_its_picture(scene, tmp_path):
    write_picture(tmp_path / "picture.png")
    picture = (tmp_path / "picture.png").read_bytes()
    rows = [[1, 0, 0, 0], [0, 0, -1, -5], [0, 1, 0, 2], [0, 0, 0, 1]]
    camera = {"principalPoint": {"x": 0.1, "y": -0.05}, "cameraTransform": {"rows": rows}}
    camera |= {"relativeFocalLength": 1.5, "imageWidth": 8, "imageHeight": 4}
    state = json.dumps({"cameraParameters": camera}).encode()
    (tmp_path / "house.fspy").write_bytes(b"fspy" + struct.pack("<III", 1, len(state), len(picture)) + state + picture)
    import_(tmp_path / "house.fspy", set_size=True)
    block = bpy.data.objects["house"]
    (background,) = block.data.background_images
    assert tuple(background.image.size) == (8, 4) and background.image.packed_file and block.data.show_background_images
    pinhole = cameras.read(block, scene)
    assert pinhole.distance == pytest.approx((6, 6), rel=2.0**-22) and pinhole.eye == pytest.approx((0, -5, 2))
    assert pinhole.principal_point == pytest.approx((4.4, 1.8), abs=1e-5)


@pytest.fixture
def trajectory(tmp_path):
    """A trajectory of TUM: three poses that turn about z, at 10, 10.5 and 12 seconds."""
    lines = []
    for time, angle in ((10, 0), (10.5, 1), (12, 2)):
        lines.append(f"{time} {angle} 2 3 0 0 {math.sin(angle / 2)!r} {math.cos(angle / 2)!r}\n")
    (tmp_path / "flight.txt").write_text("".join(lines))
    return tmp_path / "flight.txt"


def test_a_trajectory_is_one_camera_that_flies_at_its_times(scene, trajectory):
    scene.render.fps = 24
    import_(trajectory, distance=700)
    (block,) = imported("flight")
    frame = (scene.render.resolution_x, scene.render.resolution_y)
    plane = formats.camera.ViewPlane((700, 700), (frame[0] / 2, frame[1] / 2), *frame)
    for at, wanted in zip((1, 13, 49), formats.read(trajectory, options=Options(view_plane=plane)), strict=True):
        scene.frame_set(at)
        pinhole = cameras.read(block, scene)
        assert np.subtract(pinhole.basis(), wanted.pinhole.basis()) == pytest.approx(0, abs=2.0**-21)
        assert pinhole.eye == pytest.approx(wanted.pinhole.eye, abs=2.0**-22)
        assert pinhole.distance == pytest.approx((700, 700), rel=2.0**-22)


def test_a_trajectory_without_a_lens_sees_as_the_scenes_camera_or_asks(posed_camera, scene, trajectory, capfd):
    import_(trajectory)
    assert "it sees as Camera" in capfd.readouterr().out
    (block,) = imported("flight")
    assert cameras.read(block, scene).distance == pytest.approx((1500, 1500), rel=2.0**-22)
    bpy.data.objects.remove(posed_camera)
    bpy.data.objects.remove(block)
    with pytest.raises(RuntimeError, match="give the Distance"):
        import_(trajectory)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("hello", "is no camera that is understood"),
        ('{"frames": [', "looks like JSON and is none"),
    ],
)
def test_what_can_not_be_imported_is_one_sentence_and_leaves_nothing(scene, tmp_path, text, sentence):
    (tmp_path / "file.json").write_text(text)
    before = counts()
    with pytest.raises(RuntimeError, match=sentence) as error:
        import_(tmp_path / "file.json")
    assert "Traceback" not in str(error.value) and counts() == before


def test_a_camera_beyond_blenders_numbers_leaves_nothing_of_the_others(scene, tmp_path):
    cameras_around = [*around(2), Camera("far", Pinhole((1e39, 0, 0), (0, 0, 0), (0, 0, 1), 600, 640, 360))]
    formats.save(cameras_around, tmp_path / "some", "sidecar")
    before = counts(), scene.camera, scene.render.resolution_x
    with pytest.raises(RuntimeError, match=r"(?i)camera 'far'.*beyond Blender"):
        import_(tmp_path / "some", set_size=True)
    assert (counts(), scene.camera, scene.render.resolution_x) == before


@pytest.mark.parametrize("format", ["transforms", "colmap", "colmap_binary", "sidecar", "gltf", "opencv", "pbrt"])
def test_what_is_exported_is_imported_as_the_same_cameras(scene, add_camera, tmp_path, format):
    cameras_around = around(1 if format in ("opencv", "pbrt") else 3)
    if format == "gltf":  # it has no shift
        cameras_around = [
            Camera(each.name, Pinhole(each.pinhole.eye, (0, 0, 1), (0, 0, 1), 600, 640, 360)) for each in cameras_around
        ]
    scene.render.resolution_x, scene.render.resolution_y = 640, 360
    for camera in cameras_around:
        cameras.apply(add_camera(camera.name), camera.pinhole, scene)
    before = list(bpy.data.objects)
    path = tmp_path / "written"
    assert bpy.ops.viewcam.export_cameras(filepath=str(path), format=format, axes="y_up", scale=0.01) == {"FINISHED"}
    (written,) = tmp_path.iterdir()
    import_(written, axes="y_up", scale=0.01)
    objects = [each for each in bpy.data.objects if each not in before and each.type == "CAMERA"]
    assert len(objects) == len(cameras_around)
    for block, camera in zip(objects, cameras_around, strict=True):
        assert_same(cameras.read(block, scene), camera.pinhole)


def test_which_cameras_are_exported_is_chosen(scene, add_camera, tmp_path):
    for name in ("a", "b", "c"):
        add_camera(name)
    bpy.data.objects["a"].select_set(True)
    for which, names in (("SCENE", ["c"]), ("SELECTED", ["a"]), ("ALL", ["a", "b", "c"])):
        bpy.ops.viewcam.export_cameras(filepath=str(tmp_path / which), format="sidecar", which=which)
        assert sorted(file.stem for file in (tmp_path / which).iterdir()) == names
    bpy.data.objects["b"].data.type = "ORTHO"
    with pytest.raises(RuntimeError, match="'b' is orthographic"):
        bpy.ops.viewcam.export_cameras(filepath=str(tmp_path / "more"), format="sidecar")
    assert not (tmp_path / "more").exists()


def test_undo_takes_an_import_back_in_one_step(scene, tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    formats.save(around(3), tmp_path / "sparse", "colmap")
    bpy.ops.ed.undo_push(message="before")
    before = counts()
    import_(tmp_path / "sparse", set_size=True)
    bpy.ops.ed.undo_push(message="after")
    assert counts() != before
    bpy.ops.ed.undo()
    assert counts() == before and bpy.context.scene.render.resolution_x == 1920


def test_a_dropped_file_goes_to_the_import(registered_addon):
    handler = camera_files.VIEWCAM_FH_cameras
    assert handler.bl_import_operator == camera_files.VIEWCAM_OT_import_cameras.bl_idname
    assert all(re.fullmatch(r"\.\w+", suffix) for suffix in handler.bl_file_extensions.split(";"))
    assert not {".glb", ".gltf", ".usd"} & {*handler.bl_file_extensions.split(";")}


def test_a_photograph_is_shown_without_its_lens_and_fits_the_scene_to_its_corners(scene, tmp_path):
    """Known points, drawn as blobs where the lens shows them: in the background they lie where the pinhole has them."""
    lens = "640 360 500 510 310 190 -0.12 0.03 0.002 -0.003"
    (tmp_path / "cameras.txt").write_text(f"1 OPENCV {lens}\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 photo_0001.png\n\n")
    (camera,) = formats.read(tmp_path)
    pinhole = camera.pinhole
    column, row = (each.ravel() for each in np.meshgrid(np.linspace(25, 615, 7), np.linspace(25, 335, 5)))
    points = np.stack([(column - 310) / 500, (row - 190) / 510], axis=-1)
    places = camera.lens.distort(points) * [500, 510] + [310, 190]
    assert np.abs(places - np.stack([column, row], axis=-1)).max() > 5, "a lens that nobody sees"
    across, down = np.meshgrid(np.arange(640) + 0.5, np.arange(360) + 0.5)
    blobs = sum(np.exp(-((across - x) ** 2 + (down - y) ** 2) / 18) for x, y in places)
    image = bpy.data.images.new("made", 640, 360, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.repeat(blobs[::-1, :, None], 4, axis=2).astype(np.float32).ravel())
    image.filepath_raw, image.file_format = str(tmp_path / "photo_0001.exr"), "OPEN_EXR"
    image.save()
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 photo_0001.exr\n\n")
    assert import_(tmp_path, set_size=True) == {"FINISHED"}
    (block,) = bpy.data.collections[tmp_path.name].objects
    (background,) = block.data.background_images
    background_image = background.image
    width, height = background_image.size
    assert width / height == pytest.approx(640 / 360, rel=1e-4) and background_image.packed_file
    pixels = np.array(background_image.pixels[:]).reshape(height, width, 4)[::-1, :, 0]
    across, down = np.meshgrid((np.arange(width) + 0.5) * 640 / width, (np.arange(height) + 0.5) * 360 / height)
    errors = []
    for x, y in zip(column, row, strict=True):
        weight = pixels * (np.hypot(across - x, down - y) < 12)
        errors.append(math.hypot((weight * across).sum() / weight.sum() - x, (weight * down).sum() / weight.sum() - y))
    assert max(errors) < 0.1, f"{max(errors):.3f} pixels, of which the blobs' own distortion is a part"
    assert_same(cameras.read(block, scene), pinhole, ((0, 0, 4), (1, 2, 8), (-2, 1, 8)))


def test_a_photograph_of_another_size_than_its_lens_is_not_shown_and_told(scene, tmp_path, capfd):
    (tmp_path / "cameras.txt").write_text("1 SIMPLE_RADIAL 640 360 500 310 190 -0.1\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a.png\n\n")
    write_picture(tmp_path / "a.png")
    assert import_(tmp_path, set_size=True) == {"FINISHED"}
    (block,) = bpy.data.collections[tmp_path.name].objects
    assert not block.data.background_images
    assert "8 × 4" in capfd.readouterr().out
