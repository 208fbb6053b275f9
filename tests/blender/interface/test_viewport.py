"""The diagram in a viewport: whose camera it is of, and how often its lines are made.

What it looks like, and that the mouse can drag it, is looked at in tests/real_blender/handles_in_a_window.py.

Dragging a handle changes values and camera. With mouse and keys: tests/real_blender/handles_in_a_window.py.

Swipe in the viewport: the reference as the scene displays it, left of a line; in a window: tests/real_blender.
"""

import ast
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import diagram
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import preferences
from viewcam_addon.blender.interface import gizmos, overlay, swipe, viewport
from viewcam_addon.blender.rendering import live_view
from viewcam_addon.blender.rendering.picture_files import displayed
from viewcam_addon.pinhole import Pinhole

SOURCES = Path(overlay.__file__).parents[1]


@pytest.fixture
def drawn_lines(posed_camera, scene, monkeypatch):
    """The context in which Blender draws a 3D viewport that shows the camera, which is active and not selected."""
    space = viewport.area_in(bpy.context).spaces.active
    monkeypatch.setattr(space.overlay, "show_overlays", True)
    layer = bpy.context.view_layer
    layer.objects.active = posed_camera
    return SimpleNamespace(space_data=space, region_data=space.region_3d, scene=scene, view_layer=layer)


def _contrast(first, other):
    """The contrast of two colors as a screen gets them, as the Web's guidelines have it: from 1 to 21."""
    dark, light = sorted(
        float(np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4) @ (0.2126, 0.7152, 0.0722))
        for c in (first, other)
    )
    return (light + 0.05) / (dark + 0.05)


def test_axes_lines_and_handles_read_on_any_gray_which_without_their_halo_they_would_not(fresh_blender):
    """Calibrated: 2.46 is the least, of the red axis on a gray of 0.53."""
    theme = bpy.context.preferences.themes[0].user_interface
    pens = [theme.axis_x, theme.axis_y, theme.axis_z, theme.gizmo_primary, theme.gizmo_secondary]
    pens = [np.array(pen) for pen in (*pens, preferences.get().line_color[:3])]
    halo, share = np.array(overlay.HALO[:3]), overlay.HALO[3]
    for pen in pens:
        grays = [np.full(3, gray) for gray in np.linspace(0, 1, 101)]
        halos = [share * halo + (1 - share) * gray for gray in grays]
        seen = [
            max(_contrast(pen, gray), _contrast(pen, dark), _contrast(gray, dark))
            for gray, dark in zip(grays, halos, strict=True)
        ]
        assert min(seen) > 2.4 and min(_contrast(pen, gray) for gray in grays) < 1.05


def test_a_letter_stands_where_no_line_goes():
    lines = [overlay.Vector(end) for end in ((100, 0), (0, 100), (-3, 0), (-70, 70))]
    assert tuple(overlay._clearest(lines)) == pytest.approx((0, -1), abs=1e-6)
    assert overlay._clearest([]).angle(overlay.Vector((1, -1))) < 1e-3


def test_the_active_camera_has_its_diagram(drawn_lines, posed_camera):
    assert overlay._cameras(drawn_lines) == [posed_camera]


def test_the_selected_cameras_have_theirs_once_each(drawn_lines, posed_camera, add_camera):
    for name in ("Second", "Third", "Unselected"):
        add_camera(name).virtual_pinhole.enabled = True
    for name in ("Camera", "Second", "Third"):
        bpy.data.objects[name].select_set(True)
    assert sorted(block.name for block in overlay._cameras(drawn_lines)) == ["Camera", "Second", "Third"]


def _not_enabled(drawn_lines, camera):
    camera.virtual_pinhole.enabled = False


def _not_wanted(drawn_lines, camera):
    camera.virtual_pinhole.show_overlay = False


def _hidden(drawn_lines, camera):
    camera.hide_set(True)


