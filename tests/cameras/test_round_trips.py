"""Whatever the camera, the format and the options: written and read back with the same options it is the same camera."""

import dataclasses
import itertools
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from viewcam_addon import cameras
from viewcam_addon.cameras import Camera, Options, own
from viewcam_addon.errors import InputError
from viewcam_addon.pinhole import Pinhole

from .conftest import CAMERAS, numbers_alone, points_before

pytestmark = pytest.mark.usefixtures("openusd_in_this_process")

FEW = settings().max_examples // 4  # a fourth of the profile's, since there are dozens of formats
SETTINGS = settings(max_examples=FEW, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
FLOAT64, FLOAT32 = 2.0**-53, 2.0**-24

NO_MIRROR = (
    "transforms",
    "colmap",
    "colmap_binary",
    "bop",
    "gltf",
    "ros",
    "opencv",
    "look_at",
    "vtk",
    "textbook",
    "nerfstudio_path",
    "instant_ngp",
    "gaussian_splatting",
)
NO_SHIFT = ("gltf", "textbook", "nerfstudio_path", "instant_ngp", "gaussian_splatting")
SQUARE = ("mitsuba", "vtk", "textbook", "nerfstudio_path", "instant_ngp")
NO_POSE = ("ros",)
ANGLES = ("gltf", "nerfstudio_path", "instant_ngp")
"""Formats that say the distance by an angle, so that a wide or narrow one keeps fewer digits."""
WRITTEN = [form for form in cameras.writable() if form not in ("unity", "unreal")]
SEVERAL = ("sidecar", "transforms", "colmap", "colmap_binary", "bop", "gltf", "usd", "three_js", "mitsuba")
FILES = [form for form in WRITTEN if getattr(cameras.FORMATS[form], "SEVERAL", "") == "a folder"]
OURS = ("sidecar", "transforms", "colmap", "colmap_binary", "bop", "gltf", "usd", "ros", "opencv")


@pytest.fixture(autouse=True)
def _usd_is_read_by_openusd(request):
    """make test installs usd-core; the environments that differ by their Blender alone do without."""
    if hasattr(request.node, "callspec") and request.node.callspec.params.get("form") == "usd":
        pytest.importorskip("pxr")


coordinate = st.floats(-1e3, 1e3).map(lambda x: round(x, 6))
direction = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: math.hypot(*d) > 0.1)


@st.composite
def pinholes(draw):
    eye = draw(st.tuples(*[coordinate] * 3))
    view, up = draw(direction), draw(direction)
    width, height = draw(st.integers(8, 5000)), draw(st.integers(8, 5000))
    d = draw(st.floats(0.2, 50)) * width
    middle = (width / 2, height / 2)
    point = draw(st.one_of(st.none(), st.tuples(*[st.floats(-0.5, 1.5)] * 2)))
    reach = draw(st.floats(0.01, 100))
    pinhole = Pinhole(
        eye,
        tuple(a + reach * b for a, b in zip(eye, view, strict=True)),
        up,
        (d, d * draw(st.sampled_from([1.0, 1.0, 0.5, 1.7]))),
        width,
        height,
        middle if point is None else (point[0] * width, point[1] * height),
        draw(st.booleans()),
    )
    assume(pinhole.sine_to_up > 1e-3)
    return pinhole


def fitting(pinhole, form):
    """The camera, without what the format can't say."""
    change = {}
    if form in NO_MIRROR:
        change["mirrored"] = False
    if form in NO_SHIFT:
        change["principal_point"] = None
    if form in SQUARE:
        change["distance"] = pinhole.distance[0]
    return dataclasses.replace(pinhole, **change)


def read_back(pinhole, form, options, folder):
    folder.mkdir(exist_ok=True)
    path = folder / f"a{cameras.FORMATS[form].SUFFIX}" if form not in ("sidecar", "colmap", "colmap_binary") else folder
    cameras.save([Camera("a", pinhole)], path, form, options)
    there = Options(
        **{**dataclasses.asdict(options), "view_plane": None, "base": None, "size": (pinhole.width, pinhole.height)}
    )
    with numbers_alone():
        (back,) = cameras.read(path, options=there)
    return back


