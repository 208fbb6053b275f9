"""Samples up to a wanted error: where they go, that the error is met, and that means stay right."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Area, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import Color, sum_of

CAMERA = Pinhole((0, -6, 3), (0, 0, 0.6), (0, 0, 1), 84, 72, 48)
SUN = Sun("sun", towards=(0.5, -0.6, 1), irradiance=(3, 3, 2.7))


@pytest.fixture(scope="session")
def floor(make_mesh):
    """floor(height) → Mesh: a square as large as anything here, at a height."""

    def build(height=0.0):
        corners = [(-50, -50, height), (50, -50, height), (50, 50, height), (-50, 50, height)]
        return make_mesh(corners, [(0, 1, 2), (0, 2, 3)])

    return build


@pytest.fixture(scope="session")
def sunny(make_lit, floor, make_spheres):
    """sunny(**light) → Scene: spheres on a floor, under a sun of no size."""
    bodies = (
        (floor(), sum_of(diffuse=Color((0.6, 0.7, 0.8)))),
        (
            make_spheres([(-1, 0, 0.8), (1, 0.5, 0.6)], [0.8, 0.6]),
            sum_of(diffuse=Color((0.8, 0.3, 0.2))),
        ),
    )

    def build(**light):
        return make_lit(light.pop("camera", CAMERA), *bodies, **{"lamps": (SUN,), **light})

    return build


@pytest.fixture(scope="session")
def soft(sunny):
    """The sunny scene under an area lamp and a sky."""
    matrix = np.eye(4)
    matrix[:3, 3] = (1, -1, 4)
    lamp = Area("area", matrix=matrix, size=(2, 2), power=(150, 150, 150))
    return sunny(lamps=(lamp,), world=World((0.2, 0.25, 0.3)))


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def mirrored(make_lit, floor, make_spheres, soft):
    """A mirror that shows a small bright lamp, and throws its light about: some paths are far brighter than all others."""
    camera = soft.camera
    matrix = np.eye(4)
    matrix[:3, 3] = (0.5, 0, 3)
    bodies = (
        (floor(), sum_of(diffuse=Color((0.6, 0.7, 0.8)))),
        (make_spheres([(-1, 0, 0.8)], 0.8), sum_of(mirror=Color((0.9,) * 3))),
        (make_spheres([(1, 0.5, 0.6)], 0.6), sum_of(diffuse=Color((0.8, 0.3, 0.2)))),
    )
    lamp = Area("area", matrix=matrix, size=(0.5, 0.5), power=(100,) * 3)
    return make_lit(camera, *bodies, lamps=(lamp,), bounces=Bounces(2, 2, 2, 2))


@pytest.fixture(scope="module")
def reference(mirrored):
    return render(mirrored, "path", 1024, 99)


def gray(passes):
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
    pictures = [gray(render(mirrored, "path", 128, seed, error=0.05)) for seed in range(24)]
    by_tile, whole = off_by(pictures, gray(reference), reference["Variance"].astype(float).mean(axis=-1))
    assert abs(whole) < 4, f"the picture is off by {whole:+.1f} standard errors"
    # Student's t of 23 degrees of freedom exceeds 5 once in 40,000 times; there are 28 tiles.
    assert np.abs(by_tile).max() < 5, f"a tile is off by {np.abs(by_tile).max():.1f} standard errors"


def test_pictures_that_lost_what_few_samples_met_would_be_told(mirrored, reference):
    pictures = [np.minimum(gray(render(mirrored, "path", 16, seed)), 2 * gray(reference)) for seed in range(24)]
    by_tile, whole = off_by(pictures, gray(reference), reference["Variance"].astype(float).mean(axis=-1))
    assert abs(whole) > 4 or np.abs(by_tile).max() > 5


@pytest.mark.parametrize("error", [0.03, pytest.param(0.01, marks=pytest.mark.exhaustive)])
def test_the_error_that_is_wanted_is_met_in_the_mean(soft, error):
    scene = soft
    truth = render(scene, "direct", 2048, 99)["Combined"][..., :3].astype(float)
    passes = render(scene, "direct", 1024, 1, error=error)
    off = np.sqrt(((passes["Combined"][..., :3] - truth) ** 2).mean())
    assert off <= error, f"{off:.4f}"
    stated = np.sqrt(passes["Variance"].astype(float).mean())
    assert off / 3 <= stated <= 3 * off, f"{stated:.4f} told, {off:.4f} true"


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


# --- What is thinner than a pixel and would slip between samples: a wire, dust, their shadows, a window that few rays find


WANTED = 0.02
MOST = 12 * WANTED
WHITE = sum_of(diffuse=Color((0.9,) * 3))


@pytest.fixture(scope="module")
def with_things(make_lit, floor, sunny):
    """with_things(geometry, material, **light) → Scene: something above a dark floor, under the sun."""
    scene = sunny()

    def build(geometry, material=WHITE, **light):
        light = {"lamps": scene.lamps, **light}
        return make_lit(scene.camera, (floor(), sum_of(diffuse=Color((0.05,) * 3))), (geometry, material), **light)

    return build


def wire(make_mesh, start, end, thickness):
    """A ribbon between two points that faces up and the eye, this thick."""
    side = np.cross(np.subtract(end, start), (0, -0.9, 0.45))
    side *= thickness / 2 / np.linalg.norm(side)
    return make_mesh([start - side, end - side, end + side, start + side], [(0, 1, 2), (0, 2, 3)])


def assert_nothing_slips(scene, seeds=3):
    truth = render(scene, "direct", 1024, 77)["Combined"][..., :3].astype(float)
    for seed in range(seeds):
        passes = render(scene, "direct", 1024, seed, error=WANTED)
        off = np.sqrt(((passes["Combined"][..., :3] - truth) ** 2).mean(axis=-1))
        worst = np.unravel_index(off.argmax(), off.shape)
        assert off.max() <= MOST, f"{off.max() / WANTED:.1f} E at {worst}, {passes['Sample Count'][worst]} samples"
        assert np.sqrt((off**2).mean()) <= WANTED, f"{np.sqrt((off**2).mean()):.4f}"
    return passes


@pytest.mark.exhaustive
@pytest.mark.parametrize("thickness", [0.03, 0.01, 0.003])
def test_a_wire_far_thinner_than_a_pixel(with_things, make_mesh, thickness):
    """A pixel is 0.08 wide there: the thinnest wire covers a 27th of it, and no ray through a center need meet it."""
    passes = assert_nothing_slips(with_things(wire(make_mesh, (-2.03, 0, 0.61), (2.02, 0.4, 1.17), thickness)))
    assert (passes["Sample Count"].max(axis=0)[10:-10] > 1).all(), "the wire crosses these columns"


def test_a_wire_is_seen_in_every_pixel_that_it_crosses(with_things, make_mesh):
    """Its light is summed over each column: where a pixel was missed, a column would be darker."""
    scene = with_things(wire(make_mesh, (-3, 0, 0.61), (3, 0.4, 1.17), 0.01))
    truth = render(scene, "direct", 1024, 77)["Combined"][..., 0].sum(axis=0)
    columns = render(scene, "direct", 1024, 3, error=0.005)["Combined"][..., 0].sum(axis=0)
    # Some ten pixels of a column have an error of 0.005 each.
    assert np.abs(columns - truth).max() < 5 * 0.005 * np.sqrt(10), f"{np.abs(columns - truth).max():.3f}"


def test_a_field_of_spheres_smaller_than_pixels_and_their_shadows(with_things, make_spheres):
    rng = np.random.default_rng(4)
    centers = np.column_stack([rng.uniform(-3, 3, 150), rng.uniform(-3, 4, 150), rng.uniform(0.01, 0.8, 150)])
    assert_nothing_slips(with_things(make_spheres(centers, rng.uniform(0.005, 0.05, 150))))


def test_shadows_of_wires_above_the_picture(with_things, make_mesh):
    """The wires themselves are not to be seen; the floor is bright."""
    wires = [wire(make_mesh, (-6, y, 6), (6, y + 0.5, 6.5), 0.02) for y in (-5.5, -4.4, -3.3)]
    corners = np.concatenate([each.vertices for each in wires])
    ribbons = make_mesh(corners, np.concatenate([each.triangles + 4 * i for i, each in enumerate(wires)]))
    scene = with_things(ribbons)
    bright = {**scene.materials, "material 0": WHITE}
    assert_nothing_slips(type(scene)(**{**vars(scene), "materials": bright}))


def assert_no_light_is_lost(scene, seeds=48):
    """Assert that few samples, noisy as they are, are neither too dark nor too bright: the sum over many seeds is right."""
    truth = render(scene, "direct", 1024, 77)
    spread = np.sqrt(truth["Variance"].astype(float).mean(axis=-1).sum())
    sums = [render(scene, "direct", 1024, seed, error=WANTED)["Combined"][..., :3].mean(axis=-1).sum() for seed in range(seeds)]
    off = np.mean(sums) - truth["Combined"][..., :3].astype(float).mean(axis=-1).sum()
    error = np.hypot(np.std(sums, ddof=1) / np.sqrt(seeds), spread)
    assert abs(off) <= 4 * error, f"{off / error:+.1f} standard errors of {error:.3g}"


@pytest.mark.exhaustive
def test_a_small_bright_window_that_few_samples_see(with_things, make_mesh):
    """It covers a hundredth of one pixel, and is forty times as bright as white."""
    window = make_mesh([(0.5, 0, 0.8), (0.508, 0, 0.8), (0.508, 0, 0.808), (0.5, 0, 0.808)], [(0, 1, 2), (0, 2, 3)])
    assert_no_light_is_lost(with_things(window, sum_of(emission=Color((40,) * 3))))


def test_a_spot_whose_light_falls_within_a_pixel(with_things, make_spheres):
    matrix = np.eye(4)
    matrix[:3, 3] = (0.31, 0.17, 4)
    spot = Spot("spot", matrix=matrix, power=(1e5, 1e5, 1e5), angle=0.012, blend=0.0)
    assert_no_light_is_lost(with_things(make_spheres([(2, 3, 0.3)], 0.3), lamps=(spot,)))
