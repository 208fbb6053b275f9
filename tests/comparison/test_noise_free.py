"""Light without noise: a float32 renderer's roundings pass, and what is more than that does not."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.radiance import compare
from viewcam_addon.image import Image

pytestmark = pytest.mark.slow

SUN = np.array([0.4, -0.5, 0.75]) / np.linalg.norm([0.4, -0.5, 0.75])
LIGHT = ("Combined", "Diffuse Direct", "Diffuse Color")
COLORS = np.array([(0.0, 0.0, 0.0), (0.6, 0.6, 0.5), (0.8, 0.3, 0.2), (0.2, 0.6, 0.7), (0.5, 0.4, 0.8)])


def light(scene, px=0.5, py=0.5, albedo=1.0):
    """The scene on paper under a sun, with shadows; pass name → (height, width, channels)."""
    passes = scene.picture(px, py).passes
    height, width = scene.pinhole.height, scene.pinhole.width
    position, normal, index = (passes[name].astype(np.float64) for name in ("Position", "Normal", "Object Index"))
    cosine = np.maximum(normal @ SUN, 0.0)
    for *center, radius in scene.spheres:
        to_center = np.array(center) + scene.offset - position
        along = to_center @ SUN
        cosine[(along > 1e-6) & ((to_center**2).sum(axis=-1) - along**2 < radius**2 * (1 - 1e-9))] = 0.0
    color = albedo * COLORS[index[..., 0].astype(int)]
    direct = 3.0 / np.pi * cosine[..., None] * (index > 0)
    combined = np.concatenate([color * direct, np.ones((height, width, 1))], axis=-1)
    channels = {"Combined": combined, "Diffuse Direct": direct * np.ones(3), "Diffuse Color": color}
    return {name: values.astype(np.float32) for name, values in channels.items()} | {
        name: passes[name] for name in ("Depth", "Object Index")
    }


def picture(scene, **more):
    return Image(light(scene, **more), scene.pinhole, {"samples": "1"}, "light.exr")


def rendered(scene, roundings=0.35, seed=0):
    """A float32 renderer's: every ray is off by the roundings of tolerances.py, and every value by some of its own."""
    rng = np.random.default_rng(seed)
    exact = scene.picture()
    shift = tolerances.ray_shift(scene.pinhole, exact.passes)
    shift[exact["Object Index"][..., 0] == 0] = np.median(shift)
    dx, dy = roundings * shift * rng.normal(size=(2, *shift.shape))
    passes = light(scene, px=0.5 + dx, py=0.5 + dy)
    for name in ("Combined", "Diffuse Direct"):
        color = passes[name][..., :3]
        color *= (1 + 2.0**-24 * rng.normal(0, 3, color.shape)).astype(np.float32)
    return Image(passes, scene.pinhole, {"cycles.ViewLayer.samples": "1"}, "rendered.exr")


def test_a_float32_renderers_picture_is_the_same(paper_scene):
    comparison = compare(picture(paper_scene), [rendered(paper_scene)], paper_scene.pinhole)
    assert comparison.passed, "\n".join(comparison.lines())
    assert not comparison.is_noisy
    assert comparison.sentence.startswith("The same picture: over 64,000 pixels without noise ")


def test_far_from_the_origin_pixels_on_edges_turn_and_are_within_their_number(far_scene):
    """Five kilometers away rays are off by a hundredth of a pixel: some pixels on edges show the other side."""
    row = compare(picture(far_scene), [rendered(far_scene, roundings=1.0)], far_scene.pinhole).rows[0]
    assert 0 < row.edges.count <= row.edges.allowed and row.edges.ok


def combined(image, change):
    values = image["Combined"].copy()
    change(values)
    return replace(image, passes={**image.passes, "Combined": values})


def brighter(factor):
    def change(values):
        values[..., :3] *= np.float32(factor)

    return change


def no_number(values):
    values[100, 160, 1] = np.nan


