"""Whole pictures: where things appear, what no thread, tile or place in the world may change, and how much memory they take."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import render as render_module
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.render import PASSES, Keeper, Tracer, render
from viewcam_addon.tracer.scene import Mesh, Object, Scene, same, same_things
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Point, Sun
from viewcam_addon.tracer.scene.materials import Color, sum_of

SEEDS = st.integers(0, 2**32 - 1)
FLOAT32 = 2.0**-24


def assert_same(first, second):
    assert first.keys() == second.keys() == PASSES.keys()
    for name in first:
        differ = (first[name] != second[name]).any(axis=-1).sum()
        assert differ == 0, f"{name} differs in {differ} pixels"


@settings(max_examples=5)
@given(seed=SEEDS)
def test_pictures_are_the_same_bit_for_bit_for_any_number_of_threads_and_any_tile(random_scene, seed):
    scene = random_scene(seed, width=201, height=160)
    reference = render(scene, threads=1)
    for threads in (2, 3, 7):
        assert_same(reference, render(scene, threads=threads))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(render_module, "BAND", 7)
        assert_same(reference, render(scene, threads=2))


@settings(max_examples=5)
@given(seed=SEEDS)
def test_single_samples_at_pixel_centers_are_the_picture(random_scene, seed):
    scene = random_scene(seed)
    tracer = Tracer(scene)
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    picture = tracer.render()
    samples = tracer.surface_at(columns.ravel(), rows.ravel())
    assert_same({name: values.reshape(-1, values.shape[-1]) for name, values in picture.items()}, samples)
    shifted = tracer.surface_at(columns.ravel(), rows.ravel(), 0.9, 0.1)
    assert (shifted["Depth"] != samples["Depth"]).any(), "a sample elsewhere in the pixel sees something else"


@settings(max_examples=10)
@given(seed=SEEDS)
def test_positions_appear_at_their_pixels_center_and_at_their_depth(random_scene, seed):
    scene = random_scene(seed)
    camera, passes = scene.camera, render(scene)
    hit = passes["Depth"][..., 0] < image.BACKGROUND_DEPTH
    rows, columns = np.nonzero(hit)
    position = passes["Position"][hit].astype(float)
    column, row, depth = camera.project(position)
    # The position is rounded once to float32, in each of three coordinates.
    rounding = FLOAT32 * np.sqrt(3) * np.abs(position).max(axis=1, initial=0)
    allowed = (
        rounding
        / depth
        * max(camera.distance)
        * (
            1
            + np.hypot(
                *((np.array([column, row]) - np.array(camera.principal_point)[:, None]) / np.array(camera.distance)[:, None])
            )
        )
    )
    off = np.hypot(column - columns - 0.5, row - rows - 0.5)
    assert (off <= allowed + 1e-9).all(), f"{(off - allowed).max():.1e} px more than the rounding of the position explains"
    assert (np.abs(depth - passes["Depth"][hit][:, 0]) <= rounding + FLOAT32 * depth).all()


def test_rows_count_from_the_bottom_and_columns_from_the_left(make_scene, make_spheres):
    camera = Pinhole((0, -10, 0), (0, 0, 0), (0, 0, 1), 100, 60, 40)
    scene = make_scene(camera, make_spheres([[2, 0, 0]], 0.3), make_spheres([[0, 0, 1]], 0.3))
    index = render(scene)["Object Index"][..., 0]
    assert index[20, 50] == 1 and index[30, 30] == 2, "x = 2 is 20 px right of the center, z = 1 is 10 px above it"
    mirrored = render(replace(scene, camera=replace(camera, mirrored=True)))["Object Index"][..., 0]
    assert np.array_equal(mirrored, index[:, ::-1])


def test_a_cropped_picture_is_a_part_of_the_whole(random_scene):
    scene = random_scene(3)
    whole = render(scene)
    part = render(replace(scene, camera=scene.camera.cropped(17, 5, 40, 30)))
    for name, values in part.items():
        of_whole = whole[name][5:35, 17:57]
        # The principal point moves, and with it the rounding of x and y: indices agree, the rest within a rounding of float32.
        close = np.isclose(values, of_whole, rtol=8 * FLOAT32, atol=8 * FLOAT32).all(axis=-1)
        assert close.mean() > 0.999, f"{name}: {close.mean():.2%} of the pixels agree"


@settings(max_examples=5)
@given(seed=SEEDS)
def test_a_scene_a_million_meters_off_the_origin_shows_the_same_picture(random_scene, seed):
    scene = random_scene(seed)
    # A power of two, and eye, look-at and matrices that stay exact beside it: multiples of 2⁻²⁴.
    far = 2.0**20

    def exact(values):
        return np.round(np.array(values) * 2.0**24) / 2.0**24

    def moved(by):
        camera = replace(scene.camera, eye=tuple(exact(scene.camera.eye) + by), look_at=tuple(exact(scene.camera.look_at) + by))
        objects = []
        for placed in scene.objects:
            matrix = exact(placed.matrix)
            matrix[:3, 3] += by
            objects.append(replace(placed, matrix=matrix))
        return render(replace(scene, camera=camera, objects=tuple(objects)))

    here, there = moved(0.0), moved(far)
    for name in ("Depth", "Normal", "UV", "Object Index", "Material Index", "Facing"):
        assert np.array_equal(here[name], there[name]), name
    assert (there["Magnitude"][here["Depth"] < image.BACKGROUND_DEPTH] >= far - 20).all()


def test_the_magnitude_of_what_is_far_from_its_own_origin_is_that_distance(make_mesh, make_spheres, make_scene):
    """The vertices lie 1e6 away in object space, the object −1e6 in the world: their sum is rounded like the terms."""
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 60, 20)
    square = [[-2, -1, 0], [2, -1, 0], [2, 1, 0], [-2, 1, 0]]
    for make in (
        lambda away: make_mesh(np.add(square, (away, 0, 0)), [[0, 1, 2], [0, 2, 3]]),
        lambda away: make_spheres([(away, 0, 0)], 1),
    ):
        near, far = make_scene(camera, make(0)), make_scene(camera, make(1e6))
        matrix = np.eye(4)
        matrix[0, 3] = -1e6
        far = replace(far, objects=tuple(replace(placed, matrix=matrix) for placed in far.objects))
        near, far = render(near), render(far)
        hit = near["Depth"] < image.BACKGROUND_DEPTH
        assert hit.any() and np.array_equal(near["Depth"], far["Depth"])
        assert (near["Magnitude"][hit] < 100).all() and (np.abs(far["Magnitude"][hit] / 1e6 - 1) < 1e-4).all()


def test_what_shows_nothing_is_written_as_cycles_writes_it(make_scene):
    passes = render(make_scene(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 5, 3)))
    for name, values in passes.items():
        assert values.shape == (3, 5, PASSES[name]) and values.dtype == np.float32
        assert (values == (1e10 if name == "Depth" else 0)).all(), name


def test_objects_and_materials_show_their_indices(make_mesh):
    squares = make_mesh(
        [[-2, -1, 0], [0, -1, 0], [0, 1, 0], [-2, 1, 0], [2, -1, 0], [2, 1, 0]],
        [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]],
        materials=[0, 0, 1, 1],
    )
    camera = Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 100, 60, 20)
    passes = render(Scene(camera, {"squares": squares}, (Object("squares", "squares", np.eye(4), 7, (3, 9)),)))
    assert (passes["Object Index"] == 7)[5, [15, 45]].all()
    assert passes["Material Index"][5, 15] == 3 and passes["Material Index"][5, 45] == 9


def test_memory_beside_the_passes_does_not_grow_with_the_picture(ball, make_scene):
    def beside(width, height):
        camera = Pinhole((0, -4, 1), (0, 0, 0), (0, 0, 1), width, width, height)
        tracer = Tracer(make_scene(camera, ball(24)), threads=1)
        tracemalloc.start()
        passes = tracer.render()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak - sum(values.nbytes for values in passes.values())

    small, large = beside(640, 480), beside(1920, 1080)  # both are cut into tiles of full size
    # Python's own things, of some tiles at a time.
    assert large <= 1e6, f"{large / 1e6:.1f} MB"
    assert large <= 1.5 * small + 1e6, f"{small / 1e6:.1f} MB for the small picture, {large / 1e6:.1f} MB for the large one"


# --- What is seen first: the ends of the clip range, nothing, eyes in spheres, and many spheres, against answers on paper


def objects_seen(scene):
    """(height, width) of a picture: the index of the object seen, 0 where there is none."""
    return Tracer(scene, 2).render()["Object Index"][..., 0].astype(int)


def first_of(scene, x, y):
    """Primitives of the first object and distances, of rays from the eye through (x, y) of the view plane."""
    u, v, w = scene.camera.basis()
    directions = np.stack([x, y, np.ones_like(x)], axis=1) @ np.stack([u, v, -w])
    core = CoreScene(scene, 2)
    depth, objects, primitives = core.closest(core.rays(np.array(scene.camera.eye)[None], directions))
    return np.where(objects == 0, primitives, -1), depth, directions


def centers(scene):
    rows, columns = np.mgrid[: scene.camera.height, : scene.camera.width]
    return scene.camera.view_plane(columns.ravel() + 0.5, rows.ravel() + 0.5)


def test_what_lies_before_the_clip_range_is_looked_through_and_what_lies_behind_it_is_not_seen(
    make_scene, make_spheres, make_mesh
):
    def wall(depth):
        return make_mesh([[-9, -9, -depth], [9, -9, -depth], [0, 20, -depth]], [[0, 1, 2]])

    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 4, 4)
    bodies = (wall(1), make_spheres([[0, 0, -3]], 0.5), wall(5))  # objects 1, 2 and 3
    for clip, seen in (
        ((0, 100), 1),
        ((2, 100), 2),
        ((2.6, 100), 3),  # the sphere's near side is clipped, and its far side is never seen
        ((2, 2.4), 0),
        ((4, 5), 3),
        ((0, 0.9), 0),
    ):
        rendered = objects_seen(make_scene(camera, *bodies, clip=clip))[2, 2]
        assert rendered == seen, f"clip {clip}: object {rendered} instead of {seen}"


def test_scenes_and_meshes_that_are_empty_or_degenerate_show_nothing(make_scene, make_mesh, make_spheres):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 8)
    flat = np.diag([1.0, 1.0, 0.0, 1.0])
    flat[2, 3] = -2
    for bodies in (
        (),
        (make_mesh([], []),),
        (make_spheres([], []),),
        (make_mesh([[0, 0, -1]], [[0, 0, 0]]),),
        (make_mesh([[-1, 0, -1], [0, 0, -1], [1, 0, -1]], [[0, 1, 2]]),),  # a line
        (make_mesh([[0, -1, -1], [0, 1, -1], [0, 0, -3]], [[0, 1, 2]]),),  # its plane holds the eye
        (make_spheres([[0, 0, -2]], 0.0),),
        ((make_spheres([[0, 0, 0]], 1.0), flat),),  # a sphere that its matrix flattens
    ):
        scene = make_scene(camera, *bodies)
        assert not objects_seen(scene).any(), f"{bodies}: {np.unique(objects_seen(scene))}"


def test_an_eye_inside_a_sphere_sees_through_it_and_one_just_outside_sees_it(make_scene, make_spheres):
    camera = Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 1, 1)
    around, beyond = [0, 0, -0.5], [0, 0, -4]
    for radius, seen in ((0.5 + 1e-12, 2), (0.5 - 1e-12, 1)):
        rendered = objects_seen(make_scene(camera, make_spheres([around], radius), make_spheres([beyond], 1.0)))[0, 0]
        assert rendered == seen, f"radius {radius}: object {rendered}"


def depths_by_testing_each(scene, spheres, directions):
    """The oracle: the nearest sphere's distance by the textbook's quadratic about the foot, inf where there is none."""
    relative = spheres.centers - np.array(scene.camera.eye)
    best = np.full(len(directions), np.inf)
    for ray, direction in enumerate(directions):
        foot = relative @ direction / (direction @ direction)
        beside = relative - foot[:, None] * direction
        half = (spheres.radii**2 - np.einsum("ij,ij->i", beside, beside)) / (direction @ direction)
        depth = np.where((half >= 0) & (foot > 0), foot - np.sqrt(np.maximum(half, 0)), np.inf)
        best[ray] = depth[depth > 0].min(initial=np.inf)
    return best


@pytest.mark.exhaustive
@pytest.mark.parametrize("radius", [0.003, 0.03, 0.15])
def test_a_hundred_thousand_spheres_are_told_apart_as_by_testing_each(make_scene, make_spheres, radius):
    rng = np.random.default_rng(1)
    spheres = make_spheres(rng.uniform(-2, 2, (100_000, 3)), rng.uniform(0.5, 1.5, 100_000) * radius)
    for eye in ((0, -7, 1), (0.3, 0.1, 0.2)):  # before the cloud, and in it, where many spheres reach behind the eye
        scene = make_scene(Pinhole(eye, (0, 1, 0), (0, 0, 1), 80, 100, 100), spheres)
        number, traced, directions = first_of(scene, *rng.uniform(-0.6, 0.6, (2, 120)))
        depth = depths_by_testing_each(scene, spheres, directions)
        hits = np.isfinite(depth)
        assert hits.any() and np.array_equal(number >= 0, hits), "other rays hit than by testing each sphere"
        # Both in float64, by different formulas: the root of a discriminant as small as 1e-6 keeps ten digits.
        worst = np.abs(traced[hits] / depth[hits] - 1).max()
        assert worst < 1e-9, f"another sphere is nearer than the one that was found: depths differ by {worst:.1e}"


def test_spheres_that_touch_one_depth_overlap_or_coincide_are_all_found(make_scene, make_spheres):
    """The cases in which a ray that continues behind a box would step over the next one."""
    side = np.linspace(-1, 1, 41)
    grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    lattice = np.column_stack([grid, np.full(len(grid), -3.0)])
    nested = np.repeat([[0.0, 0.0, -2.0]], 50, axis=0)
    for name, spheres in {
        "equal spheres side by side at one depth, overlapping": make_spheres(lattice, 0.04),
        "fifty spheres of one center, each larger by 1e-9": make_spheres(nested, 0.3 * (1 + 1e-9 * np.arange(50))),
    }.items():
        scene = make_scene(Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 100, 60, 60), spheres)
        number, traced, directions = first_of(scene, *centers(scene))
        depth = depths_by_testing_each(scene, spheres, directions)
        hits = np.isfinite(depth)
        assert hits.any() and np.array_equal(number >= 0, hits), name
        worst = np.abs(traced[hits] / depth[hits] - 1).max()
        # A sphere that was stepped over would show one that lies behind it by 2e-10 at least.
        assert worst < 1e-11, f"{name}: depths differ by {worst:.1e}"


# --- Structures kept from frame to frame: the pictures of fresh ones, and nothing kept that has changed


WIDTH, HEIGHT = 96, 64
GREEN, RED = sum_of(diffuse=Color((0.1, 0.8, 0.2))), sum_of(diffuse=Color((0.9, 0.1, 0.1)))
GROUND = np.array([[-300, -300, -1.2], [300, -300, -1.2], [300, 300, -1.2], [-300, 300, -1.2]], float)


def camera(turn=0.0, distance=90.0, **changes):
    eye = (6 * np.sin(turn), -6 * np.cos(turn), 2.0 + turn)
    return Pinhole(eye, (0, 0, 0), (0, 0, 1), **({"distance": distance, "width": WIDTH, "height": HEIGHT} | changes))


@pytest.fixture
def scene(make_lit, make_mesh, make_spheres, ball):
    """A ball, a soup that shadow rays don't see, a wide ground and some spheres, under a sun and a lamp."""
    rng = np.random.default_rng(1)
    soup = make_mesh(rng.normal(size=(60, 3)), np.arange(60))
    spheres = make_spheres(rng.uniform(-2, 2, (12, 3)), rng.uniform(0.1, 0.4, 12))
    ground = make_mesh(GROUND, [[0, 1, 2], [0, 2, 3]])
    bodies = ((ball(12), GREEN), (soup, RED), (ground, None), (spheres, RED))
    lamps = (Sun("sun", towards=(0.48, -0.6, 0.64), irradiance=(2.0, 2.0, 2.0)),)
    lit = make_lit(camera(), *bodies, lamps=lamps, bounces=Bounces().none)
    objects = tuple(replace(o, hidden_from=frozenset({"shadow"}) if o.name == "object 1" else frozenset()) for o in lit.objects)
    return replace(lit, objects=objects)


