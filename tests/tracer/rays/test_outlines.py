"""Every pixel that a visible outline crosses is marked: against brute force, 256 rays a pixel.

A pixel holds an outline, says brute force, if two rays beside one another in it show two things, one clearly behind the other.
That is stricter than what is promised: rays lie a sixteenth of a pixel apart, and see no outline that is shorter.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.light.lamps import Lamps
from viewcam_addon.tracer.rays.joints import Joints
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun

SEEDS = st.integers(0, 10**6)
QUADS = [(0, 1, 2), (0, 2, 3)]


def check_none_is_missed(picture, of_at_least: int = 1, **how) -> None:
    crossed, marked = picture.crossed(**how), picture.marked()
    missed = np.argwhere(crossed & ~marked)
    text = f"of {crossed.sum()} pixels with outlines, while {marked.mean():.0%} of all are marked"
    assert not len(missed), f"{len(missed)} {text}, are missed, as in (row, column) {missed[:3].tolist()}"
    assert crossed.sum() >= of_at_least, f"too few tell nothing: {text}"


@pytest.fixture(scope="module")
def wires(make_wire, make_mesh, make_scene, some_camera):
    """wires(seed, thin, zoom) → Scene of wires so many pixels thin, before a wall."""

    def build(seed: int, thin: float, zoom: float | None = None, count: int = 12):
        rng, camera = np.random.default_rng(seed), some_camera(seed, zoom=zoom)
        eye, reach = np.array(camera.eye), 1.5 / max(camera.distance[0] / camera.width, 1)
        things = []
        for _ in range(count):
            start, end = rng.uniform(-reach, reach, (2, 3)) + camera.look_at
            depth = np.linalg.norm((start + end) / 2 - eye)
            things.append(make_wire(start, end, thin * depth / camera.distance[0]))
        wall = 12 * rng.normal(size=(3, 3)) - 6 * eye
        return make_scene(camera, *things, make_mesh(wall, [(0, 1, 2)]))

    return build


@given(SEEDS, st.floats(0.01, 1))
@settings(max_examples=12, deadline=None)
def test_no_wire_is_missed_however_thin_and_at_whatever_angle(outlined, wires, seed, thin):
    check_none_is_missed(outlined(wires(seed, thin)), of_at_least=0)


@given(SEEDS, st.sampled_from([0.05, 0.1, 20.0, 1e3, 1e5]), st.floats(0.05, 1))
@settings(max_examples=12, deadline=None)
def test_no_wire_is_missed_with_extreme_lenses(outlined, wires, seed, zoom, thin):
    check_none_is_missed(outlined(wires(seed, thin, zoom)), of_at_least=0)


@given(SEEDS, st.sampled_from([1e-5, 1e-2, 1e3, 1e6]))
@settings(max_examples=12, deadline=None)
def test_the_size_of_the_world_does_not_matter(outlined, make_scene, ball, make_wire, some_camera, seed, size):
    camera, rng = some_camera(seed), np.random.default_rng(seed)
    camera = Pinhole(
        tuple(size * x for x in camera.eye), tuple(size * x for x in camera.look_at), camera.up, camera.distance, 40, 24
    )
    matrix = np.diag([size, size, size, 1.0])
    ends = [[(x, -1, z), (x, 1, -z)] for x, z in zip((-1.5, -1.3, -1.1, 1.1, 1.3), rng.uniform(-1, 1, 5), strict=True)]
    wires = [(make_wire(*some, 0.02), matrix) for some in ends]  # beside the ball and one another
    check_none_is_missed(outlined(make_scene(camera, (ball(7), matrix), *wires)), of_at_least=0)


@given(SEEDS, st.floats(0.02, 3))
@settings(max_examples=3, deadline=None)
def test_none_of_ten_thousand_small_spheres_is_missed(outlined, make_scene, make_spheres, make_mesh, some_camera, seed, pixels):
    camera, rng = some_camera(seed, 80, 50), np.random.default_rng(seed)
    centres = rng.uniform(-2, 2, (10000, 3))
    depths = np.linalg.norm(centres - camera.eye, axis=1)
    wall = make_mesh(np.array([(-9, -9, 0), (9, -9, 0), (0, 9, 0)]) - 3 * np.array(camera.eye), [(0, 1, 2)])
    # At most so large that some gaps are left.
    radii = np.minimum(pixels * depths / camera.distance[0] / 2, 0.1)
    check_none_is_missed(outlined(make_scene(camera, make_spheres(centres, radii), wall)), fine=8)


@given(SEEDS, st.floats(0.1, 0.7))
@settings(max_examples=10, deadline=None)
def test_what_is_seen_through_slits_between_round_things_is_not_missed(outlined, make_scene, make_spheres, seed, slit):
    """Each centre round a slit shows what lies before the outlines on both of its sides."""
    rng = np.random.default_rng(seed)
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 500, 40, 24, tuple(rng.uniform(10, 14, 2)))
    away, radius, angle = 10.0, 3.0, rng.uniform(0, np.pi)
    aside = np.arcsin(radius / away) + np.arctan(slit / 2 / 500)
    centres = [
        away * np.array([side * np.cos(angle) * np.sin(aside), side * np.sin(angle) * np.sin(aside), -np.cos(aside)])
        for side in (-1, 1)
    ]
    check_none_is_missed(
        outlined(make_scene(camera, make_spheres(centres, radius), make_spheres([(0, 0, -30)], 9))), of_at_least=10
    )


@given(SEEDS, st.floats(0.05, 1.5))
@settings(max_examples=10, deadline=None)
def test_no_tooth_of_a_comb_and_no_gap_is_missed(outlined, make_scene, make_mesh, some_camera, seed, width):
    rng, camera = np.random.default_rng(seed), some_camera(seed)
    pixel = np.linalg.norm(camera.eye) / camera.distance[0]
    left = np.arange(-0.8, 0.8, 2 * width * pixel)[:2000]
    teeth = np.array([[(x, 0, -1), (x + width * pixel, 0, -1), (x + width * pixel / 2, 0, 1)] for x in left])
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    wall = make_mesh(np.array([(-9, -9, 0), (9, -9, 0), (0, 9, 0)]) - 3 * np.array(camera.eye), [(0, 1, 2)])
    comb = make_mesh(teeth, np.arange(3 * len(teeth)))
    check_none_is_missed(outlined(make_scene(camera, (comb, matrix), wall)), of_at_least=0)


@given(SEEDS)
@settings(max_examples=12, deadline=None)
def test_nothing_is_missed_of_scenes_of_all_kinds_but_where_things_penetrate_one_another(outlined, random_scene, seed):
    """Where what penetrates ends another outline, that one's middle may be hidden: of 29,374 pixels 6 were missed."""
    picture = outlined(random_scene(seed, 40, 24))
    things = picture.things()
    soup = np.flatnonzero(things == 3)  # of the fourth object, the soup, each triangle is a thing
    things[soup] = 10**6 + soup
    crossed, marked = picture.crossed(things), picture.marked()
    assert (crossed & ~marked).sum() <= 1, f"{(crossed & ~marked).sum()} of {crossed.sum()} pixels are missed"


