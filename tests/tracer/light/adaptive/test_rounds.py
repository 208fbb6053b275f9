"""Pictures of a wanted error: how close they come to it, what they take for it, and that no chance and no thread bends them."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon import image
from viewcam_addon.comparison import radiance
from viewcam_addon.errors import InputError
from viewcam_addon.tracer.light.adaptive import rounds
from viewcam_addon.tracer.render import Stopped, Tracer, render
from viewcam_addon.tracer.scene.film import Film
from viewcam_addon.tracer.scene.lamps import Point, Sun, World
from viewcam_addon.tracer.scene.materials import Colour, Material

FLOAT32 = 2.0**-24
TRUTH = 1024


def shown(passes):
    return passes["Combined"][..., :3].astype(float)


def counts(passes):
    return passes["Sample Count"][..., 0].astype(int)


def rmse(passes, truth):
    return np.sqrt(((shown(passes) - shown(truth)) ** 2).mean())


def errors(passes, truth):
    """(height, width)."""
    return np.sqrt(((shown(passes) - shown(truth)) ** 2).mean(axis=-1))


def test_a_pixel_of_so_many_samples_is_that_of_a_picture_of_so_many(sunny):
    adaptive = render(sunny(), "direct", 256, 3, error=0.02)
    taken = counts(adaptive)
    assert len(np.unique(taken)) > 3
    for number in np.unique(taken[taken > 1]):
        uniform, there = render(sunny(), "direct", int(number), 3), taken == number
        for name in set(uniform) - {"Variance"}:
            differ = (uniform[name][there] != adaptive[name][there]).any(axis=-1).sum()
            assert differ == 0, f"{name} of {differ} pixels of {number} samples"


@pytest.mark.parametrize("filter", ["BOX", "BLACKMAN_HARRIS"])
def test_a_pixel_of_one_sample_is_off_by_less_than_the_wanted_error(sunny, filter):
    scene = sunny(film=Film(filter))
    truth = render(scene, "direct", TRUTH)
    for wanted in (0.03, 0.01, 0.003):
        adaptive = render(scene, "direct", TRUTH, error=wanted)
        alone = counts(adaptive) == 1
        # What the truth itself is off by in a smooth pixel is 2e-4 of the slope, some 1e-5.
        assert alone.mean() > 0.3 and errors(adaptive, truth)[alone].max() <= wanted, f"{errors(adaptive, truth)[alone].max()}"
        told = np.sqrt(adaptive["Variance"][alone].astype(float).mean())
        assert told <= wanted / 4, f"{told:.1e}"


@pytest.mark.parametrize("lit", ["sunny", "soft"])
def test_smaller_errors_take_more_samples_and_are_smaller(request, lit):
    scene = request.getfixturevalue(lit)
    scene = scene if lit == "soft" else scene()
    truth = render(scene, "direct", TRUTH, 77)
    taken, off = [], []
    for wanted in (0.05, 0.02, 0.008):
        passes = render(scene, "direct", 512, error=wanted)
        taken.append(counts(passes).mean())
        off.append(rmse(passes, truth))
        assert off[-1] <= wanted, f"{off[-1]:.4f} where {wanted} is wanted"
    assert taken == sorted(taken) and taken[-1] > 2 * taken[0], taken
    assert off == sorted(off, reverse=True) and off[-1] < off[0] / 2, off


def test_a_wanted_error_takes_far_fewer_samples_than_a_picture_of_as_many_everywhere(sunny):
    truth = render(sunny(), "direct", TRUTH, 77)
    adaptive, uniform = render(sunny(), "direct", 512, error=0.02), render(sunny(), "direct", 16)
    assert rmse(adaptive, truth) < rmse(uniform, truth) and counts(adaptive).mean() < 16 / 2


@pytest.mark.parametrize("samples", [1, 2, 3, 8, 20])
def test_no_pixel_gets_more_samples_than_allowed(soft, samples):
    passes = render(soft, "direct", samples, error=1e-6)
    assert counts(passes).max() == samples and np.isfinite(shown(passes)).all()


def test_where_nothing_changes_one_sample_is_enough(make_lit, floor, sunny):
    scene = sunny()
    plain = make_lit(scene.camera, (floor(), None), lamps=scene.lamps)
    looking_down = replace(plain, camera=replace(scene.camera, eye=(0, 0.1, 9)))
    passes = render(looking_down, "direct", 64, error=1e-4)
    taken = counts(passes)
    assert (taken[1:-1, 1:-1] == 1).all() and (passes["Variance"][1:-1, 1:-1] < 1e-16).all()
    assert (taken == render(looking_down, "direct", 64, error=1e3)["Sample Count"][..., 0]).all()


def test_several_lamps_of_no_size_light_a_centre_without_chance(sunny):
    lamps = (Sun("sun", towards=(1, -1, 2)), Point("point", position=(2, -2, 3), power=(90, 60, 60)))
    both = render(sunny(lamps=lamps), "direct", 64, error=0.01)
    each = [render(sunny(lamps=(lamp,)), "direct", 64, error=0.01) for lamp in lamps]
    alone = np.logical_and.reduce([counts(passes) == 1 for passes in (both, *each)])
    assert alone.mean() > 0.3
    np.testing.assert_allclose(shown(both)[alone], sum(map(shown, each))[alone], rtol=4 * FLOAT32)


@pytest.mark.parametrize("lit", ["sunny", "soft"])
def test_threads_and_parts_change_no_bit(request, lit, monkeypatch):
    scene = request.getfixturevalue(lit)
    scene = scene if lit == "soft" else scene()
    reference = render(scene, "direct", 64, error=0.02, threads=1)
    monkeypatch.setattr(rounds, "_WRITTEN", 999)
    monkeypatch.setattr("viewcam_addon.tracer.light.illumination.PATHS", 5000)
    other = render(scene, "direct", 64, error=0.02, threads=3)
    assert reference.keys() == other.keys() == {*image.LIGHT_PASSES, "Depth", "Object Index", "Sample Count"}
    for name, values in reference.items():
        assert np.array_equal(values, other[name]), name


def test_bands_agree_with_the_whole(soft, monkeypatch):
    truth = render(soft, "direct", TRUTH, 77)
    monkeypatch.setattr(rounds, "_BAND", 8 * soft.camera.width)
    passes = render(soft, "direct", 256, error=0.02)
    assert rmse(passes, truth) <= 0.02


@pytest.mark.parametrize("error", [0.0, -0.1, float("nan"), float("inf")])
def test_an_error_that_is_none_is_told(soft, error):
    with pytest.raises(InputError, match="error"):
        render(soft, "direct", 4, error=error)


def test_without_a_wanted_error_there_is_no_count(soft):
    assert "Sample Count" not in render(soft, "direct", 2)


@pytest.mark.parametrize("level", ["direct", "path"])
def test_passes_add_up_where_light_is_shared(soft, level):
    passes = {name: values.astype(float) for name, values in render(soft, level, 32, error=0.02).items()}
    light = (passes["Diffuse Direct"] + passes["Diffuse Indirect"]) * passes["Diffuse Color"]
    total = passes["Emission"] + passes["Environment"] + light
    assert np.allclose(passes["Combined"][..., :3], total, rtol=16 * FLOAT32, atol=16 * FLOAT32 * total.max())


def test_a_see_through_film_has_its_outlines_in_alpha(sunny):
    """A sphere as bright as the world behind it: nothing but alpha tells them apart."""
    scene = sunny(film=Film(transparent=True))
    scene = replace(scene, objects=scene.objects[1:], lamps=())
    passes, truth = (render(scene, "direct", 256, 1, error=error) for error in (0.02, None))
    off = np.abs(passes["Combined"][..., 3] - truth["Combined"][..., 3])
    assert (passes["Combined"][..., 3] % 1 > 0).any() and off.max() < 0.1, f"{off.max():.3f}"


def test_mirrors_and_images_are_sampled(sunny):
    scene = sunny()
    mirror = {**scene.materials, "material 1": Material(mirror=Colour((0.9,) * 3))}
    passes = render(replace(scene, materials=mirror), "direct", 64, error=0.02)
    assert (counts(passes)[passes["Object Index"][..., 0] == 2] > 1).all()


def test_the_mean_over_seeds_is_right_though_pixels_decide_when_to_stop(soft):
    """A pixel that stops by its own mean would be too dark on average, where rare light makes it bright."""
    seeds, truth = 32, shown(render(soft, "direct", 4096, 999))
    tracer = Tracer(soft, 2)
    pictures = np.array([shown(tracer.render_light("direct", 256, seed, error=0.05)) for seed in range(seeds)])
    mean = (pictures - truth).mean(axis=(1, 2, 3))
    # A fiftieth of the error is what is left of that, and what windows of shared light take from the borders of shadows.
    assert abs(mean.mean()) < 4 * mean.std(ddof=1) / np.sqrt(seeds) + 0.05 / 50, f"{mean.mean():.1e}"
    # In tiles of 8 × 8 pixels likewise.
    tiles = (pictures - truth).reshape(seeds, 6, 8, 9, 8, 3).mean(axis=(2, 4, 5))
    z = np.maximum(np.abs(tiles.mean(axis=0)) - 0.05 / 10, 0) / (tiles.std(axis=0, ddof=1) / np.sqrt(seeds))
    assert z.max() < 4.5, f"{z.max():.1f} standard errors"


@pytest.mark.parametrize("lit", ["sunny", "soft"])
def test_the_comparison_of_light_finds_nothing_but_noise(request, lit):
    scene = request.getfixturevalue(lit)
    scene = scene if lit == "soft" else scene()
    tracer = Tracer(scene, 2)
    seen = tracer.render()

    def picture(samples, seed, error=None):
        passes = tracer.render_light("direct", samples, seed, error=error)
        return image.Image({**seen, **passes}, scene.camera, {"samples": str(samples)})

    found = radiance.compare(picture(512, 5, 0.01), [picture(64, seed) for seed in range(8)], scene.camera)
    assert found.passed, found.sentence
    bright = picture(512, 5, 0.01)
    bright.passes["Combined"][..., :3] *= 1.01
    assert not radiance.compare(bright, [picture(64, seed) for seed in range(8)], scene.camera).passed, "1 % is not found"


def test_the_variance_told_is_that_of_pictures_with_other_seeds_or_more(sunny):
    tracer = Tracer(sunny(), 2)
    pictures = [tracer.render_light("direct", 256, seed, error=0.02) for seed in range(16)]
    true = np.var([shown(passes) for passes in pictures], axis=0, ddof=1).mean()
    told = np.mean([passes["Variance"].astype(float).mean() for passes in pictures])
    # 1.3 to 2 by halves that complete one another (estimate.py).
    assert 0.9 <= told / true <= 3, f"{told / true:.2f}"


@pytest.mark.parametrize("exposure", [0.0, 1e-3, 1e6])
def test_any_exposure(soft, exposure):
    scene = replace(soft, film=Film(exposure=exposure))
    passes = render(scene, "direct", 32, error=0.02 * (exposure or 1))
    assert all(np.isfinite(values).all() for values in passes.values())
    assert (counts(passes) == counts(render(soft, "direct", 32, error=0.02))).mean() > 0.99 or not exposure


def test_glass_and_nothing_that_light_falls_on(sunny):
    scene = sunny(world=World((0.5, 0.6, 0.7)))
    clear = dict.fromkeys(scene.materials, Material(glass=Colour((1.0,) * 3)))
    passes = render(replace(scene, materials=clear, lamps=()), "path", 16, error=0.05)
    assert np.isfinite(shown(passes)).all() and shown(passes).any()


class Impatient:
    def __init__(self, tiles):
        self.tiles, self.shown = tiles, []

    def tile(self, passes, rows):
        self.shown.extend(rows)

    def stop(self):
        self.tiles -= 1
        return self.tiles < 0


def test_a_watcher_is_shown_all_rows_and_can_stop(soft):
    patient = Impatient(10**9)
    render(soft, "direct", 16, error=0.05, watcher=patient)
    assert sorted(patient.shown) == list(range(soft.camera.height))
    with pytest.raises(Stopped):
        render(soft, "direct", 1 << 16, error=1e-5, watcher=Impatient(20))