def pictures(tracer):
    return tracer.render(), tracer.render_light("direct", 2, 3), tracer.render_light("direct", 4, 3, error=0.01)


def differing(kept, fresh):
    """The number of pixels that differ in each pass of both pictures, where any do."""
    result = {}
    for first, other in zip(kept, fresh, strict=True):
        counts = {name: int((first[name] != other[name]).any(axis=-1).sum()) for name in first}
        result |= {name: count for name, count in counts.items() if count}
    return result


def copied(scene):
    """A copy of the scene in other arrays, as the next frame's export makes them."""

    def copy(geometry):
        arrays = {name: value.copy() for name, value in vars(geometry).items() if isinstance(value, np.ndarray)}
        return replace(geometry, **arrays)

    objects = tuple(replace(placed, matrix=placed.matrix.copy()) for placed in scene.objects)
    return replace(scene, geometries={name: copy(shape) for name, shape in scene.geometries.items()}, objects=objects)


def test_a_flight_with_kept_structures_has_the_pictures_of_fresh_ones(scene):
    kept = Tracer(scene)
    for turn in np.linspace(0, 2 * np.pi, 9):
        frame = replace(copied(scene), camera=camera(turn))
        kept = Tracer(frame, kept=kept)
        errors = differing(pictures(kept), pictures(Tracer(frame)))
        assert not errors, f"at {turn:.2f} radians: {errors} pixels of {WIDTH * HEIGHT} differ"


