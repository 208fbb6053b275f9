"""The guide that diffuse rays follow: a hollow ball with a hole in it, whose light is known on paper, and what it changes.

The wall of a hollow ball gets as much light from any part of it as from any other. So where the hole takes a share f of it and
shows a sky of radiance 1, and the wall reflects ρ, every point of the wall shines with ρ f / (1 − ρ (1 − f)) (the integrating
sphere: Ulbricht, 1900). A picture whose paths are too few for lessons follows no guide.
"""

import time

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Stopped, render
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import World
from viewcam_addon.tracer.scene.materials import Color, sum_of

pytestmark = pytest.mark.slow

REFLECTED = 0.6
RINGS = 48
HOLE = 3
"""The ball's rings of triangles that are left out."""
SAMPLES = 64
GUIDED, ALONE = (192, 128), (48, 32)
"""Pictures of enough pixels to learn from, and of too few."""


@pytest.fixture(scope="module")
def hollow_ball(closed_ball, make_mesh, make_lit):
    """hollow_ball(size, sky) → Scene: from its middle, towards the wall on the other side of the hole."""
    ball = closed_ball(RINGS)
    heights = ball.vertices[ball.triangles][..., 2]
    walls = make_mesh(ball.vertices, ball.triangles[~(heights > np.cos((HOLE + 0.5) * np.pi / RINGS)).all(axis=1)])

    def build(size, sky=1.0):
        camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), float(size[0]), *size)
        return make_lit(
            camera,
            (walls, sum_of(diffuse=Color((REFLECTED,) * 3))),
            world=World((sky,) * 3),
            bounces=Bounces(64, 64, 64, 64, 64),
        )

    return build


def on_paper():
    share = (1 - np.cos(HOLE * np.pi / RINGS)) / 2
    return REFLECTED * share / (1 - REFLECTED * (1 - share))


def off(passes, expected):
    """The error of the picture's mean in standard errors, and that error as a share of it."""
    picture, variance = (passes[name][..., :3].astype(np.float64) for name in ("Combined", "Variance"))
    error = np.sqrt(variance[..., 0].sum()) / variance[..., 0].size
    return (picture.mean() - expected) / error, error / expected


# Flat faces lie up to 1 − cos(π/2/RINGS), 5e-4, inside of the round ball: twice that in the areas of hole and wall, and in the
# squares of the distances between them.
FLAT = 8 * (1 - np.cos(np.pi / 2 / RINGS))


@pytest.fixture(scope="module")
def pictures(hollow_ball):
    """The passes by the picture's size."""
    return {size: render(hollow_ball(size), "path", SAMPLES) for size in (GUIDED, ALONE)}


@pytest.mark.parametrize("size", [GUIDED, ALONE])
def test_a_hollow_ball_is_as_bright_as_on_paper_with_a_guide_and_without(pictures, size):
    errors, precision = off(pictures[size], on_paper())
    assert abs(errors) <= 3 + FLAT / precision, f"{errors:+.1f} standard errors of {precision:.2%} off"
    assert precision < 0.02


def test_a_sky_that_is_five_hundredths_brighter_would_be_noticed(hollow_ball):
    errors, precision = off(render(hollow_ball(GUIDED, sky=1.05), "path", SAMPLES), on_paper())
    assert errors > 3 + FLAT / precision, f"{errors:+.1f} standard errors of {precision:.2%}"


def test_a_guide_leaves_less_than_half_of_the_noise_where_light_comes_by_a_hole(pictures):
    guided, alone = (pictures[size]["Variance"].astype(float).mean() for size in (GUIDED, ALONE))
    assert guided < 0.5 * alone, f"variance {guided:.2e}, {guided / alone:.2f} of {alone:.2e}"


@pytest.mark.parametrize("options", [{"threads": 1}, {"threads": 3, "steps": (1, 4, SAMPLES)}])
def test_a_guided_picture_has_the_same_bits_on_any_number_of_threads_and_in_any_steps(hollow_ball, pictures, options):
    again = render(hollow_ball(GUIDED), "path", SAMPLES, **options)
    assert np.array_equal(again["Combined"], pictures[GUIDED]["Combined"])


def test_lessons_end_when_they_are_told_to(hollow_ball):
    """A watcher that stops at once waits for none of the lessons, which take a second on a core."""

    class Impatient:
        def tile(self, passes, rows):
            pass

        def stop(self):
            return True

    scene = hollow_ball((960, 640))
    begun = time.monotonic()
    with pytest.raises(Stopped):
        render(scene, "path", SAMPLES, watcher=Impatient(), threads=1)
    assert time.monotonic() - begun < 1, f"{time.monotonic() - begun:.2f} s"
