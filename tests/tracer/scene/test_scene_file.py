"""Scene files: what is written is read again, and what is wrong with one is said in a sentence that names the key."""

import copy
import functools
import json
import math
import os
import re
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import LedgerEntry, Mesh, scene_file
from viewcam_addon.tracer.scene.film import FILTERS, Bounces, Film
from viewcam_addon.tracer.scene.lamps import RAYS, Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import COMPONENTS, Color, Material, Picture, sum_of
from viewcam_addon.tracer.scene.shader_nodes import DISTRIBUTIONS, node

DOCUMENTATION = Path(__file__).parents[3] / "docs" / "scene-file.md"


@pytest.fixture(scope="module")
def example() -> dict:
    """The scene of the documentation."""
    return json.loads(re.search(r"```json\n(.*?)```", DOCUMENTATION.read_text(encoding="utf-8"), re.DOTALL)[1])


def assert_same_scene(first, second):
    assert first.camera == second.camera and first.stated_camera == second.stated_camera
    assert first.clip == second.clip and first.ledger == second.ledger and first.origin == second.origin
    assert first.geometries.keys() == second.geometries.keys()
    for name, geometry in first.geometries.items():
        other = second.geometries[name]
        assert type(geometry) is type(other)
        for field, array in vars(geometry).items():
            read_back = getattr(other, field)
            assert (array is None) == (read_back is None), f"{field} of {name}"
            if isinstance(array, dict):
                assert list(array) == list(read_back)
                pairs = [(each, read_back[key]) for key, each in array.items()]
            else:
                pairs = [] if array is None else [(array, read_back)]
            for left, again in pairs:
                assert left.dtype == again.dtype and np.array_equal(left, again), f"{field} of {name}"
    for placed, other in zip(first.objects, second.objects, strict=True):
        assert np.array_equal(placed.matrix, other.matrix)
        assert (placed.name, placed.color) == (other.name, other.color)
        assert np.array_equal(placed.random, other.random)
        assert (placed.geometry, placed.object_index, placed.material_indices) == (
            other.geometry,
            other.object_index,
            other.material_indices,
        )


@settings(max_examples=5)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_scene_that_is_written_is_read_back_to_the_last_bit(random_scene, tmp_path_factory, seed):
    scene = random_scene(seed)
    scene = replace(
        scene,
        stated_camera=scene.camera.resized(50, 60),
        origin=(4200952.123456789, 780362.0, -1e-300),
        ledger=(LedgerEntry("Hair [ 1, 2 ]", "skipped", 'curls, "quotes",\n[\n1\n]'), LedgerEntry("Bälle", "exported")),
    )
    path = tmp_path_factory.mktemp("scene") / "name.with.dots.json"
    scene_file.write(scene, path)
    assert sorted(each.name for each in path.parent.iterdir()) == ["name.with.dots.json", "name.with.dots.npz"]
    assert_same_scene(scene, scene_file.read(path))


def test_a_small_scene_needs_no_arrays_beside_it_and_has_a_line_for_each_vector(make_scene, make_mesh, random_scene, tmp_path):
    scene = make_scene(random_scene(0).camera, make_mesh([[0, 0, 0], [1, 0, 0], [0, 1 / 3, 0]], [[0, 1, 2]]))
    scene_file.write(scene, tmp_path / "small.json")
    assert [each.name for each in tmp_path.iterdir()] == ["small.json"]
    assert "[0.0, 0.3333333333333333, 0.0]" in (tmp_path / "small.json").read_text(encoding="utf-8")
    assert_same_scene(scene, scene_file.read(tmp_path / "small.json"))


def test_the_documented_example_shows_its_floor_beads_and_tent(example, read_document):
    scene = read_document(example)
    seen = set(np.unique(render(scene)["Object Index"]).astype(int))
    assert seen == {0, 1, 2, 3}
    assert scene.clip == (0.1, math.inf)
    assert set(example["geometries"]) == {"floor", "beads", "tent"}
    for key in ("matrices", "stated_camera", "principal_point", "corner_normals", "material_indices", "arrays", "ledger"):
        assert f"`{key}`" in DOCUMENTATION.read_text(encoding="utf-8"), f"{key} is not documented"


def test_rotations_are_degrees_about_x_then_y_then_z_and_scale_comes_first(example, read_document):
    example = copy.deepcopy(example)
    example["objects"] = [
        {"name": "beads", "geometry": "beads", "location": [10, 0, 0], "rotation": [90, 0, 90], "scale": [1, 2, 3]}
    ]
    matrix = read_document(example).objects[0].matrix
    # (1, 1, 1) → scaled (1, 2, 3) → about x (1, −3, 2) → about z (3, 1, 2) → moved
    assert np.allclose(matrix @ (1, 1, 1, 1), (13, 1, 2, 1), atol=1e-15)


