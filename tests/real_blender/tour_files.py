"""The tour: the proof in one click, scene files, presets, preferences."""

import os
import shutil
import tempfile
from pathlib import Path

import bpy
from hands_in_a_window import WAITING, move, press, region, window
from tour_hands import call, push, unfold
from tour_step import UPPER_PART, Step, camera, is_at_its_values, room, values

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


STEPS = [CompareWithCycles, Export, Preset, Preferences]
