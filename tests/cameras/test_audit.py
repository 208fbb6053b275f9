"""The audit of a dataset's cameras: each mistake is made on purpose in right datasets, and named; right ones raise no alarm.

The scenes, the pictures of their points and the mistakes are made here, from formulas of their own."""

import json
import os
import struct
import zlib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon import cameras, cli
from viewcam_addon.cameras import Camera, distortion
from viewcam_addon.cameras.audit import MISTAKES, Depths, Tracks, Views, _audited, audit, tracks_through, views_of
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.slow

OPENCV = np.array([1.0, -1, -1])
Y_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
SIZES = [(640, 360), (800, 600), (1080, 1920), (1920, 1080), (1200, 900)]


def a_right_dataset(random, size=None):
    """Views around a place that is not the origin, and that place."""
    count = int(random.integers(4, 16))
    size = np.array(size or SIZES[random.integers(len(SIZES))], float)
    away = random.normal(size=(count, 3))
    away *= (random.uniform(3, 8) * random.uniform(0.8, 1.2, count) / np.linalg.norm(away, axis=1))[:, None]
    away[:, 2] = 0.6 * np.abs(away[:, 2])
    middle = 3 * random.normal(size=3)
    w = away - 0.3 * random.normal(size=(count, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    u = np.cross(np.array([0, 0, 1.0]) + 0.1 * random.normal(size=(count, 3)), w)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    center = size / 2 + size * random.uniform(0.02, 0.08, 2) * random.choice([-1, 1], 2)
    center += 3.7 * (abs(center[0] - center[1]) < 20)  # so that both numbers differ
    views = Views(
        np.stack([u, np.cross(w, u), w], axis=-1),
        away + middle,
        np.full((count, 2), size[0] * random.uniform(0.6, 2.5)),
        np.tile(center, (count, 1)),
        np.tile(size, (count, 1)),
    )
    return views, middle


def points_in_pictures(random, views, middle, noise):
    """Tracks with noise, of which one in 30 is an outlier."""
    points = middle + 0.8 * random.normal(size=(int(random.integers(60, 200)), 3))
    which, points = np.repeat(np.arange(len(views.eye)), len(points)), np.tile(points, (len(views.eye), 1))
    seen = np.einsum("mij,mi->mj", views.axes[which], points - views.eye[which])
    places = views.center[which] + views.focal[which] * seen[:, :2] * [1, -1] / -seen[:, 2:]
    there = (seen[:, 2] < 0) & (places > 0).all(axis=1) & (places < views.size[which]).all(axis=1)
    which, points, places = which[there], points[there], places[there]
    places = places + noise * random.normal(size=places.shape)
    wild = random.random(len(places)) < 1 / 30
    places[wild] += 30 * random.normal(size=(wild.sum(), 2))
    return Tracks(which, places, points)


def inverse(views, opencv_in=False, opencv_out=False):
    turn = np.swapaxes(views.axes * (OPENCV if opencv_in else 1), 1, 2)
    return replace(views, axes=turn * (OPENCV if opencv_out else 1), eye=-np.einsum("nij,nj->ni", turn, views.eye))


def quaternions_in_another_order(views):
    rotation = pytest.importorskip("scipy.spatial.transform").Rotation
    turn = np.swapaxes(views.axes * OPENCV, 1, 2)
    translation = -np.einsum("nij,nj->ni", turn, views.eye)
    x, y, z, w = rotation.from_matrix(turn).as_quat().T
    turn = rotation.from_quat(np.stack([y, z, w, x], axis=-1)).as_matrix()  # the file has x y z w and is read as w x y z
    back = np.swapaxes(turn, 1, 2)
    return replace(views, axes=back * OPENCV, eye=-np.einsum("nij,nj->ni", back, translation))


def with_focal(views, factors):
    return replace(views, focal=views.focal * np.array(factors))


MADE = {
    "half_pixel": lambda v, r: replace(v, center=v.center - 0.5),
    "half_pixel_more": lambda v, r: replace(v, center=v.center + 0.5),
    "center_swapped": lambda v, r: replace(v, center=v.center[:, ::-1]),
    "center_upside_down": lambda v, r: replace(v, center=v.center * [1, -1] + v.size * [0, 1]),
    "center_mirrored": lambda v, r: replace(v, center=v.center * [-1, 1] + v.size * [1, 0]),
    "center_left_out": lambda v, r: replace(v, center=v.size / 2),
    "opencv_axes": lambda v, r: replace(v, axes=v.axes * OPENCV),
    "y_flipped": lambda v, r: replace(v, axes=v.axes * [1, -1, 1]),
    "z_flipped": lambda v, r: replace(v, axes=v.axes * [1, 1, -1]),
    "x_flipped": lambda v, r: replace(v, axes=v.axes * [-1, 1, 1]),
    "inverse": lambda v, r: inverse(v, *[(False, False), (True, True), (True, False)][r.integers(3)]),
    "transposed": lambda v, r: replace(v, axes=np.swapaxes(v.axes, 1, 2)),
    "translation_as_eye": lambda v, r: replace(v, eye=-np.einsum("nji,nj->ni", v.axes, v.eye)),
    "eye_as_translation": lambda v, r: replace(v, eye=-np.einsum("nij,nj->ni", v.axes * OPENCV, v.eye)),
    "quaternion_order": lambda v, r: quaternions_in_another_order(v),
    "y_up": lambda v, r: replace(v, axes=Y_UP.T @ v.axes, eye=v.eye @ Y_UP),
    "y_down": lambda v, r: (lambda turn: replace(v, axes=turn.T @ v.axes, eye=v.eye @ turn))(
        np.diag(OPENCV) if r.random() < 0.5 else Y_UP @ np.diag(OPENCV)
    ),
    "focal_factor": lambda v, r: with_focal(v, r.choice([r.uniform(0.3, 0.9), r.uniform(1.1, 3)])),
    "late": lambda v, r: replace(v, axes=np.roll(v.axes, 1, axis=0), eye=np.roll(v.eye, 1, axis=0)),
    "fov_axis": lambda v, r: with_focal(v, v.size[:, 1:] / v.size[:, :1]),
    "size": lambda v, r: (lambda s: replace(v, focal=v.focal * s, center=v.center * s))(r.choice([2, 4, 0.5, 0.25, 1 / 0.75])),
    "focal_of_another_size": lambda v, r: with_focal(v, r.choice([2, 0.5, 4])),
    "center_of_another_size": lambda v, r: replace(v, center=v.center * r.choice([2, 0.5, 4, 0.25])),
    "aspect": lambda v, r: with_focal(v, [1, r.choice([2, 0.5, 11 / 12])]),
    "unit": lambda v, r: replace(v, eye=v.eye * r.choice([1000, 100, 0.001, 0.01, 1 / 0.3048, 0.0254])),
}


def named(kind, seed):
    """The audit's verdict on a dataset with a mistake: nothing if it is named, alone or with what can't be told from it."""
    random = np.random.default_rng([seed, len(kind)])
    views, middle = a_right_dataset(random)
    tracks = points_in_pictures(random, views, middle, random.uniform(0.1, 1.0))
    verdict = _audited(MADE[kind](views, random), tracks)
    return "" if kind in (verdict.kind, *verdict.others) else verdict.kind


def alarm(seed):
    random = np.random.default_rng([seed, 99])
    views, middle = a_right_dataset(random)
    return _audited(views, points_in_pictures(random, views, middle, random.uniform(0.1, 1.5))).kind


@pytest.mark.parametrize("kind", MADE)
def test_a_mistake_is_named(kind):
    assert [named(kind, seed) for seed in range(3)] == [""] * 3


def test_right_datasets_raise_no_alarm():
    assert Counter(map(alarm, range(30))) == {"none": 30}


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", MADE)
def test_of_a_hundred_datasets_with_a_mistake_99_are_named(kind):
    wrong = Counter(named(kind, seed) for seed in range(100, 200))
    assert wrong[""] >= 99, wrong


@pytest.mark.exhaustive
@pytest.mark.parametrize("first", range(1000, 2000, 500))
def test_500_right_datasets_twice_raise_no_alarm(first):
    assert Counter(map(alarm, range(first, first + 500))) == {"none": 500}


def test_each_mistake_that_is_looked_for_is_made_here():
    assert {mistake.kind for mistake in MISTAKES} - MADE.keys() == {"distance_for_depth", "focal_swapped"}


def test_of_right_cameras_it_says_how_sure_it_is_and_what_the_evidence_is_too_little_to_exclude():
    random = np.random.default_rng(3)
    views, middle = a_right_dataset(random)
    sharp, blurred = (points_in_pictures(np.random.default_rng(3), views, middle, noise) for noise in (0.2, 8.0))
    verdict = _audited(views, sharp)
    assert (verdict.kind, verdict.others) == ("none", ()) and verdict.certainty > 100
    few = Tracks(blurred.which[:60], blurred.places[:60], blurred.points[:60], plausible=20.0)
    verdict = _audited(views, few)
    assert verdict.kind == "none" and "half_pixel" in verdict.others and "half_pixel" in verdict.sentence
    assert verdict.certainty < 14


def test_too_few_points_tell_nothing():
    random = np.random.default_rng(1)
    views, middle = a_right_dataset(random)
    tracks = points_in_pictures(random, views, middle, 0.5)
    few = Tracks(tracks.which[:30], tracks.places[:30], tracks.points[:30])
    assert _audited(replace(views, axes=views.axes * OPENCV), few).kind == "unsure"


def test_noise_and_unknown_mistakes_are_given_no_name():
    random = np.random.default_rng(2)
    views, middle = a_right_dataset(random)
    tracks = points_in_pictures(random, views, middle, 0.3)
    scattered = replace(views, eye=views.eye + random.normal(size=views.eye.shape))
    assert _audited(scattered, tracks).kind == "unknown"


# ---- depth maps of a sphere on a floor


def depth_map(views, number, lens=None):
    """(height, width) depth along the view, rows from the top; nan where nothing is."""
    width, height = views.size[number].astype(int)
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    x = (columns - views.center[number, 0]) / views.focal[number, 0]
    y = -(rows - views.center[number, 1]) / views.focal[number, 1]
    if lens is not None:
        x, y = np.moveaxis(lens.undistort(np.stack([x, -y], axis=-1)) * [1, -1], -1, 0)
    rays = np.stack([x, y, -np.ones_like(x)], axis=-1) @ views.axes[number].T
    eye = views.eye[number]
    with np.errstate(all="ignore"):
        floor = -eye[2] / rays[..., 2]
        b, c = rays @ (eye - [0, 0, 1]), (eye - [0, 0, 1]) @ (eye - [0, 0, 1]) - 1
        a = (rays * rays).sum(axis=-1)
        ball = (-b - np.sqrt(b * b - a * c)) / a
    depth = np.fmin(np.where(floor > 0, floor, np.nan), np.where(ball > 0, ball, np.nan))
    return np.where(depth < 30, depth, np.nan)


def a_filmed_scene(seed=4, count=8):
    random = np.random.default_rng(seed)
    angle = np.arange(count) * 0.3
    eye = np.stack([5 * np.cos(angle), 5 * np.sin(angle), 2.5 + 0.1 * np.arange(count)], axis=-1)
    result = [
        Pinhole(
            tuple(e), (0.1, 0.2, 0.7), (0.05, 0, 1), 150.0, 160, 100, tuple(np.array([84.0, 47.0]) + random.uniform(-1, 1, 2))
        )
        for e in eye
    ]
    return [Camera(f"{i}", pinhole, image=f"images/{i}.png") for i, pinhole in enumerate(result)]


BY_DEPTH = [
    *("half_pixel", "center_swapped", "opencv_axes", "y_flipped", "z_flipped", "x_flipped", "inverse", "transposed"),
    *(
        "translation_as_eye",
        "late",
        "fov_axis",
        "focal_factor",
        "focal_of_another_size",
        "center_of_another_size",
        "aspect",
        "unit",
    ),
]


@pytest.fixture(scope="module")
def filmed():
    views = views_of(a_filmed_scene())
    return views, [depth_map(views, i) for i in range(len(views.eye))]


def test_depth_maps_say_that_right_cameras_are_right(filmed):
    views, maps = filmed
    assert _audited(views, Depths(maps)).kind == "none"


def test_depth_maps_that_a_lens_has_bent_tell_the_lens_and_no_focal_length():
    """A batch with --distort makes such; taken for a pinhole's they fitted best with a focal length 1.02 times too long."""
    views = views_of(a_filmed_scene(count=3))
    verdict = _audited(views, Depths([depth_map(views, i, distortion.opencv({"k1": -0.2})) for i in range(3)]))
    assert verdict.kind == "lens_left_out", verdict
    assert abs(float(verdict.sentence.split("k1 = ")[1].split()[0]) + 0.2) < 2e-3, verdict


@pytest.mark.parametrize("kind", ["y_up", "y_down"])
def test_depth_maps_do_not_show_how_the_whole_world_is_turned_and_the_audit_says_so(filmed, kind):
    views, maps = filmed
    verdict = _audited(MADE[kind](views, np.random.default_rng(5)), Depths(maps))
    assert (verdict.kind, verdict.others) == ("none", ("y_up", "y_down"))
    assert "do not show how the whole world is turned: y_up, y_down" in verdict.sentence


@pytest.mark.parametrize("kind", BY_DEPTH)
def test_a_mistake_is_named_by_depth_maps_alone(filmed, kind):
    views, maps = filmed
    verdict = _audited(MADE[kind](views, np.random.default_rng(5)), Depths(maps))
    assert kind in (verdict.kind, *verdict.others), verdict


@pytest.mark.parametrize(("factor", "words"), [(1.5, "1.5 times too long"), (38 / 45, "1.184 times too short")])
def test_a_focal_length_that_is_wrong_by_any_factor_is_told_with_it(tmp_path, capsys, factor, words):
    """NeRF's data: the angle of a sensor of 36 mm for one of 24, a lens of 38 mm for one of 45."""
    true = a_filmed_scene()
    longer = [replace(c, pinhole=replace(c.pinhole, distance=tuple(d * factor for d in c.pinhole.distance))) for c in true]
    for name, values in (("true", true), ("wrong", longer)):
        cameras.save(values, tmp_path / f"{name}.json", "transforms")
    assert run("audit", tmp_path / "wrong.json", "--against", tmp_path / "true.json") == 1
    assert f"the focal length is {words}" in capsys.readouterr().out


def test_distances_in_place_of_depths_are_named(filmed):
    views, maps = filmed
    columns, rows = np.meshgrid(np.arange(160) + 0.5, np.arange(100) + 0.5)
    far = [
        depth * np.sqrt(1 + (((np.stack([columns, rows], -1) - views.center[i]) / views.focal[i]) ** 2).sum(-1))
        for i, depth in enumerate(maps)
    ]
    assert _audited(views, Depths(far)).kind == "distance_for_depth"


# ---- files, and bugs that others reported


def written_model(folder, cameras_read, tracks):
    """A COLMAP model of the cameras, with the tracks in its images and points."""
    cameras.save(cameras_read, folder, "colmap")
    head, *lines = (folder / "images.txt").read_text().splitlines()
    pictures = iter(range(len(cameras_read)))
    out = [head]
    for line in lines:
        if line.startswith("#") or not line.strip():
            continue
        number = next(pictures)
        indices = np.flatnonzero(tracks.which == number)
        out += [
            line,
            " ".join(f"{x!r} {y!r} {i}" for i, (x, y) in zip(indices.tolist(), tracks.places[indices].tolist(), strict=True)),
        ]
    (folder / "images.txt").write_text("\n".join(out) + "\n")
    points = [f"{i} {x!r} {y!r} {z!r} 0 0 0 0.5" for i, (x, y, z) in enumerate(tracks.points.tolist())]
    (folder / "points3D.txt").write_text("\n".join(points) + "\n")


def run(*words):
    return cli.main([*map(str, words)])


@pytest.fixture
def model(tmp_path):
    actual = a_filmed_scene()
    tracks = tracks_through(actual)
    written_model(tmp_path / "model", actual, tracks)
    return actual, tmp_path / "model"


def test_a_right_model_is_told_to_be_right(model, capsys):
    assert run("audit", model[1]) == 0
    output = capsys.readouterr().out
    assert "nothing is wrong" in output and "Sure to e^" in output


def test_a_binary_model_says_the_same(model, tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    pycolmap.Reconstruction(model[1]).write_binary(tmp_path)
    assert run("audit", tmp_path) == 0


def lines_changed(path, change):
    """The words of each camera or image of a COLMAP text, changed."""
    lines = path.read_text().splitlines()
    path.write_text("\n".join(" ".join(change(line.split())) if not line.startswith("#") else line for line in lines) + "\n")


def test_a_principal_point_of_opencvs_calibration_in_colmap_is_half_a_pixel_off(model, capsys):
    """colmap/colmap #2587: OpenCV's c has (0, 0) at the first pixel's center."""
    lines_changed(model[1] / "cameras.txt", lambda w: [*w[:-2], *(repr(float(x) - 0.5) for x in w[-2:])])
    assert run("audit", model[1]) == 1
    assert "half a pixel too small" in capsys.readouterr().out


def test_a_loader_that_leaves_the_principal_point_out_is_named(model, capsys):
    """colmap/colmap #3111, hbb1/2d-gaussian-splatting #74: cx and cy are not read."""
    lines_changed(model[1] / "cameras.txt", lambda w: [*w[:-2], repr(int(w[2]) / 2), repr(int(w[3]) / 2)])
    assert run("audit", model[1]) == 1
    assert "left out" in capsys.readouterr().out


def test_depth_that_is_distance_is_named_of_files(filmed, tmp_path, capsys):
    """colmap/colmap #1768: z was taken for the distance."""
    actual, (views, maps) = a_filmed_scene(), filmed
    document = json.loads(cameras.write(actual, "transforms"))
    columns, rows = np.meshgrid(np.arange(160) + 0.5, np.arange(100) + 0.5)
    for i, frame in enumerate(document["frames"]):
        frame["depth_file_path"] = f"depth{i}.npy"
        far = np.sqrt(1 + (((np.stack([columns, rows], -1) - views.center[i]) / views.focal[i]) ** 2).sum(-1))
        np.save(tmp_path / frame["depth_file_path"], maps[i] * far)
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    assert run("audit", tmp_path) == 1
    assert "distances from the eye" in capsys.readouterr().out


def test_a_field_of_view_of_the_other_side_is_named_against_true_cameras(tmp_path, capsys):
    """KhronosGroup/glTF-Blender-IO #1125: the width's angle stood for the height's."""
    true = [replace(c, pinhole=replace(c.pinhole, principal_point=None)) for c in a_filmed_scene()]
    wrong = [replace(c, pinhole=replace(c.pinhole, distance=tuple(d * 100 / 160 for d in c.pinhole.distance))) for c in true]
    for name, values in (("true", true), ("wrong", wrong)):
        cameras.save(values, tmp_path / f"{name}.json", "transforms")
    assert run("audit", tmp_path / "wrong.json", "--against", tmp_path / "true.json") == 1
    assert "field of view" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        # nerfstudio-project/nerfstudio #2255: c of OpenCV's calibration, where half a pixel is missing
        (lambda values: {"cx": values["cx"] - 0.5, "cy": values["cy"] - 0.5}, "half a pixel too small"),
        # ashawkey/stable-dreamfusion #377: cx stood for the height's and cy for the width's
        (lambda values: {"cx": values["cy"], "cy": values["cx"]}, "swapped"),
    ],
)
def test_a_principal_point_that_was_written_wrongly_in_transforms_json_is_named(tmp_path, capsys, change, sentence):
    true = [replace(c, pinhole=replace(c.pinhole, principal_point=(70.0, 60.0))) for c in a_filmed_scene()]
    cameras.save(true, tmp_path / "true.json", "transforms")
    document = json.loads((tmp_path / "true.json").read_text())
    (tmp_path / "wrong.json").write_text(json.dumps(document | change(document)))
    assert run("audit", tmp_path / "wrong.json", "--against", tmp_path / "true.json") == 1
    assert sentence in capsys.readouterr().out


def test_world_to_camera_with_opencvs_axes_in_transforms_json_is_named(tmp_path, capsys):
    """Matrices of OpenCV, written as they are."""
    actual = a_filmed_scene()
    cameras.save(actual, tmp_path / "true.json", "transforms")
    document = json.loads((tmp_path / "true.json").read_text())
    for frame in document["frames"]:
        matrix = np.array(frame["transform_matrix"])
        frame["transform_matrix"] = np.linalg.inv(matrix @ np.diag([1, -1, -1, 1])).tolist()
    (tmp_path / "wrong.json").write_text(json.dumps(document))
    assert run("audit", tmp_path / "wrong.json", "--against", tmp_path / "true.json") == 1
    assert "world to camera, with OpenCV's axes" in capsys.readouterr().out


def test_without_evidence_it_says_what_to_give(tmp_path, capfd):
    cameras.save(a_filmed_scene(), tmp_path / "transforms.json", "transforms")
    assert run("audit", tmp_path) == 2
    assert "--against" in capfd.readouterr().err


def test_an_audit_takes_cameras_as_they_are_read(model):
    cameras_read = cameras.read(model[1])
    assert audit(cameras_read, tracks_through(cameras_read)).kind == "none"


def head_of_a_png(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(1000))) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("pipe.png", "no file"),
        ("large.png", "13000 × 10000"),
        ("bomb.png", "too many pixels"),
        ("cut.npy", "header"),
        ("huge.npy", "header"),
    ],
)
def test_no_depth_map_is_waited_for_or_larger_than_a_picture(tmp_path, capfd, name, sentence):
    if name == "pipe.png" and not hasattr(os, "mkfifo"):
        pytest.skip("this system has no pipes in folders")
    pytest.importorskip("PIL")
    document = json.loads(cameras.write(a_filmed_scene(), "transforms"))
    for frame in document["frames"]:
        frame["depth_file_path"] = name
    (tmp_path / "transforms.json").write_text(json.dumps(document))
    if name == "pipe.png":
        os.mkfifo(tmp_path / name)
    elif name == "large.png":
        (tmp_path / name).write_bytes(head_of_a_png(13_000, 10_000))
    elif name == "bomb.png":  # Pillow itself refuses to open it
        (tmp_path / name).write_bytes(head_of_a_png(60_000, 60_000))
    else:
        np.save(tmp_path / name, np.ones((4, 4)))
        whole = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(whole[:70] if name == "cut.npy" else whole.replace(b"(4, 4)", b"(4444444444, 4)"))
    assert run("audit", tmp_path) == 2
    output = capfd.readouterr().err
    assert sentence in output and "bug" not in output and output.count("\n") == 1