@given(SEEDS, st.floats(0.05, 0.95), st.floats(0.05, 0.95))
@settings(max_examples=12, deadline=None)
def test_what_clip_planes_cut_is_not_missed(outlined, make_scene, ball, make_spheres, make_wire, seed, near, far):
    rng = np.random.default_rng(seed)
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 30, 40, 24, tuple(rng.uniform(8, 16, 2)))
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    matrix[:3, 3] = -1.2, 0, -3
    things = make_spheres([(1.2, 0.5, -3)], 1), make_wire((0.1, -2, -1), (0.1, 2, -5), 0.3), make_spheres([(0, 0, -60)], 9)
    cut = 2 + 2 * near, 50.0
    check_none_is_missed(outlined(make_scene(camera, (ball(6), matrix), *things, clip=cut)), of_at_least=0)
    check_none_is_missed(outlined(make_scene(camera, (ball(6), matrix), *things[:2], clip=(0.1, 2 + 2 * far))), of_at_least=0)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_folds_of_one_smooth_mesh_are_not_missed(outlined, make_scene, make_mesh, some_camera, seed):
    """A ring, whose far side shows through its hole: things are its patches, which are far apart where one hides another."""
    around, across = np.meshgrid(np.arange(48) * (2 * np.pi / 48), np.arange(24) * (2 * np.pi / 24), indexing="ij")
    radius = 1 + 0.5 * np.cos(across)
    vertices = np.stack([radius * np.cos(around), radius * np.sin(around), 0.5 * np.sin(across)], axis=-1).reshape(-1, 3)
    number = np.arange(48 * 24).reshape(48, 24)
    first, second = number, np.roll(number, -1, axis=0)
    corners = [first, second, np.roll(second, -1, axis=1), np.roll(first, -1, axis=1)]
    faces = np.concatenate([np.stack([corners[a].ravel() for a in face], axis=1) for face in QUADS])
    normals = np.stack([np.cos(across) * np.cos(around), np.cos(across) * np.sin(around), np.sin(across)], axis=-1)
    picture = outlined(make_scene(some_camera(seed), make_mesh(vertices, faces, corner_normals=normals.reshape(-1, 3)[faces])))
    check_none_is_missed(picture, of_at_least=0, thing_of=np.arange(len(faces)))


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_creases_and_changes_of_material_are_not_missed(outlined, make_scene, make_mesh, some_camera, seed):
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    box = make_mesh(corners, [[side[corner] for corner in face] for side in sides for face in QUADS])
    picture = outlined(make_scene(some_camera(seed), box))
    check_none_is_missed(picture, of_at_least=0, thing_of=np.repeat(np.arange(6), 2), clearly=-1)
    crossed = picture.crossed(np.repeat(np.arange(6), 2), clearly=-1)
    # Diagonals of sides are no creases, and what is behind is not marked.
    assert picture.marked().sum() < 4 * max(crossed.sum(), 30)


