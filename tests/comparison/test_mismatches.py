"""Pixels on edges: explained by a shift within tolerance, and by nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.comparison.mismatches import KINDS, largest_around, reach_of


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