def _excluded(drawn_lines, camera):
    collection = bpy.data.collections.new("Elsewhere")
    drawn_lines.scene.collection.children.link(collection)
    collection.objects.link(camera)
    drawn_lines.scene.collection.objects.unlink(camera)
    drawn_lines.view_layer.layer_collection.children["Elsewhere"].exclude = True


def _no_overlays(drawn_lines, camera):
    drawn_lines.space_data.overlay.show_overlays = False


def _looked_through(drawn_lines, camera):
    drawn_lines.region_data = SimpleNamespace(view_perspective="CAMERA")


def _another_is_active(drawn_lines, camera):
    other = bpy.data.objects.new("Other", None)
    drawn_lines.scene.collection.objects.link(other)
    drawn_lines.view_layer.objects.active = other


@pytest.mark.parametrize(
    "hide", [_not_enabled, _not_wanted, _hidden, _excluded, _no_overlays, _looked_through, _another_is_active]
)
def test_no_diagram(drawn_lines, posed_camera, hide):
    hide(drawn_lines, posed_camera)
    bpy.context.view_layer.update()
    assert overlay._cameras(drawn_lines) == []


def test_a_view_through_another_camera_shows_this_one(drawn_lines, posed_camera, add_camera, monkeypatch):
    other = add_camera("Other")
    drawn_lines.region_data = SimpleNamespace(view_perspective="CAMERA")
    assert overlay._cameras(drawn_lines) == [posed_camera]
    monkeypatch.setattr(drawn_lines.space_data, "use_local_camera", True)
    drawn_lines.space_data.camera = posed_camera
    assert overlay._cameras(drawn_lines) == []
    drawn_lines.space_data.camera = other
    assert overlay._cameras(drawn_lines) == [posed_camera]


def test_a_view_through_the_camera_marks_its_look_at_point_and_nothing_else(drawn_lines, posed_camera, monkeypatch):
    monkeypatch.setattr(overlay, "_pixel", lambda point, context: point)
    assert overlay.mark(drawn_lines) is None, "in another view the diagram shows it"
    drawn_lines.region_data = SimpleNamespace(view_perspective="CAMERA")
    assert overlay.mark(drawn_lines) == (0, 0, 1) and overlay.looked_through(drawn_lines) == posed_camera
    posed_camera.virtual_pinhole.show_overlay = False
    assert overlay.mark(drawn_lines) is None
    posed_camera.virtual_pinhole.show_overlay = True
    posed_camera.virtual_pinhole.enabled = False
    assert overlay.mark(drawn_lines) is None


def test_what_is_drawn_is_what_the_values_ask_for(drawn_lines, posed_camera):
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    limit = posed_camera.constraints.new("LIMIT_LOCATION")  # holds the camera off its values
    limit.use_max_x, limit.max_x = True, 0
    ((pinhole, up, share),) = overlay._figures(drawn_lines)
    assert pinhole.eye == (7, -6, 5) and up == (0, 0, 1) and share == posed_camera.virtual_pinhole.plane_at
    assert (pinhole.width, pinhole.height) == (1920, 1080)


def test_values_that_make_no_camera_have_no_diagram(drawn_lines, posed_camera):
    posed_camera.virtual_pinhole.look_at = posed_camera.virtual_pinhole.eye
    assert list(overlay._figures(drawn_lines)) == []


def test_lines_are_made_again_only_where_something_changed(drawn_lines, posed_camera):
    def drawn_anew():
        before = overlay._diagram.cache_info().misses
        for figure in overlay._figures(drawn_lines):
            overlay._diagram(*figure)
        return overlay._diagram.cache_info().misses - before

    drawn_anew()
    assert [drawn_anew() for _ in range(20)] == [0] * 20
    posed_camera.virtual_pinhole.eye[0] = 7.123
    assert [drawn_anew() for _ in range(3)] == [1, 0, 0]
    drawn_lines.scene.render.resolution_x = 1919
    assert [drawn_anew() for _ in range(3)] == [1, 0, 0]
    posed_camera.virtual_pinhole.plane_at = 0.25
    assert [drawn_anew() for _ in range(3)] == [1, 0, 0]
    posed_camera.data.dof.focus_distance = 3
    assert drawn_anew() == 0, "the plane of focus is not drawn"


