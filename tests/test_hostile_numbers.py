"""Hostile numbers against every public function of pinhole.py and intrinsics.py: a right answer or one sentence, nothing else.

Each function has an attack below: it calls the function with what a `Source` gives it and looks at the answer. Hypothesis is
one source; the exhaustive tests draw 20,000 times from a fast one. A public function without an attack fails a test.

The right answers below them are those of the same formulas at 300 bits and more, from the smallest float64 to the largest.
"""

import contextlib
import inspect
import math
import sys
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from viewcam_addon import checks, intrinsics, pinhole
from viewcam_addon.errors import InputError
from viewcam_addon.intrinsics import CameraData, Frame
from viewcam_addon.pinhole import Pinhole, ViewPlane

pytestmark = pytest.mark.usefixtures("no_warnings")


EXTREMES = (
    *(0.0, -0.0, 5e-324, -5e-324, 2.2250738585072014e-308, 1e-308, -1e-308, 1e-200, 1e-162, 1e-45, 1.4e-45, 1e-16, 0.5),
    *(1.0, -1.0, 1.0 + 2.0**-52, 500.0, 2.0**31 - 1, 2.0**53, 1e16, 3.4028234663852886e38, 3.41e38, 1e154, 1e162, 1e200),
    *(8.9e307, 1e308, -1e308, 1.7976931348623157e308, -1.7976931348623157e308),
)
NOT_FINITE = (math.nan, math.inf, -math.inf)
NO_NUMBERS = (
    *(None, True, False, "1", "nan", "", b"1", 1j, [], {}, {1, 2, 3}, object(), float, 10**400, -(10**5000), Fraction(10**400)),
    *(np.ma.masked, np.array([]), np.array("1"), np.array([[1.0, 2.0, 3.0]]), np.complex128(1), np.datetime64("2026-01-01")),
    *(np.timedelta64(1, "s"), np.bool_(True), np.longdouble("1e4000"), [1.0, [2.0]], [[1], [2, 3]], "abc", b"abc"),
    [1.0, None, 2],
    *(np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0]), [1.0, np.ma.masked, 3.0], np.array([1, 2, 3j]), [True, False, True]),
    *(["1", "2", "3"], [10**400, 0, 1], {1: 2, 2: 3, 3: 4}, bytearray(b"abc"), np.float32("nan"), np.array(np.inf)),
)
NUMBERS_IN_DISGUISE = (
    *(np.float32(3.4e38), np.float16(2), np.int8(3), np.uint64(2**64 - 1), np.array(2.5), Fraction(1, 3), 2**70),
)
WHOLES = (1, 2, 64, 1920, 65536, 2**31 - 1, 2**31, 2**63, 10**30, 10**400, 0, -1, 2.5, 1.0, np.int32(7), np.array(5))
finite_floats = st.sampled_from(EXTREMES) | st.floats(allow_nan=False, allow_infinity=False) | st.floats(-1e4, 1e4)


class Hypothesis:
    """Draws from Hypothesis, so that a failure shrinks."""

    def __init__(self, data):
        self._data = data
        self._number = st.one_of(
            st.sampled_from(EXTREMES),
            st.floats(allow_nan=False, allow_infinity=False),
            st.floats(-1e4, 1e4),
            st.sampled_from((*NOT_FINITE, *NO_NUMBERS, *NUMBERS_IN_DISGUISE)),
        )

    def number(self):
        return self._data.draw(self._number)

    def finite(self):
        return self._data.draw(finite_floats)

    def choice(self, values):
        return self._data.draw(st.sampled_from(values))


class Random:
    """A million draws a second or so, seeded. One in thirty is no finite number, one in three is ordinary."""

    def __init__(self, seed, count=1 << 16):
        random = np.random.default_rng(seed)
        sized = np.ldexp(random.uniform(-1, 1, count), random.integers(-1022, 1024, count, np.int32))
        kinds = random.random(count)
        usual = random.normal(size=count) * 10
        numbers = np.where(kinds < 0.33, usual, np.where(kinds < 0.66, sized, random.choice(EXTREMES, count))).tolist()
        self._finite = numbers
        hostile = (*NOT_FINITE, *NO_NUMBERS, *NUMBERS_IN_DISGUISE)
        self._numbers = [
            hostile[i % len(hostile)] if kind > 0.966 else x for i, (x, kind) in enumerate(zip(numbers, kinds, strict=True))
        ]
        self._count, self._at, self._random = count, 0, random

    def _next(self):
        # A stride that shares no factor with the count walks through all, and each round begins elsewhere.
        self._at += 40503
        if self._at % 9973 == 0:
            self._at += int(self._random.integers(self._count))
        return self._at % self._count

    def number(self):
        return self._numbers[self._next()]

    def finite(self):
        return self._finite[self._next()]

    def choice(self, values):
        return values[self._next() % len(values)]