BENT = {
    "": (lambda lens: lens, "none"),
    "lens_twice": (lambda lens: None, "lens_twice"),
    "tangential_swapped": (lambda lens: replace(lens, tangential=lens.tangential[::-1]), "tangential_swapped"),
    "a fisheye": (lambda lens: replace(lens, projection="equidistant"), "lens_model"),
    "the other sign": (lambda lens: replace(lens, radial=tuple(-k for k in lens.radial)), "lens_model"),
    "y up in p1": (lambda lens: replace(lens, tangential=(-lens.tangential[0], lens.tangential[1])), "lens_model"),
    "another model": (lambda lens: distortion.Lens((), "fov", (0.9,)), "lens_model"),
}


@pytest.mark.parametrize("true", BENT)
def test_what_is_wrong_with_a_lens_is_named_and_nothing_where_it_is_right(true):
    """The pictures were taken through one lens, and the cameras say another."""
    change, kind = BENT[true]
    values = distortion.opencv({"k1": -0.2, "k2": 0.05, "p1": 0.004, "p2": -0.003})
    for seed in range(10):
        random = np.random.default_rng(seed)
        views, middle = a_right_dataset(random)
        lens = change(values)
        straight = points_in_pictures(random, views, middle, 0.0)
        in_plane = (straight.places - views.center[straight.which]) / views.focal[straight.which]
        taken = (in_plane if lens is None else lens.distort(in_plane)) * views.focal[straight.which] + views.center[
            straight.which
        ]
        evidence = Tracks(straight.which, taken + 0.3 * random.normal(size=taken.shape), straight.points)
        verdict = _audited(replace(views, lenses=(values,) * len(views.eye)), evidence)
        off = np.median(
            np.hypot(*(taken - (values.distort(in_plane) * views.focal[straight.which] + views.center[straight.which])).T)
        )
        if not true or off > 1.5:  # a telephoto shows too little of a lens to tell
            assert verdict.kind == kind, (seed, off, verdict)