def test_an_object_stands_as_often_as_it_has_matrices(example, read_document):
    example = copy.deepcopy(example)
    there = [[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
    example["objects"] = [{"name": "beads", "geometry": "beads", "matrices": [np.eye(4).tolist(), there]}]
    (placed,) = read_document(example).objects
    assert np.array_equal(placed.matrices, [np.eye(4), there])
    assert placed.color == (1.0,) * 4 and placed.random is None
    example["objects"][0] |= {"color": [0.5, 2, 0, 1], "random": [0.25, 1]}
    (placed,) = read_document(example).objects
    assert placed.color == (0.5, 2.0, 0.0, 1.0) and placed.random.tolist() == [0.25, 1.0]
    for random, words in (([0.5], "must have"), ([0.5, 1.5], "from 0 to 1")):
        example["objects"][0]["random"] = random
        with pytest.raises(InputError, match=words):
            read_document(example)


def test_many_instances_are_one_array_beside_the_scene(make_scene, ball, random_matrix, random_scene, tmp_path):
    rng = np.random.default_rng(1)
    matrices = np.array([random_matrix(rng) for _ in range(20)])
    scene = make_scene(random_scene(0).camera, (ball(3), matrices))
    *others, placed = scene.objects
    placed = replace(placed, color=(0.5, 0.25, 2.0, 1.0), random=rng.random(20, np.float32))
    scene = replace(scene, objects=(*others, placed))
    scene_file.write(scene, tmp_path / "many.json")
    with np.load(tmp_path / "many.npz") as arrays:
        assert [array.shape for array in arrays.values()].count((20, 4, 4)) == 1
    assert_same_scene(scene, scene_file.read(tmp_path / "many.json"))
    with pytest.raises(InputError, match=r"few\.npz is where this scene's arrays stand"):
        scene_file.write(scene, tmp_path / "few.npz")
    assert not (tmp_path / "few.npz").exists()


def test_a_plane_is_two_triangles_with_a_uv_map_along_its_edges(example, read_document):
    floor = read_document(example).geometries["floor"]
    assert isinstance(floor, Mesh) and len(floor.triangles) == 2
    corners = floor.vertices[floor.triangles]
    assert np.allclose(corners[..., :2], floor.corner_uvs * 8 - 4)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["format"], None, ["'format'", "add"]),
        (["format"], "something else", ["'format'", "no scene file"]),
        (["version"], 2, ["'version'", "2"]),
        (["version"], "1", ["'version'", "'1'"]),
        (["color"], 1, ["unknown key 'color'"]),
        (["camera"], None, ["'camera'"]),
        (["camera"], 5, ["'camera'", "object"]),
        (["camera", "eye"], None, ["'camera'", "'eye'"]),
        (["camera", "eye"], [0, 1], ["'eye' of 'camera'", "3"]),
        (["camera", "eye"], [0, 1, "2"], ["'eye' of 'camera'"]),
        (["camera", "eye"], [0, 1, True], ["'eye' of 'camera'"]),
        (["camera", "eye"], [0, 1, 1e999], ["finite"]),
        (["camera", "look_at"], [0, -6, 2.5], ["'camera'", "look"]),
        (["camera", "up"], [0, 0, 0], ["'camera'", "up"]),
        (["camera", "distance"], 0, ["'camera'", "distance"]),
        (["camera", "distance"], [1, 2, 3], ["'distance' of 'camera'", "2"]),
        (["camera", "width"], 1.5, ["'width' of 'camera'", "whole"]),
        (["camera", "width"], 0, ["'width' of 'camera'", "1"]),
        (["camera", "mirrored"], 1, ["'mirrored' of 'camera'", "true or false"]),
        (["camera", "fov"], 1, ["unknown key 'fov'"]),
        (["clip"], [1], ["'clip'", "2"]),
        (["clip"], [None, 1], ["bound 0 of 'clip'"]),
        (["clip"], [5, 1], ["clip"]),
        (["origin"], [1, 2], ["'origin'", "3"]),
        (["origin"], [1, 2, 1e999], ["finite"]),
        (["geometries"], [], ["'geometries'"]),
        (["geometries", "beads", "type"], None, ["geometry 'beads'", "'type'"]),
        (["geometries", "beads", "type"], "cube", ["geometry 'beads'", "'cube'", "mesh"]),
        (["geometries", "beads", "radii"], None, ["geometry 'beads'", "'radii'"]),
        (["geometries", "beads", "radii"], [1], ["'radii' of geometry 'beads'", "2"]),
        (["geometries", "beads", "radii"], [1, -1], ["geometry 'beads'", "negative"]),
        (["geometries", "beads", "radii"], [1, "1"], ["'radii' of geometry 'beads'"]),
        (["geometries", "beads", "radii"], "many", ["'radii' of geometry 'beads'"]),
        (["geometries", "beads", "centers"], [[0, 0, 0], [1, 1]], ["'centers' of geometry 'beads'"]),
        (["geometries", "beads", "materials"], [0, 1], ["'beads'", "material_indices"]),
        (["geometries", "beads", "color"], [1], ["geometry 'beads'", "unknown key 'color'"]),
        (["geometries", "tent", "triangles"], [[0, 1, 5]], ["geometry 'tent'", "0 … 4"]),
        (["geometries", "tent", "triangles"], [[0, 1, 0.5]], ["'triangles' of geometry 'tent'", "whole"]),
        (["geometries", "tent", "triangles"], [[0, 1, 2**40]], ["'triangles' of geometry 'tent'"]),
        (["geometries", "tent", "triangles"], [[0, 1]], ["'triangles' of geometry 'tent'", "3"]),
        (["geometries", "tent", "vertices"], {"npz": "v"}, ["'vertices' of geometry 'tent'", "'arrays'"]),
        (["geometries", "tent", "vertices"], [[10**400, 0, 0]], ["'vertices' of geometry 'tent'"]),
        (["geometries", "tent", "corner_uvs"], [[[0, 0]] * 3], ["'corner_uvs' of geometry 'tent'", "4 × 3 × 2"]),
        (["geometries", "floor", "edges"], [[1, 0, 0]], ["'edges' of geometry 'floor'", "2 × 3"]),
        (["objects"], {}, ["'objects'", "list"]),
        (["objects", 0, "name"], None, ["object 0", "'name'"]),
        (["objects", 0, "geometry"], "wall", ["'floor'", "'wall'"]),
        (["objects", 0, "object_index"], -1, ["'object_index' of object 'floor'", "0"]),
        (["objects", 0, "matrix"], [[1, 0], [0, 1]], ["'matrix' of object 'floor'", "4 × 4"]),
        (["objects", 0, "matrix"], [[2 * (i == j) for i in range(4)] for j in range(4)], ["'floor'", "affine"]),
        (["objects", 1, "matrix"], [[int(i == j) for i in range(4)] for j in range(4)], ["'beads'", "scale"]),
        (["objects", 0, "material_indices"], [], ["'floor'", "material_indices"]),
        (["objects", 0, "material_indices"], [0.5], ["'material_indices' of object 'floor'"]),
        (["ledger"], [{"object": "x"}], ["ledger entry 'x'", "'status'"]),
        (["arrays"], "absent.npz", ["'arrays'", "absent.npz"]),
        (["arrays"], 5, ["'arrays'", "text"]),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_one_sentence_that_names_the_key(
    example, changed, assert_refused, path, value, words
):
    assert_refused(changed(example, path, value), words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["line 1", "JSON"]),
        ('{"format": ', ["line 1", "JSON"]),
        ("[]", ["the scene", "object"]),
        ("[" * 100_000, ["JSON"]),
        ('{"format": "virtual-pinhole-scene", "version": 1, "clip": [NaN, 1]}', ["NaN"]),
        ('{"format": "virtual-pinhole-scene", "version": 1, "version": 1}', ["'version'", "twice"]),
    ],
)
def test_what_is_no_json_is_refused(read_document, text, words):
    with pytest.raises(InputError) as caught:
        read_document(text)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_file_that_is_absent_binary_or_a_folder_is_refused(tmp_path):
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x01")
    (tmp_path / "folder.json").mkdir()
    for name, word in (("absent.json", "does not exist"), ("binary.json", "no JSON"), ("folder.json", "can't be read")):
        with pytest.raises(InputError, match=word):
            scene_file.read(tmp_path / name)


