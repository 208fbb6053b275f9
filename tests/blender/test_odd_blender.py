"""docs/odd-blender.md, row by row: parents, scenes, view layers, units and pictures around an enabled camera.

Each row says what its test expects (fixture `odd`). Every row has its test, every test its row, and a false row fails.
"""

import ast
import dataclasses
import inspect
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Matrix

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks, targets, versions
from viewcam_addon.blender.interface import panel
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.slow


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

        for _ in range(2):  # a handler's change in one update shows in the next
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
    page = Path(__file__).resolve().parent.parent.parent / "docs" / "odd-blender.md"
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


TURNED = (0.3, 0.4, 0.5)


@pytest.fixture
def rig(add_rig):
    """An armature with one bone, Head, posed."""
    armature = add_rig(0.4)
    armature.location, armature.rotation_euler = (1, 2, 3), TURNED
    armature.pose.bones["Head"].location = (0.5, 0, 0)
    return armature


@pytest.fixture
def carrying_path():
    """A circle that carries what hangs on it along."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=3, location=(1, 2, 3))
    curve = bpy.context.object
    curve.name = "Path"
    curve.data.use_path = curve.data.use_path_follow = True
    curve.data.eval_time = 30
    return curve


def apply_scale(block):
    """Object > Apply > Scale."""
    bpy.ops.object.select_all(action="DESELECT")
    block.select_set(True)
    bpy.context.view_layer.objects.active = block
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)


def set_again(camera_object, scene):
    return cameras.apply(camera_object, cameras.stated(camera_object, scene), scene)


def test_under_a_parent_that_is_moved_turned_and_scaled_the_pose_sticks(posed_camera, empty, odd):
    posed_camera.parent = empty("Dolly", (1, 2, 3), rotation_euler=TURNED, scale=(2, 2, 2))
    odd.check(posed_camera)


def test_under_a_parent_set_with_keep_transform_the_pose_sticks(posed_camera, empty, odd):
    parent = empty("Dolly", (1, 2, 3), rotation_euler=TURNED)
    posed_camera.parent, posed_camera.matrix_parent_inverse = parent, parent.matrix_world.inverted()
    parent.location = (4, 5, 6)
    odd.check(posed_camera)


def test_a_parent_that_moves_later_takes_the_camera_along(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    odd.check(posed_camera, then=lambda: setattr(parent, "location", (0, 0, 2)))


def test_under_a_mirrored_parent_the_pose_sticks_and_the_picture_stays_mirrored(posed_camera, empty, scene, odd):
    posed_camera.parent = empty("Mirror", scale=(-2, 2, 2))
    assert cameras.stated(posed_camera, scene).mirrored
    odd.check(posed_camera)


def test_under_a_turned_parent_that_is_scaled_non_uniformly_the_camera_is_oblique(posed_camera, empty, odd):
    posed_camera.parent = empty("Stretched", (1, 2, 3), rotation_euler=TURNED, scale=(1, 1, 3))
    odd.check(posed_camera)


def test_under_an_ancestor_that_is_scaled_non_uniformly_the_camera_is_oblique(posed_camera, empty, odd):
    ancestor = empty("Stretched", scale=(1, 1, 3))
    posed_camera.parent = empty("Dolly", (1, 2, 3), rotation_euler=TURNED)
    posed_camera.parent.parent = ancestor
    odd.check(posed_camera)


def test_applying_the_scale_of_the_parent_helps_as_the_sentence_says(posed_camera, empty, scene):
    posed_camera.parent = parent = empty("Stretched", (1, 2, 3), rotation_euler=TURNED, scale=(1, 1, 3))
    assert "apply the scale of 'Stretched'" in set_again(posed_camera, scene)[0]
    apply_scale(parent)
    assert set_again(posed_camera, scene) == []


def test_clearing_the_parent_inverse_helps_as_the_sentence_says(posed_camera, empty, scene):
    posed_camera.parent = empty("Dolly")
    posed_camera.matrix_parent_inverse = Matrix.Diagonal((1, 1, 3, 1))
    assert "clear the parent inverse" in set_again(posed_camera, scene)[0]
    posed_camera.matrix_parent_inverse = Matrix.Identity(4)
    assert set_again(posed_camera, scene) == []


def test_a_parents_stretching_along_the_cameras_own_axes_does_no_harm(posed_camera, empty, odd):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0, 0, 5), (0, 0, 0), (0, 1, 0)
    posed_camera.parent = empty("Stretched", scale=(1, 1, 3))
    odd.check(posed_camera)


def test_under_a_parent_that_is_scaled_to_zero_there_is_no_camera(posed_camera, empty, odd):
    posed_camera.parent = empty("Flat", scale=(1, 0, 1))
    odd.check(posed_camera)


def test_under_a_parent_inverse_with_a_non_uniform_scale_the_camera_is_oblique(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Stretched", rotation_euler=TURNED, scale=(1, 1, 3))
    posed_camera.matrix_parent_inverse = parent.matrix_world.inverted()
    parent.rotation_euler, parent.scale = (0, 0, 0), (1, 1, 1)
    odd.check(posed_camera)


def test_on_a_bone_the_pose_sticks(posed_camera, rig, odd):
    posed_camera.parent, posed_camera.parent_type, posed_camera.parent_bone = rig, "BONE", "Head"
    odd.check(posed_camera)


def test_on_a_bone_that_is_scaled_non_uniformly_the_camera_is_oblique(posed_camera, rig, odd):
    posed_camera.parent, posed_camera.parent_type, posed_camera.parent_bone = rig, "BONE", "Head"
    rig.pose.bones["Head"].scale = (1, 1, 3)
    odd.check(posed_camera)


def test_on_an_animated_bone_the_camera_goes_along(posed_camera, rig, odd):
    posed_camera.parent, posed_camera.parent_type, posed_camera.parent_bone = rig, "BONE", "Head"
    bone = rig.pose.bones["Head"]
    for frame, x in ((1, 0.0), (5, 2.0)):
        bone.location.x = x
        bone.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


@pytest.mark.parametrize(("kind", "vertices"), [("VERTEX", (3, 0, 0)), ("VERTEX_3", (3, 50, 100))])
def test_on_one_vertex_or_three_the_pose_sticks(posed_camera, odd, kind, vertices):
    bpy.ops.mesh.primitive_monkey_add(location=(1, 2, 3), rotation=TURNED)
    posed_camera.parent, posed_camera.parent_type = bpy.context.object, kind
    posed_camera.parent_vertices = vertices
    odd.check(posed_camera)


def test_on_a_path_that_it_follows_the_pose_sticks(posed_camera, carrying_path, odd):
    posed_camera.parent = carrying_path
    odd.check(posed_camera)


def test_on_a_path_with_an_animated_time_the_camera_goes_along(posed_camera, carrying_path, odd):
    posed_camera.parent = carrying_path
    for frame, time in ((1, 0.0), (5, 50.0)):
        carrying_path.data.eval_time = time
        carrying_path.data.keyframe_insert("eval_time", frame=frame)
    bpy.context.scene.frame_set(1)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_under_a_parent_with_a_constraint_the_pose_sticks(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    parent.constraints.new("COPY_LOCATION").target = empty("Car", (3, 3, 3))
    odd.check(posed_camera)


def test_under_a_parent_whose_constraint_moves_it_later_the_camera_goes_along(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    parent.constraints.new("COPY_LOCATION").target = car = empty("Car", (3, 3, 3))
    odd.check(posed_camera, then=lambda: setattr(car, "location", (3, 3, 5)))


def animate_height(block):
    for frame, height in ((1, 0), (5, 2)):
        block.location.z = height
        block.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(1)


def test_under_an_animated_parent_the_camera_goes_along(posed_camera, empty, odd):
    posed_camera.parent = parent = empty("Dolly")
    animate_height(parent)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_under_a_parent_with_a_driver_the_camera_goes_along(posed_camera, empty, odd):
    posed_camera.parent = empty("Dolly")
    posed_camera.parent.driver_add("location", 2).driver.expression = "2.0 if frame > 4 else 0.0"
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_under_an_animated_parent_animated_values_win(posed_camera, empty, scene, odd, render_positions, picture_error):
    posed_camera.parent = parent = empty("Dolly", rotation_euler=TURNED)
    animate_height(parent)
    group = posed_camera.virtual_pinhole
    for frame, height in ((1, 5), (9, 9)):
        group.eye[2] = height
        group.keyframe_insert("eye", frame=frame)
    scene.frame_set(3)
    scene.frame_start = scene.frame_end = 5
    positions = render_positions(animation=True)[5]
    scene.frame_set(5)
    error, tolerance = picture_error(cameras.stated(posed_camera, scene), positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera)


@pytest.fixture
def collected(posed_camera, scene):
    """The layer collection that alone holds the camera."""
    collection = bpy.data.collections.new("Cameras")
    scene.collection.children.link(collection)
    collection.objects.link(posed_camera)
    scene.collection.objects.unlink(posed_camera)
    return bpy.context.view_layer.layer_collection.children["Cameras"]


@pytest.fixture
def other_scene(posed_camera):
    """A function that adds a scene of another size with the camera in it."""

    def add(width, height):
        other = bpy.data.scenes.new("Other")
        other.collection.objects.link(posed_camera)
        other.camera = posed_camera
        other.render.resolution_x, other.render.resolution_y = width, height
        return other

    return add


def hidden_in(collected, state):
    if state == "excluded":
        collected.exclude = True
    elif state == "disabled":
        collected.collection.hide_viewport = True
    elif state == "hidden":
        collected.hide_viewport = True
    else:
        collected.collection.hide_render = True


@pytest.mark.parametrize("state", ["excluded", "disabled", "hidden", "not rendered"])
def test_the_scenes_camera_sticks_whatever_becomes_of_its_collection(posed_camera, collected, odd, state):
    hidden_in(collected, state)
    odd.check(posed_camera)


@pytest.mark.parametrize("state", ["excluded", "disabled"])
def test_another_camera_in_an_excluded_or_disabled_collection_takes_no_part(posed_camera, collected, add_camera, odd, state):
    add_camera("Other")
    hidden_in(collected, state)
    odd.check(posed_camera)


@pytest.mark.parametrize("state", ["hidden", "not rendered"])
def test_another_camera_in_a_hidden_collection_sticks(posed_camera, collected, add_camera, odd, state):
    add_camera("Other")
    hidden_in(collected, state)
    odd.check(posed_camera)


def test_a_camera_that_takes_no_part_stands_right_as_soon_as_it_does(posed_camera, add_camera, scene):
    add_camera("Other")
    posed_camera.hide_viewport = True
    posed_camera.virtual_pinhole.eye = (1, 2, 3)
    posed_camera.hide_viewport = False
    bpy.context.view_layer.update()
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


@pytest.mark.parametrize("hidden", ["in the view layer", "in viewports", "in renders"])
def test_a_hidden_camera_that_is_the_scenes_sticks(posed_camera, odd, hidden):
    if hidden == "in the view layer":
        posed_camera.hide_set(True)
    elif hidden == "in viewports":
        posed_camera.hide_viewport = True
    else:
        posed_camera.hide_render = True
    odd.check(posed_camera)


def test_another_camera_that_is_disabled_in_viewports_takes_no_part(posed_camera, add_camera, odd):
    add_camera("Other")
    posed_camera.hide_viewport = True
    odd.check(posed_camera)


def test_a_camera_that_only_another_view_layer_shows_sticks_as_the_scenes(posed_camera, collected, scene, odd):
    scene.view_layers.new("Second").layer_collection.children["Cameras"].exclude = False
    collected.exclude = True
    odd.check(posed_camera)


def test_of_a_camera_in_an_instanced_collection_the_object_itself_sticks(posed_camera, collected, empty, scene, odd):
    collection = collected.collection
    scene.collection.children.unlink(collection)
    instance = empty("Instance", (9, 9, 9))
    instance.instance_type, instance.instance_collection = "COLLECTION", collection
    odd.check(posed_camera)


def test_local_view_and_another_objects_edit_mode_do_no_harm(posed_camera, odd):
    bpy.ops.mesh.primitive_monkey_add()
    area = next((area for area in bpy.context.window.screen.areas if area.type == "VIEW_3D"), None)
    if area:
        with bpy.context.temp_override(area=area, region=area.regions[-1]):
            bpy.ops.view3d.localview()
            assert area.spaces.active.local_view and not posed_camera.local_view_get(area.spaces.active)
    bpy.ops.object.mode_set(mode="EDIT")
    odd.check(posed_camera)


def test_two_scenes_of_one_resolution_share_a_camera(posed_camera, other_scene, odd):
    other_scene(1920, 1080)
    odd.check(posed_camera)
    assert panel.notices(bpy.data.objects["Camera"], bpy.data.scenes["Other"]) == []


def test_in_a_second_scene_of_another_resolution_the_lens_is_wrong(posed_camera, other_scene, scene, odd):
    other = other_scene(960, 540)
    odd.apply(posed_camera, scene)
    odd.later(posed_camera, other, "in the other scene")
    odd.render(posed_camera, other)
    odd.later(*odd.reopen(posed_camera, other), "saved and opened again")


def test_a_camera_of_another_scene_sticks_there(add_camera, other_scene, scene, odd):
    """It is in that scene only; the panel of this scene does not show it."""
    camera_object = bpy.data.objects["Camera"]
    other = other_scene(800, 600)
    scene.collection.objects.unlink(camera_object)
    add_camera("Here")
    odd.check(camera_object, scene=other)


def test_with_shared_data_the_camera_that_was_set_last_has_its_lens(posed_camera, scene, odd):
    twin = bpy.data.objects.new("Twin", posed_camera.data)
    scene.collection.objects.link(twin)
    group = twin.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (5, 5, 5), (0, 0, 1), (0, 0, 1), 1000
    odd.check(posed_camera, then=lambda: setattr(group, "enabled", True))


def test_two_cameras_of_one_distance_share_their_data(posed_camera, scene, odd):
    twin = bpy.data.objects.new("Twin", posed_camera.data)
    scene.collection.objects.link(twin)
    group = twin.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (5, 5, 5), (0, 0, 1), (0, 0, 1), 1500
    group.enabled = True
    odd.check(posed_camera)


def keep_above(camera_object, height):
    """Though the values say otherwise, at every frame."""
    camera_object.virtual_pinhole.keyframe_insert("eye", frame=1)
    constraint = camera_object.constraints.new("LIMIT_LOCATION")
    constraint.use_min_z, constraint.min_z = True, height


def test_a_smaller_scale_of_units_changes_nothing_but_the_words(posed_camera, scene, odd):
    """A distance of 2 units is 0.02 m here."""
    scene.unit_settings.scale_length = 0.01
    odd.check(posed_camera, then=lambda: keep_above(posed_camera, 7))


def test_feet_change_nothing_but_the_words(posed_camera, scene, odd):
    scene.unit_settings.system, scene.unit_settings.length_unit = "IMPERIAL", "FEET"
    rows = {row.label: row.texts for row in panel.readouts_of(posed_camera, scene)}
    assert rows["To Look-At"] == ("32.972'",)  # √(7² + 6² + 4²) m
    odd.check(posed_camera, then=lambda: keep_above(posed_camera, 7))


def test_without_units_a_length_is_a_bare_number(posed_camera, scene, odd):
    scene.unit_settings.system = "NONE"
    odd.check(posed_camera, then=lambda: keep_above(posed_camera, 7))


def test_another_resolution_keeps_the_distance_in_pixels(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "resolution_x", 1280))
    assert bpy.data.objects["Camera"].virtual_pinhole.distance == 1500


def test_another_resolution_keeps_the_field_of_view_if_it_shall(posed_camera, scene, odd):
    posed_camera.virtual_pinhole.keeps = "FIELD_OF_VIEW"
    lens = posed_camera.data.lens
    odd.check(posed_camera, then=lambda: setattr(scene.render, "resolution_x", 1280))
    assert bpy.data.cameras["Camera"].lens == lens


def test_another_percentage_shows_the_same_picture(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "resolution_percentage", 50))


def test_a_cropped_border_shows_its_part_of_the_picture(posed_camera, scene, odd):
    def crop():
        scene.render.use_border = scene.render.use_crop_to_border = True
        scene.render.border_min_x, scene.render.border_max_y = 0.25, 0.75

    odd.check(posed_camera, then=crop)


def test_pixels_that_become_wider_keep_the_distance(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "pixel_aspect_x", 2))


def test_pixels_that_become_much_higher_keep_the_distance(posed_camera, scene, odd):
    odd.check(posed_camera, then=lambda: setattr(scene.render, "pixel_aspect_y", 2))


def test_stereoscopy_is_told(posed_camera, scene, odd):
    scene.render.use_multiview = True
    odd.check(posed_camera)


def test_a_marker_chooses_the_camera_of_its_frame(both_sides, posed_camera, add_camera, scene, odd):
    """A render shows it from the marker's frame on, and `viewcam check --frame` takes it."""
    other = add_camera("Other")
    other.location = (0, 0, 8)
    bpy.ops.mesh.primitive_monkey_add(size=3)
    for frame, camera_object in ((2, other), (4, posed_camera)):
        scene.timeline_markers.new(camera_object.name, frame=frame).camera = camera_object
    scene.frame_set(3)
    scene.camera = posed_camera  # by hand, which a render does not mind
    assert datablocks.render_camera(scene) == other
    sides = both_sides()
    sides.check()
    assert sides.exported.camera.eye == (0, 0, 8)
    for request, eye in (({"frame": 4}, (7, -6, 5)), ({"frame": 1}, (0, 0, 8)), ({"camera": "Camera"}, (7, -6, 5))):
        assert jobs.export(Job(**request)).camera.eye == eye
        assert (scene.camera, scene.frame_current) == (posed_camera, 3)
    assert [marker.camera for marker in scene.timeline_markers] == [other, posed_camera]
    scene.frame_set(4)
    odd.check(posed_camera)