FAULTS = {
    "a hundred-thousandth too bright": lambda s: combined(rendered(s), brighter(1 + 1e-5)),
    "albedo off by a hundredth": lambda s: picture(s, albedo=1.01),
    "a shift of a hundredth of a pixel": lambda s: picture(s, px=0.51),
    "a shift of half a pixel": lambda s: picture(s, py=1.0),
    "no shadows of the smallest ball": lambda s: Image(
        {**light(replace(s, spheres=s.spheres[:2])), "Depth": light(s)["Depth"]}, s.pinhole, {"samples": "1"}
    ),
    "one pixel that is no number": lambda s: combined(rendered(s), no_number),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_without_noise_is_found(paper_scene, fault):
    comparison = compare(picture(paper_scene), [FAULTS[fault](paper_scene)], paper_scene.pinhole)
    assert not comparison.passed, f"{fault}: {comparison.sentence}"
    assert comparison.sentence.startswith("Different here: "), comparison.sentence


def test_a_factor_that_explains_all_is_told_and_named(paper_scene):
    reference = picture(paper_scene)
    sentence = compare(reference, [combined(rendered(paper_scene), brighter(np.pi))], paper_scene.pinhole).sentence
    assert "a factor of 3.1416, which is π" in sentence
    sentence = compare(reference, [combined(rendered(paper_scene), brighter(1.25))], paper_scene.pinhole).sentence
    assert "a factor of 1.25)" in sentence
    assert "factor" not in compare(reference, [picture(paper_scene, px=0.6)], paper_scene.pinhole).sentence


def test_a_pixel_or_two_that_leak_are_let_pass_and_no_more(paper_scene):
    """One in a million may: more than one in 64,000 happens by chance once in 500 pictures, more than two once in 20,000."""

    def leaking(count):
        def change(values):
            values[2, 10 : 10 + 3 * count : 3, :3] = 0.5

        return compare(picture(paper_scene), [combined(rendered(paper_scene), change)], paper_scene.pinhole)

    assert leaking(2).rows[0].edges.leaks == 2 == leaking(2).rows[0].edges.allowed_leaks
    assert leaking(2).passed and not leaking(3).passed


def test_the_tolerance_grows_with_value_lamp_and_samples():
    base = tolerances.radiance_error(1.0, 1.0, 1)
    assert base == 2.0**-24 * (
        tolerances.RADIANCE_ROUNDINGS + 1 / tolerances.SAMPLES_PER_ROUNDING + tolerances.COSINE_ROUNDINGS
    )
    for more in ((2.0, 1.0, 1), (1.0, 9.0, 1), (1.0, 1.0, 1024)):
        assert tolerances.radiance_error(*more) > base


def test_short_normals_are_allowed_to_the_blender_that_has_them_and_to_no_other(paper_scene):
    """The ground's cosine is 0.76: a normal that is 6.4e-5 off changes its light by 6.4e-5 · 0.65 / 0.76 = 5.5e-5."""
    reference = picture(paper_scene)
    ground = reference["Object Index"][..., 0] == 1

    def off(software):
        def change(values):
            values[ground, :3] *= np.float32(1 + 4e-5)

        image = combined(rendered(paper_scene), change)
        return compare(reference, [replace(image, attributes={"Software": software})], paper_scene.pinhole)

    assert off("Blender 5.2.3 LTS").passed and off("Blender 6.0.0").passed
    assert not off("Blender 5.0.1").passed and not off("").passed


def test_the_tolerance_s_shares_are_of_the_floor_too(paper_scene):
    image = combined(rendered(paper_scene), brighter(1 + 1e-3))
    image = replace(image, attributes={"Software": "Blender 5.2.3 LTS"})
    assert not compare(picture(paper_scene), [image], paper_scene.pinhole).passed


def test_a_light_without_a_diffuse_pass_is_compared_without_a_warning(paper_scene, recwarn):
    image = replace(rendered(paper_scene), attributes={"Software": "Blender 5.2.3 LTS"})
    bare = [
        replace(picture_, passes={name: picture_[name] for name in ("Combined", "Depth")})
        for picture_ in (picture(paper_scene), image)
    ]
    radiance = compare(bare[0], [bare[1]], paper_scene.pinhole)
    assert [row.name for row in radiance.rows] == ["Combined"] and not list(recwarn)


@pytest.mark.parametrize(
    ("factor", "tabulated", "passed"), [(1.00008, True, True), (1.00008, False, False), (1.0003, True, False)]
)
def test_albedos_from_tables_differ_by_a_ten_thousandth_and_by_no_more(paper_scene, factor, tabulated, passed):
    reference, test = picture(paper_scene), rendered(paper_scene)
    if tabulated:
        reference = replace(reference, attributes={**reference.attributes, "albedo tables": "yes"})
    test = replace(test, passes={**test.passes, "Diffuse Color": test["Diffuse Color"] * np.float32(factor)})
    assert compare(reference, [test], paper_scene.pinhole).passed == passed


@pytest.mark.parametrize(
    ("name", "factor", "passed"),
    [("Diffuse Direct", 0.9995, True), ("Diffuse Direct", 0.997, False), ("Diffuse Color", 0.9995, False)],
)
def test_surfaces_that_shine_may_lose_a_thousandth_of_their_light_and_no_color(paper_scene, name, factor, passed):
    reference, test = picture(paper_scene), rendered(paper_scene)
    test = replace(test, passes={**test.passes, name: test[name] * np.float32(factor)})
    assert not compare(reference, [test], paper_scene.pinhole).passed, "without such a surface"
    reference = replace(reference, attributes={**reference.attributes, "shining surfaces": "yes"})
    assert compare(reference, [test], paper_scene.pinhole).passed == passed


def test_light_in_half_floats_is_the_same_and_a_thousandth_brighter_is_not(paper_scene):
    """Blender writes light of a multilayer EXR so unless it is asked for 32 bits; it was called different."""

    def stored(brighter=1.0):
        passes = rendered(paper_scene).passes
        halves = {name: (brighter * passes[name]).astype(np.float16).astype(np.float32) for name in LIGHT}
        return Image(passes | halves, paper_scene.pinhole, {"cycles.ViewLayer.samples": "1"}, "half.exr", frozenset(LIGHT))

    comparison = compare(picture(paper_scene), [stored()], paper_scene.pinhole)
    assert comparison.passed, "\n".join(comparison.lines())
    assert not compare(picture(paper_scene), [stored(1.003)], paper_scene.pinhole).passed
    lossy = compare(picture(paper_scene), [replace(stored(1.003), lossy="DWAA")], paper_scene.pinhole)
    assert "the test picture is compressed with loss (DWAA): write it with ZIP; " in lossy.sentence, lossy.sentence


@pytest.mark.parametrize(
    ("turn", "words"),
    [(np.s_[::-1], "upside down"), (np.s_[:, ::-1], "mirrored left"), (np.s_[::-1, ::-1], "turned by half a turn")],
)
def test_light_of_a_picture_that_is_turned_over_is_told(turn, words, paper_scene):
    test = rendered(paper_scene)
    turned = replace(test, passes={name: values[turn] for name, values in test.passes.items()})
    comparison = compare(picture(paper_scene), [turned], paper_scene.pinhole)
    assert f"Different here: the picture looks {words}" in comparison.sentence, comparison.sentence
