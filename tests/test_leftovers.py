"""Enabling and disabling the add-on ten times leaves nothing behind, and what is left behind is found (leftovers.py).

Each in a process of its own, where nothing else has been registered. tests/real_blender does the same with the extension's zip.
"""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer.scene import Spheres

pytestmark = pytest.mark.slow


ROOT = Path(__file__).resolve().parent.parent

# Code that leaves something behind → the line that tells so.
FORGOTTEN = {
    "bpy.app.handlers.load_post.append(lambda *_: None)": "<lambda> in handlers load_post",
    "bpy.types.TOPBAR_MT_file.append(lambda *_: None)": "<lambda> in entries of TOPBAR_MT_file",
    "bpy.types.Scene.forgotten = bpy.props.IntProperty()": "more: forgotten in properties of Scene",
    "bpy.utils.register_class(type('FORGOTTEN_OT_it', (bpy.types.Operator,), {'bl_idname': 'forgotten.it', 'bl_label': ''}))": (
        "more: FORGOTTEN_OT_it in types"
    ),
    "bpy.types.RENDER_PT_format.COMPAT_ENGINES.add('FORGOTTEN')": "more: 'FORGOTTEN' in RENDER_PT_format.COMPAT_ENGINES",
    "bpy.utils.register_preset_path('/forgotten')": "more: '/forgotten' in bpy.utils._preset_path_registry",
    "bpy.data.texts.new('Forgotten')": "more: Forgotten in bpy.data.texts",
    "__import__('sys').path.append('/forgotten')": "more: /forgotten in sys.path",
    "__import__('threading').Thread(target=__import__('time').sleep, args=(60,), daemon=True, name='Forgotten').start()": (
        "more: Forgotten in threads"
    ),
}
# Code that leaves something behind which can't be asked for: it keeps its module alive.
HELD = [
    "bpy.app.timers.register(addon.register, first_interval=1e6)",
    "bpy.types.SpaceView3D.draw_handler_add(addon.register, (), 'WINDOW', 'POST_VIEW')",
    "bpy.msgbus.subscribe_rna(key=(bpy.types.Object, 'location'), owner=bpy, args=(), notify=addon.register)",
    "bpy.utils.register_cli_command('forgotten', addon.register)",
]


def leftovers(*arguments):
    return subprocess.run([sys.executable, "tests/leftovers.py", *arguments], cwd=ROOT, capture_output=True, text=True)


def test_ten_rounds_leave_nothing_behind():
    outcome = leftovers("wheel", "10")
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
    assert "0 left behind after 10 rounds" in outcome.stdout


def test_what_is_forgotten_is_found():
    outcome = leftovers("wheel", "1", "\n".join(FORGOTTEN))
    assert outcome.returncode == 1, outcome.stdout + outcome.stderr
    missed = [line for line in FORGOTTEN.values() if line not in outcome.stdout]
    assert not missed, f"not told: {missed}\n{outcome.stdout}{outcome.stderr}"


@pytest.mark.skipif(bpy.app.version < (4, 5), reason="Blender 4.2 keeps all classes of properties alive itself")
@pytest.mark.parametrize("held", [HELD[0], *(pytest.param(held, marks=pytest.mark.exhaustive) for held in HELD[1:])])
def test_what_blender_still_holds_is_found(held):
    outcome = leftovers("wheel", "1", held)
    assert outcome.returncode == 1, outcome.stdout + outcome.stderr
    assert "alive: viewcam_addon.register" in outcome.stdout, outcome.stdout + outcome.stderr


# --- The sample scenes are what their README says: small, stated, and each with the difficulty that it is there for


FOLDER = Path(__file__).parent.parent / "sample_scenes"
SCENES = {
    "studio": "320x180",
    "spheres": "240x180",
    "straight_down": "240x240",
    "portrait": "120x270",
    "wide": "320x105",
    "telephoto": "320x180",
    "flight": "240x135",
    "cornell": "180x180",
}
"""The size that each is compared at: a quarter of its width and height."""
LARGEST_FILE = 300_000  # bytes
FLOAT32 = 2.0**-24  # relative rounding of what Blender stores


@pytest.fixture
def opened(fresh_blender):
    def open_scene(name: str):
        bpy.ops.wm.open_mainfile(filepath=str(FOLDER / f"{name}.blend"))
        scene = bpy.context.scene
        return scene, scene.camera

    return open_scene


def test_every_sample_scene_is_tested():
    assert {path.stem for path in FOLDER.glob("*.blend")} == set(SCENES)


@pytest.mark.parametrize("name", SCENES)
def test_scene_is_small_and_names_no_folder_of_its_maker(name, opened):
    size = (FOLDER / f"{name}.blend").stat().st_size
    assert size <= LARGEST_FILE, f"{name}.blend has {size} bytes"
    scene, _ = opened(name)
    assert scene.render.filepath.startswith("//")
    assert not [image.name for image in bpy.data.images if image.filepath], "picture files"
    assert not bpy.data.libraries, "linked libraries"


