import json
import math
import re
import struct
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon import cameras as formats
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import findings
from viewcam_addon.blender.interface import clipboard, file_menu
from viewcam_addon.blender.interface.camera_options import READING, ReadingOptions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.cameras import Camera, Options, distortion, naming
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import LedgerEntry, scene_file


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


def flight(tmp_path, names, lens=None):
    """A transforms.json of cameras with these pictures, imported as one that flies: its camera."""
    views = [replace(each, image=name, lens=lens) for each, name in zip(around(len(names)), names, strict=True)]
    formats.save(views, tmp_path / "transforms.json", "transforms")
    for name in names:
        write_picture(tmp_path / name)
    assert import_(tmp_path / "transforms.json", set_size=True, import_as="FLIGHT") == {"FINISHED"}
    return imported("transforms")[0]


@pytest.mark.parametrize(("first", "start"), [(7, 1), (0, 101), (1, 1)])
def test_a_flight_shows_the_picture_of_each_frame(scene, tmp_path, first, start):
    scene.frame_start = start
    names = [f"shot2_{number:04}.png" for number in range(first, first + 4)]
    (background,) = flight(tmp_path, names).data.background_images
    for i, name in enumerate(names):
        scene.frame_set(start + i)
        assert background.image.filepath_from_user(image_user=background.image_user).endswith(name)


@pytest.mark.parametrize(
    ("names", "lens", "sentence"),
    [
        (["a_1.png", "a_2.png", "a_4.png"], None, "do not go with the frames"),
        (["a_1.png", "b_2.png", "a_3.png"], None, "do not go with the frames"),
        (["a_9.png", "a_10.png", "a_11.png"], None, "do not go with the frames"),
        (["a.png", "b.png", "c.png"], None, "do not go with the frames"),
        (["a_1.png", "a_2.png", "a_3.png"], distortion.opencv({"k1": 0.1}), "viewcam camera --undistort"),
    ],
)
def test_pictures_that_a_flight_can_not_show_are_told(scene, tmp_path, capfd, names, lens, sentence):
    assert not flight(tmp_path, names, lens).data.background_images
    assert sentence in capfd.readouterr().out
    assert not [image for image in bpy.data.images if image.source == "SEQUENCE"] and not bpy.data.movieclips


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
    handler = file_menu.VIEWCAM_FH_cameras
    assert handler.bl_import_operator == file_menu.VIEWCAM_OT_import_cameras.bl_idname
    assert all(re.fullmatch(r"\.\w+", suffix) for suffix in handler.bl_file_extensions.split(";"))
    assert not {".glb", ".gltf", ".usd"} & {*handler.bl_file_extensions.split(";")}


@pytest.mark.parametrize("name", ["import_cameras", "export_cameras"])
def test_all_options_are_drawn_beside_the_browsers_files(registered_addon, name):
    drawn = []
    layout = SimpleNamespace(prop=lambda _owner, name: drawn.append(name))
    getattr(file_menu, f"VIEWCAM_OT_{name}").draw(SimpleNamespace(layout=layout), bpy.context)
    options = getattr(bpy.ops.viewcam, name).get_rna_type().properties
    assert {*drawn} == {each.identifier for each in options if not each.is_hidden} - {"rna_type", "filepath"}


COLUMNS, ROWS = (each.ravel() for each in np.meshgrid(np.linspace(25, 615, 7), np.linspace(25, 335, 5)))
"""Places in a picture of 640 × 360 at which known points are, from its upper left corner."""


