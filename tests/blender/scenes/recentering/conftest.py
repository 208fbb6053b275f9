"""Scenes far from the origin: a camera and maps at any place of the world, and both sides compared with the origin at the eye.

What is rendered is compared with the plain export of the same file, less the eye in float64: whatever moves an object or a
vertex, it must have moved along.
"""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.camera import apply
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.scene import Mesh


@pytest.fixture
def look(scene, camera_object):
    """A function that states the camera some meters beside a place, in float64, looking at it."""
    scene.render.resolution_x, scene.render.resolution_y = 160, 120

    def state(place, **options):
        eye, look_at = (tuple(np.add(place, point).tolist()) for point in ((6.2, -7.3, 4.123456789), (0.1, 0.2, 0.3)))
        return apply(camera_object, Pinhole(eye, look_at, (0, 0, 1), 150, 160, 120, **options), scene)

    return state


def _grid(name, place, size=30.0, count=20):
    """A mesh whose vertices lie at `place`: a map as geographers' files bring it, the object's origin far away."""
    steps = np.linspace(-size / 2, size / 2, count)
    x, y = np.meshgrid(steps, steps, indexing="ij")
    points = np.stack([x, y, np.sin(x / 3) + np.cos(y / 4) - 1], axis=-1).reshape(-1, 3) + place
    faces = [
        (i * count + j, (i + 1) * count + j, (i + 1) * count + j + 1, i * count + j + 1)
        for i in range(count - 1)
        for j in range(count - 1)
    ]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points.tolist(), [], faces)
    return mesh


@pytest.fixture
def map_mesh():
    """A function (name, place, size, count) that makes the mesh of a map at a place."""
    return _grid


@pytest.fixture
def add_map(scene):
    """A function that adds an object at the origin whose mesh is a map at a place, and returns it."""

    def add(place, name="Map", **options):
        block = bpy.data.objects.new(name, _grid(name, place, **options))
        scene.collection.objects.link(block)
        return block

    return add


@pytest.fixture
def crowd(scene, look, add, add_map, mesh_from):
    """A function that fills the scene at a place with all that Blender puts somewhere in the world."""

    def fill(place):
        look(place)
        add_map(place)
        monkey = add(mesh_from("monkey"), "Monkey", np.add(place, (0, 0, 1.5)))
        monkey.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
        monkey.shape_key_add(name="Basis")
        key = monkey.shape_key_add(name="Raised")
        key.value = 1.0
        for point in key.data:
            point.co.z += 0.5
        parent = add(None, "Parent", np.add(place, (2, 1, 1)))
        parent.rotation_euler, parent.scale = (0.2, 0.3, 0.4), (1, 2, 0.5)
        child = add(mesh_from("cube", size=1), "Child", (0.5, 0, 0.2))
        child.parent, child.rotation_euler = parent, (0.5, 0.1, 0.9)
        many = bpy.data.collections.new("Many")
        for number in range(3):
            add(mesh_from("ico_sphere", radius=0.5), f"Ball {number}", (number, 0, 0), many)
        for number in range(2):
            instance = add(None, f"Instance {number}", np.add(place, (-3, 2.0 * number, 0.5)))
            instance.instance_type, instance.instance_collection = "COLLECTION", many
        animated = add(mesh_from("cube", size=1), "Animated")
        for frame, shift in ((1, 0), (11, 2)):
            animated.location = np.add(place, (shift, -2, 0.5))
            animated.keyframe_insert("location", frame=frame)
        scene.frame_set(4)
        text = bpy.data.curves.new("Words", "FONT")
        text.body, text.extrude = "far", 0.1
        add(text, "Text", np.add(place, (-2, -3, 1)))
        add(bpy.data.lights.new("Sun", "SUN"), "Sun", place)

    return fill


def assert_moved(plain, moved):
    """Assert that each object has as many instances, and each point stands where the plain export has it, less the origin."""
    counts, wanted = ([(each.name, len(each.matrices)) for each in scene.objects] for scene in (moved, plain))
    assert counts == wanted, "not the same objects with the same number of instances"
    for was, now in zip(plain.objects, moved.objects, strict=True):
        before, after = (scene.geometries[each.geometry] for scene, each in ((plain, was), (moved, now)))
        points, moved_points = (each.vertices if isinstance(each, Mesh) else each.centers for each in (before, after))
        for number, (stood, stands) in enumerate(zip(was.matrices, now.matrices, strict=True), start=1):
            wanted = points @ stood[:3, :3].T + (stood[:3, 3] - moved.origin)
            counts = moved_points @ stands[:3, :3].T + stands[:3, 3]
            # The translation and the vertex are rounded to float32 once each, and the vertex is multiplied by the matrix.
            size = np.abs(moved_points) @ np.abs(stands[:3, :3]).T + np.abs(stands[:3, 3])
            off = np.abs(counts - wanted)
            error = off - 2.0**-23 * size - 1e-30
            assert error.max(initial=0) <= 0, f"instance {number} of {was.name} is {off.max():.3g} from where it should be"


@pytest.fixture
def check_moved():
    """`assert_moved`, for a test that it can fail."""
    return assert_moved


@pytest.fixture
def check(both_sides):
    """A function that fails unless both sides, recentered, are one picture of the file's scene; it returns them."""

    def compare(**request):
        plain = jobs.export(Job(**request))
        sides = both_sides(recenter=True, **request)
        sides.check()
        position = sides.comparison.rows[0]
        assert position.values[2] < 1e-3, f"99 % of the positions are within {position.values[2]:.1e} px"
        assert_moved(plain, sides.exported)
        return sides

    return compare