def test_a_camera_that_blender_would_not_choose_at_its_marker_is_a_difference(
    both_sides, posed_camera, add_camera, scene, monkeypatch
):
    """Cycles was given the camera that the tracer had."""
    other = add_camera("Other")
    other.location = (0, 0, 8)
    bpy.ops.mesh.primitive_monkey_add(size=3)
    scene.timeline_markers.new("Other", frame=1).camera = other
    both_sides().check()
    monkeypatch.setattr(datablocks, "bound_camera", lambda *_: posed_camera)
    with pytest.raises(AssertionError):
        both_sides().check()


def test_a_camera_that_is_named_is_rendered_though_a_marker_chooses_another(both_sides, posed_camera, add_camera, scene):
    other = add_camera("Other")
    bpy.ops.mesh.primitive_monkey_add(size=3)
    scene.timeline_markers.new("Other", frame=1).camera = other
    sides = both_sides(camera="Camera")
    sides.check()
    assert sides.exported.camera.eye == (7, -6, 5)


# --- Channels of an enabled camera that something else sets too, or holds. docs/odd-blender.md says what each test expects
MODES = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "QUATERNION", "AXIS_ANGLE")


def animate(block, path, *values, frames=(1, 5)):
    for frame, value in zip(frames, values, strict=True):
        setattr(block, path, value)
        block.keyframe_insert(path, frame=frame)
    bpy.context.scene.frame_set(1)


