"""The dataset of a batch: of all its shots or none, of the cameras that took the pictures, and each file whole."""

import json
from dataclasses import replace

import pytest

from viewcam_addon.cameras import sidecar as record
from viewcam_addon.errors import InputError
from viewcam_addon.jobs import dataset
from viewcam_addon.jobs.folder import Folder, write_json
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole

STATED = Pinhole((3, -6, 2.5), (0, 0, 1), (0, 0, 1), 400.0, 320, 180)
# What came of it in Blender, of which only the last bits differ; here it is plain to see which of the two is written.
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
    return sorted(str(path.relative_to(folder.path)) for path in folder.path.rglob("*") if path.suffix == ".txt") + [
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


@pytest.mark.parametrize("how", ["no sidecar", "no picture", "other settings", "half a sidecar"])
def test_with_a_shot_missing_there_is_none_and_it_is_named(folder, finish, how):
    for name in ("a", "b", "c"):
        finish(name, settings="of before" if how == "other settings" and name == "b" else "of now")
    if how == "no sidecar":
        folder.sidecar("b").unlink()
    elif how == "no picture":
        folder.preview("b").unlink()
    elif how == "half a sidecar":
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
