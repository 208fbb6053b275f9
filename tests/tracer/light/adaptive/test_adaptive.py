"""As many samples as a wanted error takes: where they go, that the error is met, and that means stay right."""

import numpy as np
import pytest

from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Area
from viewcam_addon.tracer.scene.materials import Colour, Material

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def mirrored(make_lit, floor, make_spheres, soft):
    """A mirror that shows a small bright lamp, and throws its light about: some paths are far brighter than all others."""
    camera = soft.camera
    matrix = np.eye(4)
    matrix[:3, 3] = (0.5, 0, 3)
    things = (
        (floor(), Material(diffuse=Colour((0.6, 0.7, 0.8)))),
        (make_spheres([(-1, 0, 0.8)], 0.8), Material(mirror=Colour((0.9,) * 3))),
        (make_spheres([(1, 0.5, 0.6)], 0.6), Material(diffuse=Colour((0.8, 0.3, 0.2)))),
    )
    lamp = Area("area", matrix=matrix, size=(0.5, 0.5), power=(100,) * 3)
    return make_lit(camera, *things, lamps=(lamp,), bounces=Bounces(2, 2, 2, 2))


@pytest.fixture(scope="module")
def reference(mirrored):
    return render(mirrored, "path", 1024, 99)


def grey(passes):
    return passes["Combined"][..., :3].astype(float).mean(axis=-1)


def tiles(values, side=12):
    height, width = (size // side * side for size in values.shape)
    return values[:height, :width].reshape(height // side, side, width // side, side).mean(axis=(1, 3))


def off_by(pictures, truth, variance):
    """Standard errors by which the means of pictures differ from the truth, by tiles and in all: (tiles), whole."""

    def judged(reduce):
        many = np.array([reduce(picture) for picture in pictures])
        error = np.sqrt(many.var(axis=0, ddof=1) / len(many) + reduce(variance))
        return (many.mean(axis=0) - reduce(truth)) / np.maximum(error, 1e-12)

    pixels = truth.size / tiles(truth).size
    by_tile = judged(lambda values: tiles(values) if values is not variance else tiles(values) / pixels)
    whole = judged(lambda values: values.mean() if values is not variance else values.mean() / truth.size)
    return by_tile, whole


def test_means_are_right_over_many_seeds_in_every_tile_and_in_all(mirrored, reference):
    """Pixels that went on for what they had met, and stopped for what they had missed, would be too dark: by some 16 errors."""
    pictures = [grey(render(mirrored, "path", 128, seed, error=0.05)) for seed in range(24)]
    by_tile, whole = off_by(pictures, grey(reference), reference["Variance"].astype(float).mean(axis=-1))
    assert abs(whole) < 4, f"the picture is off by {whole:+.1f} standard errors"
    # Student's t of 23 degrees of freedom exceeds 5 once in 40,000 times; there are 28 tiles.
    assert np.abs(by_tile).max() < 5, f"a tile is off by {np.abs(by_tile).max():.1f} standard errors"


def test_pictures_that_lost_what_few_samples_met_would_be_told(mirrored, reference):
    pictures = [np.minimum(grey(render(mirrored, "path", 16, seed)), 2 * grey(reference)) for seed in range(24)]
    by_tile, whole = off_by(pictures, grey(reference), reference["Variance"].astype(float).mean(axis=-1))
    assert abs(whole) > 4 or np.abs(by_tile).max() > 5


@pytest.mark.parametrize("error", [0.03, pytest.param(0.01, marks=pytest.mark.exhaustive)])
def test_the_error_that_is_wanted_is_met_in_the_mean(soft, error):
    scene = soft
    truth = render(scene, "direct", 2048, 99)["Combined"][..., :3].astype(float)
    passes = render(scene, "direct", 1024, 1, error=error)
    off = np.sqrt(((passes["Combined"][..., :3] - truth) ** 2).mean())
    assert off <= error, f"{off:.4f}"
    told = np.sqrt(passes["Variance"].astype(float).mean())
    assert off / 3 <= told <= 3 * off, f"{told:.4f} told, {off:.4f} true"


def test_samples_go_where_noise_is_and_are_no_more_than_allowed(soft):
    scene = soft
    coarse, fine, few = (
        render(scene, "direct", most, 1, error=error)["Sample Count"]
        for most, error in ((1024, 0.03), (1024, 0.01), (50, 0.001))
    )
    assert coarse.min() == 8 and coarse.mean() < fine.mean() and fine.max() > 4 * fine.min()
    assert few.max() == 50 and set(np.unique(few)) <= {8, 16, 32, 50}
    passes = render(scene, "direct", 1, 1, error=0.03)
    assert (passes["Sample Count"] == 1).all()


def test_without_noise_all_pixels_have_the_fewest_samples(make_lit, floor):
    from viewcam_addon.pinhole import Pinhole
    from viewcam_addon.tracer.scene.lamps import World

    camera = Pinhole((0, -6, 3), (0, 0, 0.6), (0, 0, 1), 84, 72, 48)
    passes = render(make_lit(camera, world=World((1, 2, 3))), "path", 1024, error=1e-6)
    assert (passes["Sample Count"] == 8).all() and (passes["Combined"] == (1, 2, 3, 1)).all()
    assert (passes["Variance"] == 0).all()
