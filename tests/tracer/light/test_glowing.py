"""Surfaces that shine, by shadow rays, by rays that run into them, and by both, weighted."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.arrays import dot
from viewcam_addon.tracer.light import emitters
from viewcam_addon.tracer.light.emitters import weight
from viewcam_addon.tracer.light.sampler import Sampler
from viewcam_addon.tracer.light.scattering import cosine_direction
from viewcam_addon.tracer.rays.space import Space
from viewcam_addon.tracer.scene import Mesh
from viewcam_addon.tracer.scene.lamps import Point
from viewcam_addon.tracer.scene.materials import Colour, Material, Picture

SEEDS = st.integers(0, 2**32 - 1)
SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])


def glow(*radiance, **more):
    return Material(emission=Colour(radiance if len(radiance) == 3 else radiance * 3, **more))


@settings(max_examples=40)
@given(seed=SEEDS, scale=st.integers(-6, 6), distance=st.floats(0.5, 30))
def test_a_triangle_anywhere_gives_what_lambert_says_to_both_sides(
    make_lighting, make_mesh, polygon_irradiance, seed, scale, distance
):
    """To the precision of its samples, and to what its radiance could give at most."""
    rng = np.random.default_rng(seed)
    size = 10.0**scale
    corners = rng.normal(size=(3, 3)) * size
    lighting = make_lighting(surfaces=[(make_mesh(corners, [[0, 1, 2]]), glow(3, 2, 1))])
    across = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    position = corners.mean(axis=0) + rng.choice([-1, 1]) * across / np.linalg.norm(across) * distance * size
    normal = corners.mean(axis=0) - position + rng.normal(size=3) * distance * size / 2
    expected = 3 * polygon_irradiance(corners - position, normal)
    whole = 3 * polygon_irradiance(corners - position, corners.mean(axis=0) - position)
    mean, error = lighting.irradiance(position, normal)
    # Camera space moves everything by the eye's place: that many roundings of 2⁻⁵³ of what is small.
    moved = 1e-15 / size
    assert error <= 0.1 * whole and abs(mean - expected) <= 3 * error + (1e-9 + 10 * moved) * whole, (mean, error, expected)


def test_a_mesh_gives_the_sum_of_its_triangles_however_bright_each_is(make_lighting, make_mesh, polygon_irradiance, off_by):
    """One triangle has no area; two objects, one of them dim in the channel that is looked at."""
    rng = np.random.default_rng(5)
    corners = rng.normal(size=(60, 3)) * 0.5 + np.array([0, 0, 4])
    corners[2] = corners[1]
    beside = make_mesh(corners + np.array([2, 0, 0]), np.arange(60))
    lighting = make_lighting(surfaces=[(make_mesh(corners, np.arange(60)), glow(2)), (beside, glow(0.1, 5, 5))])
    normal = (0.2, 0.1, 1)
    expected = sum(2 * polygon_irradiance(three, normal) for three in corners.reshape(-1, 3, 3))
    expected += sum(0.1 * polygon_irradiance(three + np.array([2, 0, 0]), normal) for three in corners.reshape(-1, 3, 3))
    assert abs(off_by(lighting.irradiance((0, 0, 0), normal, 16384), expected)) <= 3


def test_an_image_on_a_surface_lights_as_bright_as_it_is_where_it_is(make_lighting, off_by, polygon_irradiance):
    """The left half of a square shines, the right half does not."""
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uvs = (SQUARE[triangles][..., :2] / 2 + 0.5).astype(np.float32)
    mesh = Mesh(SQUARE + np.array([0, 0, 1.0]), triangles, np.zeros(2, np.int32), corner_uvs=uvs)
    image = Picture(np.array([[[1, 1, 1], [0, 0, 0]]], np.float32))
    lighting = make_lighting(surfaces=[(mesh, glow(4, image="half", closest=True))], images={"half": image})
    expected = 4 * polygon_irradiance(SQUARE * (0.5, 1, 1) - (0.5, 0, -1), (1, 0, 1))
    assert abs(off_by(lighting.irradiance((0, 0, 0), (1, 0, 1), 16384), expected, 0.05)) <= 3
    expected = 4 * polygon_irradiance(SQUARE * (0.5, 1, 1) - (0.5, 0, -1), (-1, 0, 1))
    assert abs(off_by(lighting.irradiance((0, 0, 0), (-1, 0, 1), 16384), expected)) <= 3


class Ways:
    """Light at a point by shadow rays, by scattered rays, and by both, weighted; one sample each."""

    def __init__(self, lighting, position, normal, count=16384):
        points = lighting.points(position, normal, count)
        numbers = Sampler(3, count).numbers(np.zeros(count, np.int64), np.arange(count), 2, 5)
        aimed = lighting.emitters.sample(points, numbers[:3])
        cosine = np.maximum(dot(points.normal, aimed.direction), 0.0)
        self.aimed = aimed.light[0] * cosine
        self.aimed_weighted = self.aimed * weight(aimed.pdf, cosine / np.pi)
        direction, density = cosine_direction(points.normal, numbers[3:])
        met, hits, distance = Space(lighting.surfaces).first(points, direction, "diffuse")
        self.shared = lighting.emitters.surface_weight(
            points.at(met), hits, direction[:, met], distance, density[met], "diffuse"
        )
        self.scattered, self.scattered_weighted = np.zeros(count), np.zeros(count)
        radiance = np.where(hits.material > 0, 3.0, 0.0)
        self.scattered[met] = radiance * np.pi
        self.scattered_weighted[met] = radiance * np.pi * self.shared

    @staticmethod
    def mean(values):
        return values.mean(), values.std() / np.sqrt(len(values))


@pytest.mark.parametrize("height", [0.02, 0.5, 3.0])
@pytest.mark.parametrize("lamps", [0, 2, 40])
def test_shadow_rays_and_scattered_rays_and_both_weighted_find_the_same(
    make_lighting, make_mesh, polygon_irradiance, height, lamps
):
    """Beside lamps too far off to matter, but among which the surface must be chosen."""
    far = [Point(f"lamp {number}", position=(0, 0, 1e4), power=(1e-3,) * 3) for number in range(lamps)]
    mesh = make_mesh(SQUARE + np.array([0.3, 0, height]), [[0, 1, 2], [0, 2, 3]])
    lighting = make_lighting(*far, surfaces=[(mesh, glow(3))])
    ways = Ways(lighting, (0, 0, 0), (0.2, 0, 1))
    expected = 3 * polygon_irradiance(SQUARE + np.array([0.3, 0, height]), (0.2, 0, 1))
    both = ways.aimed_weighted + ways.scattered_weighted
    for values in (ways.scattered, both) if height < 0.1 else (ways.scattered, both, ways.aimed):
        mean, error = ways.mean(values)
        assert error < 0.05 * expected and abs(mean - expected) <= 3 * error, (mean, error, expected)
    least = min(ways.mean(ways.scattered)[1], ways.mean(ways.aimed)[1]) if lamps == 0 else ways.mean(ways.aimed)[1]
    assert ways.mean(both)[1] <= 2 * least, "weighting makes it worse"


def test_a_wrong_weight_is_told(make_lighting, make_mesh, polygon_irradiance, monkeypatch):
    mesh = make_mesh(SQUARE + np.array([0.3, 0, 0.5]), [[0, 1, 2], [0, 2, 3]])
    lighting = make_lighting(surfaces=[(mesh, glow(3))])
    expected = 3 * polygon_irradiance(SQUARE + np.array([0.3, 0, 0.5]), (0.2, 0, 1))
    monkeypatch.setattr(emitters, "weight", lambda pdf, other: weight(pdf, other * 2))
    ways = Ways(lighting, (0, 0, 0), (0.2, 0, 1))
    mean, error = ways.mean(ways.aimed_weighted + ways.scattered_weighted)
    assert abs(mean - expected) > 3 * error


@settings(max_examples=20)
@given(seed=SEEDS, lamps=st.sampled_from([0, 1, 40]))
def test_the_density_of_shadow_rays_is_the_one_that_scattered_rays_are_told(make_lighting, make_mesh, seed, lamps):
    """A shadow ray's own density and the one found from where it ends give the same weights."""
    rng = np.random.default_rng(seed)
    far = [Point(f"lamp {number}", position=(5, 0, 9), power=(1.0,) * 3) for number in range(lamps)]
    mesh = make_mesh(rng.normal(size=(30, 3)) + np.array([0, 0, 5]), np.arange(30))
    lighting = make_lighting(*far, surfaces=[(mesh, glow(3))])
    points = lighting.points((0, 0, 0), (0, 0, 1), 300)
    aimed = lighting.emitters.sample(points, rng.random((3, 300)))
    sent = np.flatnonzero(np.isfinite(aimed.pdf))
    met, hits, distance = Space(lighting.surfaces).first(points.at(sent), aimed.direction[:, sent], "diffuse")
    same = np.flatnonzero(np.abs(distance - aimed.distance[sent[met]]) < 1e-9)
    rays = sent[met[same]]
    assert len(rays) > 20
    told = lighting.emitters.surface_weight(
        points.at(rays), hits.at(same), aimed.direction[:, rays], distance[same], np.full(len(rays), 0.2), "diffuse"
    )
    assert told == pytest.approx(weight(np.full(len(rays), 0.2), aimed.pdf[rays]), rel=1e-6)


