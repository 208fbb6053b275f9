"""What Cycles does with light inside a point cloud's sphere: a ray is refracted on its way in, and never meets the far side."""

import sys

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as blender_camera
from viewcam_addon.tracer.light.scattering import refracted
from viewcam_addon.tracer.rays.ellipsoids import ellipsoids_of
from viewcam_addon.tracer.rays.points import Surfaces
from viewcam_addon.tracer.rays.space import Space
from viewcam_addon.tracer.rays.triangles import Planes, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Object, Scene, Spheres

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
    view = View(pinhole)
    triangles = triangles_of([], view)
    ellipsoids = ellipsoids_of([(scene.objects[0], scene.geometries["drop"])], view)
    surfaces = Surfaces(scene, view, triangles, Planes(triangles, view), ellipsoids)
    rows, columns = np.mgrid[: pinhole.height, : pinhole.width] + 0.5
    x, y = pinhole.view_plane(columns.ravel(), rows.ravel())
    pixels = np.flatnonzero(np.isfinite(ellipsoids.depth(np.zeros(1, np.intp), x, y)))
    x, y = x[pixels], y[pixels]
    points = surfaces.seen(np.zeros(len(pixels), np.intp), x, y)
    ways = np.stack([x, y, np.ones_like(x)])
    ways /= np.linalg.norm(ways, axis=0)
    onwards, _ = refracted(ways, points.shading, np.full(len(x), IOR))
    met, _, _ = Space(surfaces).first(points, onwards, "transmission")
    assert not len(met), f"{len(met)} rays meet the far side of the sphere that they are in"
    start = (view.axes.T @ points.position).T + view.eye
    way = (view.axes.T @ onwards).T
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
