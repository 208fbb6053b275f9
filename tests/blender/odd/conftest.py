"""What holds docs/odd-blender.md to its word: its rows, each with the stages through which a test takes its scene."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest


@dataclasses.dataclass(frozen=True)
class OddRow:
    """A row of docs/odd-blender.md, and the scene that holds it to its word.

    sticks : whether the pose sticks right after `apply`, later, in the render; None where nothing is said of it.
    sentences : what the panel says in the end. folder : for files.
    """

    sticks: tuple[bool | None, bool | None, bool | None]
    sentences: list[str]
    folder: Path

    def check(self, camera_object, then=None, scene=None, reopened=True):
        """Apply the four values; let `then` happen, four frames pass; render; save and open again. Another file is open then.

        Fails unless at each stage the pose sticks or not as the row has it, and the panel says what the row says.
        reopened : whether that holds of the saved file too.
        """
        import bpy

        scene = scene or bpy.context.scene
        self.apply(camera_object, scene)
        if then:
            then()
        self.later(camera_object, scene, "after an update")
        scene.frame_set(scene.frame_current + 4)
        self.later(camera_object, scene, "at another frame")
        self.render(camera_object, scene)
        if reopened:
            self.later(*self.reopen(camera_object, scene), "saved and opened again")

    def apply(self, camera_object, scene):
        """Apply the four values."""
        from viewcam_addon.blender import camera as cameras
        from viewcam_addon.blender import datablocks
        from viewcam_addon.errors import InputError

        try:
            said = cameras.apply(camera_object, cameras.stated(camera_object, scene), scene)
        except InputError as error:
            said = [datablocks.sentence(error)]
        self._compare(0, _off_by(camera_object, scene, datablocks.depsgraph_of(scene)), "right after apply")
        if self.sticks[0] == self.sticks[1]:
            assert set(said) <= set(self.sentences), f"apply says {said}"

    def later(self, camera_object, scene, moment):
        """Look at the camera and at its panel."""
        import bpy

        from viewcam_addon.blender import datablocks, panel

        for _ in range(2):  # what a handler changes in one update shows in the next
            bpy.context.view_layer.update()
        self._compare(1, _off_by(camera_object, scene, datablocks.depsgraph_of(scene)), moment)
        said = panel.contents(camera_object, scene)[1]
        assert said == self.sentences, f"{moment} the panel says\n" + "\n".join(said)

    def render(self, camera_object, scene):
        """Look at the camera as a render engine gets it."""
        from viewcam_addon.blender import depsgraph

        off = depsgraph.visit(scene, lambda graph: _off_by(camera_object, scene, graph))
        self._compare(2, off, "in the render")

    def reopen(self, camera_object, scene):
        """Save and open again: the camera and the scene in the new file."""
        import bpy

        names, path = (camera_object.name, scene.name), str(self.folder / "odd.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        scene = bpy.data.scenes[names[1]]
        return scene.objects.get(names[0]) or bpy.data.objects[names[0]], scene

    def _compare(self, stage, off, moment):
        if self.sticks[stage] is not None:
            # Blender's own projection runs in float32: 20 roundings of numbers up to 2 · 1920 px.
            assert (off < 20 * 2.0**-24 * 3840) == self.sticks[stage], f"{moment} the picture is off by {off:.3g} px"


def _off_by(camera_object, scene, graph):
    """Pixels between where Blender's own function sees points about the look-at point and where the four values see them."""
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    from viewcam_addon.blender import camera as cameras
    from viewcam_addon.blender import datablocks
    from viewcam_addon.errors import InputError

    evaluated = camera_object.evaluated_get(graph)
    try:
        stated = cameras.stated(camera_object, scene)
    except InputError:
        return math.inf
    if not evaluated.is_evaluated or not evaluated.matrix_world.determinant():
        return math.inf
    frame = datablocks.frame_of(scene)
    points = np.add(stated.look_at, [(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0, 0, 0.5)])
    seen = np.array([world_to_camera_view(scene, evaluated, Vector(point)) for point in points])[:, :2]
    stated_at = np.column_stack(stated.project(points)[:2]) + frame.window[:2]
    return float(np.linalg.norm(seen * frame.size - stated_at, axis=1).max())


@pytest.fixture
def odd_rows(tmp_path):
    """The rows of docs/odd-blender.md by the name of their test."""
    rows = {}
    page = Path(__file__).resolve().parent.parent.parent.parent / "docs" / "odd-blender.md"
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if cells[-1].strip("`").startswith("test_"):
            _, *sticks, said, test = cells
            assert test not in rows and len(sticks) == 3, f"one row, three cells of yes or no for {test}"
            sticks = tuple({"yes": True, "no": False, "—": None}[cell] for cell in sticks)
            rows[test.strip("`")] = OddRow(sticks, [] if said == "nothing" else said.split("<br>"), tmp_path)
    return rows


@pytest.fixture
def odd(request, odd_rows):
    """The row of docs/odd-blender.md that names the test."""
    return odd_rows[request.node.originalname]
