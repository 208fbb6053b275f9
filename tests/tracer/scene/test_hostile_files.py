"""Scene files, and the arrays beside them, made to do harm: refused in a sentence, before they take time or memory."""

import io
import json
import time
import tracemalloc
import zipfile

import numpy as np
import pytest

from viewcam_addon import machine
from viewcam_addon.errors import InputError
from viewcam_addon.tracer.scene import scene_file

CAMERA = {"eye": [0, -5, 0], "look_at": [0, 0, 0], "up": [0, 0, 1], "distance": 50, "width": 16, "height": 12}
MEBI = 2**20


def document(**changed):
    return {
        "format": "virtual-pinhole-scene",
        "version": 1,
        "camera": CAMERA,
        "geometries": {"it": {"type": "mesh", "vertices": {"npz": "v"}, "triangles": []}},
        "objects": [],
        "arrays": "scene.npz",
    } | changed


@pytest.fixture
def refused(tmp_path):
    """refused(text or document, members of the archive) → the sentence that the scene is refused with."""

    def read(scene, members=(), packing=zipfile.ZIP_DEFLATED):
        (tmp_path / "scene.json").write_text(scene if isinstance(scene, str) else json.dumps(scene), encoding="utf-8")
        with zipfile.ZipFile(tmp_path / "scene.npz", "w", packing) as archive:
            for name, content in dict(members).items():
                archive.writestr(name, content)
        with pytest.raises(InputError) as error:
            scene_file.read(tmp_path / "scene.json")
        sentence = str(error.value)
        assert "\n" not in sentence and len(sentence) < 300, sentence
        return sentence

    return read


def array(values):
    file = io.BytesIO()
    np.save(file, values)
    return file.getvalue()


def header(text, content=b""):
    """An array's file whose header says anything."""
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode("latin1") + content


def test_a_number_of_5000_digits_is_no_number_of_a_scene(refused):
    scene = json.dumps(document(geometries={}, camera=CAMERA | {"distance": 123456789})).replace("123456789", "9" * 5000)
    assert refused(scene) == "scene.json: 'distance' of 'camera' of the scene is inf: give a finite number"


def test_a_key_that_is_there_twice_is_found_among_200000_in_the_time_that_reading_takes(refused):
    keys = ", ".join(f'"{number}": 0' for number in range(200_000))
    started = time.process_time()
    assert "'199999' appears twice" in refused(f'{{{keys}, "199999": 0}}')
    assert time.process_time() - started < 5, "to count each key among all takes minutes"  # and linear time 0.3 s


@pytest.mark.parametrize(
    "changed", [{"x" * 1_000_000: 1}, {"objects": [{"name": "x" * 1_000_000, "geometry": "x"}]}, {"arrays": "x" * 1_000_000}]
)
def test_a_name_of_a_million_letters_is_told_by_its_beginning(refused, changed):
    assert "xxx…" in refused(document(geometries={}) | changed)


def test_a_member_of_the_archive_that_is_no_array_is_not_there(refused):
    sentence = refused(document(), {"v": b"text", "w.npy": array(np.zeros(3))})
    assert sentence.endswith("is 'v', which scene.npz does not hold: export the scene again")


@pytest.mark.parametrize(
    "member",
    [
        b"",
        b"text",
        header(""),
        header("("),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3,"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 3)}"),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (True, 3)}", b"0" * 24),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (0, 99999999999999999999, 3)}"),
        header("{'descr': 'no type', 'fortran_order': False, 'shape': (1, 3)}"),
        header("[" * 5000),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3)}", b"0" * 24),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3)}", b"0" * 25),
        header("{'descr': '<f8', 'fortran_order': False, 'shape': (6442450941, 3)}", b"0" * 24),
        b"\x93NUMPY\x07\x00" + array(np.zeros((1, 3)))[8:],
    ],
    ids=range(14),
)
def test_an_array_whose_header_is_malformed_or_lies_is_damaged(refused, member):
    assert "scene.npz: the array 'v' is damaged: export the scene again" in refused(document(), {"v.npy": member})


def test_a_size_in_the_archive_that_its_packed_bytes_can_not_hold_is_damaged(refused, tmp_path):
    """The archive's own table lies: 2³¹ bytes in a few, where Deflate packs a thousand into one at most."""
    shape = (2**31 // 24, 3)
    text = header(f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}")
    refused(document(), {"v.npy": text})
    data = bytearray((tmp_path / "scene.npz").read_bytes())
    size, lie = (length.to_bytes(4, "little") for length in (len(text), len(text) + shape[0] * 24))
    (tmp_path / "scene.npz").write_bytes(data.replace(size, lie))
    with pytest.raises(InputError, match="the array 'v' is damaged"):
        scene_file.read(tmp_path / "scene.json")


def test_arrays_that_need_more_memory_than_there_is_are_refused_before_any_is_taken(refused, monkeypatch):
    """16 MiB that are a few kilobytes as they are packed; two are too large together, and one is not."""
    monkeypatch.setattr(machine, "most", lambda: 40 * MEBI)
    vertices = array(np.zeros((16 * MEBI // 24, 3)))
    geometries = {name: {"type": "mesh", "vertices": {"npz": name}, "triangles": []} for name in "vw"}
    assert "memory" not in refused(document(geometries={"v": geometries["v"]}, objects=1), {"v.npy": vertices})
    members = {"v.npy": vertices, "w.npy": vertices}
    tracemalloc.start()
    sentence = refused(document(geometries=geometries), members)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert "the arrays of scene.npz need 0.0625 GiB of memory and there are 0.0391 GiB: make the scene smaller" in sentence
    assert peak < 24 * MEBI, f"{peak / MEBI:.0f} MiB were taken: the second array was read, too"


def test_an_array_that_many_geometries_name_is_read_once(tmp_path, monkeypatch):
    """Else a file of some kilobytes takes gigabytes."""
    monkeypatch.setattr(machine, "most", lambda: 3 * 8 * MEBI)
    np.savez_compressed(tmp_path / "scene.npz", v=np.zeros((8 * MEBI // 24, 3)))
    mesh = {"type": "mesh", "vertices": {"npz": "v"}, "triangles": []}
    (tmp_path / "scene.json").write_text(json.dumps(document(geometries={str(number): mesh for number in range(100)})))
    geometries = scene_file.read(tmp_path / "scene.json").geometries
    assert len({id(geometry.vertices) for geometry in geometries.values()}) == 1


def test_what_is_no_file_is_no_archive(tmp_path):
    (tmp_path / "scene.json").write_text(json.dumps(document()))
    (tmp_path / "scene.npz").mkdir()
    with pytest.raises(InputError, match=r"scene\.npz. is no \.npz file"):
        scene_file.read(tmp_path / "scene.json")
