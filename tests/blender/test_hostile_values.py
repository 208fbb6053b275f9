"""Numbers that no artist types and any script can set: the camera stays finite, the panel and the operators say a sentence.

Blender clamps infinity to the largest float32, and lets NaN pass everywhere.

Every combination of what may go wrong between d in pixels and Blender's lens: set through the properties, judged by Blender.

Two judges, neither of which shares a line with intrinsics.py: Blender's own `calc_matrix_camera` for the whole grid, and
Cycles, rendering where in the world each pixel falls, for a sample of it.
"""

import itertools
import json
import math
import warnings

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import rotation
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import datablocks
from viewcam_addon.blender.interface import panel
from viewcam_addon.errors import InputError

pytestmark = pytest.mark.slow


HOSTILE = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e20, 1e-38, 1e-45, 0.0)
TEXTS = (
    *("", "x", "[]", "null", "1", "{}", '"NaN"', "[1, 2, 3]", "[1, 2, [3]]", '{"a": 1}', "[" * 5000, "1" * 5000, "é\n"),
    *(json.dumps([item] * count) for item in (None, True, "1", [1], math.nan, math.inf) for count in (9, 10)),
    *("[" + ", ".join([number] * count) + "]" for number in ("1e400", "1" + "0" * 400, "9" * 5000) for count in (9, 10)),
)


@pytest.fixture(autouse=True)
def numpy_raises():
    """Turn NumPy's warnings into errors, except of underflow, of which it doesn't warn."""
    with np.errstate(divide="raise", over="raise", invalid="raise"), warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


def numbers_of(camera_object):
    """Everything of the camera that makes the picture."""
    channels = (
        *(camera_object.location, camera_object.rotation_euler, camera_object.rotation_quaternion, camera_object.scale),
        *camera_object.matrix_world,
    )
    camera = camera_object.data
    return [
        *(number for vector in channels for number in vector),
        *(camera.lens, camera.sensor_width, camera.sensor_height, camera.shift_x, camera.shift_y),
    ]


def assert_sentence(text):
    assert text[:1].isupper() and ": " in text and "\n" not in text and 20 < len(text) < 300, text


def operate(operator, camera_object):
    """Press a button: whatever it reports as an error is a sentence."""
    try:
        operator(camera=camera_object.name)
    except RuntimeError as error:
        assert_sentence(str(error).removeprefix("Error: ").rstrip("\n"))


def warnings_of(camera_object, scene):
    """The sentences of the panel's warnings."""
    return [notice.sentence for notice in panel.notices(camera_object, scene)]


def use(camera_object, scene, capfd):
    """Everything that an artist may do next. Returns what the panel says first."""
    bpy.context.view_layer.update()
    messages, rows = warnings_of(camera_object, scene), panel.readouts_of(camera_object, scene)
    for sentence in messages:
        assert_sentence(sentence)
    assert messages or not any("nan" in text for row in rows for text in (*row.texts, row.exact)), rows
    operate(bpy.ops.viewcam.apply_camera, camera_object)
    scene.frame_set(scene.frame_current + 1)
    operate(bpy.ops.viewcam.adopt_camera, camera_object)
    for enabled in (False, True):
        camera_object.virtual_pinhole.enabled = enabled
    bpy.context.view_layer.update()
    warnings_of(camera_object, scene)
    printed = "".join(capfd.readouterr())
    assert "Traceback" not in printed and "RuntimeWarning" not in printed, printed
    return messages


@pytest.mark.parametrize("pole", ["CANONICAL", "HOLD"])
@pytest.mark.parametrize("value", HOSTILE)
@pytest.mark.parametrize("name", ["eye", "look_at", "up", "distance", "zoom", "held_roll", "hold_within"])
def test_a_hostile_value_never_makes_a_camera_of_nans(posed_camera, scene, capfd, name, value, pole):
    group = posed_camera.virtual_pinhole
    group.pole = pole
    for values in ((value, 1.0, 2.0), (value,) * 3) if name in ("eye", "look_at", "up") else (value,):
        setattr(group, name, values)
        messages = use(posed_camera, scene, capfd)
        assert np.isfinite(numbers_of(posed_camera)).all(), numbers_of(posed_camera)
        if math.isnan(value) and (name != "held_roll" or pole == "HOLD") and name != "hold_within":
            assert any("finite" in sentence for sentence in messages), messages


