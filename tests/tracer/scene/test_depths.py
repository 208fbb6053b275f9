"""Bounds of depth for a renderer that needs some: nothing is cut off that the scene shows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres
from viewcam_addon.tracer.scene.depths import visible_depths


def square(half, depth):
    """A square before the eye, which looks along −z from the origin."""
    vertices = np.array([[-half, -half, -depth], [half, -half, -depth], [half, half, -depth], [-half, half, -depth]])
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]], np.int32), np.zeros(2, np.int32))


def scene_of(geometry, clip=(0.0, math.inf), distance=16.0, matrix=None):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), distance, 32, 32)
    return Scene(camera, {"thing": geometry}, (Object("thing", "thing", np.eye(4) if matrix is None else matrix),), clip=clip)


def test_what_the_scene_says_stays():
    assert visible_depths(scene_of(square(1, 2), (0.5, 7.0))) == (0.5, 7.0)


@pytest.mark.parametrize(
    ("depth", "start", "end"), [(5.0, 0.1, 1000.0), (0.05, 0.01, 1000.0), (1e-7, 1e-6, 1000.0), (2e5, 0.1, 1e6)]
)
def test_the_start_is_before_the_nearest_thing_and_the_end_behind_the_farthest(depth, start, end):
    assert visible_depths(scene_of(square(depth, depth))) == (start, end)


def test_a_wide_view_needs_a_nearer_start():
    """What is seen in a corner is farther away than deep."""
    assert visible_depths(scene_of(square(5, 5), distance=16.0))[0] == 0.1
    assert visible_depths(scene_of(square(5, 5), distance=0.16))[0] == 0.01


def test_a_room_around_the_eye_is_not_taken_for_a_thing_at_the_eye():
    vertices = np.array([[x, y, z] for x in (-3.0, 3.0) for y in (-3.0, 3.0) for z in (-3.0, 3.0)])
    walls = np.array([[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6]], np.int32)
    assert visible_depths(scene_of(Mesh(vertices, walls, np.zeros(8, np.int32))))[0] == 0.1


def test_a_scene_without_anything_has_bounds():
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32))
    assert visible_depths(scene_of(empty)) == (0.1, 1000.0)
    assert visible_depths(replace(scene_of(empty), objects=())) == (0.1, 1000.0)


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.01, 0.3, 3.0, 1e4]))
@settings(max_examples=30)
def test_the_picture_is_the_same_with_the_bounds(seed, size):
    random = np.random.default_rng(seed)
    matrix = np.eye(4)
    matrix[:3, :3] = random.normal(size=(3, 3))
    matrix[:3, 3] = random.normal(size=3) * size
    count = 6
    balls = Spheres(random.normal(size=(count, 3)) * size, random.random(count) * size / 2, np.zeros(count, np.int32))
    triangles = Mesh(random.normal(size=(9, 3)) * size, np.arange(9, dtype=np.int32).reshape(3, 3), np.zeros(3, np.int32))
    for geometry in (balls, triangles):
        scene = scene_of(geometry, matrix=matrix)
        bounded = replace(scene, clip=visible_depths(scene))
        one, other = render.render(scene, threads=1), render.render(bounded, threads=1)
        for name in one:
            assert np.array_equal(one[name], other[name]), (name, bounded.clip)
