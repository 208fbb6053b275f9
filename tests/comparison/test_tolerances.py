"""Tolerances in places where its answer is known on paper."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.pinhole import Pinhole

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
