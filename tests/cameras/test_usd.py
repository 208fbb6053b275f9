"""USD: the stage's own unit and axes count, and no stage takes more time, memory or files than it may."""

import math
import os
import sys
import time

import numpy as np
import pytest

from viewcam_addon import cameras, usd_stage
from viewcam_addon.cameras import Camera, Options
from viewcam_addon.errors import InputError

from .conftest import CAMERAS

pytest.importorskip("pxr")

pytestmark = pytest.mark.slow

GIVEN = Options(size=(640, 360))
SECONDS = 80 if sys.platform == "win32" else 20
"""The time that a busy machine may take to answer, on Windows after 20 s of any kind; a stage without bounds takes minutes.

Calibrated: 44 s under wine, on two cores with twenty processes."""


def stage(inside="", head='metersPerUnit = 1\n    upAxis = "Z"', name="Cam", at="(3, -1.5, -4.5)"):
    return f"""#usda 1.0
(
    {head}
)
def Camera "{name}" (
    {inside}
)
{{
    float focalLength = 35
    float horizontalAperture = 36
    float verticalAperture = 20.25
    double3 xformOp:translate = {at}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
"""


def read(text, options=GIVEN):
    return cameras.read(text, options=options)


@pytest.mark.usefixtures("openusd_in_this_process")
@pytest.mark.parametrize(
    ("head", "eye", "right"),
    [
        ("", (0.03, 0.045, -0.015), (1, 0, 0)),  # nothing is said: centimeters, y up
        ('metersPerUnit = 0.01\n upAxis = "Y"', (0.03, 0.045, -0.015), (1, 0, 0)),
        ('metersPerUnit = 1\n upAxis = "Z"', (3, -1.5, -4.5), (1, 0, 0)),
        ('metersPerUnit = 0.0254\n upAxis = "Z"', (0.0762, -0.0381, -0.1143), (1, 0, 0)),
        ("metersPerUnit = 1000", (3000, 4500, -1500), (1, 0, 0)),
    ],
)
def test_a_stage_says_its_unit_and_what_points_up(head, eye, right):
    (camera,) = read(stage(head=head))
    assert camera.pinhole.eye == pytest.approx(eye, rel=1e-15)
    assert camera.pinhole.axes()[0] == pytest.approx(right, abs=1e-15)
    assert any("as Blender's importer does" in note for note in camera.notes) == (eye != (3, -1.5, -4.5))
    assert camera.pinhole.distance == pytest.approx((35 / 36 * 640,) * 2, rel=1e-6)  # which counts in no unit


@pytest.mark.usefixtures("openusd_in_this_process")
def test_what_is_chosen_comes_on_top_of_what_the_stage_says():
    text = stage(head='metersPerUnit = 0.01\n upAxis = "Y"')
    (twice,) = read(text, Options(size=(640, 360), scale=1000, axes="y_up"))
    assert twice.pinhole.eye == pytest.approx((30, 45, -15), rel=1e-15)
    (turned,) = read(stage(), Options(size=(640, 360), axes="y_up"))
    assert turned.pinhole.eye == pytest.approx((3, 4.5, -1.5), rel=1e-15)


@pytest.mark.usefixtures("openusd_in_this_process")
@pytest.mark.parametrize("name", ["plain", "shifted_and_not_square", "telephoto"])
def test_what_was_written_with_y_up_is_the_same_camera_whether_that_is_chosen_or_not(name):
    written_cameras = [Camera("a", CAMERAS[name])]
    for options in (Options(), Options(axes="y_up")):
        text = cameras.write(written_cameras, "usd", options)
        assert read(text)[0].pinhole == read(text, Options(axes="y_up"))[0].pinhole == CAMERAS[name] or options.axes == "as_is"
        assert read(text)[0].pinhole == CAMERAS[name] and not any("written with" in note for note in read(text)[0].notes)


# ---- hostile stages