def test_moving_the_camera_and_zooming_make_nothing_anew(scene):
    first = Tracer(scene)
    core = first._core
    pictures(first)
    zoomed = Tracer(replace(copied(scene), camera=camera(distance=200.0, width=50)), kept=first)
    moved = Tracer(replace(scene, camera=camera(0.05)), kept=zoomed)
    assert moved._core is core


def one_mesh(scene, **changes):
    """The scene with something else about its ball."""
    mesh = scene.geometries["geometry 0"]
    changes = {name: change(getattr(mesh, name).copy()) for name, change in changes.items()}
    return replace(scene, geometries=scene.geometries | {"geometry 0": replace(mesh, **changes)})


def one_object(scene, **changes):
    first, *others = scene.objects
    return replace(scene, objects=(replace(first, **changes), *others))


def put(array, place, value):
    array[place] = value
    return array


SCALED = np.diag([0.5, 0.5, 0.5, 1.0])
CHANGES = {
    "a vertex": lambda scene: one_mesh(scene, vertices=lambda v: put(v, 100, v[100] * 1.5)),
    "a vertex by its last bit": lambda scene: one_mesh(scene, vertices=lambda v: put(v, 100, np.nextafter(v[100], 9))),
    "the order of triangles": lambda scene: one_mesh(scene, triangles=lambda t: t[::-1].copy()),
    "a triangle less": lambda scene: one_mesh(
        scene, **dict.fromkeys(("triangles", "materials", "corner_normals", "corner_uvs"), lambda array: array[:-40].copy())
    ),
    "corner normals": lambda scene: one_mesh(scene, corner_normals=lambda n: -n),
    "a UV map": lambda scene: one_mesh(scene, corner_uvs=lambda uv: uv * 2),
    "a placement": lambda scene: one_object(scene, matrix=SCALED),
    "what the camera sees": lambda scene: one_object(scene, hidden_from=frozenset({"camera"})),
    "what shadow rays see": lambda scene: one_object(scene, hidden_from=frozenset({"shadow"})),
    "an object's number": lambda scene: one_object(scene, object_index=7),
    "a material's number": lambda scene: one_object(scene, material_indices=(9,)),
    "which material an object has": lambda scene: one_object(scene, materials=("material 1",)),
    "an object less": lambda scene: replace(scene, objects=scene.objects[1:]),
    "spheres": lambda scene: replace(
        scene,
        geometries=scene.geometries | {"geometry 3": replace(scene.geometries["geometry 3"], radii=np.full(12, 0.3))},
    ),
}


