"""The dataset of a batch: of all its shots or none, of the cameras that took the pictures, and each file whole."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon import cameras
from viewcam_addon.cameras import sidecar as record
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import dataset
from viewcam_addon.jobs.folder import Folder, write_json
from viewcam_addon.jobs.job import Job
from viewcam_addon.labels import files as label_files
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.png import encoded

from ..labels.conftest import room

STATED = Pinhole((3, -6, 2.5), (0, 0, 1), (0, 0, 1), 400.0, 320, 180)
# The camera read back from Blender, which differs in the last bits only; here it is plain to see which of the two is written.
STORED = replace(STATED, eye=(3.25, -6, 2.5))
FILES = ("sparse/0/cameras.txt", "sparse/0/images.txt", "sparse/0/points3D.txt", "transforms.json")


def shots(*names):
    return [Job(name, eye=STATED.eye, look_at=STATED.look_at, up=STATED.up, d=400.0) for name in names]


@pytest.fixture
def folder(tmp_path):
    return Folder(tmp_path / "out")


@pytest.fixture
def finish(folder):
    """finish(name, camera, settings) puts a shot there as a batch leaves it."""

    def put(name, camera=STORED, settings="of now"):
        folder.image(name).write_bytes(b"picture")
        folder.preview(name).write_bytes(b"preview!")
        stated = record.record(STATED)["camera"]
        entries = {"rendered": {"width": 320, "height": 180}, "warnings": [], "timing": {"seconds": 0.5}}
        made_from = {"settings": settings, "image": f"{name}.exr", "bytes": {"image": 7, "preview": 8}}
        write_json(folder.sidecar(name), {**made_from, **entries, **record.record(camera), "stated": stated})

    return put


def written(folder):
    return sorted(path.relative_to(folder.path).as_posix() for path in folder.path.rglob("*") if path.suffix == ".txt") + [
        path.name for path in folder.path.glob("transforms*")
    ]


def settings(listed):
    return {shot.name: "of now" for shot in listed}


def write(folder, listed, suffix="png"):
    return dataset.write(folder, listed, settings(listed), suffix)


@pytest.mark.parametrize("suffix", ["png", "exr"])
def test_all_shots_in_the_order_of_the_list_with_the_cameras_that_blender_had(folder, finish, suffix):
    for name in ("b", "a"):
        finish(name)
    sentence = write(folder, shots("b", "a"), suffix)
    assert sentence == f"dataset of 2 pictures: {folder.path / 'transforms.json'} and {folder.path / 'sparse' / '0'}"
    assert written(folder) == list(FILES)
    document = json.loads((folder.path / "transforms.json").read_text())
    assert [frame["file_path"] for frame in document["frames"]] == [f"b.{suffix}", f"a.{suffix}"]
    assert [row[3] for row in document["frames"][0]["transform_matrix"]] == [3.25, -6, 2.5, 1]
    assert f" b.{suffix}\n\n" in (folder.path / "sparse/0/images.txt").read_text()


def test_the_same_shots_give_the_same_bytes(folder, finish):
    finish("a")
    write(folder, shots("a"))
    before = [(folder.path / name).read_bytes() for name in FILES]
    write(folder, shots("a"))
    assert [(folder.path / name).read_bytes() for name in FILES] == before


@pytest.mark.parametrize("fault", ["no sidecar", "no picture", "other settings", "half a sidecar"])
def test_with_a_shot_missing_there_is_none_and_it_is_named(folder, finish, fault):
    for name in ("a", "b", "c"):
        finish(name, settings="of before" if fault == "other settings" and name == "b" else "of now")
    if fault == "no sidecar":
        folder.sidecar("b").unlink()
    elif fault == "no picture":
        folder.preview("b").unlink()
    elif fault == "half a sidecar":
        folder.sidecar("b").write_text(folder.sidecar("b").read_text()[:-40])
    sentence = write(folder, shots("a", "b", "c"))
    assert sentence == "no dataset is written, since 1 of 3 shots are missing: b"
    assert written(folder) == []


def test_shots_of_other_lists_in_the_folder_are_no_part_of_it(folder, finish):
    finish("a")
    finish("another")
    write(folder, shots("a"))
    assert len(json.loads((folder.path / "transforms.json").read_text())["frames"]) == 1


def test_a_mirrored_camera_is_a_sentence_and_no_file(folder, finish):
    finish("a")
    finish("b", replace(STORED, mirrored=True))
    with pytest.raises(InputError, match=r"can't say that a camera is mirrored, as in b\.png: make its scale positive"):
        write(folder, shots("a", "b"))
    assert written(folder) == []


def test_a_name_with_a_space_is_refused_before_anything_is_rendered(folder, finish):
    listed = shots("front", "front left")
    with pytest.raises(InputError, match=r"can't name a picture with a space, as front left\.png: rename it"):
        dataset.refuse(listed, "png")
    dataset.refuse(listed[:1], "png")
    for shot in listed:
        finish(shot.name)
    with pytest.raises(InputError, match="front left"):
        write(folder, listed)
    assert written(folder) == []


@pytest.mark.parametrize("camera", [None, {}, {"eye": [0, 0, 0]}, "left"], ids=["none", "empty", "half", "a text"])
def test_a_sidecar_of_somebody_else_is_a_sentence(folder, finish, camera):
    finish("a")
    content = json.loads(folder.sidecar("a").read_text())
    write_json(folder.sidecar("a"), content | {"camera": camera})
    with pytest.raises(InputError, match=r"a\.json has no camera that can be read"):
        write(folder, shots("a"))


def test_a_folder_that_can_not_be_written_is_a_sentence(folder, finish):
    finish("a")
    (folder.path / "sparse").write_text("a file where the model would be")
    with pytest.raises(InputError, match="can't be written"):
        write(folder, shots("a"))
    assert written(folder) == []


# --- With labels: depth, masks, points and held-out pictures, by the rules of those who read them


@pytest.fixture(scope="module")
def learned(tmp_path_factory):
    """The folder of a dataset of nine labeled pictures, every fourth of which is held out."""
    folder = Folder(tmp_path_factory.mktemp("dataset") / "out")
    listed = shots(*(f"r_{i}" for i in range(9)))
    for i, shot in enumerate(listed):
        camera = Pinhole((4 * np.sin(i / 3) + 0.4, -7 * np.cos(i / 3), 3), (0.2, 0, 0.8), (0, 0, 1), 70.0, 64, 48)
        label(folder, shot.name, camera)
    dataset.write(folder, listed, settings(listed), "png", "4")
    return folder.path


def label(folder, name, camera, steps=1000.0, kinds=("depth", "masks")):
    """A shot and its labels as a batch leaves them, in a picture of colors by place."""
    row, column = np.mgrid[: camera.height, : camera.width]
    picture = np.stack([4 * row, 3 * column, row * 0 + 7], axis=-1).astype(np.uint8)
    folder.image(name).write_bytes(b"picture")
    folder.preview(name).write_bytes(encoded(picture))
    beside = label_files.write(folder.image(name), vp.label(room(camera), kinds), steps)
    sizes = {"image": 7, "preview": folder.preview(name).stat().st_size, **{path.name: path.stat().st_size for path in beside}}
    document = {"rendered": {"width": 64, "height": 48}, "warnings": [], "timing": {"seconds": 0.5}}
    of_labels = {"kinds": [*kinds], "depth_steps": steps, "files": [path.name for path in beside]}
    made_from = {"settings": "of now", "image": f"{name}.exr", "bytes": sizes, "labels": of_labels}
    write_json(folder.sidecar(name), {**made_from, **document, **record.record(camera)})


def test_nerfstudio_finds_all_it_asks_for(learned):
    """Its parser's rules: a depth and a mask of every frame, each of one channel; lists of all three splits, of pictures that
    there are; numbers of the camera at the top."""
    cv2 = pytest.importorskip("cv2")
    document = json.loads((learned / "transforms.json").read_text())
    assert {"fl_x", "fl_y", "cx", "cy", "w", "h"} <= document.keys()
    assert all(
        {"mask_path", "depth_file_path", "file_path", "transform_matrix"} <= frame.keys() for frame in document["frames"]
    )
    for frame in document["frames"]:
        assert cv2.imread(str(learned / frame["file_path"])).shape == (document["h"], document["w"], 3)
        depth = cv2.imread(str(learned / frame["depth_file_path"]), cv2.IMREAD_ANYDEPTH) * document["depth_unit_scale_factor"]
        mask = cv2.imread(str(learned / frame["mask_path"]), cv2.IMREAD_UNCHANGED)
        assert mask.shape == depth.shape == (document["h"], document["w"])
        camera = np.array(frame["transform_matrix"])
        floor = -camera[2, 3] / -camera[2, 2]  # along the axis to z = 0: nothing that the middle shows is beyond
        assert 0 < depth[24, 32] <= floor + 0.001 and set(np.unique(mask)) == {0, 255}
        assert np.array_equal(mask > 0, depth > 0)
    pictures = [frame["file_path"] for frame in document["frames"]]
    assert document["test_filenames"] == document["val_filenames"] == ["r_0.png", "r_4.png", "r_8.png"]
    assert sorted(document["train_filenames"] + document["test_filenames"]) == sorted(pictures)


def test_points_have_the_pictures_colors_where_splatting_looks_for_them(learned):
    pycolmap = pytest.importorskip("pycolmap")
    document = json.loads((learned / "transforms.json").read_text())
    head, _, data = (learned / document["ply_file_path"]).read_bytes().partition(b"end_header\n")
    names = [line.split()[-1] for line in head.decode().splitlines() if line.startswith("property")]
    assert names == ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue"]
    vertices = np.frombuffer(data, [(name, "<f4" if i < 6 else "u1") for i, name in enumerate(names)])
    model = pycolmap.Reconstruction(learned / "sparse" / "0")
    assert len(vertices) == model.num_points3D() > 1000 and model.num_images() == 9
    near = 0
    for point, vertex in zip((model.points3D[i] for i in sorted(model.points3D)), vertices, strict=True):
        assert np.abs(point.xyz - [vertex[name] for name in "xyz"]).max() < 1e-5
        assert [*point.color] == [vertex[name] for name in ("red", "green", "blue")] and vertex["blue"] == 7
        places = [model.images[each.image_id].points2D[each.point2D_idx].xy for each in point.track.elements]
        near += any(np.abs([4 * (y - 0.5) - vertex["red"], 3 * (x - 0.5) - vertex["green"]]).max() < 0.01 for x, y in places)
    assert near == len(vertices), (
        f"{len(vertices) - near} of {len(vertices)} points have a color that no picture has at their place"
    )


def test_gaussian_splatting_finds_each_picture_by_a_model_that_it_takes(learned):
    """The rules of its scene/colmap_loader.py and dataset_readers.py, and of nerfstudio's colmap_dataparser.py, which takes one
    model of all cameras: words parted at any white space, PINHOLE alone, two lines an image, pictures by their last name."""
    lines = {
        name: [line for line in (learned / "sparse" / "0" / f"{name}.txt").read_text().split("\n") if line[:1] != "#"]
        for name in ("cameras", "images")
    }
    cameras_of_file = [line.split() for line in lines["cameras"] if line]
    assert [(model, len(numbers)) for _, model, _, _, *numbers in cameras_of_file] == [("PINHOLE", 4)]
    images = [line.split() for line in lines["images"][:-1:2]]
    assert [words[9] for words in images] == [f"r_{i}.png" for i in range(9)] and {len(words) for words in images} == {10}
    assert all((learned / words[9]).is_file() and words[8] == cameras_of_file[0][0] for words in images)
    assert all(len(line.split()) % 3 == 0 for line in lines["images"][1::2])


def test_instant_ngp_has_depth_in_scene_units_and_a_cube_that_holds_the_points(learned):
    document = json.loads((learned / "transforms.json").read_text())
    assert document["integer_depth_scale"] == 0.001 and all(
        (learned / frame["depth_path"]).is_file() for frame in document["frames"]
    )
    lines = (learned / "sparse/0/points3D.txt").read_text().splitlines()
    points = np.array([line.split()[1:4] for line in lines if line[0] != "#"], float) * 0.33
    scale = document["aabb_scale"]
    assert scale in (1, 2, 4, 8, 16, 32, 64, 128)
    assert np.abs(points).max() <= scale / 2 and (scale == 1 or np.abs(points).max() > scale / 4)


def test_the_original_nerf_and_its_readers_find_three_files_of_pictures_without_a_suffix(learned):
    names = {}
    for split in ("train", "val", "test"):
        document = json.loads((learned / f"transforms_{split}.json").read_text())
        assert abs(document["camera_angle_x"] - 2 * np.arctan(32 / 70)) < 1e-12
        names[split] = [frame["file_path"] for frame in document["frames"]]
        assert all((learned / f"{name}.png").is_file() and not Path(name).suffix for name in names[split])
    assert names["test"] == names["val"] == ["r_0", "r_4", "r_8"] and len(names["train"]) == 6
    assert len(cameras.read(learned / "transforms_train.json")) == 6


@pytest.mark.parametrize(("test", "held_out"), [("4", ["a", "eval_2"]), ("eval_*", ["eval_1", "eval_2"]), ("[bc]", ["b", "c"])])
def test_pictures_are_held_out_by_number_or_name(folder, finish, test, held_out):
    listed = shots("a", "b", "c", "eval_1", "eval_2")
    for shot in listed:
        finish(shot.name)
    dataset.refuse(listed, "png", test)
    dataset.write(folder, listed, settings(listed), "png", test)
    document = json.loads((folder.path / "transforms_test.json").read_text())
    assert [frame["file_path"] for frame in document["frames"]] == held_out


@pytest.mark.parametrize(
    ("suffix", "test", "sentence"),
    [
        ("png", "1", "holds out all of the 2 pictures"),
        ("png", "c*", "holds out none of the 2 pictures"),
        ("exr", "2", "whose pictures are PNGs"),
    ],
)
def test_what_can_not_be_held_out_is_refused_before_anything_is_rendered(suffix, test, sentence):
    with pytest.raises(InputError, match=sentence):
        dataset.refuse(shots("a", "b"), suffix, test)


def test_depths_of_different_steps_are_refused_and_labels_of_some_shots_are_not_named(folder, finish):
    camera = Pinhole((0.4, -7, 3), (0.2, 0, 0.8), (0, 0, 1), 70.0, 64, 48)
    label(folder, "a", camera)
    label(folder, "b", camera, steps=500.0)
    with pytest.raises(InputError, match="depths have different steps"):
        write(folder, shots("a", "b"))
    finish("c", camera)
    write(folder, shots("a", "c"))
    document = json.loads((folder.path / "transforms.json").read_text())
    assert not {"ply_file_path", "depth_unit_scale_factor"} & document.keys()
    assert all(frame.keys() == {"file_path", "transform_matrix", "virtual_pinhole"} for frame in document["frames"])
