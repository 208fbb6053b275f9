"""A check must be able to fail: every fault that a camera or a renderer can have is found, in geometry and in light.

Light is compared at the samples stated. Both sides are the tracer's own, with other seeds: the right one passes, and each
fault is made in the scene or in the formulas that light goes through.
"""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison.geometry import compare
from viewcam_addon.comparison.radiance import compare as compare_light
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Area, Sun, World
from viewcam_addon.tracer.scene.materials import Color, Material, Picture, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

pytestmark = pytest.mark.slow


PASSES = ("Depth", "Position", "Normal", "UV", "Object Index", "Material Index")


def changed(image, **changes):
    """The picture with some passes put through a function; underscores stand for blanks in their names."""
    passes = dict(image.passes)
    for name, change in changes.items():
        passes[name.replace("_", " ")] = change(passes[name.replace("_", " ")].copy())
    return replace(image, passes=passes)


def everywhere(image, change):
    return replace(image, passes={name: change(values) for name, values in image.passes.items()})


def with_hole(image, background):
    """A disc of background amid the picture."""
    rows, columns = np.mgrid[: image.size[1], : image.size[0]]
    inside = (rows - image.size[1] / 3) ** 2 + (columns - image.size[0] / 2) ** 2 < 3**2
    passes = {name: values.copy() for name, values in image.passes.items()}
    for name, values in passes.items():
        values[inside] = background.get(name, 0.0)
    return replace(image, passes=passes)


def rolled(pinhole, angle):
    u, v, _ = pinhole.basis()
    return replace(pinhole, up=tuple(np.cos(angle) * v + np.sin(angle) * u))


def swap(a, b):
    def swapped(values):
        values[..., [a, b]] = values[..., [b, a]]
        return values

    return swapped