@pytest.fixture
def with_arrays(example, changed, tmp_path):
    """with_arrays(name, **arrays) → path of the example whose tent takes its vertices from the .npz of this name."""

    def build(name, **arrays):
        document = changed(changed(example, ["arrays"], name), ["geometries", "tent", "vertices"], {"npz": "tent"})
        if arrays:
            np.savez(tmp_path / "scene.npz", **arrays)
        (tmp_path / "scene.json").write_text(json.dumps(document), encoding="utf-8")
        return tmp_path / "scene.json"

    return build


def test_arrays_may_stand_in_the_npz(with_arrays, example):
    tent = np.array(example["geometries"]["tent"]["vertices"])
    assert np.array_equal(scene_file.read(with_arrays("scene.npz", tent=tent)).geometries["tent"].vertices, tent)


@pytest.mark.parametrize(
    ("array", "word"),
    [
        (np.array([{"code": 1}], dtype=object), "pickled"),
        (np.full((5, 3), np.nan), "finite"),
        (np.full((5, 3), "text"), "real numbers"),
        (np.full((5, 3), 1j), "real numbers"),
        (np.zeros((5, 2)), "n × 3"),
    ],
)
def test_arrays_of_objects_texts_nan_or_another_shape_are_refused(with_arrays, array, word):
    with pytest.raises(InputError, match=word):
        scene_file.read(with_arrays("scene.npz", tent=array))


