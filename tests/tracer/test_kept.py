"""Structures kept from frame to frame: the pictures of fresh ones, and nothing kept that has changed."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Keeper, Tracer, render
from viewcam_addon.tracer.scene import Mesh
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Point, Sun
from viewcam_addon.tracer.scene.materials import Colour, Material
from viewcam_addon.tracer.scene.sameness import same, same_things

WIDTH, HEIGHT = 96, 64
GREEN, RED = Material(diffuse=Colour((0.1, 0.8, 0.2))), Material(diffuse=Colour((0.9, 0.1, 0.1)))
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
    things = ((ball(12), GREEN), (soup, RED), (ground, None), (spheres, RED))
    lamps = (Sun("sun", towards=(0.48, -0.6, 0.64), irradiance=(2.0, 2.0, 2.0)),)
    lit = make_lit(camera(), *things, lamps=lamps, bounces=Bounces().none)
    objects = tuple(replace(o, hidden_from=frozenset({"shadow"}) if o.name == "object 1" else frozenset()) for o in lit.objects)
    return replace(lit, objects=objects)


def pictures(tracer):
    return tracer.render(), tracer.render_light("direct", 2, 3), tracer.render_light("direct", 4, 3, error=0.01)


def differing(kept, fresh):
    """Of the passes of both pictures, how many pixels differ where any do."""
    found = {}
    for one, other in zip(kept, fresh, strict=True):
        counts = {name: int((one[name] != other[name]).any(axis=-1).sum()) for name in one}
        found |= {name: count for name, count in counts.items() if count}
    return found


def copied(scene):
    """The same in other arrays, as the next frame's export makes them."""

    def copy(geometry):
        arrays = {name: value.copy() for name, value in vars(geometry).items() if isinstance(value, np.ndarray)}
        return replace(geometry, **arrays)

    objects = tuple(replace(placed, matrix=placed.matrix.copy()) for placed in scene.objects)
    return replace(scene, geometries={name: copy(some) for name, some in scene.geometries.items()}, objects=objects)


def test_a_flight_with_kept_structures_has_the_pictures_of_fresh_ones(scene):
    kept = Tracer(scene)
    for turn in np.linspace(0, 2 * np.pi, 9):
        frame = replace(copied(scene), camera=camera(turn))
        kept = Tracer(frame, kept=kept)
        found = differing(pictures(kept), pictures(Tracer(frame)))
        assert not found, f"at {turn:.2f} radians: {found} pixels of {WIDTH * HEIGHT} differ"


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
        scene, **dict.fromkeys(("triangles", "materials", "corner_normals", "corner_uvs"), lambda some: some[:-40].copy())
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
    shown, fresh = pictures(before), pictures(Tracer(now))
    assert not differing(pictures(Tracer(now, kept=before)), fresh)
    assert change == "an eye moved by its last bit" or differing(shown, fresh) or change == "the order of materials"


def test_a_tracer_whose_structures_were_taken_over_traces_no_more(scene):
    before = Tracer(scene)
    Tracer(replace(scene, camera=camera(0.2)), kept=before)
    with pytest.raises(AttributeError):
        before.render()


def test_a_keeper_hands_each_scene_what_the_one_before_had(scene):
    keeper, frames = Keeper(), [replace(scene, camera=camera(turn)) for turn in (0.0, 0.1, 0.2)]
    shown = [render(frame, "direct", 2, keeper=keeper) for frame in frames]
    core = keeper._tracer._core
    assert not differing(shown, [render(frame, "direct", 2) for frame in frames])
    render(frames[-1], keeper=keeper)
    assert keeper._tracer._core is core


def test_scenes_are_the_same_by_content(scene):
    assert same_things(scene, copied(scene))
    assert same((1.0, None, "a"), (1.0, None, "a"))
    for one, other in (((1,), (1, 2)), (1, True), (np.zeros(3), np.zeros(3, np.float32)), ({"a": 1, "b": 2}, {"b": 2, "a": 1})):
        assert not same(one, other), f"{one!r} is taken for {other!r}"
    assert isinstance(scene.geometries["geometry 0"], Mesh)
