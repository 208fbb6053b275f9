"""A world that is an image: it is seen where it stands, and gives surfaces what its integral over their sky is."""

import numpy as np
import pytest
from core_probes import ScatteredBy

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.colors import RGBE
from viewcam_addon.tracer.scene.film import Film
from viewcam_addon.tracer.scene.lamps import World
from viewcam_addon.tracer.scene.materials import Material, Picture
from viewcam_addon.tracer.scene.shader_nodes import node

DOWN = Pinhole((0, 0, 2), (0, 0, 0), (0, 1, 0), 60, 32, 32)
WHITE = (1.0, 1.0, 1.0)


@pytest.fixture
def room():
    """16 × 32 pixels, dim but for a window of two by two."""
    pixels = np.random.default_rng(0).uniform(0.0, 0.2, (16, 32, 3)).astype(np.float32)
    pixels[10:12, 20:22] = 40.0, 20.0, 10.0
    return Picture(pixels)


def light_of(make_lit, make_mesh, surface, world, picture, level="direct", samples=64, camera=DOWN, threads=2):
    floor = make_mesh([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)], [(0, 1, 2), (0, 2, 3)])
    bodies = [] if surface is None else [(floor, Material(surface=surface))]
    scene = make_lit(camera, *bodies, world=world, images={"room": picture}, film=Film("BOX"))
    return render(scene, level, samples, threads=threads)


def above_the_floor(rows):
    """(n, 3) directions in the middle of cells of equal solid angle."""
    z, turn = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(2 * rows) + 0.5) / rows * np.pi, indexing="ij")
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1).reshape(-1, 3)


def looked_up(picture, directions):
    """The image in the directions (n, 3), as Blender's manual has it: blends wrap around both ways."""
    height, width, _ = picture.pixels.shape
    column = (0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)) * width - 0.5
    row = (1 - np.arccos(directions[:, 2]) / np.pi) * height - 0.5
    x, y = np.floor(column).astype(int), np.floor(row).astype(int)
    total = 0.0
    for dx, wx in ((0, 1 - column + x), (1, column - x)):
        for dy, wy in ((0, 1 - row + y), (1, row - y)):
            total = total + (wx * wy)[:, None] * picture.pixels[(y + dy) % height, (x + dx) % width]
    return total


def test_the_eye_sees_the_image_where_it_stands(make_lit, make_mesh, room):
    for turn in (0.0, 0.7):
        passes = light_of(make_lit, make_mesh, None, World(WHITE, image="room", rotation=(0, 0, turn)), room, samples=1)
        columns, rows = np.meshgrid(np.arange(32), np.arange(32))
        directions = DOWN.ray_directions(columns.ravel(), rows.ravel())
        cos, sin = np.cos(turn), np.sin(turn)
        turned = directions @ np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]).T
        np.testing.assert_allclose(passes["Environment"].reshape(-1, 3), looked_up(room, turned), rtol=1e-6)


@pytest.mark.parametrize(
    ("surface", "share"),
    [
        (node("diffuse", color=WHITE), 1.0),
        (node("mix", first=node("diffuse", color=WHITE), second=node("translucent", color=WHITE)), 0.5),
    ],
)
def test_a_floor_gets_what_its_sky_gives(make_lit, make_mesh, room, surface, share):
    directions = above_the_floor(600)
    above = 2 * (looked_up(room, directions) * directions[:, 2:]).mean(axis=0)
    below = 2 * (looked_up(room, directions * (1, 1, -1)) * directions[:, 2:]).mean(axis=0)
    passes = light_of(make_lit, make_mesh, surface, World(WHITE, image="room"), room)
    values = passes["Combined"][..., :3].reshape(-1, 3).astype(np.float64)
    error = values.std(axis=0) / np.sqrt(len(values))
    expected = share * above + (1 - share) * below
    assert (error < 0.01 * expected).all(), "the window is found"
    assert (np.abs(values.mean(axis=0) - expected) < 4 * error).all(), (values.mean(axis=0), expected, error)


