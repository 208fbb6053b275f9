"""The tracer's process: right pictures pass, those of a wrong camera don't, and nothing of one shows in the next verdict.

Cycles' side is traced here, with the camera that Blender is made to have.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon import child_process, image
from viewcam_addon.errors import InputError
from viewcam_addon.jobs.job import Job
from viewcam_addon.jobs.tracing import Tracing
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import render
from viewcam_addon.tracer.scene import Mesh, Object, Scene, Spheres, scene_file

pytestmark = pytest.mark.slow

CAMERA = Pinhole((3, -6, 2.5), (0.2, 0, 0.4), (0, 0, 1), 110.0, 96, 54, (46.0, 28.0))
OTHER = replace(CAMERA, eye=(-4.0, -5.0, 1.5), distance=140.0)
CLIP = (0.1, 100.0)

# Faults between the numbers of a sidecar and the camera that takes the picture.
WRONG = {
    "half a pixel to the right": replace(CAMERA, principal_point=(46.5, 28.0)),
    "half a pixel upwards": replace(CAMERA, principal_point=(46.0, 28.5)),
    "a thousandth more distance": replace(CAMERA, distance=110.11),
    "mirrored": replace(CAMERA, mirrored=True),
    "the middle for the principal point": replace(CAMERA, principal_point=None),
    "another eye": replace(CAMERA, eye=(3.001, -6, 2.5)),
    "a tilted up": replace(CAMERA, up=(0.001, 0, 1)),
    "the shot before": OTHER,
}
# And between the picture and its file.
FLIPS = {"left to right": np.s_[:, ::-1], "upside down": np.s_[::-1], "a pixel to the left": np.s_[:, [*range(1, 96), 0]]}


def made_scene(camera=CAMERA):
    """A ground of 30 × 30 squares, a box's worth of triangles and three spheres, numbered."""
    steps = np.linspace(-6, 6, 31)
    x, y = np.meshgrid(steps, steps)
    corner = (np.arange(30)[:, None] * 31 + np.arange(30)).ravel()
    squares = np.concatenate([corner[:, None] + (0, 1, 32), corner[:, None] + (0, 32, 31)]).astype(np.int32)
    ground = Mesh(np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3), squares, np.zeros(len(squares), np.int32))
    tent = Mesh(
        np.array([[-2.0, -1, 0], [-1, -1, 0], [-1, 0, 0], [-1.4, -0.6, 1.2]]),
        np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32),
        np.zeros(3, np.int32),
    )
    balls = Spheres(
        np.array([[0, 0, 0.5], [1.2, 0.6, 0.3], [0.4, -1.5, 0.4]]), np.array([0.5, 0.3, 0.4]), np.zeros(3, np.int32)
    )
    geometries = {"ground": ground, "tent": tent, "balls": balls}
    objects = tuple(Object(name, name, np.eye(4), number) for number, name in enumerate(geometries, start=1))
    return Scene(camera, geometries, objects, clip=CLIP)


@pytest.fixture(scope="module")
def scene_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("comparer") / "scene.json"
    scene_file.write(made_scene(), path)
    return path


@pytest.fixture
def picture(tmp_path):
    """picture(camera) → the path of what that camera sees."""

    def take(camera, change=np.s_[:]):
        path = tmp_path / "cycles.exr"
        passes = {name: values[change] for name, values in render(made_scene(camera)).items()}
        image.write(path, image.Image(passes))
        return path

    return take


class Comparer(Tracing):
    """The process, asked for pictures of geometry alone."""

    def verdict(self, scene, image, camera, clip, stated=None):
        comparison = self.compare(scene, [image], Job(level="geometry"), camera, clip, stated, may_be_empty=True)
        return {"passed": comparison["passed"], "verdict": comparison["sentence"], "figures": comparison["figures"]}


@pytest.fixture(scope="module")
def comparer():
    with Comparer() as comparer:
        yield comparer


def test_a_right_picture_passes_with_figures_that_a_sidecar_keeps(comparer, scene_path, picture):
    result = comparer.verdict(scene_path, picture(CAMERA), CAMERA, CLIP)
    assert result["passed"] and result["verdict"].startswith("The same picture: over ")
    figures = result["figures"]
    assert figures["pixels"] > 3000 and figures["conversion"] is None and figures["mismatches"]["unexplained"] == 0
    # The two differ by no more than one side's float32: 2⁻²⁴ · d · |P|/z at 8 units, ten times as much at most.
    assert figures["position"]["max"] < 10 * 2.0**-24 * 110 * 8 and max(figures["share_of_tolerance"].values()) <= 1
    assert len(json.dumps(result, allow_nan=False)) < 1500, "it stands in every sidecar"


@st.composite
def cameras(draw):
    """Cameras that see the ground from above it, some of them turned, shifted, mirrored or with pixels that are not square."""
    azimuth, height = draw(st.floats(0, 6.28)), draw(st.floats(1.5, 6))
    width, height_of_picture = draw(st.integers(24, 80)), draw(st.integers(24, 80))
    d = draw(st.floats(60, 200))
    return Pinhole(
        (6 * np.cos(azimuth), 6 * np.sin(azimuth), height),
        (draw(st.floats(-0.5, 0.5)), draw(st.floats(-0.5, 0.5)), 0.3),
        (draw(st.floats(-0.5, 0.5)), 0, 1),
        (d, d * draw(st.sampled_from([1.0, 0.75, 1.2]))),
        width,
        height_of_picture,
        (width / 2 + draw(st.floats(-9, 9)), height_of_picture / 2 + draw(st.floats(-9, 9))),
        mirrored=draw(st.booleans()),
    )


