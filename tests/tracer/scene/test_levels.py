"""The least level: no more than a scene needs, and a sentence that names why."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Area, Point, Sun, World
from viewcam_addon.tracer.scene.levels import least_level
from viewcam_addon.tracer.scene.materials import Colour, Material

WHITE, BLACK = Colour((1.0, 1.0, 1.0)), Colour((0.0, 0.0, 0.0))
SUN = Sun("Sun", irradiance=(1.0, 1.0, 1.0))


@pytest.fixture
def scene(make_scene, make_mesh):
    """scene(material, field=value, …) → a Scene of one triangle of this material, "object 1"."""

    def build(material=None, **changes):
        made = make_scene(Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 4, 4), make_mesh(np.eye(3), [[0, 1, 2]]))
        if material:
            placed = replace(made.objects[0], materials=("M",))
            made = replace(made, objects=(placed,), materials={"M": material})
        return replace(made, **changes)

    return build


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"lamps": (replace(SUN, irradiance=(0.0, 0.0, 0.0)), Point("Off", power=(0.0, 0.0, 0.0)))},
        {"world": World(hidden_from={"camera"})},
        {"material": Material(emission=BLACK)},
    ],
)
def test_without_light_there_is_only_geometry(scene, changes):
    level, reason = least_level(scene(**changes))
    assert level == "geometry" and "Nothing gives light" in reason


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lamps": (SUN,)}, "the lamp 'Sun'"),
        ({"lamps": (Area("Panel", matrix=np.eye(4)),)}, "the lamp 'Panel'"),
        ({"material": Material(emission=WHITE, diffuse=WHITE)}, "the surface of 'object 1'"),
        ({"world": World((0.0, 0.5, 0.0))}, "the world"),
        ({"world": World(backdrop=World((0.0, 0.5, 0.0)))}, "the world"),
    ],
)
def test_light_on_a_surface_that_reflects_needs_paths(scene, changes, words):
    level, reason = least_level(scene(**changes))
    assert level == "path" and words in reason and "'object 1' reflects" in reason


@pytest.mark.parametrize(
    ("material", "words"),
    [(Material(mirror=WHITE), "mirrors"), (Material(glass=WHITE), "is clear"), (Material(refraction=WHITE), "is clear")],
)
def test_mirrors_and_glass_need_paths(scene, material, words):
    level, reason = least_level(scene(material, lamps=(SUN,)))
    assert level == "path" and f"'object 1' {words}" in reason


@pytest.mark.parametrize(
    ("material", "bounces", "words"),
    [
        (None, Bounces().none, "allows no bounces"),
        (Material(emission=WHITE), Bounces(), "nothing reflects"),
        (Material(diffuse=BLACK), Bounces(), "nothing reflects"),
        (Material(diffuse=WHITE), Bounces(diffuse=0), "of the kinds"),
        (Material(mirror=WHITE), Bounces(glossy=0), "of the kinds"),
        (Material(glass=WHITE), Bounces(transmission=0, glossy=0), "of the kinds"),
    ],
)
def test_without_bounces_light_is_direct(scene, material, bounces, words):
    level, reason = least_level(scene(material, lamps=(SUN,), bounces=bounces))
    assert level == "direct" and words in reason


def test_glass_that_only_reflects_needs_paths(scene):
    assert least_level(scene(Material(glass=WHITE), lamps=(SUN,), bounces=Bounces(transmission=0)))[0] == "path"


def test_materials_that_nothing_shows_do_not_count(scene):
    made = scene(Material(emission=WHITE))
    unused = replace(made, materials=made.materials | {"Mirror": Material(mirror=WHITE)})
    assert least_level(unused)[0] == "direct"