def one_nan(values):
    values[values.shape[0] // 3, values.shape[1] // 2, 0] = np.nan
    return values


def renumbered(values):
    values[values == 2] = 7
    return values


def moved_sphere(scene, step):
    (x, y, z, radius), *others = scene.spheres
    return replace(scene, spheres=((x + step[0], y + step[1], z + step[2], radius), *others))


# name → what a renderer with this fault writes. The cameras' faults render the scene anew; the files' faults change the arrays.
CAMERA_FAULTS = {
    "half a pixel to the right": lambda s: s.picture(1.0, 0.5),
    "half a pixel down": lambda s: s.picture(0.5, 0.0),
    "a hundredth of a pixel": lambda s: s.picture(0.51, 0.5),
    "d by a tenth of a per cent": lambda s: s.seen_by(replace(s.pinhole, distance=s.pinhole.distance[0] * 1.001)).picture(),
    "sensor fitted to the other side": lambda s: s.seen_by(replace(s.pinhole, distance=300 * 320 / 200)).picture(),
    "pixel aspect ignored": lambda s: s.seen_by(replace(s.pinhole, distance=(300, 300 / 1.001))).picture(),
    "rolled by a milliradian": lambda s: s.seen_by(rolled(s.pinhole, 1e-3)).picture(),
    "eye moved by a millimeter": lambda s: s.seen_by(replace(s.pinhole, eye=(5.001, -7.0, 4.0))).picture(),
    "shift of the principal point": lambda s: s.seen_by(replace(s.pinhole, principal_point=(160.02, 100))).picture(),
    "mirrored by the camera": lambda s: s.seen_by(replace(s.pinhole, mirrored=True)).picture(),
    "one object moved across the view": lambda s: moved_sphere(s, (0.002, 0.001, 0.0)).rendered(),
    "one object moved along the view": lambda s: moved_sphere(s, (-0.0005, 0.0007, -0.0004)).rendered(),
    "one object missing": lambda s: replace(s, spheres=s.spheres[:2]).rendered(),
    "one object too many": lambda s: replace(s, spheres=(*s.spheres, (1.2, -1.8, 0.2, 0.2))).rendered(),
    "ten times the rounding": lambda s: s.rendered(roundings=3.5),
}
FILE_FAULTS = {
    "Position with X and Y swapped": lambda i: changed(i, Position=swap(0, 1)),
    "Position with Y and Z swapped": lambda i: changed(i, Position=swap(1, 2)),
    "Normal with Y and Z swapped": lambda i: changed(i, Normal=swap(1, 2)),
    "UV swapped": lambda i: changed(i, UV=swap(0, 1)),
    "rows flipped": lambda i: everywhere(i, lambda values: values[::-1]),
    "columns flipped": lambda i: everywhere(i, lambda values: values[:, ::-1]),
    "one row repeated": lambda i: everywhere(i, lambda values: np.concatenate([values[:60], values[59:60], values[61:]])),
    "picture moved by one pixel": lambda i: everywhere(i, lambda values: np.roll(values, 1, axis=1)),
    "Depth along the ray": lambda i: changed(i, Depth=lambda d: d * np.linspace(1, 1.2, d.size).reshape(d.shape).astype("f4")),
    "Depth in other units": lambda i: changed(i, Depth=lambda d: np.where(d < 1e10, d * np.float32(1.0001), d)),
    "Position twice as far from the origin": lambda i: changed(i, Position=lambda p: 2 * p),
    "Normal reversed": lambda i: changed(i, Normal=lambda n: -n),
    "Normal not of unit length": lambda i: changed(i, Normal=lambda n: 1.01 * n),
    "Normal empty": lambda i: changed(i, Normal=lambda n: 0 * n),
    "UV upside down": lambda i: changed(i, UV=lambda uv: uv * np.float32([1, -1, 1])),
    "Object Index renumbered": lambda i: changed(i, Object_Index=renumbered),
    "Material Index shifted by one": lambda i: changed(i, Material_Index=lambda index: index + (index > 0)),
    "a hole": lambda i: with_hole(i, {"Depth": 1e10}),
    "a hole in Depth only": lambda i: changed(
        i, Depth=lambda d: with_hole(replace(i, passes={"Depth": d}), {"Depth": 1e10})["Depth"]
    ),
    **{f"one NaN in {name}": lambda i, name=name: changed(i, **{name.replace(" ", "_"): one_nan}) for name in PASSES},
}


@pytest.fixture(scope="module")
def reference(paper_scene):
    return paper_scene.picture()


@pytest.fixture(scope="module")
def honest(paper_scene):
    return paper_scene.rendered()


def test_the_picture_without_a_fault_passes(paper_scene, reference, honest):
    comparison = compare(reference, honest, paper_scene.pinhole, paper_scene.surfaces_at)
    assert comparison.passed, "\n".join(comparison.lines())


@pytest.mark.parametrize("fault", CAMERA_FAULTS)
def test_a_fault_of_the_camera_or_the_scene_is_found(fault, paper_scene, reference):
    comparison = compare(reference, CAMERA_FAULTS[fault](paper_scene), paper_scene.pinhole, paper_scene.surfaces_at)
    assert not comparison.passed, f"{fault} went unnoticed:\n" + "\n".join(comparison.lines())
    assert comparison.sentence.startswith("Not the same picture: ")


@pytest.mark.parametrize("fault", FILE_FAULTS)
def test_a_fault_of_the_file_is_found(fault, paper_scene, reference, honest):
    comparison = compare(reference, FILE_FAULTS[fault](honest), paper_scene.pinhole, paper_scene.surfaces_at)
    assert not comparison.passed, f"{fault} went unnoticed:\n" + "\n".join(comparison.lines())
    assert comparison.sentence.startswith("Not the same picture: ")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("half a pixel to the right", "shifted by (+0.5, "),
        ("half a pixel down", ", -0.5) px"),
        ("d by a tenth of a per cent", "magnified by 0.999001 × 0.999001"),
        ("sensor fitted to the other side", "magnified by 0.625 × 0.625"),
        ("rolled by a milliradian", "rolled by "),
        ("mirrored by the camera", "mirrored left to right"),
    ],
)
def test_the_verdict_names_the_fault_of_the_camera(fault, words, paper_scene, reference):
    sentence = compare(reference, CAMERA_FAULTS[fault](paper_scene), paper_scene.pinhole, paper_scene.surfaces_at).sentence
    assert words in sentence, sentence


