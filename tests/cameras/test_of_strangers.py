"""Files as strangers publish them, in ways of their own: read as their program sees them, or refused.

Each text is the least that shows what was read wrongly, or refused without need, of files that stand in public repositories.
"""

import json
import math
import time

import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options
from viewcam_addon.errors import InputError

VGA = Options(size=(640, 480))
THREE = "const camera = new THREE.PerspectiveCamera(50, 1.333, 0.1, 100); camera.position.set(3, 4, 5);"
ROS = """image_width: 640
image_height: 480
camera_name: front
camera_matrix:
  rows: 3
  cols: 3
  data: [500, 0, 320, 0, 500, 240, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficents:
  rows: 1
  cols: 5
  data: [-0.2, 0.1, 0, 0, 0]
"""


def read(text):
    (camera,) = cameras.read(text, options=VGA)
    return camera


@pytest.mark.parametrize("name", ["OrbitControls", "TrackballControls", "MapControls", "ArcballControls"])
@pytest.mark.parametrize("before", ["", "camera.lookAt(0, 5, 0);"])
def test_controls_turn_the_camera_to_their_target_whatever_it_looked_at_before(name, before):
    program = f"{before} const controls = new THREE.{name}(camera, canvas);"
    assert read(THREE + program).pinhole.look_at == (0, 0, 0)
    with pytest.raises(InputError, match="write the target in plain numbers"):
        read(THREE + program + "controls.target.set(1, height, 0);")
    aimed = read(THREE + program + "controls.target.set(1, 2, 0);")
    assert aimed.pinhole.look_at == (1, 2, 0) and any(name in note for note in aimed.notes)


def test_a_position_that_is_computed_and_then_changed_in_one_coordinate_is_refused():
    with pytest.raises(InputError, match="plain numbers"):
        read("const eye = new THREE.Mesh(ball, red); camera.position.z = 5;")


@pytest.mark.parametrize("later", ["r = f(r);", "r = clamp(r, 1, 9);", "if (near) { r = distance(a, b); }", "r = 5; " * 30])
def test_a_name_that_is_known_once_and_computed_elsewhere_is_not_known(later):
    code = "float r = 5; {} gluPerspective(60, 1.333, 1, 100); gluLookAt(r, 0, 0, 0, 0, 0, 0, 0, 1);"
    assert read(code.format("")).pinhole.eye == (5, 0, 0)
    with pytest.raises(InputError, match="plain numbers"):
        read(code.format(later))


def test_meshes_that_are_called_eyes_are_no_cameras():
    assert read(THREE + "leftEye.position.x = -3; rightEye.position.x = 3;").pinhole.eye == (3, 4, 5)


def test_a_size_that_is_computed_twice_is_no_contradiction():
    resized = "renderer.setSize(innerWidth, innerHeight); onresize = () => { renderer.setSize(innerWidth, innerHeight); };"
    assert read(THREE + resized + "camera.lookAt(0, 0, 0);").pinhole.look_at == (0, 0, 0)


