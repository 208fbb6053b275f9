"""What is exported, imported and exported again is the same scene: to the last bit where Blender's float32 holds it."""

import dataclasses
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import findings, versions
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import import_scene
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres, scene_file
from viewcam_addon.tracer.scene.film import Bounces, Film
from viewcam_addon.tracer.scene.lamps import RAYS, Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import PLAIN, Colour, Material, Picture
from viewcam_addon.tracer.scene.shader_nodes import node

pytestmark = pytest.mark.slow

SAMPLES = Path(__file__).resolve().parents[3] / "sample_scenes"

# A number that is float32's is stored as it is. A colour times a strength is rounded once, and read back as a product of two
# numbers, each rounded once: 3 roundings of 2⁻²⁴.
PRODUCT = 3 * 2.0**-24
# Blender 4.2 keeps a normal as two angles of 16 bits, 2π · 2⁻¹⁶ apart, relative to axes of its own, and gives a fan of corners
# that are nearly alike one normal. Measured: up to 6.5e-4 in the sample scenes.
NORMAL = 0.0 if versions.MESHES_KEEP_NORMALS else 1e-3


def empty_file():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene


def import_whole(made, name="File"):
    return import_scene.import_scene(made, name, empty_file(), set_picture=True, set_surroundings=True)


def lacking(ledger):
    return [entry for entry in ledger if entry.status != "exported"]


def there_and_back(made):
    """What the exporter makes of an imported scene."""
    import_whole(made)
    return jobs.export(Job(level="path"))


def things(scene, light=True):
    """All that stands in a scene, whatever its order and its names: the arrays' bytes and the materials, counted."""
    return Counter(_thing(scene, placed, matrix, light) for placed in scene.objects for matrix in placed.matrices)


def _thing(scene, placed, matrix, light):
    geometry = scene.geometries[placed.geometry]
    names = (
        ("vertices", "triangles", "materials", "corner_uvs")
        if isinstance(geometry, Mesh)
        else ("centers", "radii", "materials")
    )
    arrays = tuple(getattr(geometry, name) for name in names)
    hidden = placed.hidden_from if light else frozenset()
    bytes_of = tuple(array is not None and array.tobytes() for array in arrays)
    return bytes_of, matrix.tobytes(), placed.object_index, placed.material_indices, hidden


def surfaces(scene):
    """(material index, the material) of each slot of each object."""
    return {
        (index, scene.materials[name] if name else PLAIN)
        for placed in scene.objects
        for index, name in zip(placed.material_indices, (*placed.materials, *[""] * len(placed.material_indices)), strict=False)
    }


def numbers_of(material):
    return [value for colour in material.colours.values() for value in colour.rgb]


def check_same_surfaces(one, other):
    """Every material has one of the same components, images and index, whose colours are off by no more than PRODUCT."""
    left = list(surfaces(other))
    for index, material in surfaces(one):
        found = [
            (i, each)
            for i, each in left
            if i == index
            and [(name, c.image is None, c.closest, c.vertex) for name, c in each.colours.items()]
            == [(name, c.image is None, c.closest, c.vertex) for name, c in material.colours.items()]
            and each.displacement == material.displacement
            and np.allclose(numbers_of(each), numbers_of(material), rtol=PRODUCT, atol=0)
            and (each.ior == pytest.approx(material.ior, rel=2.0**-24) or not material.colours.keys() & {"glass", "refraction"})
        ]
        assert found, f"{material} with the index {index} is not among {left}"


def check_same_camera(made, found):
    reach = max(map(abs, made.camera.eye))
    assert findings.differences(made.camera, found.camera, reach) == {}
    stated = found.stated_camera
    assert (stated.eye, stated.look_at, stated.up) == (made.camera.eye, made.camera.look_at, made.camera.up)
    assert stated.distance[0] == made.camera.distance[0]