@pytest.mark.parametrize(
    "name", ["../scene.npz", "/etc/passwd", "folder/scene.npz", "..", "", ".", "linked.npz", "a\0b", "./scene.npz"]
)
def test_no_path_leaves_the_folder(with_arrays, symlink, tmp_path, tmp_path_factory, name):
    outside = tmp_path_factory.mktemp("outside") / "scene.npz"
    np.savez(outside, tent=np.zeros((5, 3)))
    if name == "linked.npz":
        symlink(tmp_path / "linked.npz", outside)
    with pytest.raises(InputError, match="leaves"):
        scene_file.read(with_arrays(name, tent=np.zeros((5, 3))))


def test_a_name_of_arrays_that_is_too_long_for_the_system_is_refused_in_one_sentence(with_arrays):
    with pytest.raises(InputError, match=r"leaves|is no \.npz"):
        scene_file.read(with_arrays("a" * 40_000))


def test_arrays_that_are_absent_damaged_or_no_archive_are_refused(with_arrays, tmp_path):
    with pytest.raises(InputError, match="not there"):
        scene_file.read(with_arrays("scene.npz"))
    path = with_arrays("scene.npz", other=np.zeros((5, 3)))
    with pytest.raises(InputError, match="does not hold"):
        scene_file.read(path)
    whole = (tmp_path / "scene.npz").read_bytes()
    for damage in (b"", b"no zip", whole[:100], whole[: len(whole) // 2]):
        (tmp_path / "scene.npz").write_bytes(damage)
        with pytest.raises(InputError, match=r"no \.npz file"):
            scene_file.read(path)
    path = with_arrays("scene.npz", tent=np.random.default_rng(0).normal(size=(5, 3)))
    flipped = bytearray((tmp_path / "scene.npz").read_bytes())
    flipped[len(flipped) // 2] ^= 0xFF
    (tmp_path / "scene.npz").write_bytes(flipped)
    with pytest.raises(InputError):
        scene_file.read(path)
    np.save(tmp_path / "single.npy", np.zeros(3))
    os.replace(tmp_path / "single.npy", tmp_path / "scene.npz")
    with pytest.raises(InputError, match=r"no \.npz file"):
        scene_file.read(path)


def test_where_the_folder_cannot_be_written_nothing_appears(random_scene, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="can't be written"):
        scene_file.write(random_scene(0), tmp_path / "file" / "scene.json")
    (tmp_path / "scene.npz").mkdir()  # the arrays can't be written, so the scene must not appear
    with pytest.raises(InputError):
        scene_file.write(random_scene(0), tmp_path / "scene.json")
    assert sorted(each.name for each in tmp_path.iterdir()) == ["file", "scene.npz"]


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from(["npz", "type", "name", "x"]), inner, max_size=3)
    ),
    max_leaves=8,
)


@settings(max_examples=200)
@given(data=st.data(), value=VALUES)
def test_whatever_a_key_is_replaced_by_is_read_or_refused_in_a_sentence(example, meet_replaced, data, value):
    meet_replaced(example, data.draw, value)


@pytest.fixture(scope="session")
def lit_example():
    """The second example of the documentation, which has light, as parsed JSON."""
    return json.loads(re.findall(r"```json\n(.*?)```", DOCUMENTATION.read_text(encoding="utf-8"), re.DOTALL)[1])


def differences(first, second, where="scene"):
    """The places where two values are not the same to the last bit."""
    if type(first) is not type(second):
        yield f"{where}: {first!r} became {second!r}"
    elif isinstance(first, np.ndarray):
        if first.dtype != second.dtype or not np.array_equal(first, second):
            yield where
    elif is_dataclass(first):
        for each in fields(first):
            yield from differences(getattr(first, each.name), getattr(second, each.name), f"{where}.{each.name}")
    elif isinstance(first, dict) and list(first) == list(second):
        for key in first:
            yield from differences(first[key], second[key], f"{where}[{key!r}]")
    elif isinstance(first, tuple) and len(first) == len(second):
        for index, (left, other) in enumerate(zip(first, second, strict=True)):
            yield from differences(left, other, f"{where}[{index}]")
    elif first != second:
        yield f"{where}: {first!r} became {second!r}"