@pytest.mark.parametrize("pole", ["CANONICAL", "HOLD"])
@pytest.mark.parametrize("name", ["exact", "when_set"])
@pytest.mark.parametrize("text", TEXTS, ids=lambda text: text[:12])
def test_hostile_text_in_a_hidden_property_changes_nothing(posed_camera, scene, capfd, name, text, pole):
    posed_camera.virtual_pinhole.pole = pole
    before = cameras.stated(posed_camera, scene)
    setattr(posed_camera.virtual_pinhole, name, text)
    assert cameras.stated(posed_camera, scene) == before
    assert use(posed_camera, scene, capfd) == []
    setattr(posed_camera.virtual_pinhole, name, text)
    posed_camera.virtual_pinhole.eye = (3, 4, 5)
    assert use(posed_camera, scene, capfd) == []
    assert np.isfinite(numbers_of(posed_camera)).all()


@pytest.mark.parametrize("keeps", ["PIXELS", "FIELD_OF_VIEW"])
@pytest.mark.parametrize("value", HOSTILE)
def test_a_hostile_picture_when_set_is_borne(posed_camera, scene, capfd, value, keeps):
    group = posed_camera.virtual_pinhole
    group.keeps = keeps
    for stored in ((value,) * 5, (1920, value, 100, 1, 1), (1920, 1080, 100, value, 1)):
        group.picture = group.counted_in = stored
        use(posed_camera, scene, capfd)
        assert np.isfinite(numbers_of(posed_camera)).all()


@pytest.mark.parametrize("value", HOSTILE)
@pytest.mark.parametrize("other", [None, 1.0])
def test_a_hostile_sensor_before_growth_is_no_sensor(posed_camera, scene, capfd, value, other):
    posed_camera.data.virtual_pinhole_sensor = (value, value if other is None else other)
    posed_camera.virtual_pinhole.distance = 1200
    assert use(posed_camera, scene, capfd) == []
    assert np.isfinite(numbers_of(posed_camera)).all()


def set_location(camera_object, parent, value):
    camera_object.location = (value, 0, 0)


def set_scale(camera_object, parent, value):
    camera_object.scale = (value, 1, 1)


def set_uniform_scale(camera_object, parent, value):
    camera_object.scale = (value,) * 3


def set_euler(camera_object, parent, value):
    camera_object.rotation_euler = (value, 0, value)


def set_quaternion(camera_object, parent, value):
    camera_object.rotation_mode, camera_object.rotation_quaternion = "QUATERNION", (value,) * 4


def set_axis_angle(camera_object, parent, value):
    camera_object.rotation_mode, camera_object.rotation_axis_angle = "AXIS_ANGLE", (1, value, 0, 0)


def set_deltas(camera_object, parent, value):
    camera_object.delta_location, camera_object.delta_scale = (value, 0, 0), (1, value, 1)


def set_delta_euler(camera_object, parent, value):
    camera_object.delta_rotation_euler = (value, 0, 0)


def set_delta_quaternion(camera_object, parent, value):
    camera_object.rotation_mode, camera_object.delta_rotation_quaternion = "QUATERNION", (value, 0, 0, 0)


def set_parent(camera_object, parent, value):
    camera_object.parent = parent
    parent.location, parent.scale = (value, 0, 0), (1, 1, value)


def set_parent_scale(camera_object, parent, value):
    camera_object.parent = parent
    parent.scale = (value,) * 3


def set_parent_inverse(camera_object, parent, value):
    camera_object.parent = parent
    camera_object.matrix_parent_inverse = [[value] * 4] * 4


def set_vertex_parent(camera_object, parent, value):
    mesh = bpy.data.meshes.new("Vertex")
    mesh.from_pydata([(0, 0, 0)], [], [])
    camera_object.parent = bpy.data.objects.new("Vertex", mesh)
    bpy.context.scene.collection.objects.link(camera_object.parent)
    camera_object.parent_type = "VERTEX"
    camera_object.matrix_parent_inverse = [[value] * 4] * 4


def set_matrix(camera_object, parent, value):
    camera_object.matrix_world = [[value] * 4] * 4


def set_lens(camera_object, parent, value):
    camera_object.data.lens = value


def set_sensor(camera_object, parent, value):
    camera_object.data.sensor_width = camera_object.data.sensor_height = value


def set_shift(camera_object, parent, value):
    camera_object.data.shift_x, camera_object.data.shift_y = value, -value


def set_focus(camera_object, parent, value):
    camera_object.data.dof.focus_distance = value


def set_focus_object(camera_object, parent, value):
    camera_object.data.dof.focus_object, parent.location = parent, (value,) * 3


def set_pixel_aspect(camera_object, parent, value):
    bpy.context.scene.render.pixel_aspect_x = value


def set_border(camera_object, parent, value):
    render = bpy.context.scene.render
    render.use_border = render.use_crop_to_border = True
    render.border_min_x = value


def set_reversed_border(camera_object, parent, value):
    render = bpy.context.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.9, value


def set_unit_scale(camera_object, parent, value):
    bpy.context.scene.unit_settings.scale_length = value


SETTERS = [function for name, function in sorted(globals().items()) if name.startswith("set_")]


