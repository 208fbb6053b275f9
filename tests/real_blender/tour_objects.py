"""The tour: the camera as an object among objects, by Blender's own keys. tests/blender/odd has many more of these."""

import bpy
from hands_in_a_window import NOWHERE, press
from tour_hands import call
from tour_step import Step, select, state, values


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


STEPS = [DuplicateTheCamera, DeleteTheCamera, EnterEditMode]
