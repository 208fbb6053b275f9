"""Carrying the picture's axes through the pole: parallel transport, in figures derived from the arithmetic."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from viewcam_addon import roll
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole, basis

UP = np.array([0.0, 0.0, 1.0])
ALWAYS, TEN_DEGREES = math.pi / 2, math.radians(10)
# A turn is read off two bases, each component within 4e-16 (pinhole.py), and a dozen products and sums of numbers up to 2.
TURN = 16e-16

coordinates = st.floats(-1e3, 1e3, allow_subnormal=False)
angles = st.floats(-math.pi, math.pi)


def vectors(count):
    return arrays.arrays(np.float64, (count, 3), elements=coordinates)


def around(axis, start, angles):
    """`start` turned about the unit vector `axis` by each of the angles."""
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return cosine * start + sine * np.cross(axis, start) + (1 - cosine) * (axis @ start) * axis


def flight_over_the_top(frames, miss):
    """View directions w from 30° before the pole to 30° behind it, passing it at the angle `miss`."""
    along = np.linspace(-math.radians(30), math.radians(30), frames)
    side = np.array([1.0, 0.0, 0.0])
    middle = np.array([0.0, -math.sin(miss), math.cos(miss)])
    return np.sin(along)[:, None] * side + np.cos(along)[:, None] * middle


def pictures(w, roll_of_each):
    """(n, 3, 3): the picture's axes u', v', w of each pose."""
    return np.array(
        [np.array(roll.turned(Pinhole(e, (0, 0, 0), UP, 1.0, 1, 1), a).basis()) for e, a in zip(w, roll_of_each, strict=True)]
    )


def turns_between(axes):
    """The angle of the rotation from each picture's axes to the next's."""
    chord = np.linalg.norm(axes[1:] - axes[:-1], axis=(1, 2)) / math.sqrt(8)
    return 2 * np.arcsin(np.minimum(1.0, chord))


@given(vectors(4), angles, angles)
@example(np.array([[0, 0, 5.0], [0, 0, 0], [0, 0, 1], [0, 0, 0]]), 0.5, 0.25)
def test_a_turned_pinhole_has_its_axes_turned_and_its_view_kept(numbers, first, second):
    eye, look_at, up, _ = map(tuple, numbers)
    assume(math.dist(eye, look_at) > 1e-3 and math.hypot(*up) > 1e-3)
    level = Pinhole(eye, look_at, up, 700.0, 40, 30)
    u, v, w = level.basis()
    turned = roll.turned(level, first)
    expected = (math.cos(first) * u + math.sin(first) * v, math.cos(first) * v - math.sin(first) * u, w)
    assert np.abs(np.array(turned.basis()) - expected).max() <= TURN
    again, at_once = roll.turned(turned, second), roll.turned(level, first + second)
    assert np.abs(np.array(again.basis()) - at_once.basis()).max() <= 2 * TURN
    assert (turned.eye, turned.look_at, turned.distance) == (level.eye, level.look_at, level.distance)


def test_a_positive_roll_turns_the_picture_from_u_towards_v():
    level = Pinhole((0, -1, 0), (0, 0, 0), UP, 1.0, 1, 1)
    np.testing.assert_allclose(roll.turned(level, math.pi / 2).basis()[0], level.basis()[1], atol=TURN)


def test_no_roll_leaves_up_as_it_was_stated():
    level = Pinhole((1, 2, 3), (0, 0, 0), (0.1, 1e-9, 7.0), 1.0, 1, 1)
    assert roll.turned(level, 0.0) is level


@pytest.mark.parametrize("angle", [math.inf, -math.inf, math.nan])
def test_a_roll_that_is_no_angle_is_refused(angle):
    with pytest.raises(InputError, match="give a finite angle"):
        roll.turned(Pinhole((0, -1, 0), (0, 0, 0), UP, 1.0, 1, 1), angle)