def write_photographs(folder, names):
    """A COLMAP model of photographs with a lens, which show a blob of light at each of the points; its cameras.

    Each is brighter in green by a tenth than the one before.
    """
    (folder / "cameras.txt").write_text("1 OPENCV 640 360 500 510 310 190 -0.12 0.03 0.002 -0.003\n")
    lines = [f"{i} 1 0 0 0 {i} 0 0 1 {name}\n\n" for i, name in enumerate(names, 1)]
    (folder / "images.txt").write_text("".join(lines))
    lens = formats.read(folder)[0].lens
    points = np.stack([(COLUMNS - 310) / 500, (ROWS - 190) / 510], axis=-1)
    places = lens.distort(points) * [500, 510] + [310, 190]
    assert np.abs(places - np.stack([COLUMNS, ROWS], axis=-1)).max() > 5, "a lens that nobody sees"
    across, down = np.meshgrid(np.arange(640) + 0.5, np.arange(360) + 0.5)
    blobs = sum(np.exp(-((across - x) ** 2 + (down - y) ** 2) / 18) for x, y in places)
    for i, name in enumerate(names):
        image = bpy.data.images.new("made", 640, 360, float_buffer=True)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.repeat(blobs[::-1, :, None], 4, axis=2)
        pixels[..., 1], pixels[..., 3] = 0.1 * i, 1
        image.pixels.foreach_set(pixels.astype(np.float32).ravel())
        image.filepath_raw, image.file_format = str(folder / name), "OPEN_EXR"
        image.save()
        bpy.data.images.remove(image)
    return formats.read(folder)


def pixels_of(image):
    """The colors, rows from the top."""
    width, height = image.size
    return np.array(image.pixels[:]).reshape(height, width, 4)[::-1]


def worst_of_blobs(pixels):
    """The distance from its point of the blob that is farthest from it, in pixels of 640 × 360."""
    height, width = pixels.shape
    across, down = np.meshgrid((np.arange(width) + 0.5) * 640 / width, (np.arange(height) + 0.5) * 360 / height)
    errors = []
    for x, y in zip(COLUMNS, ROWS, strict=True):
        weight = pixels * (np.hypot(across - x, down - y) < 12)
        errors.append(math.hypot((weight * across).sum() / weight.sum() - x, (weight * down).sum() / weight.sum() - y))
    return max(errors)


def test_a_photograph_is_shown_without_its_lens_and_fits_the_scene_to_its_corners(scene, tmp_path):
    """Known points, drawn as blobs where the lens shows them: in the background they lie where the pinhole has them."""
    (camera,) = write_photographs(tmp_path, ["photo_0001.exr"])
    assert import_(tmp_path, set_size=True) == {"FINISHED"}
    (block,) = bpy.data.collections[tmp_path.name].objects
    (background,) = block.data.background_images
    width, height = background.image.size
    assert width / height == pytest.approx(640 / 360, rel=1e-4) and background.image.packed_file
    worst = worst_of_blobs(pixels_of(background.image)[..., 0])
    assert worst < 0.1, f"{worst:.3f} pixels, of which the blobs' own distortion is a part"
    assert_same(cameras.read(block, scene), camera.pinhole, ((0, 0, 4), (1, 2, 8), (-2, 1, 8)))


@pytest.fixture
def undistorted_frame(scene, tmp_path):
    """A function of a movie clip and a frame: the colors that a strip of it shows, undistorted as behind a camera."""

    def frame_of(clip, number):
        editor = scene.sequence_editor_create()
        strips = editor.strips if hasattr(editor, "strips") else editor.sequences
        for strip in list(strips):
            strips.remove(strip)
        strips.new_clip("clip", clip, 1, clip.frame_start).undistort = True
        scene.frame_set(number)
        scene.view_settings.view_transform, scene.render.image_settings.file_format = "Raw", "OPEN_EXR"
        scene.render.filepath = str(tmp_path / f"shown_{number}.exr")
        bpy.ops.render.render(write_still=True)
        return pixels_of(bpy.data.images.load(scene.render.filepath))

    return frame_of


def test_a_flight_shows_the_photograph_of_each_frame_without_its_lens(scene, tmp_path, undistorted_frame):
    write_photographs(tmp_path, [f"photo_{number:04}.exr" for number in (7, 8, 9)])
    scene.frame_start = 101
    assert import_(tmp_path, set_size=True, import_as="FLIGHT") == {"FINISHED"}
    (block,) = imported(tmp_path.name)
    (background,) = block.data.background_images
    assert background.source == "MOVIE_CLIP" and background.clip_user.use_render_undistorted
    assert block.data.show_background_images and background.clip.frame_start == 101
    greens = []
    for frame in (101, 103):
        pixels = undistorted_frame(background.clip, frame)
        worst = worst_of_blobs(pixels[..., 0])
        assert worst < 0.1, f"{worst:.3f} pixels, of which Blender's own 0.04 are a part"
        greens.append(pixels[180, 320, 1])
    assert greens[0] < 0.01 and greens[1] > 0.1
    background.clip.tracking.camera.brown_p1 *= -1
    clip = background.clip.copy()  # the other's frames are kept
    assert worst_of_blobs(undistorted_frame(clip, 101)[..., 0]) > 0.1


