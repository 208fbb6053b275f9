"""The moves of a camera: what each keeps, what each does on paper, and how far float64 lets them be off."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from viewcam_addon import moves
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

ROUNDING = 2.0**-53
Z = (0.0, 0.0, 1.0)

coordinates = st.floats(-1e3, 1e3, allow_subnormal=False)
triples = st.tuples(coordinates, coordinates, coordinates)
angles = st.floats(-math.pi, math.pi, allow_subnormal=False)
margins = st.floats(0, 0.4)


@st.composite
def pinholes(draw):
    """Cameras whose view is a meter long or more, of any up that is not within 1e-3 of it, of any principal point nearby."""
    eye, look_at, up = draw(triples), draw(triples), draw(triples)
    assume(math.dist(eye, look_at) > 1 and math.hypot(*up) > 1e-3)
    width, height = draw(st.integers(1, 4000)), draw(st.integers(1, 4000))
    distance = draw(st.floats(10, 1e4))
    principal_point = (width * draw(st.floats(0.42, 0.58)), height * draw(st.floats(0.42, 0.58)))
    pair = (distance, distance * draw(st.floats(0.5, 2)))
    pinhole = Pinhole(eye, look_at, up, pair, width, height, principal_point, draw(st.booleans()))
    assume(pinhole.sine_to_up > 1e-3)
    return pinhole


def clouds(least=2):
    return arrays.arrays(np.float64, st.tuples(st.integers(least, 12), st.just(3)), elements=coordinates)


def largest(pinhole, *more):
    """The largest coordinate that goes into a camera."""
    return max(np.abs(np.concatenate([pinhole.eye, pinhole.look_at, *map(np.ravel, more)])).max(), 1e-3)


def axes_error(first, second):
    return np.abs(np.subtract(first.basis(), second.basis())).max()


def turn_allowed(pinhole):
    """The turn of the view by an eye rounded once (three operations on components up to M), and 16e-16 of two bases.

    The roll turns by as much over the sine of the angle between the view and up.
    """
    turn = 4 * ROUNDING * largest(pinhole) / math.dist(pinhole.eye, pinhole.look_at) + 16e-16
    return 2 * turn / pinhole.sine_to_up


# --- Swap -------------------------------------------------------------------------------------------------------------------


@given(pinholes())
def test_swapping_twice_is_the_very_same_camera_and_once_looks_back(pinhole):
    back = moves.swapped(pinhole)
    assert moves.swapped(back) == pinhole
    assert (back.basis()[2] == -pinhole.basis()[2]).all(), "the view back is not exactly opposite"
    assert back.up == pinhole.up


# --- Dolly ------------------------------------------------------------------------------------------------------------------


@given(pinholes(), st.floats(1, 1e4))
@example(Pinhole((0, 0, 5), (0, 0, 0), Z, 1000, 640, 480), 2.0)
def test_dolly_keeps_the_view_and_reaches_its_distance(pinhole, reach):
    moved = moves.dollied(pinhole, reach)
    assert moved.look_at == pinhole.look_at and moved.distance == pinhole.distance
    sine = pinhole.sine_to_up or 1.0  # the canonical axes of a view along z stay exactly what they are
    allowed = (4 * ROUNDING * (largest(moved) + largest(pinhole)) + 16e-16) * 2 / sine
    error = axes_error(moved, pinhole)
    assert error <= allowed, f"the axes turned by {error:.3g}, {allowed:.3g} is allowed"
    assert math.dist(moved.eye, moved.look_at) == pytest.approx(reach, abs=8 * ROUNDING * (largest(moved) + reach))


@pytest.mark.parametrize("up", [Z, (0, 1, 0), (1, 2, 3)])
def test_dolly_along_an_axis_keeps_every_bit(up):
    for axis in np.eye(3):
        pinhole = Pinhole(tuple(4 * axis), (0, 0, 0), up, 1000, 640, 480)
        moved = moves.dollied(pinhole, 16.0)
        assert moved.eye == tuple(16 * axis) and moved.up == pinhole.up
        assert np.array_equal(moved.basis(), pinhole.basis())


def test_dolly_keeps_the_picture_of_a_view_along_an_oblique_up_which_its_rounding_would_turn():
    pole = np.array([1.0, 2, 3])
    pinhole = Pinhole(tuple(pole), (0, 0, 0), tuple(pole), 1000, 640, 480)
    assert pinhole.is_singular
    moved = moves.dollied(pinhole, 0.7)
    assert axes_error(moved, pinhole) <= 16e-16
    assert not moved.is_singular, "it stays the same picture by chance only"


@pytest.mark.parametrize("reach", [0, -1.0, math.nan, math.inf, "far"])
def test_a_distance_that_is_none_is_refused(reach):
    with pytest.raises(InputError, match="distance to the look-at point is"):
        moves.dollied(Pinhole((5, 0, 0), (0, 0, 0), Z, 1000, 640, 480), reach)


# --- Orbit ------------------------------------------------------------------------------------------------------------------


@given(pinholes(), angles, angles)
def test_orbit_there_and_back_is_the_identity(pinhole, around, upwards):
    there = moves.orbited(pinhole, around, upwards)
    assume(there.sine_to_up > 1e-3)
    hangs = there.up != pinhole.up
    back = moves.orbited(there, around if hangs else -around, -upwards)
    # Two eyes rounded, and the second orbit starts from the axes of the first.
    scale = largest(pinhole) + largest(there)
    allowed = turn_allowed(there) + turn_allowed(pinhole) + turn_allowed(back)
    apart = math.dist(back.eye, pinhole.eye)
    assert apart <= allowed * math.dist(pinhole.eye, pinhole.look_at) + 8 * ROUNDING * scale, f"the eye is {apart:.3g} off"
    assert axes_error(back, pinhole) <= allowed
    assert back.up == pinhole.up and back.look_at == pinhole.look_at


@given(pinholes(), angles, angles)
def test_orbit_keeps_the_distance_and_turns_the_axes_as_a_rigid_body(pinhole, around, upwards):
    moved = moves.orbited(pinhole, around, upwards)
    reach = math.dist(pinhole.eye, pinhole.look_at)
    assert math.dist(moved.eye, moved.look_at) == pytest.approx(reach, abs=8 * ROUNDING * (largest(moved) + reach))
    # First about u, then about up: u's angle to up stays 90°, or at the pole, where up is another, u stays perpendicular to it.
    up = np.array(pinhole.up) / np.linalg.norm(pinhole.up)
    expected = math.cos(around) * pinhole.basis()[0] + math.sin(around) * np.cross(up, pinhole.basis()[0])
    if not (around == upwards == 0):
        # Where the rule's u would be off by more than float32 holds, v is stated instead.
        allowed = 2.0**-24 + turn_allowed(pinhole)
        assert np.abs(moved.basis()[0] - expected).max() <= allowed


@given(pinholes())
def test_no_orbit_is_the_very_same_camera(pinhole):
    assert moves.orbited(pinhole, 0.0, 0.0) is pinhole


@pytest.mark.parametrize(
    ("around", "upwards", "eye", "up"),
    [
        (90, 0, (5, 0, 0), Z),  # from the front to the right
        (-90, 0, (-5, 0, 0), Z),
        (180, 0, (0, 5, 0), Z),
        (0, 30, (0, -5 * math.cos(math.pi / 6), 2.5), Z),
        (0, 90, (0, 0, 5), (0, 1, 0)),  # the pole itself: v is stated
        (0, -90, (0, 0, -5), (0, -1, 0)),
        (0, 135, (0, 5 * math.sqrt(0.5), 5 * math.sqrt(0.5)), (0, 0, -1)),  # over the top, upside down
        (0, 180, (0, 5, 0), (0, 0, -1)),
        (90, 45, (5 * math.sqrt(0.5), 0, 5 * math.sqrt(0.5)), Z),
    ],
)
def test_orbits_on_paper(around, upwards, eye, up):
    pinhole = Pinhole((0, -5, 0), (0, 0, 0), Z, 1000, 640, 480)
    moved = moves.orbited(pinhole, math.radians(around), math.radians(upwards))
    np.testing.assert_allclose(moved.eye, eye, atol=5 * 4 * ROUNDING)
    np.testing.assert_allclose(moved.up, up, atol=4 * ROUNDING)


def test_the_picture_turns_evenly_through_the_pole():
    """From 10° before it to 10° behind, in steps of 1° of which one is the pole: each turns the picture by 1° and no more."""
    pinhole = Pinhole((0, -5, 0), (0, 0, 0), Z, 1000, 640, 480)
    pictures = [np.array(moves.orbited(pinhole, 0.3, math.radians(angle)).basis()) for angle in range(80, 101)]
    turns = [math.asin(np.linalg.norm(b - a) / math.sqrt(8)) * 2 for a, b in itertools.pairwise(pictures)]
    np.testing.assert_allclose(np.degrees(turns), 1.0, atol=1e-5)  # float32's 2⁻²⁴ of a turn is 3.4e-6°


def test_an_orbit_straight_down_turns_the_picture_where_it_stands():
    pinhole = Pinhole((0, 0, 5), (0, 0, 0), Z, 1000, 640, 480)
    moved = moves.orbited(pinhole, math.radians(90), 0.0)
    np.testing.assert_allclose(moved.eye, (0, 0, 5), atol=16 * ROUNDING)
    np.testing.assert_allclose(moved.basis()[0], (1, 0, 0), atol=16 * ROUNDING)  # u was (0, −1, 0)


@pytest.mark.parametrize("angle", [math.nan, math.inf, None])
def test_an_orbit_by_no_angle_is_refused(angle):
    pinhole = Pinhole((5, 0, 0), (0, 0, 0), Z, 1000, 640, 480)
    with pytest.raises(InputError, match="angle around"):
        moves.orbited(pinhole, angle, 0.0)
    with pytest.raises(InputError, match="angle upwards"):
        moves.orbited(pinhole, 0.0, angle)


# --- Frame ------------------------------------------------------------------------------------------------------------------


def slack(pinhole, points, margin):
    """(n, 4): pixels by which each point is inside each of the four margin lines; and how far rounding may put it, (n,)."""
    column, row, depth = pinhole.project(points)
    right, top = (1 - margin) * pinhole.width, (1 - margin) * pinhole.height
    left, bottom = margin * pinhole.width, margin * pinhole.height
    inside = np.stack([right - column, column - left, top - row, row - bottom], axis=-1)
    # An eye and a point rounded a few times, and a view turned by its rounding, seen from that depth; the picture's own size.
    reach = math.dist(pinhole.eye, pinhole.look_at)
    scale = largest(pinhole, points)
    apart = np.linalg.norm(points - np.array(pinhole.eye), axis=-1)
    turn = scale / reach / max(pinhole.sine_to_up, 1e-300) * apart
    picture = pinhole.width + pinhole.height
    along = np.hypot(column - pinhole.principal_point[0], row - pinhole.principal_point[1])
    allowed = 32 * ROUNDING * ((scale + turn) * (max(pinhole.distance) + along) / depth + picture)
    return inside, allowed


def check_framed(moved, points, margin):
    inside, allowed = slack(moved, points, margin)
    assert np.isfinite(inside).all(), "a point does not lie before the eye"
    worst = (inside + allowed[:, None]).min()
    assert worst >= 0, f"a point is {-inside.min():.3g} px outside, {allowed.max():.3g} is allowed"
    assert (inside <= allowed[:, None]).any(), f"no point touches the margin: the nearest is {inside.min():.3g} px away from it"


@given(pinholes(), clouds(), margins)
def test_framing_by_the_eye_has_every_point_inside_and_one_at_the_margin(pinhole, points, margin):
    try:
        moved = moves.framed_by_eye(pinhole, points, margin)
    except InputError as error:
        assert "axis" in str(error)
        assume(False)
    _, allowed = slack(moved, points, margin)
    assume(allowed.max() < 1e-3)  # else a point is in the eye but for rounding
    check_framed(moved, points, margin)
    assert moved.distance == pinhole.distance
    assert axes_error(moved, pinhole) <= 2.0**-24


@given(pinholes(), clouds(), margins)
def test_framing_by_the_distance_has_every_point_inside_and_one_at_the_margin(pinhole, points, margin):
    depth = pinhole.project(points)[2]
    assume(depth.max() > 1e-3)
    points = points[depth > 1e-3]
    try:
        moved = moves.framed_by_distance(pinhole, points, margin)
    except InputError as error:
        assert "axis" in str(error)
        assume(False)
    _, allowed = slack(moved, points, margin)
    assume(allowed.max() < 1e-3)
    check_framed(moved, points, margin)
    assert (moved.eye, moved.look_at, moved.up) == (pinhole.eye, pinhole.look_at, pinhole.up)
    assert moved.distance[1] / moved.distance[0] == pytest.approx(pinhole.distance[1] / pinhole.distance[0], rel=4 * ROUNDING)


@pytest.mark.parametrize("frame", [moves.framed_by_eye, moves.framed_by_distance])
def test_the_check_of_framing_sees_a_thousandth_too_near_and_too_far(frame):
    pinhole = Pinhole((0, -10, 0), (0, 0, 0), Z, 1000, 640, 480)
    points = np.array([[1.0, 0, 0], [-1, 0, 0.5], [0.2, 0.1, -1]])
    moved = frame(pinhole, points, 0.05)
    check_framed(moved, points, 0.05)
    for factor in (0.999, 1.001):
        wrong = dataclasses.replace(moved, distance=tuple(factor * distance for distance in moved.distance))
        with pytest.raises(AssertionError):
            check_framed(wrong, points, 0.05)


def looking_along_y(**changes):
    """640 × 480 pixels at d = 320: 45° to the right of the view lies at the right edge."""
    return dataclasses.replace(Pinhole((0, -10, 0), (0, 0, 0), Z, 320, 640, 480), **changes)


@pytest.mark.parametrize(
    ("points", "margin", "changes", "eye_y", "distance"),
    [
        ([[2, 0, 0]], 0, {}, -2, 1600),  # 2 to the right: 2 away at 45°, or d = 320 · 10/2
        ([[2, 0, 0], [-2, 0, 0]], 0.25, {}, -4, 800),  # half the picture is left
        ([[0, 0, 3]], 0, {}, -4, 800),  # 240 px upwards: 3 · 320/240, or 240 · 10/3
        ([[2, 3, 0]], 0, {}, 1, 2080),  # in front of the look-at point
        ([[2, 0, 0]], 0, {"mirrored": True}, -2, 1600),
        ([[2, 0, 0]], 0, {"principal_point": (480, 240)}, -4, 800),  # 160 px are left to the right
        ([[-2, 0, 0]], 0, {"principal_point": (480, 240)}, -4 / 3, 2400),  # and 480 to the left
        ([[0, 0, 3]], 0, {"distance": (320, 640)}, -8, 400),  # pixels half as high
    ],
)
def test_framing_on_paper(points, margin, changes, eye_y, distance):
    pinhole = looking_along_y(**changes)
    by_eye = moves.framed_by_eye(pinhole, points, margin)
    np.testing.assert_allclose(by_eye.eye, (0, eye_y, 0), atol=10 * 8 * ROUNDING)
    by_distance = moves.framed_by_distance(pinhole, points, margin)
    assert by_distance.distance[0] == pytest.approx(distance, rel=8 * ROUNDING)


def test_the_look_at_point_stays_before_the_eye_and_moves_only_if_the_eye_passes_it():
    pinhole = looking_along_y()
    assert moves.framed_by_eye(pinhole, [[2, 0, 0]]).look_at == (0, 0, 0)
    passed = moves.framed_by_eye(pinhole, [[2, 3, 0], [-1, 7, 0]])
    np.testing.assert_allclose(passed.eye, (0, 1, 0), atol=80 * ROUNDING)
    np.testing.assert_allclose(passed.look_at, (0, 5, 0), atol=80 * ROUNDING)  # the depths are 2 and 6
    at_the_eye = moves.framed_by_eye(pinhole, [[2, 2, 0], [-1, 7, 0]])
    np.testing.assert_allclose(at_the_eye.look_at, (0, 4.5, 0), atol=80 * ROUNDING)


@pytest.mark.parametrize(
    ("frame", "points", "changes", "message"),
    [
        (moves.framed_by_eye, [[0, 3, 0]], {}, "nearest of the points lies on the view axis"),
        (moves.framed_by_eye, [[0, -3, 0], [1, 5, 0]], {}, "nearest of the points lies on the view axis"),
        (moves.framed_by_distance, [[0, 3, 0], [0, 5, 0]], {}, "all of the points lie on the view axis"),
        (moves.framed_by_distance, [[1, 0, 0], [1, -10, 0]], {}, "not all of the points lie before the eye"),
        (moves.framed_by_eye, [[1, 0, 0]], {"principal_point": (700, 240)}, "take shift off"),
        (moves.framed_by_distance, [[1, 0, 0]], {"principal_point": (700, 240)}, "take shift off"),
        (moves.framed_by_eye, [[1, 0, 0]], {"principal_point": (640, 240)}, "take shift off"),
        (moves.framed_by_distance, [[1, 0, 0]], {"principal_point": (640, 240)}, "take shift off"),
        # At 60 px or more to the left for one, and at 700 px or less for the other, which is always twenty times as far out.
        (moves.framed_by_eye, [[-1, 0, 0], [-20, 0, 0]], {"principal_point": (700, 240)}, "take shift off"),
        (moves.framed_by_distance, [[-1, 0, 0], [-20, 0, 0]], {"principal_point": (700, 240)}, "take shift off"),
        (moves.framed_by_eye, np.empty((0, 3)), {}, "there are no points"),
        (moves.framed_by_eye, [1, 2, 3], {}, "points have the shape"),
        (moves.framed_by_distance, [[math.nan, 0, 0]], {}, "points holds nan"),
    ],
)
def test_what_cannot_be_framed_is_said(frame, points, changes, message):
    with pytest.raises(InputError, match=message):
        frame(looking_along_y(**changes), points)


@pytest.mark.parametrize("frame", [moves.framed_by_eye, moves.framed_by_distance])
@pytest.mark.parametrize("center", [640, 700])
def test_a_principal_point_at_the_margin_or_outside_frames_what_lies_on_its_other_side(frame, center):
    pinhole = looking_along_y(principal_point=(center, 240))
    points = np.array([[-4.0, 0, 0], [-7, 0, 1]])
    check_framed(frame(pinhole, points), points, 0.0)


@pytest.mark.parametrize("margin", [-0.01, 0.5, math.nan])
@pytest.mark.parametrize("frame", [moves.framed_by_eye, moves.framed_by_distance])
def test_a_margin_that_leaves_no_picture_is_refused(frame, margin):
    with pytest.raises(InputError, match="margin is"):
        frame(looking_along_y(), [[1, 0, 0]], margin)
