"""Nothing that is read raises anything but InputError, hangs, or runs: files of every format, damaged in every way."""

import copy
import io
import json
import math
import re
import struct
import time
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Options
from viewcam_addon.errors import InputError

from . import test_read_only_formats as files
from .conftest import camera

pytestmark = pytest.mark.slow

SETTINGS = settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
GIVEN = Options(size=(64, 36), base=camera("plain").pinhole, original_world=True)


def documents():
    """A JSON of each format that is one."""
    known = files.Known("plain")
    k = {"fx": 1.0, "fy": 1.0, "cx": 1.0, "cy": 1.0, "width": 4, "height": 4}
    matrix = [*known.opengl.ravel().tolist(), 0, 0, 0, 1]
    return [
        json.loads(cameras.write([camera("plain"), camera("shifted")], "transforms")),
        json.loads(cameras.write([camera("plain")], "transforms"))
        | {"applied_transform": known.opengl.tolist(), "k1": 0.1, "camera_model": "OPENCV"},
        json.loads(cameras.write([camera("plain")], "bop")),
        json.loads(cameras.write([camera("plain")], "gltf")) | {"animations": [{"channels": [{"target": {"node": 0}}]}]},
        json.loads(cameras.write([camera("plain")], "sidecar")["plain.json"]),
        {"K": [[1, 0, 1], [0, 1, 1], [0, 0, 1]], "rvec": [0, 0, 1], "t": [1, 2, 3], "image_size": [4, 4], "dist": [0.1] * 5},
        {f"t_{i}{j}": 1.0 for i in range(3) for j in range(4)} | k,
        {"cameraPoseARFrame": matrix, "intrinsics": [1.0] * 9},
        {"poses": [[0, 0, 0, 1, 1, 2, 3]], "K": [1.0] * 9, "w": 4, "h": 4},
        {
            "version": ["1", "2", "9"],
            "views": [{"viewId": "1", "poseId": "1", "intrinsicId": "1", "path": "a.jpg"}],
            "intrinsics": [
                {
                    "intrinsicId": "1", "width": "4", "height": "3", "type": "radial3",
                    "focalLength": "50", "sensorWidth": "36",
                    "principalPoint": ["0", "0"], "distortionParams": ["0.1", "0", "0"],
                }
            ],
            "poses": [{"poseId": "1", "pose": {"transform": {"rotation": ["1", "0", "0"] * 3, "center": ["0", "0", "0"]}}}],
        },
        {
            "sfm_data_version": "0.3",
            "root_path": "",
            "views": [{"key": 0, "value": {"ptr_wrapper": {"data": {"filename": "a", "id_intrinsic": 0, "id_pose": 0}}}}],
            "intrinsics": [
                {
                    "key": 0,
                    "value": {
                        "polymorphic_id": 1,
                        "polymorphic_name": "pinhole",
                        "ptr_wrapper": {"data": {"width": 1, "height": 1, "focal_length": 1, "principal_point": [1, 1]}},
                    },
                }
            ],
            "extrinsics": [{"key": 0, "value": {"rotation": np.eye(3).tolist(), "center": [0, 0, 0]}}],
        },
    ]  # fmt: skip


JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.floats(),
    st.text(max_size=5),
    st.sampled_from(
        [[], {}, [[]], [{}], "", "1e999", "nan", [1, 2], [[1, 0], [0]], {"a": 1}, 0, -1, 1e308, 1e-308, [None] * 16]
    ),
)


def places(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*path, key))


def read_or_refused(source, options=GIVEN):
    try:
        return cameras.read(source, options=options)
    except InputError as error:
        assert str(error) and "\n" not in str(error), str(error)
        return []