@pytest.mark.parametrize(
    "other", ["OPENCV_FISHEYE 640 360 500 510 310 190 0.1 0 0 0", "OPENCV 640 360 501 510 310 190 -0.1 0 0 0"]
)
def test_a_flight_whose_lens_blender_has_not_is_told(scene, tmp_path, capfd, other):
    names = [f"photo_{number:04}.exr" for number in (7, 8)]
    write_photographs(tmp_path, names)
    lens = "1 OPENCV 640 360 500 510 310 190 -0.1 0 0 0\n"
    (tmp_path / "cameras.txt").write_text(lens + f"2 {other}\n")
    (tmp_path / "images.txt").write_text("".join(f"{i} 1 0 0 0 {i} 0 0 {3 - i} {name}\n\n" for i, name in enumerate(names, 1)))
    assert import_(tmp_path, set_size=True, import_as="FLIGHT") == {"FINISHED"}
    assert not imported(tmp_path.name)[0].data.background_images and not bpy.data.movieclips
    assert "viewcam camera --undistort" in capfd.readouterr().out


@pytest.mark.parametrize("import_as", ["EACH", "FLIGHT"])
def test_a_photograph_of_another_size_than_its_lens_is_not_shown_and_told(scene, tmp_path, capfd, import_as):
    (tmp_path / "cameras.txt").write_text("1 SIMPLE_RADIAL 640 360 500 310 190 -0.1\n")
    (tmp_path / "images.txt").write_text("1 1 0 0 0 0 0 0 1 a_1.png\n\n")
    write_picture(tmp_path / "a_1.png")
    assert import_(tmp_path, set_size=True, import_as=import_as) == {"FINISHED"}
    (block,) = imported(tmp_path.name)
    assert not block.data.background_images and not bpy.data.movieclips
    assert "8 × 4" in capfd.readouterr().out


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


def paste(text, **options):
    return bpy.ops.viewcam.paste_camera(text=text, **options)


def values(camera_object):
    eye, look_at, up, distance = camera_object.virtual_pinhole.numbers()
    return (*eye, *look_at, *up, distance)


def everything(camera_object):
    """All that copying and pasting could change, bit for bit."""
    group, data = camera_object.virtual_pinhole, camera_object.data
    lens = (data.lens, data.shift_x, data.shift_y, data.sensor_width, data.sensor_height)
    pose = (*camera_object.location, *camera_object.rotation_euler, *camera_object.scale)
    return (group.enabled, *values(camera_object), *pose, *lens)


def test_a_pasted_camera_stands_where_the_text_says(posed_camera, scene):
    assert paste("eye=(1, 2, 3) look_at=(4, 5, 6) up=(0, 1, 0) d=900") == {"FINISHED"}
    assert values(posed_camera) == (1, 2, 3, 4, 5, 6, 0, 1, 0, 900)
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


def test_what_the_text_does_not_say_stays(posed_camera):
    paste("look_at=(0, 0, 2)")
    assert values(posed_camera) == (7, -6, 5, 0, 0, 2, 0, 0, 1, 1500)


