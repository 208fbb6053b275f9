"""Labels as files, read by those who read such files: OpenCV, pycocotools, the project's own EXR reader."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import viewcam_addon as vp
from viewcam_addon import image
from viewcam_addon.cli import main
from viewcam_addon.errors import InputError
from viewcam_addon.labels import KINDS, PASSES, coco, files, masks
from viewcam_addon.labels.scene_labels import label
from viewcam_addon.png import encoded
from viewcam_addon.tracer.scene import scene_file

from .conftest import CAMERA, moved, room

ENDINGS = [
    "labels.exr",
    "depth.png",
    "instances.png",
    "mask.png",
    "forward.flo",
    "forward_hidden.png",
    "backward.flo",
    "backward_hidden.png",
    "labels.json",
]


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """The labels of a frame with both neighbors, and the folder that they were written to, as shot.*"""
    folder = tmp_path_factory.mktemp("labels")
    frames = [room(ball=moved(0.1 * i, 0, 0.7), camera=replace(CAMERA, eye=(1 + 0.2 * i, -7, 3))) for i in range(3)]
    labels = vp.label(frames[1], KINDS, frames[0], frames[2])
    assert [path.name for path in files.write(folder / "shot.exr", labels)] == [f"shot.{ending}" for ending in ENDINGS]
    return labels, folder


def test_the_exr_has_every_pass_to_the_last_bit(written):
    labels, folder = written
    read_image = image.read(folder / "shot.labels.exr")
    assert set(read_image.passes) == set(labels.image.passes) and read_image.camera == labels.image.camera
    for name, values in labels.image.passes.items():
        np.testing.assert_array_equal(read_image[name], values)


def test_the_passes_of_each_label_are_those_that_are_told_beforehand(written):
    labels, _ = written
    entries = [name for names in PASSES.values() for name in names]
    assert list(labels.image.passes)[: len(entries)] == entries
    assert all(name.startswith("Crypto") for name in list(labels.image.passes)[len(entries) :])


def test_no_json_of_an_older_frame_stands_beside_files_of_a_newer(written, tmp_path, monkeypatch):
    labels, _ = written
    files.write(tmp_path / "shot.exr", labels)

    def fail(*_, **__):
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
    with np.errstate(all="raise"):
        assert not files.depth_levels(depths, 1e308).any()


def test_pycocotools_finds_the_same_masks_areas_and_boxes(written):
    coco = pytest.importorskip("pycocotools.mask")
    labels, folder = written
    record = json.loads((folder / "shot.labels.json").read_text())
    ids = labels.image["Instance"][::-1, :, 0]
    assert record["instances"] == labels.instances and len(record["instances"]) == 4
    for each in record["instances"]:
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
    arguments = [str(tmp_path / word) if word.endswith((".json", ".exr")) else word for word in words]
    assert main(arguments) == 0
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["labels"] == [str(tmp_path / f"shot.{ending}") for ending in ENDINGS]
    for ending in ENDINGS:
        assert (tmp_path / f"shot.{ending}").read_bytes() == (folder / f"shot.{ending}").read_bytes(), ending


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--labels", "color"], "there is no label 'color'"),
        (["--labels", "flow"], "flow goes to another frame"),
        (["--labels", "depth", "--next", "SCENE"], "--next is for flow"),
        (["--depth-steps", "0"], "'0' is no number above 0"),
    ],
)
def test_what_is_wrong_is_one_sentence_before_anything_is_written(tmp_path, capfd, words, sentence):
    scene_file.write(room(), tmp_path / "scene.json")
    arguments = [str(tmp_path / "scene.json") if word == "SCENE" else word for word in words]
    before = sorted(tmp_path.iterdir())
    assert main(["render", str(tmp_path / "scene.json"), str(tmp_path / "out.exr"), *arguments]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and sorted(tmp_path.iterdir()) == before


# --- COCO's files of many pictures, as pycocotools and the panoptic format's own rule read them


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """The labels of three pictures by name, and their folder. In the last one the ball hides behind a cube."""
    folder = tmp_path_factory.mktemp("shots")
    result = {}
    for name, ball in (("a", moved(z=0.7)), ("b", moved(1, 0.4, 0.7)), ("c", moved(0.1, 2, 0.8, scale=0.3))):
        scene = room(ball=ball)
        cube = replace(scene.objects[2], name="Cube.001", matrix=np.array([moved(-2, 0, 0.4, 0.2, 0.4)]))
        result[name] = vp.label(replace(scene, objects=(*scene.objects, cube)), ("masks", "amodal"))
        files.write(folder / f"{name}.exr", result[name])
    return result, folder


def run(*words):
    return main(["labels", *map(str, words)])


@pytest.mark.parametrize("kind", ["visible", "amodal"])
def test_pycocotools_loads_it_and_finds_every_mask(pictures, tmp_path, kind):
    loader = pytest.importorskip("pycocotools.coco").COCO
    actual, folder = pictures
    assert run(folder, tmp_path / "all.json", *(["--amodal"] if kind == "amodal" else [])) == 0
    dataset = loader(tmp_path / "all.json")
    assert [each["name"] for each in dataset.loadCats(dataset.getCatIds())] == ["Ball", "Cube", "Floor"]
    images = {each["file_name"]: each for each in dataset.loadImgs(dataset.getImgIds())}
    assert list(images) == ["a.exr", "b.exr", "c.exr"]
    for name, labels in actual.items():
        image = images[f"{name}.exr"]
        assert (image["width"], image["height"]) == (64, 48)
        encoded = {each["id"]: each for each in labels.instances if each[kind] is not None}
        annotations = dataset.loadAnns(dataset.getAnnIds(image["id"]))
        assert {each["instance_id"] for each in annotations} == set(encoded)
        for each in annotations:
            mask, expected = dataset.annToMask(each), encoded[each["instance_id"]]
            assert mask.sum() == each["area"] == expected[kind]["area"] and each["bbox"] == expected[kind]["bbox"]
            assert dataset.loadCats(each["category_id"])[0]["name"] == coco.category(expected)
            if kind == "visible":
                np.testing.assert_array_equal(mask, labels.image["Instance"][::-1, :, 0] == each["instance_id"])
    coco_masks = pytest.importorskip("pycocotools.mask")
    runs = [each["segmentation"] for each in dataset.loadAnns(dataset.getAnnIds())]
    stated = [(each["area"], each["bbox"]) for each in dataset.loadAnns(dataset.getAnnIds())]
    assert [*zip(coco_masks.area(runs).tolist(), coco_masks.toBbox(runs).tolist(), strict=True)] == stated
    results = json.loads((tmp_path / "all.json").read_text())["annotations"]
    kept = ("image_id", "category_id", "segmentation")  # a result with a box would be one of boxes, not of masks
    again = dataset.loadRes([{name: each[name] for name in kept} | {"score": 1.0} for each in results])
    assert [(each["area"], [*each["bbox"]]) for each in again.loadAnns(again.getAnnIds())] == stated
    hidden = [each for each in actual["c"].instances if each["name"] == "Ball"]
    assert [each["visible"] for each in hidden] == [None], "the test wants an object that is hidden as a whole"
    ids = dataset.getAnnIds()
    assert sorted(ids) == list(range(1, len(ids) + 1))


def test_categories_and_keypoints_are_those_of_pycocotools_and_yolo(tmp_path):
    """A ball's center is in the ball, its far side is as well, and what is behind it is hidden."""
    joints = {"middle": [0.0, 0, 0], "behind": [0.0, 4, 0], "aside": [0.0, -60, 9]}
    bones = {"aside": "behind", "behind": "middle"}
    annotations = {"Ball": {"category": "person", "keypoints": joints, "bones": bones}, "Cube": {"category": "person"}}
    labels = label(room(), ("masks",), annotations=annotations)
    path = tmp_path / "shots" / "a.exr"
    path.parent.mkdir()
    files.write(path, labels)
    path.with_suffix(".png").write_bytes(encoded(np.zeros((48, 64, 3), np.uint8)))
    column, row, _ = CAMERA.project(np.array([[0.0, 0, 0.7], [0, 4, 0.7]]))  # the ball's matrix lifts it by 0.7
    loader = pytest.importorskip("pycocotools.coco").COCO
    assert run(path.parent, tmp_path / "all.json") == 0
    dataset = loader(tmp_path / "all.json")
    categories = {each["name"]: each for each in dataset.loadCats(dataset.getCatIds())}
    assert [*categories] == ["Floor", "person"] and categories["person"]["keypoints"] == [*joints]
    assert sorted(categories["person"]["skeleton"]) == [[1, 2], [2, 3]]
    people = dataset.loadAnns(dataset.getAnnIds(catIds=[categories["person"]["id"]]))
    (ball,) = (each for each in people if each["num_keypoints"])
    expected = [column[0] - 0.5, 48 - row[0] - 0.5, 2, column[1] - 0.5, 48 - row[1] - 0.5, 1, 0, 0, 0]
    np.testing.assert_allclose(ball["keypoints"], expected, atol=1e-9)
    assert len(people) == 3 and "keypoints" not in dataset.loadAnns(dataset.getAnnIds(catIds=[1]))[0]
    assert run(path.parent, tmp_path / "yolo", "--to", "yolo") == 0
    lines = (tmp_path / "yolo" / "labels" / "a.txt").read_text().splitlines()
    assert (tmp_path / "yolo" / "images" / "a.png").read_bytes() == path.with_suffix(".png").read_bytes()
    numbers = np.array([[*map(float, line.split())] for line in lines])
    assert sorted(numbers[:, 0]) == [0, 1, 1, 1] and numbers.shape[1] == 5 + 3 * 3
    of_ball = numbers[[line[7] == 2 for line in numbers]][0]
    x, y, width, height = ball["bbox"]
    np.testing.assert_allclose(of_ball[1:5] * [64, 48, 64, 48], [x + width / 2, y + height / 2, width, height], rtol=1e-8)
    np.testing.assert_allclose(of_ball[5:11:3] * 64, column, rtol=1e-8)
    assert "kpt_shape: [3, 3]" in (tmp_path / "yolo" / "data.yaml").read_text()


