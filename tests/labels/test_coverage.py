"""Coverage: areas on paper, masks at the centres, and Cryptomatte as it is specified."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import viewcam_addon as vp
from viewcam_addon import image
from viewcam_addon.labels import coverage, files
from viewcam_addon.labels.surfaces import Surfaces
from viewcam_addon.tracer.scene import Object, Scene

from .conftest import CAMERA, mesh, moved, room

STEP = 1 / coverage.SAMPLES
CRYPTOMATTE = "cryptomatte/542cafa"


def soft(found, name, number=0):
    told = next(each for each in found.instances if (each["name"], each["number"]) == (name, number))
    return coverage.soft_mask(found.image, told["coverage"]["name"])


def board(left, low, right, high):
    """Seen from the origin along −z, 1 away: a rectangle in the pixels of a picture of 8 × 6, x right and y up."""
    corners = [((x - 4) / 10, (y - 3) / 10, -1) for x, y in ((left, low), (right, low), (right, high), (left, high))]
    camera = vp.Pinhole((0, 0, 0), (0, 0, -1), (0, 1, 0), 10, 8, 6)
    return Scene(camera, {"board": mesh(corners, [(0, 1, 2), (0, 2, 3)])}, (Object("Board", "board", np.eye(4)),))


@settings(max_examples=15)
@given(st.floats(0.01, 7.99), st.floats(0.01, 7.99), st.floats(0.01, 5.99), st.floats(0.01, 5.99))
def test_a_rectangle_covers_what_it_covers_on_paper(discrepancy, x, other_x, y, other_y):
    (left, right), (low, high) = sorted((x, other_x)), sorted((y, other_y))
    if right - left < 1e-6 or high - low < 1e-6:
        return
    found = vp.label(board(left, low, right, high), ("coverage",))
    columns = np.clip(np.minimum(right, np.arange(1, 9)) - np.maximum(left, np.arange(8)), 0, 1)
    rows = np.clip(np.minimum(high, np.arange(1, 7)) - np.maximum(low, np.arange(6)), 0, 1)
    expected = rows[:, None] * columns
    name = found.instances[0]["coverage"]["name"] if found.instances else "Board"
    off = np.abs(coverage.soft_mask(found.image, name) - expected).max()
    assert off <= discrepancy, f"a pixel is {off:.3f} off"


@pytest.fixture(scope="module")
def discrepancy():
    """How much a box in the pixel may differ from its share of the places, found by trying all boxes between them."""
    i = np.arange(coverage.SAMPLES)
    points = np.stack([(i + 0.5) * STEP, (i * coverage._STEP % coverage.SAMPLES + 0.5) * STEP])
    edges = np.append(np.append(0.0, (i + 0.5) * STEP), 1.0)
    table = np.histogram2d(*points, bins=[np.append(i * STEP, 1.0)] * 2)[0]
    sums = np.pad(table.cumsum(0).cumsum(1), ((1, 0), (1, 0)))  # of the places below each pair of edges
    worst = 0.0
    for a in range(len(i) + 1):
        for b in range(a, len(i) + 1):
            strip = sums[b] - sums[a]
            counts = strip[None, :] - strip[:, None]
            j = np.arange(len(i) + 1)
            is_box = j[None, :] >= j[:, None]
            # Between the last place that is left out and the first that is in, the box's edges may be anywhere.
            widest = (edges[min(b + 1, len(i) + 1)] - edges[a]) * (edges[j + 1][None, :] - edges[j][:, None])
            least = max(edges[b] - edges[a + 1], 0) * np.maximum(edges[j][None, :] - edges[j + 1][:, None], 0)
            worst = max(worst, np.abs(counts * STEP - widest)[is_box].max(), np.abs(counts * STEP - least)[is_box].max())
    return worst


def test_a_lattice_is_more_even_than_a_grid_of_as_many():
    """An upright edge that moves through a pixel: a grid of 6 × 6 is off by a twelfth."""
    places = np.linspace(0.005, 0.995, 19)
    shares = [soft(vp.label(board(0.5, 1, 3 + x, 5), ("coverage",)), "Board")[2, 3] for x in places]
    assert np.abs(shares - places).max() <= STEP / 2 + 1e-6


def test_shares_add_up_and_hold_the_masks_at_the_centres():
    found = vp.label(room(), ("masks", "coverage"))
    shares = [soft(found, each["name"], each["number"]) for each in found.instances]
    hit = found.image["Instance"][..., 0] != 0
    total = np.sum(shares, axis=0)
    assert total.max() <= 1 + 1e-6 and (total[hit] > 0).all()
    ids = found.image["Instance"][..., 0]
    for each, share in zip(found.instances, shares, strict=True):
        assert (share[ids == each["id"]] > 0).all(), "what is at the centre covers some of the pixel"
        assert ((share > 0) & (share < 1)).any()
        assert each["coverage"]["area"] == pytest.approx(share.sum(), rel=1e-6)
        if each["visible"]:
            edge = 2 * (each["visible"]["bbox"][2] + each["visible"]["bbox"][3])
            assert abs(each["coverage"]["area"] - each["visible"]["area"]) <= edge
    layers = [name for name in found.image.passes if name.startswith("Crypto")]
    ranks = np.concatenate([found.image[name][..., 1::2] for name in layers], axis=-1)
    assert (np.diff(ranks, axis=-1) <= 0).all() and ranks[..., -2:].any(), "the largest first, and no layer for nothing"


def test_another_place_in_the_pixels_is_the_camera_shifted_and_leaves_the_centres_as_they_were(scene):
    surfaces = Surfaces(scene)
    there = surfaces.instances_at((0.2, 0.9))
    aside = replace(scene, camera=CAMERA.cropped(-0.3, 0.4, CAMERA.width, CAMERA.height))
    np.testing.assert_array_equal(there, Surfaces(aside).instance)
    np.testing.assert_array_equal(surfaces.instance, Surfaces(scene).instance)
    assert (there != surfaces.instance).any()


def test_an_object_behind_another_or_smaller_than_a_pixel_counts_for_what_is_seen_of_it():
    small = moved(-3, -3, 0.5, 0.2, 0.004)  # a cube a twentieth of a pixel wide
    scene = room(cubes=np.array([small, moved(1.6, 0.5, 0.4, 0.3, 0.4)]), camera=replace(CAMERA, width=64, height=48))
    found = vp.label(scene, ("coverage",))
    names = {each["coverage"]["name"] for each in found.instances}
    assert "Cube #1" in names and "Ball" in names
    assert all(each["coverage"]["area"] > 0 for each in found.instances)


def test_the_file_is_cryptomatte(tmp_path):
    found = vp.label(room(), ("coverage",))
    files.write(tmp_path / "shot.exr", found)
    read = image.read(tmp_path / "shot.labels.exr")
    assert read.attributes[f"{CRYPTOMATTE}/name"] == "ViewLayer.CryptoObject"
    assert read.attributes[f"{CRYPTOMATTE}/hash"] == "MurmurHash3_32"
    assert read.attributes[f"{CRYPTOMATTE}/conversion"] == "uint32_to_float32"
    manifest = json.loads(read.attributes[f"{CRYPTOMATTE}/manifest"])
    assert set(manifest) == {each["coverage"]["name"] for each in found.instances}
    held = {int(value) for name in read.passes for value in np.unique(read[name][..., ::2].copy().view(np.uint32))} - {0}
    assert held == {int(value, 16) for value in manifest.values()}
    for name in found.image.passes:
        np.testing.assert_array_equal(read[name].view(np.uint32), found.image[name].view(np.uint32))


def test_ids_are_those_that_blender_gives():
    """Read from files that Blender wrote; the last two are such whose float would be none."""
    ours = {name: f"{coverage.murmur3(name.encode()):08x}" for name in ("Quad", "Floor", "Mä t", "o14", "o108")}
    assert ours == {"Quad": "a9947c8d", "Floor": "6a2fb16e", "Mä t": "9e9d1370", "o14": "ff9c08d6", "o108": "8061a038"}
    assert [coverage._hex(coverage._mark(name)) for name in ("o14", "o108")] == ["ff1c08d6", "80e1a038"]


def test_a_name_that_another_object_has_is_not_given_to_a_copy():
    scene = room()
    floor = replace(scene.objects[0], name="Cube #1")
    found = vp.label(replace(scene, objects=(floor, *scene.objects[1:])), ("coverage",))
    names = [each["coverage"]["name"] for each in found.instances]
    assert sorted(names) == ["Ball", "Cube", "Cube #1", "Cube #1#"]
