"""Far from the origin: the file stays as it is, and what did not come along is named."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.rendering import cycles
from viewcam_addon.blender.scenes import recentering
from viewcam_addon.errors import InputError, NotModeledError
from viewcam_addon.jobs.job import Job

UTM = (448262.25, 5411932.5, 42.0)
ECEF = (4200952.5, 780362.0, 4720030.0)


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


def test_objects_of_a_library_are_shown_and_stay_linked(look, add, mesh_from, scene, tmp_path, check):
    look(UTM)
    block = add(mesh_from("monkey"), "Linked", UTM)
    block.shape_key_add(name="Basis")
    block.data.materials.append(bpy.data.materials.new("Linked too"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"), copy=True)
    for blocks, each in ((bpy.data.objects, block), (bpy.data.meshes, block.data)):
        blocks.remove(each)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, target):
        target.objects = ["Linked"]
    scene.collection.objects.link(target.objects[0])
    check()
    before = file_state()
    check()
    assert file_state() == before and bpy.data.objects["Linked"].library