@given(st.lists(st.integers(1, 70_000), min_size=1, max_size=12), st.booleans())
def test_run_lengths_as_a_text_are_those_of_pycocotools(counts, begins_with_a_set_pixel):
    coco_masks = pytest.importorskip("pycocotools.mask")
    counts = [0] * begins_with_a_set_pixel + counts
    segmentation = {"size": [sum(counts), 1], "counts": counts}
    expected = coco_masks.frPyObjects(segmentation, sum(counts), 1)["counts"].decode("ascii")
    assert masks.compressed(segmentation) == {"size": [sum(counts), 1], "counts": expected}


def test_segments_are_those_of_the_colors_of_the_pictures(pictures, tmp_path):
    cv2 = pytest.importorskip("cv2")
    _, folder = pictures
    assert run(folder, tmp_path / "panoptic.json", "--to", "panoptic") == 0
    record = json.loads((tmp_path / "panoptic.json").read_text())
    assert [each["image_id"] for each in record["annotations"]] == [each["id"] for each in record["images"]] == [1, 2, 3]
    for annotation in record["annotations"]:
        blue_green_red = cv2.imread(str(folder / annotation["file_name"])).astype(int)
        numbers, areas = np.unique(blue_green_red @ [256**2, 256, 1], return_counts=True)
        segments = {each["id"]: each["area"] for each in annotation["segments_info"]}
        assert segments == {n: area for n, area in zip(numbers.tolist(), areas.tolist(), strict=True) if n}
    colors = [tuple(each["color"]) for each in record["categories"]]
    assert len(set(colors)) == len(colors) and all(each["isthing"] == 1 for each in record["categories"])