REFUSED = object()


def answer(function, *arguments):
    """The value of the function, or REFUSED where it raises InputError with one good sentence. Nothing else may be raised."""
    try:
        return function(*arguments)
    except InputError as error:
        sentence = str(error)
        assert "\n" not in sentence and 20 < len(sentence) < 400 and ": " in sentence, f"no good sentence: {sentence!r}"
        return REFUSED


ATTACKS = {}


def attacks(*names):
    """Registers a function of a source as an attack on the public functions of these names."""

    def register(attack):
        ATTACKS.update(dict.fromkeys(names, attack))
        return attack

    return register


def assert_numbers(*values):
    for value in values:
        assert value is REFUSED or not np.isnan(value).any(), f"nan in {values}"


def assert_unit(vectors):
    """Ten roundings of 2⁻⁵³: the axes' 4e-16, sums of three products, a division."""
    with np.errstate(under="ignore"):
        lengths = np.sqrt((np.asarray(vectors) ** 2).sum(axis=-1))
    assert abs(lengths - 1).max(initial=0) <= 10 * 2.0**-53, vectors


@attacks("pinhole.Pinhole")
def a_camera(source):
    # Every argument in turn is hostile beside good ones, or all are at once.
    numbers = [source.number() for _ in range(15)]
    good = [(1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 500.0, 64, 48, None, False]
    hostile = [
        *(tuple(numbers[i : i + 3]) for i in (0, 3, 6)),
        source.choice((numbers[9], (numbers[9], numbers[10]), numbers[10:14])),
        *(source.choice(WHOLES) for _ in range(2)),
        source.choice(((numbers[11], numbers[12]), numbers[13], None)),
        source.choice((False, True, numbers[14])),
    ]
    if source.choice((True, False)):
        i = source.choice(range(8))
        good[i] = hostile[i]
        hostile = good
    camera = answer(Pinhole, *hostile)
    if camera is not REFUSED:
        numbers = [*camera.eye, *camera.look_at, *camera.up, *camera.distance, *camera.principal_point]
        assert all(type(x) is float and math.isfinite(x) for x in numbers) and min(camera.distance) > 0, camera
        assert type(camera.width) is type(camera.height) is int and min(camera.width, camera.height) >= 1
        assert type(camera.mirrored) is bool
    return camera


def some_camera(source):
    """A camera of any size that is none of the refused."""
    eye, look_at, up = ([source.finite() for _ in range(3)] for _ in range(3))
    if source.choice((True, False)):
        eye, look_at, up = (1.5, -2.5, 3.0), (0.1, 0.2, 0.3), (0.0, 0.0, 1.0)  # where other things shall be hostile
    distance = [abs(source.finite()) or 1.0 for _ in range(2)]
    point = (source.finite(), source.finite()) if source.choice((True, False)) else None
    if list(eye) == list(look_at) or not any(up):
        return some_camera(source)
    return Pinhole(eye, look_at, up, distance, source.choice((1, 64, 4095)), 48, point, source.choice((True, False)))


@attacks(
    *(f"pinhole.Pinhole.{name}" for name in ("basis", "axes", "is_singular", "sine_to_up", "roll_uncertainty")),
    *(f"pinhole.Pinhole.{name}" for name in ("picture_axes", "field_of_view", "resized", "cropped")),
)
def what_a_camera_says(source):
    camera = some_camera(source)
    u, v, w = camera.axes()
    for axis in (u, v, w):
        assert abs(math.hypot(*axis) - 1) <= 1e-15, camera
    assert abs(u[0] * v[0] + u[1] * v[1] + u[2] * v[2]) <= 1e-15 >= abs(u[0] * w[0] + u[1] * w[1] + u[2] * w[2]), camera
    assert [axis.tolist() for axis in camera.basis()] == list(map(list, (u, v, w)))
    right = [-each for each in u] if camera.mirrored else list(u)
    assert camera.picture_axes().tolist() == [right, list(v), [-each for each in w]]
    sine = camera.sine_to_up
    assert 0 <= sine <= 1 and not (camera.is_singular and sine), camera
    assert 0 <= camera.roll_uncertainty() <= math.pi, camera
    roll = answer(camera.roll_uncertainty, source.number())
    assert roll is REFUSED or 0 <= roll <= math.pi, camera
    assert all(0 <= angle <= math.pi + 1e-15 for angle in camera.field_of_view()), camera
    answer(camera.resized, source.choice(WHOLES), source.choice(WHOLES))  # a Pinhole, if anything: attacked above
    answer(camera.cropped, source.number(), source.number(), source.choice(WHOLES), 48)


@attacks("pinhole.Pinhole.of_poses", "pinhole.basis_of_views", "pinhole.make_views")
def many_poses(source):
    """Refused where one of them is, and else what they are one by one; but that in an array True is 1, as for NumPy."""
    plane, draw = some_camera(source).plane, source.choice((source.number, source.finite))
    numbers = [float(x) if isinstance(x, bool | np.bool_) else x for x in (draw() for _ in range(18))]
    poses = [[numbers[i : i + 3] for i in (j, j + 3, j + 6)] for j in (0, 9)]
    pinholes = answer(Pinhole.of_poses, *zip(*poses, strict=True), [plane, plane])
    alone = [answer(Pinhole, *pose, plane.distance, plane.width, plane.height, plane.principal_point) for pose in poses]
    assert (pinholes is REFUSED) if REFUSED in alone else (pinholes == alone), (pinholes, alone)
    if all(isinstance(x, float) for x in numbers):
        views = np.array(poses).swapaxes(0, 1)
        axes, valid = pinhole.basis_of_views(*views)
        assert valid.tolist() == pinhole.make_views(*views).tolist() == [camera is not REFUSED for camera in alone], poses
        for i in np.flatnonzero(valid):  # each within 4e-16 of exact arithmetic
            assert np.abs(axes[:, i] - alone[i].basis()).max() <= 8e-16, poses[i]


@attacks("pinhole.Pinhole.ray_directions", "pinhole.Pinhole.view_plane", "pinhole.Pinhole.project", "pinhole.basis")
def what_many_numbers_give(source):
    camera = some_camera(source)
    shapes = (lambda: source.number(), lambda: [source.number(), source.number()], lambda: [[source.finite()]] * 3)
    column, row, px, py = (source.choice(shapes)() for _ in range(4))
    directions = answer(camera.ray_directions, column, row, px, py)
    if directions is not REFUSED:
        assert_unit(directions)
    result = answer(camera.view_plane, column, row)
    assert_numbers(*([] if result is REFUSED else result))
    points = (source.number(), [source.number() for _ in range(3)], [[source.finite() for _ in range(3)]] * 2)
    result = answer(camera.project, source.choice(points))
    if result is not REFUSED:
        column, row, depth = result
        assert_numbers(depth)
        behind = ~(np.asarray(depth) > 0)
        assert np.array_equal(np.isnan(column), behind) and np.array_equal(np.isnan(row), behind), camera
    axes = answer(pinhole.basis, *(source.choice(points) for _ in range(3)))
    if axes is not REFUSED:
        assert_unit(axes)


@attacks("pinhole.canonical_axes")
def the_canonical_axes(source):
    up = source.choice(([source.number() for _ in range(3)], [source.finite() for _ in range(3)]))
    axes = answer(pinhole.canonical_axes, up, source.choice((True, False, None, 1.0)))
    if axes is not REFUSED:
        assert all(abs(math.hypot(*axis) - 1) <= 1e-15 for axis in axes), up


def float32(source):
    """A number that Blender can hold, positive."""
    return min(max(abs(source.finite()), 2.0**-149), 3.4028234663852886e38)


@attacks(
    "intrinsics.CameraData",
    "intrinsics.Frame",
    "pinhole.ViewPlane",
    "pinhole.check_distance",
    "pinhole.Pinhole.plane",
    "intrinsics.Frame.size",
)
def the_classes_of_intrinsics(source):
    numbers = [source.number() for _ in range(5)]
    fit = source.choice((*intrinsics.FITS, "auto", "", None, 1, ["AUTO"]))
    camera = answer(CameraData, *numbers[:3], fit, *numbers[3:])
    if camera is not REFUSED:
        assert all(map(math.isfinite, (camera.lens, camera.sensor_width, camera.sensor_height, camera.shift_x, camera.shift_y)))
        assert min(camera.lens, camera.sensor_width, camera.sensor_height) > 0
    border = source.choice((None, numbers[:4], [0.1, 0.2, source.number(), 1.0], [0.9, 0.0, 0.1, 1.0], numbers[0]))
    wholes = [source.choice(WHOLES) for _ in range(3)]
    frame = answer(Frame, *wholes, *numbers[1:3], border, source.choice((True, False, None, numbers[4])))
    if frame is not REFUSED:
        assert min(frame.size) >= 0
    plane = answer(ViewPlane, source.choice((numbers[:2], numbers[0])), source.choice((numbers[2:4], None)), *wholes[:2])
    if plane is not REFUSED:
        assert all(map(math.isfinite, (*plane.distance, *plane.principal_point))) and min(plane.distance) > 0
        pinhole_of_it = Pinhole((0, 0, 1), (0, 0, 0), (0, 1, 0), plane.distance, *wholes[:2], plane.principal_point)
        assert pinhole_of_it.plane == plane and pinhole.check_distance(min(plane.distance)) is None


@attacks("intrinsics.view_plane", "intrinsics.camera_data", "intrinsics.Frame.window", "intrinsics.Frame.border_window")
def blenders_camera_and_the_view_plane(source):
    lens, width, height, *aspects = (float32(source) for _ in range(5))
    fit = source.choice(intrinsics.FITS)
    camera = CameraData(lens, width, height, fit, *(math.copysign(float32(source), source.finite()) for _ in range(2)))
    border = source.choice((None, (0.0, 0.25, 0.5, 1.0), (0.3, 0.3, 0.3, 0.3), (0.1, 5e-324, 0.9, 1.0)))
    sizes = [source.choice((1, 3, 1920, 65536, 2**31 - 1)) for _ in range(2)]
    frame = Frame(*sizes, source.choice((1, 33, 100, 32767)), *aspects, border, source.choice((True, False)))
    whole, window = (0, 0, *frame.size), frame.border_window
    assert min(window) >= 0 and window[0] + window[2] <= whole[2] and window[1] + window[3] <= whole[3], frame
    assert frame.window == (window if frame.crop else whole)
    plane = answer(intrinsics.view_plane, camera, frame)
    if plane is REFUSED:
        numbers = [abs(source.finite()) or 1.0 for _ in range(4)]
        plane = ViewPlane(numbers[:2], numbers[2:], max(frame.window[2], 1) % 2**31 or 1, max(frame.window[3], 1) % 2**31 or 1)
    sensor = source.choice(((width, height, fit), (source.number(), height, fit), (width, height, source.number())))
    back = answer(intrinsics.camera_data, plane, frame, *sensor)
    if back is not REFUSED:
        stored = np.array([back.lens, back.sensor_width, back.sensor_height, back.shift_x, back.shift_y])
        assert np.isfinite(stored).all() and np.float32(back.lens) >= 1 and (np.abs(stored) <= np.finfo(np.float32).max).all()


def any_frame(source):
    sizes = [source.choice((1, 3, 1920, 65536, 2**31 - 1)) for _ in range(2)]
    return Frame(*sizes, source.choice((1, 33, 100, 32767)), float32(source), float32(source))


@attacks("intrinsics.growth")
def another_picture(source):
    fit, before, after = source.choice(intrinsics.FITS), any_frame(source), any_frame(source)
    there, back = answer(intrinsics.growth, fit, before, after), answer(intrinsics.growth, fit, after, before)
    assert 0 < there < math.inf and abs(there * back - 1) <= 2 * 2.0**-52, (fit, before, after)  # two quotients, a product


@attacks("intrinsics.lens_in", "intrinsics.distance_by_lens")
def a_lens_in_any_unit(source):
    """There and back a distance loses what rounding the lens does to it, near 180° by 1/sin more."""
    frame, sensor = any_frame(source), (float32(source), float32(source))
    unit, fit, distance = source.choice(intrinsics.LENS_UNITS), source.choice(intrinsics.FITS), float32(source)
    lens = intrinsics.lens_in(unit, distance, frame, sensor, fit)
    is_length = unit in ("PIXELS", "MILLIMETERS")
    assert 0 < lens < math.inf and (is_length or lens <= math.pi), (unit, distance, frame)
    back = answer(intrinsics.distance_by_lens, unit, lens, frame, sensor, fit)
    amplified = 1.0 if is_length else lens / max(math.sin(lens), 1e-300)
    assert back is REFUSED or abs(back / distance - 1) <= (8 + 4 * amplified) * 2.0**-53, (unit, distance, lens, back)
    answered = answer(
        intrinsics.distance_by_lens, unit, source.choice((source.finite(), math.nan, math.inf)), frame, sensor, fit
    )
    assert answered is REFUSED or 0 < answered < math.inf, (unit, answered)


@attacks("intrinsics.own_sensor", "intrinsics.lens_and_sensor", "intrinsics.check_storable")
def a_sensor_that_grew(source):
    """Whatever a script has stored: the sensor is one of the two, and it grew by a power of two where it is the earlier."""
    current, before = ((source.finite(), source.finite()) for _ in range(2))
    before = source.choice((before, (0.0, 0.0), (math.nan, 1.0), tuple(side / 4 for side in current)))
    own = intrinsics.own_sensor(current, before)
    assert own in (current, before)
    if own is not current:
        assert own[0] * 2 ** round(math.log2(current[0] / own[0])) == current[0]
    data = CameraData(50.0, float32(source), 24.0)
    stored = intrinsics.lens_and_sensor(data, own)
    assert stored["virtual_pinhole_sensor"] in (own, (0.0, 0.0)) and stored["sensor_width"] == data.sensor_width
    values = (source.choice((source.finite(), math.inf, math.nan)),)
    answered = answer(lambda: intrinsics.check_storable("Camera", eye=values))
    assert (answered is REFUSED) == (not abs(values[0]) <= np.finfo(np.float32).max)


def public_functions():
    """Every public function, class, method and property of the two modules, by name."""
    for module in (pinhole, intrinsics):
        name = module.__name__.rpartition(".")[2]
        for key, public in vars(module).items():
            if key.startswith("_") or getattr(public, "__module__", None) != module.__name__ or not callable(public):
                continue
            yield f"{name}.{key}"
            if inspect.isclass(public):
                members = [member for member, value in vars(public).items() if callable(value) or hasattr(value, "__get__")]
                yield from (f"{name}.{key}.{member}" for member in members if not member.startswith("_"))


def test_every_public_function_is_attacked():
    assert sorted(public_functions()) == sorted(ATTACKS)


@pytest.mark.parametrize("attack", list(dict.fromkeys(ATTACKS.values())), ids=lambda attack: attack.__name__)
@given(data=st.data())
def test_hostile_numbers_get_a_right_answer_or_one_sentence(attack, data):
    attack(Hypothesis(data))


@pytest.mark.parametrize("attack", list(dict.fromkeys(ATTACKS.values())), ids=lambda attack: attack.__name__)
def test_some_hundred_random_attacks(attack):
    source = Random(seed=1)
    for _ in range(400):
        attack(source)


def test_what_is_no_number_is_shown_in_one_short_line():
    for value in NO_NUMBERS:
        text = checks.quoted(value)
        assert "\n" not in text and len(text) < 70, text
    with pytest.raises(InputError, match=r"eye is array\(\[\[1., 2., 3.\]\]\): give 3 numbers"):
        Pinhole(np.array([[1.0, 2.0, 3.0]]), (0, 0, 0), (0, 0, 1), 500, 64, 48)


TRIES = 20_000


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    "attack",
    [attack for attack in dict.fromkeys(ATTACKS.values()) if attack is not what_many_numbers_give],
    ids=lambda attack: attack.__name__,
)
def test_twenty_thousand_random_and_hostile_inputs_to_each_function(attack):
    source = Random(seed=2)
    for _ in range(TRIES):
        attack(source)