@pytest.fixture
def folder(tmp_path):
    """A folder for stages, beside a file that is none of theirs."""
    (tmp_path / "secret.usda").write_text(stage(name="secret"))
    inside = tmp_path / "inside"
    (inside / "parts").mkdir(parents=True)
    (inside / "parts" / "part.usda").write_text(stage(name="part"))
    return inside


@pytest.fixture
def outside(request, folder):
    """Assets outside of a stage's folder, or that are no files, by their names in OUTSIDE."""
    if request.param == "a link that leads out":
        request.getfixturevalue("symlink")(folder / "link.usda", folder.parent / "secret.usda")
    if request.param == "a pipe":
        if not hasattr(os, "mkfifo"):
            pytest.skip("there are no pipes in folders here")
        os.mkfifo(folder / "pipe.usda")
    return OUTSIDE[request.param].format(folder=folder.as_posix())


OUTSIDE = {
    "an absolute path": "/etc/passwd",
    "a device": "/dev/zero",
    "an absolute path of a stage": "{folder}/../secret.usda",
    "a path that leaves the folder": "../secret.usda",
    "a path that leaves it on its way": "parts/../../secret.usda",
    "a link that leads out": "link.usda",
    "a pipe": "pipe.usda",
    "an address": "https://example.org/a.usda",
    "an expression": "`'../secret.usda'`",
    "a package": "a.usdz[secret.usda]",
    "what is not there": "nothing.usda",
    "a layer with arguments": "../secret.usda:SDF_FORMAT_ARGS:a=b",
}
ARCS = {
    "references": ("prepend references = @{0}@</secret>", ""),
    "payloads": ("prepend payload = @{0}@</secret>", ""),
    "layers": ("", "subLayers = [@{0}@]"),
    "variants": ('variants = {{ string v = "a" }}\n prepend variantSets = "v"', ""),
}


# Each of them as a reference, and by each of the other arcs those that a program could open.
OUTSIDE_BY_ARC = [(each, "references") for each in OUTSIDE] + [
    (each, arc)
    for arc in ("payloads", "layers", "variants")
    for each in ("an absolute path of a stage", "a path that leaves the folder", "a link that leads out")
]


@pytest.mark.parametrize(("outside", "arc"), OUTSIDE_BY_ARC, indirect=["outside"])
def test_no_stage_opens_what_lies_outside_of_its_folder_or_is_no_file(folder, outside, arc):
    inside, head = (part.format(outside) for part in ARCS[arc])
    text = stage(inside, f'metersPerUnit = 1\n upAxis = "Z"\n {head}')
    if arc == "variants":
        variant = f'variantSet "v" = {{\n"a" ( prepend references = @{outside}@</secret> ) {{\n}}\n}}\n}}\n'
        text = text[: text.rindex("}")] + variant
    (folder / "a.usda").write_text(text)
    started = time.monotonic()
    cameras_read = cameras.read(folder / "a.usda", options=GIVEN)
    assert time.monotonic() - started < SECONDS
    assert [camera.name for camera in cameras_read] == ["Cam"]
    (note,) = (note for note in cameras_read[0].notes if note.startswith("Not read"))
    assert outside[:20] in note


@pytest.mark.parametrize("arc", ["references", "layers"])
def test_a_stage_is_composed_of_the_layers_in_its_folder(folder, arc):
    head = "subLayers = [@parts/part.usda@]" if arc == "layers" else ""
    body = "" if arc == "layers" else 'def "group" (\n prepend references = @./parts/part.usda@</part>\n)\n{\n}\n'
    (folder / "a.usda").write_text(stage(head=f'metersPerUnit = 1\n upAxis = "Z"\n {head}') + body)
    cameras_read = cameras.read(folder / "a.usda", options=GIVEN)
    assert {camera.name for camera in cameras_read} == {"Cam", "part" if arc == "layers" else "group"}
    assert not any(note.startswith("Not read") for camera in cameras_read for note in camera.notes)


