"""The tour: handles and diagram in the 3D viewport, and viewports of every kind."""

import bpy
import numpy as np
from hands_in_a_window import region, window
from tour_hands import VIEWPORT, drag, hide_the_sidebar, on_screen
from tour_step import Step, is_at_its_values, room, select, values


class _WithoutTheSidebar(Step):
    """Its picture shows all of the viewport."""

    def pose_for_the_picture(self):
        yield from hide_the_sidebar()

    def after_the_picture(self):
        yield from hide_the_sidebar(hidden=False)


class DragTheLookAtPoint(_WithoutTheSidebar):
    """By its handle; the camera turns."""

    picture = "handles.png"
    shows, with_before = (0.0, 0.42, 0.78, 0.75), True

    def prepare(self):
        values().eye, values().look_at, values().up = (4, -6, 3.5), (0, 0, 1), (0, 0, 1)
        select("Camera")

    def by_hand(self):
        yield from drag(on_screen(values().look_at), (60, 30))
        for _ in range(4):  # the drag becomes a step of undo a moment later
            yield

    def by_script(self):
        values().look_at = (0.5, 0.2, 1.3)

    def check(self):
        eye, look_at, up, _ = values().numbers()
        assert np.allclose(eye, (4, -6, 3.5)) and up == (0, 0, 1), "the drag has changed more than the look-at point"
        assert 0.2 < np.linalg.norm(np.subtract(look_at, (0, 0, 1))) < 3, f"the look-at point is at {look_at}"
        is_at_its_values()


class DragTheEye(Step):
    """By its handle; the camera keeps its look-at point."""

    def by_hand(self):
        self.look_at = values().numbers()[1]
        yield from drag(on_screen(values().eye), (-50, 40))
        for _ in range(4):
            yield

    def by_script(self):
        self.look_at = values().numbers()[1]
        values().eye = (4.5, -6, 4)

    def check(self):
        assert values().numbers()[1] == self.look_at and tuple(values().eye) != (4, -6, 3.5)
        is_at_its_values()


class DragUp(Step):
    """By the ring at its tip; the picture is turned."""

    def by_hand(self):
        camera_object = bpy.data.objects["Camera"]
        yield from drag(on_screen(room("interface.gizmos").place(camera_object, "up")), (40, 0))
        for _ in range(4):
            yield

    def by_script(self):
        values().up = (0.3, 0.1, 1)

    def check(self):
        up = np.array(values().up)
        assert 0.05 < np.linalg.norm(np.cross(up, (0, 0, 1))) / np.linalg.norm(up) < 0.9, f"up is {up}"
        is_at_its_values()

    def tidy(self):
        values().up = (0, 0, 1)


class ShowTheDiagramElsewhere(_WithoutTheSidebar):
    """The view plane is drawn close to the look-at point."""

    picture = "diagram.png"
    shows, with_before = (0.0, 0.42, 0.78, 0.935), True

    def by_hand(self):
        values().plane_at = 0.65
        with bpy.context.temp_override(window=window()):
            bpy.ops.ed.undo_push(message="View Plane At")
        yield

    def by_script(self):
        values().plane_at = 0.65

    def check(self):
        is_at_its_values()


class FourViews(_WithoutTheSidebar):
    """The quad view draws the diagram in each, orthographic ones too."""

    picture = "quad-view.png"
    shows = "area"
    edits, needs_a_window = 0, True

    def by_hand(self):
        toggle(bpy.ops.screen.region_quadview)
        for _ in range(4):
            yield

    def check(self):
        area, _ = region(*VIEWPORT)
        assert len(area.spaces.active.region_quadviews) == 4
        is_at_its_values()

    def tidy(self):
        toggle(bpy.ops.screen.region_quadview)


class LocalView(Step):
    """The camera is not in it, and the panel still shows the scene's."""

    edits, needs_a_window = 0, True

    def prepare(self):
        select("Suzanne")

    def by_hand(self):
        toggle(bpy.ops.view3d.localview, frame_selected=False)
        for _ in range(4):
            yield

    def check(self):
        area, _ = region(*VIEWPORT)
        assert area.spaces.active.local_view
        values().eye[2] += 0.0
        is_at_its_values()

    def tidy(self):
        toggle(bpy.ops.view3d.localview, frame_selected=False)
        select("Camera")


class TwoWindows(Step):
    """Both draw the same camera while it is edited."""

    edits, needs_a_window = 0, True

    def by_hand(self):
        with bpy.context.temp_override(window=window()):
            bpy.ops.wm.window_new_main()
        for _ in range(4):
            yield

    def check(self):
        assert len(bpy.context.window_manager.windows) == 2
        is_at_its_values()

    def tidy(self):
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[1]):
            bpy.ops.wm.window_close()


def toggle(operator, **properties):
    area, part = region(*VIEWPORT)
    with bpy.context.temp_override(window=window(), area=area, region=part):
        operator(**properties)


STEPS = [DragTheLookAtPoint, DragTheEye, DragUp, ShowTheDiagramElsewhere, FourViews, LocalView, TwoWindows]
