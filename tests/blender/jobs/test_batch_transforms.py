"""Datasets end to end: small shining balls are found in a batch's pictures where its transforms.json and COLMAP text say.

The readers here are written from those formats' own pages and share nothing with viewcam_addon.cameras.

A batch through a calibrated lens: a board's corners are in its pictures where OpenCV projects them, and back undistorted.
"""

import json
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import child_process, cli

pytestmark = pytest.mark.slow


RADIUS = 0.09
BALLS = {
    (1, 0, 0): (1.1, 0.1, 0.3),
    (0, 1, 0): (-0.8, 0.9, 0.8),
    (0, 0, 1): (0.2, -1.0, -0.7),
    (1, 1, 0): (-0.3, -0.6, 1.2),
    (0, 1, 1): (-0.6, 0.3, -1.1),
}
"""Color → center. The places are symmetric in nothing, and no ball hides another in any of the views."""

SHOTS = [
    {"name": "front", "eye": [0.5, -6, 1], "look_at": [0, 0, 0], "up": [0, 0, 1], "d": 190},
    {"name": "rolled", "eye": [5, 3, -1], "look_at": [0.1, 0, 0], "up": [0.4, 0.2, 1], "d": 210},
    {"name": "above", "eye": [0, 0, 6], "look_at": [0, 0, 0], "up": [0, 0, 1], "d": 200},
    {"name": "wide", "eye": [-2, 4, 2], "look_at": [0, 0, 0], "up": [0, 0, 1], "d": 120, "width": 192, "height": 120},
    {"name": "shifted", "camera": "Shifted"},
]
CLOSE = 0.1
"""Pixels. A ball of 2 pixels' radius has some 13 pixels on its rim, whose coverage 64 samples tell to 0.06. That moves its
center of weight by 2 · √13 · 0.06 / (π 2²) = 0.04 pixels, and twice as much, rounded up, is allowed."""


@pytest.fixture
def stage(fresh_blender, scene, tmp_path):
    """A file of shining balls in the dark, and a camera whose lens is shifted both ways; its path."""
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.cycles.pixel_filter_type = "BOX"
    scene.virtual_pinhole_reference.samples = 64
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    scene.render.image_settings.color_mode = "RGB"
    for color, center in BALLS.items():
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=RADIUS, location=center)
        bpy.context.object.data.materials.append(_shining(color))
    data = bpy.data.cameras.new("Shifted")
    data.lens, data.shift_x, data.shift_y = 36, 0.11, -0.07
    scene.camera = bpy.data.objects.new("Shifted", data)
    scene.collection.objects.link(scene.camera)
    scene.camera.location, scene.camera.rotation_euler = (-0.5, -6.5, 0.4), (1.52, 0.1, -0.03)

    def save(aspect=(1, 1)):
        scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "balls.blend"))
        return tmp_path / "balls.blend"

    return save


def _shining(color):
    material = bpy.data.materials.new("Shining")
    if not material.node_tree:  # new materials have one from 5.0 on
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shining, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
    shining.inputs["Color"].default_value = (*color, 1)
    links.new(shining.outputs[0], output.inputs["Surface"])
    return material


@pytest.fixture
def batch(tmp_path):
    """batch(blend, shots, *words) runs `viewcam batch` into tmp_path/out: its exit status."""

    def run(blend, shots, *words):
        listed = tmp_path / "shots.json"
        listed.write_text(json.dumps(shots))
        return cli.main(["batch", str(blend), str(listed), "--out", str(tmp_path / "out"), *words])

    return run


@dataclass(frozen=True)
class Camera:
    """A camera of either format, brought to x right, y down, z into the view."""

    to_camera: np.ndarray
    f: tuple[float, float]
    c: tuple[float, float]
    size: tuple[int, int]

    def project(self, points):
        """(n, 3) world space to (n, 2) column and row, from the top left."""
        x, y, z = self.to_camera[:, :3] @ np.transpose(points) + self.to_camera[:, 3:]
        return np.stack([self.f[0] * x / z + self.c[0], self.f[1] * y / z + self.c[1]], axis=-1)