@given(vectors(4), angles)
@example(np.array([[0, 0, 5.0], [0, 0, 0], [0, 0, 1], [0, 0, 1]]), 0.5)
@example(np.array([[0, 0, 5.0], [0, 0, 0], [1, 0, 0], [0, 0, 1]]), 0.0)
def test_a_roll_that_is_set_against_another_up_is_read_again(numbers, angle):
    eye, look_at, up, reference = map(tuple, numbers)
    assume(math.dist(eye, look_at) > 1e-3 and math.hypot(*up) > 1e-3 and math.hypot(*reference) > 1e-3)
    pinhole = Pinhole(eye, look_at, up, 700.0, 40, 30)
    rolled = roll.rolled(pinhole, reference, angle)
    assert abs(math.remainder(roll.angle_from(reference, rolled) - angle, 2 * math.pi)) <= 2 * TURN
    assert (rolled.eye, rolled.look_at, rolled.distance) == (pinhole.eye, pinhole.look_at, pinhole.distance)
    back = roll.rolled(rolled, reference, roll.angle_from(reference, pinhole))
    assert np.abs(np.array(back.basis()) - pinhole.basis()).max() <= 3 * TURN


@pytest.mark.parametrize("eye", [(0, 0, 5), (0, 0, -5)])
def test_a_view_along_the_up_that_roll_counts_from_has_the_canonical_axes_at_0(eye):
    pinhole = Pinhole(eye, (0, 0, 0), (0.3, 0.1, 0.2), 700.0, 40, 30)
    level = roll.rolled(pinhole, (0, 0, 1), 0.0)
    assert not level.is_singular
    np.testing.assert_array_equal(level.basis(), Pinhole(eye, (0, 0, 0), (0, 0, 1), 700.0, 40, 30).basis())


def test_no_roll_from_another_up_is_that_very_up():
    pinhole = Pinhole((1, 2, 3), (0, 0, 0), (0.1, 1e-9, 7.0), 1.0, 1, 1)
    assert roll.rolled(pinhole, (0, 0, 1), 0.0).up == (0, 0, 1)


@given(vectors(2), vectors(1))
def test_a_step_that_is_carried_does_not_turn_about_the_view(w, up):
    assume(np.linalg.norm(w, axis=-1).min() > 1e-3 and np.linalg.norm(up) > 1e-3)
    u, v, w_unit = basis(w, np.zeros(3), up)
    assume(np.linalg.norm(w_unit[0] + w_unit[1]) > 1e-3)
    (angle,), near = roll.steps(w, np.zeros((2, 3)), up, ALWAYS)
    assert near.all()
    after = math.cos(angle) * u[1] + math.sin(angle) * v[1]
    # The smallest rotation turns about w₀ × w₁, and leaves that axis' share of u as it is.
    axis = np.cross(*w_unit)
    assert abs(axis @ after - axis @ u[0]) <= TURN
    # And along the arc, the share of the tangent.
    assert abs(np.cross(axis, w_unit[1]) @ after - np.cross(axis, w_unit[0]) @ u[0]) <= TURN


@given(vectors(6), vectors(1))
@example(np.array([[0, 0, 1.0], [1e-9, 0, 1], [0, 0, 1], [0, 1e-300, 1], [0, 0, 2], [0, -1e-9, 1]]), UP[None])
def test_the_way_back_undoes_the_way_there(w, up):
    assume(np.linalg.norm(w, axis=-1).min() > 1e-3 and np.linalg.norm(up) > 1e-3)
    unit = w / np.linalg.norm(w, axis=-1, keepdims=True)
    assume(np.linalg.norm(unit[1:] + unit[:-1], axis=-1).min() > 1e-3)
    there_and_back = np.concatenate([w, w[-2::-1]])
    total = roll.carried(there_and_back, np.zeros(3), np.broadcast_to(up, there_and_back.shape), ALWAYS)[-1]
    # Ten steps, each as wrong as the arc's sum of ends is small: |w₀ + w₁| > 1e-3 halves the digits that its square costs.
    assert abs(math.remainder(total, 2 * math.pi)) <= 10 * TURN / 1e-3


