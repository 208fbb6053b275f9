import math

from viewcam_addon.blender import readouts
from viewcam_addon.pinhole import Pinhole

LEVEL = Pinhole((0, -5, 0), (0, 0, 0), (0, 0, 1), 50.0, 100, 60)


def test_readouts_are_the_camera_in_words():
    rows = {label: " ".join(texts) for label, *texts in readouts.readouts(LEVEL, 18.0, "5 m")}
    assert rows["Focal Length"] == "18 mm"
    assert rows["Horizontal FOV"] == "90.0000°"
    assert rows["Vertical FOV"] == f"{2 * math.degrees(math.atan(30 / 50)):.4f}°"
    assert rows["Diagonal FOV"] == f"{2 * math.degrees(math.atan(math.hypot(50, 30) / 50)):.4f}°"
    assert rows["u"] == "+1.00000 +0.00000 +0.00000"
    assert rows["v"] == "+0.00000 +0.00000 +1.00000"
    assert rows["w"] == "+0.00000 -1.00000 +0.00000"
    assert rows["To Look-At"] == "5 m"


def test_a_camera_without_stated_values_has_no_distance_to_a_look_at_point():
    assert "To Look-At" not in [row[0] for row in readouts.readouts(LEVEL, 18.0, None)]


def test_a_singular_pose_is_said_to_be_so():
    (warning,) = readouts.pose_warnings(Pinhole((0, 0, 5), (0, 0, 0), (0, 0, 1), 50.0, 100, 60), 2.0**-24)
    assert "parallel to up" in warning


def test_the_roll_is_called_uncertain_only_where_a_corner_moves_half_a_pixel():
    def warnings(angle, precision=2.0**-24):
        pinhole = Pinhole((math.sin(angle), 0, math.cos(angle)), (0, 0, 0), (0, 0, 1), 1000.0, 1920, 1080)
        return readouts.pose_warnings(pinhole, precision)

    assert warnings(1e-3) == []  # 2⁻²⁴ · 2 / 1e-3 rad · 1101 px = 0.13 px
    assert "0.0057° from up" in warnings(1e-4)[0]  # 1.3 px
    assert "any roll" in warnings(1e-8)[0]
    assert warnings(1e-8, precision=2.0**-53) == []


def test_long_sentences_are_wrapped_to_the_width_of_the_region():
    lines = readouts.wrapped("one two three four five six seven eight nine ten", 150)
    assert len(lines) > 1
    assert max(map(len, lines)) <= 22
