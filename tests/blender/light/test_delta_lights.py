"""Light without noise, one sample and one light: what Cycles shows is what the paper says, to float32's last bits.

Errors are relative to the light on a surface that faces the lamp, albedo · E/π, for the cosine's rounding is an absolute one.
E is computed here from the lamp's formula and the traced position; in a spot it is that in the middle of the cone.
"""

import sys

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.tracer.render import render

# Relative errors of Cycles at the 50th and 99th percentile: those of the facts that this project began with, which another
# tracer measured on other scenes with 4.2 to 5.2 (a sun's 99th percentile was 1.9e-7 there; here it is 2.3e-7 in 4.2). For a
# spot there was only the 50th; the 99th is 1.25 times what is measured here. On Windows a point lamp's is 9.13e-7 in
# 4.2 and 9.94e-7 in 5.0, where another compiler has made Cycles' code: calibrated, 1.25 times what is measured as well.
SUN, POINT, SPOT = (7e-8, 2.4e-7), (2.4e-7, 1.25e-6 if sys.platform == "win32" else 9e-7), (1.2e-6, 1.8e-6)
# Calibrated: what its size leaves, and Cycles' tangent of an angle in float32.
SPREAD = 3e-6, 1.5e-5
# Smooth normals of Cycles, in radians at the 99th percentile: 2.5e-4°, and 2e-3° since 5.1.
SMOOTH = 2e-3 if bpy.app.version >= (5, 1) else 2.5e-4


def irradiance(lamp, position):
    """(height, width, 3) on surfaces that face a lamp without an edge. position : (height, width, 3), world space."""
    if lamp.kind == "sun":
        return np.broadcast_to(lamp.irradiance, position.shape)
    origin = np.array(lamp.position) if lamp.kind == "point" else lamp.matrix[:3, 3]
    ways = position - origin
    square = (ways**2).sum(axis=-1, keepdims=True)
    return np.array(lamp.power) / (4 * np.pi * square)


def errors(sides):
    """Relative errors of all lit channels of all scenes, and how many are lit on one side only."""
    errors_found, mismatches = [], 0
    for each in sides:
        (lamp,) = each.exported.lamps
        facing = irradiance(lamp, render(each.exported, threads=2)["Position"].astype(np.float64)) / np.pi
        traced, cycles = (passes["Combined"][..., :3].astype(np.float64) for passes in (each.traced, each.cycles[0]))
        lit = (traced > 0) & (cycles > 0)
        mismatches += int(((traced > 0) != (cycles > 0)).sum())
        full = facing * each.traced["Diffuse Color"]
        errors_found.append(np.abs(traced - cycles)[lit] / full[lit])
    return np.concatenate(errors_found), mismatches


def check(sides, figures):
    relative_errors, mismatches = errors(sides)
    p50, p99 = np.percentile(relative_errors, [50, 99])
    most = relative_errors.max()
    summary = f"{len(relative_errors)} lit, {mismatches} on one side only, p50 {p50:.3g}, p99 {p99:.3g}, most {most:.3g}"
    assert len(relative_errors) > 20_000 and mismatches == 0 and p50 <= figures[0] and p99 <= figures[1], summary


@pytest.fixture
def sun(add_lamp):
    """A sun without a size, and a function that turns it."""
    lamp = add_lamp("SUN", angle=0.0)

    def arrange(rng):
        lamp.rotation_euler, lamp.data.energy = rng.uniform(-0.8, 0.8, 3), rng.uniform(0.1, 9)

    return arrange


def test_suns(pictures, sun):
    check(pictures(sun), SUN)


def test_points(pictures, add_lamp):
    lamp = add_lamp("POINT", shadow_soft_size=0.0)

    def arrange(rng):
        lamp.location, lamp.data.energy = (*rng.uniform(-3, 3, 2), rng.uniform(2, 6)), rng.uniform(1, 900)

    check(pictures(arrange), POINT)


def test_spots_of_any_size_blend_and_scale(pictures, add_lamp):
    lamp = add_lamp("SPOT", shadow_soft_size=0.0)

    def arrange(rng):
        lamp.location, lamp.data.energy = (*rng.uniform(-1, 1, 2), rng.uniform(3, 6)), rng.uniform(1, 900)
        lamp.rotation_euler, lamp.scale = rng.uniform(-0.3, 0.3, 3), rng.uniform(0.5, 2, 3)
        lamp.data.spot_size, lamp.data.spot_blend = rng.uniform(1, 2.5), rng.uniform(0.15, 1)

    check(pictures(arrange), SPOT)