def read_transforms(folder):
    """Picture → Camera. OpenGL's camera looks along −z and has y upwards."""
    document = json.loads((folder / "transforms.json").read_text())
    cameras = {}
    for frame in document["frames"]:
        values = document | frame
        to_camera = np.diag([1.0, -1.0, -1.0, 1.0]) @ np.linalg.inv(values["transform_matrix"])
        f, c, size = (values["fl_x"], values["fl_y"]), (values["cx"], values["cy"]), (values["w"], values["h"])
        cameras[values["file_path"]] = Camera(to_camera[:3], f, c, size)
    return cameras


def read_colmap(folder):
    """Picture → Camera."""
    lines = {
        name: [line for line in (folder / "sparse" / "0" / f"{name}.txt").read_text().split("\n") if line[:1] != "#"]
        for name in ("cameras", "images")
    }
    lenses = {}
    for line in filter(None, lines["cameras"]):
        number, model, width, height, *parameters = line.split(" ")
        assert model == "PINHOLE"
        f_x, f_y, *c = map(float, parameters)
        lenses[number] = (f_x, f_y), tuple(c), (int(width), int(height))
    cameras = {}
    for line in lines["images"][0::2]:
        if not line:
            continue
        _, *pose, number, name = line.split(" ")
        w, *xyz = map(float, pose[:4])
        cross = np.cross(xyz, np.eye(3)).T
        turn = np.eye(3) + 2 * w * cross + 2 * cross @ cross
        cameras[name] = Camera(np.column_stack([turn, [*map(float, pose[4:])]]), *lenses[number])
    return cameras


def look(path):
    """(height, width, 3) linear light of a picture, rows from the top."""
    if path.suffix == ".exr":
        # Never in this process, which has Blender's own copy of the library.
        program = (
            "import numpy, OpenEXR, sys\n"
            "for part in OpenEXR.File(sys.argv[1], separate_channels=True).parts:\n"
            "    for name, channel in part.channels.items():\n"
            "        if '.Combined.' in name:\n"
            "            numpy.save(sys.argv[2] + name[-1], channel.pixels)\n"
        )
        stem = str(path.with_suffix(""))
        subprocess.run([sys.executable, "-c", program, str(path), stem], check=True, env=child_process.environment())
        return np.stack([np.load(f"{stem}{letter}.npy") for letter in "RGB"], axis=-1)
    picture = bpy.data.images.load(str(path))
    picture.colorspace_settings.name = "Non-Color"
    (width, height), flat = picture.size, np.empty(picture.size[0] * picture.size[1] * picture.channels, np.float32)
    picture.pixels.foreach_get(flat)
    pixels = flat.reshape(height, width, -1)[::-1, :, :3].astype(float)
    bpy.data.images.remove(picture)
    return np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)


def ball_centers(picture):
    """(n, 2) centers of weight of the balls, in the order of BALLS: column and row, pixel centers at + 0.5."""
    height, width, _ = picture.shape
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    light = picture.max(axis=-1)
    shining = picture / np.maximum(light, 1e-3)[..., None] > 0.5
    places = []
    for color in BALLS:
        weight = np.where((shining == np.array(color, bool)).all(axis=-1), light, 0.0)
        assert weight.sum() > 5, f"the ball {color} can't be seen: the view tests nothing"
        places.append([np.average(axis, weights=weight) for axis in (columns, rows)])
    return np.array(places)


def beside(camera):
    """(n,) pixels from the image of each ball's center to the center of its outline.

    Under the angle θ to the axis a ball of the angular radius α spans tan(θ − α) to tan(θ + α), so that the middle is at
    sin 2θ / (cos 2θ + cos 2α).
    """
    x, y, z = camera.to_camera[:, :3] @ np.transpose([*BALLS.values()]) + camera.to_camera[:, 3:]
    theta, alpha = np.arctan2(np.hypot(x, y), z), np.arcsin(RADIUS / np.sqrt(x * x + y * y + z * z))
    return max(camera.f) * np.abs(np.sin(2 * theta) / (np.cos(2 * theta) + np.cos(2 * alpha)) - np.tan(theta))


def hold(cameras, pictures):
    """Fail unless the balls are where the cameras say, in all of the pictures (name → picture)."""
    assert cameras.keys() == pictures.keys()
    for name, camera in cameras.items():
        height, width, _ = pictures[name].shape
        assert camera.size == (width, height), f"{name} has {width} × {height} pixels and not {camera.size}"
        miss = np.linalg.norm(camera.project([*BALLS.values()]) - ball_centers(pictures[name]), axis=-1)
        worst = int(np.argmax(miss - beside(camera)))
        assert (miss <= CLOSE + beside(camera)).all(), f"{name}: {[*BALLS][worst]} is {miss[worst]:.2f} pixels off"


