"""The roll that Blender stores after `apply`, in every rotation mode: within 4e-7 rad, however the camera looks.

The values that files hold.

`saved/values.blend` was saved with Blender 4.2 by the last version without CameraValues; `saved/values.json` is what that read.
"""

import json
import math
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon import rotation
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import conversion, datablocks, findings, preferences, storage
from viewcam_addon.camera_values import CameraValues
from viewcam_addon.pinhole import Pinhole

MODES = ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "QUATERNION", "AXIS_ANGLE"]
FLOAT32 = 2.0**-24
# The largest error of the roll that was asked for. Euler angles rounded alone stay below 3.2e-7 (pose.py); the choice among
# neighbors does for the others.
LARGEST_ROLL = 4e-7
# A product of rotations in float32 rounds each entry by 4 · 2⁻²⁴ at most (four products of which the magnitudes sum to 1, and
# their sum), and so an axis by √3 times that. A parent is two products, with its inverse and with the camera's own matrix. Its
# own two axes, each entry rounded by 2⁻²⁵, are as much out of square, twice √3 · 2⁻²⁵, which no rotation of a child can mend.
PRODUCT = math.sqrt(3) * 4 * FLOAT32
UNDER_PARENT = LARGEST_ROLL + 2 * PRODUCT + math.sqrt(3) * FLOAT32


def roll_error(camera_object, pinhole):
    """Radians about the stated view axis from the stated to the stored u and v, whichever is further off."""
    evaluated = camera_object.evaluated_get(bpy.context.evaluated_depsgraph_get())
    u, v, _ = pinhole.basis()
    right, up, _ = np.array(evaluated.matrix_world)[:3, :3].T
    if pinhole.mirrored:
        right = -right
    return max(abs(math.atan2(right @ v, right @ u)), abs(math.atan2(up @ u, up @ v)))


def looking(eye, look_at, up):
    return Pinhole(tuple(eye), tuple(look_at), tuple(up), 1000.0, 1920, 1080)


def random_poses(random, count):
    for _ in range(count):
        eye = random.normal(0, 5, 3)
        yield looking(eye, eye + random.normal(0, 3, 3), random.normal(size=3))


def poses_close_to_up(random, count):
    """1 to 1e-17 rad from an up along an axis, from above and from below."""
    for _ in range(count):
        axis = random.integers(3)
        view = random.normal(size=3) * 10.0 ** random.uniform(-17, 0)
        view[axis] = random.choice([-1.0, 1.0])
        yield looking(view, (0, 0, 0), np.eye(3)[axis])


def poses_in_gimbal_lock(random, count):
    """For every Euler order the middle angle is ±90°, or up to 1e-17 rad beside it."""
    for _ in range(count):
        order = MODES[random.integers(6)]
        angles = random.uniform(-math.pi, math.pi, 3)
        angles["XYZ".index(order[1])] = random.choice([-1, 1]) * (math.pi / 2 - 10.0 ** random.uniform(-17, -1))
        matrix = rotation.from_euler(angles, order)
        yield looking(matrix[:, 2], (0, 0, 0), matrix[:, 1])


KINDS = [random_poses, poses_close_to_up, poses_in_gimbal_lock]


def check(camera_object, scene, poses, limit=LARGEST_ROLL):
    for pinhole in poses:
        conversion.place(camera_object, pinhole, scene, bpy.context.evaluated_depsgraph_get())
        error = roll_error(camera_object, pinhole)
        assert error <= limit, f"{camera_object.rotation_mode}: {error:.2e} rad for {pinhole}"


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", MODES)
def test_the_roll_is_stored_within_4e_7_radians(camera_object, scene, mode, kind):
    camera_object.rotation_mode = mode
    check(camera_object, scene, kind(np.random.default_rng(1), 100))


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", MODES)
def test_the_roll_is_stored_within_4e_7_radians_in_thousands_of_poses(camera_object, scene, mode, kind):
    camera_object.rotation_mode = mode
    check(camera_object, scene, kind(np.random.default_rng(2), 500))


