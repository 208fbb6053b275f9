"""The tour through all that an artist does with a camera, in order: by mouse and keys in a window, or by script."""

import math
import os
import shutil
import tempfile
from pathlib import Path

import bpy
import numpy as np
from hands import (
    NOWHERE,
    VIEWPORT,
    WAITING,
    call,
    click,
    drag,
    hide_the_sidebar,
    key_over,
    move,
    on_screen,
    press,
    push,
    region,
    strike,
    type_into,
    unfold,
    window,
)
from tour_step import SIZE, UPPER_PART, Step, axes, camera, is_at_its_values, room, select, state, values

TEXT = "eye=4,-6,3.5 look_at=0,0,1 up=0,0,1 d=700"


class Enable(Step):
    """The camera stays where it is, and the values are read off it."""

    picture = "enable.png"

    def prepare(self):
        camera().rotation_euler.x = math.radians(60)  # the numbers of its look-at point fit beside their letters

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
    """An angle that turns up about the view; to the side on which the viewport shows it best."""

    picture = "roll.png"
    shows = UPPER_PART

    def by_hand(self):
        yield from type_into("virtual_pinhole.roll", "-20")

    def by_script(self):
        values().roll = math.radians(-20)

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


class _Move(Step):
    """By hand a button of the panel, by script its operator with the same properties."""

    operator, properties = "", {}
    button = None  # the beginning of its call, where the operator has several

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


class _WithoutTheSidebar(Step):
    """Its picture shows all of the viewport, without the tools."""

    def pose_for_the_picture(self):
        region(*VIEWPORT)[0].spaces.active.show_region_toolbar = False
        yield from hide_the_sidebar()

    def after_the_picture(self):
        region(*VIEWPORT)[0].spaces.active.show_region_toolbar = True
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
        values().look_at = bpy.data.objects["Ball"].location

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

    def prepare(self):
        values().look_at = (0, 0, 1)

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


class DuplicateTheCamera(Step):
    """Shift D; the copy has values of its own."""

    def prepare(self):
        select("Camera")

    def by_hand(self):
        press("D", *NOWHERE, shift=True)
        yield
        yield
        press("ESC", *NOWHERE)  # it stays where the camera is
        yield
        yield

    def by_script(self):
        bpy.ops.object.duplicate()

    def check(self):
        copy = bpy.data.objects["Camera.001"]
        assert copy.virtual_pinhole.numbers() == values().numbers()
        before = state()["Camera"]
        copy.virtual_pinhole.eye = (1, 2, 3)
        assert state()["Camera"] == before, "the camera goes where its copy is sent"

    def tidy(self):
        bpy.data.objects.remove(bpy.data.objects["Camera.001"])
        select("Camera")


class DeleteTheCamera(Step):
    """There is none left, and the panel goes."""

    def by_hand(self):
        call(bpy.ops.object.delete, confirm=False)
        for _ in range(4):
            yield

    def by_script(self):
        bpy.ops.object.delete()

    def check(self):
        assert bpy.context.scene.camera is None and "Camera" not in bpy.context.scene.objects

    def tidy(self):
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
            bpy.ops.ed.undo()
        select("Camera")


class EnterEditMode(Step):
    """Tab, on another object; the panel shows the scene's camera."""

    edits = 0

    def prepare(self):
        select("Suzanne")

    def by_hand(self):
        press("TAB", *NOWHERE)
        for _ in range(4):
            yield

    def by_script(self):
        bpy.ops.object.mode_set(mode="EDIT")

    def check(self):
        assert bpy.context.mode == "EDIT_MESH"

    def tidy(self):
        bpy.ops.object.mode_set(mode="OBJECT")
        select("Camera")


LAST = 20


def stands_at(frame):
    """Eye and axes of the camera at a frame, as Blender evaluates it; the frame of before is shown again."""
    scene, before = bpy.context.scene, bpy.context.scene.frame_current
    scene.frame_set(frame)
    camera_object = camera().evaluated_get(bpy.context.evaluated_depsgraph_get())
    values = np.array(camera_object.matrix_world)
    scene.frame_set(before)
    return values