def test_what_is_hidden_is_not_marked(outlined, make_scene, make_mesh, make_spheres, ball):
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 40, 40, 24)
    wall = make_mesh([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], QUADS)
    behind = np.eye(4)
    behind[2, 3] = -3
    spheres = make_spheres(np.random.default_rng(0).uniform(-1, 1, (200, 3)), 0.1)
    picture = outlined(make_scene(camera, wall, (ball(8), behind), (spheres, behind)))
    for known in (False, True):
        assert not picture.marked(known).any(), "behind the wall"
    without = outlined(make_scene(camera, (ball(8), behind), (spheres, behind)))
    assert without.marked().any()


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_bands_of_rows_and_what_the_centres_show_change_nothing(outlined, random_scene, seed):
    picture = outlined(random_scene(seed, 40, 24))
    *_, found, depth = picture.rays(1)
    whole, unknown = picture.outlines.seen(depth, found), picture.outlines.seen(depth)
    parts = [picture.outlines.seen(depth[rows], found[rows], rows.start) for rows in (slice(0, 7), slice(7, 24))]
    # A place on the border of pixels may be rounded to either.
    differ = (np.concatenate(parts) != whole).sum() + (whole != unknown).sum()
    assert differ <= 1, f"{differ} of {whole.size} pixels"


def met_by_eye(picture, lamps, fine):
    """(3, height · fine, width · fine) what rays see of lamps."""
    x, y, _, depth = picture.rays(fine)
    directions = np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    length = np.linalg.norm(directions, axis=0)
    directions /= length
    table, farthest = Lamps(lamps, picture.view), np.where(depth.ravel() < 1e10, depth.ravel() * length, np.inf)
    light = table.met(np.zeros((3, 1)), directions, 0.0, farthest)
    light[:, np.isinf(farthest)] += table.suns_met(directions[:, np.isinf(farthest)])
    return light.reshape(3, *x.shape)