@pytest.mark.exhaustive
def test_twenty_thousand_random_and_hostile_rays_points_and_poses_at_once():
    source, many = Random(seed=3), 10_000
    for _ in range(TRIES // many):
        camera = some_camera(source)
        column, row = (np.array([source.finite() for _ in range(many)]) for _ in range(2))
        points, eye, look_at, up = (np.array([source.finite() for _ in range(3 * many)]).reshape(-1, 3) for _ in range(4))
        assert_numbers(*camera.view_plane(column, row))
        assert_unit(camera.ray_directions(column, row, 0.25, 0.75))
        column, row, depth = camera.project(points)
        assert_numbers(depth)
        assert np.array_equal(np.isnan(column), ~(depth > 0)) and np.array_equal(np.isnan(row), ~(depth > 0))
        eye[::2] = [source.finite() for _ in range(3)]  # one eye for half of them, as in an animation
        good = (eye != look_at).any(axis=-1) & up.any(axis=-1)
        assert_unit(pinhole.basis(eye[good], look_at[good], up[good]))
        answer(pinhole.basis, eye[:100], look_at[:100], up[:100])


def naive_rays(camera, columns, rows, px=0.5, py=0.5):
    x, y = (np.add(columns, px) - camera.principal_point[0]) / camera.distance[0], np.add(rows, py) / camera.distance[1]
    u, v, w = camera.basis()
    directions = x[..., None] * u + y[..., None] * v - w
    return directions / np.linalg.norm(directions, axis=-1)[..., None]


def naive_projection(camera, points):
    u, v, w = camera.basis()
    relative = np.asarray(points, dtype=float) - camera.eye
    depth = -(relative @ w)
    return relative @ u / depth, relative @ v / depth, depth


def naive_field_of_view(camera):
    return tuple(
        2 * math.atan(size / 2 / d) if d > 1e-300 else math.nan for size, d in zip((64, 48), camera.distance, strict=True)
    )


@pytest.mark.parametrize(
    ("attack", "name", "naive"),
    [
        (what_many_numbers_give, "ray_directions", naive_rays),
        (what_many_numbers_give, "project", naive_projection),
        (what_a_camera_says, "field_of_view", naive_field_of_view),
        (what_a_camera_says, "roll_uncertainty", lambda camera, precision=0.0: precision / camera.sine_to_up),
    ],
)
def test_the_attacks_find_the_edges_of_naive_formulas(attack, name, naive, monkeypatch):
    monkeypatch.setattr(Pinhole, name, naive)
    source = Random(seed=4)
    with pytest.raises((AssertionError, ArithmeticError, TypeError, ValueError)):
        for _ in range(1000):
            attack(source)


def test_a_function_that_is_not_attacked_is_found(monkeypatch):
    def new(number):
        return number

    new.__module__ = intrinsics.__name__
    monkeypatch.setattr(intrinsics, "new", new, raising=False)
    assert set(public_functions()) - set(ATTACKS) == {"intrinsics.new"}


ROUNDING = 2.0**-53
LARGEST = 1.7976931348623157e308
any_floats = st.floats(allow_nan=False, allow_infinity=False)
floats_of_all_sizes = (
    st.sampled_from((0.0, 5e-324, 1e-308, 1e-162, 1.0, 1e154, 1e308, -1e308, LARGEST, -LARGEST))
    | any_floats
    | st.floats(-1e4, 1e4)
)
positive_floats = floats_of_all_sizes.map(abs).filter(bool)
triples = st.tuples(floats_of_all_sizes, floats_of_all_sizes, floats_of_all_sizes)
pairs = st.tuples(floats_of_all_sizes, floats_of_all_sizes)
sizes = st.integers(1, 4096)
# Cameras of any size: what Pinhole takes, from one end of float64 to the other.
cameras = st.builds(
    lambda poses, up, *rest: Pinhole(*poses, up, *rest),
    st.tuples(triples, triples).filter(lambda poses: poses[0] != poses[1]),
    triples.filter(any),
    st.tuples(positive_floats, positive_floats),
    sizes,
    sizes,
    pairs | st.none(),
    st.booleans(),
)


def precise(vector):
    return [mpmath.mpf(float(x)) for x in vector]


def dot(a, b):
    return mpmath.fsum(x * y for x, y in zip(a, b, strict=True))


def is_near(have, true, error):
    """True if a float is the true number to within the error; infinite, where that is beyond float64's range."""
    if math.isinf(have):
        return abs(true) + error >= LARGEST and (have > 0) == (true > 0)
    return abs(mpmath.mpf(float(have)) - true) <= error + 5e-324


@given(cameras, floats_of_all_sizes, floats_of_all_sizes)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 64, 48), 1e308, -1e308)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), (5e-324, 1e308), 64, 48, (-1e308, 1e308)), 1e308, -1e308)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 64, 48, (0, 0)), 5e-324, -5e-324)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 1e308, 64, 48, (-1e308, 0)), 1e308, 0.0)
def test_rays_and_the_view_plane_are_right_for_every_distance_and_column(camera, column, row):
    with mpmath.workprec(300):
        x, y = (
            (mpmath.mpf(place) - center) / distance
            for place, center, distance in zip((column, row), camera.principal_point, camera.distance, strict=True)
        )
        assert is_near(camera.view_plane(column, row)[0], x, 2 * ROUNDING * abs(x))
        assert is_near(camera.view_plane([column], [row])[1][0], y, 2 * ROUNDING * abs(y))
        u, v, w = map(precise, camera.axes())
        across = -x if camera.mirrored else x
        length = mpmath.sqrt(x * x + y * y + 1)
        true = [(across * a + y * b - c) / length for a, b, c in zip(u, v, w, strict=True)]
        direction = camera.ray_directions(column, row, 0.0, 0.0)
        error = max(float(abs(a - b)) for a, b in zip(precise(direction), true, strict=True))
    # Two roundings of x and y, three products and two sums, the length's three, the division: 10 of a component.
    assert error <= 10 * ROUNDING