def test_copy_and_paste_bring_every_bit_to_another_camera(posed_camera, add_camera, scene):
    paste("eye=0.1,0.2,0.3333333333333333 look_at=1e-3,-7,1e5 up=0.1,0.1,1 d=1234.5678901234567")
    text = clipboard.text_of(posed_camera, scene)
    other = add_camera("Other")
    paste(text, camera="Other")
    assert (
        values(other) == values(posed_camera) == (0.1, 0.2, 0.3333333333333333, 1e-3, -7, 1e5, 0.1, 0.1, 1, 1234.5678901234567)
    )
    assert clipboard.text_of(other, scene) == text


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.floats(-1e4, 1e4), min_size=9, max_size=9),
    st.floats(1, 1e5),
    st.sampled_from([100, 50, 33]),
    st.sampled_from([(1, 1), (2, 1), (1, 1.5)]),
)
def test_what_is_pasted_is_what_is_copied_at_any_percentage_and_pixel_aspect(
    posed_camera, scene, pose, distance, percent, aspect
):
    scene.render.resolution_percentage = percent
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    text = json.dumps({"eye": pose[0:3], "look_at": pose[3:6], "up": pose[6:9], "distance": distance})
    try:
        paste(text)
    except RuntimeError as error:  # eye = look-at, up = 0
        assert "same point" in str(error) or "up is" in str(error).lower() or "Up is" in str(error)
        return
    copied = json.loads(clipboard.text_of(posed_camera, scene))
    assert [*copied["eye"], *copied["look_at"], *copied["up"]] == pose
    # To the picture's size and back: two products of one rounding each, and those of their factors.
    assert np.ravel(copied["distance"])[0] == pytest.approx(distance, rel=0 if percent == 100 else 4 * 2.0**-53, abs=0)


def test_pasting_enables_a_camera_and_takes_the_rest_from_how_it_stands(camera_object, scene):
    camera_object.location, camera_object.rotation_euler = (0, -5, 1), (math.pi / 2, 0, 0)
    bpy.context.view_layer.update()
    before = cameras.read(camera_object, scene)
    paste("eye=(0, -9, 1)")
    group = camera_object.virtual_pinhole
    assert group.enabled and tuple(group.eye) == (0, -9, 1)
    # The new camera's plane of focus, 10 m before it, is what it keeps looking at.
    assert group.look_at[:] == pytest.approx((0, 5, 1), abs=1e-5)
    after = cameras.read(camera_object, scene)
    assert after.distance == before.distance
    assert np.subtract(after.basis(), before.basis()) == pytest.approx(0, abs=findings.LARGEST_TURN)


def test_copying_a_camera_that_is_not_in_use_changes_nothing(camera_object, scene):
    camera_object.location = (1, 2, 3)
    bpy.context.view_layer.update()
    before = everything(camera_object)
    copied = json.loads(clipboard.text_of(camera_object, scene))
    assert copied["eye"] == [1, 2, 3] and copied["look_at"] == [1, 2, -7]
    assert everything(camera_object) == before


def test_copying_says_what_it_copied(posed_camera, capfd):
    assert bpy.ops.viewcam.copy_camera() == {"FINISHED"}
    output = capfd.readouterr().out.split("Copied ", 1)[1].splitlines()[0]
    values = {"eye": [7, -6, 5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 1500}
    assert json.loads(output) == values | {"width": 1920, "height": 1080}


def test_a_held_roll_is_copied_as_the_up_of_the_same_picture(posed_camera, add_camera, scene):
    group = posed_camera.virtual_pinhole
    group.pole, group.held_roll = "HOLD", 0.3
    before = cameras.stated(posed_camera, scene)
    other = add_camera("Other")
    paste(clipboard.text_of(posed_camera, scene), camera="Other")
    after = cameras.stated(other, scene)
    assert np.subtract(after.basis(), before.basis()) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ('Scale -1 1 1 LookAt 7 -6 5 0 0 1 0 0 1 Camera "perspective" "float fov" 40', 1),
        ("look_at(origin=[7, -6, 5], target=[0, 0, 1], up=[0, 0, 1]), 'fov': 40, 'fov_axis': 'x'", 0),
        ("fov=40 axis=diagonal", 2),
    ],
)
@pytest.mark.parametrize("aspect", [(1, 1), (2, 1)])
def test_a_pasted_field_of_view_is_that_of_blenders_camera(posed_camera, scene, text, side, aspect):
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    scene.render.resolution_percentage = 50
    paste(text)
    # The lens is stored in float32, its sensor and the pixel aspect as well.
    assert math.degrees(cameras.read(posed_camera, scene).field_of_view()[side]) == pytest.approx(40, rel=4 * 2.0**-24)


