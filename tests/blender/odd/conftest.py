"""The rows of docs/odd-blender.md, each with the stages through which a test takes its scene."""

import dataclasses
import inspect
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest


class _Layout:
    """Takes all that a panel puts into Blender's layout, which draws in a window only."""

    def __getattr__(self, name):
        return lambda *arguments, **looks: _Layout()

    def prop(self, block, name, **looks):
        assert hasattr(block, name), f"{block} has no {name}"

    def panel(self, name, **looks):
        return _Layout(), _Layout()


class _Panel:
    """Stands in for an instance of a panel's class, which Blender makes itself."""

    def __init__(self, kind):
        self.kind, self.layout = kind, _Layout()

    def __getattr__(self, name):
        attribute = inspect.getattr_static(self.kind, name)
        return attribute.__get__(self, self.kind) if hasattr(attribute, "__get__") else attribute


class _Over:
    """Blender's own modules, with something that only a window adds to them."""

    def __init__(self, blenders, **more):
        self._blenders = blenders
        vars(self).update(more)

    def __getattr__(self, name):
        return getattr(self._blenders, name)


@pytest.fixture
def draw_panels():
    """A function that draws the add-on's panels for the active object, as far as they are shown: their names.

    camera : the data that the properties editor shows, if it is another's than the active object's.
    """
    import bpy

    from viewcam_addon import blender

    def draw(camera=None):
        active, preferences = bpy.context.active_object, bpy.context.preferences
        context = _Over(
            bpy.context,
            camera=camera or (active.data if active and active.type == "CAMERA" else None),
            region=SimpleNamespace(width=300),
            preferences=_Over(preferences, system=SimpleNamespace(ui_scale=1.0, pixel_size=1.0)),
        )
        drawn = []
        for kind in (each for room in blender._rooms() for each in getattr(room, "CLASSES", ())):
            if issubclass(kind, bpy.types.Panel) and kind.__name__.startswith("VIEWCAM_PT") and _is_shown(kind, context, drawn):
                for part in ("draw_header", "draw"):
                    if hasattr(kind, part):
                        getattr(_Panel(kind), part)(context)
                drawn.append(kind.__name__)
        return drawn

    return draw


def _is_shown(kind, context, drawn):
    parent = getattr(kind, "bl_parent_id", None)
    return (parent is None or parent in drawn) and (not hasattr(kind, "poll") or kind.poll(context))


@pytest.fixture(autouse=True)
def no_traceback(capfd):
    """Whatever is done, nothing that a handler or a callback raises stands in the console."""
    yield
    output = "".join(capfd.readouterr())
    print(output)
    assert "Traceback" not in output


@dataclasses.dataclass(frozen=True)
class OddRow:
    """A row of docs/odd-blender.md, and the scene that holds it to its word.

    sticks : true for each of these moments at which the pose sticks: right after `apply`, later, in the render; None where
        nothing is said of it.
    sentences : the panel's sentences in the end.
    folder : a folder for files.
    draw : draws the panels of what is active.
    """

    sticks: tuple[bool | None, bool | None, bool | None]
    sentences: list[str]
    folder: Path
    draw: Callable[[], object] = list

    def check(self, camera_object, then=None, scene=None, reopened=True):
        """Apply the four values; let `then` happen, four frames pass; render; save and open again. Another file is open then.

        Fails unless at each stage the pose sticks or not as the row has it, and the panel says what the row says.
        reopened : true if that holds of the saved file too.
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
            messages = cameras.apply(camera_object, cameras.stated(camera_object, scene), scene)
        except InputError as error:
            messages = [datablocks.sentence(error)]
        self._compare(0, _off_by(camera_object, scene, datablocks.depsgraph_of(scene)), "right after apply")
        if self.sticks[0] == self.sticks[1]:
            assert set(messages) <= set(self.sentences), f"apply says {messages}"

    def later(self, camera_object, scene, moment):
        """Look at the camera and at its panel."""
        import bpy

        from viewcam_addon.blender import datablocks
        from viewcam_addon.blender.interface import panel

        for _ in range(2):  # what a handler changes in one update shows in the next
            bpy.context.view_layer.update()
        self._compare(1, _off_by(camera_object, scene, datablocks.depsgraph_of(scene)), moment)
        self.draw()
        sentences = [notice.sentence for notice in panel.notices(camera_object, scene)]
        assert sentences == self.sentences, f"{moment} the panel says\n" + "\n".join(sentences)

    def render(self, camera_object, scene):
        """Look at the camera as a render engine gets it."""
        from viewcam_addon.blender.scenes import depsgraph

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
def odd_rows(tmp_path, draw_panels):
    """The rows of docs/odd-blender.md by the name of their test."""
    rows = {}
    page = Path(__file__).resolve().parent.parent.parent.parent / "docs" / "odd-blender.md"
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if cells[-1].strip("`").startswith("test_"):
            _, *sticks, sentence, test = cells
            assert test not in rows and len(sticks) == 3, f"one row, three cells of yes or no for {test}"
            sticks = tuple({"yes": True, "no": False, "—": None}[cell] for cell in sticks)
            rows[test.strip("`")] = OddRow(
                sticks, [] if sentence == "nothing" else sentence.split("<br>"), tmp_path, draw_panels
            )
    return rows


@pytest.fixture
def odd(request, odd_rows):
    """The row of docs/odd-blender.md that names the test."""
    return odd_rows[request.node.originalname]