@pytest.mark.parametrize("form", OURS)
@SETTINGS
@given(pinhole=pinholes(), axes=st.sampled_from([*cameras.AXES]), scale=st.sampled_from([1.0, 0.01, 1000.0, 0.3048]))
def test_it_comes_back_as_the_same_camera(tmp_path_factory, form, pinhole, axes, scale):
    pinhole = fitting(pinhole, form)
    options = Options(axes=axes, scale=scale)
    back = read_back(pinhole, form, options, tmp_path_factory.mktemp("a"))
    assert back.name == ("0" if form == "bop" else "a")  # BOP numbers its images
    have = back.pinhole
    unit = FLOAT32 if form == "usd" else FLOAT64
    assert (have.width, have.height, have.mirrored) == (pinhole.width, pinhole.height, pinhole.mirrored)
    size = max(have.width, have.height)
    # An angle θ of half the picture is told to unit · θ, which is d/W + W/d times that of the distance.
    bent = 1 + max(pinhole.distance) / min(pinhole.width, pinhole.height) if form in ANGLES else 1
    for first, other in zip(have.distance, pinhole.distance, strict=True):
        assert abs(first - other) <= 16 * bent * unit * other, f"d is {first!r} and was {other!r}"
    for first, other in zip(have.principal_point, pinhole.principal_point, strict=True):
        assert abs(first - other) <= 16 * unit * max(abs(other), size), f"c is {first!r} and was {other!r}"
    if form in NO_POSE:
        return
    # The look-at point is near, and eye and look-at are rounded each where the scale is applied, and where it is taken off.
    turned = 8 * FLOAT64 * (math.hypot(*pinhole.eye) + math.hypot(*pinhole.look_at)) / math.dist(pinhole.eye, pinhole.look_at)
    assert np.abs(np.array(have.axes()) - pinhole.axes()).max() < 1e-14 + turned / pinhole.sine_to_up
    assert math.dist(have.eye, pinhole.eye) <= 1e-14 * max(math.hypot(*pinhole.eye), 1e-3)


@pytest.mark.parametrize("form", WRITTEN)
@SETTINGS
@given(several=st.lists(pinholes(), min_size=1, max_size=3), axes=st.sampled_from([*cameras.AXES]))
def test_whatever_is_written_comes_back_to_the_bit(tmp_path_factory, form, several, axes):
    several = [fitting(pinhole, form) for pinhole in several[: None if form in SEVERAL else 1]]
    options = Options(axes=axes, size=(several[0].width, several[0].height))
    if form == "bop":  # whose pictures have one size
        several = [dataclasses.replace(pinhole, width=options.size[0], height=options.size[1]) for pinhole in several]
    folder = tmp_path_factory.mktemp("a")
    path = folder / f"a{suffix}" if (suffix := cameras.FORMATS[form].SUFFIX) and form != "sidecar" else folder
    cameras.save([Camera(f"{number}", pinhole) for number, pinhole in enumerate(several)], path, form, options)
    back = cameras.read(path, options=options)
    if form in NO_POSE:  # and half a pixel off and on again
        assert cameras.write(back, form, options) == path.read_text()
    else:
        assert [camera.pinhole for camera in back] == several


def test_the_values_stay_where_openusd_writes_the_stage_again(tmp_path):
    usd = pytest.importorskip("pxr.Usd")
    pinhole = CAMERAS["shifted_and_not_square"]
    cameras.save([Camera("a", pinhole)], tmp_path / "ours.usda", "usd", Options(axes="y_up", scale=2))
    for suffix in (".usda", ".usdc"):
        usd.Stage.Open(str(tmp_path / "ours.usda")).Export(str(tmp_path / f"theirs{suffix}"))
        (back,) = cameras.read(tmp_path / f"theirs{suffix}", options=Options(axes="y_up", scale=2))
        (otherwise,) = cameras.read(tmp_path / f"theirs{suffix}")
        assert back.pinhole == pinhole
        assert any("axes=y_up scale=2" in note for note in otherwise.notes)


def test_the_values_stay_where_a_library_makes_a_glb_of_the_gltf(tmp_path):
    pygltflib = pytest.importorskip("pygltflib")
    cameras.save([Camera("a", CAMERAS["pixels_not_square"])], tmp_path / "ours.gltf", "gltf")
    pygltflib.GLTF2().load(str(tmp_path / "ours.gltf")).save_binary(str(tmp_path / "theirs.glb"))
    (back,) = cameras.read(tmp_path / "theirs.glb")
    assert back.pinhole == CAMERAS["pixels_not_square"]


