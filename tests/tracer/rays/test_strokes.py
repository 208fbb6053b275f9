"""Strokes cross the pixels that points along them lie in, and no others that are not beside these."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays.rims import BULGE, circles, rims_seen_from
from viewcam_addon.tracer.rays.strokes import Canvas

WIDTH, HEIGHT = 32, 20
MARGIN = 1e-3
AHEAD = np.array([[0.0], [0.0], [1.0]])


@pytest.fixture(scope="module")
def canvas() -> Canvas:
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), (30, 25), WIDTH, HEIGHT, (14, 11))
    return Canvas(camera, (0.0, np.inf))


def dense(canvas, starts, ends, count=4001):
    """(2, k) columns and rows of points along strokes that lie before the eye."""
    parts = np.linspace(0, 1, count)[:, None]
    points = [(a + parts * (b - a)).T for a, b in zip(starts.T, ends.T, strict=True)]
    points = np.concatenate(points, axis=1)
    return canvas.place(points[:, points[2] > 1e-9])[:2]


def pixels_of(places):
    column, row = np.floor(places).astype(int)
    inside = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
    return set(zip(row[inside].tolist(), column[inside].tolist(), strict=True))


@given(st.integers(0, 10**6), st.sampled_from([0.05, 0.5, 3.0]))
@settings(max_examples=60, deadline=None)
def test_every_pixel_that_a_stroke_crosses_is_found_even_if_it_begins_behind_the_eye(canvas, seed, size):
    rng = np.random.default_rng(seed)
    starts = rng.normal(size=(3, 8), loc=AHEAD)
    ends = starts + rng.normal(size=(3, 8)) * size
    pieces = canvas.pieces(starts, ends, MARGIN)
    found = set(zip((pieces.pixel // WIDTH).tolist(), (pieces.pixel % WIDTH).tolist(), strict=True))
    crossed = pixels_of(dense(canvas, starts, ends))
    assert crossed <= found, f"{len(crossed - found)} of {len(crossed)} pixels are missed: {sorted(crossed - found)[:5]}"


@given(st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_no_pixel_is_found_that_lies_farther_from_the_stroke_than_its_margin(canvas, seed):
    rng = np.random.default_rng(seed)
    start, end = rng.uniform(-0.4, 0.4, (2, 3, 1)) + AHEAD
    pieces = canvas.pieces(start, end, MARGIN)
    (a, b), (c, d) = canvas.place(start)[:2, 0], canvas.place(end)[:2, 0]
    along, aside = max(abs(c - a), abs(d - b)), np.hypot(c - a, d - b)
    for pixel in np.unique(pieces.pixel):
        corners = np.array([(pixel % WIDTH + x, pixel // WIDTH + y) for x in (0, 1) for y in (0, 1)])
        sides = ((corners - (a, b)) * (-(d - b), c - a)).sum(axis=1) / aside
        # Twice the margin along a column, which is more than its share across.
        assert sides.min() < 3 * MARGIN and sides.max() > -3 * MARGIN, f"{sides} pixels beside a stroke of {along:.3g}"


@given(st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_the_place_of_a_piece_lies_in_its_pixel_on_the_stroke_at_its_depth(canvas, seed):
    rng = np.random.default_rng(seed)
    starts = rng.normal(size=(3, 20), loc=1.5 * AHEAD)
    ends = starts + rng.normal(size=(3, 20))
    pieces = canvas.pieces(starts, ends, MARGIN)
    column, row = places = pieces.places(np.arange(len(pieces.pixel)))
    beside = np.abs(places - [pieces.pixel % WIDTH + 0.5, pieces.pixel // WIDTH + 0.5]).max(axis=0) - 0.5
    assert beside.max(initial=0) <= 3 * MARGIN, f"{beside.max()} pixels outside of its pixel"
    x, y = (column - 14) / 30, (row - 11) / 25
    point = np.stack([x, y, np.ones_like(x)]) / pieces.nearness
    begin, way = starts[:, pieces.stroke], (ends - starts)[:, pieces.stroke]
    part = ((point - begin) * way).sum(axis=0) / (way * way).sum(axis=0)
    off = np.linalg.norm(point - begin - part * way, axis=0) / np.linalg.norm(point, axis=0)
    assert off.max(initial=0) < 1e-7, f"{off.max()} of its distance off the stroke"


@given(st.integers(0, 10**6), st.sampled_from([0.01, 0.3, 0.9, 0.999, 1.5]))
@settings(max_examples=40, deadline=None)
def test_arcs_lie_as_close_to_a_circle_as_they_say(canvas, seed, size):
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-0.3, 0.3, (3, 1)) + AHEAD
    rims = circles(centre, rng.normal(size=(3, 1)), np.array([size]))
    _, starts, ends = rims.arcs(canvas)
    pieces = canvas.pieces(starts, ends, MARGIN + BULGE)
    found = set(zip((pieces.pixel // WIDTH).tolist(), (pieces.pixel % WIDTH).tolist(), strict=True))
    points = rims.at(np.zeros(200001, int), np.linspace(0, 1, 200001))
    crossed = pixels_of(canvas.place(points[:, points[2] > 1e-9])[:2])
    assert crossed <= found, f"{len(crossed - found)} of {len(crossed)} pixels are missed"


@given(st.floats(1e-6, 0.99), st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_rays_touch_a_sphere_in_its_rim(radius, seed):
    rng = np.random.default_rng(seed)
    centre = rng.normal(size=(3, 1))
    centre /= np.linalg.norm(centre)
    away = centre / radius
    rims = rims_seen_from(radius * np.eye(3)[:, :, None], centre, away, (away * away).sum(axis=0) - 1)
    points = rims.at(np.zeros(7, int), np.linspace(0, 1, 7))
    off = np.linalg.norm(points - centre, axis=0) / radius - 1
    slant = (points * (points - centre)).sum(axis=0) / radius
    # Roundings of the point, of length 1, against the radius.
    assert np.abs(off).max() < 1e-15 / radius + 1e-14, f"{off} radii off the sphere"
    assert np.abs(slant).max() < 1e-14 / radius, f"the cosine to its normal is {slant}"