@pytest.mark.parametrize("exponent", range(-17, 0))
@pytest.mark.parametrize("mode", MODES)
def test_the_roll_is_stored_at_any_angle_from_straight_down(camera_object, scene, mode, exponent):
    camera_object.rotation_mode = mode
    random = np.random.default_rng(-exponent)
    directions = random.normal(size=(3, 2))
    check(camera_object, scene, (looking((*(10.0**exponent * d), 1), (0, 0, 0), (0, 0, 1)) for d in directions))


@pytest.mark.parametrize("mode", MODES)
def test_the_roll_is_stored_with_delta_transforms(camera_object, scene, mode):
    camera_object.rotation_mode = mode
    camera_object.delta_rotation_euler, camera_object.delta_rotation_quaternion = (0.1, 0.2, 0.3), (0.8, 0.1, 0.6, -0.2)
    camera_object.delta_scale = (1, 2, 3)
    # The product with the delta rotation comes before the choice among neighbors, and is as much as it may miss.
    check(camera_object, scene, random_poses(np.random.default_rng(3), 100), LARGEST_ROLL + PRODUCT)


@pytest.mark.parametrize("mode", ["XYZ", "QUATERNION", "AXIS_ANGLE"])
def test_the_roll_is_stored_under_a_parent(camera_object, scene, mode):
    random = np.random.default_rng(4)
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    camera_object.parent, camera_object.rotation_mode = parent, mode
    for kind in KINDS:
        parent.location, parent.rotation_euler = random.normal(0, 5, 3), random.normal(0, 2, 3)
        parent.scale = [math.exp(random.normal())] * 3
        bpy.context.view_layer.update()
        camera_object.matrix_parent_inverse = parent.matrix_world.inverted()
        parent.rotation_euler = random.normal(0, 2, 3)
        bpy.context.view_layer.update()
        check(camera_object, scene, kind(random, 100), UNDER_PARENT)


def from_quaternion(numbers):
    matrix = rotation.from_quaternion(numbers)
    return looking(matrix[:, 2], (0, 0, 0), matrix[:, 1])


@pytest.mark.parametrize(
    ("mode", "numbers"),
    [
        ("QUATERNION", (0.03821824566126326, -0.6600684167027189, 0.7502326076722793, 0.0002921564531494881)),
        ("AXIS_ANGLE", (0.017720579998972353, 0.7580914116189941, -0.6519040917876271, -0.002108977138292242)),
    ],
)
def test_a_rotation_that_plain_rounding_spoils_is_stored_well(camera_object, scene, mode, numbers):
    """Found among 4 · 10⁵ at random: the worst for numbers that are merely rounded to float32."""
    camera_object.rotation_mode = mode
    pinhole = from_quaternion(numbers)
    if mode == "QUATERNION":
        camera_object.rotation_quaternion = numbers
    else:
        camera_object.rotation_axis_angle = rotation.axis_angle(rotation.from_quaternion(numbers))
    bpy.context.view_layer.update()
    plain = roll_error(camera_object, pinhole)
    assert plain > LARGEST_ROLL, f"{plain:.2e}"
    check(camera_object, scene, [pinhole], limit=plain / 2)


@pytest.mark.parametrize("roll", [1e-6, 1e-3, 1.0])
def test_a_roll_that_is_off_is_seen(camera_object, scene, roll):
    pinhole = next(random_poses(np.random.default_rng(5), 1))
    u, v, _ = pinhole.basis()
    conversion.place(camera_object, pinhole, scene, bpy.context.evaluated_depsgraph_get())
    other = looking(pinhole.eye, pinhole.look_at, math.cos(roll) * v + math.sin(roll) * u)
    assert abs(roll_error(camera_object, other) - roll) <= LARGEST_ROLL


# --- Adopt


def pose(camera_object):
    bpy.context.view_layer.update()
    return [tuple(row) for row in camera_object.matrix_world], camera_object.data.lens


