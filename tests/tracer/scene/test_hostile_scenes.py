"""Every number of a scene file, replaced by every hostile one: the picture holds finite numbers, or a sentence says why not."""

import copy
import json
import math

import numpy as np
import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import LARGEST, Mesh, Object, Scene, Spheres, scene_file

pytestmark = pytest.mark.usefixtures("no_warnings")

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
