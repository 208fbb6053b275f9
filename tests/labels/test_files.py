"""Labels as files, read by those who read such files: OpenCV, pycocotools, the project's own EXR reader."""

import json
from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon import image
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError
from viewcam_addon.labels import KINDS, PASSES, files
from viewcam_addon.tracer.scene import scene_file

from .conftest import CAMERA, moved, room

ENDINGS = [
    "labels.exr",
    "depth.png",
    "instances.png",
    "forward.flo",
    "forward_hidden.png",
    "backward.flo",
    "backward_hidden.png",
    "labels.json",
]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The labels of a frame with both neighbours, and the folder that they were written to, as shot.*"""
    folder = tmp_path_factory.mktemp("labels")
    frames = [room(ball=moved(0.1 * i, 0, 0.7), camera=replace(CAMERA, eye=(1 + 0.2 * i, -7, 3))) for i in range(3)]
    labels = vp.label(frames[1], KINDS, frames[0], frames[2])
    assert [path.name for path in files.write(folder / "shot.exr", labels)] == [f"shot.{ending}" for ending in ENDINGS]
    return labels, folder


def test_the_exr_has_every_pass_to_the_last_bit(written):
    labels, folder = written
    found = image.read(folder / "shot.labels.exr")
    assert set(found.passes) == set(labels.image.passes) and found.camera == labels.image.camera
    for name, values in labels.image.passes.items():
        np.testing.assert_array_equal(found[name], values)


def test_the_passes_of_each_label_are_those_that_are_told_beforehand(written):
    labels, _ = written
    told = [name for names in PASSES.values() for name in names]
    assert list(labels.image.passes)[: len(told)] == told
    assert all(name.startswith("Crypto") for name in list(labels.image.passes)[len(told) :])


def test_no_json_of_an_older_frame_stands_beside_files_of_a_newer(written, tmp_path, monkeypatch):
    labels, _ = written
    files.write(tmp_path / "shot.exr", labels)

    def fail(*_):
        raise InputError("the disk is full")

    monkeypatch.setattr(image, "write", fail)
    with pytest.raises(InputError, match="the disk is full"):
        files.write(tmp_path / "shot.exr", labels)
    assert not (tmp_path / "shot.labels.json").exists() and (tmp_path / "shot.labels.exr").exists()


def test_opencv_reads_the_flow_and_what_is_unknown_is_that_there(written):
    cv2 = pytest.importorskip("cv2")
    labels, folder = written
    for name in ("forward", "backward"):
        flow = cv2.readOpticalFlow(str(folder / f"shot.{name}.flo"))
        expected = labels.image[f"{name.title()} Flow"][::-1]
        known = np.isfinite(expected).all(-1)
        assert known.sum() > 0 and flow.shape == expected.shape
        np.testing.assert_array_equal(flow[known], expected[known])
        assert (flow[~known] > 1e9).all()
        hidden = cv2.imread(str(folder / f"shot.{name}_hidden.png"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(hidden, 255 * labels.image[f"{name.title()} Hidden"][::-1, :, 0])
        assert hidden.any()


def test_opencv_reads_sixteen_bits_of_depth_and_ids_as_coco_has_them(written):
    cv2 = pytest.importorskip("cv2")
    labels, folder = written
    levels = cv2.imread(str(folder / "shot.depth.png"), cv2.IMREAD_UNCHANGED)
    depth = labels.image["Depth"][::-1, :, 0].astype(float)
    assert levels.dtype == np.uint16
    hit = depth < 65.535
    assert np.abs(levels[hit] / files.DEPTH_STEPS - depth[hit]).max() <= 0.5 / files.DEPTH_STEPS + 1e-9
    blue_green_red = cv2.imread(str(folder / "shot.instances.png"), cv2.IMREAD_UNCHANGED).astype(int)
    ids = blue_green_red @ [256**2, 256, 1]
    np.testing.assert_array_equal(ids, labels.image["Instance"][::-1, :, 0])


def test_depth_that_sixteen_bits_can_not_hold_is_none_and_never_another_depth():
    depths = np.array([[0.5, 65.535, 65.536, 70, 131.1, 1e10, 0.0004]], np.float32)
    assert files.depth_levels(depths, 1000).tolist() == [[500, 65535, 0, 0, 0, 0, 0]]
    assert files.depth_levels(depths, 256).tolist() == [[128, 16777, 16777, 17920, 33562, 0, 0]]


def test_pycocotools_finds_the_same_masks_areas_and_boxes(written):
    coco = pytest.importorskip("pycocotools.mask")
    labels, folder = written
    told = json.loads((folder / "shot.labels.json").read_text())
    ids = labels.image["Instance"][::-1, :, 0]
    assert told["instances"] == labels.instances and len(told["instances"]) == 4
    for each in told["instances"]:
        for kind in ("visible", "amodal"):
            packed = coco.frPyObjects(each[kind]["segmentation"], *each[kind]["segmentation"]["size"])
            assert coco.area(packed) == each[kind]["area"]
            assert coco.toBbox(packed).tolist() == each[kind]["bbox"]
            if kind == "visible":
                np.testing.assert_array_equal(coco.decode(packed), ids == each["id"])


def test_the_command_writes_what_the_function_finds(written, tmp_path, capfd):
    _, folder = written
    for i in range(3):
        frame = room(ball=moved(0.1 * i, 0, 0.7), camera=replace(CAMERA, eye=(1 + 0.2 * i, -7, 3)))
        scene_file.write(frame, tmp_path / f"{i}.json")
    words = ["render", "1.json", "shot.exr", "--labels", ",".join(KINDS)]
    words += ["--previous", "0.json", "--next", "2.json", "--json", "result.json"]
    given = [str(tmp_path / word) if word.endswith((".json", ".exr")) else word for word in words]
    assert main(given) == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["labels"] == [str(tmp_path / f"shot.{ending}") for ending in ENDINGS]
    for ending in ENDINGS:
        assert (tmp_path / f"shot.{ending}").read_bytes() == (folder / f"shot.{ending}").read_bytes(), ending


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--labels", "colour"], "there is no label 'colour'"),
        (["--labels", "flow"], "flow goes to another frame"),
        (["--labels", "depth", "--next", "SCENE"], "--next is for flow"),
        (["--depth-steps", "0"], "'0' is no number above 0"),
    ],
)
def test_what_is_wrong_is_one_sentence_before_anything_is_written(tmp_path, capfd, words, sentence):
    scene_file.write(room(), tmp_path / "scene.json")
    given = [str(tmp_path / "scene.json") if word == "SCENE" else word for word in words]
    before = sorted(tmp_path.iterdir())
    assert main(["render", str(tmp_path / "scene.json"), str(tmp_path / "out.exr"), *given]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and sorted(tmp_path.iterdir()) == before
