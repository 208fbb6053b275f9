"""Light and shadow linking of lamps and of surfaces that shine: what objects receive, and what stands before it, on paper."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Keeper, render
from viewcam_addon.tracer.scene import Scene
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import MOST_LINKS, Area, Point, Sun
from viewcam_addon.tracer.scene.materials import Color, Material, sum_of
from viewcam_addon.tracer.scene.shader_nodes import Node

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


UP = Pinhole((0, 0, 4), (0, 0, 8), (0, 1, 0), 40, 32, 24)
LIGHT, BLOCKER = "object 2", "object 3"
CHROME = sum_of(mirror=Color((1.0, 1.0, 1.0)))
SATIN = Material(surface=Node("glossy", (("color", Color((1.0, 1.0, 1.0))), ("roughness", 0.5))))
PANE = Material(surface=Node("transparent", (("color", Color((0.5, 0.5, 0.5))),)))
ROUNDING = 2e-7  # float32, in which pictures are; the sums of float64 differ by their order alone


def glow(strength):
    return sum_of(emission=Color((strength,) * 3))


@pytest.fixture
def square(make_mesh):
    def make(x0, x1, y0, y1, z):
        return make_mesh([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]], [[0, 1, 2], [0, 2, 3]])

    return make


@pytest.fixture
def shone_halves(square, make_lit):
    """shone_halves(floor, light, screen) → a floor in two halves, a shape that shines behind the eye, and what is between."""

    def make(floor=CHROME, light=None, screen=None, camera=DOWN, lit=3.0, **more):
        bodies = [(square(-9, 0, -9, 9, 0), floor), (square(0, 9, -9, 9, 0), floor)]
        bodies.append((square(-20, 20, -20, 20, 8) if light is None else light, glow(lit)))
        return make_lit(camera, *bodies, *([(square(-99, 99, -99, 99, 5), screen)] if screen else ()), **more)

    return make


def linked(scene: Scene, name=LIGHT, **links) -> Scene:
    return replace(
        scene, objects=tuple(replace(placed, **links) if placed.name == name else placed for placed in scene.objects)
    )


def red(scene, samples=4, level="path"):
    return render(scene, level, samples, threads=1)["Combined"][..., 0].astype(np.float64)


def light_of_halves(scene, samples=4):
    """The light that the left half and the right half show."""
    picture = red(scene, samples)
    return picture[:, :15].mean(), picture[:, 17:].mean()


def same(first, second, samples=16, level="path"):
    """True if two scenes' pictures are the same but for float32's rounding."""
    return np.allclose(red(first, samples, level), red(second, samples, level), rtol=ROUNDING, atol=0)


@pytest.fixture(params=["mesh", "spheres"])
def light(request, square, make_spheres):
    """A light that covers all that a mirror below shows."""
    return square(-20, 20, -20, 20, 8) if request.param == "mesh" else make_spheres([[0, 0, 60]], 45)


def test_a_mirror_shows_what_shines_on_it_alone(shone_halves, light):
    assert light_of_halves(shone_halves(light=light)) == (3, 3)
    assert light_of_halves(linked(shone_halves(light=light), receivers={LEFT})) == (3, 0)
    assert light_of_halves(linked(shone_halves(light=light), receivers={RIGHT}, blockers=())) == (0, 3)
    assert light_of_halves(linked(shone_halves(light=light), receivers=())) == (0, 0)


def test_in_a_mirror_only_blockers_stand_before_what_shines(shone_halves, light):
    scene = shone_halves(light=light, screen=BLACK)
    assert light_of_halves(scene) == (0, 0)
    assert light_of_halves(linked(scene, blockers={BLOCKER})) == (0, 0)
    assert light_of_halves(linked(scene, blockers={LEFT})) == (3, 3)
    assert light_of_halves(linked(scene, blockers=(), receivers={LEFT})) == (3, 0)


def test_of_all_that_a_mirror_shows_each_counts_that_nothing_stands_before(shone_halves, square):
    """A screen that shines itself, and is a blocker of what is behind it, or is none."""
    scene = shone_halves(screen=glow(7.0))
    assert light_of_halves(scene) == (7, 7)
    assert light_of_halves(linked(scene, blockers=())) == (10, 10)
    assert light_of_halves(linked(linked(scene, blockers=()), BLOCKER, blockers=())) == (10, 10)
    assert light_of_halves(linked(linked(scene, blockers={BLOCKER}), BLOCKER, blockers={LIGHT})) == (7, 7)
    assert light_of_halves(linked(linked(scene, blockers=()), BLOCKER, receivers={LEFT})) == (10, 3)


def test_the_eye_sees_what_shines_whatever_it_lights_and_through_a_pane(shone_halves):
    for screen, expected in ((None, 3), (PANE, 1.5), (BLACK, 0)):
        scene = shone_halves(camera=UP, screen=screen)
        assert light_of_halves(linked(scene, receivers=(), blockers=())) == pytest.approx((expected,) * 2, rel=ROUNDING)


def test_what_is_hidden_from_a_ray_stays_so(shone_halves):
    scene = linked(shone_halves(), blockers={LEFT})
    assert light_of_halves(linked(scene, hidden_from=frozenset({"glossy"}))) == (0, 0)
    hidden = linked(shone_halves(screen=BLACK), BLOCKER, hidden_from=frozenset({"shadow"}))
    assert light_of_halves(linked(hidden, blockers={BLOCKER})) == (3, 3)


FAR, SIDE = 50.0, 0.02


def test_a_matte_floor_receives_what_shines_on_it(shone_halves, square):
    """A square so small that it is a point: L A cos² / d². It is asked for as a whole, and no scattered ray finds it."""
    half, (height, width) = SIDE / 2, (24, 32)
    scene = shone_halves(WHITE, square(-half, half, -half, half, FAR), lit=1e6, screen=BLACK)
    rows, columns = np.mgrid[:height, :width]
    squared = ((columns - 15.5) / 10) ** 2 + ((rows - 11.5) / 10) ** 2 + FAR**2
    expected = 1e6 * SIDE**2 / np.pi * FAR**2 / squared**2
    assert not red(scene).any()
    # Where the square's points are apart, so are their cosines to the fourth, by 4 r s / d²; the rest is a pixel's own size.
    tolerance = 4 * 2 * SIDE / FAR**2 + 4 * 0.1**2 / FAR**2
    for receivers, lit in (({LEFT}, (1, 0)), ({LEFT, RIGHT}, (1, 1)), ((), (0, 0))):
        actual = red(linked(scene, receivers=receivers, blockers={LEFT}))
        for half, factor in zip((np.s_[:, :15], np.s_[:, 17:]), lit, strict=True):
            assert np.allclose(actual[half], factor * expected[half], rtol=tolerance, atol=0)


@pytest.mark.parametrize("floor", [WHITE, SATIN, CHROME], ids=["matte", "rough", "mirror"])
@pytest.mark.parametrize("level", ["direct", "path"])
def test_light_that_both_ways_find_is_the_same_past_what_is_no_blocker(shone_halves, light, floor, level):
    """Samples of light and scattered rays are the same ones, and so is what they bring."""
    free = shone_halves(floor, light, bounces=Bounces(3, 3, 3, 3))
    behind = linked(shone_halves(floor, light, screen=BLACK, bounces=Bounces(3, 3, 3, 3)), blockers={LEFT, RIGHT, LIGHT})
    assert red(free, 16, level).min() > 0
    assert same(behind, free, level=level)
    assert not same(linked(behind, blockers={BLOCKER}), free, level=level)
    assert same(linked(free, receivers={LEFT, RIGHT, LIGHT}, blockers={LEFT, RIGHT, LIGHT}), free, level=level)


@pytest.mark.parametrize("floor", [WHITE, SATIN, CHROME], ids=["matte", "rough", "mirror"])
def test_a_pane_dims_the_light_whose_blocker_it_is(shone_halves, floor):
    free, paned = shone_halves(floor), shone_halves(floor, screen=PANE)
    assert same(linked(paned, blockers=()), free)
    half = linked(paned, blockers={BLOCKER})
    assert np.allclose(red(half, 16), red(free, 16) / 2, rtol=2 * ROUNDING, atol=0)
    assert same(half, paned)


@pytest.mark.parametrize(
    "lamp",
    [
        Point("lamp", position=(0, 0, 9), power=(900, 900, 900), radius=2.0),
        Area(
            "lamp",
            matrix=np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 9], [0, 0, 0, 1]]),
            power=(900, 900, 900),
            size=(6, 6),
        ),
        Sun("lamp", towards=(0.2, 0, 1), angle=0.8),
    ],
    ids=["point", "area", "sun"],
)
@pytest.mark.parametrize("floor", [WHITE, SATIN, CHROME], ids=["matte", "rough", "mirror"])
def test_scattered_rays_find_a_lamp_of_some_size_past_what_is_no_blocker(shone_halves, square, lamp, floor):
    free, behind = (
        shone_halves(floor, square(90, 91, 90, 91, 8), screen, lit=0.0, lamps=(replace(lamp, blockers=blockers),))
        for screen, blockers in ((None, None), (BLACK, {LEFT}))
    )
    assert red(free, 16).any() and same(behind, free)
    assert not same(replace(behind, lamps=(replace(lamp, blockers={BLOCKER}),)), free)


@pytest.mark.parametrize("count", [2, 40])
def test_of_many_shining_surfaces_each_half_gets_those_that_light_it(square, make_lit, count):
    """However many there are: one is asked by its part, or in a tree."""
    floor = [(square(-9, 0, -9, 9, 0), WHITE), (square(0, 9, -9, 9, 0), WHITE)]
    panels = [square(-0.5 + i / count, 0.5 + i / count, -0.5, 0.5, 5 + i / 100) for i in range(count)]

    def lit(lights_of, receivers):
        scene = make_lit(DOWN, *floor, *[(panels[i], glow(3.0 + i % 3)) for i in lights_of])
        lights = (
            replace(light, receivers=receivers(i), blockers=()) for light, i in zip(scene.objects[2:], lights_of, strict=True)
        )
        return light_of_halves(replace(scene, objects=(*scene.objects[:2], *lights)), 256)

    left, right = lit(range(count), lambda i: {LEFT} if i % 2 else {RIGHT})
    wanted_left = lit([i for i in range(count) if i % 2], lambda _: None)[0]
    wanted_right = lit([i for i in range(count) if not i % 2], lambda _: None)[1]
    # 256 samples of 360 pixels have a noise of 0.2 %.
    assert (left, right) == pytest.approx((wanted_left, wanted_right), rel=0.02)


def test_links_of_what_does_not_shine_change_no_bit(shone_halves):
    plain = shone_halves(WHITE, screen=PANE)
    odd = linked(linked(plain, LEFT, receivers=(), blockers=()), BLOCKER, receivers={LEFT}, blockers={RIGHT})
    assert np.array_equal(red(plain), red(odd))


def test_a_kept_scene_is_made_anew_where_links_of_surfaces_differ(shone_halves):
    keeper, plain = Keeper(), shone_halves(screen=BLACK)
    scenes = (plain, 0), (linked(plain, blockers=()), 3), (linked(plain, blockers=(), receivers=()), 0), (plain, 0)
    for scene, expected in scenes:
        passes = render(scene, "direct", 1, threads=1, keeper=keeper)
        assert (passes["Combined"][..., 0] == expected).all()


@pytest.mark.parametrize("what", ["receivers", "blockers"])
def test_links_of_surfaces_to_what_is_not_there_and_too_many_are_refused(shone_halves, what):
    with pytest.raises(InputError, match=f"{what} of object {LIGHT!r} names the object 'absent'"):
        linked(shone_halves(), **{what: {LEFT, "absent"}})
    scene = shone_halves()
    names = [f"object {number}" for number in range(8)]
    sets = [frozenset(name for bit, name in enumerate(names) if number >> bit & 1) for number in range(MOST_LINKS[what] + 1)]
    floor = tuple(replace(scene.objects[0], name=name) for name in names)
    lights = tuple(
        replace(scene.objects[2], name=f"light {i}", **{what: linked_names}) for i, linked_names in enumerate(sets[:-1])
    )
    sun = Sun("sun", **{what: sets[-1]})
    replace(scene, objects=(*floor, *lights), lamps=(replace(sun, **{what: sets[0]}),))
    with pytest.raises(InputError, match=f"different sets of {what}"):
        replace(scene, objects=(*floor, *lights), lamps=(sun,))
