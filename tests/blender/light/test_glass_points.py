"""What Cycles does with light inside a point cloud's sphere: a ray is refracted on its way in, and never meets the far side."""

import sys

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as blender_camera
from viewcam_addon.tracer.native import CoreScene
from viewcam_addon.tracer.scene import Object, Scene, Spheres

from tests.tracer.core_probes import refracted  # isort: skip

IOR = 1.5
SKY = 40.0  # the radius of what render_positions makes shine


@pytest.fixture
def drop(scene, camera, add, node_group):
    """A point of radius 1 at the origin, of clear glass that does not reflect."""
    data = bpy.data.meshes.new("Point")
    data.from_pydata([(0, 0, 0)], [], [])
    material = bpy.data.materials.new("Refraction")
    if not material.node_tree:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new("ShaderNodeBsdfRefraction"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["IOR"].default_value, shader.inputs["Roughness"].default_value = IOR, 0
    material.node_tree.links.new(shader.outputs[0], output.inputs["Surface"])
    tree, source, target = node_group()
    points, paint = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    points.inputs["Radius"].default_value, paint.inputs["Material"].default_value = 1, material
    for output, goal in ((source, points), (points, paint), (paint, target)):
        tree.links.new(output.outputs[0], goal.inputs[0])
    block = add(data, "Drop")
    block.modifiers.new("Nodes", "NODES").node_group = tree
    return block


def beyond(pinhole, scale) -> tuple[np.ndarray, np.ndarray]:
    """By the tracer: which pixels show the drop, (n,), and where their refracted rays reach the sky, (n, 3)."""
    scene = Scene(
        pinhole,
        {"drop": Spheres(np.zeros((1, 3)), np.ones(1), np.zeros(1, np.int32))},
        (Object("drop", "drop", np.diag([*scale, 1.0])),),
    )
    core = CoreScene(scene, 1)
    rows, columns = np.mgrid[: pinhole.height, : pinhole.width]
    rays = core.rays(np.array(pinhole.eye)[None], pinhole.ray_directions(columns.ravel(), rows.ravel()))
    pixels = np.flatnonzero(np.isfinite(core.closest(rays)[0]))
    rays = rays[pixels]
    points, normals, _, _, _ = core.leaving(rays, np.array([0.0, 0.0, 1.0]))
    way = refracted(rays[:, 3:6].T, normals.T, IOR)[0].T
    _, _, _, starts, _ = core.leaving(rays, way)
    met = np.isfinite(core.closest(core.rays(starts + core.origin, way), "transmission")[0])
    assert not met.any(), f"{met.sum()} rays meet the far side of the sphere that they are in"
    start = points + core.origin
    along = np.einsum("ij,ij->i", start, way)
    reach = -along + np.sqrt(along**2 - np.einsum("ij,ij->i", start, start) + SKY**2)
    return pixels, start + reach[:, None] * way


@pytest.mark.parametrize("scale", [(1, 1, 1), (0.6, 1.3, 1)])
def test_rays_are_refracted_once_by_a_sphere_and_by_an_ellipsoid_about_the_direction_from_its_centre(
    scene, drop, camera, render_positions, scale
):
    drop.scale = scale
    shown = render_positions().reshape(-1, 3)
    pinhole = blender_camera.read(camera, scene)
    pixels, expected = beyond(pinhole, scale)
    assert len(pixels) > 20
    apart = np.linalg.norm(shown[pixels] - expected, axis=1)
    # The sky is an icosphere of sides up to 1.6: its faces lie up to 1.6² / (6 · 40) within the radius.
    assert apart.max() < 0.015, f"Cycles' rays reach the sky {apart.max():.2g} m elsewhere"


def test_rays_that_are_not_refracted_or_by_another_index_are_told_apart(monkeypatch, scene, drop, camera, render_positions):
    shown = render_positions().reshape(-1, 3)
    for ior in (1.0, 1.01 * IOR):
        monkeypatch.setattr(sys.modules[__name__], "IOR", ior)
        pixels, expected = beyond(blender_camera.read(camera, scene), (1, 1, 1))
        apart = np.linalg.norm(shown[pixels] - expected, axis=1)
        assert np.median(apart) > 0.03, (ior, np.median(apart))