OTHERS = {
    "an eye": {"eye": tuple(x + 1e-9 for x in CAMERAS["plain"].eye)},
    "a view": {"look_at": (0, 1e-9, 1)},
    "a distance": {"distance": 600.001},  # USD's is float32
    "a principal point": {"principal_point": (320.000001, 180)},
    "a size": {"width": 642},
    "a mirror": {"mirrored": True},
}


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("form", [form for form in WRITTEN if form not in ("sidecar", "text", *NO_POSE)])
def test_values_that_are_not_those_of_the_numbers_beside_them_do_not_count(tmp_path, form, other):
    """Somebody may edit the file in another program, which knows the format's own numbers alone."""
    path = tmp_path / f"a{suffix}" if (suffix := cameras.FORMATS[form].SUFFIX) else tmp_path
    options = Options(size=(640, 360))
    wrong = json.dumps(own.document(dataclasses.replace(CAMERAS["plain"], **OTHERS[other])))
    result = []
    for record in (None, "{}", wrong):
        cameras.save([Camera("a", CAMERAS["plain"])], path, form)
        if record is not None:
            file = path if suffix else path / {"colmap": "images.txt", "colmap_binary": "virtual_pinhole.txt"}[form]
            text, count = re.subn(r"\{[^{}]*\"up\"[^{}]*\}", record, file.read_text())
            assert count == 1
            file.write_text(text)
        (camera,) = cameras.read(path, options=options)
        result.append(camera.pinhole)
    exact, own_numbers, edited = result
    assert exact == CAMERAS["plain"] and edited == own_numbers


@pytest.mark.parametrize(("form", "file"), [("transforms", "transforms.json"), ("colmap", "images.txt")])
def test_where_somebody_changed_the_matrix_it_counts_and_not_the_values_of_which_it_was_made(tmp_path, form, file):
    path = tmp_path / file if form == "transforms" else tmp_path
    cameras.save([Camera("a", CAMERAS["plain"])], path, form)
    text = (tmp_path / file).read_text()
    assert "virtual_pinhole" in text and cameras.read(path)[0].pinhole == CAMERAS["plain"]
    if form == "transforms":
        record = json.loads(text)
        record["frames"][0]["transform_matrix"][0][3] += 1
        (tmp_path / file).write_text(json.dumps(record))
    else:
        *head, number, _, _ = text.split("\n")
        words = number.split(" ")
        words[5] = repr(float(words[5]) + 1)
        (tmp_path / file).write_text("\n".join([*head, " ".join(words), "", ""]))
    (changed,) = cameras.read(path)
    assert math.dist(changed.pinhole.eye, CAMERAS["plain"].eye) == pytest.approx(1)
    for damage in ("{", '"eye": [1, 2, 3]', '"eye": "x", "look_at"'):
        (tmp_path / file).write_text(text.replace('"eye"', damage, 1) if form == "colmap" else text.replace('"eye"', '"ey"', 1))
        assert np.abs(np.array(cameras.read(path)[0].pinhole.axes()) - CAMERAS["plain"].axes()).max() < 1e-15


@pytest.mark.parametrize("form", OURS)
@pytest.mark.parametrize("name", [*CAMERAS])
def test_what_it_can_not_say_it_refuses_and_never_leaves_out(tmp_path, form, name):
    """Written or refused, but never another picture."""
    pinhole = CAMERAS[name]
    try:
        back = read_back(pinhole, form, Options(), tmp_path)
    except InputError as error:
        assert ("mirrored" in str(error) and pinhole.mirrored) or ("shifted" in str(error) and form in NO_SHIFT), str(error)
        return
    assert not (form in NO_MIRROR and pinhole.mirrored)
    if form not in NO_POSE:
        points = points_before(pinhole)
        ours, expected = pinhole.project(points), back.pinhole.project(points)
        limit = max(1e-3, 64 * (FLOAT32 if form == "usd" else FLOAT64) * max(*pinhole.distance) * 1e6)
        assert np.hypot(ours[0] - expected[0], ours[1] - expected[1]).max() < limit