def test_adopting_keeps_the_digits_of_values_that_the_camera_has(posed_camera, scene):
    posed_camera.virtual_pinhole.look_at = (0.1, 0.2, 0.3)
    before = posed_camera.virtual_pinhole.numbers()
    cameras.adopt(posed_camera, scene)
    assert posed_camera.virtual_pinhole.numbers() == before


def test_no_number_that_is_nothing_but_rounding_is_shown_as_minus_zero(camera_object, scene):
    """Such a remainder is kept where it is known, and the field shows 0."""
    pinhole = Pinhole((7, -1e-9, -0.0), (0, 3e-8, -1e-10), (-4.4e-8, 0, 1), 1000.0, 1920, 1080)
    cameras.apply(camera_object, pinhole, scene)
    group = camera_object.virtual_pinhole
    numbers = [*group.eye, *group.up]
    assert [math.copysign(1, number) for number in numbers if number == 0] == [1, 1, 1, 1]
    assert cameras.stated(camera_object, scene) == pinhole
    camera_object.rotation_euler = (math.pi / 2, 0, math.pi)
    bpy.context.view_layer.update()
    cameras.adopt(camera_object, scene)
    for number in (*group.eye, *group.look_at, *group.up):
        assert number == 0 or abs(number) > 1e-6, f"{number} is shown as a zero with a sign"


@pytest.mark.parametrize("seed", range(10))
def test_adopting_moves_nothing_and_applying_afterwards_neither(camera_object, scene, seed):
    random = np.random.default_rng(seed)
    camera_object.location, camera_object.rotation_euler = random.normal(0, 5, 3), random.normal(0, 2, 3)
    before = pose(camera_object)
    cameras.adopt(camera_object, scene)
    assert pose(camera_object) == before
    assert cameras.apply(camera_object, cameras.stated(camera_object, scene), scene) == []
    moved = np.abs(np.array(pose(camera_object)[0]) - np.array(before[0])).max()
    assert moved <= findings.LARGEST_TURN, f"{moved:.1e}"


def test_a_level_camera_is_given_the_worlds_up_and_a_rolled_one_its_own(camera_object, scene):
    camera_object.rotation_euler = (1.1, 0, 0.7)
    bpy.context.view_layer.update()
    cameras.adopt(camera_object, scene)
    assert tuple(camera_object.virtual_pinhole.up) == (0, 0, 1)
    camera_object.rotation_euler = (1.1, 1e-5, 0.7)
    bpy.context.view_layer.update()
    cameras.adopt(camera_object, scene)
    _, v, _ = cameras.read(camera_object, scene).basis()
    np.testing.assert_allclose(camera_object.virtual_pinhole.up, v, atol=1e-7)


def test_a_camera_in_use_keeps_the_distance_to_its_look_at_point(posed_camera, scene):
    reach = math.dist((7, -6, 5), (0, 0, 1))
    posed_camera.location = (20, 0, 0)
    bpy.context.view_layer.update()
    cameras.adopt(posed_camera, scene)
    eye, look_at, *_ = posed_camera.virtual_pinhole.numbers()
    assert eye == (20, 0, 0)
    assert math.dist(eye, look_at) == pytest.approx(reach, rel=1e-15)


def test_a_new_camera_looks_at_its_plane_of_focus(camera_object, scene):
    camera_object.data.dof.focus_distance = 4.0
    cameras.adopt(camera_object, scene)
    np.testing.assert_allclose(camera_object.virtual_pinhole.look_at, (0, 0, -4))


@pytest.mark.parametrize(("where", "depth"), [((3, 0, -6), 6), ((0, 0, 6), 10)])
def test_a_focus_object_counts_if_it_stands_before_the_camera(camera_object, scene, where, depth):
    focus = bpy.data.objects.new("Focus", None)
    scene.collection.objects.link(focus)
    focus.location = where
    bpy.context.view_layer.update()
    camera_object.data.dof.focus_object, camera_object.data.dof.focus_distance = focus, 10
    cameras.adopt(camera_object, scene)
    np.testing.assert_allclose(camera_object.virtual_pinhole.look_at, (0, 0, -depth))