@pytest.mark.parametrize("lamps", [0, 1, 40])
def test_the_density_of_shadow_rays_is_one_over_the_whole_sphere(make_lighting, make_mesh, lamps):
    """Of the part of them that is sent to the surface; by quadrature over a million directions."""
    far = [Point(f"lamp {number}", position=(0, 0, 3), power=(10.0,) * 3) for number in range(lamps)]
    mesh = make_mesh([[-1, -1, 1], [2, -1, 1.5], [0, 1, 2]], [[0, 1, 2]])
    lighting = make_lighting(*far, surfaces=[(mesh, glow(3))])
    count = 2**18
    numbers = Sampler(3, count).numbers(np.zeros(count, np.int64), np.arange(count), 2, 3)
    points = lighting.points((0, 0, 0), (0, 0, 1), count)
    sent = np.isfinite(lighting.emitters.sample(points, numbers).pdf).mean()
    height, turn = 2 * numbers[1] - 1, 2 * np.pi * numbers[2]
    ahead = np.stack([np.sqrt(1 - height**2) * np.cos(turn), np.sqrt(1 - height**2) * np.sin(turn), height])
    met, hits, distance = Space(lighting.surfaces).first(points, ahead, "diffuse")
    chosen = np.full(len(met), 1.0)
    shared = lighting.emitters.surface_weight(points.at(met), hits, ahead[:, met], distance, chosen, "diffuse")
    density = np.sqrt(1 / shared - 1)  # from the power heuristic against a density of 1
    assert density.sum() / count * 4 * np.pi == pytest.approx(sent, abs=0.01)