@pytest.mark.parametrize("mode", MODES)
def test_in_every_rotation_mode_the_pose_sticks(posed_camera, odd, mode):
    posed_camera.rotation_mode = mode
    odd.check(posed_camera)


def test_a_negative_scale_mirrors_the_picture_and_the_pose_sticks(posed_camera, scene, odd, render_positions, picture_error):
    posed_camera.scale = (-1, 2, 3)
    bpy.context.view_layer.update()
    pinhole = cameras.stated(posed_camera, scene)
    assert pinhole.mirrored
    cameras.apply(posed_camera, pinhole, scene)
    positions = render_positions()
    error, tolerance = picture_error(cameras.stated(posed_camera, scene), positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera)


def test_a_camera_that_is_scaled_to_zero_is_none(posed_camera, odd):
    posed_camera.scale = (1, 1, 0)
    odd.check(posed_camera)


@pytest.mark.parametrize("mode", MODES)
def test_delta_transforms_are_taken_off_and_the_pose_sticks(posed_camera, odd, mode):
    posed_camera.rotation_mode = mode
    posed_camera.delta_location, posed_camera.delta_scale = (1, 2, 3), (1, 2, 3)
    posed_camera.delta_rotation_euler = (0.1, 0.2, 0.3)
    posed_camera.delta_rotation_quaternion = (0.8, 0.0, 0.6, 0.0)
    odd.check(posed_camera)