class KeyTheEye(Step):
    """I over the field at two frames."""

    picture = "keyframes.png"
    edits = 3

    def prepare(self):
        bpy.context.scene.frame_set(1)
        values().eye, values().look_at, values().up = (4, -6, 3.5), (0, 0, 1), (0, 0, 1)

    def by_hand(self):
        yield from key_over("virtual_pinhole.eye[0]", "I")
        bpy.context.scene.frame_set(LAST)
        yield
        yield from type_into("virtual_pinhole.eye[0]", "-4")
        yield from key_over("virtual_pinhole.eye[0]", "I")

    def by_script(self):
        values().keyframe_insert("eye", frame=1)
        bpy.context.scene.frame_set(LAST)
        values().eye[0] = -4
        values().keyframe_insert("eye", frame=LAST)

    def check(self):
        for frame, eye in ((1, 4), (LAST, -4)):
            assert abs(stands_at(frame)[0, 3] - eye) < 1e-6, f"at frame {frame} the eye's x is {stands_at(frame)[0, 3]}"
        assert -3 < stands_at(10)[0, 3] < 3


class Play(Step):
    """The camera flies in the viewport, at every frame where its values say."""

    edits = 0

    def by_hand(self):
        call(bpy.ops.screen.animation_play)
        seen = set()
        while len(seen) < 4:
            yield
            seen.add(round(values().eye[0], 3))
            is_at_its_values()
        with bpy.context.temp_override(window=window()):
            bpy.ops.screen.animation_cancel()
        yield

    def check(self):
        is_at_its_values()