LEFT_OUT = {
    "k1": distortion.opencv({"k1": -0.25}),
    "little": distortion.opencv({"k1": -0.05}),
    "undistorted twice": distortion.opencv({"k1": 0.15}),
    "tangential": distortion.opencv({"k1": -0.25, "k2": 0.08, "p1": 0.006, "p2": -0.004}),
    "a fisheye": distortion.fisheye({"k1": 0.03, "k2": -0.01}),
    "fov": distortion.Lens((), "fov", (0.9,)),
}


@pytest.mark.parametrize("name", LEFT_OUT)
def test_a_lens_that_was_left_out_is_named_with_its_coefficient(name):
    """A positive k1 says that pictures were undistorted twice, or have a pincushion's lens."""
    named = 0
    for seed in range(10):
        random = np.random.default_rng(seed)
        views, middle = a_right_dataset(random)
        lens = LEFT_OUT[name]
        straight = points_in_pictures(random, views, middle, 0.0)
        in_plane = (straight.places - views.center[straight.which]) / views.focal[straight.which]
        bent = (lens.distort(in_plane) - in_plane) * views.focal[straight.which]
        noise = 0.3 * random.normal(size=bent.shape)
        verdict = _audited(views, Tracks(straight.which, straight.places + bent + noise, straight.points))
        if np.percentile(np.hypot(*bent.T), 95) > 4:
            named += 1
            assert verdict.kind == "lens_left_out", (seed, verdict)
            k1 = float(verdict.sentence.split("k1 = ")[1].split(",")[0])
            if lens.projection == "pinhole" and not any(lens.tangential):  # the terms of others do each other's work
                assert abs(k1 - lens.radial[0]) < 0.2 * abs(lens.radial[0]) + 0.02, verdict
    assert named >= 3