def test_delta_transforms_that_change_later_move_the_camera(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera, "delta_location", (0, 0, 2)))


def test_locked_channels_are_moved_all_the_same(posed_camera, odd):
    posed_camera.lock_location[0] = posed_camera.lock_rotation[2] = True
    odd.check(posed_camera)


def test_a_driver_on_the_location_wins(posed_camera, odd):
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    odd.check(posed_camera)


def test_a_driver_on_the_rotation_wins(posed_camera, odd):
    posed_camera.driver_add("rotation_euler", 2).driver.expression = "1.0 + 0.0"
    odd.check(posed_camera)


def test_a_driver_on_the_lens_wins(posed_camera, odd):
    posed_camera.data.driver_add("lens").driver.expression = "20.0 + 1.0"
    odd.check(posed_camera)


def test_a_driver_on_the_shift_moves_the_picture_and_the_pose_sticks(posed_camera, odd):
    posed_camera.data.driver_add("shift_x").driver.expression = "0.1 + 0.1"
    odd.check(posed_camera)


def test_a_driver_that_is_muted_does_no_harm(posed_camera, odd):
    driver = posed_camera.driver_add("location", 0)
    driver.driver.expression, driver.mute = "1.0 + 1.0", True
    odd.check(posed_camera)


def test_a_camera_moved_by_hand_is_told_without_blaming_its_muted_driver(posed_camera, odd):
    driver = posed_camera.driver_add("location", 0)
    driver.driver.expression, driver.mute = "1.0 + 1.0", True
    odd.check(posed_camera, then=lambda: setattr(posed_camera, "location", (7, -6, 7)))


def test_drivers_on_the_four_values_move_the_camera(posed_camera, empty, odd):
    """The handle is moved between frames."""
    handle = empty("Handle", (0, 0, 5))
    driver = posed_camera.virtual_pinhole.driver_add("eye", 2).driver
    driver.type = "SUM"
    target = driver.variables.new().targets[0]
    target.id, target.data_path = handle, "location.z"
    bpy.context.scene.frame_set(1)
    odd.check(posed_camera, then=lambda: setattr(handle, "location", (0, 0, 8)))
    assert bpy.data.objects["Camera"].location.z == 8


def test_keyframes_on_the_location_win(posed_camera, odd):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_keyframes_on_the_lens_win(posed_camera, odd):
    animate(posed_camera.data, "lens", posed_camera.data.lens, 50)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_keyframes_in_the_nla_win(posed_camera, odd):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    data = posed_camera.animation_data
    action = data.action
    data.action = None
    data.nla_tracks.new().strips.new("Strip", 1, action)
    odd.check(posed_camera, then=lambda: bpy.context.scene.frame_set(5))


def test_keyframes_that_are_muted_do_no_harm(posed_camera, odd):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    for curve in versions.animation_curves(posed_camera):
        curve.mute = True
    odd.check(posed_camera)


def test_keyframes_on_location_and_values_alike_win_in_the_render_only(
    posed_camera, scene, odd, render_positions, picture_error
):
    animate(posed_camera, "location", (7, -6, 5), (7, -6, 9))
    animate(posed_camera.virtual_pinhole, "eye", (7, -6, 5), (7, -6, 6))
    scene.frame_start = scene.frame_end = 5
    positions = render_positions(animation=True)[5]
    scene.frame_set(5)
    stated = cameras.stated(posed_camera, scene)
    error, tolerance = picture_error(stated, positions)
    assert error > 100 * tolerance, "the render follows the four values"
    _, v, w = stated.basis()
    rendered = Pinhole((7, -6, 9), tuple((7, -6, 9) - w), tuple(v), stated.distance, stated.width, stated.height)
    error, tolerance = picture_error(rendered, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera, reopened=False)


def test_keyframes_on_the_four_values_move_the_camera(posed_camera, odd):
    animate(posed_camera.virtual_pinhole, "eye", (7, -6, 5), (7, -6, 9))
    animate(posed_camera.virtual_pinhole, "distance", 1500, 500)
    odd.check(posed_camera)