amounts = st.floats(0, 1e18)
rgb = st.tuples(amounts, amounts, amounts)
names = st.text(min_size=1, max_size=6)
vectors = st.tuples(*[st.floats(-1e6, 1e6)] * 3)
rays = st.frozensets(st.sampled_from(RAYS))
matrices = st.lists(st.floats(-1e6, 1e6), min_size=12, max_size=12).map(
    lambda numbers: np.vstack([np.reshape(numbers, (3, 4)), (0.0, 0.0, 0.0, 1.0)])
)
links = st.none() | st.just(frozenset())
value_nodes = st.none() | st.deferred(lambda: nodes)
common = {
    "name": names,
    "hidden_from": rays,
    "casts_shadow": st.booleans(),
    "multiple_importance": st.booleans(),
    "receivers": links,
    "blockers": links,
}
common |= {"emission": value_nodes}
round_lamps = common | {"power": rgb, "radius": st.floats(0, 1e6), "soft_falloff": st.booleans()}
lamps = st.one_of(
    st.builds(Sun, **common, towards=vectors.filter(any), irradiance=rgb, angle=st.floats(0, math.pi)),
    st.builds(Point, **round_lamps, position=vectors),
    st.builds(Spot, **round_lamps, matrix=matrices, angle=st.floats(0, math.pi), blend=st.floats(0, 1)),
    st.builds(Area, **common, matrix=matrices, size=st.tuples(*[st.floats(0, 1e6)] * 2), power=rgb, ellipse=st.booleans()),
)
colors = st.builds(Color, rgb=rgb, image=st.sampled_from([None, "small", "large"]), closest=st.booleans(), vertex=st.booleans())
values = st.recursive(
    st.one_of(
        vectors,
        colors,
        st.builds(partial(node, "layer_weight"), blend=st.floats(-9, 9), output=st.sampled_from(("fresnel", "facing"))),
        st.builds(
            partial(node, "image"),
            image=st.builds(partial(Color, (1.0, 1.0, 1.0)), st.sampled_from(["small", "large"])),
            interpolation=st.sampled_from(("linear", "closest", "cubic")),
            straight=st.booleans(),
        ),
    ),
    lambda inner: st.one_of(
        st.builds(partial(node, "math"), a=inner, operation=st.sampled_from(("multiply", "sine")), clamp=st.booleans()),
        st.builds(partial(node, "mix_color"), factor=inner, a=inner, b=inner, clamp_factor=st.booleans()),
    ),
    max_leaves=4,
)
nodes = st.builds(partial(node, "separate"), color=values)
bumps = st.builds(partial(node, "bump"), height=nodes, distance=st.floats(-9, 9), invert=st.booleans(), normal=nodes)
shaders = st.recursive(
    st.one_of(
        st.builds(
            partial(node, "principled"),
            base_color=colors | nodes,
            roughness=amounts,
            coat_weight=colors,
            coat_normal=bumps,
        ),
        st.builds(partial(node, "glossy"), color=rgb, roughness=colors, distribution=st.sampled_from(DISTRIBUTIONS)),
        st.builds(partial(node, "emission"), color=colors, strength=amounts),
    ),
    lambda inner: st.one_of(
        st.builds(partial(node, "mix"), factor=colors | nodes, first=inner, second=st.none() | inner),
        st.builds(partial(node, "add"), first=inner, second=inner),
    ),
    max_leaves=4,
)
materials = st.builds(Material, surface=shaders, displacement=value_nodes) | st.builds(
    sum_of,
    **{name: st.none() | colors for name in ("diffuse", "emission", "mirror", "glass", "refraction")},
    ior=st.floats(1e-3, 1e3),
)
films = st.builds(
    Film,
    filter=st.sampled_from(FILTERS),
    filter_width=st.floats(0.01, 10),
    transparent=st.booleans(),
    exposure=st.floats(0, 1e6),
)
bounces = st.builds(Bounces, *[st.integers(0, 1024)] * 4)


def test_a_constant_color_that_a_value_is_made_from_is_three_numbers_and_the_default_none():
    assert dict(node("separate", color=Color((1.0, 0.5, 0.0))).inputs) == {"color": (1.0, 0.5, 0.0)}
    assert node("separate", color=Color((0.0, 0.0, 0.0))) == node("separate")


