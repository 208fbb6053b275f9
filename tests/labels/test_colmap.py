"""COLMAP's points and tracks: pycolmap reads and adjusts them, and rays in the scene say what each picture really sees."""

import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon.cameras import Camera
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError
from viewcam_addon.labels import colmap, files, surface_points
from viewcam_addon.labels.surfaces import Surfaces
from viewcam_addon.png import encoded

from .conftest import CAMERA, moved, room

EYES = [(1.0, -7, 3), (2.2, -6.5, 3.4), (-1.5, -6.5, 2.6), (1.5, 8, 3.5)]  # the last one sees all from behind

# Points are off their surface by depth's rounding to float32, 2⁻²⁵ of it along the ray of one picture; along the ray of another
# one that meets the surface at an angle by up to 100 times as much.
SLACK = 100 * 2.0**-24


def labeled(folder, scenes, kinds=("depth", "masks")):
    for i, scene in enumerate(scenes):
        files.write(folder / f"{i}.exr", vp.label(scene, kinds))
    return folder


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Four pictures of a room that stands still, and their model."""
    scenes = [room(replace(CAMERA, eye=eye)) for eye in EYES]
    shots = labeled(tmp_path_factory.mktemp("colmap") / "shots", scenes)
    assert main(["labels", str(shots), str(shots.parent / "model"), "--to", "colmap", "--points", "600"]) == 0
    return SimpleNamespace(scenes=scenes, shots=shots, model=shots.parent / "model")


def points_of(model):
    """By hand: positions, colors, and which image shows which point, (points, images)."""
    lines = [line.split() for line in (model / "points3D.txt").read_text().splitlines() if not line.startswith("#")]
    visible = np.zeros((len(lines), len(list(model.parent.glob("shots/*.json")))), bool)
    for i, line in enumerate(lines):
        visible[i, np.array(line[8::2], int) - 1] = True
    return np.array([line[1:4] for line in lines], float), np.array([line[4:7] for line in lines], int), visible


def really_seen(scene, positions):
    none = np.full(len(positions), -1)
    return Surfaces(scene).seen_first(positions, none, none, SLACK)


def reconstruction(written):
    return pytest.importorskip("pycolmap").Reconstruction(written.model)


def test_pycolmap_reads_it_and_each_track_projects_to_its_places(written):
    model = reconstruction(written)
    assert [model.images[i].name for i in sorted(model.images)] == ["0.exr", "1.exr", "2.exr", "3.exr"]
    assert model.is_valid() and model.num_points3D() > 1000
    worst, count = 0.0, 0
    for point in model.points3D.values():
        assert point.track.length() >= 2
        for each in point.track.elements:
            image = model.images[each.image_id]
            worst = max(worst, np.abs(image.project_point(point.xyz) - image.points2D[each.point2D_idx].xy).max())
            count += 1
    assert count == sum(image.num_points3D for image in model.images.values())
    assert worst <= 1e-9, f"a point projects {worst:.3g} pixels beside its place"


def test_what_a_track_names_rays_see_and_few_pictures_that_see_a_point_are_not_named(written):
    positions, _, visible = points_of(written.model)
    seen = np.stack([really_seen(scene, positions) for scene in written.scenes], axis=1)
    assert not (visible & ~seen).any(), f"{(visible & ~seen).sum()} of {visible.sum()} places are hidden"
    assert (visible & seen).sum() >= 0.85 * seen.sum(), f"{visible.sum()} of {seen.sum()} places are found"
    assert not seen.all(), "the test wants hidden points"


def test_that_test_finds_a_test_of_depth_that_lets_all_pass(written, symlink, tmp_path, monkeypatch):
    monkeypatch.setattr(surface_points, "_ROUNDING", 1.0)
    colmap.write(written.shots, tmp_path / "model", 600)
    symlink(tmp_path / "shots", written.shots)
    positions, _, visible = points_of(tmp_path / "model")
    seen = np.stack([really_seen(scene, positions) for scene in written.scenes], axis=1)
    assert (visible & ~seen).any()


@pytest.mark.parametrize("disturbed", [False, True])
def test_a_bundle_adjustment_moves_no_camera_and_brings_one_back_that_was_moved(written, disturbed):
    pycolmap = pytest.importorskip("pycolmap")
    model = reconstruction(written)
    before = {number: image.cam_from_world().matrix() for number, image in model.images.items()}
    if disturbed:
        away = np.random.default_rng(1)
        for point in model.points3D.values():
            point.xyz = point.xyz + away.normal(scale=0.01, size=3)
        frame = model.frames[model.images[3].frame_id]
        turn = pycolmap.Rotation3d(np.array([0.002, -0.001, 0.003]))
        pose = frame.rig_from_world
        frame.rig_from_world = pycolmap.Rigid3d(turn * pose.rotation, pose.translation + np.array([0.02, -0.01, 0.03]))
        assert np.abs(model.images[3].cam_from_world().matrix() - before[3]).max() > 0.01
    config, options = pycolmap.BundleAdjustmentConfig(), pycolmap.BundleAdjustmentOptions()
    for number in model.images:
        config.add_image(number)
    for number in model.cameras:
        config.set_constant_cam_intrinsics(number)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    options.print_summary = False
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()
    off = max(np.abs(image.cam_from_world().matrix() - before[number]).max() for number, image in model.images.items())
    scene = 10.0  # from the cameras to the farthest points
    assert off <= 1e-6 * scene, f"a camera was moved by {off:.3g}"


def test_what_moves_from_picture_to_picture_has_no_track_from_one_to_the_other(tmp_path):
    """The first two pictures have the cubes here, the others there: where they were, the floor is seen now."""
    there = np.array([moved(1.6, 0.5, 0.4, 0.3, 0.4), moved(0.3, 2, 0.8, 0.1, 0.8)])
    scenes = [room(replace(CAMERA, eye=eye), cubes=there if i > 1 else None) for i, eye in enumerate(EYES)]
    shots = labeled(tmp_path / "shots", scenes)
    colmap.write(shots, tmp_path / "model")
    _, colors, visible = points_of(tmp_path / "model")
    ids = colors @ [1, 256, 65536]
    labels = vp.label(scenes[0], ("masks",)).instances
    still, moving = (next(each["id"] for each in labels if (each["name"], each["number"]) == ("Cube", i)) for i in range(2))
    crosses = visible[:, :2].any(axis=1) & visible[:, 2:].any(axis=1)
    assert (ids == moving).sum() > 10 and not crosses[ids == moving].any()
    assert crosses[ids == still].any() and crosses[ids == next(each["id"] for each in labels if each["name"] == "Floor")].any()


def test_points_lie_evenly_over_what_is_shown():
    state = np.zeros((48, 64), int)
    actual = surface_points.sampled(
        0, Camera("shot", CAMERA), np.full((48, 64), 5.0), state, np.zeros((48, 64, 3), np.uint8), 192
    )
    column, row, _ = CAMERA.project(actual.positions)
    counts = np.histogram2d(row, column, bins=(6, 8), range=((0, 48), (0, 64)))[0]
    assert counts.sum() == 192 and counts.min() > 0
    assert counts.std() <= 1.2, f"4 are wanted in each 8 × 8 pixels; they spread by {counts.std():.3g}, and thrown dice's by 2"


def test_the_same_labels_give_the_same_bytes(written, tmp_path):
    colmap.write(written.shots, tmp_path / "again", 600)
    first, second = (
        {path.name: path.read_bytes() for path in folder.iterdir()} for folder in (written.model, tmp_path / "again")
    )
    assert first == second and set(first) == {"cameras.txt", "images.txt", "points3D.txt", "points3D.ply"}


def test_points_come_into_the_model_of_cameras_alone_that_a_batch_has_written_and_into_no_other(written, tmp_path, capfd):
    """`viewcam batch --transforms` makes sparse/0 without points, and there its points were refused."""
    model = tmp_path / "sparse" / "0"
    shutil.copytree(written.model, model)
    heads = [line for line in (model / "points3D.txt").read_text().splitlines() if line.startswith("#")]
    (model / "points3D.txt").write_text("\n".join(heads) + "\n")
    (model / "points3D.ply").unlink()
    assert main(["labels", str(written.shots), str(model), "--to", "colmap", "--points", "600"]) == 0
    assert (model / "points3D.txt").read_bytes() == (written.model / "points3D.txt").read_bytes()
    assert [path.name for path in model.parent.iterdir()] == ["0"]
    capfd.readouterr()
    assert main(["labels", str(written.shots), str(model), "--to", "colmap"]) == 2, "it has points now"
    (model / "points3D.txt").write_text("")
    (model / "notes.txt").write_text("mine")
    assert main(["labels", str(written.shots), str(model), "--to", "colmap"]) == 2
    assert capfd.readouterr().err.count("is there already") == 2 and (model / "notes.txt").read_text() == "mine"


def test_tracks_may_be_shortened_and_lead_over_all_pictures_still():
    rng = np.random.default_rng(1)
    observations = [(np.flatnonzero(rng.random(500) < 0.7), None) for _ in range(20)]
    observations = [(which, np.stack([which, which + 0.5], axis=-1)) for which, _ in observations]
    short = colmap._shortened(observations, 4)
    before, after = (np.bincount(np.concatenate([which for which, _ in each]), minlength=500) for each in (observations, short))
    assert (after == np.minimum(before, 4)).all()
    assert all(
        set(which) <= set(all_of) and (places[:, 0] == which).all()
        for (which, places), (all_of, _) in zip(short, observations, strict=True)
    )
    counts = [len(which) for which, _ in short]
    assert min(counts) > 0.7 * np.mean(counts), "no picture goes without"


@pytest.mark.parametrize("form", ["colmap", "bop", "kitti"])
def test_overwrite_replaces_what_was_written_so_and_nothing_else(tmp_path, capfd, form):
    scenes = [room(replace(CAMERA, eye=eye)) for eye in EYES[:2]]
    shots, out = labeled(tmp_path / "shots", scenes, ("depth", "masks", "amodal")), tmp_path / "out"
    words = ["labels", str(shots), str(out), "--to", form]
    assert main(words) == 0 and main(words) == 2
    before = {path.relative_to(out): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    (shots / "1.labels.json").unlink()
    assert main([*words, "--overwrite"]) == 0
    after = {path.relative_to(out): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert after.keys() < before.keys() or after != before
    (out / "notes.txt").write_text("mine")
    capfd.readouterr()
    assert main([*words, "--overwrite"]) == 2 and "is there already" in capfd.readouterr().err
    assert (out / "notes.txt").read_text() == "mine"


def test_a_picture_beside_its_labels_is_the_one_that_is_named(tmp_path):
    shots = labeled(tmp_path / "shots", [room()])
    (shots / "0.png").write_bytes(encoded(np.zeros((48, 64, 3), np.uint8)))
    assert colmap.write(shots, tmp_path / "model") == {"images": 1, "points": 0, "observations": 0}
    assert " 1 0.png\n" in (tmp_path / "model" / "images.txt").read_text()
    (shots / "0.png").write_bytes((shots / "0.png").read_bytes()[:50])
    with pytest.raises(InputError, match=r"0\.png is no PNG of 8 or 16 bits that can be read"):
        colmap.write(shots, tmp_path / "another")


@pytest.mark.parametrize(
    ("name", "kinds", "words", "sentence"),
    [
        ("a", ("depth",), [], "a.labels.json has no masks: render it with --labels depth,masks"),
        ("a", ("masks",), [], "a.labels.json has no depth: render it with --labels depth,masks"),
        ("a b", ("depth", "masks"), [], "can't name a picture with a space"),
        ("a", ("depth", "masks"), ["--to", "bop", "--points", "9"], "--points are those of a COLMAP model"),
    ],
)
def test_what_can_not_be_written_is_one_sentence_and_leaves_no_folder(tmp_path, capfd, name, kinds, words, sentence):
    files.write(tmp_path / f"{name}.exr", vp.label(room(), kinds))
    before = sorted(path.name for path in tmp_path.iterdir())
    assert main(["labels", str(tmp_path), str(tmp_path / "out"), "--to", "colmap", *words]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and "bug" not in line
    assert sorted(path.name for path in tmp_path.iterdir()) == before, "something was left behind"