def check_same_lamps(made, found):
    shown = {lamp.name: lamp for lamp in found.lamps}
    for lamp in (lamp for lamp in made.lamps if not lamp.is_dark):
        other = shown.pop(lamp.name, None)
        assert other is not None, f"{lamp.name} is not among {list(shown)}"
        for field in dataclasses.fields(lamp):
            one, two = getattr(lamp, field.name), getattr(other, field.name)
            if field.name in ("irradiance", "power", "towards"):
                assert two == pytest.approx(one, rel=PRODUCT, abs=2.0**-24), field.name
            elif isinstance(one, np.ndarray):
                assert np.array_equal(one, two), (lamp.name, field.name, one, two)
            elif isinstance(one, float):
                assert two == pytest.approx(one, rel=2.0**-24), field.name
            else:
                assert one == two, field.name
    assert not [lamp for lamp in shown.values() if not lamp.is_dark]


def check_same(made, found):
    assert things(made) == things(found)
    check_same_surfaces(made, found)
    check_same_camera(made, found)
    check_same_lamps(made, found)
    assert found.world.radiance == pytest.approx(made.world.radiance, rel=2.0**-24)
    assert (found.world.hidden_from, found.bounces) == (made.world.hidden_from - {"shadow"}, made.bounces)
    assert (found.film.filter, found.film.transparent) == (made.film.filter, made.film.transparent)
    assert found.film.filter_width == pytest.approx(made.film.filter_width, rel=2.0**-24)
    assert found.film.exposure == made.film.exposure


# --- The sample scenes


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    "name",
    [path.stem for path in sorted(SAMPLES.glob("*.blend"))],
)
def test_a_sample_scene_comes_back_as_the_same_picture(name, fresh_blender, tmp_path):
    scene_file.write(
        jobs.export(Job(blend=SAMPLES / f"{name}.blend", level="path")),
        tmp_path / "a.json",
    )
    made = scene_file.read(tmp_path / "a.json")
    imported = import_whole(made, name)
    assert versions.MESHES_KEEP_NORMALS is False or lacking(imported.ledger) == []
    found = jobs.export(Job(level="path"))
    assert things(made) == things(found)
    check_same_surfaces(made, found)
    check_same_lamps(made, found)
    reach = max(map(abs, made.camera.eye))
    assert findings.differences(made.camera, found.camera, reach) == {}
    wanted, got = (render.render(dataclasses.replace(scene, camera=made.camera), threads=2) for scene in (made, found))
    for pass_name, values in wanted.items():
        off = np.abs(got[pass_name].astype(float) - values).max()
        assert off <= (NORMAL if pass_name == "Normal" else 0.0), f"{pass_name} is off by {off:.3g}"


def test_the_light_of_a_sample_scene_comes_back(fresh_blender):
    """The same paths are followed; on each the factors of a surface and of a lamp are off by PRODUCT at every bounce."""
    made = jobs.export(Job(blend=SAMPLES / "cornell.blend", level="path", width=32, height=32))
    found = dataclasses.replace(there_and_back(made), camera=made.camera)
    wanted, got = (render.render(each, level="path", samples=4, seed=1, threads=2)["Combined"] for each in (made, found))
    assert wanted[..., :3].max() > 0.5
    assert got == pytest.approx(wanted, rel=(made.bounces.total + 2) * PRODUCT + 2.0**-23, abs=2.0**-23)


def test_an_object_without_material_shows_none_of_the_one_whose_geometry_it_shares(fresh_blender):
    objects = [Object("Red", "ball", np.eye(4), material_indices=(5,)), Object("Plain", "ball", np.eye(4))]
    made = scene_of(objects, {"ball": tetrahedron()})
    check_same(made, there_and_back(made))


def test_an_object_that_stands_in_many_places_becomes_as_many_that_share_their_data(fresh_blender):
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[:, 0, 3], matrices[2, 1, 1] = (0, 2, 4), -2
    made = scene_of([Object("Balls", "ball", matrices, 7)], {"ball": tetrahedron()})
    found = there_and_back(made)
    check_same(made, found)
    assert len(found.objects) == 3 and len(found.geometries) == 1