@pytest.mark.parametrize("shape", ["DISK", "ELLIPSE"])
def test_area_lamps_of_any_spread(pictures, add_lamp, shape):
    """So small that its size, one part in 10⁵ of its distance, is no noise; of what a surface gets straight below.

    Of so small a rectangle Cycles' float32 loses some samples.
    """
    lamp = add_lamp("AREA", shape=shape, size=3e-5, size_y=3e-5)

    def arrange(rng):
        lamp.location, lamp.data.energy = (*rng.uniform(-1, 1, 2), rng.uniform(3, 6)), rng.uniform(1, 900)
        lamp.rotation_euler, lamp.data.spread = rng.uniform(-0.3, 0.3, 3), rng.uniform(0.7, 3)

    result = []
    for each in pictures(arrange, scenes=4):
        (area,) = each.exported.lamps
        ways = render(each.exported, threads=2)["Position"].astype(np.float64) - area.matrix[:3, 3]
        squared = (ways**2).sum(axis=-1, keepdims=True)
        half = area.spread / 2
        below = area.power[0] / np.pi**2 / squared * np.tan(half) / (np.tan(half) - half)
        traced, cycles = (passes["Combined"][..., :3].astype(np.float64) for passes in (each.traced, each.cycles[0]))
        full = below * each.traced["Diffuse Color"]
        assert ((traced > 0) != (cycles > 0)).mean() < 1e-3
        lit = (traced > 0) & (cycles > 0)
        assert lit.sum() > 300, "that would tell nothing"
        result.append(np.abs(traced - cycles)[lit] / full[lit])
    p50, p99 = np.percentile(np.concatenate(result), [50, 99])
    assert p50 <= SPREAD[0] and p99 <= SPREAD[1], (p50, p99)


def test_smooth_surfaces_shade_smoothly_and_cast_the_shadows_of_their_facets(pictures, sun):
    for polygon in bpy.data.objects["Monkey"].data.polygons:
        polygon.use_smooth = True
    check(pictures(sun), (SUN[0], np.radians(SMOOTH)))


@pytest.mark.parametrize("exposure", [1.0, 0.3])
def test_emission_is_the_exact_color(pictures, make_material, scene, exposure):
    scene.cycles.film_exposure = exposure
    monkey = bpy.data.objects["Monkey"]
    monkey.data.materials[0] = make_material("Glow", "ShaderNodeEmission")
    bpy.data.objects["Floor"].hide_render = True

    def arrange(rng):
        inputs = monkey.data.materials[0].node_tree.nodes["Shader"].inputs
        inputs["Color"].default_value, inputs["Strength"].default_value = (*rng.uniform(0, 1, 3), 1), rng.uniform(0, 9)

    for each in pictures(arrange):
        for name in ("Combined", "Emission"):
            traced, cycles = each.traced[name][..., :3], each.cycles[0][name][..., :3]
            # Cycles' product of color and strength is rounded once more than ours, that with the exposure too.
            assert np.allclose(traced, cycles, rtol=2.0**-23, atol=0), np.abs(traced - cycles).max()
        assert (each.traced["Emission"] > 0).sum() > 300


def test_a_world_that_nothing_hides_lights_a_floor_by_its_albedo(pictures, set_world):
    set_world((0.25, 0.5, 0.75), 1.0)
    bpy.data.objects["Monkey"].hide_render = True
    for each in pictures():
        traced, cycles = each.traced["Combined"], each.cycles[0]["Combined"]
        assert np.allclose(traced, cycles, rtol=2e-7, atol=0), np.abs(traced - cycles).max()
        floor = each.traced["Object Index"][..., 0] > 0
        paper = each.traced["Diffuse Color"] * (0.25, 0.5, 0.75)
        assert floor.sum() > 1000 and np.allclose(cycles[floor, :3], paper[floor], rtol=1e-6), "on paper"


@pytest.mark.parametrize("sabotage", ["power", "shadow", "direction", "albedo"])
def test_a_wrong_formula_is_caught(pictures, sun, sabotage, monkeypatch):
    """The tests above must be able to fail."""
    from dataclasses import replace

    from viewcam_addon.blender.scenes import lamps
    from viewcam_addon.tracer.scene import materials
    from viewcam_addon.tracer.scene.shader_nodes import Closure, node

    right = lamps.lamps_in

    def wrong(*arguments):
        for lamp in right(*arguments):
            if sabotage == "power":
                lamp = replace(lamp, irradiance=tuple(1.00001 * value for value in lamp.irradiance))
            elif sabotage == "shadow":
                lamp = replace(lamp, casts_shadow=False)
            elif sabotage == "direction":
                lamp = replace(lamp, towards=tuple(np.add(lamp.towards, (1e-4, 0, 0))))
            yield lamp

    monkeypatch.setattr(lamps, "lamps_in", wrong)
    if sabotage == "albedo":
        closures = materials.Material.closures.fget

        def darker(material):
            for each in closures(material):
                color = each.node["color"]
                yield Closure(node(each.node.type, color=replace(color, rgb=tuple(0.99999 * x for x in color.rgb))))

        monkeypatch.setattr(materials.Material, "closures", property(lambda material: tuple(darker(material))))
    sides = pictures(sun, scenes=2)
    with pytest.raises(AssertionError):
        check(sides * 5, SUN)
