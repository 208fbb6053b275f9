"""Trees of shaders and value nodes as chance makes them: any combination of all nodes, images and extreme numbers is rendered.

The table of nodes makes them, so that a node that is added is tried with all others. Rejected: hypothesis, which would shrink a
tree, but draws each of its numbers by itself: the seed that fails is told, and its scene is three squares.
"""

import random
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import value_nodes
from viewcam_addon.tracer.scene.colors import WHITE, Color, Picture
from viewcam_addon.tracer.scene.lamps import Area, Point, Sun, World
from viewcam_addon.tracer.scene.materials import Material
from viewcam_addon.tracer.scene.shader_nodes import KINDS, Node, node

VALUES = [name for name, kind in KINDS.items() if kind.is_value]
ENDS = [name for name, kind in KINDS.items() if not kind.is_value and None not in kind.inputs.values()]
TREES = [*ENDS, *["principled"] * 4, *["mix", "add"] * 3]
NUMBERS = (0.0, 1.0, 0.5, 1e-6, 3.0)
CAMERA = Pinhole((0.3, -0.5, 2.5), (0, 0, 0), (0, 1, 0), 20, 16, 12)
IES = "IESNA\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 100\n0 90\n0\n100 50\n"
LAMPS = (
    (),
    (Sun("sun", towards=(0.0, 0.6, 0.8), irradiance=(3, 3, 3), angle=0.01),),
    (Point("point", position=(0.5, 0.2, 2), power=(50, 40, 30), radius=0.1), Area("area", matrix=np.eye(4), power=(5, 5, 5))),
)


def random_images(seed):
    """Name → picture: floats, bytes with an alpha, and more than white."""
    numbers = np.random.default_rng(seed)
    return {
        "floats": Picture(numbers.random((2, 3, 3)).astype(np.float32)),
        "bytes": Picture((numbers.random((4, 4, 4)) * 255).astype(np.uint8), srgb=True),
        "bright": Picture((numbers.random((3, 2, 3)) * 20).astype(np.float32)),
    }


def random_image(chance, rgb=WHITE):
    return Color(rgb, image=chance.choice(["floats", "bytes", "bright"]))


def random_input(chance, default, depth, is_value):
    """A number, a color, an image or a node for an input that has this default."""
    rgb = tuple(chance.choice([0.0, 1.0, chance.random()]) for _ in range(3))
    choice = chance.random()
    if choice < 0.15:
        return random_image(chance, chance.choice([WHITE, rgb]))
    if choice < 0.5 and depth > 0:
        return random_node(chance, chance.choice(VALUES), depth - 1)
    if isinstance(default, tuple):
        return rgb
    return chance.choice([*NUMBERS, chance.random(), *((-1.0, 100.0) if is_value else ())])


def random_node(chance, kind, depth) -> Node:
    """A node of a type, each input of which is left out or drawn.

    depth : the depth of the nodes that may feed it.
    """
    inputs = {}
    for name, default in KINDS[kind].inputs.items():
        if isinstance(default, bool):
            inputs[name] = chance.random() < 0.5
        elif isinstance(default, tuple) and isinstance(default[0], str):
            inputs[name] = chance.choice(default)
        elif default is None:
            inputs[name] = random_node(chance, chance.choice(TREES if depth > 1 else ENDS), depth - 1)
        elif default == value_nodes.IMAGE:
            inputs[name] = random_image(chance)
        elif default == value_nodes.NAME:
            inputs[name] = chance.choice(["UVMap", "nothing"])
        elif default == value_nodes.IES:
            inputs[name] = IES
        elif isinstance(default, str):  # a vector that the surface has, where nothing else is given
            if chance.random() < 0.3 and depth > 0:
                inputs[name] = random_node(chance, chance.choice(VALUES), depth - 1)
        elif chance.random() < 0.5:
            inputs[name] = random_input(chance, default, depth, KINDS[kind].is_value)
    return node(kind, **inputs)


@pytest.fixture
def random_squares(make_mesh, make_lit):
    """random_squares(seed) → a scene of three squares, each with a random shader, under random lamps."""

    def build(seed):
        chance, numbers = random.Random(seed), np.random.default_rng(seed)
        bodies = []
        for height, half in ((0.0, 1.0), (0.4, 0.4), (1.2, 0.6)):
            corners = np.array([[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]])
            turn = np.linalg.qr(numbers.normal(size=(3, 3)))[0] if height else np.eye(3)
            uvs = numbers.random((2, 3, 2))
            mesh = make_mesh(corners @ turn + (0, 0, height), [[0, 1, 2], [0, 2, 3]], corner_uvs=uvs)
            bodies.append((mesh, Material(random_node(chance, chance.choice(TREES), 3))))
        world = World((chance.choice([0.0, 0.3]),) * 3)
        return make_lit(CAMERA, *bodies, lamps=chance.choice(LAMPS), images=random_images(seed), world=world)

    return build


@pytest.mark.parametrize("seed", range(0, 120, 30))
def test_a_picture_of_any_shaders_is_finite(random_squares, seed):
    for each in range(seed, seed + 30):
        scene = random_squares(each)
        for level in ("direct", "path"):
            passes = render(scene, level, 4, each)
            for name in passes.keys() - {"Depth", "Variance"}:  # the depth of nothing, and squares beyond float32
                assert np.isfinite(passes[name]).all(), f"seed {each}, {level}, {name}"


@pytest.mark.parametrize("seed", range(0, 120, 30))
def test_any_shaders_have_in_vectors_the_bits_that_they_have_path_by_path(random_squares, seed):
    """A second closure that is black and transparent adds nothing, but with it no paths at a surface go together."""
    black = node("transparent", color=Color((0.0, 0.0, 0.0)))
    for each in range(seed, seed + 30):
        scene = random_squares(each)
        one_by_one = {
            name: Material(node("add", first=material.surface, second=black)) for name, material in scene.materials.items()
        }
        in_vectors, in_turn = (
            render(replace(scene, materials=materials), "path", 8) for materials in (scene.materials, one_by_one)
        )
        for name, values in in_vectors.items():
            assert np.array_equal(values, in_turn[name], equal_nan=True), f"seed {each}, {name}"