class Render(Step):
    """F12 shows what is in the middle of the view."""

    picture = "render.png"
    shows = (0.24, 0.38, 0.76, 0.605)
    edits = 0

    def prepare(self):
        bpy.context.preferences.view.render_display_type = "AREA"
        scene = bpy.context.scene
        scene.render.engine, scene.view_settings.view_transform = "CYCLES", "Standard"
        scene.frame_set(10)
        values().look_at = (2, -1, 0.5)
        bpy.data.objects["Ball"].location = (2, -1, 0.5)

    def by_hand(self):
        with bpy.context.temp_override(window=window()):
            assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        yield
        while bpy.app.is_job_running("RENDER"):
            yield WAITING
        for _ in range(8):
            yield

    def by_script(self):
        bpy.ops.render.render()

    def check(self):
        with tempfile.TemporaryDirectory() as folder:
            path = str(Path(folder, "render.png"))
            bpy.data.images["Render Result"].save_render(path)
            picture = bpy.data.images.load(path)
            width, height = picture.size
            middle = 4 * (height // 2 * width + width // 2)
            red, green, blue = picture.pixels[middle : middle + 3]
            bpy.data.images.remove(picture)
        assert red > 1.2 * green > 1.2 * blue, (
            f"the middle of the picture is ({red:.2f}, {green:.2f}, {blue:.2f}), not the ball"
        )

    def pose_for_the_picture(self):
        call(bpy.ops.render.view_show)
        for _ in range(8):
            yield

    def tidy(self):
        for area in window().screen.areas:
            if area.type == "IMAGE_EDITOR":
                area.type = "VIEW_3D"


class Bake(Step):
    """Plain keyframes, upon which the add-on is not needed."""

    picture = "bake.png"

    def prepare(self):
        bpy.context.scene.frame_set(1)
        self.live = [stands_at(frame) for frame in (1, 7, LAST)]

    def by_hand(self):
        yield from push("viewcam.bake_camera(")
        yield
        press("RET", *NOWHERE)
        for _ in range(4):
            yield

    def by_script(self):
        bpy.ops.viewcam.bake_camera(camera="Camera")

    def check(self):
        assert not values().enabled, "the Virtual Pinhole is still on"
        curves = {curve.data_path for curve in room("versions").action_curves(camera())}
        assert {"location", "rotation_euler"} <= curves, f"keyframes of {sorted(curves)} only"
        for frame, live in zip((1, 7, LAST), self.live, strict=True):
            np.testing.assert_allclose(stands_at(frame), live, atol=1e-5, err_msg=f"frame {frame}")


FILE = Path(tempfile.gettempdir(), f"shots_{os.getpid()}", "monkey.json")
LEFT_OF_THE_PANEL, BELOW_ITS_TOP = 160, 200  # pixels


class CompareWithCycles(Step):
    """Both renders in the background, the verdict in the panel; Show brings both pictures into an image editor."""

    edits = 0

    def prepare(self):
        camera().animation_data_clear()
        camera().data.animation_data_clear()
        values().enabled = True
        values().eye, values().look_at, values().distance = (4, -6, 3.5), (0, 0, 1), 700
        if not bpy.app.background:
            region("PROPERTIES", "WINDOW")[0].type = "IMAGE_EDITOR"

    def by_hand(self):
        yield from unfold("viewcam.compare_with_cycles(")
        yield from push("viewcam.compare_with_cycles(")
        for _ in range(200):  # it begins when a copy of the file is written
            yield
            if room("interface.proof").background.running:
                break
        while room("interface.proof").background.running:
            yield WAITING
        for _ in range(6):
            yield
        yield from push("viewcam.show_difference(")
        for _ in range(6):
            yield

    def by_script(self):
        bpy.ops.viewcam.compare_with_cycles(camera="Camera")
        bpy.ops.viewcam.show_difference()

    def check(self):
        outcome = room("interface.proof").background.latest
        assert outcome is not None and outcome.answer == "same", f"the verdict is {outcome and outcome.verdict}"
        is_at_its_values()

    def tidy(self):
        if not bpy.app.background:
            region("IMAGE_EDITOR", "WINDOW")[0].type = "PROPERTIES"


class Export(Step):
    """File › Export › Virtual Pinhole Scene."""

    edits = 0

    def prepare(self):
        FILE.parent.mkdir()
        bpy.context.preferences.view.filebrowser_display_type = "SCREEN"

    def by_hand(self):
        call(bpy.ops.viewcam.export_scene, filepath=str(FILE))
        for _ in range(8):
            yield
        yield from in_the_file_browser(bpy.ops.file.execute)

    def by_script(self):
        bpy.ops.viewcam.export_scene(filepath=str(FILE))

    def check(self):
        assert '"eye"' in FILE.read_text(encoding="utf-8")

    def tidy(self):
        shutil.rmtree(FILE.parent)


def in_the_file_browser(operator):
    area, part = region("FILE_BROWSER", "WINDOW")
    with bpy.context.temp_override(window=window(), area=area, region=part):
        operator()
    for _ in range(8):
        yield


class Preset(Step):
    """A lens from the list."""

    picture = "presets.png"
    shows = UPPER_PART

    def by_hand(self):
        call(bpy.ops.viewcam.execute_preset, shipped="Lens 85 mm")
        yield
        yield

    def by_script(self):
        bpy.ops.viewcam.execute_preset(shipped="Lens 85 mm")

    def check(self):
        assert abs(camera().data.lens - 85) < 85 * 3 * 2**-24, f"the lens is {camera().data.lens} mm"
        is_at_its_values()

    def pose_for_the_picture(self):
        _, sidebar = region("VIEW_3D", "UI")
        move(sidebar.x - LEFT_OF_THE_PANEL, sidebar.y + sidebar.height - BELOW_ITS_TOP)  # where it opens
        yield
        call(bpy.ops.wm.call_panel, name="VIEWCAM_PT_presets", keep_open=True)
        for _ in range(4):
            yield

    def after_the_picture(self):
        press("ESC", 300, 300)
        yield
        yield


class Preferences(Step):
    """Another axis is up by default, and Level knows it."""

    edits, needs_a_window = 0, True

    def prepare(self):
        """Blender keeps preferences of what was enabled in them, not from the command line."""
        bpy.ops.preferences.addon_enable(module=room("preferences").PACKAGE)

    def by_hand(self):
        self.mine = room("preferences").get()
        self.mine.default_up = "Y"
        yield

    def check(self):
        assert room("preferences").up_axis() == (0, 1, 0)

    def tidy(self):
        self.mine.default_up = "Z"


STEPS = [
    *(Enable, TypeTheFourValues, TypeUp, Copy, Paste, Zoom, Roll, KeepTheFieldOfView),
    *(PickTheTarget, MoveTheTarget, ClearTheTarget),
    *(LookAtSelection, LookAtCursor, LookAtActive, FromTheCurrentView, Dolly, FrameByDistance, OrbitToTheRight, Swap, Level),
    *(DragTheLookAtPoint, DragTheEye, DragUp, ShowTheDiagramElsewhere, FourViews, LocalView, TwoWindows),
    *(DuplicateTheCamera, DeleteTheCamera, EnterEditMode),
    *(KeyTheEye, Play, Render, Bake),
    *(CompareWithCycles, Export, Preset, Preferences),
]
