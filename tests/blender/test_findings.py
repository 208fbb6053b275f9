from dataclasses import replace

import pytest

from viewcam_addon.blender.findings import CENTER, DISTANCE, EYE, POSE, VIEW, Cause, differences, explain
from viewcam_addon.pinhole import Pinhole

WANTED = Pinhole((7.0, -6.0, 5.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1500.0, 1920, 1080)
REACH = 10.0


def test_a_camera_does_not_differ_from_itself():
    assert differences(WANTED, WANTED, REACH) == {}


@pytest.mark.parametrize(
    ("quantity", "read_back"),
    [
        (EYE, replace(WANTED, eye=(7.0, -6.0, 5.0001), look_at=(0.0, 0.0, 1.0001))),
        (VIEW, replace(WANTED, up=(0.0, 1e-5, 1.0))),
        (VIEW, replace(WANTED, mirrored=True)),
        (DISTANCE, replace(WANTED, distance=1500.001)),
        (DISTANCE, replace(WANTED, distance=(1500.0, 1500.001))),
        (CENTER, replace(WANTED, principal_point=(960.001, 540.0))),
    ],
)
def test_what_is_off_by_more_than_float32_is_named_and_nothing_else(quantity, read_back):
    assert list(differences(WANTED, read_back, REACH)) == [quantity]


def test_what_float32_rounding_explains_is_no_difference():
    rounding = 2.0**-24
    read_back = replace(
        WANTED,
        eye=(7.0 * (1 + rounding), -6.0 * (1 - rounding), 5.0 * (1 + rounding)),
        up=(rounding, 0.0, 1.0),
        distance=1500.0 * (1 + 2 * rounding),
        principal_point=(960.0 * (1 + rounding), 540.0),
    )
    assert differences(WANTED, read_back, REACH) == {}


def test_far_from_the_origin_more_is_rounding():
    read_back = replace(WANTED, eye=(7.001, -6.0, 5.0), look_at=(0.001, 0.0, 1.0))
    assert EYE in differences(WANTED, read_back, REACH)
    assert differences(WANTED, read_back, reach=1e5) == {}


def sentences(differing, causes):
    return [finding.sentence for finding in explain(differing, causes)]


def test_only_a_suspect_that_acts_on_a_difference_is_blamed():
    track = Cause("The constraint 'Track' moves 'Camera'", POSE, "disable it")
    driver = Cause("A driver sets 'lens'", frozenset({DISTANCE}), "remove it")
    findings_found = sentences({VIEW: "the view is turned by 3°"}, [track, driver])
    assert findings_found == ["The constraint 'Track' moves 'Camera', the view is turned by 3°: disable it"]


def test_a_difference_that_nobody_explains_is_told_with_what_to_do():
    (eye, lens, shift) = sentences({EYE: "the eye is 1 away", DISTANCE: "d is 5", CENTER: "off"}, [])
    assert "moved since, the eye is 1 away" in eye
    assert "lens" in lens
    assert "shift" in shift
    assert all("adopt" in sentence for sentence in (eye, lens, shift))


def test_what_will_act_later_is_told_though_nothing_differs():
    later = Cause("'lens' is animated", frozenset({DISTANCE}), "animate the four values instead", always=True)
    assert sentences({}, [later]) == ["'lens' is animated: animate the four values instead"]
    assert sentences({}, [Cause("The constraint", POSE, "disable it")]) == []