@pytest.mark.parametrize("name", SCENES)
def test_scene_says_what_it_shows(name, opened):
    opened(name)
    assert bpy.data.texts["About this scene"].as_string().strip()


@pytest.mark.parametrize("name", SCENES)
def test_camera_is_where_its_four_values_say(name, opened):
    scene, camera = opened(name)
    assert camera.virtual_pinhole.enabled
    assert_same_camera(cameras.read(camera, scene), cameras.stated(camera, scene))


def assert_same_camera(pinhole, stated):
    """Equal but for float32 storage: the eye, an orientation of float32 Euler angles, a lens over a sensor, a shift."""
    offset = np.abs(np.subtract(pinhole.eye, stated.eye))
    assert np.all(offset <= FLOAT32 * np.abs(stated.eye)), f"the eye is {offset} off"
    # A matrix entry is within 2.7e-7 with the worst of rotation modes.
    turn = np.abs(np.subtract(pinhole.basis(), stated.basis())).max()
    assert turn <= 2.7e-7, f"an axis is {turn:.1e} off"
    # Lens, sensor and their quotient: three roundings.
    zoom = np.abs(np.divide(pinhole.distance, stated.distance) - 1).max()
    assert zoom <= 3 * FLOAT32, f"the distance is {zoom:.1e} of itself off"
    assert (pinhole.width, pinhole.height, pinhole.mirrored) == (stated.width, stated.height, stated.mirrored)
    shift = np.abs(np.subtract(pinhole.principal_point, stated.principal_point)).max()
    assert shift <= FLOAT32 * max(stated.width, stated.height), f"the principal point is {shift:.1e} pixels off"


def test_straight_down_looks_exactly_along_up(opened):
    scene, camera = opened("straight_down")
    stated = cameras.stated(camera, scene)
    assert stated.is_singular
    # The canonical axes for up = (0, 0, 1), looking down.
    np.testing.assert_array_equal(stated.basis(), [(0, -1, 0), (1, 0, 0), (0, 0, 1)])


def test_portrait_has_shift_and_pixels_that_are_not_square(opened):
    scene, camera = opened("portrait")
    stated = cameras.stated(camera, scene)
    assert stated.height > stated.width
    assert stated.distance[1] / stated.distance[0] == scene.render.pixel_aspect_x / scene.render.pixel_aspect_y == 1.5
    assert camera.data.shift_y != 0
    assert stated.basis()[1].tolist() == [0, 0, 1], "the picture's verticals are not the world's"


def test_wide_sees_170_degrees(opened):
    scene, camera = opened("wide")
    assert math.degrees(cameras.stated(camera, scene).field_of_view()[0]) == pytest.approx(170, abs=1e-9)


def test_telephoto_sees_half_a_degree(opened):
    scene, camera = opened("telephoto")
    assert math.degrees(cameras.stated(camera, scene).field_of_view()[0]) == pytest.approx(0.5, abs=1e-9)


def test_flight_moves_eye_and_look_at_and_the_camera_follows(opened):
    scene, camera = opened("flight")
    eyes = []
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        pinhole = cameras.read(camera, scene)
        assert_same_camera(pinhole, cameras.stated(camera, scene))
        eyes.append(pinhole.eye)
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    assert len(eyes) == 48
    assert steps.min() > 0.1, f"between two frames the eye moves by only {steps.min():.3f} m"
    assert np.linalg.norm(np.subtract(eyes[-1], eyes[0])) > 40


def test_spheres_are_exact_spheres_and_one_is_an_ellipsoid(fresh_blender):
    exported = jobs.export(Job(blend=FOLDER / "spheres.blend", strict=True))
    spheres = {name: shape for name, shape in exported.geometries.items() if isinstance(shape, Spheres)}
    assert sum(len(shape.radii) for shape in spheres.values()) >= 6000
    matrices = [matrix for obj in exported.objects if obj.geometry in spheres for matrix in obj.matrices]
    scales = [np.linalg.norm(matrix[:3, :3], axis=0) for matrix in matrices]
    assert any(np.ptp(scale) > 0.1 for scale in scales), "no sphere is scaled to an ellipsoid"


@pytest.mark.parametrize("name", SCENES)
def test_cycles_and_the_tracer_agree(name):
    """In a process of its own, as a user runs it, with a sixteenth of the pixels: each pixel's tolerance is its own."""
    command = [sys.executable, "-m", "viewcam_addon", "check", str(FOLDER / f"{name}.blend"), "--size", SCENES[name]]
    run = subprocess.run(command, cwd=FOLDER.parent, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
