"""The tour: keyframes, playback, F12, Bake."""

import tempfile
from pathlib import Path

import bpy
import numpy as np
from hands_in_a_window import NOWHERE, WAITING, press, window
from tour_hands import call, key_over, push, type_into
from tour_step import Step, camera, is_at_its_values, room, values

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


STEPS = [KeyTheEye, Play, Render, Bake]
