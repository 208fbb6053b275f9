import json
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

bpy = pytest.importorskip("bpy")

from viewcam_addon import cameras as formats
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender import findings
from viewcam_addon.blender.interface import clipboard


def paste(text, **options):
    return bpy.ops.viewcam.paste_camera(text=text, **options)


def values(camera_object):
    eye, look_at, up, distance = camera_object.virtual_pinhole.numbers()
    return (*eye, *look_at, *up, distance)


def everything(camera_object):
    """All that copying and pasting could change, bit for bit."""
    group, data = camera_object.virtual_pinhole, camera_object.data
    lens = (data.lens, data.shift_x, data.shift_y, data.sensor_width, data.sensor_height)
    pose = (*camera_object.location, *camera_object.rotation_euler, *camera_object.scale)
    return (group.enabled, *values(camera_object), *pose, *lens)


def test_a_pasted_camera_stands_where_the_text_says(posed_camera, scene):
    assert paste("eye=(1, 2, 3) look_at=(4, 5, 6) up=(0, 1, 0) d=900") == {"FINISHED"}
    assert values(posed_camera) == (1, 2, 3, 4, 5, 6, 0, 1, 0, 900)
    assert cameras.check(posed_camera, cameras.stated(posed_camera, scene), scene) == []


def test_what_the_text_does_not_say_stays(posed_camera):
    paste("look_at=(0, 0, 2)")
    assert values(posed_camera) == (7, -6, 5, 0, 0, 2, 0, 0, 1, 1500)


def test_copy_and_paste_bring_every_bit_to_another_camera(posed_camera, add_camera, scene):
    paste("eye=0.1,0.2,0.3333333333333333 look_at=1e-3,-7,1e5 up=0.1,0.1,1 d=1234.5678901234567")
    text = clipboard.text_of(posed_camera, scene)
    other = add_camera("Other")
    paste(text, camera="Other")
    assert (
        values(other) == values(posed_camera) == (0.1, 0.2, 0.3333333333333333, 1e-3, -7, 1e5, 0.1, 0.1, 1, 1234.5678901234567)
    )
    assert clipboard.text_of(other, scene) == text


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.floats(-1e4, 1e4), min_size=9, max_size=9),
    st.floats(1, 1e5),
    st.sampled_from([100, 50, 33]),
    st.sampled_from([(1, 1), (2, 1), (1, 1.5)]),
)
def test_what_is_pasted_is_what_is_copied_at_any_percentage_and_pixel_aspect(
    posed_camera, scene, pose, distance, percent, aspect
):
    scene.render.resolution_percentage = percent
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    text = json.dumps({"eye": pose[0:3], "look_at": pose[3:6], "up": pose[6:9], "distance": distance})
    try:
        paste(text)
    except RuntimeError as error:  # eye = look-at, up = 0
        assert "same point" in str(error) or "up is" in str(error).lower() or "Up is" in str(error)
        return
    copied = json.loads(clipboard.text_of(posed_camera, scene))
    assert [*copied["eye"], *copied["look_at"], *copied["up"]] == pose
    # To the picture's size and back: two products of one rounding each, and those of their factors.
    assert np.ravel(copied["distance"])[0] == pytest.approx(distance, rel=0 if percent == 100 else 4 * 2.0**-53, abs=0)


def test_pasting_enables_a_camera_and_takes_the_rest_from_how_it_stands(camera_object, scene):
    camera_object.location, camera_object.rotation_euler = (0, -5, 1), (math.pi / 2, 0, 0)
    bpy.context.view_layer.update()
    before = cameras.read(camera_object, scene)
    paste("eye=(0, -9, 1)")
    group = camera_object.virtual_pinhole
    assert group.enabled and tuple(group.eye) == (0, -9, 1)
    # The new camera's plane of focus, 10 m before it, is what it keeps looking at.
    assert group.look_at[:] == pytest.approx((0, 5, 1), abs=1e-5)
    after = cameras.read(camera_object, scene)
    assert after.distance == before.distance
    assert np.subtract(after.basis(), before.basis()) == pytest.approx(0, abs=findings.LARGEST_TURN)


