"""Far from the origin: with the origin at the eye both sides show the file's scene to a thousandth of a pixel.

And the file stays as it is, and what did not come along is named.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from mathutils import Vector

from viewcam_addon.blender.camera import apply
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.rendering import cycles
from viewcam_addon.blender.scenes import recentering
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError, NotModeledError
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Mesh, scene_file


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


UTM = (448262.25, 5411932.5, 42.0)
ECEF = (4200952.5, 780362.0, 4720030.0)


@pytest.mark.slow
@pytest.mark.parametrize("place", [UTM, ECEF, (0.0, 0.0, 0.0)], ids=["UTM", "ECEF", "home"])
def test_a_crowded_scene_anywhere_in_the_world_is_compared_to_a_thousandth_of_a_pixel(place, crowd, check):
    crowd(place)
    sides = check()
    assert sides.exported.origin == tuple(np.add(place, (6.2, -7.3, 4.123456789)))
    assert sides.exported.camera.eye == (0, 0, 0) and sides.exported.stated_camera.eye == (0, 0, 0)
    present = set(np.unique(sides.cycles["Object Index"]))
    assert len(present) >= 7, f"only the objects {present} are in the picture"


@pytest.mark.parametrize("place", [UTM, ECEF], ids=["UTM", "ECEF"])
def test_what_plain_cycles_misses_by_pixels_is_told(place, look, both_sides, add_map):
    look(place)
    add_map(place)
    comparison = both_sides().comparison
    assert comparison.rows[0].values[0] > 0.5, f"only {comparison.rows[0].values[0]:.2g} px"
    assert "check with --recenter" in comparison.far_from_origin.sentence
    assert both_sides(recenter=True).comparison.far_from_origin is None


def depth_of(comparison):
    """The median error of Depth, relative."""
    return next(row for row in comparison.rows if row.name == "Depth").values[0]


def test_a_map_that_was_pulled_home_is_within_the_tolerance_and_exact_when_recentered(look, both_sides, check, add_map):
    """Its vertices are far from its origin, and its origin as far from the world's: Cycles adds the two in float32.

    Each of its rays meets the rounded surface where it should, and so only Depth tells.
    """
    look((0, 0, 0))
    block = add_map(UTM)
    block.rotation_euler.z = 0.5
    block.location = -(block.rotation_euler.to_matrix() @ Vector(UTM))
    comparison = both_sides().comparison
    assert comparison.passed and depth_of(comparison) > 1e-3, "\n".join(comparison.lines())
    assert depth_of(check().comparison) < 1e-6


def test_one_map_that_stands_in_several_places(look, scene, check, add_map):
    look(UTM)
    first = add_map(UTM)
    for shift in ((40, 0, 3), (0, 40, 0)):
        other = bpy.data.objects.new("Copy", first.data)
        scene.collection.objects.link(other)
        other.location = shift
    check()


def limit(block, place):
    limit = block.constraints.new("LIMIT_LOCATION")
    limit.use_min_x, limit.min_x = True, place[0] + 1.5


def child_of(block, place):
    target = bpy.data.objects.new("Target", None)
    bpy.context.scene.collection.objects.link(target)
    target.location, target.rotation_euler = place, (0, 0, 0.3)
    bpy.context.view_layer.update()
    constraint = block.constraints.new("CHILD_OF")
    constraint.target, constraint.inverse_matrix = target, target.matrix_world.inverted()
    target.location.z += 1


def driven(block, place):
    driver = block.driver_add("location", 2).driver
    variable = driver.variables.new()
    variable.type = "TRANSFORMS"
    variable.targets[0].id, variable.targets[0].transform_type = bpy.context.scene.camera, "LOC_Z"
    driver.expression = "var - 3"


def rigid(block, place):
    bpy.context.view_layer.objects.active = block
    block.select_set(True)
    bpy.ops.rigidbody.object_add()
    bpy.context.scene.frame_set(5)


@pytest.mark.parametrize("move", [limit, child_of, driven, rigid])
def test_what_is_computed_in_world_space_stands_where_the_file_has_it(move, look, add, mesh_from, check):
    look(UTM)
    block = add(mesh_from("cube"), "Cube", UTM)
    move(block, UTM)
    check()


def test_points_and_instances_of_geometry_nodes(look, add, mesh_from, node_group, check, map_mesh):
    look(ECEF)
    tree, start, end = node_group()
    to_points, place_on, ball = (
        tree.nodes.new(f"GeometryNode{kind}") for kind in ("MeshToPoints", "InstanceOnPoints", "MeshIcoSphere")
    )
    to_points.inputs["Radius"].default_value, ball.inputs["Radius"].default_value = 0.4, 0.5
    shift = tree.nodes.new("GeometryNodeTransform")
    shift.inputs["Translation"].default_value = (0, 0, 1.5)
    join = tree.nodes.new("GeometryNodeJoinGeometry")
    tree.links.new(start.outputs[0], to_points.inputs["Mesh"])
    tree.links.new(to_points.outputs[0], shift.inputs["Geometry"])
    tree.links.new(shift.outputs[0], place_on.inputs["Points"])
    tree.links.new(ball.outputs[0], place_on.inputs["Instance"])
    for socket in (to_points.outputs[0], place_on.outputs[0]):
        tree.links.new(socket, join.inputs[0])
    tree.links.new(join.outputs[0], end.inputs[0])
    for name, data, where in (
        ("Here", mesh_from("grid", x_subdivisions=3, y_subdivisions=3, size=6), ECEF),
        ("Far from its origin", map_mesh("Far", np.add(ECEF, (4, 4, 0)), 4, 3), (0, 0, 0)),
    ):
        add(data, name, where).modifiers.new("Nodes", "NODES").node_group = tree
    sides = check()
    kinds = {type(geometry).__name__ for geometry in sides.exported.geometries.values()}
    assert kinds == {"Mesh", "Spheres"}


def test_particles_follow(look, add, mesh_from, scene, check):
    look(UTM)
    ground = add(mesh_from("grid", size=8), "Ground", UTM)
    ball = add(mesh_from("ico_sphere", radius=0.3), "Ball", np.add(UTM, (0, 0, -9)))
    ground.modifiers.new("Particles", "PARTICLE_SYSTEM")
    settings = ground.particle_systems[0].settings
    settings.count, settings.frame_end, settings.render_type, settings.instance_object = 40, 1, "OBJECT", ball
    settings.particle_size, settings.physics_type = 1.0, "NO"
    scene.frame_set(3)
    sides = check()
    (balls,) = (each for each in sides.exported.objects if each.name == "Ball")
    assert len(balls.matrices) == 41, "one for each particle, and the ball itself"


@pytest.mark.parametrize(
    "change, sentence",
    [
        (lambda matrices: matrices[:, :, [1, 0, 2, 3]], "instance 1 of Map is"),
        (lambda matrices: matrices[::-1], "instance 1 of Map is"),
        (lambda matrices: matrices[:2], "the same number of instances"),
    ],
    ids=["turned", "in another order", "one fewer"],
)
def test_instances_that_are_not_where_the_file_has_them_are_caught(change, sentence, look, add, map_mesh, check_moved):
    look(UTM)
    many = bpy.data.collections.new("Many")
    add(map_mesh("Map", (0, 0, 0)), "Map", collection=many)
    for number in range(3):
        instance = add(None, f"Instance {number}", np.add(UTM, (40.0 * number, 0, 0)))
        instance.instance_type, instance.instance_collection = "COLLECTION", many
    plain, moved = (jobs.export(Job(recenter=recenter)) for recenter in (False, True))
    check_moved(plain, moved)
    (maps,) = moved.objects
    with pytest.raises(AssertionError, match=sentence):
        check_moved(plain, replace(moved, objects=(replace(maps, matrix=change(maps.matrices)),)))


def test_a_file_in_edit_mode_and_materials_of_the_object_or_the_layer(look, add, mesh_from, scene, check):
    look(UTM)
    blue, layers, red = (bpy.data.materials.new(name) for name in ("Blue", "Layer", "Red"))
    blue_index, layers_index, red_index = 1, 2, 3  # as `datablocks.numbered_indices` counts them, in the order of their names
    mesh = mesh_from("cube", size=3)
    mesh.materials.append(red)
    mesh.materials.append(None)
    for number, polygon in enumerate(mesh.polygons):
        polygon.material_index = number % 2
    for number in range(2):
        block = add(mesh, f"Cube {number}", np.add(UTM, (4 * number - 2, 0, 0)))
        block.material_slots[1].link = "OBJECT"
        block.material_slots[1].material = blue if number else None
    sides = check()
    assert set(np.unique(sides.cycles["Material Index"])) == {0, blue_index, red_index}
    scene.view_layers[0].material_override = layers
    assert set(np.unique(check().cycles["Material Index"])) == {0, layers_index}
    bpy.context.view_layer.objects.active = block
    bpy.ops.object.mode_set(mode="EDIT")
    check()
    assert bpy.context.mode == "EDIT_MESH"


def test_normals_uvs_and_a_mirrored_portrait_with_shift(look, monkey, camera_object, scene, check):
    render = scene.render
    render.pixel_aspect_x, render.use_border, render.use_crop_to_border = 1.5, True, True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.1, 0.9, 0.2, 1.0
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    monkey.location, monkey.scale = ECEF, (3, -2, 4)
    bpy.context.view_layer.update()
    eye, look_at = (tuple(np.add(ECEF, point).tolist()) for point in ((1, -8, 9), (0, 0, 1)))
    size = (128, 96)
    pinhole = Pinhole(eye, look_at, (0.1, 0, 1), (90, 135), *size, (70, 40), mirrored=True)
    assert apply(camera_object, pinhole, scene) == []
    sides = check()
    assert sides.exported.camera.mirrored and sides.exported.camera.principal_point == pytest.approx((70, 40), abs=1e-4)
    assert {"Normal", "UV"} <= {row.name for row in sides.comparison.rows if row.count}


def test_the_camera_of_a_file_that_states_none_is_taken_as_it_stands(look, camera_object, check, add_map):
    look(UTM)
    camera_object.virtual_pinhole.enabled = False
    add_map(UTM)
    sides = check()
    assert sides.exported.origin == tuple(camera_object.matrix_world.translation)
    assert sides.comparison.conversion.ok and sides.comparison.conversion.largest < 1e-3


def test_a_camera_that_is_not_where_it_was_stated_is_still_told(look, camera_object, both_sides, add_map):
    look(UTM)
    add_map(UTM)
    limit = camera_object.constraints.new("LIMIT_ROTATION")
    limit.use_limit_z, limit.min_z = True, camera_object.rotation_euler.z + 0.05
    limit.max_z = limit.min_z
    comparison = both_sides(recenter=True).comparison
    assert comparison.rows[0].ok and not comparison.conversion.ok
    # 0.05 rad at a distance of 150 px.
    assert comparison.conversion.largest > 5


def test_a_held_roll_is_held(look, camera_object, check, add_map):
    look(UTM)
    add_map(UTM)
    group = camera_object.virtual_pinhole
    group.pole, group.held_roll = "HOLD", 0.4
    sides = check()
    tilt = sides.exported.camera.basis()[0][2]  # u of a level camera is horizontal
    assert abs(tilt) > 0.2 and sides.comparison.conversion.largest < 1e-3


def test_an_object_that_is_nowhere_is_left_out_and_told(look, add, add_map, mesh_from):
    look(UTM)
    add_map(UTM)
    add(mesh_from("cube"), "Lost", UTM).scale.x = float("nan")
    for recenter in (False, True):
        exported = jobs.export(Job(recenter=recenter))
        (reason,) = [entry.reason for entry in exported.ledger if entry.object == "Lost"]
        assert "has a transform that is not finite, and Cycles does not draw it" in reason, reason
        assert "Lost" not in [placed.name for placed in exported.objects]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_large_scale_or_a_small_one_moves_as_exactly(scale, look, check, add_map):
    look(UTM)
    add_map(np.divide(UTM, scale), size=30 / scale).scale = (scale, scale, scale)
    check()


@pytest.mark.slow
def test_the_command_as_its_users_type_it(look, scene, tmp_path, capfd, add_map):
    look(ECEF)
    add_map(ECEF)
    path, result = tmp_path / "far.blend", tmp_path / "result.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    words = ["check", str(path), "--threads", "2", "--json", str(result)]
    main(words)
    plain = json.loads(result.read_text())
    output = capfd.readouterr().out
    assert plain["far_from_origin"]["error"] > 0.5 and plain["far_from_origin"]["sentence"] in output
    assert main([*words, "--recenter"]) == 0
    recentered = json.loads(result.read_text())
    assert recentered["far_from_origin"] is None and recentered["origin"] == np.add(ECEF, (6.2, -7.3, 4.123456789)).tolist()
    assert recentered["passes"][0]["percentiles"]["p99"]["value"] < 1e-3
    scene_path = tmp_path / "scene.json"
    assert main(["export", str(path), str(scene_path), "--recenter"]) == 0
    assert list(scene_file.read(scene_path).origin) == recentered["origin"]
    assert main(["cycles", str(path), str(tmp_path / "picture.exr"), "--recenter"]) == 0


@pytest.mark.parametrize(
    ("output", "status"), [("Random", "approximated"), ("Location", "approximated"), ("Object Index", "exported")]
)
def test_materials_that_ask_where_they_are_are_the_same_on_both_sides_and_told(
    output, status, look, add, mesh_from, make_material, add_lamp, tmp_path, read_passes
):
    look((1000.0, 2000.0, 30.0))
    cubes = [add(mesh_from("cube"), name, (1000.0 + 3 * i, 2000.0, 30.0)) for i, name in enumerate(("Left", "Right"))]
    material = make_material("Asks", "ShaderNodeBsdfDiffuse")
    tree = material.node_tree
    socket = tree.nodes.new("ShaderNodeObjectInfo").outputs[output]
    scaled = tree.nodes.new("ShaderNodeVectorMath")
    scaled.operation, scaled.inputs[1].default_value = "MULTIPLY", (1e-2,) * 3 if output == "Location" else (1.0,) * 3
    absolute = tree.nodes.new("ShaderNodeVectorMath")
    absolute.operation = "ABSOLUTE"
    tree.links.new(socket, scaled.inputs[0])
    tree.links.new(scaled.outputs[0], absolute.inputs[0])
    tree.links.new(absolute.outputs[0], tree.nodes["Shader"].inputs["Color"])
    for number, cube in enumerate(cubes):
        cube.data.materials.append(material)
        cube.pass_index = number
    add_lamp("SUN", rotation=(0.3, 0.4, 0), angle=0.0)
    exported = jobs.both_sides(Job(level="direct", samples=1, recenter=True, threads=2), [tmp_path / "0.exr"])
    (cycles_passes,) = (passes["Diffuse Color"] for passes in read_passes([tmp_path / "0.exr"]))
    traced = render(exported, "direct", 1, threads=2)["Diffuse Color"]
    assert np.percentile(np.abs(traced - cycles_passes), 99.5) <= 1e-6 and cycles_passes.max() > 0.01
    assert {entry.status for entry in exported.ledger if entry.object in ("Left", "Right")} == {status}


def file_state():
    """Names, users and transforms of all that is in the file, and what is selected."""
    kinds = [prop.identifier for prop in bpy.data.bl_rna.properties if prop.type == "COLLECTION"]
    state = {kind: [(block.name_full, block.users) for block in getattr(bpy.data, kind)] for kind in kinds}
    for block in bpy.data.objects:
        own = ("location", "rotation_euler", "rotation_quaternion", "scale", "delta_location", "color")
        state[block.name] = [tuple(getattr(block, name)) for name in own] + [
            [tuple(row) for matrix in (block.matrix_world, block.matrix_parent_inverse) for row in matrix],
            (block.parent, block.parent_type, block.pass_index, block.hide_render, block.select_get(), len(block.constraints)),
            [slot.material for slot in block.material_slots],
        ]
    for mesh in bpy.data.meshes:
        state[f"mesh {mesh.name}"] = [tuple(vertex.co) for vertex in mesh.vertices]
    scene, layer = bpy.context.scene, bpy.context.view_layer
    return state | {"context": (scene, scene.camera, scene.frame_current, scene.frame_subframe, layer, layer.objects.active)}


def near_the_origin(entry):
    """An entry as a tuple, but for triangles that far from the origin, in float32, lie exactly where others do."""
    return entry.object, entry.status, "" if "lie exactly where" in entry.reason else entry.reason


@pytest.mark.slow
def test_the_ledger_is_that_of_the_file(crowd, scene, add, mesh_from, check):
    crowd(UTM)
    glass = bpy.data.materials.new("Glass")
    glass.use_nodes = True
    glass.node_tree.nodes["Principled BSDF"].inputs["Alpha"].default_value = 0.3
    bpy.data.objects["Map"].data.materials.append(glass)
    scene.camera.data.dof.use_dof = True
    add(bpy.data.hair_curves.new("Hair"), "Hair", UTM)
    plain, sides = jobs.export(Job()), check()
    assert sorted(map(near_the_origin, sides.exported.ledger)) == sorted(map(near_the_origin, plain.ledger))
    assert {entry.status for entry in plain.ledger} == {"exported", "approximated", "skipped"}
    with pytest.raises(NotModeledError, match="Hair"):
        jobs.export(Job(strict=True, recenter=True))


def test_rendering_alone_recenters_too(look, tmp_path, add_map):
    look(UTM)
    add_map(UTM)
    entries = jobs.cycles(Job(recenter=True), tmp_path / "picture.exr")
    assert [(entry.object, entry.status) for entry in entries] == [("Map", "exported")]
    assert (tmp_path / "picture.exr").stat().st_size > 1000


def test_the_file_is_as_it_was(crowd, both_sides):
    crowd(UTM)
    bpy.context.view_layer.objects.active = bpy.data.objects["Monkey"]
    bpy.data.objects["Monkey"].select_set(True)
    jobs.export(Job())  # evaluates all, and leaves a render result
    before = file_state()
    both_sides(recenter=True)
    assert file_state() == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("room", "name"), [(cycles, "render"), (recentering, "_moved"), (recentering, "_camera"), (recentering, "_verify")]
)
def test_the_file_is_as_it_was_after_a_failure(crowd, monkeypatch, tmp_path, room, name):
    crowd(ECEF)
    jobs.export(Job())
    before = file_state()

    def fails(*_arguments, **_options):
        raise InputError("out of luck")

    monkeypatch.setattr(room, name, fails)
    with pytest.raises(InputError, match="out of luck"):
        jobs.both_sides(Job(recenter=True), [tmp_path / "picture.exr"])
    assert file_state() == before


def stays(placed):
    """An object that was not moved."""
    return placed.matrix + np.pad(np.array(ECEF)[:, None], ((0, 1), (3, 0)))


def one_unit_off(placed):
    """An object that is off by two units in the last place of its largest coordinate."""
    matrix = placed.matrix.copy()
    matrix[0, 3] *= 1 + 2.0**-22
    return matrix


def turned(placed):
    """An object that is turned by a thousandth of a degree."""
    angle = math.radians(1e-3)
    turn = np.eye(4)
    turn[:2, :2] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return placed.matrix @ turn


@pytest.mark.parametrize("sabotage", [stays, one_unit_off, turned])
def test_an_object_that_did_not_follow_is_named(sabotage, look, add, mesh_from, monkeypatch):
    look(ECEF)
    add(mesh_from("cube"), "Cube", np.add(ECEF, (20, 0, 0)))
    place = recentering._place

    def place_wrongly(overrides, temporary, placed):
        copies = place(overrides, temporary, placed)
        for block, each in copies.items():
            block.matrix_parent_inverse = recentering.Matrix(sabotage(each))
        return copies

    monkeypatch.setattr(recentering, "_place", place_wrongly)
    with pytest.raises(InputError, match="object 'Cube' did not follow") as caught:
        jobs.export(Job(recenter=True))
    assert "\n" not in str(caught.value)


def test_a_vertex_that_did_not_follow_and_an_object_that_is_gone_are_named(look, monkeypatch, add_map):
    look(UTM)
    add_map(UTM)
    place = recentering._place

    def spoil(change):
        def place_wrongly(overrides, temporary, placed):
            copies = place(overrides, temporary, placed)
            change(next(iter(copies)))
            return copies

        monkeypatch.setattr(recentering, "_place", place_wrongly)

    def move_a_vertex(block):
        block.data.vertices[7].co.x *= 1 + 2.0**-20

    spoil(move_a_vertex)
    with pytest.raises(InputError, match="object 'Map' did not follow"):
        jobs.export(Job(recenter=True))
    spoil(lambda block: setattr(block, "hide_render", True))
    with pytest.raises(InputError, match="object 'Map' is missing"):
        jobs.export(Job(recenter=True))


def test_objects_of_a_library_are_shown_and_stay_linked(look, add, mesh_from, tmp_path, check, link_object):
    look(UTM)
    block = add(mesh_from("monkey"), "Linked", UTM)
    block.shape_key_add(name="Basis")
    block.data.materials.append(bpy.data.materials.new("Linked too"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"), copy=True)
    for blocks, each in ((bpy.data.objects, block), (bpy.data.meshes, block.data)):
        blocks.remove(each)
    link_object(tmp_path / "library.blend", "Linked")
    check()
    before = file_state()
    check()
    assert file_state() == before and bpy.data.objects["Linked"].library