@pytest.mark.parametrize("form", [form for form in OURS if form not in NO_POSE])
def test_several_are_written_in_their_order_and_none_is_chosen_silently(tmp_path, form):
    written_cameras = [Camera(name, CAMERAS[name]) for name in ("plain", "portrait", "wide", "rolled")]
    several = cameras.FORMATS[form].SUFFIX == "" or form in ("sidecar", "opencv")
    path = tmp_path if several else tmp_path / f"all{cameras.FORMATS[form].SUFFIX}"
    if form == "opencv":  # a file for each
        assert {file.name for file in cameras.save(written_cameras, path, form)} == {
            f"{camera.name}.yml" for camera in written_cameras
        }
        return
    cameras.save(written_cameras, path, form)
    back = cameras.read(path, options=Options(size=(640, 360)))
    names = [camera.name for camera in back]
    assert names == (
        ["0", "1", "2", "3"]
        if form == "bop"
        else sorted(c.name for c in written_cameras)
        if form == "sidecar"
        else [c.name for c in written_cameras]
    )
    with pytest.raises(InputError, match=f"{names[0]}.*{names[3]}"):
        cameras.choose(back)
    assert cameras.choose(back, names[2]) is back[2]
    with pytest.raises(InputError, match="no camera 'nobody'"):
        cameras.choose(back, "nobody")


NUMBERED = ("bop",)
"""Formats that have no place for a camera's name."""
OF_PICTURES = ("transforms", "mitsuba", "gaussian_splatting")
"""Formats whose cameras are called as their pictures are, or by an identifier."""
names = st.sampled_from(["left", "right", "Kamera 1", "größer", "a{b}", "x.y", "it's", "\u3042", '"quoted"', "# / , ;"])


@pytest.mark.parametrize("form", WRITTEN)
@settings(SETTINGS, max_examples=8)
@given(data=st.data())
def test_several_cameras_are_read_as_they_were_written_to_the_bit_and_by_name(tmp_path_factory, form, data):
    """A file or a folder of any format, whatever the cameras."""
    called = data.draw(st.lists(names, min_size=2, max_size=4, unique=True))
    if cameras.FORMATS[form].SUFFIX == "" or form in OF_PICTURES:
        called = [name for name in called if not set(name) & set('/"#{ ')]
        assume(len(called) > 1)
    written = [Camera(name, fitting(data.draw(pinholes()), form)) for name in called]
    if form in NUMBERED:  # whose pictures say their size
        written = [replace(camera, pinhole=replace(camera.pinhole, width=640, height=360)) for camera in written]
    if form in ("nerfstudio_path", "instant_ngp"):  # which have one size for all
        sizes = {"width": 640, "height": 360, "principal_point": None}
        written = [replace(camera, pinhole=replace(camera.pinhole, **sizes)) for camera in written]
    options = Options(
        size=(640, 360), axes=data.draw(st.sampled_from([*cameras.AXES])), scale=data.draw(st.sampled_from([1.0, 0.5]))
    )
    path = tmp_path_factory.mktemp("a")
    path = path if form in ("sidecar", "colmap", "colmap_binary", *FILES) else path / f"all{cameras.FORMATS[form].SUFFIX}"
    cameras.save(written, path, form, options)
    back = {camera.name: camera for camera in cameras.read(path, options=options)}
    if form in NUMBERED:
        back = dict(zip(called, back.values(), strict=True))
    assert back.keys() == {*called}
    for camera in written:
        if form in NO_POSE:
            assert cameras.write([back[camera.name]], form) == cameras.write([camera], form)
        else:
            assert back[camera.name].pinhole == camera.pinhole


def test_of_several_codes_one_that_is_changed_counts_as_it_stands(tmp_path):
    written = [Camera(name, CAMERAS["plain"]) for name in ("a", "b")]
    for form, eye, other in (("look_at", "gluLookAt(7,", "gluLookAt(8,"), ("vtk", "SetPosition(7,", "SetPosition(8,")):
        text = other.join(cameras.write(written, form).rsplit(eye, 1))
        first, second = cameras.read(text)
        assert first.pinhole == CAMERAS["plain"] and second.pinhole.eye == (8, -6, 4)
        with pytest.raises(InputError, match="2 cameras and one is wanted"):
            cameras.choose([first, second])


@pytest.mark.parametrize("form", [form for form in WRITTEN if getattr(cameras.FORMATS[form], "SEVERAL", "") == "a text"])
def test_of_several_codes_one_that_is_cut_off_after_its_name_is_told_by_it(form):
    text = cameras.write([Camera(name, CAMERAS["plain"]) for name in ("a", "b")], form)
    cut = text[: text.index("\n", text.index('of "b"'))]
    with pytest.raises(InputError, match="the text names the camera 'b' and has no such camera") as refused:
        cameras.read(cut)
    assert refused.value.__cause__ is None