@pytest.mark.parametrize("percentage", [100, 33])
def test_the_distance_counts_pixels_at_100_percent(camera_object, scene, percentage):
    scene.render.resolution_percentage = percentage
    cameras.adopt(camera_object, scene)
    assert camera_object.virtual_pinhole.numbers()[3] == pytest.approx(1920 * 50 / 36, rel=1e-15)


SAVED = Path(__file__).parent / "saved"
READ_BY_THE_OLD_VERSION = json.loads((SAVED / "values.json").read_text(encoding="utf-8"))


def digits(camera_object):
    """The numbers that the values ask for, to the bit."""
    stated = cameras.stated(camera_object, bpy.context.scene)
    if stated is None:
        return None
    return [number.hex() for number in (*stated.eye, *stated.look_at, *stated.up, *stated.distance)]


@pytest.mark.parametrize("name", READ_BY_THE_OLD_VERSION)
def test_a_file_of_an_older_version_opens_with_the_same_values_to_the_bit(fresh_blender, name):
    fresh_blender.ops.wm.open_mainfile(filepath=str(SAVED / "values.blend"))
    camera_object = fresh_blender.data.objects[name]
    group, expected = camera_object.virtual_pinhole, READ_BY_THE_OLD_VERSION[name]
    assert digits(camera_object) == expected["stated"]
    assert group.precision() == expected["precision"]
    assert camera_object.data.lens.hex() == expected["lens"]
    group.zoom = 1.5
    assert digits(camera_object) == expected["edited"]
    assert camera_object.data.lens.hex() == expected["edited_lens"]
    assert (float(group.roll).hex(), group.held_roll.hex()) == (expected["roll"], expected["held_roll"])


def test_what_is_stored_is_loaded_again_to_the_bit(camera_object, scene):
    frame = cameras.datablocks.frame_of(scene)
    values = CameraValues(
        eye=(0.1, 1e-9, 1 / 3),
        look_at=(-0.1, 2 / 7, -1e20),
        up=(1e-30, 0.0, 0.7),
        distance=1234.56789,
        zoom=0.5,
        keeps="FIELD_OF_VIEW",
        counted_in=frame,
        set_for=frame,
        pole="HOLD",
        hold_within=0.25,
        held_roll=-0.75,
        view_when_set=((0.1, 0.2, 0.3), (0.4, 0.5, 0.6), (0.7, 0.8, 0.9)),
        precision=2.0**-53,
    )
    names = [name for name in vars(values) if name not in ("precision", "enabled")]
    storage.store(camera_object, values, *names)
    assert storage.load(camera_object) == values


def test_storing_moves_nothing(posed_camera):
    before = posed_camera.matrix_basis.copy(), posed_camera.data.lens
    values = storage.load(posed_camera)
    storage.store(posed_camera, CameraValues((1, 2, 3), values.look_at, values.up, 77.0), *storage.EXACT)
    assert (posed_camera.matrix_basis, posed_camera.data.lens) == before
    assert posed_camera.virtual_pinhole.numbers() == ((1, 2, 3), (0, 0, 1), (0, 0, 1), 77)


def test_what_is_restored_is_as_it_was_whatever_was_stored(posed_camera):
    group = posed_camera.virtual_pinhole
    group.counted_in, group.exact = (1.5, -3, 0, 1e-30, 7), "nonsense"  # no picture and no number, either
    with storage.restored(posed_camera, "keeps", "counted_in", "exact"):
        group.keeps, group.counted_in, group.exact = "FIELD_OF_VIEW", (1, 2, 3, 4, 5), "[]"
    assert (group.keeps, group.exact) == ("PIXELS", "nonsense")
    assert tuple(group.counted_in) == pytest.approx((1.5, -3, 0, 1e-30, 7))


# --- Datablocks