@pytest.mark.parametrize("index", range(len(documents())))
@SETTINGS
@given(data=st.data())
def test_json_with_anything_in_place_of_anything_is_read_or_refused(index, data):
    document = copy.deepcopy(documents()[index])
    for _ in range(data.draw(st.integers(1, 2))):
        if not (result := [path for path in places(document) if path]):
            break
        *path, last = data.draw(st.sampled_from(result))
        holder = document
        for key in path:
            holder = holder[key]
        if data.draw(st.booleans()):
            holder[last] = copy.deepcopy(data.draw(JUNK))
        else:
            del holder[last]
    read_or_refused(json.dumps(document))
    read_or_refused(json.dumps(document), Options(axes="y_up", scale=100, without_distortion=True, original_world=True))


def texts():
    known = files.Known("plain")
    single = [camera("plain")]
    return [
        *(cameras.write(single, name) for name in ("transforms", "opencv", "ros", "bop", "gltf")),
        files.metashape(known),
        "# Bundle file v0.3\n1 0\n600 0 0\n1 0 0\n0 1 0\n0 0 1\n0 0 0\n",
        "1 1 2 3 0 0 0 1\n2 1 2 3 0 0 0 1\n",
        files.realitycapture_table(known, files.RC_HEADS[1], -0.1),
        files.visualsfm(known, term=-0.1),
        files.mvsnet(known),
        files.KITTI,
        '<x xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:FocalLength35mm="30"><xcr:Rotation>1 0 0 0 1 0 0 0 1'
        "</xcr:Rotation><xcr:Position>1 2 3</xcr:Position></x>",
    ]


@pytest.mark.parametrize("index", range(len(texts())))
@SETTINGS
@given(data=st.data())
def test_a_damaged_text_is_read_or_refused(index, data):
    text = texts()[index]
    for _ in range(data.draw(st.integers(1, 3))):
        first = data.draw(st.integers(0, len(text)))
        last = min(len(text), first + data.draw(st.integers(0, 12)))
        new = data.draw(
            st.one_of(st.text(max_size=4), st.sampled_from(["1e999", "nan", "-", "{", "[", "]", "}", '"', "\n", "  ", "0"]))
        )
        text = text[:first] + new + text[last:]
    read_or_refused(text)


def binaries(folder):
    singles = [camera("plain"), camera("shifted")]
    cameras.save(singles, folder, "colmap_binary")
    state = json.dumps({"cameraParameters": None}).encode()
    document = cameras.write(singles[:1], "gltf").encode()
    np.save(folder / "poses_bounds.npy", np.zeros((2, 17)))
    np.savez(folder / "k.npz", K=np.eye(3), R=np.eye(3), t=np.zeros(3))
    (folder / "a.fspy").write_bytes(b"fspy" + struct.pack("<III", 1, len(state), 0) + state)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(document), len(document), b"JSON")
    (folder / "a.glb").write_bytes(head + document)
    return [folder / name for name in ("cameras.bin", "images.bin", "poses_bounds.npy", "k.npz", "a.fspy", "a.glb")]


@SETTINGS
@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(tmp_path, data):
    path = data.draw(st.sampled_from(binaries(tmp_path)))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.sampled_from([0, 1, 127, 128, 255, 10, 200]))
    path.write_bytes(content[: data.draw(st.integers(0, len(content)))] if data.draw(st.booleans()) else content)
    read_or_refused(path)


EXTREME = st.sampled_from([0, -1, 5e-324, 1e-300, 1e-160, 1e160, 1e300, 1.7e308, -1.7e308, 3.5, 360, None, "a", [1], 10**400])
VALUES = st.fixed_dictionaries(
    {name: st.tuples(*[EXTREME] * 3) for name in ("eye", "look_at", "up")}
    | {"distance": EXTREME | st.tuples(EXTREME, EXTREME), "width": st.sampled_from([1, 640, 2**31, 10**15, 1.5])},
    optional={"principal_point": st.tuples(EXTREME, EXTREME), "mirrored": st.booleans()},
)


