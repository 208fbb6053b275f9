"""Lamps whose light nodes change, and displacements, in pictures whose answer is known on paper."""

import json
from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import ies, scene_file
from viewcam_addon.tracer.scene.lamps import Area, Point, Spot, Sun
from viewcam_addon.tracer.scene.materials import Color, Material, Picture, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

DOWN = Pinhole((0, 0, 4), (0, 0, 0), (0, 1, 0), 40, 32, 24)
"""Looks down at the origin, where a pixel is 0.1 wide."""
POWER, HEIGHT = 100.0, 3.0
LAMP = Point("lamp", position=(0.0, 0.0, HEIGHT), power=(POWER,) * 3)
WAY = node("light_path", output="ray_length")
SQUARED = node("math", operation="multiply", a=WAY, b=WAY)
# A picture is a mean of float64, rounded once.
EXACT = 4 * 2.0**-24

CANDELA = 1 / 0.0706650768394  # candela of a lamp's watt: 177.83 / 4π


def ies_text(across, up, values, kind=1, factor=1.0):
    """The text of an IES file. values : (across, up), candela."""
    rows = [across, *np.reshape(values, (len(across), len(up)))]
    numbers = "\n".join(" ".join(f"{number:.9g}" for number in row) for row in (up, *rows))
    return (
        f"IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 -1 {factor} {len(up)} {len(across)} {kind} 2 0 0 0\n1 1 100\n{numbers}\n"
    )


def lambert(albedo) -> Material:
    return sum_of(diffuse=Color((albedo,) * 3))


def square(make_mesh, half=1.0):
    corners = [[-half, -half, 0], [half, -half, 0], [half, half, 0], [-half, half, 0]]
    return make_mesh(corners, [[0, 1, 2], [0, 2, 3]])


@pytest.fixture
def floor(make_mesh, make_lit):
    """floor(lamp, …, samples=1) → (light on a white floor, radius r² and cosine there): (height, width)."""

    def show(*lamps, samples=1):
        scene = make_lit(DOWN, (square(make_mesh, 9.0), lambert(1.0)), lamps=lamps)
        columns, rows = np.meshgrid(
            (np.arange(DOWN.width) + 0.5 - DOWN.width / 2) / 10, (np.arange(DOWN.height) + 0.5 - DOWN.height / 2) / 10
        )
        squared = columns**2 + rows**2 + HEIGHT**2
        return (
            render(scene, "direct", samples, threads=1)["Combined"][..., 0].astype(np.float64),
            squared,
            HEIGHT / np.sqrt(squared),
        )

    return show


FALLOFFS = {
    "quadratic": (None, lambda squared: 1 / squared),
    "linear": (WAY, lambda squared: 1 / np.sqrt(squared)),
    "constant": (SQUARED, lambda squared: 1.0),
    "smooth": (
        node("math", operation="divide", a=SQUARED, b=node("math", operation="add", a=SQUARED, b=2.0)),
        lambda squared: 1 / (2.0 + squared),
    ),
}


@pytest.mark.parametrize("falloff", FALLOFFS)
def test_light_falls_off_as_its_way_says(floor, falloff):
    """E = P/(4π) · f(r) · cos θ, of which a white floor shows E/π."""
    emission, falls_off = FALLOFFS[falloff]
    rendered, squared, cosine = floor(replace(LAMP, emission=emission))
    expected = POWER / (4 * np.pi**2) * falls_off(squared) * cosine
    np.testing.assert_allclose(rendered, expected, rtol=EXACT)


@pytest.mark.parametrize("falloff", ["linear", "constant", "smooth"])
def test_a_falloff_that_is_a_little_wrong_is_found(floor, falloff):
    emission, falls_off = FALLOFFS[falloff]
    wrong = node("math", operation="power", a=emission, b=1.00001)
    rendered, squared, cosine = floor(replace(LAMP, emission=wrong))
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(rendered, POWER / (4 * np.pi**2) * falls_off(squared) * cosine, rtol=EXACT)


@pytest.mark.parametrize(
    ("kind", "across", "up"),
    [
        (1, [0], [0, 45, 90, 180]),
        (1, [0, 90], [0, 90, 180]),
        (1, [0, 30, 180], [0, 180]),
        (3, [-90, 0, 90], [-90, 90]),
        (2, [-90, 90], [-90, 0, 90]),
    ],
)
def test_a_table_of_one_candela_is_a_plain_lamp(floor, kind, across, up):
    """In all quadrants that a table tells or mirrors; files of the types A and B tell the half that lies ahead."""
    text = ies_text(across, up, np.full((len(across), len(up)), 25.0), kind, factor=2.0)
    shines = node(
        "ies", text=text, strength=0.5, vector=(-0.3, 0.2, -1.0) if kind != 1 else node("geometry", output="incoming")
    )
    rendered, *_ = floor(replace(LAMP, emission=shines))
    plain, *_ = floor(replace(LAMP, power=(POWER * 25.0 / CANDELA,) * 3))
    np.testing.assert_allclose(rendered, plain, rtol=EXACT)