@pytest.mark.parametrize(
    ("system", "unit", "scale", "value", "words"),
    [
        ("METRIC", "METERS", 1.0, 2.0, "2 m"),
        ("METRIC", "METERS", 0.01, 2.0, "0.02 m"),
        ("METRIC", "CENTIMETERS", 1.0, -2.5, "-250 cm"),
        ("METRIC", "MILLIMETERS", 1.0, 12345.6, "12345600 mm"),
        ("METRIC", "ADAPTIVE", 0.01, 2.0, "2 cm"),
        ("METRIC", "METERS", 1.0, 1e-9, "1e-09"),  # Blender would say 0 m
        ("METRIC", "METERS", 1.0, math.inf, "inf"),
        ("IMPERIAL", "FEET", 1.0, 3.048, "10'"),
        ("IMPERIAL", "INCHES", 1.0, 0.0254, '1"'),
        ("NONE", None, 0.01, 2.0, "2"),
    ],
)
def test_a_length_is_said_in_the_scenes_units(scene, system, unit, scale, value, words):
    scene.unit_settings.system, scene.unit_settings.scale_length = system, scale
    if unit:
        scene.unit_settings.length_unit = unit
    assert datablocks.length(value, scene) == words


def test_without_markers_a_render_takes_the_scenes_camera(camera_object, scene):
    scene.timeline_markers.new("Loose", frame=1)
    assert datablocks.render_camera(scene) == camera_object


@pytest.mark.parametrize(("frame", "chosen"), [(1, "A"), (5, "A"), (9, "A"), (10, "B"), (99, "B")])
def test_with_markers_a_render_takes_the_last_one_before_the_frame_or_the_first(add_camera, scene, frame, chosen):
    """And so does Blender, whose answer stands in the scene after a change of frame."""
    for name, at in (("B", 10), ("Unrendered", 7), ("A", 5)):
        scene.timeline_markers.new(name, frame=at).camera = add_camera(name)
    bpy.data.objects["Unrendered"].hide_render = True
    scene.frame_set(frame)
    assert datablocks.render_camera(scene).name == scene.camera.name == chosen


# --- Preferences


def test_without_an_add_on_there_are_the_defaults():
    assert preferences.get() == preferences.Defaults()
    assert preferences.up_axis() == (0, 0, 1)


def test_the_defaults_are_those_that_blender_shows():
    """One of each: what a person sees before the first change is what a script without an add-on gets."""
    properties = preferences.VIEWCAM_preferences.bl_rna.properties
    for name, default in vars(preferences.Defaults()).items():
        registered = properties[name].default_array if properties[name].type == "FLOAT" else properties[name].default
        assert registered == default if isinstance(default, str) else tuple(registered) == pytest.approx(default, rel=2**-24), (
            name
        )


@pytest.mark.parametrize(("name", "axis"), [("X", (1, 0, 0)), ("-Y", (0, -1, 0)), ("-Z", (0, 0, -1))])
def test_the_chosen_up_is_a_unit_vector(monkeypatch, name, axis):
    monkeypatch.setattr(preferences, "get", lambda: preferences.Defaults(default_up=name))
    assert preferences.up_axis() == axis


def test_every_up_that_can_be_chosen_is_an_axis(monkeypatch):
    names = [item.identifier for item in preferences.VIEWCAM_preferences.bl_rna.properties["default_up"].enum_items]
    assert len(names) == 6
    for name in names:
        monkeypatch.setattr(preferences, "get", lambda name=name: preferences.Defaults(default_up=name))
        assert sorted(map(abs, preferences.up_axis())) == [0, 0, 1]


def test_an_enabled_add_on_has_preferences_of_its_own(fresh_blender):
    addons = fresh_blender.context.preferences.addons
    addon = addons.new()
    try:
        addon.module = preferences.PACKAGE
        addon.preferences.default_up = "Y"
        assert preferences.up_axis() == (0, 1, 0)
        assert preferences.get().default_level == "GEOMETRY"
    finally:
        addons.remove(addon)
    assert preferences.get() == preferences.Defaults()