@settings(max_examples=30)
@given(data=st.data())
def test_light_that_is_written_is_read_back_to_the_last_bit(make_scene, make_mesh, random_scene, tmp_path_factory, data):
    rng = np.random.default_rng(0)
    mesh = replace(
        make_mesh(np.eye(3), [[0, 1, 2]]),
        corner_colors=rng.random((1, 3, 3), np.float32),
        attributes={"Weight": rng.random((1, 3, 1), np.float32)},
    )
    scene = make_scene(random_scene(0).camera, mesh)
    chosen = data.draw(st.dictionaries(names, materials, max_size=3))
    given_names = tuple(data.draw(st.lists(st.sampled_from(["", *chosen]), max_size=2)))
    scene = replace(
        scene,
        objects=(
            replace(
                scene.objects[0],
                # A tuple of names that are all empty says what no tuple says.
                materials=given_names if any(given_names) else (),
                hidden_from=data.draw(rays),
                receivers=data.draw(links | st.just(frozenset({scene.objects[0].name}))),
                blockers=data.draw(links),
            ),
        ),
        images={
            "small": Picture(rng.random((1, 2, 3), np.float32), srgb=True),
            "large": Picture(rng.normal(size=(7, 5, 3)).astype(np.float32)),
            "halves": Picture(rng.normal(size=(7, 5, 3)).astype(np.float16)),
            "bytes": Picture(rng.integers(0, 256, (7, 5, 3), np.uint8), srgb=True),
            "rgbe": Picture(rng.integers(0, 1 << 31, (7, 7, 1), np.uint32)),
            "shorts": Picture(rng.integers(0, 65536, (7, 5, 4), np.uint16)),
        },
        materials=chosen,
        lamps=tuple(data.draw(st.lists(lamps, max_size=3))),
        world=data.draw(
            st.builds(
                World,
                rgb,
                rays,
                st.sampled_from([None, "small"]),
                st.booleans(),
                st.tuples(*[st.floats(-9, 9)] * 3),
                st.none() | st.builds(World, rgb, image=st.sampled_from([None, "large"]), closest=st.booleans()),
            )
        ),
        film=data.draw(films),
        bounces=data.draw(bounces),
        cycles=data.draw(st.tuples(st.integers(0, 99), st.integers(0, 99))),
    )
    path = tmp_path_factory.mktemp("scene") / "light.json"
    scene_file.write(scene, path)
    back = scene_file.read(path)
    errors = list(differences(scene, back))
    assert not errors, "\n".join(errors)


def test_in_a_list_numbers_are_what_they_say_and_in_an_array_bytes_are_shares_of_255(random_scene, tmp_path):
    few, many = np.full((1, 2, 3), 51, np.uint8), np.full((9, 2, 3), 51, np.uint8)
    scene_file.write(replace(random_scene(0), images={"few": Picture(few), "many": Picture(many)}), tmp_path / "scene.json")
    back = scene_file.read(tmp_path / "scene.json").images
    assert back["few"].pixels.dtype == np.float32 and back["many"].pixels.dtype == np.uint8
    for picture in (*back.values(), Picture(many)):
        assert (picture.values == np.float32(51) * (np.float32(1) / np.float32(255))).all()


def test_the_round_trip_sees_what_is_lost(random_scene):
    """The test above must be able to fail."""
    scene = replace(random_scene(0), lamps=(Point("lamp", power=(1.0, 2.0, 3.0)),))
    other = replace(scene, lamps=(Point("lamp", power=(1.0, 2.0, math.nextafter(3.0, 4.0))),))
    assert [each.partition(":")[0] for each in differences(scene, other)] == ["scene.lamps[0].power[2]"]


def test_a_scene_without_light_has_no_key_of_it(random_scene, tmp_path):
    scene_file.write(random_scene(0), tmp_path / "scene.json")
    document = json.loads((tmp_path / "scene.json").read_text(encoding="utf-8"))
    assert set(document) == {"format", "version", "camera", "clip", "geometries", "objects", "ledger", "arrays"}
    assert all(set(each) == {"name", "geometry", "matrix", "object_index", "material_indices"} for each in document["objects"])


def test_the_documented_light_is_what_it_says(lit_example, read_document):
    scene = read_document(lit_example)
    wall, board = scene.materials["wall"], scene.materials["board"]
    assert wall == sum_of(diffuse=Color((0.7, 0.7, 0.7)))
    assert board == sum_of(diffuse=Color((1.0, 1.0, 1.0), "checks", closest=True)) and scene.images["checks"].srgb
    assert scene.materials["pane"] == sum_of(glass=Color((1.0, 1.0, 1.0)), ior=1.5)
    sun, lamp, panel = scene.lamps
    assert isinstance(sun, Sun) and sun.angle == 0.00918 and np.linalg.norm(sun.towards) == pytest.approx(1, abs=1e-15)
    assert isinstance(lamp, Point) and (lamp.position, lamp.radius) == ((1.0, -2.0, 3.0), 0.1)
    assert lamp.hidden_from == {"camera"}
    assert isinstance(panel, Area) and panel.matrix[:3, 3].tolist() == [0, 0, 4] and panel.size == (1.0, 0.5)
    assert scene.world.radiance == (0.05, 0.06, 0.08)
    assert scene.film == Film(filter="BOX", transparent=True) and scene.bounces == Bounces(total=8)
    assert scene.objects[1].hidden_from == {"shadow"}


