import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.interface import selection
from viewcam_addon.errors import InputError

CUBE = np.array([[x, y, z] for x in (-1.0, 1) for y in (-1.0, 1) for z in (-1.0, 1)])


@pytest.fixture
def points(posed_camera):
    """A function that gives the selection's points, sorted."""

    def sorted_points():
        bpy.context.view_layer.update()
        found = selection.points(bpy.context, posed_camera)
        return found[np.lexsort(found.round(3).T[::-1])]

    return sorted_points


def select_only(*blocks):
    for block in bpy.context.scene.objects:
        block.select_set(block in blocks)


def test_a_mesh_is_its_vertices_in_the_world(points):
    bpy.ops.mesh.primitive_cube_add(location=(1, 2, 3), rotation=(0, 0, math.pi / 2), scale=(1, 1, 2))
    expected = CUBE * (1, 1, 2) + (1, 2, 3)
    np.testing.assert_allclose(points(), expected[np.lexsort(expected.T[::-1])], atol=8 * 2**-24)


def test_modifiers_and_constraints_count(points, empty):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    array = cube.modifiers.new("Array", "ARRAY")
    array.use_relative_offset, array.use_constant_offset, array.constant_offset_displace = False, True, (10, 0, 0)
    cube.constraints.new("COPY_LOCATION").target = empty("There", (0, 0, 100))
    found = points()
    assert len(found) == 16
    np.testing.assert_allclose(selection.bounds_centre(found), (5, 0, 100), atol=200 * 2**-24)


def test_the_instances_of_a_collection_count(points, scene):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    collection = bpy.data.collections.new("Cubes")
    collection.objects.link(cube)
    scene.collection.objects.unlink(cube)
    instancer = bpy.data.objects.new("Instancer", None)
    scene.collection.objects.link(instancer)
    instancer.instance_type, instancer.instance_collection, instancer.location = "COLLECTION", collection, (5, 0, 0)
    select_only(instancer)
    np.testing.assert_allclose(points(), CUBE + np.array([5, 0, 0]), atol=8 * 2**-24)


@pytest.mark.parametrize("kind", ["curve.primitive_bezier_circle", "surface.primitive_nurbs_surface_sphere", "object.text"])
def test_curves_surfaces_and_text_are_what_is_drawn(points, kind):
    room, name = kind.split(".")
    getattr(getattr(bpy.ops, room), f"{name}_add")(location=(0, 0, 7))
    found = points()
    assert len(found) > 8 and np.abs(found - (0, 0, 7)).max() < 3


def test_metaballs_are_what_is_drawn(points):
    bpy.ops.object.metaball_add(type="BALL", location=(0, 0, 7))
    found = points()
    assert len(found) > 20
    np.testing.assert_allclose(selection.bounds_centre(found), (0, 0, 7), atol=0.1)


def test_what_has_no_geometry_is_its_origin(points, empty, add_lamp):
    there = empty("There", (1, 2, 3))
    lamp = add_lamp("POINT", (4, 5, 6))
    select_only(there, lamp)
    np.testing.assert_array_equal(points(), [(1, 2, 3), (4, 5, 6)])


@pytest.mark.parametrize("kind", ["armature", "lattice"])
def test_armatures_and_lattices_are_their_boxes(points, kind):
    if kind == "armature":
        bpy.ops.object.armature_add(location=(3, 0, 0))
        middle = (3, 0, 0.5)
    else:
        bpy.ops.object.add(type="LATTICE", location=(3, 0, 0))
        middle = (3, 0, 0)
    np.testing.assert_allclose(selection.bounds_centre(points()), middle, atol=0.11)


def test_the_camera_itself_does_not_count(points, posed_camera, empty):
    there = empty("There", (1, 2, 3))
    select_only(there, posed_camera)
    np.testing.assert_array_equal(points(), [(1, 2, 3)])


def test_a_vertex_that_is_nowhere_does_not_count(points):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.data.vertices[0].co.x = math.nan
    assert len(points()) == 7


def test_nothing_selected_is_said(points, posed_camera):
    select_only(posed_camera)
    with pytest.raises(InputError, match="nothing but the camera, or nothing at all, is selected"):
        points()


def test_in_edit_mode_the_selected_vertices_count_without_modifiers(points):
    bpy.ops.mesh.primitive_cube_add(location=(0, 0, 10))
    cube = bpy.context.object
    cube.modifiers.new("Array", "ARRAY")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    with pytest.raises(InputError, match="no vertex, control point or bone is selected"):
        points()
    bpy.ops.object.mode_set(mode="OBJECT")
    for vertex in cube.data.vertices:
        vertex.select = vertex.co.z > 0
    bpy.ops.object.mode_set(mode="EDIT")
    assert len(points()) == 4 and (points()[:, 2] == 11).all()


def test_in_edit_mode_of_a_curve_the_selected_points_count(points):
    bpy.ops.curve.primitive_bezier_curve_add(location=(0, 0, 10))
    curve = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="DESELECT")
    curve.data.splines[0].bezier_points[0].select_control_point = True
    np.testing.assert_array_equal(points(), [(-1, 0, 10)])


def test_in_edit_mode_of_a_surface_the_selected_points_count(points):
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0, 0, 10))
    surface = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.curve.select_all(action="DESELECT")
    point = surface.data.splines[0].points[3]
    point.select = True
    np.testing.assert_allclose(points(), [np.add(point.co[:3], (0, 0, 10))], atol=16 * 2**-24)


def test_in_edit_mode_of_a_lattice_the_selected_points_count(points):
    bpy.ops.object.add(type="LATTICE", location=(0, 0, 10))
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.lattice.select_all(action="SELECT")
    np.testing.assert_allclose(points(), CUBE / 2 + (0, 0, 10), atol=16 * 2**-24)


def test_in_edit_mode_of_an_armature_the_selected_ends_count(points):
    bpy.ops.object.armature_add(location=(0, 0, 10))
    bpy.ops.object.mode_set(mode="EDIT")
    bone = bpy.context.object.data.edit_bones[0]
    bone.select_head, bone.select_tail = False, True
    np.testing.assert_allclose(points(), [(0, 0, 11)], atol=16 * 2**-24)


def test_in_pose_mode_the_selected_bones_count_as_they_are_posed(points):
    bpy.ops.object.armature_add(location=(0, 0, 10))
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.select_all(action="SELECT")
    bpy.context.object.pose.bones[0].location = (5, 0, 0)
    np.testing.assert_allclose(points(), [(5, 0, 10), (5, 0, 11)], atol=32 * 2**-24)


def test_the_median_is_the_mean_and_the_centre_is_that_of_the_box():
    cloud = np.array([[0.0, 0, 0], [0, 0, 0], [3, 6, -9]])
    assert selection.median(cloud) == (1, 2, -3)
    assert selection.bounds_centre(cloud) == (1.5, 3, -4.5)