def test_what_a_reader_should_know_is_a_warning(posed_camera, capfd):
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    paste("LookAt 1 2 3 4 5 6 0 0 1")
    printed = capfd.readouterr().out
    assert "pbrt sees with left-handed axes" in printed and "driver" in printed
    assert "Pasted eye, look-at, mirror on Camera" in printed


SHIFTED = '{"eye": [7, -6, 5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 600, "width": 640, "height": 360, '
SHIFTED += '"principal_point": [300, 200], "mirrored": true}'


def test_a_pasted_camera_replaces_shift_and_mirror_of_the_old_one(posed_camera, scene):
    paste(SHIFTED)
    pinhole = cameras.read(posed_camera, scene)
    # The scene's picture is three times as large; lens and shift are float32.
    assert pinhole.mirrored and pinhole.principal_point == pytest.approx((900, 600), abs=1e-3)
    assert pinhole.distance == pytest.approx((1800, 1800), rel=2.0**-22)
    paste("eye=7,-6,5 look_at=0,0,1 up=0,0,1 d=900")
    pinhole = cameras.read(posed_camera, scene)
    assert not pinhole.mirrored and pinhole.principal_point == (960, 540)


def test_a_paste_can_leave_the_mirror_and_set_the_scenes_size(posed_camera, scene, capfd):
    paste(SHIFTED.replace('"height": 360', '"height": 480'))
    assert "The camera is for 640 × 480 pixels and the scene renders 1920 × 1080" in capfd.readouterr().out
    paste(SHIFTED.replace('"distance": 600', '"distance": [600, 450]'), set_size=True, unmirrored=True)
    pinhole = cameras.read(posed_camera, scene)
    assert (pinhole.width, pinhole.height, pinhole.mirrored) == (640, 360, False)
    assert pinhole.distance == pytest.approx((600, 450), rel=2.0**-22)
    assert pinhole.principal_point == pytest.approx((340, 200), abs=1e-3)


def test_a_text_with_several_cameras_asks_which(posed_camera):
    sensor = '<sensor type="perspective" id="{}"><transform name="to_world"><lookat origin="{},0,0" target="0,0,1" up="0,0,1"/>'
    text = "".join(sensor.format(*each) + "</transform></sensor>" for each in (("left", 1), ("right", 2)))
    with pytest.raises(RuntimeError, match="name one of 'left', 'right'"):
        paste(f"<scene>{text}</scene>")
    paste(f"<scene>{text}</scene>", named="right")
    assert tuple(posed_camera.virtual_pinhole.eye) == (2, 0, 0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "There is no text"),
        ("hello", "no camera that is understood, from its beginning 'hello' on"),
        ("eye=0,0,1", "same point"),
        ("up=0,0,0", "(?i)up is"),
        ("eye=1e200,0,0", "beyond Blender's numbers"),
        ("d=1e-300", "too small for Blender's numbers"),
    ],
)
def test_what_can_not_be_pasted_is_one_sentence_and_changes_nothing(posed_camera, text, sentence):
    before = everything(posed_camera)
    with pytest.raises(RuntimeError, match=sentence) as error:
        paste(text)
    assert everything(posed_camera) == before
    assert "Traceback" not in str(error.value)


def test_pasting_on_values_that_make_no_camera_heals_them(posed_camera):
    posed_camera.virtual_pinhole.look_at = posed_camera.virtual_pinhole.eye
    paste("look_at=0,0,1")
    assert tuple(posed_camera.virtual_pinhole.look_at) == (0, 0, 1)


def test_an_orthographic_camera_is_refused_by_name(camera_object):
    camera_object.data.type = "ORTHO"
    before = everything(camera_object)
    for call in (lambda: paste("eye=1,2,3"), bpy.ops.viewcam.copy_camera):
        with pytest.raises(RuntimeError, match="'Camera' is orthographic"):
            call()
    assert everything(camera_object) == before


THREE_JS = "const camera = new THREE.PerspectiveCamera(40, 16/9); camera.position.set(7, 3, 6); camera.lookAt(0, 1, 0);"


