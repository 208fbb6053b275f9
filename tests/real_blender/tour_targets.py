"""The tour: eye and look-at that follow objects."""

import bpy
import numpy as np
from hands_in_a_window import NOWHERE, click, press
from tour_hands import key_over, on_screen, strike
from tour_step import UPPER_PART, Step, axes, camera, is_at_its_values, select, values

FIELD = "virtual_pinhole.look_at_target"
START, END = (2, -1, 0.5), (3, -1, 0.5)


def looks_at(place):
    bpy.context.view_layer.update()
    assert np.allclose(values().numbers()[1], place, atol=1e-6), (
        f"the camera looks at {values().numbers()[1]} and not at {place}"
    )
    ahead = np.subtract(place, camera().matrix_world.translation)
    np.testing.assert_allclose(-axes()[:, 2], ahead / np.linalg.norm(ahead), atol=17 * 2**-24)


class PickTheTarget(Step):
    """E over the field, then a click on the object in the viewport."""

    picture = "target.png"

    def prepare(self):
        values().roll = 0
        values().zoom = 1
        bpy.data.objects["Ball"].location = START

    def by_hand(self):
        yield from key_over(FIELD, "E")
        yield from click(*on_screen(START))

    def by_script(self):
        values().look_at_target = bpy.data.objects["Ball"]

    def check(self):
        assert values().look_at_target == bpy.data.objects["Ball"]
        looks_at(START)


class MoveTheTarget(Step):
    """G X 1: the camera follows as the object goes."""

    picture = "follow.png"
    shows = UPPER_PART

    def prepare(self):
        select("Ball")

    def by_hand(self):
        for character in "gx1":
            strike(character)
            yield
        press("RET", *NOWHERE)
        yield
        yield

    def by_script(self):
        bpy.data.objects["Ball"].location = END

    def check(self):
        looks_at(END)

    def pose_for_the_picture(self):
        select("Camera", "Ball")
        yield

    def tidy(self):
        select("Camera")


class ClearTheTarget(Step):
    """Backspace over the field: the camera stays where it is."""

    def by_hand(self):
        yield from key_over(FIELD, "BACK_SPACE")

    def by_script(self):
        values().look_at_target = None

    def check(self):
        assert values().look_at_target is None and np.allclose(values().look_at, END)
        is_at_its_values()

    def tidy(self):
        bpy.data.objects["Ball"].location = START


STEPS = [PickTheTarget, MoveTheTarget, ClearTheTarget]