@pytest.mark.parametrize("roughness", [0.5, 0.8])
def test_a_rough_mirror_shows_what_its_integral_over_the_image_is(make_lit, make_mesh, room, roughness):
    surface = node("glossy", color=WHITE, roughness=roughness)
    directions = above_the_floor(300)
    light = ScatteredBy(surface, (0, 0, -1), directions.T, np.zeros((3, len(directions)))).light.T
    expected = 2 * np.pi * (light * looked_up(room, directions)).mean(axis=0)
    far = Pinhole((0, 0, 2), (0, 0, 0), (0, 1, 0), 1e5, 32, 32)  # so that all of the picture is seen straight from above
    passes = light_of(make_lit, make_mesh, surface, World(WHITE, image="room"), room, camera=far)
    values = passes["Combined"][..., :3].reshape(-1, 3).astype(np.float64)
    error = values.std(axis=0) / np.sqrt(len(values))
    assert (error < 0.01 * expected).all() and (np.abs(values.mean(axis=0) - expected) < 4 * error).all(), (
        values.mean(axis=0),
        expected,
    )


def test_an_image_that_is_white_is_a_white_world(make_lit, make_mesh):
    white = Picture(np.ones((4, 8, 3), np.float32))
    for surface in (node("diffuse", color=WHITE), node("glossy", color=WHITE, roughness=0.5)):
        image, plain = (
            light_of(make_lit, make_mesh, surface, world, white)["Combined"][..., :3].mean()
            for world in (World(WHITE, image="room"), World(WHITE))
        )
        assert image == pytest.approx(plain, abs=3e-3)


def test_a_world_without_its_image_is_refused(make_lit):
    with pytest.raises(InputError, match="the world names the image 'sky'"):
        make_lit(DOWN, world=World(WHITE, image="sky"))


def test_an_encoded_image_of_bytes_is_sampled_as_one_whose_pixels_are_beside_bytes(make_lit, make_mesh):
    """Bytes are decoded by a table where their light is added up, all else by the formula."""
    levels = np.random.default_rng(0).integers(0, 90, (16, 32, 3))
    levels[10:12, 20:22] = 255, 200, 150
    surface, world = node("diffuse", color=WHITE), World(WHITE, image="room")
    of_bytes, beside = (
        light_of(make_lit, make_mesh, surface, world, Picture(((levels + off) / 255).astype(np.float32), srgb=True))
        for off in (0.0, 2.0**-9)
    )
    # The light of an encoded level k of 255 changes by 2.4/k of a level's change, and at most by 1/12.92 of it for dark ones.
    np.testing.assert_allclose(of_bytes["Combined"], beside["Combined"], rtol=0.02)
    actual = of_bytes["Combined"][..., :3].reshape(-1, 3)
    assert (actual.std(axis=0) < 0.1 * actual.mean(axis=0)).all(), "the window is found"


@pytest.mark.parametrize("srgb", [False, True])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float16, RGBE])
def test_an_image_of_small_numbers_is_sampled_to_the_bit_as_its_floats_are_on_any_number_of_threads(
    make_lit, make_mesh, dtype, srgb
):
    rng = np.random.default_rng(0)
    levels = rng.integers(0, 256, (64, 128, 3)).astype(dtype)
    if dtype == RGBE:
        levels = rng.integers(0, 2**24, (64, 128, 1), dtype) | (rng.integers(128, 138, (64, 128, 1), dtype) << 24)
    small = Picture(levels / np.float16(64) if dtype == np.float16 else levels, srgb)
    surface, world = node("diffuse", color=WHITE), World(WHITE, image="room")
    result = {
        light_of(make_lit, make_mesh, surface, world, picture, samples=4, threads=threads)["Combined"].tobytes()
        for picture in (small, Picture(small.values, srgb))
        for threads in (1, 2, 5)
    }
    assert len(result) == 1
    pixels = small.values.copy()
    pixels[-9:] *= 1.5
    other = light_of(make_lit, make_mesh, surface, world, Picture(pixels, srgb), samples=4)["Combined"].tobytes()
    assert other not in result
