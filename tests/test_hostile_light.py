"""Scene files that break renderers, given to `viewcam render` as a user would: a right picture, or one sentence."""

import json

import numpy as np
import pytest

from viewcam_addon import image
from viewcam_addon.cli import main

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
SCENE = {
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


def render(folder, level="path", samples=16, **changes):
    """The Combined pass of the scene with other keys; it must hold numbers, none of them negative."""
    scene, picture = folder / "scene.json", folder / "out.exr"
    scene.write_text(json.dumps(SCENE | changes))
    status = main(["render", str(scene), str(picture), "--level", level, "--samples", str(samples)])
    assert status == 0
    passes = image.read(picture).passes
    for name in ("Combined", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color", "Emission", "Environment"):
        assert np.isfinite(passes[name]).all() and (passes[name] >= 0).all(), name
    return passes["Combined"][..., :3]


def refusal(folder, capfd, **changes):
    """The sentence with which the scene is refused."""
    scene, picture = folder / "scene.json", folder / "out.exr"
    scene.write_text(json.dumps(SCENE | changes))
    assert main(["render", str(scene), str(picture), "--level", "path"]) == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and "bug" not in lines[0], lines
    assert not picture.exists()
    return lines[0]


@pytest.mark.parametrize("level", ["direct", "path"])
def test_without_lamps_all_is_black(tmp_path, level):
    assert not render(tmp_path, level).any()


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
    np.testing.assert_allclose(render(tmp_path, lamps=[SUN, lamp], bounces={"total": 0}), LIT, rtol=4 * FLOAT32)


def test_black_surfaces_stay_black(tmp_path):
    assert not render(tmp_path, lamps=[SUN], materials={"gray": {"diffuse": [0, 0, 0]}}).any()


def test_surfaces_that_reflect_more_than_they_get_shine_brighter(tmp_path):
    picture = render(tmp_path, lamps=[SUN], materials={"gray": {"diffuse": [1.5, 2, 20]}})
    np.testing.assert_allclose(picture, np.broadcast_to(np.array([1.5, 2, 20]) / np.pi, picture.shape), rtol=4 * FLOAT32)


def test_a_closed_box_that_reflects_more_than_it_gets_ends_with_its_bounces(tmp_path):
    """Radiance E Σ ρⁿ over the bounces and one scattering more."""
    camera = SCENE["camera"] | {"eye": [0.1, 0.2, 0.3], "look_at": [1, 0, 0], "up": [0, 0, 1]}
    picture = render(
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
    scene.write_text(json.dumps(SCENE | changes).replace('"COLOR"', color))
    assert main(["render", str(scene), str(tmp_path / "out.exr"), "--level", "path"]) == 2
    lines = capfd.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and "bug" not in lines[0], lines
    assert number in ("NaN", "Infinity") or {"material": "gray", "lamp": "Sun", "world": "world"}[owner] in lines[0], lines[0]


@pytest.mark.parametrize("power", [1e10, 1e17])
def test_a_lamp_of_any_power_lights_in_proportion(tmp_path, power):
    lamp = {"type": "point", "name": "Lamp", "position": [0, 0, 3]}
    dim = render(tmp_path, "direct", lamps=[lamp | {"power": [1, 1, 1]}])
    bright = render(tmp_path, "direct", lamps=[lamp | {"power": [power] * 3}])
    np.testing.assert_allclose(bright / power, dim, rtol=4 * FLOAT32)


def test_five_thousand_lamps_light_as_one_that_has_their_power(tmp_path):
    """All in one place: the choice among them makes no noise, so that one sample a pixel is exact."""
    lamps = [{"type": "point", "name": f"Lamp {i}", "position": [0, 0, 3], "power": [1, 1, 1]} for i in range(5000)]
    bright = render(tmp_path, "direct", lamps=[lamps[0] | {"power": [5000] * 3}], samples=1)
    many = render(tmp_path, "direct", lamps=lamps, samples=1)
    np.testing.assert_allclose(many, bright, rtol=1e-5)


def test_five_thousand_lamps_all_over_the_place_light_what_their_sum_does(tmp_path):
    rng = np.random.default_rng(1)
    places = rng.uniform((-4, -4, 0.5), (4, 4, 3), (5000, 3))
    powers = rng.uniform(0, 2, 5000)
    lamps = [
        {"type": "point", "name": f"Lamp {i}", "position": list(place), "power": [power] * 3}
        for i, (place, power) in enumerate(zip(places.tolist(), powers.tolist(), strict=True))
    ]
    picture = render(tmp_path, "direct", lamps=lamps, samples=256)
    camera = SCENE["camera"]
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
    picture = render(
        tmp_path,
        camera=SCENE["camera"] | {"eye": [0.1, 0.2, 0.3], "look_at": [1, 0, 0], "up": [0, 0, 1]},
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
    camera = SCENE["camera"] | {"eye": [0.1, 0.2, 0.3], "look_at": [1, 0, 0], "up": [0, 0, 1]}
    lamps = [SUN, {"type": "point", "name": "Lamp", "position": [3, 0, 0], "power": [1000] * 3, "radius": 0.5}]
    room = [{"name": "room", "geometry": "cube", "materials": ["gray"]}]
    assert not render(tmp_path, camera=camera, objects=room, lamps=lamps, world={"radiance": [1, 1, 1]}).any()


def test_a_lamp_inside_a_closed_mesh_lights_it_and_nothing_else(tmp_path):
    lamps = [{"type": "point", "name": "Lamp", "position": [0, 0, 0], "power": [100] * 3}]
    objects = [
        {"name": "box", "geometry": "cube", "location": [0, 0, 1.5], "materials": ["gray"]},
        *SCENE["objects"],
    ]
    inside = [lamps[0] | {"position": [0, 0, 1.5]}]
    assert not render(tmp_path, objects=objects, lamps=inside).any()
    assert render(tmp_path, objects=objects, lamps=[lamps[0] | {"position": [3, 0, 4]}]).any()


def test_a_point_lamp_on_a_surface_is_no_division_by_zero(tmp_path):
    picture = render(tmp_path, "direct", lamps=[{"type": "point", "name": "Lamp", "position": [0, 0, 0], "power": [1] * 3}])
    assert picture.max() < 1e-6, "seen along the surface it brings nothing"


def test_a_scene_of_nothing_is_the_world(tmp_path):
    picture = render(tmp_path, objects=[], world={"radiance": [0.25, 0.5, 1]})
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
    scene.write_text(json.dumps(SCENE))
    assert main(["render", str(scene), str(tmp_path / "out.exr"), "--level", "path", "--samples", "0"]) == 2
    assert "--samples" in capfd.readouterr().err
