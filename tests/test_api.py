"""`import viewcam_addon as vp`: what a program gets is what the command line gets. The page's own examples are run as well."""

from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp


@pytest.fixture
def scene():
    from viewcam_addon.tracer.scene import Object, Scene, Spheres

    camera = vp.Pinhole((3, -5, 2), (0, 0, 1), (0, 0, 1), 60, 48, 32)
    ball = Spheres(np.array([[0.0, 0.0, 1.0]]), np.array([1.0]), np.zeros(1, np.int32))
    placed = Object("Ball", "ball", np.eye(4), object_index=1, material_indices=(1,))
    return Scene(camera, {"ball": ball}, (placed,))


def test_a_picture_and_itself_are_the_same_and_a_longer_lens_is_found(scene):
    picture = vp.render(scene, level="geometry")
    same = vp.compare(picture, vp.render(scene, level="geometry"), scene)
    assert same.passed and same.sentence.startswith("The same picture"), same.sentence
    longer = replace(scene.camera, distance=60.06)
    found = vp.compare(picture, vp.render(replace(scene, camera=longer), level="geometry"), scene)
    assert not found.passed and "magnified by 0.999001" in found.sentence, found.sentence


def test_a_file_is_the_same_as_what_was_read_of_it(scene, tmp_path):
    from viewcam_addon import image
    from viewcam_addon.tracer.scene import scene_file

    scene_file.write(scene, tmp_path / "scene.json")
    picture = vp.render(tmp_path / "scene.json", level="geometry")
    np.testing.assert_array_equal(picture["Depth"], vp.render(scene, level="geometry")["Depth"])
    image.write(tmp_path / "a.exr", picture)
    assert vp.compare(tmp_path / "a.exr", str(tmp_path / "a.exr"), tmp_path / "scene.json").passed


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda scene, folder: vp.render(scene, level="all"), "the level is 'all'"),
        (lambda scene, folder: vp.render(folder / "none.json"), "none.json"),
        (
            lambda scene, folder: vp.compare(vp.Image({"Depth": np.zeros((2, 2, 1), np.float32)}), []),
            "does not tell its camera",
        ),
        (lambda scene, folder: vp.check(folder / "none.blend"), "none.blend"),
    ],
)
def test_what_is_wrong_is_one_sentence(scene, tmp_path, call, sentence):
    with pytest.raises(vp.InputError, match=sentence) as raised:
        call(scene, tmp_path)
    assert "\n" not in str(raised.value)
