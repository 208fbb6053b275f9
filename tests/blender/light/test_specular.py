"""Directions of Cycles' mirrored and refracted rays, pixel by pixel: a world that shows its own directions tells.

The surface is a jagged sheet with smooth normals, seen flatly, so that most of these send a mirror's ray below the sheet.
"""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.tracer.core_probes import reflected, refracted, specular_normal
from viewcam_addon.blender.rendering import cycles

pytestmark = pytest.mark.slow


def dot(a, b):
    return (a * b).sum(axis=0)


@pytest.fixture
def sheet(add, scene, mesh_from):
    """A sheet of 128 triangles, and a camera close above it."""
    mesh = mesh_from("grid", x_subdivisions=8, y_subdivisions=8, size=2)
    rng = np.random.default_rng(1)
    for vertex in mesh.vertices:
        vertex.co.z = rng.normal() * 0.18
    block = add(mesh, "Sheet")
    modifier = block.modifiers.new("Triangles", "TRIANGULATE")
    modifier.quad_method = "FIXED"
    camera = scene.camera
    camera.location, camera.rotation_euler = (0, -1.6, 0.35), (1.4, 0, 0)
    scene.render.resolution_x = scene.render.resolution_y = 96
    scene.cycles.max_bounces = scene.cycles.glossy_bounces = scene.cycles.transmission_bounces = 0
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = True
    scene.cycles.blur_glossy = 0
    return block


@pytest.fixture
def shown_directions(set_world):
    """A world whose light is (1 + its direction) / 2."""
    tree = set_world().node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    coordinate, halved = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeVectorMath")
    halved.operation = "MULTIPLY_ADD"
    halved.inputs[1].default_value = halved.inputs[2].default_value = (0.5, 0.5, 0.5)
    tree.links.new(coordinate.outputs["Generated"], halved.inputs[0])
    tree.links.new(halved.outputs["Vector"], background.inputs["Color"])


@pytest.fixture
def rays(sheet, shown_directions, scene, make_material, read_passes, tmp_path):
    """rays(shader, {input: value}) → of each pixel on the sheet, (3, n): the ray, its true and smooth normals, and the way on.

    The way is 0 where Cycles' picture is black; the last is (n,), whether the sheet is met from behind.
    """

    def passes(name, smooth, material):
        for polygon in sheet.data.polygons:
            polygon.use_smooth = smooth
        sheet.data.materials.clear()
        sheet.data.materials.append(material)
        path = tmp_path / f"{name}.exr"
        cycles.render(scene, scene.view_layers[0], scene.camera, path)
        return path

    def cast(shader, **inputs):
        matte = make_material("Matte", "ShaderNodeBsdfDiffuse")
        paths = [
            passes("flat", False, matte),
            passes("smooth", True, matte),
            passes("way", True, make_material("Specular", shader, Roughness=0.0, Color=(1, 1, 1, 1), **inputs)),
        ]
        flat, smooth, way = read_passes(paths)
        seen = flat["Depth"][..., 0] < 1e9
        position = flat["Position"][seen].T.astype(np.float64)
        ray = position - np.array(scene.camera.location)[:, None]
        ray /= np.sqrt(dot(ray, ray))
        true, shading = (picture["Normal"][seen].T.astype(np.float64) for picture in (flat, smooth))
        true /= np.sqrt(dot(true, true))
        shading /= np.sqrt(dot(shading, shading))
        color = way["Combined"][seen].T[:3].astype(np.float64)
        return ray, true, shading, np.where(color.any(axis=0), 2 * color - 1, 0.0), true[2] < 0

    return cast


def check(light, expected):
    """Assert the same directions, but for a hundredth. Cycles' are float32: off by 1e-7, and ten times that where bent."""
    is_lit = light.any(axis=0)
    error = np.sqrt(dot(light - expected, light - expected))[is_lit]
    assert is_lit.mean() > 0.1, "nearly all of the sheet is black"
    assert np.percentile(error, 50) < 5e-7 and np.percentile(error, 99) < 1e-5, np.percentile(error, [50, 90, 99, 100])


def test_a_mirror_bends_its_smooth_normals_so_that_no_ray_goes_below(rays):
    ray, true, shading, way, _ = rays("ShaderNodeBsdfAnisotropic")
    bent = specular_normal(ray, true, shading)
    assert (bent != shading).any(axis=0).mean() > 0.3, "hardly any normal is to be bent"
    check(way, reflected(ray, bent))
    with pytest.raises(AssertionError):
        check(way, reflected(ray, shading))


@pytest.mark.parametrize("ior", [1.5, *(pytest.param(ior, marks=pytest.mark.exhaustive) for ior in (1.1, 1 / 1.1))])
def test_refraction_bends_them_likewise_and_is_black_where_no_light_goes_through(rays, ior):
    ray, true, shading, way, backside = rays("ShaderNodeBsdfRefraction", IOR=ior)

    def sent(normal):
        outwards, inwards = refracted(ray, normal, 1 / ior), refracted(ray, normal, ior)
        return (np.where(backside, *pair) for pair in zip(outwards, inwards, strict=True))

    expected, total = sent(specular_normal(ray, true, shading))
    check(way, expected)
    black = total | (dot(expected, true) > 0)
    assert black.any() and not way[:, black].any()
    with pytest.raises(AssertionError):
        check(way, next(sent(shading)))