@given(cameras, triples)
@example(Pinhole((1e308, 0, 0), (0, 0, 0), (0, 0, 1), 500, 64, 48), (-1.7e308, 1e308, 5e-324))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 500, 64, 48), (5e-324, 5e-324, -5e-324))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 64, 48), (1e308, 5e-324, 1.0))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 1e308, 64, 48, (-1e308, 1e308)), (1.5, 1.0, -1.5))
@example(Pinhole((0, 0, 0), (1, 1, 1), (0, 0, 1), 500, 64, 48), (1.7e308, 1.7e308, 1.7e308))
def test_a_point_of_any_size_appears_where_exact_arithmetic_puts_it(camera, point):
    column, row, depth = camera.project(point)
    with mpmath.workprec(300):
        relative = [mpmath.mpf(a) - mpmath.mpf(b) for a, b in zip(point, camera.eye, strict=True)]
        size = max(map(abs, relative))
        u, v, w = map(precise, camera.axes())
        z = -dot(relative, w)
        # The difference and each product is rounded, and their two sums: 5 of the largest, thrice.
        rounded = 15 * ROUNDING * size
        assert is_near(depth, z, rounded)
        assert math.isnan(column) == math.isnan(row) == (not depth > 0)
        if not depth > 0 or z <= 4 * rounded or z < 2 * 5e-324:
            return  # too near the plane of the eye for figures
        x, y = dot(relative, u) * (-1 if camera.mirrored else 1), dot(relative, v)
        for have, across, center, distance in zip((column, row), (x, y), camera.principal_point, camera.distance, strict=True):
            moved = distance * across / z
            error = distance * rounded / z * (1 + abs(across) / z) * 2 + 6 * ROUNDING * (abs(moved) + abs(center))
            assert is_near(have, center + moved, error), f"{have} for {center + moved}"


