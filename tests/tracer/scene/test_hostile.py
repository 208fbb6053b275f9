"""Scene files made to do harm: refused in a sentence before they take time or memory, or a right picture of finite numbers."""

import copy
import io
import json
import math
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from viewcam_addon import image, machine
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import LARGEST, Mesh, Object, Scene, Spheres, scene_file

pytestmark = pytest.mark.usefixtures("no_warnings")


CAMERA = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 50, "width": 16, "height": 12}
MEBI = 2**20


def document(**changed):
    return {
        "format": "virtual-pinhole-scene",
        "version": 1,
        "camera": CAMERA,
        "geometries": {"it": {"type": "mesh", "vertices": {"npz": "v"}, "triangles": []}},
        "objects": [],
        "arrays": "scene.npz",
    } | changed


@pytest.fixture
def refused(tmp_path):
    """refused(text or document, members of the archive) → the sentence that the scene is refused with."""

    def read(scene, members=(), packing=zipfile.ZIP_DEFLATED):
        (tmp_path / "scene.json").write_text(scene if isinstance(scene, str) else json.dumps(scene), encoding="utf-8")
        with zipfile.ZipFile(tmp_path / "scene.npz", "w", packing) as archive:
            for name, content in dict(members).items():
                archive.writestr(name, content)
        with pytest.raises(InputError) as error:
            scene_file.read(tmp_path / "scene.json")
        sentence = str(error.value)
        assert "\n" not in sentence and len(sentence) < 300, sentence
        return sentence

    return read


def array(values):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def header(text, content=b""):
    """An array's file whose header says anything."""
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode("latin1") + content


def test_a_number_of_5000_digits_is_no_number_of_a_scene(refused):
    scene = json.dumps(document(geometries={}, camera=CAMERA | {"distance": 123456789})).replace("123456789", "9" * 5000)
    assert refused(scene) == "scene.json: 'distance' of 'camera' of the scene is inf: give a finite number"


def test_a_key_that_is_there_twice_is_found_among_200000_in_the_time_that_reading_takes(refused):
    keys = ", ".join(f'"{number}": 0' for number in range(200_000))
    started = time.process_time()
    assert "'199999' appears twice" in refused(f'{{{keys}, "199999": 0}}')
    assert time.process_time() - started < 5, "to count each key among all takes minutes"  # and linear time 0.3 s


@pytest.mark.parametrize(
    "changed", [{"x" * 1_000_000: 1}, {"objects": [{"name": "x" * 1_000_000, "geometry": "x"}]}, {"arrays": "x" * 1_000_000}]
)
def test_a_name_of_a_million_letters_is_told_by_its_beginning(refused, changed):
    assert "xxx…" in refused(document(geometries={}) | changed)


def test_a_member_of_the_archive_that_is_no_array_is_not_there(refused):
    sentence = refused(document(), {"v": b"text", "w.npy": array(np.zeros(3))})
    assert sentence.endswith("is 'v', which scene.npz does not hold: export the scene again")


@pytest.mark.parametrize(
    "member",
    [
        b"",
        b"text",
        header(""),
        header("("),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3,"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 3)}"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (True, 3)}", b"0" * 24),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (0, 99999999999999999999, 3)}"),
        header("{'descr': 'no type', 'fortran_order': False, 'shape': (1, 3)}"),
        header("[" * 5000),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}", b"0" * 24),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3)}", b"0" * 25),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (6442450941, 3)}", b"0" * 24),
        b"\x93NUMPY\x07\x00" + array(np.zeros((1, 3)))[8:],
    ],
    ids=range(14),
)
def test_an_array_whose_header_is_malformed_or_lies_is_damaged(refused, member):
    assert "scene.npz: the array 'v' is damaged: export the scene again" in refused(document(), {"v.npy": member})