@settings(max_examples=15)
@given(cameras(), st.floats(0, 6.28))
def test_any_camera_passes_as_itself_and_fails_half_a_pixel_off_in_any_direction(
    comparer, scene_path, tmp_path_factory, camera, way
):
    path = tmp_path_factory.mktemp("any") / "cycles.exr"
    image.write(path, image.Image(render(made_scene(camera))))
    right = comparer.verdict(scene_path, path, camera, CLIP, stated=camera)
    assert right["passed"], right["verdict"]
    c_x, c_y = camera.principal_point
    off = replace(camera, principal_point=(c_x + 0.5 * np.cos(way), c_y + 0.5 * np.sin(way)))
    assert not comparer.verdict(scene_path, path, off, CLIP)["passed"]


@pytest.mark.parametrize("fault", WRONG)
def test_a_picture_of_a_wrong_camera_fails(comparer, scene_path, picture, fault):
    result = comparer.verdict(scene_path, picture(WRONG[fault]), CAMERA, CLIP)
    assert not result["passed"] and result["verdict"].startswith("Not the same picture: "), result


@pytest.mark.parametrize("flip", FLIPS)
def test_a_picture_that_is_flipped_or_moved_in_its_file_fails(comparer, scene_path, picture, flip):
    result = comparer.verdict(scene_path, picture(CAMERA, FLIPS[flip]), CAMERA, CLIP)
    assert not result["passed"], result


def test_a_wrong_conversion_fails_even_where_the_picture_is_right(comparer, scene_path, picture):
    taken = picture(CAMERA)
    right = comparer.verdict(scene_path, taken, CAMERA, CLIP, stated=CAMERA)
    assert right["passed"] and right["figures"]["conversion"]["largest"] < 1e-9
    wrong = comparer.verdict(scene_path, taken, CAMERA, CLIP, stated=replace(CAMERA, distance=110.11))
    assert not wrong["passed"] and "from the stated one" in wrong["verdict"]
    # 0.1 % of the distance moves the farthest corner, which is 96 − 46 and 28 pixels away, by as much.
    assert wrong["figures"]["conversion"]["largest"] == pytest.approx(0.001 * np.hypot(50, 28), rel=1e-2)


def test_what_lies_beyond_the_clip_range_is_not_there(comparer, scene_path, picture):
    taken = picture(CAMERA)
    assert not comparer.verdict(scene_path, taken, CAMERA, (0.1, 6.0))["passed"]
    assert comparer.verdict(scene_path, taken, CAMERA, CLIP)["passed"]


def test_the_verdicts_of_one_comparer_on_many_are_those_of_a_new_one_on_each(comparer, scene_path, picture):
    """To the last digit: what is kept changes nothing, so that a resumed batch writes the same sidecars."""
    for camera in (CAMERA, OTHER, replace(OTHER, width=64, height=64, principal_point=None), CAMERA):
        taken = picture(camera)
        with Comparer() as fresh:
            assert comparer.verdict(scene_path, taken, camera, CLIP) == fresh.verdict(scene_path, taken, camera, CLIP)


def test_another_scene_is_another_file(comparer, scene_path, picture, tmp_path):
    taken = picture(CAMERA)
    assert comparer.verdict(scene_path, taken, CAMERA, CLIP)["passed"]
    scene = made_scene()
    without = replace(scene, objects=scene.objects[:2])
    scene_file.write(without, tmp_path / "without-balls.json")
    assert not comparer.verdict(tmp_path / "without-balls.json", taken, CAMERA, CLIP)["passed"]
    assert comparer.verdict(scene_path, taken, CAMERA, CLIP)["passed"]


def test_a_picture_without_a_single_hit_is_no_proof(comparer, scene_path, picture):
    upwards = replace(CAMERA, look_at=(3, -6, 9))
    result = comparer.verdict(scene_path, picture(upwards), upwards, CLIP, stated=upwards)
    assert not result["passed"] and "Nothing to compare" in result["verdict"]
    assert json.dumps(result, allow_nan=False)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda tmp_path: {"image": tmp_path / "none.exr"}, "does not exist"),
        (lambda tmp_path: {"scene": tmp_path / "none.json"}, "does not exist"),
        (lambda tmp_path: {"camera": replace(CAMERA, width=97)}, "compare pictures of the same size"),
    ],
    ids=["no picture", "no scene", "another size"],
)
def test_what_can_not_be_checked_is_one_sentence_and_the_next_is_checked(
    comparer, scene_path, picture, tmp_path, change, sentence
):
    request = {"scene": scene_path, "image": picture(CAMERA), "camera": CAMERA, "clip": CLIP}
    with pytest.raises(InputError, match=sentence):
        comparer.verdict(**request | change(tmp_path))
    assert comparer.verdict(**request)["passed"]


def test_a_comparer_that_was_lost_is_started_again(scene_path, picture):
    taken = picture(CAMERA)
    with Comparer() as comparer:
        assert comparer.verdict(scene_path, taken, CAMERA, CLIP)["passed"]
        comparer._server._process.end()
        with pytest.raises(child_process.ProcessEnded, match="the tracer's process has ended"):
            comparer.verdict(scene_path, taken, CAMERA, CLIP)
        assert comparer.verdict(scene_path, taken, CAMERA, CLIP)["passed"]


def test_without_openexr_it_is_said_what_to_install(scene_path, picture, monkeypatch):
    taken = picture(CAMERA)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with Comparer() as comparer, pytest.raises(InputError, match="need OpenEXR: install"):
        comparer.verdict(scene_path, taken, CAMERA, CLIP)
