"""Light that goes straight through, on paper: colors multiply, alphas cover, and a white furnace stays white."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Sun, World
from viewcam_addon.tracer.scene.materials import Color, Material, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

DOWN = Pinhole((0, 0, 4), (0, 0, 0), (0, 1, 0), 40, 32, 24)
TINT = (0.9, 0.6, 0.3)
ROUNDED = 2.0**-22  # a picture is a mean of float64, rounded once, and the cosine of a float32 direction
SUN = Sun("sun", towards=(0, 0, 1), irradiance=(np.pi,) * 3)


def square(make_mesh, height):
    return make_mesh([[-9, -9, height], [9, -9, height], [9, 9, height], [-9, 9, height]], [[0, 1, 2], [0, 2, 3]])


def surface(kind, **inputs):
    return Material(surface=node(kind, **inputs))


def half(color=(1.0, 1.0, 1.0), share=0.5):
    return surface("mix", factor=share, first=node("transparent"), second=node("diffuse", color=color))


@pytest.mark.parametrize("level", ["direct", "path"])
@pytest.mark.parametrize("panes", [0, 1, 3])
def test_panes_multiply_their_colors_on_the_way_to_the_eye_and_to_the_sun(make_mesh, make_lit, panes, level):
    bodies = [(square(make_mesh, 0.5 + number / 4), surface("transparent", color=TINT)) for number in range(panes)]
    scene = make_lit(DOWN, (square(make_mesh, 0.0), sum_of(diffuse=Color((0.5, 0.5, 0.5)))), *bodies, lamps=(SUN,))
    expected = 0.5 * np.array(TINT) ** (2 * panes)
    rendered = render(scene, level, 2, threads=1)["Combined"][..., :3]
    assert np.abs(rendered - expected).max() <= ROUNDED, (rendered[0, 0], expected)


def test_a_shadow_is_black_where_shadow_rays_do_not_go_through(make_mesh, make_lit):
    pane = Material(surface=node("transparent", color=TINT), transparent_shadow=False)
    bodies = (square(make_mesh, 0.0), sum_of(diffuse=Color((0.5, 0.5, 0.5)))), (square(make_mesh, 1.0), pane)
    assert not render(make_lit(DOWN, *bodies, lamps=(SUN,)), "path", 2, threads=1)["Combined"][..., :3].any()


@pytest.mark.parametrize("cycles", [(4, 2), (5, 2)])
def test_beyond_the_limit_all_is_dark(make_mesh, make_lit, cycles):
    """The last of three panes before a light must not be beyond the limit, as Cycles counts, or one more before 5.0."""
    bodies = [(square(make_mesh, 0.5 + number / 4), surface("transparent")) for number in range(3)]
    for most in (1, 2, 3):
        glowing = (square(make_mesh, 0.0), sum_of(emission=Color((1, 1, 1))))
        scene = make_lit(DOWN, glowing, *bodies, bounces=Bounces(transparent=most), cycles=cycles)
        is_seen = most + (cycles < (5, 0)) >= 3
        assert render(scene, "path", 1, threads=1)["Combined"][..., :3].mean() == is_seen, most


def test_the_pictures_alpha_is_what_the_surface_covers(make_mesh, make_lit):
    scene = make_lit(DOWN, (square(make_mesh, 0.0), half(share=0.3)), world=World((1, 1, 1)), film=Film(transparent=True))
    alpha = render(scene, "path", 64, threads=1)["Combined"][..., 3].astype(float)
    assert abs(alpha.mean() - 0.3) <= 4 * np.sqrt(0.3 * 0.7 / (64 * alpha.size))


@pytest.mark.parametrize("share", [0.2, 0.8])
def test_a_white_furnace_stays_white(closed_ball, make_lit, share):
    """A ball that lets a part of the light through and scatters the rest, inside and outside, in a world that is white."""
    camera = Pinhole((0, 0, 4), (0, 0, 0), (0, 1, 0), 24, 16, 12)
    lots = Bounces(64, 64, 64, 64, 1024)
    passes = render(
        make_lit(camera, (closed_ball(6), half(share=share)), world=World((1, 1, 1)), bounces=lots), "path", 64, threads=1
    )
    radiance, error = passes["Combined"][..., :3].astype(float), np.sqrt(passes["Variance"].sum()) / passes["Variance"].size
    assert abs(radiance.mean() - 1) <= 4 * error + ROUNDED and error < 0.01, (radiance.mean(), error)


def test_the_bits_are_the_same_for_any_number_of_threads(closed_ball, make_lit):
    camera = Pinhole((0, 0, 4), (0, 0, 0), (0, 1, 0), 40, 64, 40)
    scene = make_lit(camera, (closed_ball(6), half()), lamps=(SUN,), world=World((0.5, 0.6, 0.7)))
    single, three = (render(scene, "path", 4, threads=threads)["Combined"] for threads in (1, 3))
    assert np.array_equal(single, three)


# --- Things that stand exactly on others show what they show a little above them, in whatever order they are in the scene


CAMERA = Pinhole((3.0, -5.0, 4.0), (0.0, 0.0, 0.7), (0.0, 0.0, 1.0), 150.0, 64, 48)
GAP = 1e-6
SIDES = 12
SURFACES = {"shines": node("emission", color=(1.0, 0.5, 0.2)), "matte": node("diffuse", color=(0.8, 0.5, 0.2))}


def cylinder(make_mesh, bottom, height, turn=0.3):
    """A closed prism, faces outwards."""
    angles = turn + np.arange(SIDES) * 2 * np.pi / SIDES
    rim = np.column_stack([np.cos(angles), np.sin(angles)])
    vertices = np.concatenate([np.column_stack([rim, np.full(SIDES, z)]) for z in (bottom, bottom + height)])
    following = [(i + 1) % SIDES for i in range(SIDES)]
    sides = [t for i, j in enumerate(following) for t in ([i, j, SIDES + j], [i, SIDES + j, SIDES + i])]
    caps = [t for i in range(1, SIDES - 1) for t in ([0, i + 1, i], [SIDES, SIDES + i, SIDES + i + 1])]
    return make_mesh(vertices, sides + caps)


@pytest.fixture
def seen(make_lit, make_mesh):
    """seen(surface, gap, first, blocks, slope) → (n, 3): a pile of glass on a plane, with gaps, sloped; which comes first?"""

    def trace(surface, gap, first, blocks, slope):
        plane = make_mesh([(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)], [(0, 1, 2), (0, 2, 3)])
        bodies = [(plane, Material(surface=SURFACES[surface]))]
        for number in range(blocks):
            block = cylinder(make_mesh, gap + number * (1.0 + gap), 1.0)
            bodies.insert(0 if first == "glass" else len(bodies), (block, Material(surface=node("glass", ior=1.5))))
        turn = np.array([[1, 0, 0], [0, np.cos(slope), -np.sin(slope)], [0, np.sin(slope), np.cos(slope)]])
        for body, _ in bodies:
            body.vertices[:] = body.vertices @ turn.T + (0.1 if slope else 0.0)
        lamps = (Sun("sun", towards=(0.3, -0.2, 1.0), irradiance=(3.0, 3.0, 3.0), angle=0.5),)
        bounces = Bounces(total=12, diffuse=4, glossy=12, transmission=12)
        scene = make_lit(CAMERA, *bodies, lamps=lamps, film=Film("BOX"), bounces=bounces)
        return render(scene, "path", 4, threads=2)["Combined"][..., :3].reshape(-1, 3)

    return trace


def differing(actual, expected):
    """The share of the pixels that differ by a thousandth of the brightest one: a shift by a gap goes across an edge in few."""
    return (np.abs(actual - expected).max(axis=1) > 1e-3 * expected.max()).mean()


@pytest.mark.parametrize("slope", [0.0, 0.2])
@pytest.mark.parametrize("blocks", [1, 2])
@pytest.mark.parametrize("surface", SURFACES)
def test_glass_that_stands_on_a_plane_shows_what_it_shows_a_little_above(seen, surface, blocks, slope):
    lifted = seen(surface, GAP, "plane", blocks, slope)
    for first in ("plane", "glass"):
        assert differing(seen(surface, 0.0, first, blocks, slope), lifted) < 0.003, first


def test_glass_that_is_let_into_a_plane_shows_something_else(seen):
    """The test above must be able to fail."""
    for surface in SURFACES:
        assert differing(seen(surface, -GAP, "plane", 1, 0.0), seen(surface, GAP, "plane", 1, 0.0)) > 0.05
