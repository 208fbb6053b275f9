"""Closures without noise: a floor of patches, one of each, under a sun without a size, seen at all angles, one sample a pixel.

Errors are relative to a patch's own light. Where lobes are tabulated (multiple scattering, and what layers leave to others)
they are those of the tables: core/bsdf/make_albedo_tables.cpp computes them by quadrature, and Cycles' own have six digits.
"""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.rendering import job
from viewcam_addon.tracer import render

COLOUR = (0.8, 0.5, 0.2, 1.0)
GLOSSY, GLASS, PRINCIPLED = "ShaderNodeBsdfGlossy", "ShaderNodeBsdfGlass", "ShaderNodeBsdfPrincipled"
METALLIC = [] if bpy.app.version < (4, 3) else ["ShaderNodeBsdfMetallic"]
ROUGHNESSES = (0.2, 0.5, 0.8, 1.0)

# p50 and p99, calibrated on 4.2, 4.5, 5.0 and 5.2: what float32 leaves of the formulas (3.4e-7 and, at roughness 0.2, 1.7e-5,
# in 4.2 2.2e-5); the tables' own differences (2.7e-5, 7.8e-5), and those of facets as rough as can be (1.3e-4); an
# exponential in float32 far off a lobe (8.6e-7, 1.2e-4); refraction (7e-7, 3.3e-5).
FORMULAS = (5e-7, 2e-5 if bpy.app.version >= (4, 3) else 2.5e-5)
TABLES, ROUGHEST, BECKMANN, REFRACTED = (3e-5, 1e-4), (3e-5, 1.5e-4), (1.2e-6, 1.5e-4), (1e-6, 4e-5)


def of_formulas():
    for r in ROUGHNESSES:
        yield "ShaderNodeBsdfDiffuse", {"Color": COLOUR, "Roughness": r}, {}
        yield GLOSSY, {"Color": COLOUR, "Roughness": r}, {"distribution": "GGX"}
        yield GLASS, {"Color": COLOUR, "Roughness": r, "IOR": 1.45}, {"distribution": "GGX"}
        for kind in METALLIC:
            yield kind, {"Base Color": COLOUR, "Roughness": r}, {"distribution": "GGX"}
            physical = {"distribution": "GGX", "fresnel_type": "PHYSICAL_CONDUCTOR"}
            yield kind, {"IOR": (0.2, 0.9, 1.5), "Extinction": (3.9, 2.4, 1.9), "Roughness": r}, physical
    yield PRINCIPLED, {"Base Color": COLOUR, "Metallic": 1.0, "Roughness": 0.4}, {"distribution": "GGX"}


def of_bare_facets(roughnesses):
    for r in roughnesses:
        yield GLOSSY, {"Color": COLOUR, "Roughness": r}, {"distribution": "MULTI_GGX"}
        for kind in METALLIC:
            yield kind, {"Base Color": COLOUR, "Roughness": r}, {"distribution": "MULTI_GGX"}


def of_tables():
    for r in ROUGHNESSES:
        yield GLASS, {"Color": COLOUR, "Roughness": r, "IOR": 1.6}, {"distribution": "MULTI_GGX"}
        yield PRINCIPLED, {"Base Color": COLOUR, "Roughness": r}, {}
        yield PRINCIPLED, {"Base Color": COLOUR, "Roughness": r, "Metallic": 0.6, "Specular Tint": (0.9, 0.5, 0.7, 1)}, {}
        yield PRINCIPLED, {"Base Color": COLOUR, "Coat Weight": 0.7, "Coat Roughness": r, "Coat Tint": (0.9, 0.6, 0.4, 1)}, {}
        yield PRINCIPLED, {"Base Color": COLOUR, "Transmission Weight": 0.7, "Roughness": r, "IOR": 1.33}, {}
    yield from of_bare_facets(ROUGHNESSES[:-1])
    yield PRINCIPLED, {"Base Color": COLOUR, "Specular IOR Level": 0.9, "Roughness": 0.3}, {"distribution": "GGX"}
    yield PRINCIPLED, {"Base Color": COLOUR, "Specular IOR Level": 0.2, "IOR": 2.0, "Coat Weight": 1.0, "Coat IOR": 1.9}, {}
    yield PRINCIPLED, {"Base Color": COLOUR, "Diffuse Roughness": 0.6}, {}


def of_beckmann():
    for r in ROUGHNESSES:
        yield GLOSSY, {"Color": COLOUR, "Roughness": r}, {"distribution": "BECKMANN"}


def seen_through():
    for r in ROUGHNESSES:
        yield GLASS, {"Color": COLOUR, "Roughness": r, "IOR": 1.45}, {"distribution": "GGX"}
        yield "ShaderNodeBsdfRefraction", {"Color": COLOUR, "Roughness": r, "IOR": 1.45}, {"distribution": "GGX"}
    yield "ShaderNodeBsdfTranslucent", {"Color": COLOUR}, {}