@given(cameras)
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 5e-324, 4096, 1, (0, 0)))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), (5e-324, 1e308), 1, 1, (1e308, -1e308)))
@example(Pinhole((0, 0, 0), (0, 1, 0), (0, 0, 1), 1e308, 1, 1, (-1e308, 0.5)))
def test_the_field_of_view_is_right_from_nothing_to_half_a_turn(camera):
    (c_x, c_y), (d_x, d_y) = camera.principal_point, camera.distance
    with mpmath.workprec(4500):  # the angle between the corners may be 1e-600
        left, right = (mpmath.mpf(0) - c_x) / d_x, (mpmath.mpf(camera.width) - c_x) / d_x
        bottom, top = (mpmath.mpf(0) - c_y) / d_y, (mpmath.mpf(camera.height) - c_y) / d_y
        cosine = (left * right + bottom * top + 1) / mpmath.sqrt(
            (left * left + bottom * bottom + 1) * (right * right + top * top + 1)
        )
        true = (mpmath.atan(right) - mpmath.atan(left), mpmath.atan(top) - mpmath.atan(bottom), mpmath.acos(cosine))
        errors = [float(abs(mpmath.mpf(a) - b)) for a, b in zip(camera.field_of_view(), true, strict=True)]
    assert max(errors) <= 1e-15, errors


