"""Pictures of the paper scene: what a float32 renderer does passes, and what isn't comparable is refused in one sentence.

Pixels on edges: explained by a shift within tolerance, and by nothing else.

Tolerances in places where its answer is known on paper.

The figures of a pass.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.comparison.mismatches import KINDS, largest_around, reach_of
from viewcam_addon.comparison.statistics import measure
from viewcam_addon.comparison.tolerances import PERCENTILES, ROUNDINGS
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole


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


def edge_pixels(scene, shift):
    """Pixels that see another object when the ray moves to the right by `shift`."""
    exact, moved = scene.picture(), scene.picture(0.5 + shift, 0.5)
    rows, columns = np.nonzero(exact["Object Index"][..., 0] != moved["Object Index"][..., 0])
    return exact, moved, rows, columns


def with_pixels_of(image, other, rows, columns):
    passes = {name: values.copy() for name, values in image.passes.items()}
    for name, values in passes.items():
        values[rows, columns] = other.passes[name][rows, columns]
    return replace(image, passes=passes)


def test_a_ray_that_was_moved_within_tolerance_is_explained_and_the_shift_is_about_what_it_was(far_scene):
    shift = 0.05
    exact, moved, rows, columns = edge_pixels(far_scene, shift)
    test = with_pixels_of(exact, moved, rows, columns)
    comparison = compare(exact, test, far_scene.pinhole, far_scene.surfaces_at).mismatches
    assert len(comparison.kinds) >= len(rows) > 5
    assert comparison.explained.all()
    assert (comparison.shifts <= comparison.reach).all()
    # A smaller shift in another direction may do; the rings grow by at most a factor of 2.2, and directions are 22.5° apart.
    assert comparison.shifts.max() <= 2.3 * shift


def test_a_ray_that_was_moved_beyond_tolerance_is_not_explained(paper_scene):
    shift = 0.3
    exact, moved, rows, columns = edge_pixels(paper_scene, shift)
    comparison = compare(
        exact, with_pixels_of(exact, moved, rows, columns), paper_scene.pinhole, paper_scene.surfaces_at
    ).mismatches
    beyond = (~comparison.explained).sum()
    assert beyond > 0.9 * len(rows), f"{beyond} of {len(rows)} stayed unexplained"


def test_the_right_object_at_a_wrong_depth_is_not_explained(far_scene):
    exact, moved, rows, columns = edge_pixels(far_scene, 0.02)
    deeper = replace(
        moved, passes={**moved.passes, "Depth": np.where(moved["Depth"] < 1e10, moved["Depth"] * np.float32(1.3), 1e10)}
    )
    # Only where the ray slipped to the ground: next to the rim of a sphere depth has no slope that bounds it.
    on_ground = deeper["Object Index"][rows, columns, 0] == 1
    test = with_pixels_of(exact, deeper, rows[on_ground], columns[on_ground])
    comparison = compare(exact, test, far_scene.pinhole, far_scene.surfaces_at).mismatches
    assert comparison.unexplained_count == on_ground.sum() > 0


def test_kinds_are_counted(far_scene):
    exact = far_scene.picture()
    passes = {name: values.copy() for name, values in exact.passes.items()}
    on_ground = np.argwhere(exact["Object Index"][..., 0] == 1)[100]
    row, column = on_ground
    passes["Depth"][row, column] = np.nan
    passes["Object Index"][row, column + 1] = 9
    passes["Material Index"][row, column + 2] = 9
    passes["Depth"][row, column + 3] *= 2
    for name in passes:
        passes[name][row, column + 4] = 1e10 if name == "Depth" else 0
    comparison = compare(exact, replace(exact, passes=passes), far_scene.pinhole, far_scene.surfaces_at).mismatches
    assert comparison.counts() == {
        "not a number": (1, 0),
        "object index": (1, 0),
        "material index": (1, 0),
        "surface": (1, 0),
        "coverage": (1, 0),
    }
    assert [KINDS[kind] for kind in comparison.kinds] == [
        "not a number",
        "object index",
        "material index",
        "surface",
        "coverage",
    ]
    assert (comparison.columns == column + np.arange(5)).all() and (comparison.rows == row).all()


def test_one_unexplained_pixel_in_a_million_is_allowed_and_in_a_small_picture_none(paper_scene):
    exact = paper_scene.picture()
    comparison = compare(exact, exact, paper_scene.pinhole)
    assert comparison.allowed_unexplained == 0
    large = replace(comparison, pinhole=replace(paper_scene.pinhole, width=1920, height=1080))
    assert large.allowed_unexplained == 2


def test_reach_takes_the_larger_side_of_an_edge_and_the_median_amid_nothing():
    shift = np.full((5, 7), np.nan)
    shift[:, 0], shift[:, 1] = 1e-4, 3e-4
    reach = reach_of(shift) / tolerances.ROUNDINGS[-1]
    assert reach[2] == pytest.approx([3e-4, 3e-4, 3e-4, 2e-4, 2e-4, 2e-4, 2e-4])


def test_largest_around_looks_one_pixel_far():
    values = np.zeros((5, 6))
    values[2, 3] = 1.0
    assert np.argwhere(largest_around(values)).tolist() == [[r, c] for r in (1, 2, 3) for c in (2, 3, 4)]


PINHOLE = Pinhole((0.0, 0.0, 10.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 1000.0, 64, 48)


def seen(**passes):
    return {name.replace("_", " "): np.atleast_2d(np.asarray(values, dtype=float)) for name, values in passes.items()}


def straight_down(depth=10.0, **passes):
    """A point on the view axis of PINHOLE, at this depth."""
    return seen(Depth=[[depth]], Position=[[0.0, 0.0, 10.0 - depth]], **passes)


def test_one_rounding_at_a_kilometer_seen_from_ten_meters_is_six_thousandths_of_a_pixel():
    shift = tolerances.ray_shift(PINHOLE, straight_down(Magnitude=[[1000.0]]))
    assert shift == pytest.approx([2**-24 * 1000 * (1000 + 10) / 10])


def test_a_ray_aside_of_the_axis_is_off_by_more_as_its_perspective_is_steeper():
    """At 60° off the axis t = 2 z: twice for its direction or distance, and twice for the slanted view plane."""
    aside = seen(Depth=[[5.0]], Position=[[np.sqrt(75.0), 0.0, 5.0]], Magnitude=[[10.0]])
    assert tolerances.ray_shift(PINHOLE, aside) == pytest.approx([2**-24 * 1000 * (10 + 10) / 5 * 2])


def test_without_magnitude_the_largest_coordinate_and_twice_the_distance_count():
    below, beside = [0.0, 0.0, -5.0], [30.0, 0.0, 10.0]
    assert tolerances.magnitude(PINHOLE, seen(Position=[below, beside])) == pytest.approx([10.0 + 2 * 15.0, 30.0 + 2 * 30.0])


def test_a_grazed_surface_is_allowed_more_and_a_facing_one_is_not():
    shifts = [tolerances.position_shift(PINHOLE, straight_down(Magnitude=[[10.0]], Facing=[[f]]))[0] for f in (1.0, 0.2, 0.02)]
    assert shifts[1] == shifts[0]
    assert shifts[2] == pytest.approx(10 * shifts[0])


def test_depth_error_is_the_finite_difference_of_a_tilted_plane_under_the_laws_shift():
    """A plane tilted by 60°: the relative depth error of a ray that is s pixels off, beside s / d of its own."""
    normal = np.array([np.sin(np.pi / 3), 0.0, np.cos(np.pi / 3)])

    def depth_at(px):
        return 10.0 * normal[2] / -(np.array([px / 1000.0, 0.0, -1.0]) @ normal)

    tilted = straight_down(Magnitude=[[10.0]], Facing=[[0.5]])
    s = tolerances.ray_shift(PINHOLE, tilted)[0]
    expected = abs(depth_at(s) - depth_at(0.0)) / 10.0 + s / 1000.0
    assert tolerances.depth_error(PINHOLE, tilted) == pytest.approx([expected], rel=1e-6)


def test_slopes_are_per_pixel_and_stop_at_the_objects_edge():
    columns = np.tile(np.arange(6.0), (4, 1))
    belongs = np.where(columns < 3, 1, 2)
    belongs[0, 0] = -1
    values = np.where(columns < 3, 0.25 * columns, 100 - 0.5 * columns)
    slopes = tolerances.slopes(values[..., None], belongs)
    assert (slopes[1:, :3] == 0.25).all()
    assert (slopes[1:, 3:] == 0.5).all()
    assert slopes[0, 0] == 0.0


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 1.0, np.pi])
def test_angles_are_exact_however_small(angle):
    a, b = np.array([[1.0, 0.0, 0.0]]), np.array([[np.cos(angle), np.sin(angle), 0.0]])
    # cos 1e-9 rounds to 1, and the chord keeps sin 1e-9: one rounding of float64.
    assert tolerances.angle_between(a, b) == pytest.approx([angle], rel=1e-8, abs=0)


def test_a_vector_without_length_is_far_from_every_direction():
    assert tolerances.angle_between(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))[0] > 1.0


def test_16_bit_octahedral_storage_stays_below_its_floor():
    """The derivation of NORMAL_STORAGE: encode, round to 16 bits, decode."""
    directions = np.random.default_rng(3).normal(size=(200_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[:, 2] = np.abs(directions[:, 2])  # the other half is folded in, with the same steps
    plane = directions[:, :2] / np.abs(directions).sum(axis=1, keepdims=True)
    rounded = np.round(plane * 32767) / 32767
    decoded = np.column_stack([rounded, 1 - np.abs(rounded).sum(axis=1)])
    decoded /= np.linalg.norm(decoded, axis=1, keepdims=True)
    worst = tolerances.angle_between(directions, decoded).max()
    assert 0.9 * tolerances.NORMAL_STORAGE < worst <= tolerances.NORMAL_STORAGE, (
        f"{worst:.3e} rad against {tolerances.NORMAL_STORAGE:.3e}"
    )


# --- What the distance from the origin costs is told where another origin would mend it, and nowhere else


@pytest.fixture
def compared(paper_scene):
    """A function that compares the picture of a float32 renderer so far from the origin; `change` is applied to the pinhole."""

    def make(away, roundings=0.2, **change):
        offset = (away, 0.0, 0.0)
        eye, look_at = (tuple(np.add(point, offset)) for point in (paper_scene.pinhole.eye, paper_scene.pinhole.look_at))
        pinhole = replace(paper_scene.pinhole, eye=eye, look_at=look_at, **change)
        scene = replace(paper_scene, pinhole=pinhole, offset=offset)
        return compare(scene.picture(), scene.rendered(roundings), pinhole, scene.surfaces_at)

    return make


@pytest.mark.parametrize("away", [1e6, 4e6])
def test_a_camera_far_from_the_origin_is_told_what_it_costs_and_what_to_do(away, compared):
    comparison = compared(away)
    far = comparison.far_from_origin
    assert far.measured and far.error == comparison.rows[0].values[0] > 0.1
    # 2⁻²⁴ · d · away / z pixels for a rounding, of which the renderer makes 0.2 each way.
    assert far.error == pytest.approx(0.2 * 2**-24 * 300 * away / 10, rel=1)
    assert f"the camera stands {away:.1e} from the origin: check with --recenter" in far.sentence
    assert far.sentence in comparison.lines() and comparison.lines()[-1] == comparison.sentence
    assert comparison.to_json()["far_from_origin"]["sentence"] == far.sentence


@pytest.mark.parametrize("away", [0.0, 100.0, 1e4, 1e5])
def test_near_home_nothing_is_told(away, compared):
    comparison = compared(away)
    assert comparison.far_from_origin is None and comparison.to_json()["far_from_origin"] is None
    assert not any("--recenter" in line for line in comparison.lines())


def test_an_error_that_no_other_origin_mends_is_not_blamed_on_this_one(compared, paper_scene):
    """A telephoto lens at the origin errs by a pixel too; a long slender triangle likewise, however far from the origin."""
    telephoto = compared(0.0, distance=1e7, width=32, height=32, principal_point=None)
    assert telephoto.rows[0].values[0] > 0.1 and telephoto.far_from_origin is None
    reference = paper_scene.picture()
    slender = replace(reference, passes=reference.passes | {"Magnitude": reference["Magnitude"] * np.float32(1e6)})
    comparison = compare(slender, paper_scene.rendered(0.2e6), paper_scene.pinhole, paper_scene.surfaces_at)
    assert comparison.far_from_origin is None


@pytest.mark.slow
def test_an_error_beyond_the_tolerance_has_another_cause(compared):
    comparison = compared(1e6, roundings=10)
    assert not comparison.rows[0].ok and comparison.far_from_origin is None


def test_where_no_pixel_can_be_compared_that_is_told(paper_scene):
    """At 1e9 neighboring float32 numbers are 64 apart: the test picture shows nothing at all."""
    offset = (1e9, 0.0, 0.0)
    eye, look_at = (tuple(np.add(point, offset)) for point in (paper_scene.pinhole.eye, paper_scene.pinhole.look_at))
    pinhole = replace(paper_scene.pinhole, eye=eye, look_at=look_at)
    scene = replace(paper_scene, pinhole=pinhole, offset=offset)
    reference = scene.picture()
    nothing = {name: np.zeros_like(values) for name, values in reference.passes.items()}
    nothing["Depth"] += np.float32(1e10)
    far = compare(reference, replace(reference, passes=nothing), pinhole).far_from_origin
    assert not far.measured and far.error == pytest.approx(tolerances.ROUNDINGS[0] * 2**-24 * 300 * 1e9 / 10, rel=1)
    assert "may be" in far.sentence


def test_two_empty_pictures_have_nothing_to_say(paper_scene):
    reference = paper_scene.picture()
    nothing = {name: np.zeros_like(values) for name, values in reference.passes.items()}
    nothing["Depth"] += np.float32(1e10)
    empty = replace(reference, passes=nothing)
    assert compare(empty, empty, paper_scene.pinhole).far_from_origin is None


def test_percentiles_are_those_of_the_errors():
    row = measure("Position", "px", np.arange(1001.0), np.full(1001, 1000.0))
    assert row.values == pytest.approx((500.0, 900.0, 990.0, 999.0, 1000.0))
    assert row.count == 1001 and row.ok


def test_the_limit_itself_is_allowed_and_anything_above_is_not():
    limit = np.full(10, ROUNDINGS[0])
    assert measure("Position", "px", limit, np.ones(10)).worst == (50.0, 1.0)
    assert measure("Position", "px", limit, np.ones(10)).ok
    assert not measure("Position", "px", limit * (1 + 1e-12), np.ones(10)).ok


@pytest.mark.parametrize("position", range(len(PERCENTILES)))
def test_each_percentile_can_fail_alone(position):
    """Only so many errors as lie above this percentile exceed its tolerance, and they stay below the later ones'."""
    errors = np.zeros(100_001)
    above = [50_002, 10_002, 1_002, 102, 1][position]
    errors[:above] = ROUNDINGS[position] * 1.001
    row = measure("Position", "px", errors, np.ones_like(errors))
    assert [share > 1 for share in row.shares] == [i == position for i in range(len(PERCENTILES))], row.shares


def test_errors_can_not_hide_where_little_is_allowed():
    """Half of the pixels may be 1000 times worse; a percentile of the plain errors would hide the fault of the other half."""
    allowed = np.repeat([1.0, 1000.0], 500)
    errors = np.where(allowed == 1.0, 100.0, 0.0)
    assert not measure("Position", "px", errors, allowed).ok


def test_nothing_compared_is_not_well():
    row = measure("Position", "px", np.empty(0), np.empty(0))
    assert row.count == 0 and not row.ok


def test_storage_alone_is_allowed():
    assert measure("Normal", "°", np.full(5, 1e-3), np.zeros(5), floor=1e-3).ok
    assert measure("UV", "absolute", np.zeros(5), np.zeros(5)).ok
    assert not measure("UV", "absolute", np.full(5, 1e-30), np.zeros(5)).ok
