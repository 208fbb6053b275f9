"""The race of labels: both ways make the same, what is not the same is told, and neither a slow nor a wrong one passes."""

import dataclasses
import itertools
import json
import os

import numpy as np
import pytest

from benchmarks import labels, race
from benchmarks.speed import references
from viewcam_addon.errors import InputError
from viewcam_addon.labels import masks

# Contestants.


def offers(factor):
    def fail():
        raise KeyError("gone")

    return {
        "times": lambda number: factor * number,
        "environment": lambda: os.environ["A_CONTESTANT_S"],
        "fail": fail,
    }


def test_a_contestant_takes_arguments_and_finds_its_environment():
    with race.Contestant(offers, 3, environment={"A_CONTESTANT_S": "own"}) as contestant:
        asked = contestant.runners()
        assert asked["times"](4) == 12
        assert asked["environment"]() == "own"
    assert "A_CONTESTANT_S" not in os.environ


def test_what_goes_wrong_in_a_contestant_s_process_is_raised_here():
    with pytest.raises(InputError, match=r"KeyError.*gone"), race.Contestant(offers, 3) as contestant:
        contestant.runners()["fail"]()


# All of it.


def test_a_scene_is_raced_from_the_blend_to_the_charts(tmp_path, monkeypatch):
    """Both figures of the studio still, 96 × 54 pixels, to an error of 0.05."""
    pytest.importorskip("bpy")
    from benchmarks.speed import stills

    monkeypatch.setattr(references, "FOLDER", tmp_path)
    chosen = {f"{stills.OURS}, adaptive", f"{stills.OURS}, uniform", stills.CYCLES}
    few = [dataclasses.replace(each, parameters=each.parameters[:3]) for each in stills.METHODS if each.name in chosen]
    monkeypatch.setattr(stills, "METHODS", tuple(few))
    studio = next(still for still in stills.STILLS if still.name == "studio")
    samples = {stills.OURS: 1024, stills.CYCLES: 512}
    small = dataclasses.replace(studio, size=(384, 216), wanted={0.005: (8, 3)}, samples=samples)
    picture, job = stills.charts(small, quick=True)
    assert picture.name == "studio-picture" and job.name == "studio-whole-job"
    assert {curve.name for curve in picture.curves} == chosen
    measured = picture.figures()["methods"]
    for name, points in measured.items():
        errors = [point["error"] for point in points]
        assert errors == sorted(errors, reverse=True), f"{name} does not get better: {errors}"
    # Both sides see the same: their difference is noise, but for what chance and a few bright edges add.
    figures = picture.figures()["reference"]
    assert figures["sides differ by"] < 1.5 * figures["explained by noise"]


def test_mitsuba_converges_to_the_same_picture(tmp_path):
    """Two Lambert boxes under a sun, by its scalar variant: as far from ours as the noise of both."""
    mitsuba = pytest.importorskip("mitsuba")
    del mitsuba
    from benchmarks.speed import mitsuba3, tracer
    from viewcam_addon.pinhole import Pinhole
    from viewcam_addon.tracer.scene import Mesh, Object, Scene, scene_file
    from viewcam_addon.tracer.scene.film import Film
    from viewcam_addon.tracer.scene.lamps import Sun

    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([face for a, b, c, d in faces for face in ((a, b, c), (a, c, d))], np.int32)
    box = Mesh(corners, triangles, np.zeros(12, np.int32))
    floor = np.diag([8.0, 8.0, 0.1, 1.0])
    floor[2, 3] = -1.1
    scene = Scene(
        camera=Pinhole((3, -6, 3), (0, 0, 0), (0, 0, 1), 60, 64, 48),
        geometries={"box": box},
        objects=(Object("box", "box", np.eye(4)), Object("floor", "box", floor)),
        lamps=(Sun("sun", towards=(0.5, -0.3, 0.8), irradiance=(3.0, 2.0, 1.0)),),
        clip=(0.1, 100.0),
        film=Film("BOX"),
    )
    scene_file.write(scene, tmp_path / "scene.json")
    with race.Contestant(mitsuba3.prepare, tmp_path / "scene.json", tmp_path / "theirs", mitsuba3.SCALAR, 2) as expected:
        expected.runners()["picture"]("samples", 64, 1, tmp_path / "theirs.exr")
    tracer.prepare(tmp_path / "scene.json", "direct", 2)["picture"]("samples", 64, 1, tmp_path / "ours.exr")
    difference = references.combined(tmp_path / "theirs.exr") - references.combined(tmp_path / "ours.exr")
    # An edge's pixel is off by about 0.35 · 64^−¾ = 0.015 of its contrast, here 1; a tenth of the pixels have an edge, and both
    # sides noise: 0.015 √0.1 √2 = 0.007. A sun that is turned by a degree would be off by as much on every lit pixel.
    assert references.rms(difference) < 0.01, references.rms(difference)


