"""BOP's scenes by its documented formulas in NumPy, of pixels that OpenCV reads and of cameras that our own reader reads.

KITTI's folders, by their devkit's formulas in NumPy, of pixels that OpenCV reads.
"""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import viewcam_addon as vp
from viewcam_addon import cameras
from viewcam_addon.cli import main
from viewcam_addon.files import written_whole
from viewcam_addon.image import BACKGROUND_DEPTH
from viewcam_addon.labels import bop, files, kitti
from viewcam_addon.png import encoded
from viewcam_addon.tracer.scene import Object

from .conftest import CAMERA, moved, room

LABELS = ("depth", "position", "masks", "amodal")

# float32's half step, of coordinates of at most 16 (of object and world, each rounded once), in pixels: 75 / 3 a unit.
PIXELS = 2 * 3**0.5 * 16 * 2.0**-25 * 75 / 3


def scene(i):
    """Cubes of two sizes, one more of the first size under another name, one that is sheared and mirrored. At i = 2 the ball
    is hidden as a whole."""
    small = np.array([moved(-2, 0, 0.4, 0.2 + i, 0.4)])
    askew = np.array([moved(-1, -2, 0.5, 0.5) @ np.array([[-0.5, 0.2, 0, 0], [0, 0.3, 0, 0], [0, 0.1, 0.4, 0], [0, 0, 0, 1]])])
    actual = room(replace(CAMERA, eye=(1 + 0.2 * i, -7, 3)), ball=moved(0.1, 2, 0.8, scale=0.3) if i == 2 else None)
    more = Object("Cube.001", "cube", small), Object("Askew", "cube", askew)
    return replace(actual, objects=(*actual.objects, *more))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Labels of three pictures, the second with other steps of its depth; the dataset's folder and JSON files."""
    cv2 = pytest.importorskip("cv2")
    shots, out = (tmp_path_factory.mktemp("bop") / name for name in ("shots", "out"))
    labels = [vp.label(scene(i), LABELS) for i in range(3)]
    for i, each in enumerate(labels):
        files.write(shots / f"{i}.exr", each, depth_steps=5000.0 if i == 1 else 1000.0)
    (shots / "0.png").write_bytes(encoded(np.full((48, 64, 3), 7, np.uint8)))
    shares = []
    bop.write(shots, out, shares.append)
    assert shares == [0.0, 1 / 3, 2 / 3, 1.0]
    read = {name: json.loads((out / f"{name}.json").read_text()) for name in ("scene_camera", "scene_gt", "scene_gt_info")}
    return SimpleNamespace(
        labels=labels,
        out=out,
        objects=json.loads((out / "objects.json").read_text()),
        png=lambda name: cv2.imread(str(out / f"{name}.png"), cv2.IMREAD_UNCHANGED),
        **read,
    )


def turn_of(values):
    turn = np.array(values).reshape(3, 3)
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-12 and abs(np.linalg.det(turn) - 1) < 1e-12, "no rotation"
    return turn


def test_each_pixels_point_projects_to_the_pixels_center_from_the_world_and_from_its_model(written):
    worst = 0.0
    for i, labels in enumerate(written.labels):
        camera = written.scene_camera[str(i)]
        k = np.array(camera["cam_K"]).reshape(3, 3)
        world, local, ids = (labels.image[name][::-1] for name in ("Position", "Object Position", "Instance"))
        depth = written.png(f"depth/{i:06d}") * camera["depth_scale"]
        for each in written.scene_gt[str(i)]:
            rows, columns = np.nonzero(ids[..., 0] == each["instance_id"])
            model = local[rows, columns] @ np.array(written.objects[str(each["obj_id"])]["object_to_model"]).T
            of_world = 1000 * world[rows, columns] @ turn_of(camera["cam_R_w2c"]).T + camera["cam_t_w2c"]
            of_model = model @ turn_of(each["cam_R_m2c"]).T + each["cam_t_m2c"]
            for points in (of_world, of_model):
                x, y, w = k @ points.T
                worst = max([worst, *np.abs(x / w - columns), *np.abs(y / w - rows)])
                depths = depth[rows, columns]
                off = np.abs(points[:, 2] - depths)[depths > 0].max(initial=0.0)
                # Half a step of the PNG, and in millimeters the rounding that PIXELS is of.
                assert off <= camera["depth_scale"] / 2 + 0.01, f"depth is off by {off:.3g} mm"
    assert 0 < worst <= PIXELS, f"a point projects {worst:.3g} pixels beside its pixel's center"