@pytest.mark.parametrize("angle", [0.1, 5.0, 40.0, 89.0])
@pytest.mark.parametrize("pole", [1.0, -1.0])
def test_a_closed_loop_turns_the_picture_by_the_solid_angle_it_encloses(angle, pole):
    """About the pole itself: the rule turns once around, and what is left of it is 2π (1 − cos θ)."""
    steps, theta = 4000, math.radians(angle)
    azimuth = np.linspace(0, 2 * math.pi, steps + 1)
    x, y = math.sin(theta) * np.cos(azimuth), math.sin(theta) * np.sin(azimuth)
    w = np.stack([x, y, np.full(steps + 1, pole * math.cos(theta))], -1)
    total = roll.carried(w, np.zeros(3), np.broadcast_to(UP, w.shape), ALWAYS)[-1]
    # The polygon's corners are rounded off by arcs: 2π³/3n² cos θ sin² θ less, to first order, and as much again for the rest.
    allowed = 4 * math.pi**3 / 3 / steps**2 * math.cos(theta) * math.sin(theta) ** 2 + steps * TURN
    error = math.remainder(total - pole * 2 * math.pi * (1 - math.cos(theta)), 2 * math.pi)
    assert abs(error) <= allowed, f"{error:.1e} of {allowed:.1e}"


@pytest.mark.parametrize("miss", [0.0, 1e-17, 1e-9, math.radians(0.1), math.radians(9)])
@pytest.mark.parametrize("frames", [3, 60, 61, 1001])
def test_a_flight_over_the_top_never_turns_the_picture_more_than_the_view(frames, miss):
    w = flight_over_the_top(frames, miss)
    held = roll.carried(w, np.zeros(3), np.broadcast_to(UP, w.shape), TEN_DEGREES)
    turns = turns_between(pictures(w, held))
    views = np.arctan2(np.linalg.norm(np.cross(w[1:], w[:-1]), axis=-1), (w[1:] * w[:-1]).sum(-1))
    near = roll.steps(w, np.zeros(3), np.broadcast_to(UP, w.shape), TEN_DEGREES)[1]
    excess = (turns - views)[near].max()
    assert excess <= 1e-12, f"the picture turns {excess:.1e} rad more than the view"


@pytest.mark.parametrize("miss", [0.0, 1e-9, math.radians(0.1)])
def test_without_holding_the_same_flight_flips(miss):
    w = flight_over_the_top(60, miss)
    assert turns_between(pictures(w, np.zeros(60))).max() > math.radians(150)


@pytest.mark.parametrize("frames", [60, 61])
def test_straight_over_the_top_the_picture_ends_upside_down(frames):
    w = flight_over_the_top(frames, 0.0)
    held = roll.carried(w, np.zeros(3), np.broadcast_to(UP, w.shape), TEN_DEGREES)[-1]
    assert abs(abs(held) - math.pi) <= frames * TURN


@given(vectors(5), st.floats(0.0, 1.5))
def test_away_from_the_pole_the_roll_stays(w, within):
    w[:, 2] = 0.0
    assume(np.linalg.norm(w, axis=-1).min() > 1e-3)
    unit = w / np.linalg.norm(w, axis=-1, keepdims=True)
    assume(np.linalg.norm(unit[1:] + unit[:-1], axis=-1).min() > 1e-3)
    assert (roll.carried(w, np.zeros(3), np.broadcast_to(UP, w.shape), within) == 0).all()