def test_every_key_of_light_is_documented():
    text = DOCUMENTATION.read_text(encoding="utf-8")
    kinds = (Sun, Point, Spot, Area, World, Film, Bounces, Material, Color, Picture)
    keys = {*COMPONENTS, "ior", *(each.name for kind in kinds for each in fields(kind))}
    missing = [key for key in sorted(keys) if f"`{key}`" not in text]
    assert not missing, missing


def in_a_row(count):
    """So many nodes, each of which feeds the next."""
    return functools.reduce(lambda node, _: {"type": "math", "a": node}, range(count), 0.5)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        (["cycles"], "five", ["'cycles' of the scene", "5.2"]),
        (
            ["materials", "wall"],
            {"surface": {"type": "varnish"}},
            ["'type' of 'surface' of material 'wall'", "'varnish'", "principled"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "gloss": 1}},
            ["'surface' of material 'wall'", "'gloss'", "roughness"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "mix", "first": 1}},
            ["'first' of 'surface' of material 'wall'", "object"],
        ),
        (["materials", "wall", "surface"], {"type": "glossy"}, ["material 'wall'", "diffuse", "one or the other"]),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "distribution": "phong"}},
            ["distribution", "'phong'", "beckmann"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "roughness": {"type": "math", "operation": "guess"}}},
            ["'roughness' of 'surface' of material 'wall'", "operation", "'guess'", "multiply"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "normal": 1.0}},
            ["'surface' of material 'wall'", "normal of a shader 'glossy'", "normal_map"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "roughness": {"type": "math", "a": 1e30}}},
            ["'roughness' of 'surface' of material 'wall'", "1e+30"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "color": {"type": "image", "straight": 1}}},
            ["'straight' of 'color'", "true or false"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "color": {"type": "image", "image": "no"}}},
            ["material 'wall'", "'no'"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "glossy", "color": {"type": "glossy"}}},
            ["material 'wall'", "'glossy'", "makes values"],
        ),
        (["materials", "wall"], {"surface": {"type": "math"}}, ["material 'wall'", "'math'", "shader"]),
        (
            ["materials", "wall"],
            {"surface": {"type": "diffuse", "color": {"type": "rgb_curves"}}},
            ["material 'wall'", "'rgb_curves'", "no table"],
        ),
        (
            ["materials", "wall"],
            {"surface": {"type": "diffuse", "color": {"type": "environment"}}},
            ["material 'wall'", "'environment'", "no image"],
        ),
        (["materials", "wall"], {"surface": {"type": "diffuse", "color": in_a_row(250)}}, ["250 nodes", "in a row"]),
        (["materials", "wall"], {"surface": {"type": "glossy", "roughness": -1}}, ["material 'wall'", "roughness", "0 to"]),
        (["materials", "wall"], {"surface": {"type": "glossy", "color": {"image": "no"}}}, ["material 'wall'", "'no'"]),
        (["images", "checks", "pixels"], None, ["image 'checks'", "'pixels'"]),
        (["images", "checks", "pixels"], [[[1, 0]]], ["'pixels' of image 'checks'", "3"]),
        (["images", "checks", "pixels"], [[]], ["image 'checks'"]),
        (["images", "checks", "pixels"], [[[1, 0, "1"]]], ["'pixels' of image 'checks'", "numbers"]),
        (["images", "checks", "pixels"], {"npz": "checks"}, ["'pixels' of image 'checks'", "'arrays'"]),
        (["images", "checks", "srgb"], 1, ["'srgb' of image 'checks'", "true or false"]),
        (["images", "checks", "path"], "x.png", ["image 'checks'", "unknown key 'path'"]),
        (["images"], [], ["'images'", "object"]),
        (["materials", "wall", "diffuse"], [0.7, 0.7], ["'diffuse' of material 'wall'", "3"]),
        (["materials", "wall", "diffuse"], [0.7, 0.7, -0.1], ["'diffuse' of material 'wall'", "0 to"]),
        (["materials", "wall", "diffuse"], {"image": "absent"}, ["'wall'", "'absent'"]),
        (["materials", "wall", "diffuse"], {"image": 5}, ["'image' of 'diffuse' of material 'wall'"]),
        (["materials", "wall", "diffuse"], {"texture": "checks"}, ["unknown key 'texture'"]),
        (["materials", "wall", "diffuse"], "red", ["'diffuse' of material 'wall' is 'red'", "3"]),
        (["materials", "wall", "diffuse"], True, ["'diffuse' of material 'wall' is true", "3"]),
        (["materials", "wall", "gloss"], 1, ["material 'wall'", "unknown key 'gloss'"]),
        (["materials", "pane", "ior"], 0, ["material 'pane'", "ior"]),
        (["materials", "pane", "ior"], "glass", ["'ior' of material 'pane'"]),
        (["lamps"], {}, ["'lamps'", "list"]),
        (["lamps", 0, "type"], "laser", ["'type' of lamp 'sun'", "'laser'", "area"]),
        (["lamps", 0, "type"], None, ["lamp 'sun'", "'type'"]),
        (["lamps", 0, "name"], None, ["lamp 0", "'name'"]),
        (["lamps", 0, "towards"], [0, 0, 0], ["lamp 'sun'", "towards"]),
        (["lamps", 0, "angle"], 4, ["lamp 'sun'", "angle"]),
        (["lamps", 0, "irradiance"], [1, 1, 1e30], ["lamp 'sun'", "irradiance"]),
        (["lamps", 0, "radius"], 1, ["lamp 'sun'", "unknown key 'radius'"]),
        (["lamps", 1, "radius"], -1, ["lamp 'lamp'", "radius"]),
        (["lamps", 1, "hidden_from"], ["x-ray"], ["lamp 'lamp'", "'x-ray'", "camera"]),
        (["lamps", 1, "hidden_from"], "camera", ["'hidden_from' of lamp 'lamp'", "list"]),
        (["lamps", 1, "hidden_from"], [[]], ["'hidden_from' of lamp 'lamp'", "text"]),
        (["lamps", 1, "receivers"], ["absent"], ["receivers", "'lamp'", "'absent'"]),
        (["lamps", 1, "receivers"], "floor", ["'receivers' of lamp 'lamp'", "list"]),
        (["lamps", 1, "blockers"], [1], ["'blockers' of lamp 'lamp'", "text"]),
        (["lamps", 1, "location"], [0, 0, 1], ["lamp 'lamp'", "unknown key 'location'"]),
        (["lamps", 2, "matrix"], [[1, 0, 0, 0]] * 4, ["lamp 'panel'", "matrix beside"]),
        (["lamps", 2, "size"], [1, -1], ["lamp 'panel'", "size"]),
        (["lamps", 2, "size"], 1, ["'size' of lamp 'panel'", "2"]),
        (["lamps", 2, "casts_shadow"], "no", ["'casts_shadow' of lamp 'panel'", "true or false"]),
        (["world"], [1, 1, 1], ["'world'", "object"]),
        (["world", "radiance"], [1, 1, -1], ["'world'", "radiance"]),
        (["world", "backdrop"], {"radiance": [1, -1, 1]}, ["'backdrop' of 'world'", "radiance"]),
        (["world", "backdrop"], {"backdrop": {}}, ["'backdrop' of 'world'", "unknown key 'backdrop'"]),
        (["film", "filter"], "TENT", ["'film'", "TENT", "BLACKMAN_HARRIS", "GAUSSIAN"]),
        (["film", "filter_width"], 0, ["'film'", "filter_width"]),
        (["film", "transparent"], 1, ["'transparent' of 'film'", "true or false"]),
        (["bounces", "total"], 1.5, ["'total' of 'bounces'", "whole"]),
        (["bounces", "total"], 2000, ["'bounces'", "1024"]),
        (["bounces", "volume"], 1, ["'bounces'", "unknown key 'volume'"]),
        (["objects", 0, "materials"], ["absent"], ["'floor'", "'absent'"]),
        (["objects", 0, "materials"], "wall", ["'materials' of object 'floor'", "list"]),
        (["objects", 1, "hidden_from"], ["everything"], ["'bead'", "'everything'"]),
        (["objects", 1, "receivers"], ["absent"], ["receivers of object 'bead'", "'absent'"]),
        (["objects", 1, "receivers"], "floor", ["'receivers' of object 'bead'", "list"]),
        (["objects", 1, "blockers"], [None], ["'blockers' of object 'bead'", "text"]),
    ],
)
def test_what_is_wrong_with_light_is_said_in_one_sentence_that_names_the_key(
    lit_example, changed, assert_refused, path, value, words
):
    assert_refused(changed(lit_example, path, value), words)


def test_a_value_may_be_made_by_many_nodes_in_a_row(lit_example, changed, tmp_path):
    document = changed(lit_example, ["materials", "wall"], {"surface": {"type": "diffuse", "color": in_a_row(249)}})
    (tmp_path / "scene.json").write_text(json.dumps(document), encoding="utf-8")
    scene = scene_file.read(tmp_path / "scene.json")
    assert len(list(scene.materials["wall"].surface.all)) == 250
    scene_file.write(scene, tmp_path / "again.json")
    assert not list(differences(scene, scene_file.read(tmp_path / "again.json")))


VALUES_OF_LIGHT = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=3) | st.lists(st.floats(0, 1))
)


@settings(max_examples=150)
@given(data=st.data(), value=VALUES_OF_LIGHT)
def test_whatever_a_key_of_light_is_replaced_by_is_read_or_refused_in_a_sentence(lit_example, meet_replaced, data, value):
    meet_replaced(lit_example, data.draw, value)
