"""Floors in one place and leaves of a pixel, in one place too: any of them is a right answer, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import ENLARGEMENT, SLOPES, Tracer
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres

pytestmark = pytest.mark.slow

# The shift of each ray of the renderer on paper, in roundings: as in conftest.py.
ROUNDINGS_OF_A_RENDERER = 0.35
CAMERA = Pinhole((0.3, -4.0, 3.1), (0.1, 0.2, 0.0), (0.0, 0.0, 1.0), 150.0, 120, 80)
HAIR = 3e-4


def square(half, uv_scale=1.0, turned=False, materials=(0,)):
    """A square of two triangles along one of its diagonals, once for each material."""
    vertices = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], float)
    triangles = np.array([(1, 2, 3), (1, 3, 0)] if turned else [(0, 1, 2), (0, 2, 3)], np.int32)
    corners = vertices[triangles]
    return Mesh(
        vertices=vertices,
        triangles=np.tile(triangles, (len(materials), 1)),
        materials=np.repeat(np.array(materials, np.int32), 2),
        corner_uvs=np.tile((corners[..., :2] / half * uv_scale / 2).astype(np.float32), (len(materials), 1, 1)),
    )


def turned_by(seed, count, scale=1.0):
    """(n, 4, 4): places over the floor, turned at random, facing the camera more or less."""
    random = np.random.default_rng(seed)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    for matrix in matrices:
        towards = np.array([0.0, -0.5, 0.8]) + random.normal(0.0, 0.2, 3)
        towards /= np.linalg.norm(towards)
        side = np.cross(towards, random.normal(size=3))
        side /= np.linalg.norm(side)
        matrix[:3, :3] = scale * np.stack([side, np.cross(towards, side), towards], axis=1)
        matrix[:3, 3] = *random.uniform(-1.4, 1.4, 2), random.uniform(0.05, 0.6)
    return matrices


def tilted(matrix, lift=0.0):
    """About x and y, so that no plane is one of float32's own."""
    a, b = 0.21, 0.13
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    placed = np.array(matrix)
    placed[..., :3, :] = about_x @ about_y @ placed[..., :3, :]
    placed[..., :3, 3] += lift * (about_x @ about_y)[:, 2]
    return placed


def a_scene(lift=0.0):
    """Three floors in one place, the second one higher by `lift`; 150 leaves of about a pixel, each in two materials."""
    geometries = {
        "floor": square(2.0),
        "carpet": square(1.9, 3.0),
        "tiles": square(1.8, 2.0, turned=True),
        "leaf": square(0.018, 0.5, materials=(0, 1)),
    }
    leaves = tilted(turned_by(1, 150))
    return Scene(
        CAMERA,
        geometries,
        (
            Object("Floor", "floor", tilted(np.eye(4)), 1, (11,)),
            Object("Carpet", "carpet", tilted(np.eye(4), lift), 2, (12,)),
            Object("Tiles", "tiles", tilted(np.eye(4)), 3, (13,)),
            Object("Leaves", "leaf", leaves, 4, (14, 15)),
        ),
    )


def rendered(tracer, seed=0, off=0.0, within=1e-12):
    """A float32 renderer's picture: each ray beside its place, of surfaces `within` a share of a depth any; all rays `off`."""
    random = np.random.default_rng(seed)
    rows, columns = (places.ravel() for places in np.mgrid[: CAMERA.height, : CAMERA.width])
    shift = tolerances.ray_shift(CAMERA, tracer.surface_at(columns, rows))
    shift[~np.isfinite(shift) | (shift > 1)] = np.median(shift)
    dx, dy = ROUNDINGS_OF_A_RENDERER * shift * random.normal(size=(2, len(shift)))
    rays, _, passes = tracer.surfaces_at(columns, rows, 0.5 + off + dx, 0.5 + dy, within)
    first, counts = np.unique(rays, return_index=True, return_counts=True)[1:]
    chosen = first + random.integers(0, counts)
    size = (CAMERA.height, CAMERA.width, -1)
    names = [name for name in passes if name not in ("Magnitude", "Facing", *SLOPES, ENLARGEMENT)]
    return Image({name: passes[name][chosen].reshape(size) for name in names})


@pytest.fixture(scope="module")
def tracer():
    return Tracer(a_scene(), 1)


@pytest.fixture(scope="module")
def reference(tracer):
    return Image(tracer.render())


def compared(reference, test, tracer):
    return compare(reference, test, CAMERA, tracer.surfaces_at)