def test_after_a_text_in_which_y_is_up_the_answer_beside_paste_is_named_and_turns_it_upright(posed_camera, capfd):
    assert bpy.ops.viewcam.paste_camera(text=THREE_JS) == {"FINISHED"}
    assert tuple(posed_camera.virtual_pinhole.up) == (0, 1, 0)
    assert "Paste Upright" in capfd.readouterr().out
    posed_camera.virtual_pinhole.up = (0, 0, 1)
    assert bpy.ops.viewcam.paste_camera(text=THREE_JS, axes="y_up") == {"FINISHED"}
    group = posed_camera.virtual_pinhole
    assert (tuple(group.eye), tuple(group.look_at), tuple(group.up)) == ((7, -6, 3), (0, 0, 1), (0, 0, 1))
    assert "Paste Upright" not in capfd.readouterr().out


def test_a_camera_of_ours_whose_up_is_y_is_pasted_without_a_word_about_it(posed_camera, capfd):
    assert bpy.ops.viewcam.paste_camera(text="eye=(0, 0, 9) look_at=(0, 0, 0) up=(0, 1, 0) d=900") == {"FINISHED"}
    assert "Paste Upright" not in capfd.readouterr().out


class Asking(ReadingOptions):
    """Paste as it is invoked by a click, with nothing chosen yet."""

    invoke, draw, _cameras_of = (vars(clipboard.VIEWCAM_OT_paste_camera)[name] for name in ("invoke", "draw", "_cameras_of"))
    camera, named = "Camera", ""
    axes, scale, unmirrored, without_distortion = "as_is", 1.0, False, False
    up_from = angle_unit = pixel = pose = "UNSTATED"

    def __init__(self, text):
        self.text, self.drawn = text, []
        self.layout = SimpleNamespace(prop=lambda _, name: self.drawn.append(name), label=self._labeled, separator=lambda: None)

    def _labeled(self, text, **_look):
        self.drawn.append(text)

    def click(self):
        """Click it; "asks" where it shows a dialog, else "pastes"."""
        self.execute = lambda _context: {"FINISHED"}
        dialog = SimpleNamespace(invoke_props_dialog=lambda *_, **__: {"RUNNING_MODAL"})
        context = SimpleNamespace(window_manager=dialog)
        (outcome,) = self.invoke(context, None)
        return {"RUNNING_MODAL": "asks", "FINISHED": "pastes"}[outcome]


def matrices_of(pinhole):
    """(4, 4) of a camera that is not mirrored, in each of formats.POSES: by whose axes, and from where to where."""
    u, v, w = pinhole.basis()
    matrices = {}
    for whose, axes in {"opencv": (u, -v, -w), "opengl": (u, v, w)}.items():
        to_world = np.eye(4)
        to_world[:3] = np.column_stack([*axes, pinhole.eye])
        matrices |= {f"c2w_{whose}": to_world, f"w2c_{whose}": np.linalg.inv(to_world)}
    return matrices


UNSAID = Pinhole((7, -6, 5), (1, 2, 0.5), (0.1, 0.2, 1), 1500, 1920, 1080)


def with_matrix(matrix, name="pose"):
    return f"K = [[1500, 0, 959.5], [0, 1500, 539.5], [0, 0, 1]]\n{name} = {matrix.tolist()}"


def is_unsaid(camera_object, scene):
    """True if the camera is UNSAID."""
    read = cameras.read(camera_object, scene)
    apart = [np.subtract(read.eye, UNSAID.eye), *np.subtract(read.basis(), UNSAID.basis())]
    return np.abs(apart).max() < 16 * 2.0**-24


def test_paste_asks_which_way_a_matrix_goes_first_and_has_no_answer_of_its_own(posed_camera):
    asking = Asking(with_matrix(matrices_of(UNSAID)["c2w_opencv"]))
    assert asking.click() == "asks"
    asking.draw(bpy.context)
    answer = asking.drawn.index("pose")
    question = " ".join(asking.drawn[:answer])
    assert "pose" in question and "which way it goes is not said" in question and "--" not in question, asking.drawn
    assert asking.drawn.count("pose") == 1 and not set(READING) & set(asking.drawn[:answer])
    pose = bpy.ops.viewcam.paste_camera.get_rna_type().properties["pose"]
    assert pose.default == "UNSTATED" and pose.is_skip_save, "an answer is a guess for the next text"