@pytest.mark.parametrize(
    "form", ["transforms", "bop", "gltf", "three_js", "opencv", "pbrt", "mitsuba", "pov_ray", "matrices", "vtk"]
)
@SETTINGS
@given(values=VALUES)
def test_whatever_values_stand_beside_the_numbers_the_numbers_are_read(form, values):
    document = {"height": 360, **values}
    text = re.sub(r"\{[^{}]*\"up\"[^{}]*\}", lambda _: json.dumps(document), cameras.write([camera("plain")], form))
    (cameras_read,) = cameras.read(text, options=GIVEN)
    assert math.dist(cameras_read.pinhole.eye, camera("plain").pinhole.eye) < 1e-14 * 64


@pytest.mark.parametrize("eye", [1e307, 5e307, 1.7e308])
def test_a_matrix_at_the_end_of_all_numbers_is_read_or_refused(eye):
    document = json.loads(cameras.write([camera("plain")], "transforms"))
    document["frames"][0]["transform_matrix"][0][3] = eye
    document["frames"][0]["transform_matrix"][1][3] = -eye
    read_or_refused(json.dumps(document))


LARGE = {
    "brackets": "[" * 250_000,
    "braces": '{"a":' * 50_000,
    "comments": '{"a": 1 /*' + "*" * 249_000,
    "quotes": '{"' + '\\"' * 125_000,
    "keys": "{" + ", ".join(f'"{i}": 1' for i in range(15_000)) + ', "a": 1, "a": 2}',
    "elements": "<a>" * 75_000,
    "pointers": json.dumps(
        {
            "asset": {"version": "2.0"},
            "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
            "nodes": [{"camera": 0}, *[{}] * 60_000],
            "animations": [
                {"channels": [{"target": {"extensions": {"KHR_animation_pointer": {"pointer": "/cameras/0/x"}}}}] * 3_000}
            ],
        }
    ),
    "nested cameras": json.dumps(
        {
            "asset": {"version": "2.0"},
            "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
            "nodes": [*({"camera": 0, "children": [i + 1]} for i in range(6_000)), {}],
        }
    ),
    "numbers": "1 2 3 4 5 6 7 8\n" * 15_000,
    "words": "eye " * 62_500,
    "yaml": "camera_matrix: a\n" * 15_000,
    "indents": "".join(" " * min(i, 50) + "a:\n" for i in range(5_000)),
    "spaces": " " * 250_000,
    "commas": "," * 250_000,
    "calls": "eye(" * 62_500,
    "projections": "perspective(" * 21_000,
    "rows": "view = " + "vec4(" * 100 + "view = vec4(" * 20_000,
    "looks": "LookAt 1 2 3 4 5 6 0 0 1\n" * 10_000,
    "sensors": "<sensor type='thinlens'/>" * 5_000 + "<sensor type='perspective'/>" * 5_000,
    "defaults": "".join(f"<default name='a{i}' value='{i}'/>" for i in range(5_000)) + "<sensor type='$a17'/>" * 5_000,
    "quotes_in_code": "camera.position = [" + "'\\'" * 80_000,
    "names": "camera.position = a" + ".b" * 120_000,
    "calls_of_nothing": "camera.position = a" + "().b" * 60_000,
    "parentheses": "camera.lookAt(" + "(" * 240_000,
    "casts": "camera.position = " + "(float)" * 35_000,
    "signs": "camera.position = " + "-" * 240_000,
    "steps": "a++ " * 60_000 + "camera.position = a",
    "dots": "camera.position = " + "1.1" * 80_000,
    "blanks_in_code": "camera.position = [1," + " " * 240_000 + "2",
    "names_of_names": "".join(f"a{i} = a{i + 1} + a{i + 2};\n" for i in range(9_000)) + "camera.position = a0",
    "comments_in_code": "camera.position = 1" + " /* //" * 40_000,
    "keys_in_code": "eye = [" + "a: " * 80_000,
    "statements_of_pbrt": "LookAt " + "1" * 100_000 + "a" + '"\\' * 60_000,
    "items_of_python": "{'type': 'perspective', 'to_world': " + "T.a() @ " * 30_000,
    "lines_of_yaml": "K: [1, 2" + ("\n" + " " * 200 + "- a") * 1_000,
    "digits": '{"frames": [{"transform_matrix": ' + "9" * 249_000 + "}]}",
}