def test_any_of_several_surfaces_in_one_place_is_right_and_the_objects_are_named(tracer, reference):
    test = rendered(tracer)
    comparison = compared(reference, test, tracer)
    assert comparison.passed, "\n".join(comparison.lines())
    pairs = comparison.in_one_place.pairs()
    assert set(pairs) == {("Carpet", "Floor"), ("Carpet", "Tiles"), ("Floor", "Tiles"), ("Leaves", "Leaves")}
    another = reference["Material Index"] != test["Material Index"]
    assert sum(pairs.values()) == pytest.approx(another.sum(), abs=0.02 * another.sum())
    assert "pixels show another of several surfaces in one place: " in comparison.sentence
    assert comparison.to_json()["in_one_place"]["pixels"] == len(comparison.in_one_place.columns)
    alone = replace(comparison.in_one_place, **{name: values[:1] for name, values in vars(comparison.in_one_place).items()})
    assert "; 1 pixel shows another of several" in replace(comparison, in_one_place=alone).sentence


def test_a_twin_whose_normals_are_a_little_off_is_told_from_the_one_that_is_seen():
    """A subdivision of doubled faces makes one: any pixel of it would pass by itself, and a tenth of the picture does not."""
    floor = square(2.0)
    scene = a_scene()
    turn = 12 * np.median(
        tolerances.position_shift(CAMERA, Tracer(scene, 1).surface_at(*np.mgrid[50:70, 30:50].reshape(2, -1)))
    )
    normals = [np.tile(np.array([np.sin(angle), 0, np.cos(angle)], np.float32), (2, 3, 1)) for angle in (0.0, turn)]
    geometries = {name: replace(floor, corner_normals=each) for name, each in zip(("floor", "twin"), normals, strict=True)}
    objects = tuple(Object(name, name.lower(), tilted(np.eye(4)), 1) for name in ("Floor", "Twin"))
    tracer = Tracer(replace(scene, geometries=geometries, objects=objects), 1)
    reference = Image(tracer.render())
    comparison = compared(reference, rendered(tracer), tracer)
    assert comparison.passed, "\n".join(comparison.lines())
    assert {*comparison.in_one_place.pairs()} == {("Floor", "Twin")}
    assert not len(compared(reference, reference, tracer).in_one_place.columns)
    turned = replace(reference, passes={**reference.passes, "Normal": reference["Normal"] + np.float32([2 * turn, 0, 0])})
    assert not compared(reference, turned, tracer).passed


def test_leaves_of_a_pixel_are_seen(reference):
    """Else the other tests prove nothing of them."""
    on_leaves = reference["Object Index"][..., 0] == 4
    alone = tolerances.at_borders(np.where(on_leaves, 4, -1))
    assert alone.sum() > 0.5 * on_leaves.sum() > 60


def test_nothing_is_explained_without_the_scene(tracer, reference):
    assert not compare(reference, rendered(tracer), CAMERA).passed


def harmed(test, name, where, change):
    passes = {**test.passes, name: test[name].copy()}
    passes[name][where] = change(passes[name][where])
    return replace(test, passes=passes)


def floors(test):
    return np.isin(test["Object Index"][..., 0], (1, 2, 3))


def leaves(test):
    return test["Object Index"][..., 0] == 4