def test_nothing_is_left_behind(registered_addon):
    assert len(overlay._handlers) == 2
    overlay.unregister()
    try:
        assert not overlay._handlers and overlay._diagram.cache_info().currsize == 0
    finally:
        overlay.register()


def test_the_graphics_card_is_left_alone_until_something_is_drawn():
    """Without a window there is none; gpu and blf are imported by the functions that draw alone."""
    for path in SOURCES.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        functions = [each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)]
        late = {line for each in functions for line in range(each.lineno, each.end_lineno + 1)}
        for each in ast.walk(tree):
            if isinstance(each, (ast.Import, ast.ImportFrom)):
                names = {getattr(each, "module", None), *(name.name for name in each.names)}
                assert not names & {"gpu", "gpu_extras.batch", "blf"} or each.lineno in late, f"{path.name}:{each.lineno}"


NAMES = ("eye", "look_at", "up")
ELSEWHERE = (3.25, -8.5, 2.125)  # numbers that float32 holds


@pytest.fixture(autouse=True)
def no_drag(fresh_blender):
    """No test leaves a drag behind that goes on."""
    yield
    gizmos.end_drag()
    if bpy.app.timers.is_registered(gizmos._end_if_over):
        bpy.app.timers.unregister(gizmos._end_if_over)


@pytest.fixture
def steps(monkeypatch):
    """The steps of undo that drags have pushed."""
    pushed = []
    monkeypatch.setattr(gizmos, "_push_undo", lambda message, window: pushed.append(message))
    return pushed


def everything(camera_object):
    """All that Blender stores of the camera and its values; floats bit by bit."""
    bpy.context.view_layer.update()
    result = {}
    for block in (camera_object, camera_object.data, camera_object.virtual_pinhole):
        for each in block.bl_rna.properties:
            if each.type in ("FLOAT", "INT", "BOOLEAN", "STRING"):
                value = getattr(block, each.identifier)
                result[block.bl_rna.identifier, each.identifier] = value if each.type == "STRING" else np.array(value).tobytes()
    return result


def check_messages(camera_object, scene):
    return cameras.check(camera_object, cameras.stated(camera_object, scene), scene)


@pytest.mark.parametrize("name", ["eye", "look_at"])
def test_a_dragged_point_is_where_the_handle_is(posed_camera, scene, steps, name):
    assert gizmos.place(posed_camera, name) == tuple(getattr(posed_camera.virtual_pinhole, name))
    gizmos.drag(posed_camera, name, ELSEWHERE)
    assert tuple(getattr(posed_camera.virtual_pinhole, name)) == gizmos.place(posed_camera, name) == ELSEWHERE
    assert check_messages(posed_camera, scene) == []


def test_a_dragged_up_points_to_the_handle_and_keeps_its_length(posed_camera, scene, steps):
    group = posed_camera.virtual_pinhole
    group.up = (0, 0, 2.5)
    gizmos.drag(posed_camera, "up", ELSEWHERE)
    eye, _, up, _ = group.numbers()
    arrow = np.subtract(ELSEWHERE, eye)
    # float32: three components, each rounded by 2⁻²⁴ of its size.
    np.testing.assert_allclose(up, 2.5 * arrow / np.linalg.norm(arrow), rtol=2**-24)
    assert check_messages(posed_camera, scene) == []
    tip = gizmos.place(posed_camera, "up")
    assert math.dist(tip, eye) == pytest.approx(math.dist(diagram.up_tip(*group.numbers()[:2], (0, 0, 1), group.plane_at), eye))


def test_up_dragged_into_the_eye_stays(posed_camera, steps):
    gizmos.drag(posed_camera, "up", ELSEWHERE)
    before = tuple(posed_camera.virtual_pinhole.up)
    gizmos.drag(posed_camera, "up", tuple(posed_camera.virtual_pinhole.eye))
    assert tuple(posed_camera.virtual_pinhole.up) == before