def test_between_the_angles_of_a_table_light_goes_on_as_it_grows(floor):
    """Catmull's and Rom's cubics are straight over three even steps; the floor is seen below 32°."""
    up = [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 90.0]
    rendered, _, cosine = floor(replace(LAMP, emission=node("ies", text=ies_text([0.0], up, [angle + 10.0 for angle in up]))))
    plain, *_ = floor(replace(LAMP, power=(POWER / CANDELA,) * 3))
    angle = np.degrees(np.arccos(cosine))
    inner = angle > 10  # below, the table is mirrored at its pole
    np.testing.assert_allclose(rendered[inner], (plain * (angle + 10))[inner], rtol=1e-6)


def test_a_table_turns_about_the_lamp(floor):
    """A lobe at an angle across is where x sinks and y rises with it: 90° is towards −x, as in Cycles."""
    across = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0, 360.0]
    values = [[100.0 if angle == 90.0 else 0.0] * 2 for angle in across]
    rendered, *_ = floor(replace(LAMP, emission=node("ies", text=ies_text(across, [0.0, 90.0], values))))
    middle = DOWN.width // 2
    assert rendered[:, :middle].sum() > 20 * rendered[:, middle:].sum()


HALF = node("math", operation="greater_than", a=node("separate", color=node("geometry"), output="x"), b=0.0)


def test_a_panel_that_is_half_dark_is_half_a_panel(make_mesh, make_lit):
    matrix, half = np.eye(4), np.eye(4)
    matrix[2, 3] = half[2, 3] = 2.0
    half[0, 3] = 0.5
    panel = Area("panel", matrix=matrix, size=(2.0, 1.0), power=(POWER,) * 3, emission=HALF)
    narrow = Area("panel", matrix=half, size=(1.0, 1.0), power=(POWER / 2,) * 3)
    floor = square(make_mesh, 9.0), lambert(0.5)
    expected = render(make_lit(DOWN, floor, lamps=(narrow,)), "direct", 1024, threads=1)["Combined"][..., :3].mean()
    rendered = render(make_lit(DOWN, floor, lamps=(panel,)), "direct", 256, threads=1)
    error = np.sqrt(rendered["Variance"][..., :3].astype(np.float64).sum()) / rendered["Variance"][..., :3].size
    assert error < 0.002 * expected
    assert abs(rendered["Combined"][..., :3].mean() - expected) < 4 * error  # both sides' error, of which the other has less


def test_a_panel_shows_what_lights(make_mesh, make_lit):
    """Its radiance is P/(π A), and a camera sees the half that shines."""
    matrix = np.diag([1.0, -1.0, -1.0, 1.0])  # shines upwards
    panel = Area("panel", matrix=matrix, size=(2.0, 1.0), power=(POWER,) * 3, emission=HALF)
    rendered = render(make_lit(DOWN, lamps=(panel,)), "direct", 1, threads=1)["Combined"][..., 0]
    row = rendered[DOWN.height // 2]
    middle = DOWN.width // 2
    np.testing.assert_allclose(row[middle : middle + 9], POWER / (2 * np.pi), rtol=EXACT)
    assert not row[:middle].any()


def test_a_lamp_that_nodes_color_everywhere_alike_is_that_colored_lamp(floor):
    warm = node("blackbody", temperature=2500.0)
    colored, *_ = floor(replace(LAMP, emission=node("mix_color", factor=1.0, a=warm, b=(0.5, 0.0, 0.0))))
    plain, *_ = floor(replace(LAMP, power=(POWER / 2, 0.0, 0.0)))
    assert (colored == plain).all()


@pytest.mark.parametrize("count", [2, 6])
def test_lamps_with_nodes_light_what_each_does(floor, count):
    """Each of few lamps is sampled, and of more one by chance, whose nodes are no part of the choice."""
    lamps = [replace(LAMP, name=str(number), emission=(WAY, SQUARED)[number % 2]) for number in range(count)]
    rendered = floor(*lamps, samples=1 if count == 2 else 256)[0]
    alone = count // 2 * (floor(lamps[0])[0] + floor(lamps[1])[0])
    if count == 2:
        np.testing.assert_allclose(rendered, alone, rtol=EXACT)
    else:  # a linear falloff brings a third of a constant one here: half of that from the mean, by √(256 · pixels)
        assert abs(rendered.sum() / alone.sum() - 1) < 4 * 0.5 / np.sqrt(256 * rendered.size)


def test_a_file_gives_back_a_lamps_nodes_and_a_displacement(make_mesh, make_lit, tmp_path):
    image = node("image", image=Color((1, 1, 1), "gobo"), vector=node("geometry"))
    text = ies_text([0.0], [0.0, 90.0], [3.0, 1.0])
    lamps = (
        replace(LAMP, emission=WAY),
        Spot("spot", matrix=np.eye(4), emission=image),
        Sun("sun", emission=node("ies", text=text, strength=0.5)),
        Area("area", matrix=np.eye(4), emission=HALF),
    )
    material = replace(lambert(0.5), displacement=node("noise", scale=3.0))
    scene = make_lit(DOWN, (square(make_mesh), material), lamps=lamps, images={"gobo": Picture(np.ones((2, 2, 3), np.float32))})
    path = tmp_path / "scene.json"
    scene_file.write(scene, path)
    read = scene_file.read(path)
    assert [lamp.emission for lamp in read.lamps] == [lamp.emission for lamp in lamps]
    assert read.materials["material 0"] == material
    assert json.loads(path.read_text())["lamps"][0]["emission"] == {"type": "light_path", "output": "ray_length"}


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: replace(LAMP, emission=node("emission")), "emission of light 'lamp' is a shader"),
        (lambda: Material(displacement=node("diffuse")), "displacement of a material is a shader"),
        (lambda: node("ies"), "has no text"),
        (lambda: node("ies", text="IESNA"), "no line TILT="),
        (lambda: node("ies", text=ies_text([0], [0, 90], [1, 1])[:-8]), "ends too early"),
        (lambda: node("ies", text=ies_text([0], [90, 0], [1, 1])), "do not ascend"),
        (lambda: node("ies", text=ies_text([0], [0, 90], [1, 1], kind=7)), "type A, B or C"),
        (lambda: node("ies", text=ies_text([0], [0, 90], [1, 1]).replace("100\n", "1e99\n")), "1e99"),
        (lambda: node("ies", text=ies_text([0], [0, 90], [1, 1]).replace("100\n", "9" * 400 + "\n")), r"number '9{30,80}…"),
        (lambda: node("ies", text=ies_text([0], [0, 90], [1, 1]).replace("100\n", "x" * 400 + "\n")), "x…"),
    ],
)
def test_what_is_none_is_refused_in_a_sentence(make, words):
    with pytest.raises(InputError, match=words) as caught:
        make()
    assert str(caught.value).count(": ") >= 1


