"""Lights in a scene file: nothing is lost on the way, a hand can write it, and what is wrong is named."""

import functools
import json
import math
import re
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.tracer.scene import scene_file
from viewcam_addon.tracer.scene.film import FILTERS, Bounces, Film
from viewcam_addon.tracer.scene.lamps import RAYS, Area, Point, Spot, Sun, World
from viewcam_addon.tracer.scene.materials import COMPONENTS, Color, Material, Picture, sum_of
from viewcam_addon.tracer.scene.shader_nodes import DISTRIBUTIONS, node

DOCUMENTATION = Path(__file__).parents[3] / "docs" / "scene-file.md"


@pytest.fixture(scope="session")
def example():
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


def test_the_documented_light_is_what_it_says(example, read_document):
    scene = read_document(example)
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
    example, changed, assert_refused, path, value, words
):
    assert_refused(changed(example, path, value), words)


def test_a_value_may_be_made_by_many_nodes_in_a_row(example, changed, tmp_path):
    document = changed(example, ["materials", "wall"], {"surface": {"type": "diffuse", "color": in_a_row(249)}})
    (tmp_path / "scene.json").write_text(json.dumps(document), encoding="utf-8")
    scene = scene_file.read(tmp_path / "scene.json")
    assert len(list(scene.materials["wall"].surface.all)) == 250
    scene_file.write(scene, tmp_path / "again.json")
    assert not list(differences(scene, scene_file.read(tmp_path / "again.json")))


VALUES = (
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=3) | st.lists(st.floats(0, 1))
)


@settings(max_examples=150)
@given(data=st.data(), value=VALUES)
def test_whatever_a_key_of_light_is_replaced_by_is_read_or_refused_in_a_sentence(example, meet_replaced, data, value):
    meet_replaced(example, data.draw, value)
