"""Light on surfaces in one place is taken out of the comparison, and what it lights; the rest is compared as before."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import radiance
from viewcam_addon.comparison.coincident import SAMPLES, CoincidentLight
from viewcam_addon.comparison.tolerances import ROUNDINGS
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Sun
from viewcam_addon.tracer.scene.materials import Material
from viewcam_addon.tracer.scene.shader_nodes import node

pytestmark = pytest.mark.slow

CAMERA = Pinhole((0.5, -6.0, 3.0), (0.0, 0.0, 0.4), (0.0, 0.0, 1.0), 70.0, 64, 48)
SAMPLES_OF_A_PICTURE = 64
COLORS = {"Floor": (0.6, 0.6, 0.6), "Carpet": (0.8, 0.2, 0.1), "Wall": (0.3, 0.5, 0.7), "Side": (0.5, 0.5, 0.5)}


def quad(*corners):
    return Mesh(np.array(corners, float), np.array([(0, 1, 2), (0, 2, 3)], np.int32), np.zeros(2, np.int32))


def a_scene(lift=0.0, only=None, colors=COLORS, energy=2.0):
    """A floor with a carpet in its plane, a wall beside that, in a plane of its own, and another far off."""
    slope = 0.07
    floor = quad((-3, -3, -3 * slope), (3, -3, 3 * slope), (3, 3, 3 * slope), (-3, 3, -3 * slope))
    carpet = quad(*((x, y, slope * x + lift) for x, y in ((-2, -2), (-0.5, -2), (-0.5, 1.5), (-2, 1.5))))
    wall = quad((-3, 3, -1), (3, 3, -1), (3, 3, 3), (-3, 3, 3))
    side = quad((3, -3, -1), (3, 3, -1), (3, 3, 3), (3, -3, 3))
    geometries = {"Floor": floor, "Carpet": carpet, "Wall": wall, "Side": side}
    kept_names = [name for name in geometries if name != only]
    return Scene(
        CAMERA,
        geometries,
        tuple(Object(name, name, np.eye(4), i, materials=(name,)) for i, name in enumerate(kept_names, start=1)),
        materials={name: Material(surface=node("diffuse", color=color)) for name, color in colors.items()},
        lamps=(Sun("sun", towards=(0.2, -0.6, 1.0), irradiance=(energy,) * 3, angle=0.3),),
        film=Film("BOX"),
        bounces=Bounces(total=3, diffuse=3),
    )


def pictures(scene, seeds=(1, 2, 3, 4)):
    tracer = Tracer(scene, 2)
    attributes = {"samples": str(SAMPLES_OF_A_PICTURE)}
    return [Image(tracer.render_light("path", SAMPLES_OF_A_PICTURE, seed), CAMERA, attributes) for seed in seeds]


@pytest.fixture(scope="module")
def tracer():
    return Tracer(a_scene(), 2)


@pytest.fixture(scope="module")
def coincident(tracer):
    light, pairs, _ = tracer.coincident_light("path", SAMPLES, 0, ROUNDINGS[-1])
    return CoincidentLight(Image(light), tracer.render_light("path", SAMPLES, 1)["Combined"][..., :3], pairs)


@pytest.fixture(scope="module")
def reference(tracer):
    light = tracer.render_light("path", 4 * SAMPLES_OF_A_PICTURE, 0)
    return Image(light, CAMERA, {"samples": str(4 * SAMPLES_OF_A_PICTURE), "level": "path"})


def as_cycles(seed, **scene):
    """Pictures as Cycles makes them: rounding gives each pixel the floor's light, the carpet's, or none by the two."""
    random = np.random.default_rng(seed)
    without_carpet, without_floor = (pictures(a_scene(only=name, **scene)) for name in ("Carpet", "Floor"))
    rendered = Tracer(a_scene(lift=1e-4), 1).render()["Object Index"][..., 0] == 2
    share = random.integers(0, 3, rendered.shape)
    images = []
    for bare, carpeted in zip(without_carpet, without_floor, strict=True):
        passes = {name: values.copy() for name, values in bare.passes.items()}
        for name, values in passes.items():
            values[rendered & (share == 1)] = carpeted[name][rendered & (share == 1)]
            if name != "Depth" and values.shape[2] < 4:
                values[rendered & (share == 2)] = 0.0
            elif name == "Combined":
                values[rendered & (share == 2), :3] = 0.0
        images.append(replace(bare, passes=passes))
    return images


@pytest.fixture(scope="module")
def honest():
    return as_cycles(1)


def test_pixels_that_show_surfaces_in_one_place_are_taken_out_and_the_rest_is_the_same(reference, honest, coincident):
    assert not radiance.compare(reference, honest, CAMERA).passed
    comparison = radiance.compare(reference, honest, CAMERA, make_coincident=lambda: coincident)
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.taken_out.pairs.keys() == {("Carpet", "Floor")}
    assert 0.05 < comparison.taken_out.pixels.mean() < 0.3
    assert f"the {comparison.taken_out.count:,} pixels that show surfaces in one place" in comparison.sentence
    assert comparison.to_json()["in_one_place"]["pairs"] == [{"objects": ["Carpet", "Floor"]}]


def test_nothing_is_taken_out_where_the_pictures_are_the_same(reference):
    def never():
        raise AssertionError("nobody has to ask")

    comparison = radiance.compare(reference, pictures(a_scene()), CAMERA, make_coincident=never)
    assert comparison.passed and not comparison.taken_out.pairs


def test_nothing_is_taken_out_where_no_two_surfaces_are_in_one_place(honest):
    tracer = Tracer(a_scene(lift=-1e-3), 2)
    light, pairs, _ = tracer.coincident_light("path", SAMPLES, 0, ROUNDINGS[-1])
    assert not pairs and not light["Combined"][..., :3].any()
    reference = Image(tracer.render_light("path", 256, 0), CAMERA, {"samples": "256"})
    nowhere = CoincidentLight(Image(light), reference["Combined"][..., :3], pairs)
    assert not radiance.compare(reference, honest, CAMERA, make_coincident=lambda: nowhere).passed


@pytest.fixture(scope="module")
def chosen_nearly_everywhere(reference, coincident):
    """Surfaces in one place, with all light of the columns from the third on a renderer's choice."""
    passes = {name: values.copy() for name, values in coincident.light.passes.items()}
    passes["Combined"][:, 2:, :3] = reference["Combined"][:, 2:, :3] + 1e-3
    return replace(coincident, light=Image(passes))


