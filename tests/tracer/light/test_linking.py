"""Lamps that light some objects only, and in whose light some objects only can stand: what each receives, on paper."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Keeper, render
from viewcam_addon.tracer.scene.lamps import MOST_LINKS, Point, Sun
from viewcam_addon.tracer.scene.materials import Color, sum_of

DOWN = Pinhole((0, 0, 4), (0, 0, 0), (0, 1, 0), 40, 32, 24)
OVERHEAD = Sun("sun", towards=(0, 0, 1), irradiance=(3, 2, 1))
LEFT, RIGHT, SCREEN = "object 0", "object 1", "object 2"
WHITE = sum_of(diffuse=Color((1.0, 1.0, 1.0)))
BLACK = sum_of(diffuse=Color((0.0, 0.0, 0.0)))


@pytest.fixture
def halves(make_mesh, make_lit):
    """halves(lamps, screen) → a scene of a white floor in two halves, with or without a black screen high over both."""

    def square(low, high, z):
        (x0, x1), (y0, y1) = (low[0], high[0]), (low[1], high[1])
        return make_mesh([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], [[0, 1, 2], [0, 2, 3]])

    def make(lamps, screen=False, **more):
        floor = [(square((-9, -9), (0, 9), 0), WHITE), (square((0, -9), (9, 9), 0), WHITE)]
        above = [(square((-99, -99), (99, 99), 5), BLACK)] if screen else []
        return make_lit(DOWN, *floor, *above, lamps=lamps, **more)

    return make


def seen(scene, samples=1):
    """The red light that the left half and the right half show."""
    passes = render(scene, "direct", samples, threads=1)
    red = passes["Combined"][..., 0].astype(np.float64)
    return red[:, :15].mean(), red[:, 17:].mean()


LIT = 3 / np.pi


@pytest.mark.parametrize("screen", [False, True])
def test_a_lamp_lights_its_receivers_only(halves, screen):
    lamp = replace(OVERHEAD, receivers={LEFT}, casts_shadow=not screen)
    assert seen(halves((lamp,), screen)) == pytest.approx((LIT, 0), rel=1e-6)


def test_a_lamp_without_receivers_lights_nothing(halves):
    assert seen(halves((replace(OVERHEAD, receivers=()),))) == (0, 0)


def test_only_blockers_stand_in_a_lamps_light(halves):
    assert seen(halves((OVERHEAD,), True)) == (0, 0)
    assert seen(halves((replace(OVERHEAD, blockers={SCREEN, LEFT}),), True)) == (0, 0)
    assert seen(halves((replace(OVERHEAD, blockers={LEFT}),), True)) == pytest.approx((LIT, LIT), rel=1e-6)


def test_of_two_lamps_each_has_links_of_its_own(halves):
    lamps = (
        replace(OVERHEAD, receivers={LEFT}, blockers=()),
        replace(OVERHEAD, name="other", receivers={RIGHT}, irradiance=(6, 2, 1)),
    )
    assert seen(halves(lamps), 16) == pytest.approx((LIT, 2 * LIT), rel=1e-6)
    assert seen(halves(lamps, True), 16) == pytest.approx((LIT, 0), rel=1e-6)


def test_a_lamp_without_links_lights_all_beside_one_that_has_some(halves):
    lamps = replace(OVERHEAD, receivers={LEFT}), replace(OVERHEAD, name="other")
    assert seen(halves(lamps), 16) == pytest.approx((2 * LIT, LIT), rel=1e-6)


@pytest.mark.parametrize("count", [2, 5, 40])
def test_of_many_lamps_each_half_gets_those_that_light_it(halves, count):
    """However many are asked at a point: each by itself, one by its part, one in a tree."""
    lamps = tuple(
        Point(str(i), position=(0, 0, 3 + i / 100), power=(9, 9, 9), receivers={LEFT} if i % 2 else {RIGHT})
        for i in range(count)
    )
    every = tuple(replace(lamp, receivers=None) for lamp in lamps)
    left, right = seen(halves(lamps), 256)
    wanted = [seen(halves(tuple(lamp for lamp in every if int(lamp.name) % 2 == odd)), 256)[0] for odd in (1, 0)]
    assert (left, right) == pytest.approx(tuple(wanted), rel=0.02)


def test_the_eye_sees_a_lamp_and_a_mirror_that_it_does_not_light_shows_none(make_mesh, make_lit):
    """A ball of light behind the eye, in a mirror below it."""
    mirror = make_mesh([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2], [0, 2, 3]])
    lamp = Point("lamp", position=(0, 0, 8), power=(9, 9, 9), radius=2.0)
    chrome = sum_of(mirror=Color((1.0, 1.0, 1.0)))

    def most(camera, lamp):
        scene = make_lit(camera, (mirror, chrome), lamps=(lamp,))
        return render(scene, "path", 4, threads=1)["Combined"][..., 0].max()

    up = Pinhole((0, 0, 4), (0, 0, 8), (0, 1, 0), 40, 32, 24)
    radiance = 9 / (np.pi * 4 * np.pi * 4)
    assert most(DOWN, lamp) == pytest.approx(radiance, rel=1e-6) and most(DOWN, replace(lamp, receivers=())) == 0
    assert most(up, replace(lamp, receivers=())) == pytest.approx(radiance, rel=1e-6)


def test_a_hidden_object_casts_no_shadow_as_a_blocker_either(halves):
    scene = halves((replace(OVERHEAD, blockers={SCREEN}),), True)
    objects = (*scene.objects[:2], replace(scene.objects[2], hidden_from=frozenset({"shadow"})))
    assert seen(replace(scene, objects=objects)) == pytest.approx((LIT, LIT), rel=1e-6)


def test_links_that_name_everything_change_no_bit(halves):
    plain, linked = (
        render(halves((lamp,), True), "path", 4, threads=1)
        for lamp in (OVERHEAD, replace(OVERHEAD, receivers={LEFT, RIGHT, SCREEN}, blockers={LEFT, RIGHT, SCREEN}))
    )
    assert all(np.array_equal(plain[name], linked[name]) for name in plain)


def test_a_kept_scene_is_made_anew_where_links_differ(halves):
    keeper = Keeper()
    for lamp, expected in ((OVERHEAD, 0.0), (replace(OVERHEAD, blockers=()), LIT), (OVERHEAD, 0.0)):
        passes = render(halves((lamp,), True), "direct", 1, threads=1, keeper=keeper)
        assert passes["Combined"][..., 0].mean() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("what", ["receivers", "blockers"])
def test_links_to_what_is_not_there_and_too_many_of_them_are_refused(halves, what):
    with pytest.raises(InputError, match=f"{what} of light 'sun' names the object 'absent'"):
        halves((replace(OVERHEAD, **{what: {LEFT, "absent"}}),))
    names = [f"object {number}" for number in range(8)]
    scene = halves((OVERHEAD,))
    objects = tuple(replace(scene.objects[0], name=name) for name in names)
    sets = [frozenset(name for bit, name in enumerate(names) if number >> bit & 1) for number in range(MOST_LINKS[what] + 1)]
    lamps = tuple(replace(OVERHEAD, **{what: linked_names}) for linked_names in sets)
    replace(scene, objects=objects, lamps=lamps[:-1])
    with pytest.raises(InputError, match=f"different sets of {what}"):
        replace(scene, objects=objects, lamps=lamps)