@pytest.mark.parametrize("mode", ["XYZ", "ZYX", "QUATERNION", "AXIS_ANGLE"])
@pytest.mark.parametrize("name", NAMES)
def test_canceling_restores_all_to_the_bit_though_the_camera_was_not_at_its_values(posed_camera, scene, steps, name, mode):
    posed_camera.rotation_mode = mode
    posed_camera.virtual_pinhole.pole = "HOLD"
    cameras.CameraSync.of(posed_camera).edited(scene)
    posed_camera.location, posed_camera.data.lens = (1.2345, 6.789, 0.1), 33.3
    before, start = everything(posed_camera), gizmos.place(posed_camera, name)
    for step in range(1, 5):
        gizmos.drag(posed_camera, name, tuple(np.add(start, (0.3 * step, -0.2 * step, 0.1)).tolist()))
    assert everything(posed_camera) != before
    gizmos.drag(posed_camera, name, tuple(np.float32(start).tolist()))
    after = everything(posed_camera)
    assert {key for key in before if after[key] != before[key]} == set()
    gizmos.end_drag()
    assert steps == [], "a canceled drag is no step of undo"


def test_what_was_stated_in_float64_comes_back_in_float64(posed_camera, scene, steps):
    group = posed_camera.virtual_pinhole
    cameras.apply(posed_camera, Pinhole((0.1, -7.2, 3.3), (0, 0, 0.7), (0, 0, 1), 1234.5678, 1920, 1080), scene)
    before = group.numbers()
    assert group.precision() == 2**-53
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    gizmos.drag(posed_camera, "eye", tuple(np.float32(before[0]).tolist()))
    assert group.numbers() == before and group.precision() == 2**-53


def test_a_drag_is_one_step_of_undo(posed_camera, steps):
    for x in range(5):
        gizmos.drag(posed_camera, "eye", (x, -8, 2))
    assert steps == []
    gizmos.end_drag()
    assert steps == ["Drag Eye"]
    gizmos.end_drag()
    gizmos.drag(posed_camera, "look_at", ELSEWHERE)
    gizmos.end_drag()
    assert steps == ["Drag Eye", "Drag Look-At"]


def test_the_next_drag_ends_one_whose_end_nobody_has_seen_yet(posed_camera, steps):
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    start = gizmos.place(posed_camera, "look_at")
    gizmos.drag(posed_camera, "look_at", (1, 2, 3))
    assert steps == ["Drag Eye"]
    gizmos.drag(posed_camera, "look_at", start)
    group = posed_camera.virtual_pinhole
    assert (tuple(group.eye), tuple(group.look_at)) == (ELSEWHERE, start)


def test_a_drag_that_leads_nowhere_is_no_step_of_undo(posed_camera, steps):
    start = gizmos.place(posed_camera, "eye")
    gizmos.drag(posed_camera, "eye", start)
    gizmos.end_drag()
    assert steps == []


def test_a_camera_that_is_deleted_while_it_is_dragged_ends_the_drag(posed_camera, steps):
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    bpy.data.objects.remove(posed_camera)
    gizmos.end_drag()
    assert steps == [] and gizmos._drag is None


@pytest.mark.parametrize("automatic", [False, True])
@pytest.mark.parametrize("keyed", ["eye", "look_at"])
def test_auto_keying_keys_what_is_animated(posed_camera, scene, steps, automatic, keyed):
    """A value without a curve gets none, as with Blender's own fields."""
    group = posed_camera.virtual_pinhole
    group.keyframe_insert(keyed, frame=1)
    group.keyframe_insert(keyed, frame=20)
    scene.frame_set(10)
    scene.tool_settings.use_keyframe_insert_auto = automatic
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    gizmos.end_drag()
    scene.frame_set(11)
    scene.frame_set(10)
    is_kept = keyed != "eye" or automatic
    assert (tuple(group.eye) == ELSEWHERE) == is_kept
    assert steps == ["Drag Eye"]