@pytest.mark.parametrize("name", LARGE)
def test_a_quarter_of_a_megabyte_of_anything_is_answered_soon(name):
    started = time.process_time()
    read_or_refused(LARGE[name])
    seconds = time.process_time() - started
    assert seconds < 20, f"{seconds:.1f} s"  # a text that takes time by its square takes many minutes


def test_no_xml_brings_anything_from_outside_or_grows():
    bomb = "".join(f'<!ENTITY a{i + 1} "{f"&a{i};" * 10}">' for i in range(10))
    for inner in (bomb, '<!ENTITY a1 SYSTEM "file:///etc/passwd">'):
        with pytest.raises(InputError):
            cameras.read(f'<!DOCTYPE document [<!ENTITY a0 "a">{inner}]><document><chunk>&a1;</chunk></document>')


def test_a_path_in_a_file_opens_nothing_but_a_pictures_head(tmp_path):
    text = cameras.write([camera("plain")], "transforms")
    document = json.loads(text)
    del document["w"], document["h"]
    for path in ("/dev/zero", "/dev/stdin", "../../../etc/passwd", "\0", "a" * 5000):
        document["frames"][0]["file_path"] = path
        (tmp_path / "transforms.json").write_text(json.dumps(document))
        with pytest.raises(InputError, match="size"):
            cameras.read(Path(tmp_path / "transforms.json"))


def npz(**members):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return packed.getvalue()


def npy(header, data=b""):
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def lying():
    """An archive whose table says that 64 MiB of zeros are 200 bytes."""
    data = bytearray(npz(K=npy("{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3), }", bytes(2**26))))
    at = data.index(b"PK\x01\x02") + 24
    data[at : at + 4] = struct.pack("<I", 200)
    return bytes(data)


SHAPES = {
    "a cut header": "{'descr': '<f8', 'fortran_order': False, 'shape': (3,",
    "a huge shape": "{'descr': '<f8', 'fortran_order': False, 'shape': (9999999999, 99999999, 17), }",
    "a shape beyond C": f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({10**30}, 17), }}",
    "a shape below nothing": "{'descr': '<f8', 'fortran_order': False, 'shape': (-3, 17), }",
    "a shape of words": "{'descr': '<f8', 'fortran_order': False, 'shape': ('a', 17), }",
    "nested signs": "-" * 5000 + "1",
    "nested brackets": "(" * 5000,
    "objects": "{'descr': '|O', 'fortran_order': False, 'shape': (3, 17), }",
    "forty axes": f"{{'descr': '<f8', 'fortran_order': False, 'shape': {(1,) * 40}, }}",
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("file", ["poses_bounds.npy", "k.npz"])
def test_an_array_whose_header_lies_is_refused_before_it_is_believed(tmp_path, name, file):
    data = npy(SHAPES[name])
    (tmp_path / file).write_bytes(data if file.endswith("npy") else npz(K=data, R=data, t=data))
    with pytest.raises(InputError, match="is damaged: save it again"):
        cameras.read(tmp_path / file)


def test_an_archive_whose_table_lies_unpacks_no_more_than_that(tmp_path):
    (tmp_path / "k.npz").write_bytes(lying())
    tracemalloc.start()
    try:
        with pytest.raises(InputError):
            cameras.read(tmp_path / "k.npz")
        assert tracemalloc.get_traced_memory()[1] < 2**25  # half of what is packed there
    finally:
        tracemalloc.stop()


