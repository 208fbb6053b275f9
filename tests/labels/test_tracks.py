"""Tracks of points: by rays in the scene, by the labels' own flow, and by the arrays' own matrices."""

from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon.cli import main
from viewcam_addon.labels import files, surface_points, tracks
from viewcam_addon.labels.surfaces import Surfaces

from .conftest import CAMERA, moved, room

EYES = [(1.0, -7, 3), (1.4, -6.9, 3.1), (1.8, -6.8, 3.2)]


@pytest.fixture(scope="module")
def sequence(tmp_path_factory):
    """Three scenes, in which the camera and the ball move, their folder of labels, and the tracks by the command."""
    scenes = [room(replace(CAMERA, eye=eye), ball=moved(0.25 * i, 0.1 * i, 0.7, 0.3 * i)) for i, eye in enumerate(EYES)]
    folder = tmp_path_factory.mktemp("tracks")
    for i, scene in enumerate(scenes):
        files.write(folder / "shots" / f"{i}.exr", vp.label(scene, ("depth", "masks")))
    assert main(["labels", str(folder / "shots"), str(folder / "tracks.npz"), "--to", "tracks", "--points", "900"]) == 0
    return scenes, folder


@pytest.fixture(scope="module")
def arrays(sequence):
    with np.load(sequence[1] / "tracks.npz") as archive:
        return dict(archive)


def sources(arrays):
    """The picture that each point was sampled in: an equal share each."""
    return np.repeat(np.arange(3), 300)[: arrays["valids"].shape[1]]


def test_the_arrays_are_those_of_pointodyssey(arrays):
    count = arrays["valids"].shape[1]
    assert count == 900
    shapes = {"trajs_2d": (3, count, 2), "trajs_3d": (3, count, 3), "visibs": (3, count), "valids": (3, count)}
    assert {name: each.shape for name, each in arrays.items()} == shapes | {"intrinsics": (3, 3, 3), "extrinsics": (3, 4, 4)}
    assert arrays["visibs"].dtype == bool and arrays["valids"].all()
    assert (arrays["visibs"] <= arrays["valids"]).all()


def test_places_are_the_points_by_the_matrices(arrays):
    points = np.concatenate([arrays["trajs_3d"], np.ones((*arrays["valids"].shape, 1))], axis=-1)
    camera = (arrays["extrinsics"][:, None] @ points[..., None])[..., :3, 0]
    pixels = (arrays["intrinsics"][:, None] @ camera[..., None])[..., 0]
    off = np.abs(pixels[..., :2] / pixels[..., 2:] - arrays["trajs_2d"]).max()
    # Points and places are float32 each: 64 pixels, and 10 units at 75 pixels from 4 units away.
    assert off < 64 * 2.0**-24 + 75 / 4 * 10 * 2.0**-24 * 2, f"a place is {off:.2g} pixels off"


def test_a_point_that_the_ball_carries_goes_where_the_flow_says(sequence, arrays):
    scenes, _ = sequence
    image = vp.label(scenes[0], ("flow", "masks"), next=scenes[1]).image
    flow = image["Forward Flow"][::-1].astype(float)
    own = sources(arrays) == 0
    column, row = np.floor(arrays["trajs_2d"][0, own]).astype(int).T
    moved_by = arrays["trajs_2d"][1, own].astype(float) - arrays["trajs_2d"][0, own]
    known = np.isfinite(flow[row, column]).all(axis=-1)
    off = np.abs(moved_by - flow[row, column])[known].max()
    assert known.sum() > 250 and off < 1e-4, f"a point is {off:.2g} pixels from where the flow leads"
    ball = image["Instance"][::-1, :, 0][row, column] == image["Instance"][::-1, :, 0][20, 26]
    assert ball.sum() > 5, "the test wants points of what moves"


def test_what_is_called_visible_rays_see_and_few_that_rays_see_are_missed(sequence, arrays):
    scenes, _ = sequence
    seen = []
    for number, scene in enumerate(scenes):
        positions = arrays["trajs_3d"][number].astype(float)
        none = np.full(len(positions), -1)
        # Points are off their surface by two roundings to float32 of 10 units, and steeper along a ray at an angle.
        seen.append(Surfaces(scene).seen_first(positions, none, none, 100 * 2.0**-24))
    seen = np.array(seen)
    wrong, missed = arrays["visibs"] & ~seen, ~arrays["visibs"] & seen
    assert not wrong.any(), f"{wrong.sum()} of {arrays['visibs'].sum()} places are hidden"
    assert missed.sum() < 0.2 * seen.sum() and not seen.all(), f"{missed.sum()} of {seen.sum()} are missed"


def test_that_test_finds_a_visibility_that_lets_all_pass(sequence, tmp_path, monkeypatch):
    monkeypatch.setattr(surface_points, "visible", lambda sampled, *_: (np.arange(len(sampled.source)), None))
    tracks.write(sequence[1] / "shots", tmp_path / "tracks.npz", 900)
    with np.load(tmp_path / "tracks.npz") as archive, pytest.raises(AssertionError, match="places are hidden"):
        test_what_is_called_visible_rays_see_and_few_that_rays_see_are_missed(sequence, dict(archive))


def test_what_deforms_or_goes_has_places_where_it_is_the_same_only(tmp_path):
    from .conftest import CUBE

    taller = replace(CUBE, vertices=CUBE.vertices * (1, 1, 1.2))
    for i, scene in enumerate((room(), room(geometries={"cube": taller}))):
        files.write(tmp_path / f"{i}.exr", vp.label(scene, ("depth", "masks")))
    counts = tracks.write(tmp_path, tmp_path / "tracks.npz", 800)
    with np.load(tmp_path / "tracks.npz") as archive:
        valids, places = archive["valids"], archive["trajs_2d"]
        assert not places[~valids].any() and not archive["visibs"][~valids].any()
    assert counts["pictures"] == 2 and counts["points"] == 800
    assert valids[0, :400].all() and valids[1, 400:].all()
    assert 20 < (~valids).sum() < 400, f"{(~valids).sum()} points belong to cubes"


def test_masks_without_depth_and_points_for_coco_are_one_sentence(tmp_path, capfd):
    files.write(tmp_path / "a.exr", vp.label(room(), ("masks",)))
    assert main(["labels", str(tmp_path), str(tmp_path / "tracks.npz"), "--to", "tracks"]) == 2
    assert "a.labels.json has no depth: render it with --labels depth,masks" in capfd.readouterr().err
    assert not (tmp_path / "tracks.npz").exists()
    assert main(["labels", str(tmp_path), str(tmp_path / "a.json"), "--points", "3"]) == 2
    assert "add --to colmap or --to tracks" in capfd.readouterr().err
