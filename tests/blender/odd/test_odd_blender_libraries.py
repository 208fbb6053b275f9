"""Enabled cameras from another .blend: linked, overridden, half of each. docs/odd-blender.md says what each test expects."""

import pytest

bpy = pytest.importorskip("bpy")


@pytest.fixture
def library(posed_camera, tmp_path):
    """A function that opens an empty file and links one camera object, or its data, from a saved one with an enabled camera."""
    path = str(tmp_path / "library.blend")

    def link(kind):
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        with bpy.data.libraries.load(path, link=True) as (_, names):
            setattr(names, kind, ["Camera"])
        return getattr(bpy.data, kind)["Camera"]

    return link


def show(block):
    scene = bpy.context.scene
    scene.collection.objects.link(block)
    scene.camera = block
    bpy.context.view_layer.update()
    return block


def state(camera_object, height):
    """Edit two of the four values as the panel does."""
    group = camera_object.virtual_pinhole
    group.eye, group.distance = (7, -6, height), 1300


def test_a_linked_camera_sticks_until_the_file_is_opened_again(library, odd):
    camera_object = show(library("objects"))
    state(camera_object, 6)
    odd.check(camera_object, reopened=False)
    camera_object, _ = odd.reopen(camera_object, bpy.context.scene)
    assert tuple(camera_object.virtual_pinhole.eye) == (7, -6, 5)
    assert camera_object.virtual_pinhole.distance == 1500


def test_a_local_camera_with_linked_data_loses_its_lens_when_the_file_is_opened_again(library, odd):
    data = library("cameras")
    camera_object = show(bpy.data.objects.new("Local", data))
    group = camera_object.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (7, -6, 6), (0, 0, 1), (0, 0, 1), 1300
    group.enabled = True
    odd.apply(camera_object, bpy.context.scene)
    camera_object, scene = odd.reopen(camera_object, bpy.context.scene)
    odd.later(camera_object, scene, "saved and opened again")
    odd.render(camera_object, scene)


def test_an_override_of_the_object_alone_loses_its_lens_when_the_file_is_opened_again(library, odd):
    camera_object = show(library("objects")).override_create(remap_local_usages=True)
    state(camera_object, 6)
    odd.apply(camera_object, bpy.context.scene)
    camera_object, scene = odd.reopen(camera_object, bpy.context.scene)
    odd.later(camera_object, scene, "saved and opened again")
    odd.render(camera_object, scene)


@pytest.mark.parametrize("system", [False, True])
def test_an_override_of_object_and_data_sticks(library, odd, system):
    """Whether the override may be edited in the window (system: it may not)."""
    camera_object = show(library("objects")).override_create(remap_local_usages=True)
    camera_object.data.override_create(remap_local_usages=True)
    camera_object.override_library.is_system_override = camera_object.data.override_library.is_system_override = system
    state(camera_object, 6)
    odd.check(camera_object)
    camera_object = bpy.context.scene.camera
    assert camera_object.override_library and tuple(camera_object.virtual_pinhole.eye) == (7, -6, 6)
