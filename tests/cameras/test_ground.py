"""The ground of a data set's points becomes z = 0: of rooms and fields made here, in worlds that are turned any way."""

import json
import math

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options, clouds
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

HEIGHT = 1.6  # the cameras', above the ground


def room(random, noise=0.0):
    """Points of a floor, z = 0, a wall with twice as many, and things in the room; and cameras that look around in it.

    Nothing is within a hundredth of the room's extent of the floor, so that the ground is fitted to the floor alone.
    """
    floor = np.column_stack([random.uniform(-3, 3, (1500, 2)), random.normal(0, noise, 1500) if noise else np.zeros(1500)])
    wall = np.column_stack([random.uniform(-3, 3, 3000), np.full(3000, 3.0), random.uniform(0.2, 3, 3000)])
    scattered = random.uniform([-3, -3, 0.2], [3, 3, 2], (1000, 3))
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    eyes = np.column_stack([np.cos(angles), np.sin(angles), np.full(12, HEIGHT)])
    views = np.column_stack([2 * np.cos(angles + 0.4), 2 * np.sin(angles + 0.4), random.uniform(1.0, 1.8, 12)])
    return np.vstack([floor, wall, scattered]), eyes, views, np.array([0.05, 0.0, 1.0])


def field(random):
    """Points of a field, z = 0, with trees, and cameras that fly over it to and fro and look straight down."""
    ground = np.column_stack([random.uniform(-50, 50, (3000, 2)), np.zeros(3000)])
    trees = np.column_stack([random.uniform(-50, 50, (1000, 2)), random.uniform(3, 15, 1000)])
    eyes = np.column_stack([random.uniform(-30, 30, (12, 2)), np.full(12, HEIGHT)]) * [1, 1, 25]
    return np.vstack([ground, trees]), eyes, eyes * [1, 1, 0], np.array([[0, (-1.0) ** i, 0] for i in range(12)])


def dataset(folder, points, eyes, views, ups, turn=None, move=(0.0, 0.0, 0.0)):
    """A COLMAP model of these in a world that is turned and moved."""
    turn = np.eye(3) if turn is None else turn
    ups = np.broadcast_to(ups, eyes.shape)
    placed = [(turn @ e + move, turn @ l + move, turn @ up) for e, l, up in zip(eyes, views, ups, strict=True)]
    shots = [Camera(f"{i:02d}", Pinhole(*map(tuple, place), 600, 640, 360)) for i, place in enumerate(placed)]
    cameras.save(shots, folder, "colmap")
    lines = (f"{i} {x!r} {y!r} {z!r} 0 0 0 0" for i, (x, y, z) in enumerate((points @ turn.T + move).tolist(), start=1))
    (folder / "points3D.txt").write_text("\n".join(lines) + "\n")
    return shots


def turns():
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    vectors = [(0, 0, 0), (np.pi, 0, 0), (-np.pi / 2, 0, 0), (0.3, -1.1, 2.0), (2.5, 1.0, -0.4)]
    return [rotation.from_rotvec(vector).as_matrix() for vector in vectors]


@pytest.mark.parametrize("number", range(5))
@pytest.mark.parametrize("scene", [room, field])
def test_cameras_stand_at_their_height_above_the_ground_however_the_world_is_turned(tmp_path, scene, number):
    points, eyes, views, ups = scene(np.random.default_rng(number))
    dataset(tmp_path, points, eyes, views, ups, turns()[number], (3.0, -2.0, 1.5))
    read = cameras.read(tmp_path, options=Options(up_from="ground"))
    heights = [camera.pinhole.eye[2] for camera in read]
    assert heights == pytest.approx(eyes[:, 2], abs=1e-9 * eyes[0, 2] + 1e-9), (
        "COLMAP's numbers are float64 and the floor is a plane"
    )
    toward = [np.subtract(camera.pinhole.look_at, camera.pinhole.eye) for camera in read]
    tilts = [vector[2] / np.linalg.norm(vector) for vector in toward]
    true = [(l - e)[2] / np.linalg.norm(l - e) for e, l in zip(eyes, views, strict=True)]
    assert tilts == pytest.approx(true, abs=1e-9)
    assert any(note.startswith("z = 0 is the ground, a plane near ") for note in read[0].notes)


def test_noise_of_the_points_tilts_the_ground_by_no_more_than_least_squares_does(tmp_path):
    noise, count = 0.005, 1500
    points, eyes, views, ups = room(np.random.default_rng(1), noise)
    dataset(tmp_path, points, eyes, views, ups, turns()[3])
    read = cameras.read(tmp_path, options=Options(up_from="ground"))
    error = max(abs(camera.pinhole.eye[2] - HEIGHT) for camera in read)
    # Height and slopes of a fitted plane are normal, with noise / √count and that by the spread of the floor, √3 m.
    allowed = 6 * noise / math.sqrt(count) * (1 + 2 / math.sqrt(3))
    assert error < allowed, f"{error} m, {allowed} are allowed"


