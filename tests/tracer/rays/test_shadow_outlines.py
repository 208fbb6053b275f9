"""Every pixel that the edge of a shadow crosses is marked: against brute force, 64 rays a pixel, each with its shadow rays.

A pixel holds such an edge, says brute force, if of two points of one thing that are seen side by side in it one is lit and the
other is not.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.arrays import dot
from viewcam_addon.tracer.rays.shadow_outlines import ShadowOutlines
from viewcam_addon.tracer.scene.lamps import Point, Spot, Sun

SEEDS = st.integers(0, 10**6)
FINE = 8
QUADS = [(0, 1, 2), (0, 2, 3)]


def lit(picture, lamp, fine: int = FINE) -> np.ndarray:
    """(height · fine, width · fine): 2 · thing, + 1 where the lamp shines on what is seen; −1 where nothing is."""
    x, y, found, _ = picture.rays(fine)
    met = np.flatnonzero(found.ravel() >= 0)
    points = picture.surfaces.seen(found.ravel()[met], x.ravel()[met], y.ravel()[met])
    if isinstance(lamp, Sun):
        towards = (picture.view.axes @ np.array(lamp.towards))[:, None] * np.ones(points.count)
        distance = np.full(points.count, np.inf)
    else:
        place = np.array(lamp.position) if isinstance(lamp, Point) else lamp.matrix[:3, 3]
        towards = (picture.view.axes @ (place - picture.view.eye))[:, None] - points.position
        distance = np.sqrt(dot(towards, towards))
        towards = towards / distance
    light = (dot(points.normal, towards) > 0) & ~picture.space.blocked(points, towards, distance)
    if isinstance(lamp, Spot):
        rays = np.linalg.inv(lamp.matrix[:3, :3]) @ picture.view.axes.T @ towards
        light &= rays[2] > np.cos(lamp.angle / 2) * np.sqrt(dot(rays, rays))
    values = np.full(x.size, -1)
    values[met] = 2 * picture.things()[found.ravel()[met]] + light
    return values.reshape(x.shape)


def edges(picture, lamp, fine: int = FINE) -> np.ndarray:
    """(height, width): the pixels in which one thing is lit here and dark beside."""
    values = lit(picture, lamp, fine)
    one_thing = picture.pixels_with_leaps(values, fine) & ~picture.pixels_with_leaps(values // 2, fine)
    return one_thing


def widened(mask: np.ndarray) -> np.ndarray:
    """With the eight pixels round each."""
    padded = np.pad(mask, 1)
    rows, columns = mask.shape
    return np.any([padded[row : row + rows, column : column + columns] for row in range(3) for column in range(3)], axis=0)


def check_none_is_missed(picture, lamp, of_at_least: int = 1, at_ends: float = 0.0) -> None:
    """at_ends : the part of the pixels that may be missed if others beside them are not: where the shadows of two things meet,
    up to half a step of an edge is."""
    crossed, marked = edges(picture, lamp), picture.shaded()
    missed = crossed & ~marked
    text = f"of {crossed.sum()} pixels with edges of shadows, while {marked.mean():.0%} of all are marked"
    few = missed.sum() <= (1 + at_ends * crossed.sum() if at_ends else 0) and not (missed & ~widened(marked)).any()
    assert few, f"{missed.sum()} {text}, are missed, as in (row, column) {np.argwhere(missed)[:3].tolist()}"
    assert crossed.sum() >= of_at_least, f"too few tell nothing: {text}"


@pytest.fixture(scope="module")
def floor(make_mesh):
    return make_mesh([(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0)], QUADS)


@pytest.fixture(scope="module")
def lamp_of():
    """lamp_of(kind, rng) → a lamp without size above the floor."""

    def build(kind: str, rng):
        place = np.append(rng.uniform(-2, 2, 2), rng.uniform(3, 6))
        if kind == "sun":
            return Sun("lamp", towards=tuple(place))
        if kind == "point":
            return Point("lamp", position=tuple(place))
        axis = place / np.linalg.norm(place)
        across = np.linalg.qr(np.c_[axis, np.eye(3)[:, :2]])[0]
        across[:, 0] = axis
        matrix = np.eye(4)
        matrix[:3, :3] = across[:, [1, 2, 0]] * (1, rng.uniform(0.5, 2), 1)
        matrix[:3, 3] = place
        return Spot("lamp", matrix=matrix, angle=rng.uniform(0.3, 1.5), blend=0.0)

    return build


def above(rng, zoom: float = 1.0) -> Pinhole:
    eye = np.append(rng.uniform(-3, 3, 2), rng.uniform(2, 6))
    return Pinhole(tuple(eye), (0, 0, 0.2), (0.1, 0.2, 1), 40 * zoom, 40, 24)


@given(SEEDS, st.sampled_from(["sun", "point", "spot"]), st.floats(0.05, 2))
@settings(max_examples=20, deadline=None)
def test_the_shadow_of_a_wire_is_not_missed_however_thin(outlined, make_lit, make_wire, floor, lamp_of, seed, kind, thin):
    rng = np.random.default_rng(seed)
    camera, lamp = above(rng), lamp_of(kind, rng)
    start, end = rng.uniform(-1, 1, (2, 3)) * (1, 1, 0.4) + (0, 0, 0.9)
    width = thin * np.linalg.norm(camera.eye) / 40
    picture = outlined(make_lit(camera, (floor, None), (make_wire(start, end, width), None), lamps=(lamp,)))
    check_none_is_missed(picture, lamp, of_at_least=0)


@given(SEEDS, st.sampled_from(["sun", "point", "spot"]))
@settings(max_examples=20, deadline=None)
def test_shadows_of_spheres_and_meshes_on_floors_and_on_one_another_are_not_missed(
    outlined, make_lit, make_spheres, ball, floor, lamp_of, seed, kind
):
    rng = np.random.default_rng(seed)
    lamp = lamp_of(kind, rng)
    places = np.stack([np.linspace(-1, 1, 5), rng.uniform(-1, 1, 5), rng.uniform(1.4, 2.4, 5)], axis=1)  # beside one another
    spheres = make_spheres(places, rng.uniform(0.05, 0.24, 5))
    round_mesh = ball(12)
    lifted = type(round_mesh)(
        round_mesh.vertices * 0.5 + (0.3, 0.2, 0.6), round_mesh.triangles, round_mesh.materials, round_mesh.corner_normals
    )
    picture = outlined(make_lit(above(rng), (floor, None), (spheres, None), (lifted, None), lamps=(lamp,)))
    check_none_is_missed(picture, lamp, of_at_least=0, at_ends=0.01)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_shadows_of_a_comb_are_not_missed(outlined, make_lit, make_mesh, floor, lamp_of, seed):
    rng = np.random.default_rng(seed)
    lamp, left = lamp_of("sun", rng), np.arange(-0.8, 0.8, 0.1)
    teeth = np.array([[(x, 0, 0.2), (x + 0.05, 0, 0.2), (x + 0.03, rng.uniform(-0.3, 0.3), 1)] for x in left])
    comb = make_mesh(teeth, np.arange(3 * len(teeth)))
    check_none_is_missed(outlined(make_lit(above(rng), (floor, None), (comb, None), lamps=(lamp,))), lamp, at_ends=0.01)


@given(SEEDS, st.sampled_from([20.0, 1e3]))
@settings(max_examples=10, deadline=None)
def test_shadows_are_not_missed_through_a_long_lens(outlined, make_lit, make_wire, floor, lamp_of, seed, zoom):
    rng = np.random.default_rng(seed)
    camera, lamp = above(rng, zoom), lamp_of("sun", rng)
    centre = np.array(camera.look_at) * (1, 1, 0) + 0.5 * np.array(lamp.towards)  # whose shadow falls to what is looked at
    way = rng.normal(size=3)
    picture = outlined(
        make_lit(camera, (floor, None), (make_wire(centre - way, centre + way, 2 / 40 / zoom), None), lamps=(lamp,))
    )
    check_none_is_missed(picture, lamp, of_at_least=0)


def test_a_surface_without_shadow_is_seen_through_by_light(outlined, make_lit, make_wire, make_mesh, floor):
    """A pane that casts no shadow gets that of the wire, and so does the floor below it."""
    camera, lamp = Pinhole((3, -3, 4), (0, 0, 0.2), (0, 0, 1), 40, 40, 24), Sun("lamp", towards=(0.3, 0.2, 1))
    pane = make_mesh([(-0.3, -1, 0.5), (0.3, -1, 0.5), (0.3, 1, 0.5), (-0.3, 1, 0.5)], QUADS)
    scene = make_lit(camera, (floor, None), (pane, None), (make_wire((-1, 0, 1), (1, 0.1, 1), 0.05), None), lamps=(lamp,))
    see_through = replace(scene.objects[1], hidden_from=frozenset({"shadow"}))
    scene = replace(scene, objects=(scene.objects[0], see_through, scene.objects[2]))
    check_none_is_missed(outlined(scene), lamp, of_at_least=10)


def test_lamps_with_a_size_dark_ones_and_such_as_light_nothing_mark_nothing(outlined, make_lit, ball, floor):
    camera = Pinhole((3, -3, 4), (0, 0, 0.2), (0, 0, 1), 40, 40, 24)
    dull = (
        Sun("wide", angle=0.1),
        Sun("dark", irradiance=(0, 0, 0)),
        Point("ball", position=(0, 0, 5), radius=0.2),
        Sun("for mirrors", hidden_from={"diffuse"}),
    )
    assert not outlined(make_lit(camera, (floor, None), (ball(5), None), lamps=dull)).shaded().any()
    assert outlined(make_lit(camera, (floor, None), (ball(5), None), lamps=(Sun("sharp"),))).shaded().any()


def test_outlines_that_cast_no_shadow_are_found_missing(outlined, make_lit, make_wire, floor, monkeypatch):
    camera, lamp = Pinhole((3, -3, 4), (0, 0, 0.2), (0, 0, 1), 40, 40, 24), Sun("lamp", towards=(0.3, 0.2, 1))
    wire = make_wire((-1, 0, 1), (1, 0.1, 1), 0.05)
    picture = outlined(make_lit(camera, (floor, None), (wire, None), lamps=(lamp,)))
    check_none_is_missed(picture, lamp)
    all_edges = ShadowOutlines._edges
    monkeypatch.setattr(ShadowOutlines, "_edges", lambda self, light: all_edges(self, light)[::2])
    with pytest.raises(AssertionError, match="are missed"):
        check_none_is_missed(picture, lamp)