def looked_at(folder, names):
    return {name: look(folder / name) for name in names}


@pytest.mark.parametrize(
    ("engine", "suffix", "aspect"),
    [("CYCLES", "png", (1, 1)), ("CYCLES", "exr", (1, 1.5)), ("VIEWCAM", "exr", (1, 1)), ("VIEWCAM", "png", (1.2, 1))],
)
def test_the_balls_are_in_the_pictures_where_both_formats_say(stage, batch, tmp_path, engine, suffix, aspect):
    assert batch(stage(aspect), SHOTS, "--engine", engine, "--transforms", suffix) == 0
    names = [f"{shot['name']}.{suffix}" for shot in SHOTS]
    pictures = looked_at(tmp_path / "out", names)
    for read in (read_transforms, read_colmap):
        cameras = read(tmp_path / "out")
        assert [*cameras] == names
        hold(cameras, pictures)


# Faults of a camera's numbers or of the reading of the pictures: each must be seen.
FAULTS = {
    "half a pixel to the right": lambda camera: {"c": (camera.c[0] + 0.5, camera.c[1])},
    "half a pixel downwards": lambda camera: {"c": (camera.c[0], camera.c[1] + 0.5)},
    "corners for centers": lambda camera: {"c": (camera.c[0] - 0.5, camera.c[1] - 0.5)},
    "1 % more distance": lambda camera: {"f": (camera.f[0] * 1.01, camera.f[1] * 1.01)},
    "x the other way": lambda camera: {"to_camera": camera.to_camera * [[-1], [1], [1]]},
    "y the other way": lambda camera: {"to_camera": camera.to_camera * [[1], [-1], [1]]},
    "z the other way": lambda camera: {"to_camera": camera.to_camera * [[1], [1], [-1]]},
    "OpenGL's axes for computer vision's": lambda camera: {"to_camera": camera.to_camera * [[1], [-1], [-1]]},
    "the world's y up": lambda camera: {"to_camera": camera.to_camera[:, [0, 2, 1, 3]]},
    "the rotation's inverse": lambda camera: {
        "to_camera": np.column_stack([camera.to_camera[:, :3].T, camera.to_camera[:, 3]])
    },
}


def test_every_fault_between_file_and_picture_is_seen(stage, batch, tmp_path):
    assert batch(stage(), SHOTS[1:2], "--engine", "VIEWCAM", "--transforms") == 0
    cameras = read_colmap(tmp_path / "out")
    pictures = looked_at(tmp_path / "out", cameras)
    hold(cameras, pictures)
    for fault, change in FAULTS.items():
        wrong = {name: Camera(**vars(camera) | change(camera)) for name, camera in cameras.items()}
        with pytest.raises(AssertionError, match="pixels off"):
            hold(wrong, pictures)
            pytest.fail(f"{fault} is not seen")
    for flip in (np.s_[::-1], np.s_[:, ::-1]):
        with pytest.raises(AssertionError, match="pixels off"):
            hold(cameras, {name: picture[flip] for name, picture in pictures.items()})
            pytest.fail("a flipped picture is not seen")


QUICK = ("--engine", "VIEWCAM", "--samples", "1", "--size", "16x16", "--transforms")


def datasets(tmp_path):
    return sorted(
        path.name for path in (tmp_path / "out").rglob("*") if path.suffix == ".txt" or path.name == "transforms.json"
    )


def test_a_part_of_a_batch_writes_no_dataset_and_the_rest_of_it_does(stage, batch, tmp_path, capfd):
    blend = stage()
    assert batch(blend, SHOTS[:3], *QUICK, "--shard", "1/2") == 0
    assert "no dataset is written, since 1 of 3 shots are missing: rolled" in capfd.readouterr().out
    assert datasets(tmp_path) == []
    assert batch(blend, SHOTS[:3], *QUICK, "--resume") == 0
    assert "dataset of 3 pictures: " in capfd.readouterr().out
    assert datasets(tmp_path) == ["cameras.txt", "images.txt", "points3D.txt", "transforms.json"]


def test_a_name_with_a_space_is_refused_before_anything_is_rendered(stage, batch, tmp_path, capfd):
    assert batch(stage(), [SHOTS[0] | {"name": "front left"}], *QUICK) == 2
    output = capfd.readouterr().err
    assert (
        "a COLMAP model can't name a picture with a space, as front left.png: rename it" in output and output.count("\n") == 1
    )
    assert not list(tmp_path.glob("out/*.*"))