@given(cameras, positive_floats)
@example(Pinhole((1e308, 5e-324, 0), (1e308, 0, 0), (0, 0, 1), 500, 64, 48), 1e-300)
@example(Pinhole((1.7e308, -1.7e308, 1.7e308), (-1.7e308, 1.7e308, -1.7e308), (0, 0, 1), 500, 64, 48), 2.0**-24)
@example(Pinhole((0, 0, 1), (2, 0, 0), (5e-324, 0, 0), 5e-324, 1, 1), 5e-324)
def test_sine_and_roll_uncertainty_are_right_for_every_pose(camera, precision):
    with mpmath.workprec(4500):
        e, l, up = map(precise, (camera.eye, camera.look_at, camera.up))
        view = [a - b for a, b in zip(e, l, strict=True)]
        across = [up[1] * view[2] - up[2] * view[1], up[2] * view[0] - up[0] * view[2], up[0] * view[1] - up[1] * view[0]]
        lengths = [mpmath.sqrt(dot(vector, vector)) for vector in (across, up, view, e, l)]
        sine = lengths[0] / (lengths[1] * lengths[2])
        assert is_near(camera.sine_to_up, sine, 10 * ROUNDING * sine)
        if sine < 1e-300:
            return
        roll = min(mpmath.pi, precision * ((lengths[3] + lengths[4]) / lengths[2] + 1) / sine)
        # The roll that precision has turned is rounded to whole multiples of 5e-324 where it is that small, and then divided by
        # sine.
        assert is_near(camera.roll_uncertainty(precision), roll, 30 * ROUNDING * roll + 5e-324 / sine)
    assert camera.roll_uncertainty(0.0) == 0