@pytest.mark.parametrize("enabled", [True, False])
@pytest.mark.parametrize("setter", SETTERS, ids=lambda setter: setter.__name__[4:])
def test_a_hostile_blender_camera_is_read_or_refused_in_a_sentence(posed_camera, empty, scene, capfd, setter, enabled):
    posed_camera.virtual_pinhole.enabled = enabled
    parent = empty("Parent")
    for value in HOSTILE:
        setter(posed_camera, parent, value)
        bpy.context.view_layer.update()
        try:
            pinhole = cameras.read(posed_camera, scene)
        except InputError as error:
            assert ": " in str(error) and "\n" not in str(error), error
            if math.isnan(value):
                assert "not finite" in str(error) or "nan" in str(error), error
        else:
            # Nothing has been lost on the way: Pinhole refuses what is not finite.
            assert np.isfinite(np.concatenate(pinhole.basis())).all()
        use(posed_camera, scene, capfd)


def test_applying_the_values_mends_a_camera_whose_own_channels_are_not_finite(posed_camera, scene):
    wanted = cameras.stated(posed_camera, scene)
    posed_camera.location, posed_camera.rotation_euler = (math.nan,) * 3, (math.nan,) * 3
    assert "'Camera' holds a number that is not finite" in warnings_of(posed_camera, scene)[0]
    assert cameras.apply(posed_camera, wanted, scene) == []
    assert cameras.read(posed_camera, scene).eye == wanted.eye


def test_blenders_matrices_are_computed_with_in_float64(posed_camera, empty, scene):
    # From 5.0 on NumPy takes them for float32: a million meters away the location would be 0.06 m off.
    assert rotation.float64(posed_camera.matrix_world).dtype == np.float64
    parent = empty("Parent", location=(1e6 / 3, -1e6 / 7, 1e5))
    posed_camera.parent = parent
    bpy.context.view_layer.update()
    cameras.apply(posed_camera, cameras.stated(posed_camera, scene), scene)
    for have, at, want in zip(posed_camera.location, parent.location, posed_camera.virtual_pinhole.eye, strict=True):
        # Both numbers are float32; their difference is exact in float64 and rounded once.
        assert have == np.float32(np.float64(want) - np.float64(at))


def test_a_rotation_by_no_quaternion_is_that_of_blender(camera_object):
    camera_object.rotation_mode = "QUATERNION"
    for numbers in ((0, 0, 0, 0), (1e-30, 0, 0, 0), (1e-20, 0, 1e-20, 0)):
        camera_object.rotation_quaternion = numbers
        blenders = rotation.float64(camera_object.matrix_basis)[:3, :3]
        # The square of 1e-20 is a denormal float32 of 17 bits.
        np.testing.assert_allclose(rotation.from_quaternion(numbers), blenders, atol=2.0**-16)


SIZES = [(1920, 1080), (1080, 1920), (1001, 777), (333, 778), (512, 512)]
FITS = ["AUTO", "HORIZONTAL", "VERTICAL"]
ASPECTS = [(1.0, 1.0), (2.0, 1.0), (1.0, 1.5)]
SHIFTS = [(0.0, 0.0), (0.13, -0.21)]
PERCENTAGES = [100, 33]
BORDERS = ["whole", "border", "cropped border"]
GRID = list(itertools.product(SIZES, FITS, ASPECTS, SHIFTS, PERCENTAGES, BORDERS))

# calc_matrix_camera holds float32 numbers: 60 cameras differed by at most 3.8e-3 px from the ideal.
LARGEST_OF_BLENDERS_MATRIX = 4e-3


def set_up(scene, camera_object, size, fit, aspect, shift, percentage, border, random):
    """Scene and camera of one combination, then the four values through the properties; the Pinhole that they state."""
    render, camera, group = scene.render, camera_object.data, camera_object.virtual_pinhole
    render.resolution_x, render.resolution_y = size
    render.pixel_aspect_x, render.pixel_aspect_y = aspect
    render.resolution_percentage = percentage
    render.use_border, render.use_crop_to_border = border != "whole", border == "cropped border"
    render.border_min_x, render.border_min_y, render.border_max_x, render.border_max_y = 0.21, 0.13, 0.87, 0.71
    camera.sensor_fit = fit
    camera.shift_x, camera.shift_y = shift
    group.enabled = True
    group.eye, group.look_at, group.up = random.uniform(-5, 5, 3), random.uniform(-5, 5, 3), random.normal(size=3)
    group.distance = max(size) * random.uniform(0.5, 2.0)
    return cameras.stated(camera_object, scene)