@pytest.mark.parametrize("moved", [False, True], ids=["before the same camera", "before a moved one"])
@pytest.mark.parametrize("change", CHANGES)
def test_nothing_is_kept_where_things_have_changed(change, moved, scene):
    now = CHANGES[change](copied(scene))
    now = replace(now, camera=camera(0.2)) if moved else now
    before = Tracer(scene, kept=Tracer(replace(scene, camera=camera(0.1))))  # moved before
    pictures(before)
    old, fresh = before._core, Tracer(now)
    kept = Tracer(now, kept=before)
    assert kept._core is not old
    assert not differing(pictures(kept), pictures(fresh))


ELSEWHERE = {
    "a lamp": lambda scene: replace(scene, lamps=(Point("lamp", position=(2.0, -4.0, 3.0), power=(90.0, 90.0, 90.0)),)),
    "a material": lambda scene: replace(scene, materials=scene.materials | {"material 0": RED}),
    "the order of materials": lambda scene: replace(scene, materials=dict(reversed(scene.materials.items()))),
    "the clip range": lambda scene: replace(scene, clip=(5.5, 20.0)),
    "a mirrored camera": lambda scene: replace(scene, camera=camera(mirrored=True)),
    "an eye moved by its last bit": lambda scene: replace(scene, camera=replace(camera(), eye=(5e-324, -6.0, 2.0))),
}