def test_a_lens_changed_by_hand_is_told(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera.data, "lens", 50))


def test_a_shift_is_kept_and_the_pose_sticks(posed_camera, odd):
    posed_camera.data.shift_x, posed_camera.data.shift_y = 0.1, -0.2
    odd.check(posed_camera)


def test_a_lens_below_one_millimeter_grows_with_its_sensor(posed_camera, odd):
    posed_camera.virtual_pinhole.distance = 8
    odd.check(posed_camera)


def test_depth_of_field_blurs_the_picture_and_the_pose_sticks(posed_camera, odd):
    posed_camera.data.dof.use_dof = True
    odd.check(posed_camera)


def test_a_camera_made_orthographic_later_is_refused(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera.data, "type", "ORTHO"))


def test_a_camera_made_panoramic_later_is_refused(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera.data, "type", "PANO"))


def test_a_pose_far_from_the_origin_is_stored_as_well_as_float32_can(posed_camera, scene):
    pinhole = Pinhole((4.6e6, 1e6, 5.0), (4.6e6, 1e6 + 10, 1.0), (0, 0, 1), 1500, 1920, 1080)
    assert cameras.apply(posed_camera, pinhole, scene) == []


# --- Constraints on an enabled camera. docs/odd-blender.md says what each test expects (fixture `odd`)
@pytest.fixture
def constrain(posed_camera, empty):
    """A function that adds a constraint to the camera, by default with the empty Target at (5, 5, 5), turned."""

    def add(kind, target=True, **properties):
        constraint = posed_camera.constraints.new(kind)
        if target:
            constraint.target = bpy.data.objects.get("Target") or empty("Target", (5, 5, 5), rotation_euler=(0.3, 0.4, 0.5))
        for name, value in properties.items():
            setattr(constraint, name, value)
        bpy.context.view_layer.update()  # Child Of takes its inverse from where its target is now
        return constraint

    return add