def passes(seed=0, height=30, width=40):
    rng = np.random.default_rng(seed)
    index = np.repeat(np.arange(height)[:, None] // 10, width, axis=1)[..., None].astype(np.float32)
    depth = rng.uniform(2, 9, (height, width, 1)).astype(np.float32)
    places, normals = (rng.normal(size=(height, width, 3)).astype(np.float32) for _ in range(2))
    return {"Object Index": index, "Material Index": index.copy(), "Depth": depth, "Position": places, "Normal": normals}


def test_what_differs_by_less_than_the_tolerances_is_the_same_and_what_is_no_number_is_not():
    ours, expected = passes(), passes()
    expected["Depth"] = expected["Depth"] * np.float32(1 + 5e-5)
    assert labels.differences(ours, expected) == dict.fromkeys(labels.TOLERANCES, 0.0)
    for name, share in {"Depth": 1e-3, "Position": 2e-3, "Normal": 0.02, "Object Index": 1, "Material Index": 1}.items():
        for wrong in (share * 9, np.nan):
            expected = passes()
            expected[name][3, 4, -1] += wrong
            errors = labels.differences(ours, expected)
            assert errors.pop(name) == pytest.approx(1 / 1200) and not any(errors.values())


def test_the_slower_and_the_wrong_miss_what_is_wanted():
    good = dict.fromkeys(labels.TOLERANCES, 1e-4)
    seconds = {name: labels.Spent(wall, 1.0) for name, wall in {"ours": 10, "passes": 9, "made of them": 2}.items()}
    assert labels.judged(seconds, good)
    assert not labels.judged({**seconds, "ours": labels.Spent(11.5, 1.0)}, good)
    assert not labels.judged(seconds, {**good, "Normal": 2e-3})


@pytest.mark.exhaustive
def test_both_ways_label_the_studio_alike_and_a_camera_that_is_off_is_told(tmp_path):
    pytest.importorskip("bpy")
    shots = labels.orbit(labels.STILL.resized(160, 120), 3)
    seconds = labels.measured(shots, tmp_path)
    assert all(min(each) > 0 for each in seconds.values()) and len(list(labels.table(seconds, 3))) == 5
    assert max(labels.compared(shots, tmp_path).values()) <= labels.ON_EDGES
    ours = labels._ours(tmp_path / "ours", shots[0])
    for number, shot in enumerate(shots, 1):
        record = json.loads((tmp_path / "theirs" / f"{number:04d}.json").read_text())
        index = labels._ours(tmp_path / "ours", shot)["Object Index"][::-1, :, 0]
        for each in record:
            mask = masks.decoded(each["visible"]["segmentation"])
            assert (mask != (index == each["object_index"])).mean() <= labels.ON_EDGES
    shifted = {name: np.roll(values, 1, axis=1) for name, values in ours.items()}
    assert min(labels.differences(ours, shifted).values()) > 10 * labels.ON_EDGES
