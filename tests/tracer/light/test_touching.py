"""Things that stand exactly on others show what they show a little above them, in whatever order they are in the scene."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import Sun
from viewcam_addon.tracer.scene.materials import Material
from viewcam_addon.tracer.scene.shader_nodes import node

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
        things = [(plane, Material(surface=SURFACES[surface]))]
        for number in range(blocks):
            block = cylinder(make_mesh, gap + number * (1.0 + gap), 1.0)
            things.insert(0 if first == "glass" else len(things), (block, Material(surface=node("glass", ior=1.5))))
        turn = np.array([[1, 0, 0], [0, np.cos(slope), -np.sin(slope)], [0, np.sin(slope), np.cos(slope)]])
        for thing, _ in things:
            thing.vertices[:] = thing.vertices @ turn.T + (0.1 if slope else 0.0)
        lamps = (Sun("sun", towards=(0.3, -0.2, 1.0), irradiance=(3.0, 3.0, 3.0), angle=0.5),)
        bounces = Bounces(total=12, diffuse=4, glossy=12, transmission=12)
        scene = make_lit(CAMERA, *things, lamps=lamps, film=Film("BOX"), bounces=bounces)
        return render(scene, "path", 4, threads=2)["Combined"][..., :3].reshape(-1, 3)

    return trace


def differing(found, expected):
    """How many of the pixels differ by a thousandth of the brightest one: a shift by a gap goes across an edge in few."""
    return (np.abs(found - expected).max(axis=1) > 1e-3 * expected.max()).mean()


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