def test_a_pixel_more_is_seen(fresh_blender):
    """The comparison of this module can fail."""
    made = scene_of([Object("Ball", "ball", np.eye(4))], {"ball": tetrahedron()})
    found = there_and_back(made)
    check_same(made, found)
    moved = dataclasses.replace(made.camera, distance=(made.camera.distance[0] + 1, made.camera.distance[1] + 1))
    shifted = np.eye(4)
    shifted[0, 3] = 2.0**-20
    others = [
        dataclasses.replace(made, camera=moved),
        dataclasses.replace(made, objects=(Object("Ball", "ball", shifted),)),
        dataclasses.replace(made, lamps=(Point("lamp"),)),
        dataclasses.replace(made, world=World((0.1, 0.1, 0.1))),
    ]
    for other in others:
        with pytest.raises(AssertionError):
            check_same(other, found)


# --- Scenes that hypothesis makes


IES = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 100\n0 90\n0\n100 50\n"
EMISSIONS = (
    node("math", operation="multiply", a=node("light_path", output="ray_length"), b=0.5),
    node("ies", text=IES, strength=0.5),
    node("wave", vector=node("geometry"), scale=0.25),
    node("image", image=Colour((1.0, 1.0, 1.0), "dots"), vector=node("geometry", output="incoming")),
)


def tetrahedron(**more):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float64)
    triangles = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
    return Mesh(vertices, triangles, more.pop("materials", np.zeros(4, np.int32)), **more)


def scene_of(objects, geometries, **more):
    camera = Pinhole((3.0, -6.0, 2.0), (0.0, 0.0, 0.5), (0.0, 0.0, 1.0), 60.0, 48, 32)
    return Scene(more.pop("camera", camera), geometries, tuple(objects), **more)


def float32(array):
    return np.asarray(array, np.float32).astype(np.float64)


def unit(array):
    return array / np.linalg.norm(array, axis=-1, keepdims=True)