def test_our_reader_of_bop_finds_the_cameras_again(written):
    cameras_read = cameras.read(written.out / "scene_camera.json", options=cameras.Options(scale=0.001, size=(64, 48)))
    points = np.array([(0.3, 0.1, 0.2), (-3.0, 4, 1), (2.0, -1, 0.5)])
    for labels, camera in zip(written.labels, cameras_read, strict=True):
        expected, got = (np.array(each.project(points)) for each in (labels.image.camera, camera.pinhole))
        assert np.abs(got - expected).max() <= 1e-11


def test_masks_are_the_labels_to_the_pixel_and_their_figures_are_the_toolkits(written):
    hidden = invalid = 0
    for i, labels in enumerate(written.labels):
        amodal = {each["id"]: each for each in labels.instances if each["amodal"]}
        entry = written.scene_gt[str(i)]
        assert [each["instance_id"] for each in entry] == list(amodal)
        depth = written.png(f"depth/{i:06d}")
        farthest = 65535.5 * written.scene_camera[str(i)]["depth_scale"] / 1000
        assert depth.dtype == np.uint16 and (farthest < 14) == (i == 1)
        np.testing.assert_array_equal(depth > 0, labels.image["Depth"][::-1, :, 0] < farthest)
        for place, (each, info) in enumerate(zip(entry, written.scene_gt_info[str(i)], strict=True)):
            whole, visible = (written.png(f"{kind}/{i:06d}_{place:06d}") for kind in ("mask", "mask_visib"))
            for mask in (whole, visible):
                assert mask.dtype == np.uint8 and mask.shape == (48, 64) and set(np.unique(mask)) <= {0, 255}
            np.testing.assert_array_equal(visible > 0, labels.image["Instance"][::-1, :, 0] == each["instance_id"])
            assert (whole[visible > 0] > 0).all() and (whole > 0).sum() == amodal[each["instance_id"]]["amodal"]["area"]
            assert info == {
                "bbox_obj": box(whole) if visible.any() else [-1] * 4,
                "bbox_visib": box(visible),
                "px_count_all": (whole > 0).sum(),
                "px_count_valid": (depth[whole > 0] > 0).sum(),
                "px_count_visib": (visible > 0).sum(),
                "visib_fract": (visible > 0).sum() / (whole > 0).sum(),
            }
            hidden += not visible.any()
            invalid += info["px_count_valid"] < info["px_count_all"]
    assert hidden and invalid, "the test wants an object that is hidden as a whole, and one beyond the reach of 16 bits"


def box(mask):
    """misc.calc_2d_bbox."""
    rows, columns = np.nonzero(mask)
    return [columns.min(), rows.min(), np.ptp(columns), np.ptp(rows)] if len(rows) else [-1] * 4


def test_what_has_one_name_box_and_scale_is_one_object_in_all_pictures(written):
    assert [each["name"] for each in written.objects.values()] == ["Askew", "Ball", "Ball", "Cube", "Cube", "Floor"]
    names = [{each["id"]: each["name"] for each in labels.instances} for labels in written.labels]
    result = {}
    for i, poses in written.scene_gt.items():
        for each in poses:
            key = (names[int(i)][each["instance_id"]], each["instance_id"])
            result.setdefault(key, set()).add(each["obj_id"])
    numbers = {key: sorted(each) for key, each in result.items()}
    assert [each for (name, _), each in numbers.items() if name == "Ball"] == [[2, 3]], "the ball is smaller in one picture"
    assert sorted(each for (name, _), each in numbers.items() if name == "Cube") == [[4], [5]]
    assert [each for (name, _), each in numbers.items() if name == "Cube.001"] == [[4]]
    assert np.linalg.det(written.objects["1"]["object_to_model"]) < 0, "what mirrors is the model's, no rotation can say it"


