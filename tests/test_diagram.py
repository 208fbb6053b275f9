import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.diagram import arrow, diagram, pixels_in_a_cell, up_tip
from viewcam_addon.pinhole import Pinhole

coordinates = st.floats(-1e3, 1e3).map(lambda x: round(x, 3))
points = st.tuples(coordinates, coordinates, coordinates)
sizes = st.integers(1, 8192)


@st.composite
def pinholes(draw):
    eye, look_at, up = draw(points), draw(points), draw(points.filter(any))
    if eye == look_at:
        look_at = (*look_at[:2], look_at[2] + 1)
    width, height = draw(sizes), draw(sizes)
    principal_point = draw(st.none() | st.tuples(st.floats(0, width), st.floats(0, height)))
    distance = draw(st.tuples(st.floats(10, 1e5), st.floats(10, 1e5)))
    return Pinhole(eye, look_at, up, distance, width, height, principal_point, draw(st.booleans()))


shares = st.floats(1e-4, 1)
PLAIN = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 1000, 2000, 1000)

# Each direction is within 1e-15 of its sample point's (Pinhole.ray_directions); a corner takes three more products and sums.
ROUNDING = 1e-14


def directions(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def test_the_figure_on_paper():
    """90° wide, 5 m away: at half the way the plane is 2.5 m away and 5 m wide."""
    figure = diagram(PLAIN, PLAIN.up, 0.5)
    np.testing.assert_allclose(figure.plane, [(-2.5, 2.5, -1.25), (2.5, 2.5, -1.25), (2.5, 2.5, 1.25), (-2.5, 2.5, 1.25)])
    np.testing.assert_allclose(figure.view, [(0, 0, 0), (0, 5, 0)])
    np.testing.assert_allclose(directions(figure.axes), [(1, 0, 0), (0, 0, 1), (0, -1, 0)])
    assert figure.up[2] > figure.axes[1, 2] > 0 and not figure.up[:2].any(), "up is longer than v, which covers it here"


@given(pinholes(), shares)
def test_the_corners_are_where_the_rays_through_the_pictures_corners_meet_the_plane(pinhole, share):
    figure = diagram(pinhole, pinhole.up, share)
    columns, rows = np.array([(0, 0), (pinhole.width, 0), (pinhole.width, pinhole.height), (0, pinhole.height)]).T
    expected = pinhole.ray_directions(columns, rows, 0.0, 0.0)
    assert np.abs(directions(figure.plane) - expected).max() <= ROUNDING
    depths = -figure.plane @ pinhole.basis()[2]
    wide = np.linalg.norm(figure.plane, axis=-1).max()  # a depth is a sum of products as large as that
    assert np.abs(depths - share * math.dist(pinhole.eye, pinhole.look_at)).max() <= ROUNDING * wide
    assert (figure.pyramid[:, 0] == 0).all() and (figure.pyramid[:, 1] == figure.plane).all()


@given(pinholes(), shares)
def test_each_line_of_the_grid_lies_between_pixels_in_the_plane(pinhole, share):
    figure = diagram(pinhole, pinhole.up, share)
    step = pixels_in_a_cell(pinhole.width, pinhole.height)
    columns, rows = range(step, pinhole.width, step), range(step, pinhole.height, step)
    ends = [((column, 0), (column, pinhole.height)) for column in columns]
    ends += [((0, row), (pinhole.width, row)) for row in rows]
    assert len(figure.grid) == len(ends)
    if ends:
        places = np.array(ends, dtype=float)
        expected = pinhole.ray_directions(places[..., 0], places[..., 1], 0.0, 0.0)
        assert np.abs(directions(figure.grid) - expected).max() <= ROUNDING


@given(sizes, sizes)
def test_the_grid_has_few_lines_whatever_the_resolution(width, height):
    step = pixels_in_a_cell(width, height)
    assert max(width, height) / step <= 16
    assert str(step).rstrip("0") in ("1", "2", "5"), f"{step} is no round number"
    assert step == 1 or max(width, height) / step > 16 / 2.5 - 1, f"{width} × {height}: {step} is more than it need be"


def test_a_small_picture_shows_each_pixel():
    figure = diagram(dataclasses.replace(PLAIN, width=4, height=2, principal_point=None), PLAIN.up, 1)
    assert len(figure.grid) == 3 + 1


@given(pinholes(), shares)
def test_the_line_of_the_view_ends_in_the_look_at_point(pinhole, share):
    figure = diagram(pinhole, pinhole.up, share)
    np.testing.assert_array_equal(figure.view[1], np.subtract(pinhole.look_at, pinhole.eye))


@given(pinholes(), shares, st.floats(1e-6, 1e6))
def test_the_length_of_up_does_not_matter(pinhole, share, factor):
    longer = tuple(factor * component for component in pinhole.up)
    tips = [up_tip(pinhole.eye, pinhole.look_at, up, share) for up in (pinhole.up, longer)]
    length = math.dist(tips[0], pinhole.eye)
    largest = max(*map(abs, pinhole.eye), length)
    assert math.dist(*tips) <= 8 * 2**-53 * largest, "a few roundings of the tip"
    cross = np.cross(np.subtract(tips[0], pinhole.eye), pinhole.up)
    assert np.abs(cross).max() <= 8 * 2**-53 * largest * math.hypot(*pinhole.up)


@pytest.mark.parametrize(
    "broken",
    [
        lambda pinhole: dataclasses.replace(pinhole, principal_point=(1000.5, 500)),
        lambda pinhole: dataclasses.replace(pinhole, mirrored=True, principal_point=(999, 500)),
        lambda pinhole: dataclasses.replace(pinhole, distance=1001),
        lambda pinhole: dataclasses.replace(pinhole, up=(0.001, 0, 1)),
    ],
    ids=["half a pixel", "mirrored", "0.1 % of d", "a turned up"],
)
def test_another_camera_has_another_plane(broken):
    plane = diagram(broken(PLAIN), PLAIN.up, 0.5).plane
    assert np.abs(plane - diagram(PLAIN, PLAIN.up, 0.5).plane).max() > 1e-4


def test_what_float32_can_not_draw_is_said():
    assert diagram(PLAIN, PLAIN.up, 0.5).is_drawable()
    assert not diagram(dataclasses.replace(PLAIN, distance=1e-300), PLAIN.up, 0.5).is_drawable()
    assert not diagram(dataclasses.replace(PLAIN, eye=(0, -1e30, 0)), PLAIN.up, 0.5).is_drawable()


@given(points.filter(any))
def test_an_arrow_has_its_shaft_and_four_barbs_of_one_length_that_all_end_in_its_tip(tip):
    tip = np.array(tip)
    lines, length = arrow(tip), np.linalg.norm(tip)
    assert lines.shape == (5, 2, 3) and (lines[:, 0] == tip).all() and not lines[0, 1].any()
    barbs = lines[1:, 1] - tip
    np.testing.assert_allclose(np.linalg.norm(barbs, axis=1), 0.12816 * length, rtol=1e-4)
    np.testing.assert_allclose(barbs @ tip, -0.12 * length**2, rtol=1e-9)
    assert np.abs(barbs.mean(axis=0) + 0.12 * tip).max() <= ROUNDING * length
