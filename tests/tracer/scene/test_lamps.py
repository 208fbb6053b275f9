"""What lamps may be: hostile values become a sentence, and what gives no light is known."""

import numpy as np
import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.tracer.scene.lamps import RAYS, Area, Point, Spot, Sun, World

EYE = np.eye(4)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Sun("key", irradiance=(1, float("nan"), 1)), "irradiance of light 'key'"),
        (lambda: Sun("key", irradiance=(1, -1, 1)), "irradiance of light 'key'"),
        (lambda: Sun("key", towards=(0, 0, 0)), "towards of light 'key'"),
        (lambda: Sun("key", towards=(0, float("inf"), 0)), "towards of light 'key'"),
        (lambda: Sun("key", angle=3.2), "angle of light 'key'"),
        (lambda: Sun("key", casts_shadow=2), "casts_shadow of light 'key'"),
        (lambda: Sun("key", multiple_importance=2), "multiple_importance of light 'key'"),
        (lambda: Point("key", power=(1e30,) * 3), "power of light 'key'"),
        (lambda: Point("key", position=(0, 0, 1e19)), "position of light 'key'"),
        (lambda: Point("key", radius=-1), "radius of light 'key'"),
        (lambda: Point("key", hidden_from={"shadows"}), "light 'key'"),
        (lambda: Spot("key"), "matrix of light 'key'"),
        (lambda: Spot("key", matrix=EYE * float("nan")), "matrix of light 'key'"),
        (lambda: Spot("key", matrix=EYE[:3]), "matrix of light 'key'"),
        (lambda: Spot("key", matrix=EYE, blend=1.1), "blend of light 'key'"),
        (lambda: Spot("key", matrix=EYE, angle=-0.1), "angle of light 'key'"),
        (lambda: Area("key", matrix=EYE * 1e19), "matrix of light 'key'"),
        (lambda: Area("key", matrix=EYE, size=(1, -1)), "size of light 'key'"),
        (lambda: Area("key", matrix=EYE, size=(1, 2, 3)), "size of light 'key'"),
        (lambda: Area("key", matrix=EYE, spread=0), "spread of light 'key'"),
        (lambda: Area("key", matrix=EYE, spread=3.2), "spread of light 'key'"),
        (lambda: World((1, 2)), "radiance of the world"),
        (lambda: World((1, 2, 3), hidden_from={"eye"}), "the world"),
        (lambda: World(backdrop=World(hidden_from={"camera"})), "backdrop of the world"),
    ],
)
def test_a_lamp_that_cannot_be_is_refused_by_name(make, named):
    with pytest.raises(InputError, match=named) as refused:
        make()
    assert "\n" not in str(refused.value)


def test_half_a_turn_in_float32_is_half_a_turn():
    half = float(np.float32(np.pi))
    assert half > np.pi and Sun("sun", angle=half).angle == np.pi == Spot("spot", matrix=EYE, angle=half).angle


def test_the_direction_to_a_sun_is_of_unit_length_at_any_scale():
    for scale in (1e-300, 1.0, 1e300):
        assert np.linalg.norm(Sun("sun", towards=(scale, -2 * scale, 2 * scale)).towards) == pytest.approx(1, rel=1e-15)


def test_the_area_of_a_lamp_is_that_in_the_world():
    matrix = np.diag([2.0, -3.0, 5.0, 1.0])
    assert Area("area", matrix=matrix, size=(1, 0.5)).area == pytest.approx(3)
    assert Area("area", matrix=matrix, size=(1, 0.5), ellipse=True).area == pytest.approx(3 * np.pi / 4)
    sheared = EYE.copy()
    sheared[0, 1] = 7
    assert Area("area", matrix=sheared).area == pytest.approx(1)


@pytest.mark.parametrize(
    ("lamp", "dark"),
    [
        (Sun("lamp", irradiance=(0, 0, 0)), True),
        (Sun("lamp", irradiance=(0, 0, 1e-30)), False),
        (Point("lamp", power=(0, 0, 0)), True),
        (Point("lamp"), False),
        (Spot("lamp", matrix=np.diag([1.0, 1, 0, 1])), True),
        (Spot("lamp", matrix=EYE), False),
        (Area("lamp", matrix=EYE, size=(0, 1)), True),
        (Area("lamp", matrix=np.diag([0.0, 1, 1, 1])), True),
        (Area("lamp", matrix=np.diag([1.0, 1, 0, 1])), True),
        (Area("lamp", matrix=EYE), False),
    ],
)
def test_what_has_no_power_no_area_or_no_direction_is_dark(lamp, dark):
    assert lamp.is_dark == dark


def test_every_kind_of_ray_may_be_hidden_from():
    assert Sun("sun", hidden_from=RAYS).hidden_from == World(hidden_from=RAYS).hidden_from == frozenset(RAYS)