@pytest.mark.parametrize("change", ELSEWHERE)
def test_what_else_changes_shows(change, scene):
    now = ELSEWHERE[change](copied(scene))
    before = Tracer(scene)
    rendered, fresh = pictures(before), pictures(Tracer(now))
    assert not differing(pictures(Tracer(now, kept=before)), fresh)
    assert change == "an eye moved by its last bit" or differing(rendered, fresh) or change == "the order of materials"


def test_a_tracer_whose_structures_were_taken_over_traces_no_more(scene):
    before = Tracer(scene)
    Tracer(replace(scene, camera=camera(0.2)), kept=before)
    with pytest.raises(AttributeError):
        before.render()


def test_a_keeper_hands_each_scene_what_the_one_before_had(scene):
    keeper, frames = Keeper(), [replace(scene, camera=camera(turn)) for turn in (0.0, 0.1, 0.2)]
    rendered = [render(frame, "direct", 2, keeper=keeper) for frame in frames]
    core = keeper._tracer._core
    assert not differing(rendered, [render(frame, "direct", 2) for frame in frames])
    render(frames[-1], keeper=keeper)
    assert keeper._tracer._core is core


def test_scenes_are_the_same_by_content(scene):
    assert same_things(scene, copied(scene))
    assert same((1.0, None, "a"), (1.0, None, "a"))
    for first, other in (
        ((1,), (1, 2)),
        (1, True),
        (np.zeros(3), np.zeros(3, np.float32)),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}),
    ):
        assert not same(first, other), f"{first!r} is taken for {other!r}"
    assert isinstance(scene.geometries["geometry 0"], Mesh)