@pytest.mark.parametrize("name", ["eye", "look_at"])
def test_a_point_that_an_object_has_can_not_be_dragged(posed_camera, empty, name):
    setattr(posed_camera.virtual_pinhole, f"{name}_target", empty("There", (1, 2, 3)))
    assert gizmos.place(posed_camera, name) is None
    assert all(gizmos.place(posed_camera, other) for other in NAMES if other != name)


def test_values_that_make_no_camera_can_be_dragged_apart(posed_camera, scene, steps):
    group = posed_camera.virtual_pinhole
    group.look_at = group.eye
    assert gizmos.place(posed_camera, "up") is None
    gizmos.drag(posed_camera, "look_at", ELSEWHERE)
    assert check_messages(posed_camera, scene) == []


def test_there_are_no_handles_where_there_is_no_viewport(posed_camera):
    handles = bpy.context.window_manager.virtual_pinhole_handles
    before = everything(posed_camera)
    assert [tuple(getattr(handles, name)) for name in NAMES] == [(0, 0, 0)] * 3
    handles.eye = ELSEWHERE
    assert everything(posed_camera) == before


def test_no_gizmo_is_left_behind(posed_camera, steps):
    def keymaps():
        keyconfigs = bpy.context.window_manager.keyconfigs
        return [(each.name, keymap.name, len(keymap.keymap_items)) for each in keyconfigs for keymap in each.keymaps]

    before = keymaps()
    gizmos.drag(posed_camera, "eye", ELSEWHERE)
    for each in reversed(gizmos.CLASSES):
        if each is gizmos.Handles:
            gizmos.unregister()
        bpy.utils.unregister_class(each)
    try:
        assert gizmos._drag is None and not bpy.app.timers.is_registered(gizmos._end_if_over)
        assert not hasattr(bpy.types.WindowManager, "virtual_pinhole_handles")
        assert not hasattr(bpy.types, "VIEWCAM_GGT_handles")
    finally:
        for each in gizmos.CLASSES:
            bpy.utils.register_class(each)
        gizmos.register()
    assert keymaps() == before


def looked_up(table, light):
    """The colors that the shader shows for light, (n, 3), by a table of `swipe.shades`."""
    last = swipe._COLORS - 1
    at = np.clip(np.log2(np.maximum(light, 0) / 2.0**swipe._LOWEST + 1) / swipe._STOPS, 0, 1) * last
    low = np.minimum(at.astype(int), last - 1)
    share, total = at - low, 0.0
    for corner in np.ndindex(2, 2, 2):
        red, green, blue = (low + corner).T
        weight = np.where(corner, share, 1 - share).prod(axis=1)
        total = total + weight[:, None] * table[blue, green * swipe._COLORS + red, :3]
    return total


@pytest.mark.parametrize("transform", ["Standard", "Filmic", "AgX"])
def test_the_table_shows_light_as_the_scene_displays_it(scene, transform):
    scene.view_settings.view_transform = transform
    scene.view_settings.exposure = 0.5
    light = np.exp2(np.random.default_rng(1).uniform(-10, 5, (32, 32, 3))).astype(np.float32)
    light[0, 0] = 0
    shaded = looked_up(swipe.shades(scene), light.reshape(-1, 3))
    expected = displayed(scene, light)[..., :3].reshape(-1, 3)
    off = np.abs(shaded - expected) * 255
    # Calibrated: both sides are rounded to 1/255, and a transform of three channels has edges between the table's numbers.
    assert off.mean() < 0.5 and np.quantile(off, 0.99) < 4 and off.max() < 16, (off.mean(), off.max())
    assert np.abs(shaded - looked_up(swipe.shades(scene)[::-1], light.reshape(-1, 3))).mean() > 0.05, (
        "a table upside down is as good"
    )


