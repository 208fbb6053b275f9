"""Pictures of the paper scene: what a float32 renderer does passes, and what isn't comparable is refused in one sentence."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.errors import InputError


@pytest.mark.parametrize("seed", range(3))
def test_errors_within_the_tolerance_pass(seed, paper_scene):
    comparison = compare(paper_scene.picture(), paper_scene.rendered(seed=seed), paper_scene.pinhole, paper_scene.surfaces_at)
    assert comparison.passed, "\n".join(comparison.lines())


@settings(max_examples=20)
@given(
    azimuth=st.floats(0, 6.28),
    height=st.floats(1.5, 9),
    distance=st.floats(60, 2000),
    away=st.sampled_from([0.0, 1.0, 100.0, 1e4]),
    seed=st.integers(0, 99),
)
def test_errors_within_the_tolerance_pass_from_anywhere(azimuth, height, distance, away, seed, paper_scene):
    offset = (away, -away, away / 2)
    eye = np.array([7 * np.cos(azimuth), 7 * np.sin(azimuth), height]) + offset
    target = np.array([0.2, 0.1, 0.6]) + offset
    pinhole = replace(paper_scene.pinhole, eye=tuple(eye), look_at=tuple(target), distance=distance, width=120, height=90)
    scene = replace(paper_scene, pinhole=replace(pinhole, principal_point=None), offset=offset)
    comparison = compare(scene.picture(), scene.rendered(seed=seed), scene.pinhole, scene.surfaces_at)
    assert comparison.passed, "\n".join(comparison.lines())


def test_crossed_silhouettes_are_found_and_all_of_them_explained(far_scene):
    actual = 0
    for seed in range(4):
        comparison = compare(far_scene.picture(), far_scene.rendered(seed=seed), far_scene.pinhole, far_scene.surfaces_at)
        assert comparison.passed, "\n".join(comparison.lines())
        actual += len(comparison.mismatches.kinds)
        largest = np.nanmax(comparison.mismatches.shifts, initial=0.0)
        assert largest <= tolerances.ROUNDINGS[-1] * np.nanmax(comparison.mismatches.reach, initial=0.0)
    assert actual >= 4, f"only {actual} rays crossed an edge: the scene tests nothing"


def test_without_a_scene_a_crossed_silhouette_stays_unexplained_and_the_verdict_says_why(far_scene):
    comparison = compare(far_scene.picture(), far_scene.rendered(seed=1), far_scene.pinhole)
    assert not comparison.passed
    assert comparison.mismatches.unexplained_count == len(comparison.mismatches.kinds) > 0
    assert "give the scene" in comparison.sentence


def test_the_comparison_works_without_the_tracers_own_passes(paper_scene):
    reference = paper_scene.picture()
    bare = replace(reference, passes={name: reference[name] for name in ("Depth", "Position", "Normal", "Object Index")})
    comparison = compare(bare, paper_scene.rendered(), paper_scene.pinhole, paper_scene.surfaces_at)
    assert [row.name for row in comparison.rows] == ["Position", "Position depth", "Depth", "Normal"]
    assert comparison.passed, "\n".join(comparison.lines())


def test_maps_hold_the_errors_where_they_were_made(paper_scene):
    reference = paper_scene.picture()
    comparison = compare(reference, paper_scene.picture(0.75, 0.5), paper_scene.pinhole)
    errors = comparison.maps["Position"]
    assert errors.shape == (200, 320)
    assert np.isnan(errors[reference["Object Index"][..., 0] == 0]).all()
    # The positions are float32: 12 / 2²⁴ world units, 300 px / 5 units away.
    assert np.nanmax(np.abs(errors - 0.25)) < 1e-4


def test_the_result_is_plain_json_and_says_what_the_lines_say(paper_scene):
    comparison = compare(
        paper_scene.picture(), paper_scene.rendered(), paper_scene.pinhole, paper_scene.surfaces_at, paper_scene.pinhole
    )
    record = json.loads(json.dumps(comparison.to_json(), allow_nan=False))
    assert record["passed"] and record["passes"][0]["name"] == "Position"
    assert record["passes"][0]["count"] == comparison.rows[0].count
    assert record["conversion"]["largest"] < 1e-9  # float64 rounding of 320 px
    lines = comparison.lines()
    assert lines[-1] == record["sentence"]
    assert all(any(line.startswith(row.name) for line in lines) for row in comparison.rows)
    assert max(map(len, lines[:-1])) < 150


def test_pictures_of_different_size_are_refused(paper_scene):
    smaller = paper_scene.seen_by(replace(paper_scene.pinhole, width=100, principal_point=None))
    with pytest.raises(InputError, match="100 × 200 pixels and the camera 320 × 200"):
        compare(paper_scene.picture(), smaller.picture(), paper_scene.pinhole)


@pytest.mark.parametrize("name", ["Depth", "Position", "Normal", "UV", "Object Index", "Material Index"])
def test_a_missing_pass_is_named(name, paper_scene):
    picture = paper_scene.picture()
    without = replace(picture, passes={key: values for key, values in picture.passes.items() if key != name})
    with pytest.raises(InputError, match=f"'{name}'"):
        compare(picture, without, paper_scene.pinhole)


# A picture of 24 × 15 pixels, where all roundings together are smaller than what Cycles' filter table is off.
SMALL = {"width": 24, "height": 15, "distance": 22.5, "principal_point": None}
# Per axis, upwards to the right: 3.505e-4 of the filter's width of 0.01.
BIAS = 3.505e-6


def test_the_bias_of_cycles_filter_table_passes_however_small_the_picture(paper_scene):
    scene = paper_scene.seen_by(replace(paper_scene.pinhole, **SMALL))
    comparison = compare(scene.picture(), scene.picture(0.5 + BIAS, 0.5 + BIAS), scene.pinhole, scene.surfaces_at)
    assert comparison.passed, "\n".join(comparison.lines())
    assert np.median(comparison.roundings) > tolerances.ROUNDINGS[0], "roundings alone would allow it: the test tests nothing"


def test_four_times_that_bias_is_caught(paper_scene):
    scene = paper_scene.seen_by(replace(paper_scene.pinhole, **SMALL))
    off = 0.5 + 4 * BIAS
    assert not compare(scene.picture(), scene.picture(off, off), scene.pinhole, scene.surfaces_at).passed