def test_a_mirrored_camera_has_its_picture_and_no_dataset(stage, batch, tmp_path, capfd):
    bpy.context.scene.camera.scale = (-1, 1, 1)
    assert batch(stage(), SHOTS[3:], *QUICK) == 2
    assert "can't say that a camera is mirrored, as in shifted.png: make its scale positive" in capfd.readouterr().err
    assert (tmp_path / "out" / "shifted.png").is_file() and datasets(tmp_path) == []


def test_one_command_makes_depth_masks_and_points_that_lie_on_a_cube_in_its_color(stage, batch, tmp_path, capfd):
    bpy.ops.mesh.primitive_cube_add(size=1.2)
    bpy.context.object.data.materials.append(_shining((0, 1, 0)))
    assert batch(stage(), SHOTS[:3], "--transforms", "--labels", "depth,masks", "--test", "front") == 0
    assert " points: " in capfd.readouterr().out
    document = json.loads((tmp_path / "out" / "transforms.json").read_text())
    assert document["test_filenames"] == ["front.png"] and document["train_filenames"] == ["rolled.png", "above.png"]
    keys = "depth_file_path", "mask_path", "depth_path"
    assert all((tmp_path / "out" / frame[key]).is_file() for frame in document["frames"] for key in keys)
    lines = [line.split() for line in (tmp_path / "out/sparse/0/points3D.txt").read_text().splitlines() if line[0] != "#"]
    points, colors = np.array([line[1:4] for line in lines], float), np.array([line[4:7] for line in lines], int)
    assert len(points) > 30 and np.abs(np.abs(points).max(axis=1) - 0.6).max() < 1e-6
    off = np.abs(colors - [0, 255, 0]).max(axis=1)
    assert off.max() < 64 and (off <= 2).mean() > 0.5, "but for dither it is the cube's, less where an edge is in the pixel"


OPENCV = (250, 250.5, 161, 88, -0.25, 0.08, 0.006, -0.004)
FISHEYE = (200, 200, 161, 88, 0.03, -0.01, 0.002, 0.0)
"""Pixels. Calibrated: the search errs by up to 0.057 in the same picture computed with 64 rays a pixel; 0.060 at most was seen
in pictures that the lens has bent, and 0.087 in those that are interpolated twice."""


@pytest.fixture
def blend(fresh_blender, scene, tmp_path):
    """A board of squares of 1 in the plane z = 0, which shine or don't, and an animated camera above it; its path."""
    corners = [(x, y, 0) for y in range(-8, 9) for x in range(-12, 13)]
    first = [(j * 25 + i, (i + j) % 2) for j in range(16) for i in range(24)]
    mesh = bpy.data.meshes.new("Board")
    mesh.from_pydata(corners, [], [(k, k + 1, k + 26, k + 25) for k, _ in first])
    for level in (0.05, 0.9):
        material = bpy.data.materials.new("Shining")
        if not material.node_tree:
            material.use_nodes = True
        nodes = material.node_tree.nodes
        nodes.clear()
        shining, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputMaterial")
        shining.inputs["Color"].default_value = (level, level, level, 1)
        material.node_tree.links.new(shining.outputs[0], output.inputs["Surface"])
        mesh.materials.append(material)
    mesh.polygons.foreach_set("material_index", [color for _, color in first])
    scene.collection.objects.link(bpy.data.objects.new("Board", mesh))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.camera.location, scene.camera.rotation_euler = (0.3, -3.2, 5.0), (0.55, 0.02, 0.05)
    scene.camera.keyframe_insert("location", frame=1)
    scene.camera.location.x += 0.5
    scene.camera.keyframe_insert("location", frame=2)
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 64, False
    scene.view_settings.view_transform = "Raw"
    scene.render.resolution_x, scene.render.resolution_y = 200, 100  # neither size nor shape of the calibrated camera's
    scene.render.pixel_aspect_x = 1.5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "board.blend"))
    return tmp_path / "board.blend"


def calibrated(folder, model, numbers):
    folder.mkdir()
    (folder / "cameras.txt").write_text(f"1 {model} 320 180 {' '.join(map(str, numbers))}\n")
    (folder / "images.txt").write_text("1 1 0 0 0 0 0 4 1 a.png\n\n")
    (folder / "points3D.txt").write_text("")
    return folder