@given(cameras, st.integers(1, 2**31 - 1), st.integers(1, 2**31 - 1), floats_of_all_sizes)
def test_resized_and_cropped_cameras_are_right_or_refused(camera, width, height, column):
    with contextlib.suppress(InputError):  # a number too large or too small
        resized = camera.resized(width, height)
        for name in ("distance", "principal_point"):
            for have, before, new, old in zip(
                getattr(resized, name), getattr(camera, name), (width, height), (camera.width, camera.height), strict=True
            ):
                assert is_near_fraction(have, Fraction(before) * new / old), f"{name}: {before} became {have}"
    with contextlib.suppress(InputError):
        assert camera.cropped(column, 0, width, height).principal_point[0] == camera.principal_point[0] - column


def is_near_fraction(have, true, roundings=4):
    return abs(Fraction(have) - true) <= abs(true) * Fraction(roundings * ROUNDING) + Fraction(5e-324)


float32_floats = positive_floats.map(lambda x: min(max(x, 2.0**-149), 3.4028234663852886e38))
blender_cameras = st.builds(
    CameraData,
    *[float32_floats] * 3,
    st.sampled_from(intrinsics.FITS),
    *[st.one_of(st.just(0.0), float32_floats, float32_floats.map(lambda x: -x))] * 2,
)
blender_frames = st.builds(Frame, sizes, sizes, st.integers(25, 200), float32_floats, float32_floats)