def blenders_picture(scene, camera_object, points):
    """(column, row) of points in the rendered picture by calc_matrix_camera; the inverse of the pose in float64."""
    frame, render = datablocks.frame_of(scene), scene.render
    depsgraph = bpy.context.evaluated_depsgraph_get()
    evaluated = camera_object.evaluated_get(depsgraph)
    width, height = frame.size
    projection = np.array(
        evaluated.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x, scale_y=render.pixel_aspect_y)
    )
    to_camera = np.linalg.inv(np.array(evaluated.matrix_world))
    clip = np.column_stack([points, np.ones(len(points))]) @ (projection @ to_camera).T
    column, row, *_ = frame.window
    return (clip[:, 0] / clip[:, 3] + 1) * width / 2 - column, (clip[:, 1] / clip[:, 3] + 1) * height / 2 - row


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("size", SIZES)
def test_every_camera_of_the_grid_is_the_one_that_blender_sees(camera_object, scene, size, fit):
    random = np.random.default_rng(SIZES.index(size) * 3 + FITS.index(fit))
    combinations = [each for each in GRID if each[:2] == (size, fit)]
    assert len(combinations) == len(ASPECTS) * len(SHIFTS) * len(PERCENTAGES) * len(BORDERS)
    for combination in combinations:
        pinhole = set_up(scene, camera_object, *combination, random)
        findings = cameras.check(camera_object, pinhole, scene)
        assert findings == [], f"{combination}: {findings}"
        columns, rows = (
            grid.ravel() for grid in np.meshgrid(np.linspace(0, pinhole.width, 9), np.linspace(0, pinhole.height, 9))
        )
        directions = pinhole.ray_directions(columns, rows, 0, 0)
        points = np.array(pinhole.eye) + directions * random.uniform(5, 50, (len(columns), 1))
        for column, row in (
            blenders_picture(scene, camera_object, points),
            cameras.read(camera_object, scene).project(points)[:2],
        ):
            error = np.hypot(column - columns, row - rows).max()
            assert error <= LARGEST_OF_BLENDERS_MATRIX, f"{combination}: {error:.1e} px"


def test_the_grid_is_whole():
    assert len(GRID) == 5 * 3 * 3 * 2 * 2 * 3


@pytest.mark.parametrize("wrong", ["half a pixel", "fit", "aspect", "0.1 %", "mirrored"])
def test_the_judge_finds_a_wrong_camera(camera_object, scene, wrong):
    random = np.random.default_rng(0)
    pinhole = set_up(scene, camera_object, (1001, 777), "AUTO", (2.0, 1.0), (0.13, -0.21), 33, "cropped border", random)
    points = np.array(pinhole.eye) + pinhole.ray_directions([0, pinhole.width], [0, pinhole.height], 0, 0) * 20
    if wrong == "half a pixel":
        camera_object.data.shift_x += 0.5 / (1001 * 33 // 100)
    elif wrong == "fit":
        camera_object.data.sensor_fit = "VERTICAL"
    elif wrong == "aspect":
        scene.render.pixel_aspect_x = 1.0
    elif wrong == "0.1 %":
        camera_object.data.lens *= 1.001
    else:
        camera_object.scale[0] = -1
    column, row = blenders_picture(scene, camera_object, points)
    error = np.hypot(column - [0, pinhole.width], row - [0, pinhole.height]).max()
    assert error > 10 * LARGEST_OF_BLENDERS_MATRIX, f"{error:.1e} px"


# A step that shares no factor with the lengths of the grid's axes, so that each of their values is in the sample.
SAMPLE = GRID[::17]


def test_the_sample_holds_every_value_of_the_grid():
    for axis, values in enumerate([SIZES, FITS, ASPECTS, SHIFTS, PERCENTAGES, BORDERS]):
        assert {combination[axis] for combination in SAMPLE} == set(values)


@pytest.mark.parametrize("combination", SAMPLE, ids=lambda combination: "-".join(map(str, combination)).replace(" ", ""))
def test_cycles_renders_the_camera_that_was_stated(camera_object, scene, render_positions, picture_error, combination):
    (width, height), *others = combination
    small = (width // 8, height // 8)  # keeps the odd sizes odd at 100 %: 125 × 97, 41 × 97
    pinhole = set_up(scene, camera_object, small, *others, np.random.default_rng(SAMPLE.index(combination)))
    positions = render_positions()
    assert positions.shape[:2] == (pinhole.height, pinhole.width)
    if combination[-1] == "border":  # zeros outside
        column, row, width, height = datablocks.frame_of(scene).border_window
        assert not positions[0, 0].any()
        assert not positions[-1, -1].any()
        pinhole, positions = pinhole.cropped(column, row, width, height), positions[row : row + height, column : column + width]
    error, tolerance = picture_error(pinhole, positions)
    assert error <= tolerance, f"{error:.1e} px, and {tolerance:.1e} are rounding"