def of_opencv(cv2, document, model):
    """(matrix, coefficients, module) by which OpenCV projects what transforms.json says."""
    k = np.array([[document["fl_x"], 0, document["cx"]], [0, document["fl_y"], document["cy"]], [0, 0, 1.0]])
    if model == "OPENCV_FISHEYE":
        return k, np.array([document[name] for name in ("k1", "k2", "k3", "k4")]), cv2.fisheye
    return k, np.array([document.get(name, 0.0) for name in ("k1", "k2", "p1", "p2")]), cv2


def to_camera(frame):
    """(4, 4): world space to OpenCV's camera."""
    return np.diag([1.0, -1, -1, 1]) @ np.linalg.inv(frame["transform_matrix"])


def distances(cv2, picture, frame, document, model):
    """The distances in pixels of the board's corners that OpenCV finds in a picture from where it projects them.

    Of corners between squares of 16 pixels and more.
    """
    points = np.array([(x, y, 0.0) for y in range(-7, 8) for x in range(-11, 12)])[:, None]
    matrix, (k, terms, module) = to_camera(frame), of_opencv(cv2, document, model)
    places = module.projectPoints(points, cv2.Rodrigues(matrix[:3, :3])[0], matrix[:3, 3], k, terms)[0].reshape(15, 23, 2)
    wide = np.min([np.linalg.norm(np.gradient(places, axis=axis), axis=-1) for axis in (0, 1)], axis=0)
    inside = ((places > 10) & (places < np.array([document["w"], document["h"]]) - 10)).all(axis=-1) & (wide > 16)
    assert inside.sum() > 20, "the view tests nothing"
    expected = (places[inside] - 0.5).astype(np.float32)
    blurred = cv2.GaussianBlur(picture.astype(np.float32), (0, 0), 1)  # OpenCV's gradients are of two pixels apart
    criteria = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 50, 1e-4)
    corners = cv2.cornerSubPix(blurred, expected[:, None].copy(), (7, 7), (-1, -1), criteria)[:, 0]
    return np.linalg.norm(corners - expected, axis=-1)


@pytest.mark.exhaustive  # which has OpenCV
@pytest.mark.parametrize(("model", "numbers"), [("OPENCV", OPENCV), ("OPENCV_FISHEYE", FISHEYE)])
def test_corners_are_where_opencv_projects_them_and_back_undistorted(blend, tmp_path, model, numbers):
    cv2 = pytest.importorskip("cv2")
    lens, out, straight = calibrated(tmp_path / "lens", model, numbers), tmp_path / "out", tmp_path / "straight"
    words = ["--frames", "2..2", "--labels", "masks", "--check", "--transforms", "--distort", str(lens)]
    assert cli.main(["batch", str(blend), "--out", str(out), *words]) == 0, "the pinhole is what the tracer sees"
    document = json.loads((out / "transforms.json").read_text())
    assert document["camera_model"] == model and (document["w"], document["h"]) == (320, 180)
    assert (out / "sparse" / "0" / "cameras.txt").read_text().splitlines()[-1].split()[1] == model
    (frame,) = document["frames"]
    np.testing.assert_allclose(np.array(frame["transform_matrix"])[:3, 3], (0.8, -3.2, 5.0), atol=1e-6)
    assert cli.main(["camera", str(out / "transforms.json"), "--undistort", str(straight)]) == 0
    pinholes = json.loads((straight / "transforms.json").read_text())
    (pinhole,) = pinholes["frames"]
    picture = cv2.imread(str(out / frame["file_path"]), cv2.IMREAD_GRAYSCALE)
    off = distances(cv2, picture, frame, document, model)
    assert off.max() < CLOSE, f"{off.max():.2g} pixels aside"
    undistorted = cv2.imread(str(straight / pinhole["file_path"]), cv2.IMREAD_GRAYSCALE)
    off = distances(cv2, undistorted, pinhole, pinholes, "PINHOLE")
    assert off.max() < CLOSE, f"{off.max():.2g} pixels aside, undistorted"
    if model == "OPENCV":
        p1, p2 = document["p1"], document["p2"]
        off = distances(cv2, picture, frame, document | {"p1": p2, "p2": p1}, model)
        assert np.median(off) > CLOSE, "p1 and p2 swapped are not found"
