"""Objects without a material in Cycles' render: one stand-in for all of them, so that their number is no square of time."""

import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.scenes import materials
from viewcam_addon.blender.temporary_settings import overridden


def bare_objects(count):
    """As many triangles without a material, each a mesh of its own."""
    objects = []
    for _ in range(count):
        mesh = bpy.data.meshes.new("Bare")
        mesh.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
        objects.append(bpy.data.objects.new("Bare", mesh))
        bpy.context.scene.collection.objects.link(objects[-1])
    return objects


def test_all_objects_without_a_material_share_one_stand_in_which_is_removed_once(fresh_blender):
    objects = bare_objects(30)
    with overridden() as overrides:
        for each in objects:
            materials.fill_empty_slots(overrides, each)
        (stand_in,) = bpy.data.materials
        assert all([slot.material for slot in each.material_slots] == [stand_in] for each in objects)
    assert not bpy.data.materials and not any(each.material_slots for each in objects)


def test_empty_slots_are_filled_and_empty_again_beside_those_that_are_not(fresh_blender):
    (bare,) = bare_objects(1)
    own = bpy.data.materials.new("Own")
    bare.data.materials.append(None)
    bare.data.materials.append(own)
    with overridden() as overrides:
        materials.fill_empty_slots(overrides, bare)
        assert None not in [slot.material for slot in bare.material_slots]
    assert [slot.material for slot in bare.material_slots] == [None, own] and list(bpy.data.materials) == [own]


def test_each_loan_has_a_stand_in_of_its_own(fresh_blender):
    first, second = bare_objects(2)
    for each in (first, second):
        with overridden() as overrides:
            materials.fill_empty_slots(overrides, each)
            assert len(bpy.data.materials) == 1
    assert not bpy.data.materials