def test_where_nearly_all_is_taken_out_there_is_no_answer_and_the_rest_may_still_differ(
    reference, honest, chosen_nearly_everywhere
):
    comparison = radiance.compare(reference, honest, CAMERA, make_coincident=lambda: chosen_nearly_everywhere)
    assert comparison.is_empty and not comparison.passed
    assert comparison.sentence.startswith("Nothing to compare: 9"), comparison.sentence
    assert all(words in comparison.sentence for words in ("'Carpet' and 'Floor'", "move one of two", "level geometry"))
    dark = [replace(image, passes={**image.passes, "Combined": 0.5 * image["Combined"]}) for image in honest]
    comparison = radiance.compare(reference, dark, CAMERA, make_coincident=lambda: chosen_nearly_everywhere)
    assert not comparison.is_empty and comparison.sentence.startswith("Different here"), comparison.sentence


FAULTS = {
    "a lamp 2 % too bright": {"energy": 2.04},
    "another wall": {"colors": {**COLORS, "Wall": (0.3, 0.5, 0.74)}},
    "a floor that is 3 % darker": {"colors": {**COLORS, "Floor": (0.582, 0.582, 0.582)}},
}


@pytest.mark.parametrize("fault", FAULTS)
def test_sabotage_is_found_in_the_rest(reference, coincident, fault):
    comparison = radiance.compare(reference, as_cycles(1, **FAULTS[fault]), CAMERA, make_coincident=lambda: coincident)
    assert not comparison.passed and comparison.taken_out.count, "\n".join(comparison.lines())


def test_the_light_by_surfaces_in_one_place_is_what_all_of_them_scatter(coincident):
    """At the carpet's middle: its own light and the floor's, as if each were there alone."""
    alone = sum(pictures(a_scene(only=name), (5,))[0]["Combined"][..., :3].astype(float) for name in ("Carpet", "Floor"))
    rendered = Tracer(a_scene(lift=1e-4), 1).render()["Object Index"][..., 0] == 2
    ratio = coincident.light["Combined"][..., :3][rendered].mean(axis=0) / alone[rendered].mean(axis=0)
    # With both in one place they light the wall, and that them: a little more than either alone.
    assert ((ratio > 0.95) & (ratio < 1.15)).all(), ratio
    far = Tracer(a_scene(), 1).render()["Object Index"][..., 0] == 4
    share = coincident.light["Combined"][..., :3][far].mean() / alone[far].mean()
    assert 0.0 < share < 0.1, "the far wall is lit by them a little"
