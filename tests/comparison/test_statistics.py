"""The figures of a pass."""

import numpy as np
import pytest

from viewcam_addon.comparison.statistics import measure
from viewcam_addon.comparison.tolerances import PERCENTILES, ROUNDINGS


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