@st.composite
def matrices(draw):
    """Affine, of float32 numbers: plain, turned, sheared, mirrored or stretched."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    matrix = np.eye(4)
    kind = draw(st.sampled_from(["moved", "turned", "any"]))
    if kind == "turned":
        matrix[:3, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0] * random.uniform(0.2, 3)
    elif kind == "any":
        matrix[:3, :3] = random.normal(size=(3, 3))
    matrix[:3, 3] = random.normal(size=3) * draw(st.sampled_from([1.0, 100.0]))
    return float32(matrix)


@st.composite
def colours(draw, varying=False):
    rgb = tuple(float32(draw(st.lists(st.floats(0, 1, width=32), min_size=3, max_size=3))).tolist())
    if not varying:
        return Colour(rgb)
    return Colour(rgb, draw(st.sampled_from([None, "dots", "shades"])), draw(st.booleans()), draw(st.booleans()))


@st.composite
def scenes(draw):
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    components = ("diffuse", "emission", "mirror", "glass", "refraction")
    materials = {}
    for name in draw(st.lists(st.sampled_from("abc"), unique=True)):
        kinds = draw(st.lists(st.sampled_from(components), min_size=1, unique=True))
        made = {kind: draw(colours(varying=True)) for kind in kinds}
        made = {kind: dataclasses.replace(c, closest=c.closest and c.image is not None) for kind, c in made.items()}
        raised = draw(st.none() | st.just(node("noise", vector=node("geometry"), scale=2.0)))
        materials[name] = Material(**made, ior=float(np.float32(draw(st.floats(1, 2)))), displacement=raised)
    images = {
        "dots": Picture((random.integers(0, 256, (3, 2, 3)) / 255).astype(np.float32), srgb=True),
        "shades": Picture(random.random((2, 5, 3)).astype(np.float32)),
    }
    geometries = {
        "flat": tetrahedron(materials=random.integers(0, 2, 4).astype(np.int32)),
        "smooth": tetrahedron(
            corner_normals=unit(random.normal(size=(4, 3, 3))).astype(np.float32) if versions.MESHES_KEEP_NORMALS else None,
            corner_uvs=random.random((4, 3, 2)).astype(np.float32),
            corner_colours=random.random((4, 3, 3)).astype(np.float32),
        ),
        "beads": Spheres(float32(random.normal(size=(5, 3))), float32(random.random(5)), np.zeros(5, np.int32)),
    }
    slots = st.tuples(st.sampled_from(["", *materials]), st.integers(0, 32767))
    objects = []
    for number in range(draw(st.integers(1, 5))):
        chosen = [draw(slots), draw(slots)]
        geometry = draw(st.sampled_from(sorted(geometries)))
        count = 1 if geometry == "beads" else 2
        objects.append(
            Object(
                f"Object {number}",
                geometry,
                draw(matrices()),
                draw(st.integers(0, 32767)),
                tuple(index for _, index in chosen[:count]),
                tuple(name for name, _ in chosen[:count]),
                frozenset(draw(st.sets(st.sampled_from(RAYS), max_size=4))),
            )
        )
    camera = Pinhole(
        tuple(float32(random.normal(size=3) * 5).tolist()),
        tuple(random.normal(size=3).tolist()),
        tuple(random.normal(size=3).tolist()),
        60.0 if draw(st.booleans()) else (60.0, 90.0),
        draw(st.integers(4, 60)),
        draw(st.integers(4, 60)),
        draw(st.sampled_from([None, (20.0, 11.0)])),
        draw(st.booleans()),
    )
    lamps = []
    for number, kind in enumerate(draw(st.lists(st.sampled_from([Sun, Point, Spot, Area]), max_size=3))):
        shone = st.none() | st.sampled_from(EMISSIONS)
        common = {
            "emission": draw(shone),
            "hidden_from": frozenset(draw(st.sets(st.sampled_from(RAYS[:-1])))),
            "casts_shadow": draw(st.booleans()),
            "multiple_importance": draw(st.booleans()),
        }
        power = draw(colours()).rgb
        name = f"Lamp {number}"
        if kind is Sun:
            lamps.append(Sun(name, towards=tuple(random.normal(size=3)), irradiance=power, angle=float32(0.1).item(), **common))
        elif kind is Point:
            place = tuple(float32(random.normal(size=3)).tolist())
            lamps.append(Point(name, position=place, power=power, radius=0.25, soft_falloff=draw(st.booleans()), **common))
        elif kind is Spot:
            lamps.append(Spot(name, matrix=draw(matrices()), power=power, angle=1.5, blend=0.5, soft_falloff=False, **common))
        else:
            lamps.append(
                Area(
                    name,
                    matrix=draw(matrices()),
                    size=(0.5, 2.0),
                    power=power,
                    ellipse=draw(st.booleans()),
                    spread=draw(st.sampled_from([1.5, np.pi])),
                    **common,
                )
            )
    return scene_of(
        objects,
        geometries,
        camera=camera,
        materials=materials,
        images=images,
        lamps=tuple(lamps),
        world=World(
            draw(colours()).rgb,
            frozenset(draw(st.sets(st.sampled_from(RAYS)))),
            backdrop=draw(st.none() | st.just(World((0.25, 0.5, 3.0)))),
        ),
        film=Film(draw(st.sampled_from(["BOX", "BLACKMAN_HARRIS"])), draw(st.floats(0.01, 10)), draw(st.booleans()), 2.0),
        bounces=Bounces(*draw(st.tuples(*[st.integers(0, 1024)] * 4))),
    )


@given(scenes())
@settings(max_examples=60, phases=(Phase.explicit, Phase.generate))  # shrinking would open hundreds of files
def test_any_small_scene_comes_back_the_same(registered_addon, made):
    check_same(made, there_and_back(made))


# --- How things stand


def object_with(matrix):
    import_whole(scene_of([Object("Thing", "thing", matrix)], {"thing": tetrahedron()}))
    return bpy.data.objects["Thing"]


@pytest.mark.parametrize(
    ("location", "degrees", "scale"),
    [
        ((1.5, -2.25, 0.1), (0, 0, 0), (1, 1, 1)),
        ((0, 0, 0), (30, -45, 12.5), (2.5, 2.5, 2.5)),
        ((7, 8, 9), (0, 90, 0), (1, 1, -1)),
        ((0, 0, 0.7), (120, 10, -170), (1, 2, 0.5)),
    ],
)
def test_location_rotation_and_scale_are_found_again(fresh_blender, location, degrees, scale):
    block = bpy.data.objects.new("Placed", None)
    block.location, block.rotation_euler, block.scale = location, np.radians(degrees), scale
    matrix = np.array(block.matrix_basis, dtype=np.float64)
    found = object_with(matrix)
    assert found.parent is None
    bpy.context.view_layer.update()
    assert np.array_equal(np.array(found.matrix_world, dtype=np.float64), matrix)
    assert np.abs(found.scale) == pytest.approx(np.abs(scale), rel=1e-6) and tuple(found.location) == pytest.approx(location)


@pytest.mark.parametrize("seed", range(3))
def test_a_matrix_that_no_channels_give_stands_below_an_empty(fresh_blender, seed):
    matrix = np.eye(4)
    matrix[:3] = float32(np.random.default_rng(seed).normal(size=(3, 4)))
    found = object_with(matrix)
    assert found.parent.type == "EMPTY" and found.parent.name == "File.001"
    bpy.context.view_layer.update()
    assert np.array_equal(np.array(found.matrix_world, dtype=np.float64), matrix)


def test_objects_of_one_geometry_share_it_and_keep_their_own_materials(fresh_blender):
    red, green = (Material(diffuse=Colour(rgb)) for rgb in ((1, 0, 0), (0, 1, 0)))
    objects = [Object(name, "thing", np.eye(4), materials=(name,)) for name in ("red", "green")]
    import_whole(scene_of(objects, {"thing": tetrahedron()}, materials={"red": red, "green": green}))
    one, other = bpy.data.objects["red"], bpy.data.objects["green"]
    assert one.data == other.data
    assert [block.material_slots[0].material.name for block in (one, other)] == ["red", "green"]


def test_what_cycles_would_make_anew_of_a_meshs_edges_comes_back_by_another_name(fresh_blender):
    values = np.random.default_rng(0).random((4, 3, 1)).astype(np.float32)
    pointed = Material(surface=node("emission", color=node("attribute", name="pointiness", output="number")))
    made = scene_of(
        [Object("Thing", "thing", np.eye(4), materials=("pointed",))],
        {"thing": tetrahedron(attributes={"pointiness": values})},
        materials={"pointed": pointed},
    )
    found = there_and_back(made)
    assert np.array_equal(found.geometries["thing"].attributes["Pointiness"], values)
    assert found.materials["pointed"].attributes == {"Pointiness"}


def test_an_image_survives_saving_and_loading(fresh_blender, tmp_path):
    pixels = np.random.default_rng(0).random((2, 3, 3)).astype(np.float32) * 10
    made = scene_of(
        [Object("Thing", "thing", np.eye(4), materials=("paper",))],
        {"thing": tetrahedron(corner_uvs=np.zeros((4, 3, 2), np.float32))},
        materials={"paper": Material(diffuse=Colour((1.0, 1.0, 1.0), "noise"))},
        images={"noise": Picture(pixels)},
    )
    import_whole(made)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "file.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "file.blend"))
    (picture,) = jobs.export(Job(level="path")).images.values()
    assert np.array_equal(picture.pixels, pixels) and not picture.srgb
