"""A comparison of light must be able to fail: every fault that a renderer of light can have is found, at the samples stated.

Both sides are the tracer's own, with other seeds. The right one passes; each fault is made in the scene or in the formulas that
light goes through.
"""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison.radiance import compare
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import Area, Sun, World
from viewcam_addon.tracer.scene.materials import Color, Material, Picture, sum_of
from viewcam_addon.tracer.scene.shader_nodes import node

pytestmark = pytest.mark.slow

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


def compared(reference, scene, level, samples):
    """The reference against the scene rendered with eight other seeds, each with an eighth of the samples."""
    return compare(reference, [picture(scene, level, samples // SEEDS, seed) for seed in range(1, SEEDS + 1)], CAMERA)


@pytest.fixture(scope="module")
def reference():
    """reference(level, samples) → the right picture, rendered once."""
    scene, pictures_by_name = build(), {}

    def rendered(level, samples):
        if (level, samples) not in pictures_by_name:
            pictures_by_name[level, samples] = picture(scene, level, samples, 0)
        return pictures_by_name[level, samples]

    return rendered


@pytest.mark.parametrize(("level", "samples"), [("direct", 64), ("path", 64), ("path", 256)])
def test_the_right_picture_is_the_same_within_noise(reference, level, samples):
    comparison = compared(reference(level, samples), build(), level, samples)
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
def test_a_fault_of_the_scene_is_found(reference, fault):
    level, samples, change = SCENE_FAULTS[fault]
    comparison = compared(reference(level, samples), change(build()), level, samples)
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
def test_a_fault_of_the_lamps_is_found(reference, fault):
    scene = build()
    wrong = replace(scene, lamps=tuple(LAMP_FAULTS[fault](lamp) for lamp in scene.lamps))
    comparison = compared(reference("direct", 64), wrong, "direct", 64)
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