DEEP = 981
NESTED = {
    "openmvg's key": '{"sfm_data_version": "0.3", "views": [], "intrinsics": [{"key": [[1]], '
    '"value": {"ptr_wrapper": {"data": {}}}}]}',
    "three.js' child": '{"object": {"type": "Group", "children": "abc"}}',
    "three.js' children": '{"object": {"type": "Group", "children": ["abc", 5, null]}}',
    "a matrix": '{"frames": [{"file_path": "a", "transform_matrix": ' + "[" * DEEP + "1" + "]" * DEEP + "}]}",
    "a matrix of objects": '{"frames": [{"file_path": "a", "transform_matrix": ' + '{"a":' * DEEP + "1" + "}" * DEEP + "}]}",
    "K": '{"K": ' + "[" * DEEP + "1" + "]" * DEEP + "}",
    "a pose of BOP": '{"0": {"cam_K": ' + "[" * DEEP + "1" + "]" * DEEP + "}}",
    "a phone's": '{"poses": ' + "[" * DEEP + "1" + "]" * DEEP + ', "K": 1, "w": 1, "h": 1}',
    "glTF's": '{"asset": {}, "nodes": [{"camera": 0, "children": ' + "[" * DEEP + "1" + "]" * DEEP + '}], "cameras": [{}]}',
    "an id of Meshroom": '{"views": [{"viewId": [[]], "poseId": {}}], "intrinsics": [{"intrinsicId": []}], '
    '"poses": [{"poseId": []}]}',
    "a sidecar's": '{"camera": ' + "[" * DEEP + "1" + "]" * DEEP + ', "cameraToWorld": 1, "worldToCamera": 1, "K": 1}',
    "a distortion": '{"K": [1, 0, 1, 0, 1, 1, 0, 0, 1], "image_size": [4, 4], "dist": ' + "[" * DEEP + "0" + "]" * DEEP + "}",
    "OpenCV's XML": "<opencv_storage><K type_id='opencv-matrix'><rows>1</rows><cols>3</cols><data>1 0 1 0 1 1 0 0 1</data></K>"
    "</opencv_storage>",
    "a narrow pbrt": 'LookAt 1 2 3 0 0 0 0 0 1 Camera "perspective" "float fov" [ 5e-324 ]',
    "a narrow POV-Ray": "camera { angle 5e-324 location 0 look_at z sky y }",
    "an applied transform": '{"frames": [{"file_path": "a.png", "transform_matrix": 1}], "applied_transform": 5}',
    "a flat view": "view = [0,0,1,0, 0,0,1,0, 0,0,1,-5, 0,0,0,1]",
}


@pytest.mark.parametrize("name", NESTED)
def test_what_is_of_another_kind_than_expected_is_told_by_its_reader(name):
    with pytest.raises(InputError) as refused:
        cameras.read(NESTED[name], options=GIVEN)
    assert refused.value.__cause__ is None, f"no reader thought of this: {refused.value.__cause__!r}"


def long_named():
    document = json.loads(cameras.write([camera("plain")], "gltf"))
    document["nodes"][0]["name"] = "x" * 5000
    return document


def test_names_and_sentences_are_lines_of_characters_that_show():
    assert len(cameras.read(json.dumps(long_named()))[0].name) == 1001
    name = "a\nb\0c\x1b[2J\ud83d"
    document = json.loads(cameras.write([camera("plain")], "gltf"))
    document["nodes"][0]["name"] = name
    (cameras_read,) = cameras.read(json.dumps(document))
    assert cameras_read.name == r"a\nb\x00c\x1b[2J\ud83d"
    document["cameras"][0]["perspective"]["yfov"] = 4
    with pytest.raises(InputError) as refused:
        cameras.read(json.dumps(document))
    assert str(refused.value).isprintable()
    with pytest.raises(InputError) as refused:
        cameras.read('LookAt 1 2 3 0 0 0 0 0 1 Camera "\nspherical" "float fov" [ 50 ]')
    assert str(refused.value).isprintable()


def test_what_no_reader_thought_of_is_a_sentence_with_its_cause(monkeypatch):
    def stumble(source, options):
        return {}["nothing of that name"]

    monkeypatch.setattr(cameras.FORMATS["transforms"], "read", stumble)
    with pytest.raises(InputError, match="damaged where it says its cameras") as refused:
        cameras.read(cameras.write([camera("plain")], "transforms"))
    assert isinstance(refused.value.__cause__, KeyError)