def test_a_lens_that_moves_less_than_a_pixel_is_no_wrong_focal_length_where_the_evidence_is_as_exact():
    for seed in range(10):
        random = np.random.default_rng(seed)
        views, middle = a_right_dataset(random)
        straight = points_in_pictures(random, views, middle, 0.0)
        in_plane = (straight.places - views.center[straight.which]) / views.focal[straight.which]
        of_k1 = in_plane * (in_plane**2).sum(axis=1, keepdims=True) * views.focal[straight.which]  # the shift by a k1 of 1
        k1 = -0.8 / np.percentile(np.hypot(*of_k1.T), 95)
        places = straight.places + k1 * of_k1 + 0.05 * random.normal(size=of_k1.shape)
        verdict = _audited(views, Tracks(straight.which, places, straight.points))
        assert verdict.kind == "lens_left_out", (seed, verdict)


def test_a_data_set_of_colmap_with_a_lens_is_right(tmp_path, capsys):
    random = np.random.default_rng(3)
    lens = distortion.opencv({"k1": -0.2})
    points = np.array([0, 0, 4]) + random.uniform(-1, 1, (80, 3))
    images, where = [], random.uniform(-0.3, 0.3, 4)
    for number, x in enumerate(where, start=1):
        seen = points + np.array([x, 0, 0])
        places = lens.distort(seen[:, :2] / seen[:, 2:]) * 600 + [320, 180]
        observations = " ".join(f"{a!r} {b!r} {i}" for i, (a, b) in enumerate(places.tolist(), start=1))
        images.append(f"{number} 1 0 0 0 {float(x)!r} 0 0 1 {number}.png\n{observations}\n")
    (tmp_path / "images.txt").write_text("".join(images))
    (tmp_path / "cameras.txt").write_text("1 SIMPLE_RADIAL 640 360 600 320 180 -0.2\n")
    lines = [f"{i} {x!r} {y!r} {z!r} 1 1 1 0 1 0" for i, (x, y, z) in enumerate(points.tolist(), start=1)]
    (tmp_path / "points3D.txt").write_text("\n".join(lines) + "\n")
    assert cli.main(["audit", str(tmp_path)]) == 0
    assert "nothing is wrong" in capsys.readouterr().out
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 360 600 600 320 180\n")
    assert cli.main(["audit", str(tmp_path)]) == 1
    assert "lens distortion was left out: k1 = -0.2" in capsys.readouterr().out