@given(st.floats(0.001, 1.4), st.floats(0.001, 1.4), st.floats(-2.5, 2.5), st.floats(0.01, 1.5))
def test_a_step_is_near_where_any_point_of_its_arc_is(start, end, azimuth, within):
    a, b = ([math.sin(t) * math.cos(f), math.sin(t) * math.sin(f), math.cos(t)] for t, f in ((start, 0.0), (end, azimuth)))
    share = np.linspace(0, 1, 2001)[:, None]
    arc = (1 - share) * np.array(a) + share * np.array(b)
    closest = np.arctan2(np.hypot(arc[:, 0], arc[:, 1]), np.abs(arc[:, 2])).min()
    assume(abs(closest - within) > 1e-2)  # the 2001 points are up to that apart
    assert roll.steps([a, b], np.zeros(3), np.tile(UP, (2, 1)), within)[1].item() == (closest < within)


@pytest.mark.parametrize("length", [1e-8, 1e-14, 3e-16, 0.0])
def test_the_shortest_step_far_from_the_pole_is_not_near(length):
    random = np.random.default_rng(5)
    w = random.normal(size=(400, 3))
    w[:, 2] = 0.3 * np.abs(w[:, :2]).max(-1)
    pairs = np.stack([w, w + length * random.normal(size=w.shape)], 1)
    assert not any(roll.steps(pair, np.zeros(3), np.tile(UP, (2, 1)), TEN_DEGREES)[1].any() for pair in pairs)


def test_a_step_across_the_pole_is_near_though_its_ends_are_not():
    turns, near = roll.steps([(1, 0, 1), (-1, 0, 1)], np.zeros(3), np.tile(UP, (2, 1)), 0.01)
    assert near.all()
    assert abs(abs(turns.item()) - math.pi) <= TURN


def test_up_that_sweeps_through_the_view_is_as_near_as_a_view_that_sweeps_through_up():
    up = [(0.2, 0, 1), (-0.2, 0, 1)]
    turns, near = roll.steps([(0, 0, 1), (0, 0, 1)], np.zeros(3), up, 0.01)
    assert near.all()
    assert abs(abs(turns.item()) - math.pi) <= TURN


def test_up_that_is_reversed_at_once_turns_the_picture_as_it_says():
    _, near = roll.steps([(0, -1.0, 0.3), (0, -1.0, 0.3)], np.zeros(3), [(0, 0, 1.0), (0, 0, -1.0)], 0.5)
    assert not near.any()


def test_a_view_that_turns_with_up_is_not_near():
    up = np.array([(0, 0, 1.0), (0, 1.0, 0)])
    _, near = roll.steps([(0, -1.0, 0), (0, 0, 1.0)], np.zeros(3), up, 0.5)
    assert not near.any()


@pytest.mark.parametrize("w", [(1.0, 0, 0), (0.3, 0.4, 0.5), (0, 0, 1.0)])
def test_a_step_to_the_opposite_direction_is_half_a_turn_about_u(w):
    turns, near = roll.steps([w, tuple(-x for x in w)], np.zeros(3), np.tile(UP, (2, 1)), 0.0)
    before, after = basis(w, np.zeros(3), UP), basis([-x for x in w], np.zeros(3), UP)
    (angle,) = turns
    assert near.all()
    np.testing.assert_allclose(math.cos(angle) * after[0] + math.sin(angle) * after[1], before[0], atol=TURN)


def test_many_poses_are_the_same_steps_one_by_one():
    random = np.random.default_rng(3)
    e, l, up = random.normal(size=(3, 50, 3))
    turns, near = roll.steps(e, l, up, 0.5)
    for i in range(49):
        turn, is_near = roll.steps(e[i : i + 2], l[i : i + 2], up[i : i + 2], 0.5)
        assert abs(turn.item() - turns[i]) <= TURN and is_near.item() == near[i]
    assert 0 < near.sum() < 49


def test_a_pose_that_is_none_is_named():
    with pytest.raises(InputError, match="pose 1: eye and look_at are the same point"):
        roll.steps([(1, 2, 3), (0, 0, 0)], np.zeros(3), np.tile(UP, (2, 1)), 0.5)