def test_a_picture_beside_its_labels_is_in_rgb_and_must_be_of_their_size(written, tmp_path, capfd):
    assert [path.name for path in (written.out / "rgb").iterdir()] == ["000000.png"]
    assert (written.png("rgb/000000") == 7).all()
    files.write(tmp_path / "a.exr", vp.label(room(), LABELS))
    (tmp_path / "a.png").write_bytes(encoded(np.zeros((24, 32, 3), np.uint8)))
    assert main(["labels", str(tmp_path), str(tmp_path / "out"), "--to", "bop"]) == 2
    assert "a.png has 32 × 24 pixels and its labels have others" in capfd.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("labels", "sentence"),
    [
        (("masks", "amodal"), "a.labels.json has no depth: render it with --labels depth"),
        (("depth", "amodal"), "a.labels.json has no visible masks: render it with --labels masks"),
        (("depth", "masks"), "a.labels.json has no amodal masks: render it with --labels amodal"),
        ("mirrored", "can't say that a camera is mirrored"),
        ("spoilt", "a.labels.json is no label file that can be read"),
    ],
)
def test_what_is_lacking_is_one_sentence_and_leaves_no_folder(tmp_path, capfd, labels, sentence):
    camera = replace(CAMERA, mirrored=labels == "mirrored")
    path = files.write(tmp_path / "a.exr", vp.label(room(camera), LABELS if isinstance(labels, str) else labels))[-1]
    if labels == "spoilt":
        record = json.loads(path.read_text())
        record["instances"][0]["amodal"]["segmentation"]["counts"].append(5)
        with written_whole(path) as temporary:
            temporary.write_text(json.dumps(record))
    before = sorted(path.name for path in tmp_path.iterdir())
    assert main(["labels", str(tmp_path), str(tmp_path / "out"), "--to", "bop"]) == 2
    (line,) = capfd.readouterr().err.strip().splitlines()
    assert sentence in line and "bug" not in line
    assert sorted(path.name for path in tmp_path.iterdir()) == before, "something was left behind"


@pytest.fixture(scope="module")
def written_kitti(tmp_path_factory):
    """Labels by name, and the dataset's folder: `a` has a next frame, `b` has none."""
    folder = tmp_path_factory.mktemp("kitti")
    a, b = (room(replace(CAMERA, eye=(1 + 0.2 * i, -7, 3)), ball=moved(0.3 * i, 0, 0.7)) for i in range(2))
    labels = {"a": vp.label(a, ("depth", "flow"), next=b), "b": vp.label(b, ("depth",))}
    for name, each in labels.items():
        files.write(folder / "shots" / f"{name}.exr", each)
    assert main(["labels", str(folder / "shots"), str(folder / "kitti"), "--to", "kitti"]) == 0
    return labels, folder / "kitti"


def test_opencv_reads_depth_in_256ths_of_a_meter_and_none_where_nothing_is(written_kitti):
    cv2 = pytest.importorskip("cv2")
    labels, folder = written_kitti
    for name, each in labels.items():
        levels = cv2.imread(str(folder / "depth" / f"{name}.png"), cv2.IMREAD_UNCHANGED)
        depth = each.image["Depth"][::-1, :, 0].astype(float)
        visible = depth < BACKGROUND_DEPTH
        assert levels.dtype == np.uint16 and visible.any() and not visible.all()
        off = np.abs(levels[visible] / 256 - depth[visible]).max()
        assert off <= 0.5 / 256, f"depth is off by {off * 256:.3g} steps, and rounds by half a step"
        assert (levels[~visible] == 0).all()


def test_opencv_reads_the_flow_and_what_is_hidden_there_is_valid_in_one_folder_only(written_kitti):
    cv2 = pytest.importorskip("cv2")
    labels, folder = written_kitti
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
