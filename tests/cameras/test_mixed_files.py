"""Files with several cameras, one of which is no pinhole: the others are read, and that one is named."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.errors import InputError

from . import test_read_only_formats as files
from .conftest import CAMERAS

GIVEN = Options(size=(640, 360))
KNOWN = files.Known("plain")
TURN, EYE = KNOWN.opencv.ravel().tolist(), KNOWN.e.tolist()


def transforms():
    document = json.loads(cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "transforms"))
    lens = {key: document.pop(key) for key in ("fl_x", "fl_y", "cx", "cy", "w", "h", "camera_angle_x", "camera_angle_y")}
    for frame, more in zip(document["frames"], ({}, {"camera_model": "EQUIRECTANGULAR"}), strict=True):
        frame.update(lens | more)
    return json.dumps(document)


def colmap(model="2 EQUIRECTANGULAR 640 360 640 360"):
    return {
        "cameras.txt": f"1 PINHOLE 640 360 600 600 320 180\n{model}\n",
        "images.txt": "1 1 0 0 0 0 0 4 1 good.png\n\n2 1 0 0 0 0.1 0 4 2 bad.png\n\n",
    }


def colmap_binary(tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    for name, text in (colmap() | {"points3D.txt": ""}).items():
        (tmp_path / name).write_text(text)
    pycolmap.Reconstruction(tmp_path).write_binary(tmp_path)
    return tmp_path


def kalibr():
    both = "\n  resolution: [640, 360]\n  intrinsics: [600, 600, 320, 180]\n  distortion_coeffs: [0, 0, 0, 0]\n"
    return f"good:{both}  distortion_model: radtan\nbad:{both}  distortion_model: fov\n"


def opencv():
    k = {"K": [[600, 0, 320], [0, 600, 180], [0, 0, 1]], "image_size": [640, 360]}
    return json.dumps({"good": k, "bad": k | {"model": "omni"}})


def skewed():
    k = {"image_size": [640, 360]}
    return json.dumps(
        {"good": k | {"K": [[600, 0, 320], [0, 600, 180], [0, 0, 1]]}, "bad": k | {"K": [600, 5, 320, 0, 600, 180, 0, 0, 1]}}
    )


def metashape():
    sphere = '<sensor id="1" type="spherical"><resolution width="8000" height="4000"/></sensor></sensors>'
    placed = (
        f'<camera id="7" label="bad.jpg" sensor_id="1"><transform>{files.text_of(np.eye(4))}</transform></camera></cameras>'
    )
    text = files.metashape(KNOWN, label="good.jpg")
    return text.replace("</sensors>", sphere).replace("</cameras>", placed)


def meshroom():
    views = [{"viewId": f"{i}", "poseId": f"{i}", "intrinsicId": f"{i}", "path": f"{name}.jpg"} for i, name in NAMED]
    lens = {"width": "640", "height": "360", "focalLength": "36", "sensorWidth": "36"}
    intrinsics = [lens | {"intrinsicId": f"{i}", "type": kind} for i, kind in enumerate(("pinhole", "equidistant"))]
    pose = {"transform": {"rotation": [*map(str, TURN)], "center": [*map(str, EYE)]}}
    poses = [{"poseId": f"{i}", "pose": pose} for i in range(2)]
    return json.dumps({"version": ["1", "2", "11"], "views": views, "intrinsics": intrinsics, "poses": poses})


def openmvg():
    def data(**values):
        return {"ptr_wrapper": {"data": values}}

    lens = {"width": 640, "height": 360, "focal_length": 600, "principal_point": [320, 180]}
    return json.dumps(
        {
            "sfm_data_version": "0.3",
            "views": [{"key": i, "value": data(filename=f"{name}.jpg", id_intrinsic=i, id_pose=i)} for i, name in NAMED],
            "intrinsics": [
                {"key": i, "value": {"polymorphic_id": i + 1, "polymorphic_name": kind} | data(**lens)}
                for i, kind in enumerate(("pinhole", "spherical"))
            ],
            "extrinsics": [{"key": i, "value": {"rotation": KNOWN.opencv.tolist(), "center": EYE}} for i in range(2)],
        }
    )


def realitycapture(tmp_path):
    for name, skew in (("good", "0"), ("bad", "0.1")):
        (tmp_path / f"{name}.xmp").write_text(
            f'<x xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:FocalLength35mm="30" xcr:Skew="{skew}">'
            f"<xcr:Rotation>1 0 0 0 1 0 0 0 1</xcr:Rotation><xcr:Position>1 2 3</xcr:Position></x>"
        )
    return tmp_path


def gltf():
    document = json.loads(cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "gltf"))
    document["cameras"][1] = {"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0, "zfar": 1}}
    return json.dumps(document)


def usd():
    pytest.importorskip("pxr")
    text = cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "usd")
    return '"orthographic"'.join(text.rsplit('"perspective"', 1))


def three_js():
    document = json.loads(cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "three_js"))
    document["object"]["children"][1]["type"] = "OrthographicCamera"
    return json.dumps(document)


def mitsuba():
    text = cameras.write([Camera("good", CAMERAS["plain"]), Camera("bad", CAMERAS["plain"])], "mitsuba")
    return 'type="thinlens"'.join(text.rsplit('type="perspective"', 1))


NAMED = [*enumerate(("good", "bad"))]
MIXED = (
    *(transforms, colmap, colmap_binary, kalibr, opencv, skewed, metashape, meshroom, openmvg, realitycapture),
    *(gltf, usd, three_js, mitsuba),
)


def source(make, folder) -> Path | str:
    contents = make(folder) if make in (colmap_binary, realitycapture) else make()
    if isinstance(contents, dict):
        for name, text in contents.items():
            (folder / name).write_text(text)
        return folder
    return contents


@pytest.mark.parametrize("make", MIXED)
def test_one_camera_that_is_no_pinhole_keeps_none_of_the_others_back(tmp_path, make):
    cameras_read = cameras.read(source(make, tmp_path), options=GIVEN)
    assert [camera.name for camera in cameras_read] == ["good"]
    (note,) = (note for note in cameras_read[0].notes if note.startswith("Left out"))
    assert re.search("bad", note) and re.search("pinhole", note), note
    assert cameras.choose(cameras_read, "good") is cameras_read[0]
    with pytest.raises(InputError, match="pinhole"):  # and not: there is no such camera
        cameras.choose(cameras_read, "bad")
    with pytest.raises(InputError, match="name one of 'good'"):
        cameras.choose(cameras_read, "nobody")


def test_where_all_are_no_pinholes_the_first_is_named():
    with pytest.raises(InputError, match="EQUIRECTANGULAR"):
        cameras.read(
            transforms()
            .replace("PINHOLE", "EQUIRECTANGULAR")
            .replace('"file_path": "good.png"', '"file_path": "good.png", "camera_model": "EQUIRECTANGULAR"')
        )


def test_a_camera_that_is_damaged_is_no_other_kind_of_camera_and_refuses_the_file():
    document = json.loads(transforms())
    document["frames"][0]["transform_matrix"][0][0] = 5
    with pytest.raises(InputError, match="length"):
        cameras.read(json.dumps(document))


def test_a_hundred_panoramas_are_one_note():
    images = "".join(f"{i} 1 0 0 0 0 0 4 {min(i, 2)} p{i}.png\n\n" for i in range(1, 101))
    actual = cameras.FORMATS["colmap"]
    texts = colmap() | {"images.txt": images}
    from viewcam_addon.cameras.source import Source

    (camera,) = actual.read(Source(texts), GIVEN)
    assert len(camera.notes) == 1 and len(camera.notes[0]) < 300 and len(camera.left_out) == 99


def test_a_model_is_found_above_its_folder_0(tmp_path):
    (tmp_path / "sparse" / "0").mkdir(parents=True)
    cameras.save([Camera("a", CAMERAS["plain"])], tmp_path / "sparse" / "0", "colmap")
    for place in (tmp_path / "sparse", tmp_path, tmp_path / "sparse" / "0"):
        assert cameras.read(place)[0].pinhole == CAMERAS["plain"]
    (tmp_path / "sparse" / "1").mkdir()
    with pytest.raises(InputError, match="2 models"):
        cameras.read(tmp_path / "sparse")
