"""KITTI's folders, by their devkit's formulas in NumPy, of pixels that OpenCV reads."""

from dataclasses import replace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon.cli import main
from viewcam_addon.image import BACKGROUND_DEPTH
from viewcam_addon.labels import files, kitti

from .conftest import CAMERA, moved, room


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Labels by name, and the dataset's folder: `a` has a next frame, `b` has none."""
    folder = tmp_path_factory.mktemp("kitti")
    a, b = (room(replace(CAMERA, eye=(1 + 0.2 * i, -7, 3)), ball=moved(0.3 * i, 0, 0.7)) for i in range(2))
    labels = {"a": vp.label(a, ("depth", "flow"), next=b), "b": vp.label(b, ("depth",))}
    for name, each in labels.items():
        files.write(folder / "shots" / f"{name}.exr", each)
    assert main(["labels", str(folder / "shots"), str(folder / "kitti"), "--to", "kitti"]) == 0
    return labels, folder / "kitti"


def test_opencv_reads_depth_in_256ths_of_a_meter_and_none_where_nothing_is(written):
    cv2 = pytest.importorskip("cv2")
    labels, folder = written
    for name, each in labels.items():
        levels = cv2.imread(str(folder / "depth" / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        depth = each.image["Depth"][::-1, :, 0].astype(float)
        visible = depth < BACKGROUND_DEPTH
        assert levels.dtype == np.uint16 and visible.any() and not visible.all()
        off = np.abs(levels[visible] / 256 - depth[visible]).max()
        assert off <= 0.5 / 256, f"depth is off by {off * 256:.3g} steps, and rounds by half a step"
        assert (levels[~visible] == 0).all()


def test_opencv_reads_the_flow_and_what_is_hidden_there_is_valid_in_one_folder_only(written):
    cv2 = pytest.importorskip("cv2")
    labels, folder = written
    flow = labels["a"].image["Forward Flow"][::-1].astype(float)
    known, hidden = np.isfinite(flow).all(axis=-1), labels["a"].image["Forward Hidden"][::-1, :, 0] != 0
    assert (known & hidden).any() and (~known).any()
    for kind, expected in (("flow_occ", known), ("flow_noc", known & ~hidden)):
        valid, v, u = np.moveaxis(cv2.imread(str(folder / kind / "a.png"), cv2.IMREAD_UNCHANGED), -1, 0)  # blue, green, red
        assert valid.dtype == np.uint16
        np.testing.assert_array_equal(valid, expected.astype(int))
        assert not u[~expected].any() and not v[~expected].any()
        read = (np.stack([u, v], axis=-1).astype(float) - 2**15) / 64
        off = np.abs(read - flow)[expected].max()
        assert off <= 0.5 / 64, f"flow is off by {off * 64:.3g} steps, and rounds by half a step"
    assert {path.name for path in (folder / "flow_occ").iterdir()} == {"a.png"}, "b has no next frame"


def test_a_flow_of_more_than_512_pixels_is_unknown_and_does_not_wrap():
    u = np.array([-512.1, -512, 0, 511.98, 512, np.nan, -1e30, np.inf])
    levels = kitti.flow_levels(np.stack([u, np.zeros_like(u)], axis=-1)[None].astype(np.float32))[0]
    assert levels.tolist() == [[0, 0, 0], [0, 2**15, 1], [2**15, 2**15, 1], [65535, 2**15, 1]] + 4 * [[0, 0, 0]]


@pytest.mark.parametrize("there", ["masks only", "another picture's", "no EXR", "a folder", "a file"])
def test_what_can_not_be_written_is_one_sentence_and_leaves_no_folder(tmp_path, capfd, there):
    shots, out = tmp_path / "shots", tmp_path / "out"
    files.write(shots / "a.exr", vp.label(room(), ("depth",)))
    files.write(shots / "b.exr", vp.label(room(), ("masks" if there == "masks only" else "depth",)))
    sentence = {
        "masks only": "b.labels.json has neither depth nor forward flow: render it with --labels depth,flow --next",
        "another picture's": "b.labels.json is of another picture than",
        "no EXR": "b.labels.exr",
        "a folder": "out is there already: give the name of a new folder",
        "a file": "out",
    }[there]
    if there == "another picture's":
        small = replace(CAMERA, width=32, height=24)
        files.write(tmp_path / "small.exr", vp.label(room(small), ("depth",)))
        (tmp_path / "small.labels.exr").replace(shots / "b.labels.exr")
    elif there == "no EXR":
        (shots / "b.labels.exr").unlink()
    elif there == "a folder":
        (out / "mine").mkdir(parents=True)
    elif there == "a file":
        out.write_text("mine")
    before = sorted(path.name for path in tmp_path.iterdir())
    assert main(["labels", str(shots), str(out), "--to", "kitti"]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and "bug" not in line
    assert sorted(path.name for path in tmp_path.iterdir()) == before, "something was left behind"


def test_an_empty_folder_is_taken(tmp_path):
    files.write(tmp_path / "shots" / "a.exr", vp.label(room(), ("depth",)))
    (tmp_path / "out").mkdir()
    assert kitti.write(tmp_path / "shots", tmp_path / "out") == {"depth": 1, "flow": 0}
    assert [path.name for path in tmp_path.glob("out/*/*")] == ["a.png"]