def test_two_empty_pictures_prove_nothing(paper_scene):
    away = paper_scene.seen_by(replace(paper_scene.pinhole, look_at=(5.0, -7.0, 9.0), up=(0.0, 1.0, 0.0)))
    comparison = compare(away.picture(), away.picture(), away.pinhole, away.surfaces_at)
    assert not comparison.passed
    assert comparison.sentence.startswith("Nothing to compare")
    assert comparison.to_json()["passed"] is False


CAMERA = Pinhole((4.5, -5.0, 3.0), (0.0, 0.6, 0.8), (0.0, 0.0, 1.0), 60.0, 64, 48)
SEEDS = 8


def quads(*corners, normals=None):
    corners = np.array(corners, np.float64)
    first = 4 * np.arange(len(corners))[:, None]
    triangles = np.concatenate([first + np.array(three) for three in ((0, 1, 2), (0, 2, 3))]).astype(np.int32)
    return Mesh(corners.reshape(-1, 3), triangles, np.zeros(len(triangles), np.int32), normals)


def ball(center, radius, rings=16):
    """A smooth ball of triangles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1), indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    row = 2 * rings + 1
    first = (np.arange(rings)[:, None] * row + np.arange(2 * rings)).ravel()[:, None]
    triangles = np.concatenate([first + np.array(three) for three in ((0, row, 1), (1, row, row + 1))]).astype(np.int32)
    normals = points[triangles].astype(np.float32)
    return Mesh(points * radius + center, triangles, np.zeros(len(triangles), np.int32), normals)


def lambert(*color):
    return sum_of(diffuse=Color(color))


def build():
    """A corner of two walls on a floor, with a smooth ball, under a sun, an area lamp and a sky."""
    wall = 3.0
    geometries = {
        "floor": quads([(-wall, -wall, 0), (wall, -wall, 0), (wall, wall, 0), (-wall, wall, 0)]),
        "walls": quads(
            [(-wall, wall, 0), (wall, wall, 0), (wall, wall, 4), (-wall, wall, 4)],
            [(-wall, -wall, 0), (-wall, wall, 0), (-wall, wall, 4), (-wall, -wall, 4)],
        ),
        "ball": ball((0.3, 0.2, 1.0), 1.0),
    }
    over = np.eye(4)
    over[:3, 3] = (1.0, -0.5, 3.8)
    return Scene(
        camera=CAMERA,
        geometries=geometries,
        objects=tuple(Object(name, name, np.eye(4), i, materials=(name,)) for i, name in enumerate(geometries, start=1)),
        materials={"floor": lambert(0.6, 0.6, 0.6), "walls": lambert(0.7, 0.35, 0.25), "ball": lambert(0.3, 0.5, 0.8)},
        lamps=(
            Sun("sun", towards=(1.0, -1.2, 2.0), irradiance=(1.5, 1.4, 1.2), angle=0.05),
            Area("area", matrix=over, size=(1.0, 0.7), power=(40.0, 42.0, 45.0)),
        ),
        world=World((0.08, 0.1, 0.14)),
        bounces=Bounces(3, 3, 3, 3),
    )


def picture(scene, level, samples, seed):
    return Image(render(scene, level, samples, seed), CAMERA, {"samples": str(samples)}, f"seed {seed}")


def compared(lit_reference, scene, level, samples):
    """The reference against the scene rendered with eight other seeds, each with an eighth of the samples."""
    return compare_light(lit_reference, [picture(scene, level, samples // SEEDS, seed) for seed in range(1, SEEDS + 1)], CAMERA)


@pytest.fixture(scope="module")
def lit_reference():
    """lit_reference(level, samples) → the right picture, rendered once."""
    scene, pictures_by_name = build(), {}

    def rendered(level, samples):
        if (level, samples) not in pictures_by_name:
            pictures_by_name[level, samples] = picture(scene, level, samples, 0)
        return pictures_by_name[level, samples]

    return rendered


@pytest.mark.parametrize(("level", "samples"), [("direct", 64), ("path", 64), ("path", 256)])
def test_the_right_picture_is_the_same_within_noise(lit_reference, level, samples):
    comparison = compared(lit_reference(level, samples), build(), level, samples)
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.sentence.startswith(f"The same within noise at {samples} samples: ")


def recolored(scene, name, factor):
    color = tuple(factor * value for value in scene.materials[name].surface["color"].rgb)
    return replace(scene, materials={**scene.materials, name: lambert(*color)})


def with_normals(scene, change):
    mesh = scene.geometries["ball"]
    return replace(scene, geometries={**scene.geometries, "ball": replace(mesh, corner_normals=change(mesh.corner_normals))})


def shifted(scene, x, y):
    """The film's filter beside the pixel's center: the same as the picture shifted the other way."""
    (cx, cy), camera = scene.camera.principal_point, scene.camera
    return replace(scene, camera=replace(camera, principal_point=(cx - x, cy - y)))


# fault → (level, samples, what it makes of the scene). The samples are those that this picture of 3,072 pixels needs.
SCENE_FAULTS = {
    "albedo of the floor off by 1 %": ("direct", 64, lambda s: recolored(s, "floor", 1.01)),
    "albedo of the ball off by 1 %": ("direct", 256, lambda s: recolored(s, "ball", 0.99)),
    "the sun dropped": ("direct", 64, lambda s: replace(s, lamps=s.lamps[1:])),
    "the area lamp dropped": ("direct", 64, lambda s: replace(s, lamps=s.lamps[:1])),
    "the world dropped": ("direct", 64, lambda s: replace(s, world=World())),
    "one bounce fewer, 3 to 2": ("path", 256, lambda s: replace(s, bounces=Bounces(2, 2, 2, 2))),
    "smooth normals inside out": ("direct", 64, lambda s: with_normals(s, lambda n: -n)),
    "smooth normals with two axes swapped": ("direct", 64, lambda s: with_normals(s, lambda n: n[..., [1, 0, 2]].copy())),
    "a filter 0.1 px to the right": ("direct", 256, lambda s: shifted(s, 0.1, 0.0)),
    "a filter 0.25 px up": ("direct", 64, lambda s: shifted(s, 0.0, 0.25)),
    "a filter a quarter wider": ("direct", 64, lambda s: replace(s, film=replace(s.film, filter_width=1.875))),
    "a box in place of the filter": ("direct", 64, lambda s: replace(s, film=replace(s.film, filter="BOX"))),
}


@pytest.mark.parametrize("fault", SCENE_FAULTS)
def test_a_fault_of_the_scene_is_found(lit_reference, fault):
    level, samples, change = SCENE_FAULTS[fault]
    comparison = compared(lit_reference(level, samples), change(build()), level, samples)
    assert not comparison.passed, f"{fault}: {comparison.sentence}"
    assert comparison.sentence.startswith("Different here: ")


def with_a_bulb(strength=3.0, tint=1.0):
    """A ball of some nine pixels before the walls that shines, and gives next to no light to them."""
    scene = build()
    count, bulb = len(scene.objects), Object("bulb", "bulb", np.eye(4), 9, materials=("bulb",))
    glow = sum_of(emission=Color((strength, strength, tint * strength)))
    return replace(
        scene,
        geometries={**scene.geometries, "bulb": ball((1.9, -0.4, 1.2), 0.17)},
        objects=(*scene.objects[:count], bulb),
        materials={**scene.materials, "bulb": glow},
    )


@pytest.fixture(scope="module")
def reference_of_a_bulb():
    return picture(with_a_bulb(), "direct", 64, 0)


@pytest.mark.parametrize("fault", [{}, {"strength": 3.05}, {"tint": 0.98}])
def test_a_bulb_of_nine_pixels_of_another_strength_is_found(reference_of_a_bulb, fault):
    seen = render(with_a_bulb(), "geometry")["Object Index"] == 9
    assert 6 <= seen.sum() <= 12, seen.sum()
    comparison = compared(reference_of_a_bulb, with_a_bulb(**fault), "direct", 64)
    assert comparison.passed == (not fault), "\n".join(comparison.lines())


def brighter(lamp, factor):
    what = "irradiance" if isinstance(lamp, Sun) else "power"
    return replace(lamp, **{what: tuple(factor * value for value in getattr(lamp, what))})


# fault → what it makes of a lamp.
LAMP_FAULTS = {
    "π lost": lambda lamp: brighter(lamp, np.pi),
    "no shadows": lambda lamp: replace(lamp, casts_shadow=False),
}


@pytest.mark.parametrize("fault", LAMP_FAULTS)
def test_a_fault_of_the_lamps_is_found(lit_reference, fault):
    scene = build()
    wrong = replace(scene, lamps=tuple(LAMP_FAULTS[fault](lamp) for lamp in scene.lamps))
    comparison = compared(lit_reference("direct", 64), wrong, "direct", 64)
    assert not comparison.passed, f"{fault}: {comparison.sentence}"


PAINT = {"base_color": (0.7, 0.35, 0.25), "metallic": 0.6, "roughness": 0.25, "specular_tint": (1.0, 0.6, 0.4)}
GLASS = {"color": (0.95, 1.0, 0.97), "roughness": 0.0, "ior": 1.45}


def build_artists(paint=PAINT, glass=GLASS, turn=0.0):
    """A ball of tinted paint and one of glass amid a room of windows, an image wrapped around all.

    turn : the room's turn about the vertical, degrees.
    """
    room = np.full((32, 64, 3), 0.15, np.float32)
    room[10:26, ::4], room[18:22, 22:26] = (0.5, 0.6, 0.9), (6.0, 5.0, 4.0)
    return Scene(
        camera=CAMERA,
        geometries={"ball": ball((-1.6, -0.7, 0.8), 2.0, 32), "bead": ball((1.6, 1.9, 0.8), 2.0, 32)},
        objects=tuple(Object(name, name, np.eye(4), i, materials=(name,)) for i, name in enumerate(("ball", "bead"), start=1)),
        materials={
            "ball": Material(surface=node("principled", **paint)),
            "bead": Material(surface=node("glass", **glass)),
        },
        world=World((1.0, 1.0, 1.0), image="room", rotation=(0.0, 0.0, np.radians(turn))),
        images={"room": Picture(room)},
        bounces=Bounces(6, 3, 3, 6),
    )


# fault → what build_artists is given. The picture shows all of them at 256 samples.
ARTISTS_FAULTS = {
    "IOR off by 0.02": {"glass": GLASS | {"ior": 1.47}},
    "roughness off by 0.01": {"paint": PAINT | {"roughness": 0.26}},
    "tint dropped": {"paint": PAINT | {"specular_tint": (1.0, 1.0, 1.0)}},
    "environment turned by a degree": {"turn": 1.0},
}


@pytest.fixture(scope="module")
def artists_reference():
    return picture(build_artists(), "path", 256, 0)


@pytest.mark.parametrize("fault", [None, *ARTISTS_FAULTS])
def test_a_fault_of_artists_materials_is_found(artists_reference, fault):
    comparison = compared(artists_reference, build_artists(**ARTISTS_FAULTS.get(fault, {})), "path", 256)
    assert comparison.passed == (fault is None), f"{fault}: {comparison.sentence}"


@pytest.mark.parametrize("change", [{}, {"roughness": 0.29}, {"base_color": (0.707, 0.35, 0.25)}])
def test_at_64_samples_a_metal_is_found_to_be_rougher_by_four_hundredths_or_redder_by_one(change):
    comparison = compared(picture(build_artists(), "path", 64, 0), build_artists(PAINT | change), "path", 64)
    assert comparison.passed == (not change), f"{change}: {comparison.sentence}"