@pytest.mark.parametrize("kind", ["coco", "panoptic"])
def test_a_picture_beside_its_labels_is_the_one_that_is_named(tmp_path, kind):
    for name in ("a", "b"):
        files.write(tmp_path / f"{name}.exr", vp.label(room(), ("masks",)))
    (tmp_path / "b.png").write_bytes(encoded(np.zeros((48, 64, 3), np.uint8)))
    assert run(tmp_path, tmp_path / "all.json", "--to", kind) == 0
    record = json.loads((tmp_path / "all.json").read_text())
    assert [each["file_name"] for each in record["images"]] == ["a.exr", "b.png"]


def test_an_instance_has_one_id_in_all_pictures(pictures, tmp_path):
    _, folder = pictures
    document = coco.instances(folder, amodal=True)
    of_balls = {each["instance_id"] for each in document["annotations"] if each["category_id"] == 1}
    assert len(of_balls) == 1 and sum(each["category_id"] == 1 for each in document["annotations"]) == 3


@pytest.mark.parametrize(
    ("content", "words", "sentence"),
    [
        (None, [], "has no label files"),
        ("{", [], "a.labels.json is no label file"),
        ("[]", [], "a.labels.json is no label file"),
        ('{"format": "virtual-pinhole-labels", "version": 1, "picture": "a", "camera": {"width": 1}}', [], "is no label file"),
        (
            '{"format": "virtual-pinhole-labels", "version": 2, "picture": "a", "camera": {"width": 1, "height": 1},'
            ' "instances": []}',
            [],
            "is of another version",
        ),
        *(
            (change, way, "a.labels.json is no label file")
            for change in (
                {"counts": [10**17, 0]},
                {"counts": ["1" * 400]},
                {"counts": [float("inf")]},
                {"counts": [-1, 64 * 48 + 1]},
                {"size": [2**31, 2**31]},
                {"bbox": [0, 0, 65, 1]},
                {"area": 10**400},
                {"camera": {}},
                {"id": 2**24},
                {"name": "\ud800"},
                {"object_to_camera": [[1e999] * 4] * 4},
                {"object_to_world": 1},
                {"box": {"min": [0, 0], "max": [1, 1]}},
                {"depth_png_steps": 0},
                {"picture": "../../a.exr"},
            )
            for way in ([], ["--to", "bop"])
        ),
        ("MASKS", ["--amodal"], "has no amodal masks: render it with --labels amodal"),
        ("MASKS", ["--amodal", "--to", "panoptic"], "--amodal is for COCO's instances"),
    ],
)
def test_what_can_not_be_gathered_is_one_sentence_and_nothing_is_written(tmp_path, capfd, content, words, sentence):
    """Run lengths of 10¹⁷ pixels asked for 888 PiB."""
    folder = tmp_path / "shots"
    folder.mkdir()
    if content == "MASKS":
        files.write(folder / "a.exr", vp.label(room(CAMERA), ("masks",)))
    elif isinstance(content, dict):
        told_in = files.write(folder / "a.exr", vp.label(room(CAMERA), ("depth", "masks", "amodal")))[-1]
        record = json.loads(told_in.read_text())
        instance = next(each for each in record["instances"] if each["visible"])
        for key, value in content.items():
            owners = (record, instance, instance["visible"], instance["visible"]["segmentation"])
            next(owner for owner in owners if key in owner)[key] = value
        told_in.write_text(json.dumps(record))
    elif content:
        (folder / "a.labels.json").write_text(content)
    assert run(folder, tmp_path / "out.json", *words) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and "bug" not in line and not (tmp_path / "out.json").exists()
