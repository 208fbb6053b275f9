"""Mirrors and glass whose pictures are known on paper: where things appear by Snell's law, and how bright by Fresnel's."""

import numpy as np
import pytest

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene.film import Bounces
from viewcam_addon.tracer.scene.lamps import World
from viewcam_addon.tracer.scene.materials import Color, Material, sum_of

FLOAT32 = 2.0**-24
WHITE = (1.0, 1.0, 1.0)
WITHOUT_END = Bounces(1024, 1024, 1024, 1024)


def rectangle(make_mesh, x, y, z):
    """In the plane of height z, seen counter-clockwise from above. x, y : from and to."""
    corners = [[x[0], y[0], z], [x[1], y[0], z], [x[1], y[1], z], [x[0], y[1], z]]
    return make_mesh(corners, [[0, 1, 2], [0, 2, 3]])


def glow(radiance) -> Material:
    return sum_of(emission=Color((radiance,) * 3))


def fresnel_of_angles(angle, ior):
    """Fresnel's equations as Fresnel had them, of the two angles."""
    inside = np.arcsin(np.sin(angle) / ior)
    across = (np.sin(angle - inside) / np.sin(angle + inside)) ** 2
    along = (np.tan(angle - inside) / np.tan(angle + inside)) ** 2
    return (across + along) / 2


def test_a_mirror_shows_things_where_their_mirror_images_stand(make_mesh, make_lit):
    camera = Pinhole((0, -3, 2), (0, 0, 0), (0, 0, 1), 150, 160, 120)
    patch = rectangle(make_mesh, (-0.4, 0.3), (0.5, 1.1), 1.0)
    floor = rectangle(make_mesh, (-9, 9), (-9, 9), 0.0)
    scene = make_lit(camera, (floor, sum_of(mirror=Color((0.9, 0.6, 0.3)))), (patch, glow(2)))
    picture = render(scene, "direct", 1, threads=1)["Combined"][..., :3]
    image = make_lit(camera, (rectangle(make_mesh, (-0.4, 0.3), (0.5, 1.1), -1.0), glow(2)))
    seen = render(image)["Object Index"][..., 0] == 1
    direct = render(make_lit(camera, (patch, glow(2))))["Object Index"][..., 0] == 1
    assert seen.sum() > 100 and not (seen & direct).any()
    assert np.abs(picture[seen] - 2 * np.array([0.9, 0.6, 0.3])).max() <= 8 * FLOAT32
    assert (picture[direct] == 2).all() and (picture[~seen & ~direct] == 0).all()


def test_refraction_shows_things_where_snell_says(make_mesh, make_lit):
    """From 2 above water of 1.5 that is 1 deep, the floor beyond x = 0.8 is lit: the ray at x = 2 tan a there arrives at
    2 tan a + tan b with sin a = 1.5 sin b."""
    camera = Pinhole((0, 0, 2), (0.7, 0, 0), (0, 1, 0), 1000, 400, 4)
    bodies = (
        (rectangle(make_mesh, (-9, 9), (-9, 9), 0.0), sum_of(refraction=Color((1.0, 0.5, 0.25)), ior=1.5)),
        (rectangle(make_mesh, (0.8, 9), (-9, 9), -1.0), glow(1)),
    )
    picture = render(make_lit(camera, *bodies), "direct", 1, threads=1)["Combined"][..., :3]
    rows, columns = np.mgrid[:4, :400]
    x, y, z = np.moveaxis(camera.ray_directions(columns, rows), -1, 0)
    sine = np.hypot(x, y)
    inside = np.arcsin(sine / 1.5)
    arrives = (2 * sine / -z + np.tan(inside)) * x / sine
    lit = picture[..., 0] > 0
    assert np.array_equal(lit, arrives > 0.8) and 0.1 < lit.mean() < 0.9
    assert (picture[lit] == (1.0, 0.5, 0.25)).all()


def test_glass_shares_light_out_by_fresnel(make_mesh, make_lit):
    """Water, seen flat: F of the bright ceiling and 1 − F of the floor."""
    camera = Pinhole((0, 0, 1), (5, 0, 0), (0, 0, 1), 2000, 16, 12)
    bodies = (
        (rectangle(make_mesh, (-90, 90), (-90, 90), 0.0), sum_of(glass=Color(WHITE), ior=1.33)),
        (rectangle(make_mesh, (-900, 900), (-900, 900), 9.0), glow(5)),
        (rectangle(make_mesh, (-90, 90), (-90, 90), -1.0), glow(1)),
    )
    passes = render(make_lit(camera, *bodies), "direct", 256, threads=1)
    angle = np.arccos(-camera.ray_directions(*np.meshgrid(np.arange(16), np.arange(12)))[..., 2])
    reflectance = fresnel_of_angles(angle, 1.33)
    off = passes["Combined"][..., 0] - (1 + 4 * reflectance)
    error = np.sqrt(passes["Variance"][..., 0].sum()) / off.size
    assert error <= 0.01 * 4 * reflectance.mean(), "the picture tells F"
    # A sample is not at its pixel's center, of which the angle is; over the picture that cancels but for F's curvature.
    assert abs(off.mean()) <= 3 * error, f"{off.mean() / error:+.1f} standard errors"
    assert abs(off.mean() + 4 * reflectance.mean() - 4 * ((1.33 - 1) / (1.33 + 1)) ** 2) > 30 * error, "not F of a steep ray"