def test_a_folder_with_files_of_others_says_which_were_not_read(tmp_path):
    cameras.save([Camera(name, CAMERAS["plain"]) for name in ("left", "right")], tmp_path, "ros")
    (tmp_path / "settings.yaml").write_text("rate: 30\n")
    (tmp_path / "omni.yml").write_text((tmp_path / "left.yaml").read_text().replace("plumb_bob", "omni"))
    cameras_read = cameras.read(tmp_path)
    assert [camera.name for camera in cameras_read] == ["left", "right"]
    assert all(any("settings.yaml" in note for note in camera.notes) for camera in cameras_read)
    assert all(any("omni" in note for note in camera.notes) for camera in cameras_read)
    assert cameras.read(tmp_path, format="ros") == cameras_read


@pytest.mark.parametrize("form", ["transforms", "colmap", "gltf", "usd", "opencv", "ros"])
def test_what_is_written_remembers_axes_and_scale_and_says_so_where_others_are_chosen(tmp_path, form):
    options = Options(axes="y_up", scale=0.01)
    path = tmp_path / f"a{cameras.FORMATS[form].SUFFIX}"
    cameras.save([Camera("a", CAMERAS["plain"])], path, form, options)
    (as_written,), (otherwise,) = cameras.read(path, options=options), cameras.read(path)
    assert not any("was written with" in note for note in as_written.notes)
    assert any("axes=y_up scale=0.01" in note for note in otherwise.notes)


def test_y_down_is_half_a_turn_from_y_up_and_comes_back():
    below = Pinhole((1, 2, 3), (0, 0, 1), (0, -1, 0), 600, 640, 360)
    text = cameras.write([Camera("a", below)], "opencv")
    (camera,) = cameras.read(text, options=Options(axes="y_down", scale=2.0))
    assert camera.pinhole.eye == (2, 6, -4) and camera.pinhole.up == (0, 0, 1)
    (again,) = cameras.read(cameras.write([camera], "opencv", Options(axes="y_down", scale=2.0)), options=Options())
    assert again.pinhole.eye == (1, 2, 3) and again.pinhole.up == (0, -1, 0)


@pytest.mark.parametrize("tilt", [(0.2, -0.5, 1.0), (0.0, 1.0, 0.0), (0.3, 0.1, -1.0), (0.0, 0.0, -1.0)])
def test_a_world_is_leveled_by_its_cameras_as_nerfstudio_does(tilt):
    """Cameras around an axis, upright to it: the mean of their up is the axis but for its length."""
    rotations = pytest.importorskip("scipy.spatial.transform")
    turn, _ = rotations.Rotation.align_vectors([tilt], [(0, 0, 1)])
    angles = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    eyes = np.stack([7 * np.cos(angles), 7 * np.sin(angles), np.full(8, 3.0)], axis=-1)
    turned = [
        Camera(f"{i}", Pinhole(tuple(eye), tuple(turn.apply((0, 0, 1))), tilt, 600, 640, 360))
        for i, eye in enumerate(turn.apply(eyes))
    ]
    cameras_read = cameras.read(cameras.write(turned, "transforms"), options=Options(up_from="cameras"))
    ups = np.mean([camera.pinhole.picture_axes()[1] for camera in cameras_read], axis=0)
    assert ups / np.linalg.norm(ups) == pytest.approx((0, 0, 1), abs=1e-14)
    assert [camera.pinhole.eye[2] for camera in cameras_read] == pytest.approx([3.0] * 8, abs=1e-13)
    between = [np.linalg.norm(np.subtract(a.pinhole.eye, b.pinhole.eye)) for a, b in itertools.pairwise(cameras_read)]
    assert between == pytest.approx(np.linalg.norm(np.diff(eyes, axis=0), axis=1), rel=1e-13), "no world is stretched"
    degrees = np.degrees(np.arccos(tilt[2] / np.linalg.norm(tilt)))
    assert all(any(f"turned by {degrees:.4g}°" in note for note in camera.notes) for camera in cameras_read)


def test_cameras_whose_ups_cancel_out_level_nothing():
    with_ups = [Camera(f"{up}", Pinhole((7, 0, 0), (0, 0, 0), (0, 0, up), 600, 640, 360)) for up in (-1, 1)]
    with pytest.raises(InputError, match="cancel out"):
        cameras.read(cameras.write(with_ups, "transforms"), options=Options(up_from="cameras"))