def test_copying_a_camera_that_is_not_in_use_changes_nothing(camera_object, scene):
    camera_object.location = (1, 2, 3)
    bpy.context.view_layer.update()
    before = everything(camera_object)
    copied = json.loads(clipboard.text_of(camera_object, scene))
    assert copied["eye"] == [1, 2, 3] and copied["look_at"] == [1, 2, -7]
    assert everything(camera_object) == before


def test_copying_says_what_it_copied(posed_camera, capfd):
    assert bpy.ops.viewcam.copy_camera() == {"FINISHED"}
    output = capfd.readouterr().out.split("Copied ", 1)[1].splitlines()[0]
    values = {"eye": [7, -6, 5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 1500}
    assert json.loads(output) == values | {"width": 1920, "height": 1080}


def test_a_held_roll_is_copied_as_the_up_of_the_same_picture(posed_camera, add_camera, scene):
    group = posed_camera.virtual_pinhole
    group.pole, group.held_roll = "HOLD", 0.3
    before = cameras.stated(posed_camera, scene)
    other = add_camera("Other")
    paste(clipboard.text_of(posed_camera, scene), camera="Other")
    after = cameras.stated(other, scene)
    assert np.subtract(after.basis(), before.basis()) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ('Scale -1 1 1 LookAt 7 -6 5 0 0 1 0 0 1 Camera "perspective" "float fov" 40', 1),
        ("look_at(origin=[7, -6, 5], target=[0, 0, 1], up=[0, 0, 1]), 'fov': 40, 'fov_axis': 'x'", 0),
        ("fov=40 axis=diagonal", 2),
    ],
)
@pytest.mark.parametrize("aspect", [(1, 1), (2, 1)])
def test_a_pasted_field_of_view_is_that_of_blenders_camera(posed_camera, scene, text, side, aspect):
    scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
    scene.render.resolution_percentage = 50
    paste(text)
    # The lens is stored in float32, its sensor and the pixel aspect as well.
    assert math.degrees(cameras.read(posed_camera, scene).field_of_view()[side]) == pytest.approx(40, rel=4 * 2.0**-24)


def test_what_a_reader_should_know_is_a_warning(posed_camera, capfd):
    posed_camera.driver_add("location", 0).driver.expression = "1.0 + 1.0"
    paste("LookAt 1 2 3 4 5 6 0 0 1")
    printed = capfd.readouterr().out
    assert "pbrt sees with left-handed axes" in printed and "driver" in printed
    assert "Pasted eye, look-at, mirror on Camera" in printed


SHIFTED = '{"eye": [7, -6, 5], "look_at": [0, 0, 1], "up": [0, 0, 1], "distance": 600, "width": 640, "height": 360, '
SHIFTED += '"principal_point": [300, 200], "mirrored": true}'


def test_a_pasted_camera_replaces_shift_and_mirror_of_the_old_one(posed_camera, scene):
    paste(SHIFTED)
    pinhole = cameras.read(posed_camera, scene)
    # The scene's picture is three times as large; lens and shift are float32.
    assert pinhole.mirrored and pinhole.principal_point == pytest.approx((900, 600), abs=1e-3)
    assert pinhole.distance == pytest.approx((1800, 1800), rel=2.0**-22)
    paste("eye=7,-6,5 look_at=0,0,1 up=0,0,1 d=900")
    pinhole = cameras.read(posed_camera, scene)
    assert not pinhole.mirrored and pinhole.principal_point == (960, 540)