def test_a_question_of_paste_that_is_not_answered_changes_nothing(posed_camera):
    before = everything(posed_camera)
    for matrix in matrices_of(UNSAID).values():
        with pytest.raises(RuntimeError, match="which way it goes is not said"):
            paste(with_matrix(matrix))
    assert everything(posed_camera) == before


@pytest.mark.parametrize("way", formats.POSES)
def test_each_answer_of_paste_takes_the_matrix_as_its_words_say(posed_camera, scene, way):
    """An answer that stood for another would give one of the others' cameras, and all four are different."""
    label = bpy.ops.viewcam.paste_camera.get_rna_type().properties["pose"].enum_items[way].name
    goes, whose = way.split("_")
    assert label.startswith({"w2c": "World to Camera", "c2w": "Camera to World"}[goes])
    assert label.endswith({"opencv": "OpenCV's Axes", "opengl": "OpenGL's Axes"}[whose])
    for written, matrix in matrices_of(UNSAID).items():
        asking = Asking(with_matrix(matrix))
        asking.pose = way
        assert asking.click() == "pastes", "it is answered"
        assert paste(with_matrix(matrix), pose=way) == {"FINISHED"}
        assert is_unsaid(posed_camera, scene) == (written == way), f"{written}, taken as {way}"


def test_a_matrix_whose_name_says_which_way_it_goes_is_pasted_without_a_question(posed_camera, scene):
    for name, way in (("w2c", "w2c_opencv"), ("extrinsic", "w2c_opencv"), ("matrix_world", "c2w_opengl")):
        text = with_matrix(matrices_of(UNSAID)[way], name)
        assert Asking(text).click() == "pastes", name
        paste(text)
        assert is_unsaid(posed_camera, scene), name


def test_of_several_cameras_that_are_not_known_paste_asks_the_way_and_which_at_once(posed_camera, scene):
    matrices = matrices_of(UNSAID)["c2w_opencv"], np.eye(4)
    text = json.dumps(
        {
            f"cam{i}": {"K": [[1500, 0, 960], [0, 1500, 540], [0, 0, 1]], "pose": each.tolist()}
            for i, each in enumerate(matrices)
        }
    )
    asking = Asking(text)
    assert asking.click() == "asks" and asking.names == ["cam0", "cam1"]
    asking.draw(bpy.context)
    assert [name for name in asking.drawn if name in ("pose", "named", "axes")] == ["pose", "named", "axes"], asking.drawn
    assert paste(text, pose="c2w_opencv", named="cam0") == {"FINISHED"}
    assert is_unsaid(posed_camera, scene)


def test_undo_takes_a_pasted_camera_back(camera_object):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    before = everything(camera_object)
    paste("eye=1,2,3 look_at=4,5,6 d=900")
    bpy.ops.ed.undo_push(message="after")
    assert everything(bpy.data.objects["Camera"]) != before
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Camera"]) == before


def test_without_a_camera_both_are_off(fresh_blender):
    assert not bpy.ops.viewcam.copy_camera.poll()
    assert not bpy.ops.viewcam.paste_camera.poll()


# ROS says no pose, and USD is read where OpenUSD is.
BOTH_WAYS = sorted({name for name, *_ in clipboard._writable()} & {*formats.readable()} - {"ros", "usd"})


@pytest.mark.parametrize("format", BOTH_WAYS)
def test_what_is_copied_as_any_format_is_the_same_camera_when_it_is_pasted(posed_camera, add_camera, scene, format):
    before = cameras.read(posed_camera, scene)
    text = clipboard.text_of(posed_camera, scene, format, formats.Options(axes="y_up", scale=0.5))
    other = add_camera("Other")
    paste(text, camera="Other", axes="y_up", scale=0.5)
    after = cameras.read(other, scene)
    # Both are float32 in Blender.
    assert np.subtract(after.basis(), before.basis()) == pytest.approx(0, abs=findings.LARGEST_TURN)
    assert np.subtract(after.eye, before.eye) == pytest.approx(0, abs=2.0**-20)
    assert np.divide(after.distance, before.distance) == pytest.approx(1, rel=2.0**-20)