@pytest.fixture
def path():
    """A circle that objects can follow."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=3, location=(1, 2, 3))
    bpy.context.object.data.use_path = True
    return bpy.context.object


def test_track_to_turns_the_camera(posed_camera, constrain, odd):
    constrain("TRACK_TO")
    odd.check(posed_camera)


def test_damped_track_turns_the_camera(posed_camera, constrain, odd):
    constrain("DAMPED_TRACK", track_axis="TRACK_NEGATIVE_Z")
    odd.check(posed_camera)


def test_track_to_the_look_at_point_leaves_an_upright_camera_where_it_belongs(posed_camera, constrain, empty, odd):
    constrain("TRACK_TO", target=False, target_space="WORLD", track_axis="TRACK_NEGATIVE_Z", up_axis="UP_Y")
    posed_camera.constraints[0].target = empty("Look", (0, 0, 1))
    odd.check(posed_camera)


def test_locked_track_turns_the_camera(posed_camera, constrain, odd):
    constrain("LOCKED_TRACK")
    odd.check(posed_camera)


def test_copy_location_moves_the_camera(posed_camera, constrain, odd):
    constrain("COPY_LOCATION")
    odd.check(posed_camera)


def test_copy_location_with_offset_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, odd):
    constrain("COPY_LOCATION", use_offset=True)
    odd.check(posed_camera)


def test_copy_rotation_turns_the_camera(posed_camera, constrain, odd):
    constrain("COPY_ROTATION")
    odd.check(posed_camera)


def test_copy_transforms_moves_and_turns_the_camera(posed_camera, constrain, odd):
    constrain("COPY_TRANSFORMS")
    odd.check(posed_camera)


def test_copy_scale_does_no_harm(posed_camera, constrain, odd):
    constrain("COPY_SCALE")
    bpy.data.objects["Target"].scale = (2, 3, 4)
    odd.check(posed_camera)


def test_child_of_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, odd):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].location = (2, 3, 4)
    odd.check(posed_camera)


def test_a_target_of_child_of_that_moves_later_takes_the_camera_along(posed_camera, constrain, odd):
    constrain("CHILD_OF")
    odd.check(posed_camera, then=lambda: setattr(bpy.data.objects["Target"], "location", (5, 5, 7)))


def test_child_of_a_target_that_is_scaled_non_uniformly_makes_the_camera_oblique(posed_camera, constrain, odd):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].scale = (1, 1, 3)
    odd.check(posed_camera)


def test_child_of_with_half_its_influence_moves_the_camera(posed_camera, constrain, odd):
    constrain("CHILD_OF", influence=0.5)
    bpy.data.objects["Target"].location = (5, 5, 7)
    odd.check(posed_camera)


def test_child_of_under_a_parent_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, empty, odd):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].location = (2, 3, 4)
    posed_camera.parent = empty("Dolly", (1, 2, 3), rotation_euler=(0.5, 0.6, 0.7))
    odd.check(posed_camera)


def test_an_armature_constraint_carries_the_camera_and_the_pose_sticks(posed_camera, constrain, add_rig, odd):
    armature = add_rig()
    armature.pose.bones["Head"].location = (1, 0, 0)
    target = constrain("ARMATURE", target=False).targets.new()
    target.target, target.subtarget = armature, "Head"
    odd.check(posed_camera)


def test_follow_path_carries_the_camera_and_the_pose_sticks(
    posed_camera, constrain, path, scene, odd, render_positions, picture_error
):
    constrain("FOLLOW_PATH", target=False, use_curve_follow=True, offset=20).target = path
    cameras.apply(posed_camera, cameras.stated(posed_camera, scene), scene)
    positions = render_positions()
    error, tolerance = picture_error(cameras.stated(posed_camera, scene), positions)
    assert error <= 2 * tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
    odd.check(posed_camera)


def test_follow_path_along_a_scaled_curve_moves_the_camera(posed_camera, constrain, path, odd):
    path.scale = (2, 2, 2)
    constrain("FOLLOW_PATH", target=False, offset=20).target = path
    odd.check(posed_camera)


def test_what_carries_the_camera_is_told_exactly_though_it_stood_far_away(posed_camera, constrain, scene):
    constrain("CHILD_OF")
    bpy.data.objects["Target"].location = (2, 3, 4)
    group = posed_camera.virtual_pinhole
    for height in (1e6, 5):
        group.eye = (7, -6, height)
        assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


def test_follow_path_with_an_animated_offset_takes_the_camera_along(posed_camera, constrain, path, scene, odd):
    constraint = constrain("FOLLOW_PATH", target=False)
    constraint.target = path
    for frame, offset in ((1, 0), (5, 50)):
        constraint.offset = offset
        constraint.keyframe_insert("offset", frame=frame)
    scene.frame_set(1)
    odd.check(posed_camera, then=lambda: scene.frame_set(5))


def test_limit_location_that_the_eye_keeps_does_no_harm(posed_camera, constrain, odd):
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=2)
    odd.check(posed_camera)


def test_limit_location_moves_the_camera(posed_camera, constrain, odd):
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=9)
    odd.check(posed_camera)


def test_limit_location_in_local_space_under_a_parent_moves_the_camera(posed_camera, constrain, empty, odd):
    posed_camera.parent = empty("Dolly", (5, 0, 0))
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=3, owner_space="LOCAL")
    odd.check(posed_camera)


def test_limit_rotation_turns_the_camera(posed_camera, constrain, odd):
    constrain("LIMIT_ROTATION", target=False, use_limit_x=True, max_x=0.1)
    odd.check(posed_camera)


def test_limit_scale_does_no_harm(posed_camera, constrain, odd):
    constrain("LIMIT_SCALE", target=False, use_max_x=True, max_x=0.5)
    odd.check(posed_camera)


def test_limit_distance_moves_the_camera(posed_camera, constrain, odd):
    constrain("LIMIT_DISTANCE", distance=3, limit_mode="LIMITDIST_INSIDE")
    odd.check(posed_camera)


def test_a_transformation_constraint_moves_the_camera(posed_camera, constrain, odd):
    constrain("TRANSFORM", from_max_x=10, to_max_x=4)
    odd.check(posed_camera)


def test_stretch_to_turns_the_camera(posed_camera, constrain, odd):
    constrain("STRETCH_TO")
    odd.check(posed_camera)


def test_a_muted_constraint_does_no_harm(posed_camera, constrain, odd):
    constrain("TRACK_TO", mute=True)
    odd.check(posed_camera)


def test_a_constraint_without_influence_does_no_harm(posed_camera, constrain, odd):
    constrain("COPY_TRANSFORMS", influence=0)
    odd.check(posed_camera)


def test_a_constraint_without_a_target_does_no_harm(posed_camera, constrain, odd):
    constrain("TRACK_TO", target=False)
    odd.check(posed_camera)


def test_of_two_constraints_the_guilty_one_is_named(posed_camera, constrain, odd):
    constrain("LIMIT_LOCATION", target=False, use_min_x=True, min_x=2)
    constrain("TRACK_TO")
    odd.check(posed_camera)


def test_animated_values_follow_a_moving_target_of_child_of(posed_camera, constrain, scene, odd):
    constrain("CHILD_OF")
    target, group = bpy.data.objects["Target"], posed_camera.virtual_pinhole
    for frame, height in ((1, 5), (9, 9)):
        target.location.z, group.eye[2] = height, height
        target.keyframe_insert("location", frame=frame)
        group.keyframe_insert("eye", frame=frame)
    scene.frame_set(1)
    odd.check(posed_camera)


# --- What people do with objects: duplicate, copy and paste, link, append, override, rename, delete, undo
@pytest.fixture
def aimed_camera(posed_camera, empty):
    """The posed camera with an object Target as look-at, which stands in for the point (0, 0, 1)."""
    posed_camera.virtual_pinhole.look_at_target = empty("Target", (0, 0, 1))
    bpy.context.view_layer.update()
    return posed_camera


@pytest.fixture
def carried_over(tmp_path):
    """A function that saves the file, opens an empty one and brings objects over: by "copy", "append" or "link"; the camera."""

    def carry(way, *names):
        path = str(tmp_path / "other.blend")
        if way == "copy":
            pick(*names)
            bpy.ops.view3d.copybuffer()
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        if way == "copy":
            bpy.ops.view3d.pastebuffer()
        else:
            directory = f"{path}/Object/"
            bring = bpy.ops.wm.append if way == "append" else bpy.ops.wm.link
            bring(directory=directory, files=[{"name": name} for name in names])
        bpy.context.scene.camera = bpy.data.objects["Camera"]
        bpy.context.view_layer.update()
        return bpy.data.objects["Camera"]

    return carry


def pick(*names):
    """Select these objects, the first one active."""
    bpy.ops.object.select_all(action="DESELECT")
    for name in names:
        bpy.data.objects[name].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]


def duplicate(*names, linked=False):
    """Shift-D or Alt-D: the copy of the first."""
    pick(*names)
    bpy.ops.object.duplicate(linked=linked)
    return bpy.data.objects[f"{names[0]}.001"]


def move(name, place):
    bpy.data.objects[name].location = place
    bpy.context.view_layer.update()


def place_of(name):
    return tuple(bpy.data.objects[name].evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world.translation)


def test_a_duplicate_follows_values_of_its_own(posed_camera, odd):
    group = duplicate("Camera").virtual_pinhole
    assert group.numbers() == posed_camera.virtual_pinhole.numbers()
    group.eye, group.distance = (1, 2, 3), 700
    bpy.context.view_layer.update()
    assert place_of("Camera") == (7, -6, 5) and place_of("Camera.001") == (1, 2, 3)
    assert posed_camera.data.lens == 1500 * 36 / 1920
    odd.check(bpy.data.objects["Camera.001"])


def test_of_linked_duplicates_the_one_that_was_set_last_has_its_lens(posed_camera, odd):
    twin = duplicate("Camera", linked=True)
    odd.check(posed_camera, then=lambda: setattr(twin.virtual_pinhole, "distance", 1000))


def test_a_duplicated_camera_looks_at_the_same_target(aimed_camera, odd):
    twin = duplicate("Camera")
    move("Target", (1, 1, 1))
    assert twin.virtual_pinhole.numbers()[1] == aimed_camera.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(twin)


def test_duplicated_along_with_its_target_it_looks_at_the_new_one(aimed_camera, odd):
    twin = duplicate("Camera", "Target")
    move("Target.001", (1, 1, 1))
    assert twin.virtual_pinhole.numbers()[1] == (1, 1, 1) and aimed_camera.virtual_pinhole.numbers()[1] == (0, 0, 1)
    odd.check(twin)


@pytest.mark.parametrize("way", ["copy", "append"])
def test_a_camera_that_is_copied_or_appended_brings_its_values_along(posed_camera, carried_over, odd, way):
    camera_object = carried_over(way, "Camera")
    assert camera_object.virtual_pinhole.numbers() == ((7, -6, 5), (0, 0, 1), (0, 0, 1), 1500)
    odd.check(camera_object)


@pytest.mark.parametrize("way", ["copy", "append"])
def test_a_camera_that_is_copied_or_appended_brings_its_target_along(aimed_camera, carried_over, odd, way):
    camera_object = carried_over(way, "Camera")
    move("Target", (1, 1, 1))
    assert camera_object.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(camera_object)


@pytest.mark.parametrize("names", [("Camera", "Target"), ("Camera",)], ids=str)
def test_a_linked_camera_follows_its_linked_target(aimed_camera, carried_over, odd, names):
    """Blender links the target's datablock too where only the camera is asked for, and shows it in no scene."""
    odd.check(carried_over("link", *names))