def mixed_up(test):
    """The carpet's index with the floor's material, UV and normal, in one pixel."""
    rows, columns = np.nonzero(test["Material Index"][..., 0] == 11)
    return harmed(test, "Object Index", (rows[len(rows) // 2], columns[len(rows) // 2]), lambda _: 2.0)


def one_of(where):
    def of(test):
        rows, columns = np.nonzero(where(test))
        return rows[len(rows) // 2], columns[len(rows) // 2]

    return of


def through_another_camera():
    """The picture of a marker's camera that stands a hundredth of a unit aside."""
    return rendered(Tracer(replace(a_scene(), camera=replace(CAMERA, eye=(0.31, -4.0, 3.1))), 1))


FAULTS = {
    "the camera of another marker": lambda _, test: through_another_camera(),
    "all rays off by 1e-3 px": lambda tracer, test: rendered(tracer, off=1e-3),
    "an index that is not there, on a floor": lambda _, test: harmed(test, "Object Index", one_of(floors)(test), lambda _: 4.0),
    "an index that is not there, on a leaf": lambda _, test: harmed(test, "Object Index", one_of(leaves)(test), lambda _: 1.0),
    "one floor's index with another's material": lambda _, test: mixed_up(test),
    "a normal flipped on a floor": lambda _, test: harmed(test, "Normal", one_of(floors)(test), lambda n: -n),
    "a normal flipped on a leaf": lambda _, test: harmed(test, "Normal", one_of(leaves)(test), lambda n: -n),
    "a UV off by 1e-4 on a floor": lambda _, test: harmed(test, "UV", one_of(floors)(test), lambda uv: uv + np.float32(1e-4)),
    "the leaves' UV off by 1e-4": lambda _, test: harmed(test, "UV", leaves(test), lambda uv: uv + np.float32(1e-4)),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_sabotage_is_found_amid_surfaces_in_one_place(tracer, reference, fault):
    test = FAULTS[fault](tracer, rendered(tracer))
    comparison = compared(reference, test, tracer)
    assert not comparison.passed, f"{fault} was not found:\n" + "\n".join(comparison.lines())


WRONG_NORMALS = {
    "flipped": lambda n: -n,
    "of other axes": lambda n: n[..., [1, 2, 0]],
    "turned by 5°": lambda n: n + np.float32(0.0873) * np.cross(n, np.float32([0.6, 0.0, 0.8])).astype(np.float32),
}


@pytest.mark.parametrize("fault", WRONG_NORMALS)
def test_each_wrong_normal_amid_thousands_of_spheres_of_a_pixel_is_found(fault):
    random = np.random.default_rng(4)
    count, scene = 4000, a_scene()
    centers = random.uniform((-1.6, -1.6, 0.02), (1.6, 1.6, 0.8), (count, 3))
    balls = Spheres(centers, random.uniform(0.004, 0.02, count), np.zeros(count, np.int32))
    objects = (*scene.objects, Object("Balls", "balls", np.eye(4), 5, (16,)))
    tracer = Tracer(replace(scene, geometries={**scene.geometries, "balls": balls}, objects=objects), 1)
    reference, test = Image(tracer.render()), rendered(tracer)
    assert compared(reference, test, tracer).passed
    is_ball = (test["Object Index"][..., 0] == 5) & (reference["Object Index"][..., 0] == 5)
    facing = tolerances.facing(CAMERA, reference.passes)
    rows, columns = np.nonzero(is_ball & (facing > 0.2))  # less is within the tolerance of the rim, where any normal is right
    chosen = random.choice(len(rows), 40, replace=False)
    comparison = compared(reference, harmed(test, "Normal", (rows[chosen], columns[chosen]), WRONG_NORMALS[fault]), tracer)
    mismatches = comparison.mismatches
    unexplained = {*zip(mismatches.rows[~mismatches.explained], mismatches.columns[~mismatches.explained], strict=True)}
    assert unexplained == {*zip(rows[chosen], columns[chosen], strict=True)}, "\n".join(comparison.lines())


@pytest.mark.parametrize("lift", [HAIR, -HAIR])
def test_a_twin_that_is_moved_by_a_hair_is_found(tracer, reference, lift):
    """In the picture alone, where it lies above or has vanished below; and in the scene alone, where it is not seen."""
    moved = Tracer(a_scene(lift), 1)
    of_moved = Image(moved.render())
    assert compared(of_moved, rendered(moved), moved).passed
    assert not compared(of_moved, rendered(tracer), moved).passed, "the scene's carpet is moved, the picture's is not"
    if lift > 0:
        assert not compared(reference, rendered(moved), tracer).passed, "the picture's carpet is moved, the scene's is not"


def test_a_hair_is_beyond_tolerance_and_a_hundredth_of_it_within(tracer, reference):
    """A renderer may see either of two surfaces that are a hundredth of it apart, and not of two that are one apart."""
    for lift, passes in (HAIR / 100, True), (HAIR, False):
        moved = Tracer(a_scene(lift), 1)
        assert compared(Image(moved.render()), rendered(moved, within=lift), moved).passed == passes
    hit = reference["Depth"][..., 0] < 1e10
    seen = {name: values[hit] for name, values in reference.passes.items()}
    allowed = tolerances.ROUNDINGS[-1] * tolerances.depth_error(CAMERA, seen) * seen["Depth"][:, 0]
    assert HAIR / 100 < np.median(allowed) < HAIR / 2


@pytest.mark.parametrize(
    ("turned", "stretched", "passes"), [(0.95, 1.0, True), (2.0, 1.0, False), (0.95, 9.0, True), (2.0, 9.0, False)]
)
def test_stored_normals_are_off_by_more_between_corners_that_diverge_and_under_a_scale(turned, stretched, passes):
    """Corners lean outwards by 75°: amid them their sum is cos 75° = 0.26 long, and what each is off is divided by it. Under a
    scale along that sum it is a ninth as long beside them.
    """

    def of_a_square(off):
        mesh = square(2.0)
        out = np.sign(mesh.vertices[mesh.triangles][..., :2]) * np.sin(np.radians(75.0)) / np.sqrt(2.0)
        normals = np.concatenate([out, np.full((2, 3, 1), np.cos(np.radians(75.0)))], axis=-1)
        across = np.array([1.0, -1.0, 0.0]) - normals * (normals[..., :1] - normals[..., 1:2])
        normals += off * across / np.linalg.norm(across, axis=-1, keepdims=True)
        mesh = replace(mesh, corner_normals=normals.astype(np.float32))
        return Tracer(Scene(CAMERA, {"square": mesh}, (Object("Square", "square", placed, 1),)), 1)

    placed = tilted(np.diag([1.0, 1.0, stretched, 1.0]))
    tracer, test = of_a_square(0.0), Image(of_a_square(turned * tolerances.NORMAL_STORAGE).render())
    comparison = compared(Image(tracer.render()), test, tracer)
    assert comparison.passed == passes, "\n".join(comparison.lines())
    assert comparison.passed or "Normal is" in comparison.sentence
