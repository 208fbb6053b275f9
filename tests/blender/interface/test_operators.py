import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.interface import readouts


def test_apply_leaves_a_camera_where_its_values_are(posed_camera):
    assert bpy.ops.viewcam.apply_camera() == {"FINISHED"}
    assert tuple(posed_camera.location) == (7, -6, 5)


def test_adopt_takes_the_values_of_a_moved_camera(posed_camera):
    posed_camera.location = (1, 1, 1)
    bpy.context.view_layer.update()
    assert bpy.ops.viewcam.adopt_camera() == {"FINISHED"}
    assert tuple(posed_camera.virtual_pinhole.eye) == (1, 1, 1)
    assert tuple(posed_camera.location) == (1, 1, 1)


def test_another_up_keeps_the_picture_and_makes_its_roll_certain(posed_camera, scene):
    group = posed_camera.virtual_pinhole
    group.eye, group.look_at, group.up = (0.5, 0.25, 5), (0.5, 0.25, 0), (0, 0, 1)
    before, precision = cameras.stated(posed_camera, scene), 2.0**-24
    assert "roll" in readouts.roll_warning(before, precision)
    assert bpy.ops.viewcam.choose_up() == {"FINISHED"}
    after = cameras.stated(posed_camera, scene)
    assert after.up == (1, 0, 0) and after.basis()[0] == pytest.approx(before.basis()[0], abs=1e-15)
    assert readouts.roll_warning(after, precision) is None


def test_adopt_enables_a_camera(camera_object):
    bpy.ops.viewcam.adopt_camera()
    assert camera_object.virtual_pinhole.enabled


def test_a_camera_can_be_named(posed_camera, add_camera):
    other = add_camera("Other")
    posed_camera.virtual_pinhole.enabled = False
    bpy.ops.viewcam.adopt_camera(camera="Camera")
    assert posed_camera.virtual_pinhole.enabled and not other.virtual_pinhole.enabled


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: bpy.ops.viewcam.apply_camera(camera="Nobody"), "There is no camera 'Nobody'"),
        (lambda: bpy.ops.viewcam.apply_camera(), "is not enabled"),
        (lambda: bpy.ops.viewcam.choose_up(), "is not enabled"),
        (lambda: bpy.ops.viewcam.adopt_camera(camera="Lamp"), "'Lamp' is no camera"),
    ],
)
def test_errors_are_reported_in_one_sentence(camera_object, scene, call, message):
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    scene.collection.objects.link(lamp)
    with pytest.raises(RuntimeError, match=message) as error:
        call()
    assert "Traceback" not in str(error.value)


def test_without_a_camera_the_buttons_are_off(fresh_blender):
    assert not bpy.ops.viewcam.apply_camera.poll()
    assert not bpy.ops.viewcam.adopt_camera.poll()


def test_they_work_in_edit_mode_of_another_object(posed_camera, scene):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.mode_set(mode="EDIT")
    posed_camera.virtual_pinhole.enabled = False
    bpy.ops.viewcam.adopt_camera(camera="Camera")
    assert posed_camera.virtual_pinhole.enabled


def test_applying_reports_what_did_not_stick(posed_camera, scene, capfd):
    posed_camera.virtual_pinhole.keyframe_insert("eye", frame=1)
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    bpy.ops.viewcam.apply_camera()
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene)[0].sentence in capfd.readouterr().out
