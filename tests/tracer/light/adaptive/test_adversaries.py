"""What is thinner than a pixel and would slip between samples: a wire, dust, their shadows, a window that few rays find.

A pixel is off by its standard error E, and by more than 6 E with a probability of 2e-9 if that is normal. Estimates of it are
not: pixels stop sooner by luck. What slips through is bounded by 12 E for any pixel here, and by E for the whole picture; but
for what is so small and bright that the first samples of a pixel and of those around it all miss it.
"""

import numpy as np
import pytest

from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.lamps import Spot
from viewcam_addon.tracer.scene.materials import Colour, Material

pytestmark = pytest.mark.slow

WANTED = 0.02
MOST = 12 * WANTED
WHITE = Material(diffuse=Colour((0.9,) * 3))


@pytest.fixture(scope="module")
def with_things(make_lit, floor, sunny):
    """with_things(geometry, material, **light) → Scene: something above a dark floor, under the sun."""
    scene = sunny()

    def build(geometry, material=WHITE, **light):
        light = {"lamps": scene.lamps, **light}
        return make_lit(scene.camera, (floor(), Material(diffuse=Colour((0.05,) * 3))), (geometry, material), **light)

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
    """A pixel is 0.08 wide there: the thinnest wire covers a 27th of it, and no ray through a centre need meet it."""
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
    """What few samples meet is noise of a pixel, but neither too dark nor too bright: the sum over many seeds is right."""
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
    assert_no_light_is_lost(with_things(window, Material(emission=Colour((40,) * 3))))


def test_a_spot_whose_light_falls_within_a_pixel(with_things, make_spheres):
    matrix = np.eye(4)
    matrix[:3, 3] = (0.31, 0.17, 4)
    spot = Spot("spot", matrix=matrix, power=(1e5, 1e5, 1e5), angle=0.012, blend=0.0)
    assert_no_light_is_lost(with_things(make_spheres([(2, 3, 0.3)], 0.3), lamps=(spot,)))