def test_a_pane_of_clear_glass_shifts_what_is_behind_it(make_mesh, make_lit):
    """By its thickness times tan a − tan b; and lets through (1 − F)/(1 + F), all inner reflections told."""
    camera = Pinhole((0, 0, 3), (1.5, 0, 0), (0, 1, 0), 1000, 400, 4)
    pane = [rectangle(make_mesh, (-9, 9), (-9, 9), 1.0), rectangle(make_mesh, (-9, 9), (-9, 9), 0.5)]
    below = make_mesh(pane[1].vertices, pane[1].triangles[:, ::-1])  # its front looks down, out of the glass
    glass = sum_of(glass=Color(WHITE), ior=1.5)
    bodies = ((pane[0], glass), (below, glass), (rectangle(make_mesh, (1.2, 9), (-9, 9), -1.0), glow(1)))
    passes = render(make_lit(camera, *bodies, bounces=WITHOUT_END), "path", 128, threads=1)
    rows, columns = np.mgrid[:4, :400]
    x, _, z = np.moveaxis(camera.ray_directions(columns, rows), -1, 0)
    angle = np.arccos(-z)
    inside = np.arcsin(np.sin(angle) / 1.5)
    arrives = (3.5 * np.tan(angle) + 0.5 * np.tan(inside)) * x / np.sin(angle)
    pixel = 4 / 1000 * 1.5  # on the floor, at the most; the filter reaches 1.5 pixels
    lit, dark = arrives > 1.2 + 2 * pixel, arrives < 1.2 - 2 * pixel
    assert lit.mean() > 0.2 and dark.mean() > 0.05
    reflectance = fresnel_of_angles(angle, 1.5)
    assert (passes["Combined"][dark][:, 0] <= 0.2).all(), "only inner reflections come from farther off"
    # Rays that are reflected inside arrive farther along, all of them lit where the first is.
    off = passes["Combined"][lit][:, 0] - ((1 - reflectance) / (1 + reflectance))[lit]
    error = np.sqrt(passes["Variance"][lit][:, 0].sum()) / lit.sum()
    assert error <= 0.003 and abs(off.mean()) <= 3 * error, f"{off.mean() / error:+.1f} standard errors of {error:.4f}"


@pytest.mark.parametrize("component", ["mirror", "glass"])
def test_between_two_mirrors_light_is_reflected_as_often_as_there_are_bounces(make_mesh, make_lit, component):
    """Two mirrors of 0.5 that glow by 1: with k bounces, k + 1 reflections; each kind is limited by its own number."""
    camera = Pinhole((0, 0, 1), (0, 0.1, 0), (0, 1, 0), 500, 8, 6)
    shining = {component: Color((0.5,) * 3), "emission": Color(WHITE), "ior": 1e3 if component == "glass" else 1.45}
    floor, ceiling = rectangle(make_mesh, (-99, 99), (-99, 99), 0.0), rectangle(make_mesh, (-99, 99), (-99, 99), 2.0)
    bodies = [(floor, sum_of(**shining)), (ceiling, sum_of(**shining))]
    for bounces, reflections in ((Bounces(0, 9, 9, 9), 1), (Bounces(3, 9, 9, 9), 4), (Bounces(9, 9, 2, 9), 3)):
        scene = make_lit(camera, *bodies, bounces=bounces)
        picture = render(scene, "path", 1, threads=1)["Combined"][..., :3]
        expected = sum(0.5**k for k in range(reflections + 1))
        if component == "mirror":
            assert np.abs(picture - expected).max() <= 8 * FLOAT32
        else:  # an index of 1000 reflects 99.6 %: of 48 pixels hardly one is refracted, and sees something else
            assert np.abs(np.median(picture) - expected) <= 8 * FLOAT32


def test_what_a_mirror_shows_is_of_no_pass_but_combined(make_mesh, make_lit):
    camera = Pinhole((0, 0, 1), (0, 0.1, 0), (0, 1, 0), 500, 8, 6)
    floor = rectangle(make_mesh, (-9, 9), (-9, 9), 0.0)
    passes = render(make_lit(camera, (floor, sum_of(mirror=Color(WHITE))), world=World((1, 2, 3))), "path", 1, threads=1)
    assert (passes["Combined"] == (1, 2, 3, 1)).all()
    for name in ("Emission", "Environment", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color", "Variance"):
        assert (passes[name] == 0).all(), name
