"""The diagram in a viewport: whose camera it is of, and how often its lines are made.

What it looks like, and that the mouse can drag it, is looked at in tests/real_blender/handles_in_a_window.py.
"""

import ast
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import preferences
from viewcam_addon.blender.interface import overlay, viewport

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