@given(SEEDS)
@settings(max_examples=10, deadline=None)
def test_outlines_of_lamps_that_the_eye_sees_are_not_missed(outlined, make_lit, make_wire, random_matrix, some_camera, seed):
    rng, camera = np.random.default_rng(seed), some_camera(seed, zoom=0.8)

    def place():
        return random_matrix(rng, 0.8)

    lamps = (
        Area("square", matrix=place(), size=(0.6, 0.3)),
        Area("disc", matrix=place(), size=(0.6, 0.9), ellipse=True),
        Point("ball", position=tuple(rng.uniform(-1, 1, 3)), radius=0.3),
        Point("soft", position=tuple(rng.uniform(-1, 1, 3)), radius=0.2, soft_falloff=True),
        Spot("spot", matrix=place(), radius=0.5, angle=2.0, blend=0.0),
        Sun("sun", towards=tuple(-np.array(camera.eye) + rng.uniform(-1, 1, 3)), angle=0.1),
    )
    before = 0.7 * np.array(camera.eye)
    picture = outlined(make_lit(camera, (make_wire(before - rng.normal(size=3), before, 0.02), None), lamps=lamps))
    light = met_by_eye(picture, lamps, 16)
    leaps = picture.pixels_with_leaps((light / light.max()).sum(axis=0).round(6), 16)
    missed = leaps & ~picture.marked()
    assert not missed.any(), f"{missed.sum()} of {leaps.sum()} pixels with outlines of lamps"


class WithoutBorders(Joints):
    def __init__(self, *args) -> None:
        super().__init__(*args)
        self.borders = self.borders[:0]


class OfHalfThePairs(Joints):
    def __init__(self, *args) -> None:
        super().__init__(*args)
        half = slice(0, self.pairs.shape[1] // 2)
        self.pairs, self.twisted, self.creases = self.pairs[:, half], self.twisted[half], self.creases[:0]


@pytest.mark.parametrize("wrong", [WithoutBorders, OfHalfThePairs])
def test_edges_that_are_left_out_are_found_missing(outlined, make_scene, make_mesh, ball, wires, wrong):
    scene = wires(5, 0.3, 1.0)
    picture = outlined(make_scene(scene.camera, *scene.geometries.values(), make_mesh(np.eye(3), [(0, 1, 2)])))
    check_none_is_missed(picture)
    picture.outlines.joints = wrong(picture.triangles, 1e-3)
    with pytest.raises(AssertionError, match="are missed"):
        check_none_is_missed(picture)


def test_spheres_that_are_left_out_are_found_missing(outlined, make_scene, make_spheres, some_camera, monkeypatch):
    picture = outlined(make_scene(some_camera(1, zoom=2), make_spheres(np.eye(3), 0.6)))
    check_none_is_missed(picture)
    of_spheres = picture.outlines._of_spheres

    def some(canvas):
        strokes = of_spheres(canvas)
        half = slice(0, strokes.starts.shape[1] // 2)
        return type(strokes)(strokes.starts[:, half], strokes.ends[:, half], strokes.within[:, half], strokes.nearest[half])

    monkeypatch.setattr(picture.outlines, "_of_spheres", some)
    with pytest.raises(AssertionError, match="are missed"):
        check_none_is_missed(picture)


def test_without_embree_the_same_is_marked(outlined, random_scene, without_embree, monkeypatch):
    scene = random_scene(3, 24, 14)
    marked = outlined(scene).marked()
    without_embree(monkeypatch)
    differ = (outlined(scene).marked() != marked).sum()
    # Embree is asked beside outlines by twice what it errs by.
    assert differ <= 1, f"{differ} of {marked.size} pixels"