def test_the_ground_is_the_same_each_time_and_in_the_files_unit_and_axes(tmp_path):
    points, eyes, views, ups = room(np.random.default_rng(2), 0.005)
    dataset(tmp_path, points, eyes, views, ups, turns()[2])  # y down
    first, again = (cameras.read(tmp_path, options=Options(up_from="ground")) for _ in range(2))
    assert first == again
    scaled = cameras.read(tmp_path, options=Options(up_from="ground", axes="y_down", scale=100.0))
    assert [c.pinhole.eye[2] for c in scaled] == pytest.approx([100 * c.pinhole.eye[2] for c in first], rel=1e-9)


def test_what_was_done_to_the_world_is_written_as_transforms_json_says_it_and_undone(tmp_path, capfd):
    points, eyes, views, ups = room(np.random.default_rng(3))
    shots = dataset(tmp_path, points, eyes, views, ups, turns()[3], (1.0, 2.0, 3.0))
    out = tmp_path / "transforms.json"
    assert main(["camera", str(tmp_path), "--ground", "--scale", "0.5", "--to", "transforms", "--out", str(out)]) == 0
    assert "z = 0 is the ground" in capfd.readouterr().err
    document = json.loads(out.read_text())
    assert document["applied_scale"] == pytest.approx(0.5, rel=1e-12)
    (there,) = (camera for camera in cameras.read(out) if camera.name == "00")
    applied = 0.5 * (np.array(document["applied_transform"]) @ [*shots[0].pinhole.eye, 1.0])  # p' = scale (R p + t)
    assert there.pinhole.eye == pytest.approx(tuple(applied), abs=1e-12)
    back = cameras.read(out, options=Options(original_world=True))
    for camera, shot in zip(back, shots, strict=True):
        assert camera.pinhole.eye == pytest.approx(shot.pinhole.eye, abs=1e-12)
        assert np.abs(np.array(camera.pinhole.axes()) - shot.pinhole.axes()).max() < 1e-12
    assert "applied_transform" not in cameras.write(shots, "transforms", Options(axes="y_up"))  # which its comment says


PLY = "ply\nformat {} 1.0\ncomment of the test\nelement vertex {}\nproperty float nx\nproperty double x\nproperty double y\n"
PLY += "property uchar red\nproperty double z\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n"


def ply(points, form):
    head = PLY.format(form, len(points)).encode()
    if form == "ascii":
        return head + "".join(f"0.5 {x!r} {y!r} 7 {z!r}\n" for x, y, z in points.tolist()).encode()
    order = "<" if "little" in form else ">"
    rows = np.zeros(len(points), [("nx", f"{order}f4"), *((n, f"{order}f8") for n in "xy"), ("red", "u1"), ("z", f"{order}f8")])
    rows["x"], rows["y"], rows["z"] = points.T
    return head + rows.tobytes()


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_ply_that_transforms_json_names_has_the_ground(tmp_path, form):
    points, eyes, views, ups = room(np.random.default_rng(4))
    shots = dataset(tmp_path / "colmap", points, eyes, views, ups)
    document = json.loads(cameras.write(shots, "transforms")) | {"ply_file_path": "cloud.ply"}
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    (tmp_path / "cloud.ply").write_bytes(ply(points, form))
    assert np.array_equal(clouds.of_ply(tmp_path / "cloud.ply"), points)
    for path in (tmp_path, tmp_path / "transforms.json"):
        read = cameras.read(path, options=Options(up_from="ground"))
        assert [camera.pinhole.eye[2] for camera in read] == pytest.approx([HEIGHT] * len(read), abs=1e-9)
    with pytest.raises(InputError, match="original-world"):
        cameras.read(tmp_path, options=Options(up_from="ground", original_world=True))
    (tmp_path / "cloud.ply").write_bytes(ply(points, form)[:-200])
    with pytest.raises(InputError, match=r"cloud.ply is damaged"):
        cameras.read(tmp_path, options=Options(up_from="ground"))


def test_a_data_set_without_points_or_ground_is_refused(tmp_path):
    points, eyes, views, ups = room(np.random.default_rng(5))
    shots = dataset(tmp_path, points, eyes, views, ups)
    (tmp_path / "transforms.json").write_text(cameras.write(shots, "transforms"))
    (tmp_path / "points3D.txt").write_text("# none\n")
    for path in (tmp_path / "cameras.txt", tmp_path / "transforms.json", cameras.write(shots, "transforms")):
        with pytest.raises(InputError, match="no points to find the ground by"):
            cameras.read(path, options=Options(up_from="ground"))
    dataset(tmp_path, np.random.default_rng(6).uniform(-3, 3, (4000, 3)), eyes, views, ups)  # a cloud
    with pytest.raises(InputError, match="no plane below the cameras"):
        cameras.read(tmp_path, options=Options(up_from="ground"))