TURNED = "gluPerspective(60, 1.333, 1, 100); gluLookAt(eye.x, eye.y, eye.z, 0, 0, 0, 0, 1, 0);"
REFUSED = {
    "controls that turn it by themselves": (THREE + "new FirstPersonControls(camera).lon = -150;", "turn the camera"),
    "positions of several": (
        "a = new THREE.PerspectiveCamera(50, 1, 1, 9); a.position.z = 2; b = new THREE.PerspectiveCamera(50, 1, 1, 9);"
        "b.position.x = 2;",
        "another camera than a",
    ),
    "a name that is stepped": (
        f"angle = 0; {THREE} angle += 0.005; camera.position.x = Math.sin(angle) * 50;",
        "computed",
    ),
    "one coordinate by its number": (
        "lookfrom = vec3(1, 2, 3); lookfrom[2] = 9; lookat = vec3(0); vup = vec3(0, 1, 0);",
        "one",
    ),
    "one coordinate by its name": (f"vec3 eye(1, 2, 3); eye.z = 10; {TURNED}", "one coordinate"),
    "a light's focal point": (
        "vtkLight light; cam = vtkCamera(); cam.SetPosition(1, 2, 3); lgt = vtkLight(); lgt.SetFocalPoint(1, 1, 1)",
        "target",
    ),
    "distortion by a word with a slip": (ROS, "distortioncoefficents"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_would_be_another_camera_is_refused(what):
    text, sentence = REFUSED[what]
    with pytest.raises(InputError, match=sentence):
        read(text)


def test_a_key_of_the_keyboard_is_no_camera():
    assert read(f'{THREE} camera.lookAt(0, 0, 0); keyboard.up("R");').pinhole.up == (0, 1, 0)


def test_vtks_window_says_the_size_unless_it_has_several_views():
    text = (
        "renWin->SetSize(512, 256); camera->SetPosition(1, 2, 3); camera->SetFocalPoint(0, 0, 0); camera->SetViewUp(0, 1, 0);"
    )
    (camera,) = cameras.read(text)
    assert (camera.pinhole.width, camera.pinhole.height) == (512, 256)
    with pytest.raises(InputError, match="pixels"):
        cameras.read(text + "left->SetViewport(0, 0, 0.5, 1);")


def pov(text):
    return read(text).pinhole


def test_pov_rays_names_stand_for_what_they_were_where_they_are_used():
    declared = "#declare A = 1; #declare B = A * 2; #declare A = 5; camera { location <0, 1, -B> look_at 0 }"
    assert pov(declared).eye == (0, 1, -2)
    kept = "#declare D = 3; #declare C = camera { location <0, 1, -D> look_at 0 } #declare D = 9; camera { C }"
    assert pov(kept).eye == (0, 1, -3)


def test_pov_rays_names_that_double_twenty_times_take_no_time():
    doubled = "".join(f"#declare A{n + 1} = A{n} + A{n};" for n in range(19))
    started = time.process_time()
    assert pov(f"#declare A0 = 1; {doubled} camera {{ location <0, 1, -A19> look_at 0 }}").eye == (0, 1, -(2**19))
    assert time.process_time() - started < 1  # each twice as often as the one before: half a minute


@pytest.mark.parametrize(("version", "aspect"), [("3.7", 1.33), ("3.8", 640 / 480)])
def test_without_right_pov_rays_picture_is_1_33_times_as_wide_and_since_3_8_as_wide_as_the_film(version, aspect):
    pinhole = pov(f"#version {version}; camera {{ location <0, 0, -9> look_at 0 angle 60 }}")
    d_x, d_y = pinhole.distance  # the pixels are not square where the size is of another shape than the view plane
    assert (pinhole.width / d_x) / (pinhole.height / d_y) == pytest.approx(aspect, rel=1e-12)


def test_pov_ray_keeps_right_where_it_looks_along_the_sky():
    straight_down = pov("camera { location <1, 9, 2> look_at <1, 0, 2> right x * 4 / 3 angle 60 }")
    u, v, w = straight_down.basis()
    # up is look × right: (0, −1, 0) × (1, 0, 0), and x points right in the picture, which is mirrored.
    assert v == pytest.approx((0, 0, 1), abs=1e-15) and w == pytest.approx((0, 1, 0), abs=1e-15)
    assert straight_down.mirrored and u == pytest.approx((-1, 0, 0), abs=1e-15)


def test_opengls_arrays_of_sixteen_numbers_are_matrices():
    view = "GLfloat viewMatrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -2, -3, -4, 1};"
    projection = "const GLfloat projectionMatrix[16] = {1.5, 0, 0, 0, 0, 2, 0, 0, 0, 0, -1.002, -1, 0, 0, -0.2002, 0};"
    assert read(view + projection).pinhole.eye == (2, 3, 4)


def test_mitsubas_parameters_matter_where_the_camera_needs_them():
    scene = """<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="{}"/>
        <transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/>
        <string name="decomposition" value="$how"/></film></sensor></scene>"""
    assert read(scene.format(90)).pinhole.distance[0] == pytest.approx(32, rel=4 * 2**-53)
    with pytest.raises(InputError, match=r"fov .* '\$wide'"):
        read(scene.format("$wide"))


def test_mitsubas_scalar_points_are_points():
    look = "mi.ScalarTransform4f().look_at(origin=mi.ScalarPoint3f(0, 0, 10), target=[0, 0, 0], up=[0, 1, 0])"
    film = "{'type': 'hdrfilm', 'width': 64, 'height': 48}"
    assert read(f"{{'type': 'perspective', 'fov': 45, 'to_world': {look}, 'film': {film}}}").pinhole.eye == (0, 0, 10)


def test_a_scene_of_three_js_editor_has_its_windows_camera_and_its_own():
    lens = {"type": "PerspectiveCamera", "fov": 90, "aspect": 4 / 3}
    matrices = ([*(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0), 0, 0, z, 1] for z in (3, 7))
    first, second = ({**lens, "name": f"{index}", "matrix": matrix} for index, matrix in enumerate(matrices))
    document = {"metadata": {}, "camera": {"object": first}, "scene": {"object": {"type": "Scene", "children": [second]}}}
    cameras_read = cameras.read(json.dumps(document), options=VGA)
    assert [camera.pinhole.eye[2] for camera in cameras_read] == [3, 7]
    assert all(math.isclose(camera.pinhole.distance[1], 240, rel_tol=4 * 2**-53) for camera in cameras_read)


def test_a_stray_sign_before_pbrts_first_statement_hides_nothing_of_it():
    text = '-Scale -1 1 1\nLookAt 7 -6 4  0 0 1  0 0 1\nCamera "perspective" "float fov" 40\n'
    assert cameras.recognized(text) == "pbrt" and not read(text).pinhole.mirrored
