"""The tour: enabling, the four values, text."""

import math

import bpy
import numpy as np
from tour_hands import key_over, push, type_into
from tour_step import SIZE, UPPER_PART, Step, axes, camera, is_at_its_values, room, values

TEXT = "eye=4,-6,3.5 look_at=0,0,1 up=0,0,1 d=700"


class Enable(Step):
    """The camera stays where it is, and the values are read off it."""

    picture = "enable.png"

    def by_hand(self):
        self.stood = axes()
        yield from push("virtual_pinhole.enabled")

    def by_script(self):
        self.stood = axes()
        values().enabled = True

    def check(self):
        assert values().enabled and np.array_equal(axes(), self.stood), "enabling moved the camera"
        is_at_its_values()


class TypeTheFourValues(Step):
    """Every component by its field."""

    picture = "four-values.png"
    edits = 7
    eye, look_at, distance = (4, -7, 3), (0, 0, 1), 800

    def prepare(self):
        values().lens_unit = "PIXELS"

    def by_hand(self):
        for name in ("eye", "look_at"):
            for i, number in enumerate(getattr(self, name)):
                yield from type_into(f"virtual_pinhole.{name}[{i}]", str(number))
        yield from type_into("virtual_pinhole.distance", str(self.distance))

    def by_script(self):
        values().eye, values().look_at, values().distance = self.eye, self.look_at, self.distance

    def check(self):
        actual = (tuple(values().eye), tuple(values().look_at), values().distance)
        assert actual == (self.eye, self.look_at, self.distance), f"the values are {actual}"
        is_at_its_values()


class TypeUp(Step):
    """Another direction points up in the picture."""

    def by_hand(self):
        yield from type_into("virtual_pinhole.up[0]", "0.3")

    def by_script(self):
        values().up[0] = 0.3

    def check(self):
        assert abs(values().up[0] - 0.3) < 2**-24 and axes()[2, 0] < -0.1, f"u is {axes()[:, 0]}, and the picture is not rolled"
        is_at_its_values()


class Copy(Step):
    """The values go to the clipboard as text."""

    edits = 0

    def by_hand(self):
        yield from push("viewcam.copy_camera(")
        self.copied = bpy.context.window_manager.clipboard

    def by_script(self):
        bpy.ops.viewcam.copy_camera()
        self.copied = room("interface.clipboard").text_of(camera(), bpy.context.scene)

    def check(self):
        assert '"eye": [4.0, -7.0, 3.0]' in self.copied, f"copied {self.copied}"


class Paste(Step):
    """A line of text from elsewhere sets the camera."""

    picture = "paste.png"

    def by_hand(self):
        bpy.context.window_manager.clipboard = TEXT
        yield from push("viewcam.paste_camera(")

    def by_script(self):
        bpy.ops.viewcam.paste_camera(text=TEXT)

    def check(self):
        assert values().numbers() == ((4, -6, 3.5), (0, 0, 1), (0, 0, 1), 700), (
            f"pasted, and the values are {values().numbers()}"
        )
        is_at_its_values()


class Zoom(Step):
    """A factor on the distance, apart from it."""

    picture = "zoom.png"

    def by_hand(self):
        yield from type_into("virtual_pinhole.zoom", "1.5")

    def by_script(self):
        values().zoom = 1.5

    def check(self):
        assert (values().distance, values().numbers()[3]) == (700, 1050), "zoom is no factor on the distance"
        is_at_its_values()


class Roll(Step):
    """An angle that turns up about the view."""

    picture = "roll.png"
    shows = UPPER_PART

    def by_hand(self):
        yield from type_into("virtual_pinhole.roll", "20")

    def by_script(self):
        values().roll = math.radians(20)

    def check(self):
        w = axes()[:, 2]
        level = np.cross((0, 0, 1), w)
        turned = math.acos(axes()[:, 0] @ level / np.linalg.norm(level))
        # The angle is a float32, and so are the matrix's nine numbers.
        assert abs(turned - math.radians(20)) < 1e-6, f"the picture is turned by {math.degrees(turned):.5f}°"
        is_at_its_values()


class KeepTheFieldOfView(Step):
    """The choice of what the camera keeps when the picture gets another resolution, by the mouse wheel over it."""

    def prepare(self):
        values().keeps = "PIXELS"  # a new camera has the other

    def by_hand(self):
        while values().keeps != "FIELD_OF_VIEW":
            yield from key_over("virtual_pinhole.keeps", "WHEELDOWNMOUSE", ctrl=True)

    def by_script(self):
        values().keeps = "FIELD_OF_VIEW"

    def check(self):
        render, before = bpy.context.scene.render, camera().data.lens
        for size in ((1280, 720), SIZE):
            render.resolution_x, render.resolution_y = size
            bpy.context.view_layer.update()
            assert abs(camera().data.lens - before) < before * 3 * 2**-24, f"the lens was {before} and is {camera().data.lens}"


STEPS = [Enable, TypeTheFourValues, TypeUp, Copy, Paste, Zoom, Roll, KeepTheFieldOfView]