def test_an_override_of_a_camera_and_its_target_is_edited_here(aimed_camera, carried_over, odd):
    carried_over("link", "Camera", "Target")
    target = bpy.data.objects["Target"].override_create(remap_local_usages=True)
    camera_object = bpy.data.objects["Camera"].override_create(remap_local_usages=True)
    camera_object.data.override_create(remap_local_usages=True)
    camera_object.virtual_pinhole.look_at_target = target
    move(target.name, (1, 1, 1))
    camera_object.virtual_pinhole.eye = (7, -6, 6)
    odd.check(camera_object)
    camera_object = bpy.context.scene.camera
    assert camera_object.virtual_pinhole.numbers()[:2] == ((7, -6, 6), (1, 1, 1))


@pytest.mark.parametrize("data", [lambda: None, lambda: bpy.data.meshes.new("Mesh"), lambda: bpy.data.lights.new("Sun", "SUN")])
def test_all_values_of_what_is_no_camera_can_be_read_and_its_lens_set(scene, data):
    """Blender reads them as it looks for what an override has changed, and any script may."""
    group = bpy.data.objects.new("None", data()).virtual_pinhole
    names = [each.identifier for each in group.bl_rna.properties]
    before = {name: repr(getattr(group, name)) for name in names}
    assert group.focal_length == group.field_of_view == group.roll == 0
    group.focal_length, group.field_of_view = 50, 1
    assert {name: repr(getattr(group, name)) for name in names} == before


def test_renamed_all_goes_on(aimed_camera, odd):
    aimed_camera.name, aimed_camera.data.name, bpy.data.objects["Target"].name = "Shot", "Lens", "Aim"
    move("Aim", (1, 1, 1))
    assert aimed_camera.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(aimed_camera)


def test_where_its_target_is_deleted_the_camera_stays(aimed_camera, odd):
    def delete():
        pick("Target")
        bpy.ops.object.delete()

    move("Target", (1, 1, 1))
    odd.check(aimed_camera, then=delete, reopened=False)
    assert aimed_camera.virtual_pinhole.numbers()[1] == (1, 1, 1)


def test_where_its_target_is_removed_for_good_the_camera_stays(aimed_camera, odd):
    move("Target", (1, 1, 1))
    odd.check(aimed_camera, then=lambda: bpy.data.objects.remove(bpy.data.objects["Target"]))
    assert tuple(bpy.context.scene.camera.virtual_pinhole.look_at) == (1, 1, 1)
    assert targets.names(bpy.context.scene.camera) == {}


def test_where_another_camera_is_deleted_nothing_happens(posed_camera, add_camera, scene, odd, draw_panels):
    def delete():
        pick("Other")
        bpy.ops.object.delete()
        draw_panels()

    add_camera("Other")
    scene.camera = posed_camera
    odd.check(posed_camera, then=delete)


def test_given_other_data_a_camera_has_its_lens_when_it_is_set_again(posed_camera, odd):
    odd.check(posed_camera, then=lambda: setattr(posed_camera, "data", bpy.data.cameras.new("New")))


def test_made_single_user_it_has_a_lens_of_its_own(posed_camera, odd):
    twin = duplicate("Camera", linked=True)
    pick("Camera.001")
    bpy.ops.object.make_single_user(object=True, obdata=True)
    twin.virtual_pinhole.distance = 1000
    odd.check(posed_camera)


def test_in_a_full_copy_of_the_scene_the_camera_is_another(aimed_camera, odd):
    bpy.ops.scene.new(type="FULL_COPY")
    scene = bpy.context.scene
    move("Target.001", (1, 1, 1))
    scene.render.resolution_x = 1280
    bpy.context.view_layer.update()
    assert aimed_camera.virtual_pinhole.numbers()[1] == (0, 0, 1) and aimed_camera.data.lens == 1500 * 36 / 1920
    assert scene.camera.virtual_pinhole.numbers()[1] == (1, 1, 1)
    odd.check(scene.camera, scene=scene)


def test_when_its_scene_is_deleted_the_camera_stays_well_in_the_other(posed_camera, odd):
    def delete():
        bpy.ops.scene.new(type="LINK_COPY")
        bpy.data.scenes.remove(bpy.context.scene)

    odd.check(posed_camera, then=delete)


def duplicate_it():
    duplicate("Camera")


def delete_the_target():
    pick("Target")
    bpy.ops.object.delete()


def delete_the_camera():
    pick("Camera")
    bpy.ops.object.delete()


def remove_the_data():
    bpy.data.cameras.remove(bpy.data.cameras["Camera"])


def forget_the_scenes_camera():
    bpy.context.scene.camera = None


def unlink():
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["Camera"])


def exclude():
    collection = bpy.data.collections.new("Cameras")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(bpy.data.objects["Camera"])
    unlink()
    bpy.context.view_layer.layer_collection.children["Cameras"].exclude = True


def edit_another_object():
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.mode_set(mode="EDIT")


def clear_its_location():
    pick("Camera")
    bpy.ops.object.location_clear()


