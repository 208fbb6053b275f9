import math
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.blender.interface import readouts
from viewcam_addon.pinhole import Pinhole

LEVEL = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)


def test_readouts_are_the_camera_in_words():
    readings = readouts.readouts(LEVEL, 18.0, 50.0, ("5 m", 5.0))
    rows = {row.label: " ".join(row.texts) for row in readings}
    assert rows["Focal Length"] == "18 mm"
    assert rows["Horizontal FOV"] == "90.0000°"
    assert rows["Vertical FOV"] == f"{2 * math.degrees(math.atan(30 / 50)):.4f}°"
    assert rows["Diagonal FOV"] == f"{2 * math.degrees(math.atan(math.hypot(50, 30) / 50)):.4f}°"
    assert rows["u"] == "+1.00000 +0.00000 +0.00000"
    assert rows["v"] == "+0.00000 +0.00000 +1.00000"
    assert rows["w"] == "+0.00000 -1.00000 +0.00000"
    assert rows["View Plane"] == "50 px"
    assert rows["To Look-At"] == "5 m"


def test_what_is_copied_has_all_its_digits():
    camera = replace(LEVEL, eye=(1 / 3, -5, 0.1))
    for row in readouts.readouts(camera, 18.1, 1 / 3, ("5 m", math.pi)):
        numbers = eval(row.exact, {})
        if row.label in "uvw":
            np.testing.assert_array_equal(numbers, camera.axes()["uvw".index(row.label)])
        else:
            names = ("Horizontal FOV", "Vertical FOV", "Diagonal FOV")
            angles = dict(zip(names, map(math.degrees, camera.field_of_view()), strict=True))
            lengths = {"Focal Length": 18.1, "View Plane": 1 / 3, "To Look-At": math.pi}
            assert numbers == (angles | lengths)[row.label]


def test_a_camera_without_stated_values_has_no_distance_to_a_look_at_point():
    assert "To Look-At" not in [row.label for row in readouts.readouts(LEVEL, 18.0, 50.0, None)]


def above(angle):
    """Looks down within `angle` of an up that has no zeros, so that every number of the pose is rounded."""
    up = np.array((0.48, 0.6, 0.64))
    across = np.cross(up, (1, 0, 0))
    eye = tuple(up + math.tan(angle) * across / np.linalg.norm(across))
    return Pinhole(eye, (0, 0, 0), tuple(up), 1000.0, 1920, 1080)


def warnings_of(camera, precision):
    return [sentence for sentence in (readouts.roll_warning(camera, precision), readouts.distance_warning(camera)) if sentence]


def test_a_singular_pose_is_said_to_be_so():
    (warning,) = warnings_of(Pinhole((0, 0, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60), 2.0**-24)
    assert "parallel to up" in warning


def test_the_roll_is_called_uncertain_where_a_corner_moves_a_tenth_of_a_pixel_and_not_before():
    corner = math.hypot(960, 540)
    for angle in (3e-2, 1e-2, 3e-3, 1e-3, 3e-4):
        camera = above(angle)
        moved = camera.roll_uncertainty() * corner
        assert bool(warnings_of(camera, 2.0**-24)) == (moved > 0.1), f"{angle:g} rad: {moved:.2g} px"
    assert warnings_of(above(3e-2), 2.0**-24) == []
    assert warnings_of(above(3e-4), 2.0**-24)


def test_the_roll_warning_tells_the_angle_and_the_roll():
    angle = math.radians(0.001)
    (sentence,) = warnings_of(above(angle), 2.0**-24)
    roll = math.degrees(above(angle).roll_uncertainty())
    assert sentence == f"The view is within 0.001° of up: the roll is uncertain by {float(f'{roll:.0e}'):g}°"
    assert "any roll is possible" in warnings_of(above(1e-8), 2.0**-24)[0]


def test_values_known_in_float64_leave_the_roll_certain():
    assert warnings_of(above(1e-5), precision=2.0**-53) == []


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.1])
def test_the_proposed_up_gives_the_same_picture_and_is_certain(angle):
    camera = above(angle) if angle else Pinhole((0.48, 0.6, 0.64), (0, 0, 0), (0.48, 0.6, 0.64), 1000.0, 1920, 1080)
    proposed = replace(camera, up=readouts.certain_up(camera))
    assert proposed.sine_to_up == pytest.approx(1, abs=1e-12)
    assert np.abs(np.stack(proposed.basis()) - np.stack(camera.basis())).max() < 1e-15
    assert not any("roll" in sentence for sentence in warnings_of(proposed, 2.0**-24))


def test_a_coordinate_axis_is_proposed_where_it_is_one():
    assert readouts.certain_up(Pinhole((0, 0, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)) == (1, 0, 0)
    assert readouts.certain_up(Pinhole((0, 1e-7, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)) == (0, -1, 0)


def test_far_from_the_origin_the_rounding_is_told_in_pixels():
    def warnings(far):
        return warnings_of(Pinhole((far, 0, 0), (far, 10, 0), (0, 0, 1), 1000.0, 1920, 1080), 2.0**-24)

    assert warnings(1e4) == []  # 2⁻²⁴ · 1000 px · 1e4 / 10 = 0.06 px
    assert "may be 0.2 px off" in warnings(4e4)[-1]
    assert "may be 40 px off" in warnings(6.4e6)[-1]


def test_long_sentences_are_wrapped_to_the_width_of_the_region():
    lines = readouts.wrapped("one two three four five six seven eight nine ten", 150)
    assert len(lines) > 1
    assert max(map(len, lines)) <= 22