def test_a_lamp_names_an_image_of_the_scene(make_mesh, make_lit):
    gobo = replace(LAMP, emission=node("image", image=Color((1, 1, 1), "gobo")))
    with pytest.raises(InputError, match="emission of light 'lamp' names the image 'gobo'"):
        make_lit(DOWN, (square(make_mesh), lambert(1.0)), lamps=(gobo,))


# Displacements


def test_a_displacement_turns_the_floor_as_its_slope_says(make_mesh, make_lit):
    """A height s·x turns the normal to (−s, 0, 1)/√(1 + s²); nothing moves."""
    slope = 0.5
    height = node("math", operation="multiply", a=node("separate", color=node("geometry"), output="x"), b=slope)
    sun = Sun("sun", towards=(0.6, 0.0, 0.8), irradiance=(np.pi,) * 3)
    camera = Pinhole((0.2, 0.1, 4), (0, 0, 0), (0, 1, 0), 40, 16, 12)

    def show(**keywords):
        scene = make_lit(camera, (square(make_mesh, 9.0), replace(lambert(0.5), **keywords)), lamps=(sun,))
        return render(scene, "direct", 1, threads=1)["Combined"][..., 0].astype(np.float64)

    cosine = (0.8 - 0.6 * slope) / np.sqrt(1 + slope**2)
    np.testing.assert_allclose(show(displacement=height), 0.5 * cosine, rtol=1e-6)
    np.testing.assert_allclose(show(), 0.5 * 0.8, rtol=EXACT)


def test_types_and_quadrants_of_tables_are_told_alike():
    """One lobe in three types of files: B's angles change places, A's begin at the left."""
    up, across = [0.0, 90.0], [0.0, 90.0]
    table = ies.read("it", ies_text(across, up, [[4.0, 2.0], [3.0, 1.0]]))
    assert table.across.tolist() == [0.0, 90.0, 180.0, 270.0, 360.0] and table.up.tolist() == up
    assert (table.watts[:, 0] * CANDELA).tolist() == pytest.approx([4.0, 3.0, 4.0, 3.0, 4.0])
    table = ies.read("it", ies_text([-90.0, 90.0], [-90.0, 90.0], [[4.0, 2.0], [3.0, 1.0]], kind=3))
    assert (table.across.tolist(), table.up.tolist()) == ([90.0, 270.0], [0.0, 180.0])
    assert (table.watts[:, 0] * CANDELA).tolist() == pytest.approx([3.0, 4.0])
    table = ies.read("it", ies_text([0.0, 90.0], [0.0, 90.0], [[4.0, 2.0], [3.0, 1.0]], kind=2))
    assert (table.across.tolist(), table.up.tolist()) == ([0.0, 90.0, 180.0],) * 2
    assert (table.watts * CANDELA).ravel().tolist() == pytest.approx([1.0, 2.0, 1.0, 3.0, 4.0, 3.0, 1.0, 2.0, 1.0])
    across = [0.0, 120.0, 240.0]  # the last of which goes on to the first
    table = ies.read("it", ies_text(across, up, [[4.0, 2.0], [3.0, 1.0], [2.0, 1.0]]))
    assert table.across.tolist() == [*across, 360.0] and table.watts[3, 0] == table.watts[0, 0]
