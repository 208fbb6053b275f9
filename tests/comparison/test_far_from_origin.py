"""What the distance from the origin costs is told where another origin would mend it, and nowhere else."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.geometry import compare


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


def test_an_error_beyond_the_tolerance_has_another_cause(compared):
    comparison = compared(1e6, roundings=10)
    assert not comparison.rows[0].ok and comparison.far_from_origin is None


def test_where_no_pixel_can_be_compared_that_is_told(paper_scene):
    """At 1e9 neighbouring float32 numbers are 64 apart: the test picture shows nothing at all."""
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