def test_spheres_that_shine_are_found_by_scattered_rays_alone_and_count_whole(make_lighting, make_mesh, make_spheres):
    """π L (R/d)², beside a mesh that shadow rays are sent to."""
    mesh = make_mesh(SQUARE - np.array([0, 0, 3]), [[0, 1, 2], [0, 2, 3]])
    lighting = make_lighting(surfaces=[(make_spheres([[0, 0, 2]], 1.5), glow(3)), (mesh, glow(3))])
    ways = Ways(lighting, (0, 0, 0), (0, 0, 1))
    assert (ways.shared == 1).all() and not ways.aimed.any()
    mean, error = ways.mean(ways.scattered_weighted)
    assert error < 0.02 * mean and abs(mean - 3 * np.pi * (1.5 / 2) ** 2) <= 3 * error, (mean, error)


def test_a_surface_that_diffuse_rays_do_not_see_is_not_aimed_at(make_lighting, make_mesh, make_lit):
    scene = make_lit(Pinhole((0, 0, 5), (0, 0, 0), (0, 1, 0), 9, 8, 8), (make_mesh(SQUARE, [[0, 1, 2]]), glow(3)))
    hidden = replace(scene, objects=(replace(scene.objects[0], hidden_from=frozenset({"diffuse"})),))
    kind = type(make_lighting())
    assert kind(scene).emitters.sampled("diffuse") and not kind(hidden).emitters.sampled("diffuse")
    assert kind(hidden).emitters.lit


def test_a_surface_without_an_area_gives_nothing(make_lighting, make_mesh):
    lighting = make_lighting(surfaces=[(make_mesh([[0, 0, 1], [1, 0, 1], [2, 0, 1]], [[0, 1, 2], [0, 0, 0]]), glow(3))])
    aimed, _ = lighting.aimed((0, 0, 0), (0, 0, 1), 64)
    assert aimed.light.max() < 1e-12 and np.isfinite(aimed.distance).all()  # camera space gives it an area of a rounding


def test_a_point_on_the_surface_itself_gets_numbers(make_lighting, make_mesh):
    lighting = make_lighting(surfaces=[(make_mesh(SQUARE, [[0, 1, 2], [0, 2, 3]]), glow(1e10))])
    for position in ((0.2, 0.1, 0), (1, 1, 0), (0, 0, 1e-300)):
        aimed, _ = lighting.aimed(position, (0, 0, 1), 256)
        assert np.isfinite(aimed.light).all() and not np.isnan(aimed.pdf).any()
