"""Pictures that hold whatever float32 can: a verdict in finite figures, and no warning of NumPy's."""

import json
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon import checks
from viewcam_addon.comparison import difference, radiance, report
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.errors import InputError
from viewcam_addon.image import BACKGROUND_DEPTH, Image
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def no_warnings_but_what_underflows(no_warnings):
    """NumPy itself warns of no underflow."""
    with np.errstate(under="ignore"):
        yield


# The last one is a NaN that raises "invalid" wherever it is copied into another type.
HOSTILE = (np.nan, np.inf, -np.inf, 1e30, 3.4e38, -3.4e38, 1e-45, np.array(0x7F800001, np.uint32).view(np.float32))
GEOMETRY = ("Depth", "Position", "Normal", "UV", "Object Index", "Material Index")
LIGHT = ("Combined", "Diffuse Direct", "Diffuse Color", "Emission")
PINHOLE = Pinhole((5, -7, 4), (0.2, 0.1, 0.6), (0, 0, 1), 30.0, 32, 24)


def harmed(image, name, value, rows=slice(10, 20), columns=slice(12, 24)):
    values = image[name].copy()
    values.view(np.uint32)[rows, columns] = np.float32(value).view(np.uint32)
    return replace(image, passes=image.passes | {name: values})


def lit(seed, samples=64):
    rng = np.random.default_rng(seed)
    light = {name: rng.gamma(samples, 1 / samples, (24, 32, 1)) * np.array([0.3, 0.5, 0.4]) for name in LIGHT}
    light["Combined"] = np.concatenate([light["Combined"], np.ones((24, 32, 1))], axis=-1)
    light |= {"Variance": np.full((24, 32, 3), 0.16 / samples), "Depth": np.full((24, 32, 1), 8.0)}
    return Image({name: values.astype(np.float32) for name, values in light.items()}, PINHOLE, {"samples": str(samples)})


def assert_told(comparison, write_report, reference, test, folder):
    """Assert that the comparison can be printed and drawn, in finite figures."""
    text = json.dumps(checks.for_json(comparison.to_json()), allow_nan=False)
    assert comparison.sentence and all(comparison.lines()) and text
    write_report(comparison, reference, test, folder, (), "viewcam compare")
    difference.write(comparison, folder / "difference.png")
    for name, values in comparison.maps.items():
        assert not np.isinf(values).any(), f"{name} is infinite somewhere"


@pytest.mark.parametrize("value", HOSTILE, ids=map(str, range(len(HOSTILE))))
@pytest.mark.parametrize("name", GEOMETRY)
def test_geometry_that_holds_a_hostile_number_is_not_the_same(paper_scene, name, value, tmp_path):
    scene = paper_scene.seen_by(paper_scene.pinhole.resized(64, 40))
    reference, test = scene.picture(), scene.rendered()
    assert compare(reference, test, scene.pinhole).passed, "the pictures must be the same before one is harmed"
    seen = harmed(test, name, value)
    comparison = compare(reference, seen, scene.pinhole)
    assert not comparison.passed, comparison.lines()
    assert_told(comparison, report.write_geometry, reference, seen, tmp_path)
    if not np.isfinite(value) or name == "Position" or (name == "Depth" and value < BACKGROUND_DEPTH):
        words = "contradicts itself in" if np.isfinite(value) else f"no finite number in its pass '{name}'"
        with pytest.raises(InputError, match=f"{words}.*: trace it again"):
            compare(harmed(reference, name, value), test, scene.pinhole)
        return
    expected = harmed(reference, name, value)
    comparison = compare(expected, test, scene.pinhole)
    assert not comparison.passed, comparison.lines()
    assert_told(comparison, report.write_geometry, expected, test, tmp_path)


@pytest.mark.parametrize("value", HOSTILE, ids=map(str, range(len(HOSTILE))))
@pytest.mark.parametrize("name", [LIGHT[0], *(pytest.param(name, marks=pytest.mark.exhaustive) for name in LIGHT[1:])])
def test_light_that_holds_a_hostile_number_is_not_the_same(name, value, tmp_path):
    reference, tests = lit(0), [lit(1), lit(2)]
    assert radiance.compare(reference, tests, PINHOLE).passed
    for expected, seen in ((reference, [harmed(tests[0], name, value), tests[1]]), (harmed(reference, name, value), tests)):
        comparison = radiance.compare(expected, seen, PINHOLE)
        assert not comparison.passed, comparison.lines()
        assert_told(comparison, report.write_light, expected, seen, tmp_path)


@pytest.mark.parametrize("name", ["Magnitude", "Facing"])
def test_what_only_the_reference_tells_may_be_hostile_too(paper_scene, name, tmp_path):
    scene = paper_scene.seen_by(paper_scene.pinhole.resized(64, 40))
    for value in HOSTILE:
        reference, test = harmed(scene.picture(), name, value), scene.rendered()
        if not np.isfinite(value):
            with pytest.raises(InputError, match=f"no finite number in its pass '{name}'"):
                compare(reference, test, scene.pinhole)
            continue
        comparison = compare(reference, test, scene.pinhole)
        assert_told(comparison, report.write_geometry, reference, test, tmp_path)


def test_a_reference_that_its_scene_does_not_show_is_refused_before_its_rays_are_traced(paper_scene):
    """Rays for each of its pixels, as far as its figures say that they may be off, take minutes."""
    asked = 0

    def surfaces_at(*where):
        nonlocal asked
        asked += len(where[0])
        return paper_scene.surfaces_at(*where)

    other = replace(paper_scene, spheres=((0.0, 0.0, 4.0, 3.0),))
    with pytest.raises(InputError, match="is not what the tracer sees in the scene: trace it again"):
        compare(other.picture(), paper_scene.rendered(), paper_scene.pinhole, surfaces_at)
    assert asked < 3000


def test_a_test_picture_that_shows_something_else_is_no_fault_of_the_reference(paper_scene):
    test = harmed(paper_scene.rendered(), "Depth", 5.0, slice(None), slice(None))
    assert not compare(paper_scene.picture(), test, paper_scene.pinhole, paper_scene.surfaces_at).passed