def test_a_size_in_the_archive_that_its_packed_bytes_can_not_hold_is_damaged(refused, tmp_path):
    """The archive's own table lies: 2³¹ bytes in a few, where Deflate packs a thousand into one at most."""
    shape = (2**31 // 24, 3)
    text = header(f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}")
    refused(document(), {"v.npy": text})
    data = bytearray((tmp_path / "scene.npz").read_bytes())
    size, lie = (length.to_bytes(4, "little") for length in (len(text), len(text) + shape[0] * 24))
    (tmp_path / "scene.npz").write_bytes(data.replace(size, lie))
    with pytest.raises(InputError, match="the array 'v' is damaged"):
        scene_file.read(tmp_path / "scene.json")


def test_arrays_that_need_more_memory_than_there_is_are_refused_before_any_is_taken(refused, monkeypatch):
    """16 MiB that are a few kilobytes as they are packed; two are too large together, and one is not."""
    monkeypatch.setattr(machine, "most", lambda: 40 * MEBI)
    vertices = array(np.zeros((16 * MEBI // 24, 3)))
    geometries = {name: {"type": "mesh", "vertices": {"npz": name}, "triangles": []} for name in "vw"}
    assert "memory" not in refused(document(geometries={"v": geometries["v"]}, objects=1), {"v.npy": vertices})
    members = {"v.npy": vertices, "w.npy": vertices}
    tracemalloc.start()
    sentence = refused(document(geometries=geometries), members)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "the arrays of scene.npz need 0.0625 GiB of memory and there are 0.0391 GiB: make the scene smaller" in sentence
    assert peak < 24 * MEBI, f"{peak / MEBI:.0f} MiB were taken: the second array was read, too"


def test_an_array_that_many_geometries_name_is_read_once(tmp_path, monkeypatch):
    """Else a file of some kilobytes takes gigabytes."""
    monkeypatch.setattr(machine, "most", lambda: 3 * 8 * MEBI)
    np.savez_compressed(tmp_path / "scene.npz", v=np.zeros((8 * MEBI // 24, 3)))
    mesh = {"type": "mesh", "vertices": {"npz": "v"}, "triangles": []}
    (tmp_path / "scene.json").write_text(json.dumps(document(geometries={str(number): mesh for number in range(100)})))
    geometries = scene_file.read(tmp_path / "scene.json").geometries
    assert len({id(geometry.vertices) for geometry in geometries.values()}) == 1


def test_what_is_no_file_is_no_archive(tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(document()))
    (tmp_path / "scene.npz").mkdir()
    with pytest.raises(InputError, match=r"scene\.npz. is no \.npz file"):
        scene_file.read(tmp_path / "scene.json")


HOSTILE = (
    *(5e-324, 1e-310, 1e-200, 1e-45, -0.0, 0, 1e15, 1e20, 3.4e38, 1e39, 1e160, 1e300, 1.7e308, -1e308, -1.7e308),
    *(math.nan, math.inf, 10**400, 2**31, -1, None, "1", True, [], {}),
)
SCENE = {
    "format": "virtual-pinhole-scene",
    "version": 1,
    "camera": {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 50, "width": 16, "height": 12},
    "geometries": {
        "ball": {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]},
        "wall": {"type": "plane", "corner": [-3, 1, -3], "edges": [[6, 0, 0], [0, 0, 6]]},
        "face": {
            "type": "mesh",
            "vertices": [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
            "triangles": [[0, 1, 2]],
            "corner_normals": [[[0, -1, 0], [0, -1, 0], [0, -1, 0]]],
            "corner_uvs": [[[0, 0], [1, 0], [0, 1]]],
            "materials": [0],
        },
    },
    "objects": [
        {"name": "ball", "geometry": "ball", "matrix": np.eye(4).tolist()},
        {"name": "wall", "geometry": "wall", "location": [0, 0, 0], "rotation": [0, 0, 0], "scale": [1, 1, 1]},
        {"name": "face", "geometry": "face", "object_index": 3, "material_indices": [1]},
    ],
    "clip": [0.1, 1000],
}


def numbers_in(document, path=()):
    """The path of keys to each number."""
    if isinstance(document, dict | list):
        for key, value in document.items() if isinstance(document, dict) else enumerate(document):
            yield from numbers_in(value, (*path, key))
    elif not isinstance(document, str):
        yield path


@pytest.mark.parametrize("path", list(numbers_in(SCENE)), ids=lambda path: ".".join(map(str, path)))
def test_a_hostile_number_in_a_scene_file_gives_a_finite_picture_or_a_sentence(path, tmp_path):
    file = tmp_path / "scene.json"
    for value in HOSTILE:
        document = copy.deepcopy(SCENE)
        inner = document
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = value
        file.write_text(json.dumps(document), encoding="utf-8")
        try:
            with np.errstate(under="ignore"):
                passes = render(scene_file.read(file), threads=1)
        except InputError as error:
            sentence = str(error)
            assert sentence.startswith("scene.json: ") or "memory" in sentence, sentence
            assert "\n" not in sentence and len(sentence) < 300, sentence
        else:
            for name, values in passes.items():
                assert np.isfinite(values).all(), f"{name} with {value} at {path}"


def camera(eye=(0, -5, 0), distance=50.0, **rest):
    return Pinhole(eye, (0, 0, 0), (0, 0, 1), distance, 16, 12, **rest)


def spheres(center, radius):
    return Spheres(np.array([center]), np.array([radius]), np.zeros(1, np.int32))


def scene(camera, geometry, matrix):
    return Scene(camera, {"it": geometry}, (Object("it", "it", matrix),))


FAR = np.diag([1e10, 1e10, 1e10, 1.0])


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((camera(eye=(0, 2e18, 0)), spheres((0.0, 0, 0), 1.0), np.eye(4)), "the camera's eye is"),
        ((camera(distance=1e-20), spheres((0.0, 0, 0), 1.0), np.eye(4)), "distance of 1e-20 pixels"),
        ((camera(principal_point=(1e30, 0)), spheres((0.0, 0, 0), 1.0), np.eye(4)), "a principal point"),
        ((camera(), spheres((2e18, 0, 0), 1.0), np.eye(4)), "object 'it' reaches as far as 2e\\+18"),
        ((camera(), spheres((0.0, 0, 0), 1e10), FAR), "object 'it' reaches as far as 3e\\+20"),
        ((camera(), spheres((0.0, 0, 0), 1.0), np.diag([1.0, 1e300, 1.0, 1.0])), "object 'it' reaches as far as 1e\\+300"),
    ],
)
def test_what_visibility_can_not_hold_is_refused_by_name(parts, words):
    with pytest.raises(InputError, match=words):
        scene(*parts)


def test_a_scene_of_nothing_has_no_reach():
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros(0, np.int32))
    passes = render(scene(camera(), empty, np.eye(4) * [LARGEST, 1, 1, 1]), threads=1)
    assert (passes["Depth"] == 1e10).all()


def test_a_picture_beyond_all_memory_is_refused():
    with pytest.raises(InputError, match="2147483647 × 2147483647 pixels needs more memory"):
        render(scene(camera().resized(2**31 - 1, 2**31 - 1), spheres((0.0, 0, 0), 1.0), np.eye(4)), threads=1)


@pytest.mark.parametrize("srgb", [False, True])
@pytest.mark.parametrize("component", ["diffuse", "emission", "mirror", "glass", "refraction"])
@pytest.mark.parametrize("pixel", [1e6, 3e7, 1e17, 1e30, 3e38, -1e30])
def test_a_hostile_pixel_of_an_image_gives_a_finite_picture_or_a_sentence(component, pixel, srgb, tmp_path):
    """At every level of light; the variance of a value that float32 just holds may be beyond it, and is then infinite."""
    document = copy.deepcopy(SCENE)
    document["images"] = {"hot": {"pixels": [[[pixel, 0, 0], [pixel, pixel, 1]]], "srgb": srgb}}
    document["materials"] = {"it": {component: {"image": "hot"}}}
    document["world"] = {"radiance": [1, 1, 1]}
    for placed in document["objects"]:
        placed["materials"] = ["it", "it"]
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(document), encoding="utf-8")
    try:
        scene = scene_file.read(file)
    except InputError as error:
        most = "3.16e+07" if srgb else "1e+18"
        assert f"image 'hot': an image holds {abs(pixel):g}: give numbers up to {most}" in str(error)
        return
    with np.errstate(under="ignore"):
        pictures = [render(scene, level, samples=4, threads=1) for level in ("direct", "path")]
    for picture in pictures:
        for name, values in picture.items():
            assert name == "Variance" or np.isfinite(values).all(), name


PLANE = {"type": "plane", "corner": [-4, -4, 0], "edges": [[8, 0, 0], [0, 8, 0]]}
BALL = {"type": "spheres", "centers": [[0, 0, 0]], "radii": [1]}
CUBE = {
    "type": "mesh",
    "vertices": [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
    "triangles": [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ],
}
LIT_SCENE = {
    "format": "virtual-pinhole-scene",
    "version": 1,
    "camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "up": [0, 1, 0], "distance": 20, "width": 16, "height": 12},
    "geometries": {"plane": PLANE, "ball": BALL, "cube": CUBE},
    "materials": {"gray": {"diffuse": [0.5, 0.5, 0.5]}, "glass": {"glass": [1, 1, 1], "ior": 1.5}},
    "objects": [{"name": "floor", "geometry": "plane", "materials": ["gray"]}],
    "film": {"filter": "BOX"},
}
SUN = {"type": "sun", "name": "Sun", "irradiance": [1, 1, 1]}
LIT = 0.5 / np.pi  # radiance of the floor under this sun
FLOAT32 = 2.0**-24


def render_file(folder, level="path", samples=16, **changes):
    """The Combined pass of the scene with other keys; it must hold numbers, none of them negative."""
    scene, picture = folder / "scene.json", folder / "out.exr"
    scene.write_text(json.dumps(LIT_SCENE | changes))
    status = main(["render", str(scene), str(picture), "--level", level, "--samples", str(samples)])
    assert status == 0
    passes = image.read(picture).passes
    for name in ("Combined", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color", "Emission", "Environment"):
        assert np.isfinite(passes[name]).all() and (passes[name] >= 0).all(), name
    return passes["Combined"][..., :3]


def refusal(folder, capfd, **changes):
    """The sentence with which the scene is refused."""
    scene, picture = folder / "scene.json", folder / "out.exr"
    scene.write_text(json.dumps(LIT_SCENE | changes))
    assert main(["render", str(scene), str(picture), "--level", "path"]) == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and "bug" not in lines[0], lines
    assert not picture.exists()
    return lines[0]


@pytest.mark.parametrize("level", ["direct", "path"])
def test_without_lamps_all_is_black(tmp_path, level):
    assert not render_file(tmp_path, level).any()


@pytest.mark.parametrize(
    "lamp",
    [
        {"type": "area", "name": "Flat", "location": [0, 0, 3], "size": [0, 1], "power": [10, 10, 10]},
        {"type": "area", "name": "Point", "location": [0, 0, 3], "size": [0, 0], "power": [10, 10, 10], "ellipse": True},
        {"type": "area", "name": "Scaled to nothing", "location": [0, 0, 3], "scale": 0, "power": [10, 10, 10]},
        {"type": "point", "name": "Out", "position": [0, 0, 3], "power": [0, 0, 0]},
        {"type": "spot", "name": "Closed", "location": [0, 0, 3], "angle": 0, "power": [10, 10, 10]},
    ],
    ids=lambda lamp: lamp["name"],
)
def test_a_lamp_of_no_extent_or_power_lights_nothing_and_leaves_the_others_alone(tmp_path, lamp):
    np.testing.assert_allclose(render_file(tmp_path, lamps=[SUN, lamp], bounces={"total": 0}), LIT, rtol=4 * FLOAT32)


def test_black_surfaces_stay_black(tmp_path):
    assert not render_file(tmp_path, lamps=[SUN], materials={"gray": {"diffuse": [0, 0, 0]}}).any()


def test_surfaces_that_reflect_more_than_they_get_shine_brighter(tmp_path):
    picture = render_file(tmp_path, lamps=[SUN], materials={"gray": {"diffuse": [1.5, 2, 20]}})
    np.testing.assert_allclose(picture, np.broadcast_to(np.array([1.5, 2, 20]) / np.pi, picture.shape), rtol=4 * FLOAT32)


def test_a_closed_box_that_reflects_more_than_it_gets_ends_with_its_bounces(tmp_path):
    """Radiance E Σ ρⁿ over the bounces and one scattering more."""
    camera = LIT_SCENE["camera"] | {"eye": [0.1, 0.2, 0.3], "look_at": [1, 0, 0], "up": [0, 0, 1]}
    picture = render_file(
        tmp_path,
        camera=camera,
        objects=[{"name": "room", "geometry": "cube", "materials": ["hot"]}],
        materials={"hot": {"diffuse": [2, 2, 2], "emission": [1, 1, 1]}},
        bounces={"total": 3, "diffuse": 3},
    )
    error = picture.std() / np.sqrt(picture[..., 0].size)
    assert abs(picture.mean() - 31) < 3 * error < 1, f"{picture.mean():.3f} ± {error:.3f} in place of 1 + 2 + 4 + 8 + 16"


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-1", "1e300"])
@pytest.mark.parametrize("owner", ["material", "lamp", "world"])
def test_colors_that_are_none_are_refused_by_name(tmp_path, capfd, number, owner):
    color = f"[0.5, {number}, 0.5]"
    changes = {
        "material": {"materials": {"gray": {"diffuse": "COLOR"}}},
        "lamp": {"lamps": [SUN | {"irradiance": "COLOR"}]},
        "world": {"world": {"radiance": "COLOR"}},
    }[owner]
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(LIT_SCENE | changes).replace('"COLOR"', color))
    assert main(["render", str(scene), str(tmp_path / "out.exr"), "--level", "path"]) == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and "bug" not in lines[0], lines
    assert number in ("NaN", "Infinity") or {"material": "gray", "lamp": "Sun", "world": "world"}[owner] in lines[0], lines[0]


@pytest.mark.parametrize("power", [1e10, 1e17])
def test_a_lamp_of_any_power_lights_in_proportion(tmp_path, power):
    lamp = {"type": "point", "name": "Lamp", "position": [0, 0, 3]}
    dim = render_file(tmp_path, "direct", lamps=[lamp | {"power": [1, 1, 1]}])
    bright = render_file(tmp_path, "direct", lamps=[lamp | {"power": [power] * 3}])
    np.testing.assert_allclose(bright / power, dim, rtol=4 * FLOAT32)


def test_five_thousand_lamps_light_as_one_that_has_their_power(tmp_path):
    """All in one place: the choice among them makes no noise, so that one sample a pixel is exact."""
    lamps = [{"type": "point", "name": f"Lamp {i}", "position": [0, 0, 3], "power": [1, 1, 1]} for i in range(5000)]
    bright = render_file(tmp_path, "direct", lamps=[lamps[0] | {"power": [5000] * 3}], samples=1)
    many = render_file(tmp_path, "direct", lamps=lamps, samples=1)
    np.testing.assert_allclose(many, bright, rtol=1e-5)


def test_five_thousand_lamps_all_over_the_place_light_what_their_sum_does(tmp_path):
    rng = np.random.default_rng(1)
    places = rng.uniform((-4, -4, 0.5), (4, 4, 3), (5000, 3))
    powers = rng.uniform(0, 2, 5000)
    lamps = [
        {"type": "point", "name": f"Lamp {i}", "position": list(place), "power": [power] * 3}
        for i, (place, power) in enumerate(zip(places.tolist(), powers.tolist(), strict=True))
    ]
    picture = render_file(tmp_path, "direct", lamps=lamps, samples=256)
    camera = LIT_SCENE["camera"]
    rows, columns = np.indices((camera["height"], camera["width"]))
    steps = (np.arange(4) + 0.5) / 4  # the mean over a pixel, by the midpoint rule
    expected = np.zeros(rows.shape)
    for px in steps:
        for py in steps:
            x, y = (columns + px - camera["width"] / 2) / 20 * 5, (rows + py - camera["height"] / 2) / 20 * 5
            apart = places - np.stack([x, y, np.zeros(x.shape)], axis=-1)[..., None, :]
            squared = (apart**2).sum(axis=-1)
            expected += (powers * apart[..., 2] / squared**1.5).sum(axis=-1) / len(steps) ** 2
    expected *= 0.5 / np.pi / (4 * np.pi)
    ratio = picture[..., 0] / expected
    # One lamp of 5000 a sample: the standard error of the mean over all pixels is told by the pixels' own spread.
    error = ratio.std() / np.sqrt(ratio.size)
    assert abs(ratio.mean() - 1) < 4 * error < 0.2, f"{ratio.mean():.4f} ± {error:.4f} of what it should be"


def test_a_camera_inside_glass_sees_the_world_as_it_is(tmp_path):
    """From inside, a cube of clear glass reflects some of the world and lets the rest through: in a white one, all is 1."""
    picture = render_file(
        tmp_path,
        camera=LIT_SCENE["camera"] | {"eye": [0.1, 0.2, 0.3], "look_at": [1, 0, 0], "up": [0, 0, 1]},
        objects=[{"name": "block", "geometry": "cube", "materials": ["glass"]}],
        world={"radiance": [1, 1, 1]},
        bounces={"total": 1024, "transmission": 1024, "glossy": 1024},
        samples=64,
    )
    # Rays that are reflected totally at all faces of a cube stay for ever: they end with the bounces, black.
    assert picture.max() < 1 + 1e-5 or picture.mean() < 1.05, picture
    middle = picture[4:8, 6:10]
    assert abs(middle.mean() - 1) < 0.02, f"the middle is {middle.mean():.4f}"


def test_a_camera_inside_a_closed_mesh_sees_no_lamp_outside(tmp_path):
    camera = LIT_SCENE["camera"] | {"eye": [0.1, 0.2, 0.3], "look_at": [1, 0, 0], "up": [0, 0, 1]}
    lamps = [SUN, {"type": "point", "name": "Lamp", "position": [3, 0, 0], "power": [1000] * 3, "radius": 0.5}]
    room = [{"name": "room", "geometry": "cube", "materials": ["gray"]}]
    assert not render_file(tmp_path, camera=camera, objects=room, lamps=lamps, world={"radiance": [1, 1, 1]}).any()


def test_a_lamp_inside_a_closed_mesh_lights_it_and_nothing_else(tmp_path):
    lamps = [{"type": "point", "name": "Lamp", "position": [0, 0, 0], "power": [100] * 3}]
    objects = [
        {"name": "box", "geometry": "cube", "location": [0, 0, 1.5], "materials": ["gray"]},
        *LIT_SCENE["objects"],
    ]
    inside = [lamps[0] | {"position": [0, 0, 1.5]}]
    assert not render_file(tmp_path, objects=objects, lamps=inside).any()
    assert render_file(tmp_path, objects=objects, lamps=[lamps[0] | {"position": [3, 0, 4]}]).any()


def test_a_point_lamp_on_a_surface_is_no_division_by_zero(tmp_path):
    picture = render_file(
        tmp_path, "direct", lamps=[{"type": "point", "name": "Lamp", "position": [0, 0, 0], "power": [1] * 3}]
    )
    assert picture.max() < 1e-6, "seen along the surface it brings nothing"


def test_a_scene_of_nothing_is_the_world(tmp_path):
    picture = render_file(tmp_path, objects=[], world={"radiance": [0.25, 0.5, 1]})
    np.testing.assert_array_equal(picture, np.broadcast_to(np.float32([0.25, 0.5, 1]), picture.shape))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"lamps": [SUN | {"angle": 4}]}, ["Sun", "angle"]),
        ({"lamps": [SUN | {"towards": [0, 0, 0]}]}, ["Sun", "towards"]),
        ({"lamps": [{"type": "laser", "name": "Beam"}]}, ["Beam", "laser"]),
        ({"materials": {"gray": {"velvet": [1, 1, 1]}}}, ["gray", "velvet"]),
        ({"materials": {"gray": {"diffuse": {"image": "lost"}}}}, ["gray", "lost"]),
        ({"bounces": {"total": -1}}, ["bounces", "total"]),
        ({"film": {"filter": "LANCZOS"}}, ["LANCZOS"]),
    ],
)
def test_what_light_can_not_be_is_refused_by_name(tmp_path, capfd, changes, words):
    sentence = refusal(tmp_path, capfd, **changes)
    assert all(word in sentence for word in words), sentence


def test_more_samples_than_there_are_random_numbers_are_refused_or_taken(tmp_path, capfd):
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps(LIT_SCENE))
    assert main(["render", str(scene), str(tmp_path / "out.exr"), "--level", "path", "--samples", "0"]) == 2
    assert "--samples" in capfd.readouterr().err