def test_a_paste_can_leave_the_mirror_and_set_the_scenes_size(posed_camera, scene, capfd):
    paste(SHIFTED.replace('"height": 360', '"height": 480'))
    assert "The camera is for 640 × 480 pixels and the scene renders 1920 × 1080" in capfd.readouterr().out
    paste(SHIFTED.replace('"distance": 600', '"distance": [600, 450]'), set_size=True, unmirrored=True)
    pinhole = cameras.read(posed_camera, scene)
    assert (pinhole.width, pinhole.height, pinhole.mirrored) == (640, 360, False)
    assert pinhole.distance == pytest.approx((600, 450), rel=2.0**-22)
    assert pinhole.principal_point == pytest.approx((340, 200), abs=1e-3)


def test_a_text_with_several_cameras_asks_which(posed_camera):
    sensor = '<sensor type="perspective" id="{}"><transform name="to_world"><lookat origin="{},0,0" target="0,0,1" up="0,0,1"/>'
    text = "".join(sensor.format(*each) + "</transform></sensor>" for each in (("left", 1), ("right", 2)))
    with pytest.raises(RuntimeError, match="name one of 'left', 'right'"):
        paste(f"<scene>{text}</scene>")
    paste(f"<scene>{text}</scene>", named="right")
    assert tuple(posed_camera.virtual_pinhole.eye) == (2, 0, 0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "There is no text"),
        ("hello", "no camera that is understood, from its beginning 'hello' on"),
        ("eye=0,0,1", "same point"),
        ("up=0,0,0", "(?i)up is"),
        ("eye=1e200,0,0", "beyond Blender's numbers"),
        ("d=1e-300", "too small for Blender's numbers"),
    ],
)
def test_what_can_not_be_pasted_is_one_sentence_and_changes_nothing(posed_camera, text, sentence):
    before = everything(posed_camera)
    with pytest.raises(RuntimeError, match=sentence) as error:
        paste(text)
    assert everything(posed_camera) == before
    assert "Traceback" not in str(error.value)


def test_pasting_on_values_that_make_no_camera_heals_them(posed_camera):
    posed_camera.virtual_pinhole.look_at = posed_camera.virtual_pinhole.eye
    paste("look_at=0,0,1")
    assert tuple(posed_camera.virtual_pinhole.look_at) == (0, 0, 1)


def test_an_orthographic_camera_is_refused_by_name(camera_object):
    camera_object.data.type = "ORTHO"
    before = everything(camera_object)
    for call in (lambda: paste("eye=1,2,3"), bpy.ops.viewcam.copy_camera):
        with pytest.raises(RuntimeError, match="'Camera' is orthographic"):
            call()
    assert everything(camera_object) == before


THREE_JS = "const camera = new THREE.PerspectiveCamera(40, 16/9); camera.position.set(7, 3, 6); camera.lookAt(0, 1, 0);"


def test_after_a_text_in_which_y_is_up_the_answer_beside_paste_is_named_and_turns_it_upright(posed_camera, capfd):
    assert bpy.ops.viewcam.paste_camera(text=THREE_JS) == {"FINISHED"}
    assert tuple(posed_camera.virtual_pinhole.up) == (0, 1, 0)
    assert "Paste Upright" in capfd.readouterr().out
    posed_camera.virtual_pinhole.up = (0, 0, 1)
    assert bpy.ops.viewcam.paste_camera(text=THREE_JS, axes="y_up") == {"FINISHED"}
    group = posed_camera.virtual_pinhole
    assert (tuple(group.eye), tuple(group.look_at), tuple(group.up)) == ((7, -6, 3), (0, 0, 1), (0, 0, 1))
    assert "Paste Upright" not in capfd.readouterr().out


def test_a_camera_of_ours_whose_up_is_y_is_pasted_without_a_word_about_it(posed_camera, capfd):
    assert bpy.ops.viewcam.paste_camera(text="eye=(0, 0, 9) look_at=(0, 0, 0) up=(0, 1, 0) d=900") == {"FINISHED"}
    assert "Paste Upright" not in capfd.readouterr().out


