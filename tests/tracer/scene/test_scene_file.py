"""Scene files: what is written is read again, and what is wrong with one is said in a sentence that names the key."""

import copy
import json
import math
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.errors import InputError
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import LedgerEntry, Mesh, scene_file

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


def test_a_plane_is_two_triangles_with_a_uv_map_along_its_edges(example, read_document):
    floor = read_document(example).geometries["floor"]
    assert isinstance(floor, Mesh) and len(floor.triangles) == 2
    corners = floor.vertices[floor.triangles]
    assert np.allclose(corners[..., :2], floor.corner_uvs * 8 - 4)


def test_colors_of_a_mesh_are_read_as_the_first_files_spell_them(example, read_document):
    document = copy.deepcopy(example)
    tent = document["geometries"]["tent"]
    tent["corner_colours"] = np.full((len(tent["triangles"]), 3, 3), 0.25).tolist()
    assert (read_document(document).geometries["tent"].corner_colors == 0.25).all()


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