@pytest.fixture
def patches(scene, camera, add, mesh_from, make_material, add_lamp, set_world, read_passes, tmp_path):
    """patches(shaders, towards, energy) → relative errors of each shader's pixels, under a sun that stands there."""

    def show(shaders, towards=(0.6, 0.3, 0.75), energy=np.pi):
        scene.render.resolution_x = scene.render.resolution_y = 96
        set_world((0, 0, 0), 0.0)
        camera.location, camera.rotation_euler, camera.data.lens = (0.013, 0.029, 1.0), (0, 0, 0), 9.0
        sun = add_lamp("SUN", angle=0.0)
        sun.data.energy = energy
        sun.rotation_mode = "QUATERNION"
        from mathutils import Vector

        sun.rotation_quaternion = Vector(towards).to_track_quat("Z", "Y")
        shaders = list(shaders)
        side, cells = 4.0 / 24, 24
        for number, (kind, inputs, properties) in enumerate(shaders):
            material = make_material(f"M{number}", kind)
            shader = material.node_tree.nodes["Shader"]
            for name, value in inputs.items():
                if name in shader.inputs:
                    shader.inputs[name].default_value = value
            for name, value in properties.items():
                setattr(shader, name, value)
            # Strewn, so that every shader is seen at all angles.
            places = [place for place in range(cells * cells) if place % len(shaders) == number]
            corners = [((p % cells - cells / 2) * side, ((7 * p // cells) % cells - cells / 2) * side) for p in places]
            vertices = [(x + dx, y + dy, 0.0) for x, y in corners for dx, dy in ((0, 0), (side, 0), (side, side), (0, side))]
            mesh = bpy.data.meshes.new(f"P{number}")
            mesh.from_pydata(vertices, [], [range(4 * i, 4 * i + 4) for i in range(len(corners))])
            mesh.materials.append(material)
            add(mesh, f"P{number}", pass_index=number + 1)
        path = tmp_path / "patches.exr"
        exported = job.export_and_render(job.Request(threads=2, level="direct", samples=1), [path])
        assert all(entry.status == "exported" for entry in exported.ledger), exported.ledger
        (theirs,) = read_passes([path])
        ours = render.render(exported, "direct", 1, threads=2)
        found = []
        for number in range(len(shaders)):
            here = ours["Object Index"][..., 0] == number + 1
            one, other = (side["Combined"][here][:, :3].astype(np.float64) for side in (ours, theirs))
            lit = (one > 0) & (other > 0)
            assert here.sum() > 60 and lit.any(), (shaders[number], here.sum())
            least = 1e-6 * other.max()
            found.append(np.abs(one - other)[lit] / np.maximum(other, least)[lit])
        return found

    return show


def check(found, shaders, figures):
    told = [
        f"{kind} {inputs} {properties}: p50 {np.median(each):.1e}, p99 {np.quantile(each, 0.99):.1e}, most {each.max():.1e}"
        for each, (kind, inputs, properties) in zip(found, shaders, strict=True)
        if not (np.median(each) <= figures[0] and np.quantile(each, 0.99) <= figures[1])
    ]
    assert not told, "\n".join(told)


def test_lobes_are_cycles_to_float32(patches):
    check(patches(of_formulas()), of_formulas(), FORMULAS)


def test_tabulated_lobes_and_layers_are_cycles_to_the_tables(patches):
    check(patches(of_tables()), of_tables(), TABLES)


def test_facets_as_rough_as_can_be_are_cycles_to_their_table(patches):
    roughest = list(of_bare_facets([1.0]))
    check(patches(roughest), roughest, ROUGHEST)


def test_beckmanns_lobes_are_cycles_to_its_exponential(patches):
    check(patches(of_beckmann()), of_beckmann(), BECKMANN)


def test_what_is_lit_from_behind_is_cycles(patches):
    check(patches(seen_through(), (0.3, 0.2, -0.7)), seen_through(), REFRACTED)


def test_what_shines_below_a_coat_is_cycles(patches):
    """Without the sun, since Cycles would ask it or the surface that shines by chance."""
    shining = {"Base Color": COLOUR, "Emission Color": COLOUR, "Emission Strength": 0.7}
    shaders = [
        (PRINCIPLED, shining | {"Coat Weight": weight, "Coat Tint": (0.9, 0.6, 0.4, 1)}, {}) for weight in (0.0, 0.5, 1.0)
    ]
    check(patches(shaders, energy=0.0), shaders, TABLES)


@pytest.mark.parametrize("wrong", [{"roughness": 0.41}, {"base_color": (0.81, 0.5, 0.2)}, {"ior": 1.52}])
def test_a_little_more_of_an_input_is_found(patches, monkeypatch, wrong):
    """The tests above must be able to fail."""
    from viewcam_addon.tracer.scene import materials
    from viewcam_addon.tracer.scene.shader_nodes import Closure, node

    right = materials.Material.closures.fget

    def changed(material):
        return tuple(Closure(node(each.node.type, **dict(each.node.inputs) | wrong)) for each in right(material))

    monkeypatch.setattr(materials.Material, "closures", property(changed))
    shaders = [(PRINCIPLED, {"Base Color": COLOUR, "Roughness": 0.4}, {})]
    with pytest.raises(AssertionError, match="p50"):
        check(patches(shaders), shaders, TABLES)
