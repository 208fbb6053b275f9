"""COCO's files of many pictures, as pycocotools and the panoptic format's own rule read them."""

import json
from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon.cli import main
from viewcam_addon.labels import coco, files
from viewcam_addon.png import encoded

from .conftest import CAMERA, moved, room


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """The labels of three pictures by name, and their folder. In the last one the ball hides behind a cube."""
    folder = tmp_path_factory.mktemp("shots")
    found = {}
    for name, ball in (("a", moved(z=0.7)), ("b", moved(1, 0.4, 0.7)), ("c", moved(0.1, 2, 0.8, scale=0.3))):
        scene = room(ball=ball)
        cube = replace(scene.objects[2], name="Cube.001", matrix=np.array([moved(-2, 0, 0.4, 0.2, 0.4)]))
        found[name] = vp.label(replace(scene, objects=(*scene.objects, cube)), ("masks", "amodal"))
        files.write(folder / f"{name}.exr", found[name])
    return found, folder


def run(*words):
    return main(["labels", *map(str, words)])


@pytest.mark.parametrize("kind", ["visible", "amodal"])
def test_pycocotools_loads_it_and_finds_every_mask(pictures, tmp_path, kind):
    loader = pytest.importorskip("pycocotools.coco").COCO
    found, folder = pictures
    assert run(folder, tmp_path / "all.json", *(["--amodal"] if kind == "amodal" else [])) == 0
    dataset = loader(tmp_path / "all.json")
    assert [each["name"] for each in dataset.loadCats(dataset.getCatIds())] == ["Ball", "Cube", "Floor"]
    images = {each["file_name"]: each for each in dataset.loadImgs(dataset.getImgIds())}
    assert list(images) == ["a.exr", "b.exr", "c.exr"]
    for name, labels in found.items():
        image = images[f"{name}.exr"]
        assert (image["width"], image["height"]) == (64, 48)
        given = {each["id"]: each for each in labels.instances if each[kind] is not None}
        annotations = dataset.loadAnns(dataset.getAnnIds(image["id"]))
        assert {each["instance_id"] for each in annotations} == set(given)
        for each in annotations:
            mask, expected = dataset.annToMask(each), given[each["instance_id"]]
            assert mask.sum() == each["area"] == expected[kind]["area"] and each["bbox"] == expected[kind]["bbox"]
            assert dataset.loadCats(each["category_id"])[0]["name"] == coco.category(expected["name"])
            if kind == "visible":
                np.testing.assert_array_equal(mask, labels.image["Instance"][::-1, :, 0] == each["instance_id"])
    hidden = [each for each in found["c"].instances if each["name"] == "Ball"]
    assert [each["visible"] for each in hidden] == [None], "the test wants an object that is hidden as a whole"
    ids = dataset.getAnnIds()
    assert sorted(ids) == list(range(1, len(ids) + 1))


def test_segments_are_those_of_the_colours_of_the_pictures(pictures, tmp_path):
    cv2 = pytest.importorskip("cv2")
    _, folder = pictures
    assert run(folder, tmp_path / "panoptic.json", "--to", "panoptic") == 0
    told = json.loads((tmp_path / "panoptic.json").read_text())
    assert [each["image_id"] for each in told["annotations"]] == [each["id"] for each in told["images"]] == [1, 2, 3]
    for annotation in told["annotations"]:
        blue_green_red = cv2.imread(str(folder / annotation["file_name"])).astype(int)
        numbers, areas = np.unique(blue_green_red @ [256**2, 256, 1], return_counts=True)
        segments = {each["id"]: each["area"] for each in annotation["segments_info"]}
        assert segments == {n: area for n, area in zip(numbers.tolist(), areas.tolist(), strict=True) if n}
    colours = [tuple(each["color"]) for each in told["categories"]]
    assert len(set(colours)) == len(colours) and all(each["isthing"] == 1 for each in told["categories"])


@pytest.mark.parametrize("kind", ["coco", "panoptic"])
def test_a_picture_beside_its_labels_is_the_one_that_is_named(tmp_path, kind):
    for name in ("a", "b"):
        files.write(tmp_path / f"{name}.exr", vp.label(room(), ("masks",)))
    (tmp_path / "b.png").write_bytes(encoded(np.zeros((48, 64, 3), np.uint8)))
    assert run(tmp_path, tmp_path / "all.json", "--to", kind) == 0
    told = json.loads((tmp_path / "all.json").read_text())
    assert [each["file_name"] for each in told["images"]] == ["a.exr", "b.png"]


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
        told = json.loads(told_in.read_text())
        instance = next(each for each in told["instances"] if each["visible"])
        for key, value in content.items():
            owners = (told, instance, instance["visible"], instance["visible"]["segmentation"])
            next(owner for owner in owners if key in owner)[key] = value
        told_in.write_text(json.dumps(told))
    elif content:
        (folder / "a.labels.json").write_text(content)
    assert run(folder, tmp_path / "out.json", *words) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and "bug" not in line and not (tmp_path / "out.json").exists()