def test_copying_in_a_format_names_it_and_leaves_the_scene_alone(posed_camera, capfd):
    before = everything(posed_camera)
    assert bpy.ops.viewcam.copy_camera(format="pbrt", axes="y_up") == {"FINISHED"}
    assert "Copied Camera as pbrt scene, axes y_up, scale 1" in capfd.readouterr().out
    assert everything(posed_camera) == before


def test_what_a_format_can_not_say_is_one_sentence(posed_camera):
    posed_camera.scale[0] = -1
    with pytest.raises(RuntimeError, match="mirrored") as error:
        bpy.ops.viewcam.copy_camera(format="transforms")
    assert "Traceback" not in str(error.value)


def test_pixels_of_another_aspect_are_told_and_set_if_that_is_asked_for(posed_camera, scene, capfd):
    text = SHIFTED.replace('"distance": 600', '"distance": [600, 450]').replace("640", "1920").replace("360", "1080")
    paste(text)
    message = "The camera is for 1920 × 1080 pixels of aspect 0.75 and the scene renders 1920 × 1080 of aspect 1"
    assert message in capfd.readouterr().out
    assert cameras.read(posed_camera, scene).distance == pytest.approx((600, 600), rel=2.0**-22)
    paste(text, set_size=True)
    assert message not in capfd.readouterr().out
    assert scene.render.pixel_aspect_y / scene.render.pixel_aspect_x == pytest.approx(4 / 3, rel=2.0**-23)
    assert cameras.read(posed_camera, scene).distance == pytest.approx((600, 450), rel=2.0**-22)


def test_a_size_beyond_blenders_is_refused_and_the_scenes_stays(posed_camera, scene):
    with pytest.raises(RuntimeError, match="camera's picture is 3 × 360 pixels and Blender's are 4 to 65536"):
        paste(SHIFTED.replace('"width": 640', '"width": 3'), set_size=True)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (1920, 1080)


def test_no_shift_is_told_of_where_a_principal_point_is_rounded(posed_camera, capfd):
    paste(
        'Film "rgb" "integer xresolution" [800] "integer yresolution" [600] LookAt 4 -6 3.5 0 0 1 0 0 1 '
        'Scale -1 1 1 Camera "perspective" "float fov" [40]'
    )
    assert "shift on Camera" not in capfd.readouterr().out


USD_HEADS = [
    "",
    'metersPerUnit = 0.01\n upAxis = "Z"',
    'metersPerUnit = 1\n upAxis = "Y"',
    'metersPerUnit = 0.0254\n upAxis = "Y"',
]
USD_STAGE = """#usda 1.0
( {} )
def Xform "root"
{{
    double3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    def Camera "Cam"
    {{
        float focalLength = 74.98
        float horizontalAperture = 36
        float verticalAperture = 20.25
        float3 xformOp:rotateZYX = (133.97, 98.04, -134.99)
        double3 xformOp:translate = (1.5, -2.25, 0.75)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZYX"]
    }}
}}
"""


@pytest.mark.parametrize("head", USD_HEADS)
@pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="Blender's importer takes the unit since 4.5")
def test_a_usd_s_camera_stands_where_blenders_importer_puts_it(tmp_path, head):
    """By the stage's unit and up axis."""
    pytest.importorskip("pxr")
    (tmp_path / "a.usda").write_text(USD_STAGE.format(head))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "a.usda"))
    (imported,) = (each for each in bpy.data.objects if each.type == "CAMERA")
    (camera,) = formats.read(tmp_path / "a.usda", options=Options(size=(640, 360)))
    matrix = np.array(imported.matrix_world)
    away = np.abs(matrix[:3, 3]).max()
    assert np.abs(matrix[:3, 3] - camera.pinhole.eye).max() < 8 * 2**-24 * away  # a chain of float32 matrices
    turn = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    assert np.abs(turn.T - np.array(camera.pinhole.axes())).max() < 8 * 2**-24
