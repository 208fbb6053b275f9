"""Pixels whose centre tells all: what makes one none, and what a smooth one is corrected by."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.tracer.light import filters
from viewcam_addon.tracer.light.adaptive.interior import correction, interior, widened, within
from viewcam_addon.tracer.scene.film import Film

BOX, USUAL = Film("BOX"), Film()
NONE = np.zeros((12, 16), bool)
FILMS = st.one_of(st.just(BOX), st.floats(0.01, 10).map(lambda width: Film("BLACKMAN_HARRIS", width)))


def light(values):
    return np.broadcast_to(values, (4, 12, 16)).astype(float)


def test_a_slope_is_interior_up_to_the_border():
    found = interior(light(np.arange(16) * 0.3), NONE, USUAL, 1e-3)
    assert found[1:-1, 1:-1].all() and not found[[0, -1]].any() and not found[:, [0, -1]].any()


@pytest.mark.parametrize("direction", [(1, 0), (0, 1), (1, 1), (1, -1), (2, 1)])
def test_an_edge_is_none_on_both_sides(direction):
    rows, columns = np.mgrid[:12, :16]
    beyond = direction[0] * (rows - 5.5) + direction[1] * (columns - 7.5) > 0
    found = interior(light(beyond), NONE, BOX, 0.1)
    beside = widened(beyond, 1) & widened(~beyond, 1)
    across = beyond & (widened(~beyond, 1)) | ~beyond & widened(beyond, 1)
    assert beside.any() and not found[across].any()
    assert found[~widened(across, 1)][20:-20].any()


@given(FILMS, st.floats(0.001, 1), st.floats(1e-4, 0.1))
def test_an_edge_that_is_not_found_changes_a_pixel_by_less_than_the_error(film, contrast, error):
    """It is upright, between the columns 7 and 8, anywhere there: at worst at the centre of the nearer one."""
    found = interior(light(np.where(np.arange(16) > 7, contrast, 0.0)), NONE, film, error)[6]
    for column in np.flatnonzero(found[:8]):
        changed = contrast * filters.beyond(film, 7 - column)
        assert changed <= error * (1 + 1e-9), f"column {column}: {changed}"


@given(FILMS)
def test_what_the_filter_reaches_of_others_is_not_interior(film):
    alone = NONE.copy()
    alone[6, 8] = True
    reached = within(alone, film)
    rows, columns = np.mgrid[:12, :16]
    nearest = np.maximum(np.abs(rows - 6), np.abs(columns - 8)) - 0.5
    assert (reached == ((nearest < filters.reach(film)) | alone)).all()
    assert not interior(light(0.0), reached, film, 0.1)[reached].any()


@given(FILMS, st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_what_is_quadratic_is_corrected_to_the_filters_mean(film, a, b, c):
    """The mean of x² is the filter's variance, that of xy is 0."""
    rows, columns = np.mgrid[:12, :16] - 6.0
    found = correction(a * columns**2 + b * rows**2 + c * rows * columns + a * rows, film)
    assert found[1:-1, 1:-1] == pytest.approx((a + b) * filters.variance(film), abs=1e-11)


@pytest.mark.parametrize("film", [BOX, USUAL, Film("BLACKMAN_HARRIS", 4.0)])
def test_the_filters_variance_and_tail_are_those_of_its_samples(film):
    u = (np.arange(1 << 20) + 0.5) / (1 << 20)
    place = filters.offsets(film, np.stack([u, u]))[0] - 0.5
    assert np.abs(place).max() <= filters.reach(film)
    # Steps of 2⁻¹⁶ are spread evenly over their lengths: 3.6e-5 of the mass (filters.py).
    assert (place**2).mean() == pytest.approx(filters.variance(film), rel=1e-3)
    for distance in (0.0, 0.3, 0.49, 1.0, 1.4):
        assert (place > distance).mean() == pytest.approx(filters.beyond(film, distance), abs=5e-5)