def test_value_clips_are_left_out(folder):
    clips = f"""clips = {{
        dictionary default = {{
            double2[] active = [(0, 0)]
            asset[] assetPaths = [@{folder}/pipe.usda@]
            string primPath = "/Cam"
            double2[] times = [(0, 0)]
        }}
    }}"""
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.usda")
    (folder / "a.usda").write_text(stage(clips))
    (camera,) = cameras.read(folder / "a.usda", options=GIVEN)
    assert camera.pinhole.eye == (3, -1.5, -4.5) and any("value clips of /Cam" in note for note in camera.notes)


def test_a_package_is_read_from_its_first_file_on_with_the_layers_in_it(tmp_path):
    from pxr import UsdUtils

    (tmp_path / "part.usda").write_text(stage(name="part"))
    (tmp_path / "a.usda").write_text(stage(head='metersPerUnit = 1\n upAxis = "Z"\n subLayers = [@./part.usda@]'))
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usda"), str(tmp_path / "a.usdz"))
    cameras_read = cameras.read(tmp_path / "a.usdz", options=GIVEN)
    assert {camera.name for camera in cameras_read} == {"Cam", "part"}


def doubling(times):
    """Each prim is twice the one before: 2 to the power of so many cameras."""
    prims = ['def "L0"\n{\ndef Camera "c"\n{\n}\n}']
    for i in range(1, times):
        prims.append(
            "\n".join([f'def "L{i}"\n{{', *(f'def "{name}" (references = </L{i - 1}>)\n{{\n}}' for name in "ab"), "}"])
        )
    return "#usda 1.0\n" + "\n".join(prims)