@pytest.fixture
def view(posed_camera, scene, monkey):
    """A viewport of 48 × 32 pixels that looks through the camera, as far as a swipe looks at it."""
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    bpy.context.view_layer.update()

    def matrices():
        matrix = posed_camera.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=48, y=32)
        return {"window_matrix": matrix, "view_matrix": posed_camera.matrix_world.inverted(), "is_perspective": True}

    region = SimpleNamespace(type="WINDOW", x=100, y=50, width=48, height=32)
    space = SimpleNamespace(region_3d=SimpleNamespace(**matrices()), clip_start=0.1, clip_end=100.0)
    drawn = []
    area = SimpleNamespace(
        type="VIEW_3D", regions=[region], spaces=SimpleNamespace(active=space), tag_redraw=lambda: drawn.append(1)
    )
    yield SimpleNamespace(area=area, region=region, space=space, matrices=matrices, camera=posed_camera)
    live_view.unregister()


@pytest.fixture
def swiped(view, scene):
    result = swipe._Swipe(view.area, scene)
    result.asked = []
    result.live.show = lambda *what: result.asked.append(what)
    yield result
    result.live.close()


def test_it_follows_the_view_and_reads_the_scene_anew_for_more_than_cameras_alone(swiped, view, monkey):
    swiped.follow(bpy.context)
    swiped.follow(bpy.context)
    assert len(swiped.asked) == 1, "an unchanged view begins anew"
    first = swiped.asked[0][0]
    view.camera.location.x += 1
    bpy.context.view_layer.update()
    vars(view.space.region_3d).update(view.matrices())
    swiped.follow(bpy.context)
    second = swiped.asked[1][0]
    assert second.camera != first.camera and second.geometries is first.geometries
    monkey.location.x += 1
    bpy.context.view_layer.update()
    swiped.live.scene_changed(SimpleNamespace(id_type_updated=lambda _: False, updates=[SimpleNamespace(id=monkey)]))
    swiped.follow(bpy.context)
    third = swiped.asked[2][0]
    assert third.camera == second.camera and not np.array_equal(third.objects[0].matrices, second.objects[0].matrices)


def test_what_can_not_be_shown_is_told_and_the_next_view_is(swiped, view):
    view.space.region_3d.is_perspective = False
    swiped.follow(bpy.context)
    assert "orthographic" in swiped.message and not swiped.asked
    view.space.region_3d.is_perspective = True
    swiped.follow(bpy.context)
    assert swiped.message == "" and len(swiped.asked) == 1


def test_another_view_transform_is_another_table(swiped, scene):
    swiped.follow(bpy.context)
    before = swiped._shades
    scene.view_settings.exposure += 1
    swiped.follow(bpy.context)
    assert not np.array_equal(swiped._shades, before)


def test_the_line_is_taken_where_it_is_and_stays_in_the_region(swiped):
    assert swiped.line() == 24
    assert swiped.is_near(SimpleNamespace(mouse_x=126, mouse_y=60), 1.0)
    assert not swiped.is_near(SimpleNamespace(mouse_x=135, mouse_y=60), 1.0)
    assert not swiped.is_near(SimpleNamespace(mouse_x=126, mouse_y=40), 1.0), "below the viewport"
    for x, expected in ((112, 12), (0, 0), (900, 48)):
        swiped.drag(SimpleNamespace(mouse_x=x, mouse_y=0))
        assert swiped.line() == expected


def test_without_a_window_the_button_says_that_there_is_no_viewport(fresh_blender):
    assert not bpy.ops.viewcam.swipe_reference.poll()
    with pytest.raises(RuntimeError, match="no 3D viewport"):
        bpy.ops.viewcam.swipe_reference("INVOKE_DEFAULT")


def test_beside_the_line_stands_what_blender_calls_the_engine_of_the_viewport():
    shading = SimpleNamespace(type="RENDERED")
    for engine, name in (("BLENDER_WORKBENCH", "Workbench"), ("CYCLES", "Cycles")):
        settings = SimpleNamespace(engine=engine, bl_rna=bpy.types.RenderSettings.bl_rna)
        context = SimpleNamespace(space_data=SimpleNamespace(shading=shading), scene=SimpleNamespace(render=settings))
        assert swipe._name(context) == name
