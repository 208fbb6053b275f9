"""The tour: the buttons that move the camera."""

import math

import bpy
import numpy as np
from hands_in_a_window import region
from tour_hands import call, hide_the_sidebar, push, unfold
from tour_step import SIZE, Step, axes, camera, is_at_its_values, select, values


class _Move(Step):
    """By hand a button of the panel, by script its operator with the same properties."""

    operator, properties = "", {}
    button = None  # how the button's call begins, where the operator has several

    def by_hand(self):
        yield from unfold(f"viewcam.{self.operator}(")
        yield from push(self.button or f"viewcam.{self.operator}(")

    def by_script(self):
        getattr(bpy.ops.viewcam, self.operator)(camera="Camera", **self.properties)

    def check(self):
        is_at_its_values()


class _SeenThroughTheCamera(_Move):
    """Its picture is taken through the camera."""

    shows, with_before = "camera view", True

    def pose_for_the_picture(self):
        view = self._view()
        self.was = view.view_rotation.copy(), view.view_location.copy(), view.view_distance
        yield from hide_the_sidebar()
        view.view_perspective = "CAMERA"
        yield
        call(bpy.ops.view3d.view_center_camera)
        yield

    def after_the_picture(self):
        """Blender would leave the viewport where the camera is."""
        view = self._view()
        view.view_perspective = "PERSP"
        view.view_rotation, view.view_location, view.view_distance = self.was
        yield from hide_the_sidebar(hidden=False)

    def _view(self):
        area, _ = region("VIEW_3D", "WINDOW")
        return area.spaces.active.region_3d


class LookAtSelection(_Move):
    """The middle of what is selected comes into the middle of the picture."""

    operator = "look_at_selection"

    def prepare(self):
        select("Camera", "Ball")

    def check(self):
        np.testing.assert_allclose(values().look_at, (2, -1, 0.5), atol=1e-6)
        is_at_its_values()


class LookAtCursor(_Move):
    operator = "look_at_cursor"

    def prepare(self):
        bpy.context.scene.cursor.location = (-2, 0.5, 1)

    def check(self):
        assert tuple(values().look_at) == (-2, 0.5, 1)
        is_at_its_values()


class LookAtActive(_Move):
    operator = "look_at_active"

    def prepare(self):
        select("Cone", "Camera")

    def check(self):
        np.testing.assert_allclose(values().look_at, (-2, 0.5, 0.8), atol=1e-6)
        is_at_its_values()

    def tidy(self):
        select("Camera")


class FromTheCurrentView(_Move):
    """The camera sees what the viewport shows."""

    operator = "adopt_view"

    def check(self):
        area = next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "VIEW_3D")
        view = area.spaces.active.region_3d
        np.testing.assert_allclose(values().look_at, view.view_location, atol=1e-6)
        np.testing.assert_allclose(axes(), view.view_rotation.to_matrix(), atol=1e-6)
        is_at_its_values()
        if not bpy.app.background:  # the matrix with which the viewport is drawn, which nothing but a window draws
            lens = min(view.window_matrix[i][i] * pixels / 2 for i, pixels in enumerate(SIZE))
            # float32: the matrix, its lens and sensor, and the property.
            np.testing.assert_allclose(values().numbers()[3], lens, rtol=8 * 2**-24)


class Dolly(_Move):
    """Its distance is typed in the redo panel, or given when it is called."""

    operator, properties = "dolly_camera", {"reach": 6.0}

    def prepare(self):
        values().eye, values().look_at, values().up = (4, -6, 3.5), (0, 0, 1), (0, 0, 1)

    def by_hand(self):
        call(bpy.ops.viewcam.dolly_camera, camera="Camera", **self.properties)
        yield
        yield

    def check(self):
        reach = math.dist(*values().numbers()[:2])
        assert abs(reach - 6) < 1e-5, f"the eye is {reach} from the look-at point"
        is_at_its_values()


class FrameByDistance(_SeenThroughTheCamera):
    """All of Suzanne fills the picture, by zooming."""

    picture = "frame.png"
    operator, properties = "frame_selection", {"by": "DISTANCE"}
    button = "viewcam.frame_selection(camera=\"Camera\", by='DISTANCE'"

    def prepare(self):
        select("Camera", "Suzanne")
        values().look_at = (0, 0, 1)

    def check(self):
        from bpy_extras.object_utils import world_to_camera_view

        is_at_its_values()
        monkey = bpy.data.objects["Suzanne"]
        seen = [
            world_to_camera_view(bpy.context.scene, camera(), monkey.matrix_world @ each.co) for each in monkey.data.vertices
        ]
        room = min(min(x, y, 1 - x, 1 - y) for x, y, _ in seen)
        assert abs(room - 0.05) < 1e-5, f"the margin is {room:.5f} of the picture and not 5 %"


class OrbitToTheRight(_Move):
    operator, properties = "orbit_camera", {"around": math.radians(15)}
    button = 'viewcam.orbit_camera(camera="Camera", around=0.'

    def prepare(self):
        self.eye = np.array(values().eye)

    def check(self):
        arms = [np.subtract(eye, values().look_at)[:2] for eye in (self.eye, values().eye)]
        turned = math.atan2(arms[0][0] * arms[1][1] - arms[0][1] * arms[1][0], arms[0] @ arms[1])
        assert abs(turned - math.radians(15)) < 1e-6, f"orbited by {math.degrees(turned):.4f}°"
        is_at_its_values()


class Swap(_Move):
    operator = "swap_camera"

    def prepare(self):
        self.eye, self.look_at = tuple(values().eye), tuple(values().look_at)

    def check(self):
        assert (tuple(values().eye), tuple(values().look_at)) == (self.look_at, self.eye)
        is_at_its_values()


class Level(_SeenThroughTheCamera):
    """The horizon is level again."""

    picture = "level.png"
    operator = "level_camera"

    def prepare(self):
        values().eye, values().look_at, values().up = (4, -6, 3.5), (0, 0, 1), (0.3, 0, 1)

    def check(self):
        assert tuple(values().up) == (0, 0, 1) and abs(axes()[2, 0]) < 1e-7
        is_at_its_values()


STEPS = [LookAtSelection, LookAtCursor, LookAtActive, FromTheCurrentView, Dolly, FrameByDistance, OrbitToTheRight, Swap, Level]