HOSTILE = {
    "references to references": (doubling(30).encode(), "more time or memory"),
    "a turn of no kind": (stage().replace('["xformOp:translate"]', '["xformOp:foo"]').encode(), "can't be read"),
    "a size of no pixels": (
        stage().replace("float focal", "custom int2 userProperties:viewcam_resolution = (640, 0)\n float focal").encode(),
        "resolution",
    ),
    "a size that is none": (
        stage().replace("float focal", 'custom string userProperties:viewcam_resolution = "x"\n float focal').encode(),
        "two numbers of pixels",
    ),
    "a name in no encoding": (stage().replace('"Cam"', '"C\xfcm"').encode("latin-1"), "no stage that USD can open"),
    "a unit of 0": (stage(head="metersPerUnit = 0").encode(), "metersPerUnit"),
    "a unit beyond all numbers": (stage(head="metersPerUnit = inf").encode(), "metersPerUnit"),
    "a place beyond all numbers": (stage(at="(inf, nan, 0)").encode(), "finite"),
    "a beginning alone": (b"PXR-USDC" + bytes(200), "no stage that USD can open"),
    "noise": (b"PXR-USDC" + np.random.default_rng(1).bytes(3000), "no stage that"),
    "words": (b"#usda 1.0\n" + b"{" * 100_000, "no stage that"),
    "no camera": (b'#usda 1.0\ndef Xform "x" {}\n', "holds no camera"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_stage_is_refused_in_a_sentence_in_time(tmp_path, name):
    data, sentence = HOSTILE[name]
    (tmp_path / "a.usd").write_bytes(data)
    started = time.monotonic()
    with pytest.raises(InputError, match=sentence) as refused:
        cameras.read(tmp_path / "a.usd", options=GIVEN)
    assert time.monotonic() - started < SECONDS
    assert "bug" not in str(refused.value) and "\n" not in str(refused.value)


def test_a_time_of_a_camera_that_moves_is_what_the_stage_counts_by():
    text = stage(head='metersPerUnit = 1\n upAxis = "Z"\n timeCodesPerSecond = 25')
    moving = "double3 xformOp:translate.timeSamples = { 0: (0, 0, 5), 50: (3, 0, 5) }"
    reread = read(text.replace("double3 xformOp:translate = (3, -1.5, -4.5)", moving))
    assert [(camera.name, camera.time, camera.pinhole.eye) for camera in reread] == [
        ("Cam 0", 0.0, (0, 0, 5)),
        ("Cam 50", 2.0, (3, 0, 5)),
    ]
    assert all(math.isfinite(camera.pinhole.distance[0]) for camera in reread)


@pytest.mark.usefixtures("openusd_in_this_process")
def test_a_lens_that_a_spline_moves_is_read_at_its_knots_and_all_frames_between():
    spline = "float focalLength.spline = { 1: 18; post linear, 5.5: 36; post linear }"
    reread = read(stage().replace("float focalLength = 35", spline))
    focals = {camera.time * 24: camera.pinhole.distance[0] * 36 / 640 for camera in reread}
    assert focals == pytest.approx({time: 14 + 4 * time for time in (1, 2, 3, 4, 5, 5.5)}), focals


@pytest.mark.usefixtures("openusd_in_this_process")
def test_what_moves_above_a_camera_that_stands_in_the_world_makes_no_times_of_it():
    head, _, still = stage().partition("def Camera")
    moving = "double3 xformOp:translate.timeSamples = { 0: (0, 0, 5), 50: (3, 0, 5) }"
    order = 'uniform token[] xformOpOrder = ["xformOp:translate"]'
    still = still.replace('["', '["!resetXformStack!", "')
    reread = read(f'{head}def Xform "Dolly"\n{{\n{moving}\n{order}\ndef Camera{still}}}\n')
    assert [(camera.name, camera.pinhole.eye) for camera in reread] == [("Cam", (3, -1.5, -4.5))]


@pytest.mark.usefixtures("openusd_in_this_process")
def test_a_sublayers_times_are_where_its_offset_and_scale_put_them(tmp_path):
    moving = "double3 xformOp:translate.timeSamples = { 0: (0, 0, 5), 50: (3, 0, 5) }"
    (tmp_path / "shot.usda").write_text(stage().replace("double3 xformOp:translate = (3, -1.5, -4.5)", moving))
    layers = "subLayers = [@gone.usda@ (offset = 5), @shot.usda@ (offset = 100; scale = 2)]"
    (tmp_path / "all.usda").write_text(f'#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Z"\n {layers}\n)\n')
    reread = cameras.read(tmp_path / "all.usda", options=GIVEN)
    assert [(camera.name, camera.pinhole.eye) for camera in reread] == [("Cam 100", (0, 0, 5)), ("Cam 200", (3, 0, 5))]


def test_where_openusd_is_not_here_a_sentence_says_what_to_do(monkeypatch):
    monkeypatch.setattr(usd_stage.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="pip install usd-core"):
        read(stage())


@pytest.mark.usefixtures("openusd_in_this_process")
def test_cameras_of_one_name_in_different_places_are_told_apart():
    camera = 'def Camera "Cam" {}\n'
    first, second = read(f'#usda 1.0\ndef "A"\n{{\n{camera}}}\ndef "B"\n{{\n{camera}}}\n')
    assert first.name != second.name


def test_a_mark_of_the_byte_order_before_a_stage_is_said_by_openusd(tmp_path):
    path = tmp_path / "a.usda"
    path.write_text("\ufeff#usda 1.0\n", encoding="utf-8")
    with pytest.raises(InputError, match="no stage that USD can open"):
        cameras.read(path)


@pytest.mark.usefixtures("openusd_in_this_process")
def test_a_camera_of_an_asset_stands_wherever_that_is_an_instance():
    place = 'double3 xformOp:translate = ({}, 0, 0)\n uniform token[] xformOpOrder = ["xformOp:translate"]'
    asset = 'class "Asset"\n{\n def Camera "Cam" {}\n}\n'
    instances = (
        f'def Xform "{name}" (\n inherits = </Asset>\n instanceable = true\n)\n{{\n {place.format(x)}\n}}\n'
        for name, x in (("A", 1), ("B", 2))
    )
    read_cameras = read(f'#usda 1.0\n(\n metersPerUnit = 1\n upAxis = "Z"\n)\n{asset}{"".join(instances)}')
    assert [camera.pinhole.eye for camera in read_cameras] == [(1, 0, 0), (2, 0, 0)]


@pytest.mark.usefixtures("openusd_in_this_process")
@pytest.mark.parametrize("attribute", ["cameraProjectionType", "omni:lensdistortion:model"])
def test_a_lens_of_omniverse_is_named(attribute):
    """A fisheye was read as a pinhole without a word."""
    cameras_of_stage = "".join(
        f'def Camera "{name}" {{\n token {attribute} = "{name}"\n}}\n' for name in ("pinhole", "fisheye")
    )
    (camera,) = read(f"#usda 1.0\n{cameras_of_stage}")
    assert camera.name == "pinhole" and any("of the model 'fisheye'" in note for note in camera.notes)


def rendered(settings="", product="", products="</Render/P>"):
    return f"""#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Z"
)
def Camera "Cam" {{
    float focalLength = 50
    float horizontalAperture = 36
    float verticalAperture = 24
}}
def Scope "Render" {{
    def RenderSettings "S" {{
        int2 resolution = (1600, 800)
        rel camera = </Cam>
        rel products = [{products}]
        {settings}
    }}
    def RenderProduct "P" {{
        {product}
    }}
}}
"""


POLICY = "uniform token aspectRatioConformPolicy = "


@pytest.mark.usefixtures("openusd_in_this_process")
@pytest.mark.parametrize(
    ("settings", "product", "size", "distance"),
    [
        ("", "", (1600, 800), (50 / 48 * 1600, 50 / 24 * 800)),  # grown across, from 36 to 24 · 2
        ("", "int2 resolution = (800, 800)", (800, 800), (50 / 36 * 800, 50 / 36 * 800)),
        (f'{POLICY}"cropAperture"', "int2 resolution = (800, 800)", (800, 800), (50 / 24 * 800, 50 / 24 * 800)),
        (f'{POLICY}"cropAperture"', "", (1600, 800), (50 / 36 * 1600, 50 / 18 * 800)),
        (f'{POLICY}"cropAperture"', f'{POLICY}"adjustApertureWidth"', (1600, 800), (50 / 48 * 1600, 50 / 24 * 800)),
        (f'{POLICY}"adjustApertureHeight"', "", (1600, 800), (50 / 36 * 1600, 50 / 18 * 800)),
        (f'{POLICY}"adjustPixelAspectRatio"', "", (1600, 800), (50 / 36 * 1600, 50 / 24 * 800)),
        ("float pixelAspectRatio = 0.75", "", (1600, 800), (50 / 36 * 1600, 50 / 24 * 800)),  # 1600 · 0.75 / 800 = 36 / 24
    ],
)
def test_what_a_stage_renders_says_a_cameras_size_and_how_its_aperture_fits(settings, product, size, distance):
    (camera,) = read(rendered(settings, product))
    pinhole = camera.pinhole
    assert camera.size_stated and (pinhole.width, pinhole.height) == size
    assert pinhole.distance == pytest.approx(distance, rel=1e-12)


@pytest.mark.usefixtures("openusd_in_this_process")
def test_of_a_camera_that_is_rendered_in_several_shapes_none_is_taken():
    (camera,) = read(rendered(product="int2 resolution = (640, 480)\n rel camera = </Cam>", products=""))
    assert not camera.size_stated and any("2 shapes, as 1600 × 800, 640 × 480" in note for note in camera.notes)
    with pytest.raises(InputError, match="aspectRatioConformPolicy of camera 'Cam' is 'wide'"):
        read(rendered(f'{POLICY}"wide"'))