@given(blender_cameras, blender_frames)
def test_the_view_plane_of_every_camera_that_blender_can_store_is_right(camera, frame):
    assume(min(frame.size) >= 1)
    plane = intrinsics.view_plane(camera, frame)
    width, height = frame.size
    a_x, a_y = Fraction(frame.pixel_aspect_x), Fraction(frame.pixel_aspect_y)
    sides = {"HORIZONTAL": width * a_x, "VERTICAL": height * a_y, "AUTO": max(width * a_x, height * a_y)}
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    for axis, aspect in enumerate((a_x, a_y)):
        fitted = sides[camera.sensor_fit] / aspect
        assert is_near_fraction(plane.distance[axis], Fraction(camera.lens) / Fraction(sensor) * fitted)
        moved = Fraction((camera.shift_x, camera.shift_y)[axis]) * fitted
        half = Fraction(frame.size[axis], 2)
        error = 5 * Fraction(ROUNDING) * (abs(moved) + half)
        assert abs(Fraction(plane.principal_point[axis]) - (half - moved)) <= error
    with contextlib.suppress(InputError):  # a lens of 1 mm or more that Blender can't hold with this sensor
        back = intrinsics.camera_data(plane, frame, camera.sensor_width, camera.sensor_height, camera.sensor_fit)
        sensor_back = back.sensor_height if camera.sensor_fit == "VERTICAL" else back.sensor_width
        assert is_near_fraction(back.lens / sensor_back, Fraction(camera.lens) / Fraction(sensor), 10)


def test_masked_arrays_are_not_loaded_to_look_whether_there_are_any(monkeypatch):
    monkeypatch.delitem(sys.modules, "numpy.ma")
    monkeypatch.setattr(np.ma, "is_masked", lambda _: pytest.fail("numpy.ma is asked"))
    assert checks.array("column", [0, 1]).tolist() == [0, 1]