def test_undo_takes_a_pasted_camera_back(camera_object):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    before = everything(camera_object)
    paste("eye=1,2,3 look_at=4,5,6 d=900")
    bpy.ops.ed.undo_push(message="after")
    assert everything(bpy.data.objects["Camera"]) != before
    bpy.ops.ed.undo()
    assert everything(bpy.data.objects["Camera"]) == before


def test_without_a_camera_both_are_off(fresh_blender):
    assert not bpy.ops.viewcam.copy_camera.poll()
    assert not bpy.ops.viewcam.paste_camera.poll()


# ROS says no pose, and USD is read where OpenUSD is.
BOTH_WAYS = sorted({name for name, *_ in clipboard._writable()} & {*formats.readable()} - {"ros", "usd"})


@pytest.mark.parametrize("format", BOTH_WAYS)
def test_what_is_copied_as_any_format_is_the_same_camera_when_it_is_pasted(posed_camera, add_camera, scene, format):
    before = cameras.read(posed_camera, scene)
    text = clipboard.text_of(posed_camera, scene, format, formats.Options(axes="y_up", scale=0.5))
    other = add_camera("Other")
    paste(text, camera="Other", axes="y_up", scale=0.5)
    after = cameras.read(other, scene)
    # Both are float32 in Blender.
    assert np.subtract(after.basis(), before.basis()) == pytest.approx(0, abs=findings.LARGEST_TURN)
    assert np.subtract(after.eye, before.eye) == pytest.approx(0, abs=2.0**-20)
    assert np.divide(after.distance, before.distance) == pytest.approx(1, rel=2.0**-20)


def test_copying_in_a_format_names_it_and_leaves_the_scene_alone(posed_camera, capfd):
    before = everything(posed_camera)
    assert bpy.ops.viewcam.copy_camera(format="pbrt", axes="y_up") == {"FINISHED"}
    assert "Copied Camera as pbrt scene, axes y_up, scale 1" in capfd.readouterr().out
    assert everything(posed_camera) == before


def test_what_a_format_can_not_say_is_one_sentence(posed_camera):
    posed_camera.scale[0] = -1
    with pytest.raises(RuntimeError, match="mirrored") as error:
        bpy.ops.viewcam.copy_camera(format="transforms")
    assert "Traceback" not in str(error.value)


def test_pixels_of_another_aspect_are_told_and_set_if_that_is_asked_for(posed_camera, scene, capfd):
    text = SHIFTED.replace('"distance": 600', '"distance": [600, 450]').replace("640", "1920").replace("360", "1080")
    paste(text)
    message = "The camera is for 1920 × 1080 pixels of aspect 0.75 and the scene renders 1920 × 1080 of aspect 1"
    assert message in capfd.readouterr().out
    assert cameras.read(posed_camera, scene).distance == pytest.approx((600, 600), rel=2.0**-22)
    paste(text, set_size=True)
    assert message not in capfd.readouterr().out
    assert scene.render.pixel_aspect_y / scene.render.pixel_aspect_x == pytest.approx(4 / 3, rel=2.0**-23)
    assert cameras.read(posed_camera, scene).distance == pytest.approx((600, 450), rel=2.0**-22)


def test_a_size_beyond_blenders_is_refused_and_the_scenes_stays(posed_camera, scene):
    with pytest.raises(RuntimeError, match="camera's picture is 3 × 360 pixels and Blender's are 4 to 65536"):
        paste(SHIFTED.replace('"width": 640', '"width": 3'), set_size=True)
    assert (scene.render.resolution_x, scene.render.resolution_y) == (1920, 1080)


def test_no_shift_is_told_of_where_a_principal_point_is_rounded(posed_camera, capfd):
    paste(
        'Film "rgb" "integer xresolution" [800] "integer yresolution" [600] LookAt 4 -6 3.5 0 0 1 0 0 1 '
        'Scale -1 1 1 Camera "perspective" "float fov" [40]'
    )
    assert "shift on Camera" not in capfd.readouterr().out