def rename():
    bpy.data.objects["Camera"].name, bpy.data.objects["Target"].name = "Shot", "Aim"


def parent_the_target_to_it():
    bpy.data.objects["Target"].parent = bpy.data.objects["Camera"]


def new_view_layer():
    bpy.context.scene.view_layers.new("Second").layer_collection.exclude = True


ACTIONS = (
    duplicate_it,
    delete_the_target,
    delete_the_camera,
    remove_the_data,
    forget_the_scenes_camera,
    unlink,
    exclude,
    edit_another_object,
    clear_its_location,
    rename,
    parent_the_target_to_it,
    new_view_layer,
)


@pytest.mark.parametrize("action", ACTIONS, ids=lambda action: action.__name__)
def test_undo_brings_camera_target_and_values_back(aimed_camera, action, draw_panels):
    bpy.context.preferences.edit.use_global_undo = True
    pick("Camera")
    bpy.ops.ed.undo_push(message="before")
    before = _everything()
    action()
    bpy.context.view_layer.update()
    draw_panels()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    draw_panels()
    assert _everything() == before
    move("Target", (1, 1, 1))
    assert datablocks.camera_in(bpy.context).virtual_pinhole.numbers()[1] == (1, 1, 1), "the target is not followed any more"
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()
    assert _everything() == before


def _everything():
    bpy.context.view_layer.update()
    state = {"camera": bpy.context.scene.camera and bpy.context.scene.camera.name}
    for block in bpy.context.scene.objects:
        state[block.name] = (tuple(map(tuple, block.matrix_world)), block.parent and block.parent.name)
        if block.type == "CAMERA":
            state[block.name] += (block.virtual_pinhole.numbers(), targets.names(block), block.data.lens)
    return state


def test_the_panel_of_data_that_no_object_of_the_scene_has_stays_away(posed_camera, draw_panels):
    """Pinned in the properties editor, while its object is deleted."""
    lonely = bpy.data.cameras.new("Lonely")
    assert not any(name.startswith("VIEWCAM_PT_data") for name in draw_panels(camera=lonely))
    assert "VIEWCAM_PT_data" in draw_panels(camera=posed_camera.data)


# --- Enabled cameras from another .blend: linked, overridden, half of each. docs/odd-blender.md says what each test expects
@pytest.fixture
def library(posed_camera, tmp_path):
    """A function that opens an empty file and links one camera object, or its data, from a saved one with an enabled camera."""
    path = str(tmp_path / "library.blend")

    def link(kind):
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        with bpy.data.libraries.load(path, link=True) as (_, names):
            setattr(names, kind, ["Camera"])
        return getattr(bpy.data, kind)["Camera"]

    return link


def show(block):
    scene = bpy.context.scene
    scene.collection.objects.link(block)
    scene.camera = block
    bpy.context.view_layer.update()
    return block


def state(camera_object, height):
    """Edit two of the four values as the panel does."""
    group = camera_object.virtual_pinhole
    group.eye, group.distance = (7, -6, height), 1300


def test_a_linked_camera_sticks_until_the_file_is_opened_again(library, odd):
    camera_object = show(library("objects"))
    state(camera_object, 6)
    odd.check(camera_object, reopened=False)
    camera_object, _ = odd.reopen(camera_object, bpy.context.scene)
    assert tuple(camera_object.virtual_pinhole.eye) == (7, -6, 5)
    assert camera_object.virtual_pinhole.distance == 1500


def test_a_local_camera_with_linked_data_loses_its_lens_when_the_file_is_opened_again(library, odd):
    data = library("cameras")
    camera_object = show(bpy.data.objects.new("Local", data))
    group = camera_object.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (7, -6, 6), (0, 0, 1), (0, 0, 1), 1300
    group.enabled = True
    odd.apply(camera_object, bpy.context.scene)
    camera_object, scene = odd.reopen(camera_object, bpy.context.scene)
    odd.later(camera_object, scene, "saved and opened again")
    odd.render(camera_object, scene)


def test_an_override_of_the_object_alone_loses_its_lens_when_the_file_is_opened_again(library, odd):
    camera_object = show(library("objects")).override_create(remap_local_usages=True)
    state(camera_object, 6)
    odd.apply(camera_object, bpy.context.scene)
    camera_object, scene = odd.reopen(camera_object, bpy.context.scene)
    odd.later(camera_object, scene, "saved and opened again")
    odd.render(camera_object, scene)


@pytest.mark.parametrize("system", [False, True])
def test_an_override_of_object_and_data_sticks(library, odd, system):
    """An override that may be edited in the window, and one of the system, which may not."""
    camera_object = show(library("objects")).override_create(remap_local_usages=True)
    camera_object.data.override_create(remap_local_usages=True)
    camera_object.override_library.is_system_override = camera_object.data.override_library.is_system_override = system
    state(camera_object, 6)
    odd.check(camera_object)
    camera_object = bpy.context.scene.camera
    assert camera_object.override_library and tuple(camera_object.virtual_pinhole.eye) == (7, -6, 6)


def found_tests():
    """The tests here that take the fixture `odd`, by name: whether they ask it for what the row says."""
    result = {}
    for node in ast.parse(Path(__file__).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef) and any(argument.arg == "odd" for argument in node.args.args):
            body = ast.unparse(node)
            result[node.name] = "odd.check(" in body or "odd.later(" in body
    return result


def test_every_row_has_its_test_and_every_test_its_row(odd_rows):
    assert set(odd_rows) == set(found_tests())
    assert len(odd_rows) > 90


def test_every_test_holds_its_row_to_its_word():
    assert [name for name, asks in found_tests().items() if not asks] == []


@pytest.mark.parametrize(
    "untruth",
    [
        {"sentences": ["The camera is well."]},
        {"sticks": (False, True, True)},
        {"sticks": (True, False, True)},
        {"sticks": (True, True, False)},
    ],
)
def test_a_row_that_is_not_true_is_seen(posed_camera, odd_rows, untruth):
    row = odd_rows["test_in_every_rotation_mode_the_pose_sticks"]
    assert (row.sticks, row.sentences) == ((True, True, True), [])
    with pytest.raises(AssertionError):
        dataclasses.replace(row, **untruth).check(posed_camera)
