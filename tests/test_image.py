"""EXR files: what goes in comes out, rows flip once, names of all versions mean the same, damage is named.

PNGs in and out, OpenCV beside: all filters of the format, all kinds of grays and colors, and damaged files.
"""

import random
import re
import struct
import tracemalloc
import zlib

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from viewcam_addon import image, machine, png
from viewcam_addon.errors import InputError
from viewcam_addon.image import Image
from viewcam_addon.pinhole import Pinhole

CAMERA = Pinhole((0.1, 2, 3), (0, 0.3, 0), (0, 0, 1), (500, 250), 5, 4, (2, 2.5), mirrored=True)


def numbered(height=4, width=5):
    """Every known pass, each value of its own."""
    count = 0
    passes = {}
    for name, channels in image.CHANNELS.items():
        size = height * width * len(channels)
        passes[name] = np.arange(count, count + size, dtype=np.float32).reshape(height, width, len(channels))
        count += size
    return passes


def test_passes_camera_and_attributes_come_back_as_they_were_written(tmp_path):
    written = Image(numbered(), CAMERA, {"command": "viewcam render"})
    image.write(tmp_path / "a.exr", written)
    back = image.read(tmp_path / "a.exr")
    assert back.size == (5, 4)
    assert back.camera == CAMERA, "the camera must come back to the last bit"
    assert back.attributes["command"] == "viewcam render"
    assert back.passes.keys() == written.passes.keys()
    for name, array in written.passes.items():
        assert np.array_equal(back[name], array), name


@settings(max_examples=20)
@given(hnp.arrays(np.float32, hnp.array_shapes(min_dims=2, max_dims=2), elements=st.floats(width=32)))
def test_every_float32_survives_the_file(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("image") / "a.exr"
    image.write(path, Image({"Depth": values[..., None]}))
    assert np.array_equal(image.read(path)["Depth"][..., 0], values, equal_nan=True)


def test_the_first_row_of_a_file_is_the_top_of_the_picture(tmp_path):
    image.write(tmp_path / "a.exr", Image({"Depth": np.array([[[1.0]], [[2.0]]], dtype=np.float32)}))
    stored = OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True).channels()["ViewLayer.Depth.Z"].pixels
    assert stored.tolist() == [[2.0], [1.0]]


def test_names_of_blender_4_and_parts_of_blender_5_mean_the_same_passes(tmp_path):
    index, depth = np.full((2, 3), 7, dtype=np.float32), np.full((2, 3), 9, dtype=np.float32)
    view_layer = {"View Layer.001.IndexOB.X": index, "View Layer.001.IndexMA.X": index, "View Layer.001.Depth.Z": depth}
    OpenEXR.File({}, view_layer).write(str(tmp_path / "4.exr"))
    parts = [
        OpenEXR.Part({}, {f"ViewLayer.{name}": pixels}, name)
        for name, pixels in (("Object Index.X", index), ("Depth.Z", depth))
    ]
    OpenEXR.File(parts).write(str(tmp_path / "5.exr"))
    for name in ("4.exr", "5.exr"):
        back = image.read(tmp_path / name)
        assert (back["Object Index"] == 7).all() and (back["Depth"] == 9).all()


def test_the_light_passes_of_blender_4_and_5_are_the_same(tmp_path):
    """The names that Cycles 4.2, 4.5, 5.0 and 5.2 write, read off their files."""
    light = np.full((2, 3), 7, dtype=np.float32)
    older = ("Combined", "Emit", "Env", "DiffDir", "DiffInd", "DiffCol")
    newer = ("Combined", "Emission", "Environment", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color")
    for file, names in (("4.exr", older), ("5.exr", newer)):
        channels = {f"ViewLayer.{name}.{letter}": light for name in (*names, "Noisy Image") for letter in "RGBA"}
        OpenEXR.File({}, channels).write(str(tmp_path / file))
        back = image.read(tmp_path / file)
        assert tuple(back.passes) == newer
        assert [back[name].shape[2] for name in newer] == [4, 3, 3, 3, 3, 3]


def test_of_two_view_layers_the_first_is_read(tmp_path):
    values = {f"{layer}.Depth.Z": np.full((1, 1), depth, dtype=np.float32) for layer, depth in (("A", 1), ("B", 2))}
    OpenEXR.File({}, values).write(str(tmp_path / "a.exr"))
    assert image.read(tmp_path / "a.exr")["Depth"] == 1


def test_channels_of_one_name_in_several_parts_are_told_apart_by_the_parts(tmp_path):
    """The last part of a picture for each eye was read, whatever was asked for."""
    for names in (("Z",), ("ViewLayer.Depth.Z",)):
        parts = [
            OpenEXR.Part({}, {name: np.full((1, 1), depth, np.float32) for name in names}, eye)
            for eye, depth in (("left", 1), ("right", 2))
        ]
        OpenEXR.File(parts).write(str(tmp_path / f"{names[0]}.exr"))
    with pytest.raises(InputError, match=r"several channels 'Z': name one of left\.Z, right\.Z"):
        image.read_channels(tmp_path / "Z.exr", {"Depth": ["Z"]})
    assert image.read_channels(tmp_path / "Z.exr", {"Depth": ["left.Z"]})["Depth"] == 1
    assert image.read(tmp_path / "ViewLayer.Depth.Z.exr")["Depth"] == 1


def test_what_a_file_holds_in_place_of_known_passes_is_said(tmp_path):
    OpenEXR.File({}, {name: np.zeros((1, 1), np.float32) for name in "RGB"}).write(str(tmp_path / "a.exr"))
    with pytest.raises(InputError, match="but the channels B, G, R: render a multilayer EXR"):
        image.read(tmp_path / "a.exr")


@pytest.mark.parametrize(("data", "kind"), [(b"\x89PNG\r\n", "a PNG"), (b"\xff\xd8\xff\xe0", "a JPEG"), (b"MM\0*", "a TIFF")])
def test_a_picture_of_another_kind_is_named(tmp_path, data, kind):
    (tmp_path / "a.exr").write_bytes(data)
    with pytest.raises(InputError, match=f"is {kind}, which has no passes: render an EXR"):
        image.read(tmp_path / "a.exr")


def test_only_the_passes_asked_for_are_kept(tmp_path):
    image.write(tmp_path / "a.exr", Image(numbered()))
    assert set(image.read(tmp_path / "a.exr", only=["Depth", "UV"]).passes) == {"Depth", "UV"}


def test_the_standard_attributes_take_world_points_to_the_camera_and_to_their_pixels(tmp_path):
    image.write(tmp_path / "a.exr", Image(numbered(), CAMERA))
    header = OpenEXR.File(str(tmp_path / "a.exr"), header_only=True).header()
    points = np.array(CAMERA.eye) + 3 * CAMERA.ray_directions([0, 4, 2], [3, 1, 0])
    column, row, depth = CAMERA.project(points)
    homogeneous = np.column_stack([points, np.ones(3)])
    # float32 matrices: each product is rounded to 2⁻²⁴ of its largest term, up to 500/5 · 2 · |P| ≈ 1000 before the division.
    assert (homogeneous @ header["worldToCamera"])[:, 2] == pytest.approx(-depth, abs=8 * 2.0**-24 * 10)
    clip = homogeneous @ header["worldToNDC"]
    ndc = clip[:, :2] / clip[:, 3:]
    assert ndc[:, 0] == pytest.approx(2 * column / CAMERA.width - 1, abs=8 * 2.0**-24 * 1000)
    assert ndc[:, 1] == pytest.approx(2 * row / CAMERA.height - 1, abs=8 * 2.0**-24 * 1000)


def test_a_missing_pass_is_named_with_those_that_are_there(tmp_path):
    image.write(tmp_path / "a.exr", Image({"Depth": np.zeros((1, 1, 1), dtype=np.float32)}))
    with pytest.raises(InputError, match=r"a\.exr has no pass 'Position' but Depth"):
        image.read(tmp_path / "a.exr")["Position"]


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.99])
def test_a_truncated_file_is_refused_in_one_sentence_and_prints_nothing(tmp_path, capfd, share):
    passes = {"Depth": np.random.default_rng(0).normal(size=(200, 100, 1)).astype(np.float32)}
    image.write(tmp_path / "whole.exr", Image(passes))
    data = (tmp_path / "whole.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(data[: int(len(data) * share)])
    with pytest.raises(InputError, match=r"cut\.exr .*render it again"):
        image.read(tmp_path / "cut.exr")
    assert capfd.readouterr() == ("", "")


def test_files_that_are_no_exr_or_hold_nothing_known_are_refused(tmp_path):
    (tmp_path / "text.exr").write_text("no picture")
    OpenEXR.File({}, {"R": np.zeros((1, 1), dtype=np.float32)}).write(str(tmp_path / "plain.exr"))
    for name, words in (("none.exr", "does not exist"), ("text.exr", "can't be read"), ("plain.exr", "none of the passes")):
        with pytest.raises(InputError, match=words):
            image.read(tmp_path / name)


def deep(path):
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    samples = np.empty((2, 3), dtype=object)
    for place in np.ndindex(2, 3):
        samples[place] = np.ones(2, dtype=np.float32)
    OpenEXR.File(header, {"ViewLayer.Depth.Z": OpenEXR.Channel("ViewLayer.Depth.Z", samples)}).write(str(path))


def window(path, data=((0, 0), (4, 3)), display=((0, 0), (4, 3)), aspect=1.0):
    (left, top), (right, bottom) = data
    pixels = np.zeros((bottom - top + 1, right - left + 1), dtype=np.float32)
    corners = {
        name: tuple(np.array(corner, np.int32) for corner in at)
        for name, at in (("dataWindow", data), ("displayWindow", display))
    }
    header = {**corners, "pixelAspectRatio": aspect, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"ViewLayer.Depth.Z": pixels}).write(str(path))


@pytest.mark.parametrize("data", [((100, 0), (104, 3)), ((1, 1), (3, 2)), ((-1, 0), (3, 3))])
def test_a_part_of_a_picture_is_refused_with_both_windows(tmp_path, data):
    window(tmp_path / "a.exr", data)
    words = f"holds the pixels from {data[0]} to {data[1]} of a picture from (0, 0) to (4, 3): render all of it"
    with pytest.raises(InputError, match=re.escape(words)):
        image.read(tmp_path / "a.exr")


def test_what_is_rendered_around_a_picture_is_left_out(tmp_path):
    """An overscan was refused as a part of a picture."""
    numbers = np.arange(8 * 9, dtype=np.float32).reshape(8, 9)
    windows = {"dataWindow": ((-2, -1), (6, 6)), "displayWindow": ((0, 0), (4, 3))}
    header = {name: tuple(np.array(corner, np.int32) for corner in corners) for name, corners in windows.items()}
    OpenEXR.File(header, {"ViewLayer.Depth.Z": numbers}).write(str(tmp_path / "a.exr"))
    assert (image.read(tmp_path / "a.exr")["Depth"][::-1, :, 0] == numbers[1:5, 2:7]).all()


def test_a_channel_of_a_part_is_named_with_it_or_without(tmp_path):
    """P.X was none of a file whose parts P and Z have the channels X, Y, Z and Z."""
    numbers = {letter: np.full((2, 3), i, np.float32) for i, letter in enumerate("XYZ")}
    parts = [OpenEXR.Part({}, numbers, "P"), OpenEXR.Part({}, {"Z": np.full((2, 3), 9, np.float32)}, "Z")]
    OpenEXR.File(parts).write(str(tmp_path / "a.exr"))
    for named in (["P.X", "P.Y", "P.Z"], ["X", "Y", "P.Z"]):
        read = image.read_channels(tmp_path / "a.exr", {"Position": named, "Depth": ["Z.Z"]})
        assert read["Position"][0, 0].tolist() == [0, 1, 2] and read["Depth"][0, 0] == 9


@pytest.mark.parametrize(
    ("compression", "kind", "lossy"),
    [
        ("ZIP", np.float16, ""),
        ("PIZ", np.float32, ""),
        ("PXR24", np.float16, ""),
        ("PXR24", np.float32, "PXR24"),
        ("B44", np.float32, ""),
        ("B44", np.float16, "B44"),
        ("DWAA", np.float32, "DWAA"),
        ("DWAB", np.float16, "DWAB"),
    ],
)
def test_a_compression_that_changes_pixels_is_known(tmp_path, compression, kind, lossy):
    numbers = np.random.default_rng(1).random((40, 40)).astype(kind)
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION")}
    OpenEXR.File(
        header, {"ViewLayer.Position.Y": numbers, "ViewLayer.Position.X": numbers, "ViewLayer.Position.Z": numbers}
    ).write(str(tmp_path / "a.exr"))
    read = image.read(tmp_path / "a.exr")
    changed = bool((read["Position"][::-1, :, 1] != numbers).any())
    assert (read.lossy, changed) == (lossy, bool(lossy))


def test_a_picture_may_begin_anywhere(tmp_path):
    window(tmp_path / "a.exr", ((7, -7), (11, -4)), ((7, -7), (11, -4)))
    assert image.read(tmp_path / "a.exr").size == (5, 4)


def test_pictures_of_other_sizes_or_pixels_are_told_apart_by_their_headers(tmp_path, monkeypatch):
    window(tmp_path / "a.exr", aspect=1.5)
    window(tmp_path / "wide.exr", aspect=2.0)
    window(tmp_path / "small.exr", ((0, 0), (3, 3)), ((0, 0), (3, 3)), aspect=1.5)
    image.check_same_frames([tmp_path / "a.exr", tmp_path / "a.exr"])
    for other, words in (
        ("wide", "wide.exr has 5 × 4 pixels, each 2 times as wide as it is high and .*a.exr has 5 × 4 pixels, each 1.5 times"),
        ("small", "small.exr has 4 × 4 pixels, each 1.5 .* and .*a.exr has 5 × 4 pixels.*: compare pictures of the same size"),
    ):
        with pytest.raises(InputError, match=words):
            image.check_same_frames([tmp_path / "a.exr", tmp_path / f"{other}.exr"])


def test_a_picture_that_states_square_pixels_may_have_others(tmp_path):
    """Blender 4.2 writes an aspect of 1 of pictures whose pixels are 1.5 times as wide as high."""
    for name, aspect in (("stated", 1.5), ("not", 1.0)):
        window(tmp_path / f"{name}.exr", aspect=aspect)
    image.check_same_frames([tmp_path / "stated.exr", tmp_path / "not.exr"])
    image.check_same_frames([tmp_path / "not.exr", tmp_path / "stated.exr"])


def test_a_picture_says_the_shape_of_its_cameras_pixels_to_a_rounding_of_float32(tmp_path):
    """3 : 2 as Blender has it: widths of which two make three heights, so that across there are fewer to the view plane."""
    passes = {"Depth": np.ones((4, 5, 1), np.float32)}
    camera = Pinhole((0, -1, 0), (0, 0, 0), (0, 0, 1), (100.0 / 3, 50.0), 5, 4)
    image.write(tmp_path / "a.exr", image.Image(passes, camera))
    window(tmp_path / "same.exr", ((0, 0), (4, 3)), ((0, 0), (4, 3)), aspect=1.5)
    window(tmp_path / "off.exr", ((0, 0), (4, 3)), ((0, 0), (4, 3)), aspect=1.50001)
    image.check_same_frames([tmp_path / "a.exr", tmp_path / "same.exr"])
    with pytest.raises(InputError, match=r"each 1\.50001 times as wide"):
        image.check_same_frames([tmp_path / "a.exr", tmp_path / "off.exr"])


def test_what_takes_more_memory_than_there_is_is_refused_by_its_header(tmp_path, monkeypatch):
    """64 MiB of zeros, which are 60 kB as they are packed."""
    monkeypatch.setattr(machine, "most", lambda: 100 * 2**20)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"ViewLayer.Depth.Z": np.zeros((4096, 4096), np.float32)}).write(str(tmp_path / "a.exr"))
    tracemalloc.start()
    with pytest.raises(InputError, match=r"a\.exr need 0\.125 GiB of memory and there are 0\.0977 GiB: render it smaller"):
        image.read(tmp_path / "a.exr")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**20, f"{peak} bytes were taken"


def test_a_deep_picture_and_channels_of_fewer_pixels_are_refused(tmp_path):
    deep(tmp_path / "deep.exr")
    with pytest.raises(InputError, match="several depths in each pixel"):
        image.read(tmp_path / "deep.exr")
    window(tmp_path / "half.exr", ((0, 0), (3, 3)), ((0, 0), (3, 3)))
    data = (tmp_path / "half.exr").read_bytes()
    start = data.index(b"ViewLayer.Depth.Z\0") + len(b"ViewLayer.Depth.Z\0") + 8
    (tmp_path / "half.exr").write_bytes(data[:start] + b"\2\0\0\0" * 2 + data[start + 8 :])
    with pytest.raises(InputError, match="channels of less than all pixels"):
        image.read(tmp_path / "half.exr")


@pytest.mark.parametrize("camera", ["[" * 100_000, "9" * 5000, "[]", '{"eye": 1}', '{"distance": [[1]]}', "NaN", "\udce9"])
def test_a_camera_that_is_none_is_told_in_a_sentence(tmp_path, camera):
    passes = {"ViewLayer.Depth.Z": np.zeros((4, 5), np.float32)}
    OpenEXR.File({"virtualPinhole": camera.encode("utf-8", "replace").decode()}, passes).write(str(tmp_path / "a.exr"))
    with pytest.raises(InputError, match=r"has a camera attribute that can't be read .*: render it again"):
        image.read(tmp_path / "a.exr")


def test_a_camera_of_another_size_is_refused_by_the_header(tmp_path):
    image.write(tmp_path / "a.exr", Image({"Depth": np.zeros((2, 3, 1), np.float32)}, CAMERA))
    with pytest.raises(InputError, match=r"a\.exr has 3 × 2 pixels and its camera 5 × 4: render it again"):
        image.read(tmp_path / "a.exr")


def test_names_that_are_not_utf_8_are_told_in_a_sentence(tmp_path):
    image.write(tmp_path / "a.exr", Image(numbered(), CAMERA))
    data = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "a.exr").write_bytes(data.replace(b"ViewLayer.Depth.Z", b"ViewLayer.D\xff\xfeth.Z"))
    with pytest.raises(InputError, match=r"a\.exr .*can't be read.*: render it again"):
        image.read(tmp_path / "a.exr")


def test_a_device_is_no_picture():
    with pytest.raises(InputError, match=r"[/\\]dev[/\\]zero is no file"):
        image.read("/dev/zero")


def test_nothing_is_left_where_the_folder_can_not_be_written(tmp_path):
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(InputError, match="can't be written"):
        image.write(tmp_path / "file" / "a.exr", Image(numbered()))
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


KINDS = {(1, 8): 0, (2, 8): 4, (3, 8): 2, (4, 8): 6, (1, 16): 0, (3, 16): 2, (4, 16): 6}
"""(channels, bits) → the kind of color."""


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def filtered(pixels, filters):
    """A PNG each row of which has the filter that is named, by the specification's section 9.2."""
    height, width, channels = pixels.shape
    step = channels * pixels.itemsize
    raw = pixels.astype(pixels.dtype.newbyteorder(">")).view(np.uint8).reshape(height, -1).astype(int)
    rows, above = [], np.zeros(width * step, int)
    for row, number in zip(raw, filters, strict=True):
        left, corner = (np.concatenate([np.zeros(step, int), each[:-step]]) for each in (row, above))
        p = left + above - corner
        to_left, to_above, to_corner = np.abs(p - left), np.abs(p - above), np.abs(p - corner)
        nearest = (to_left <= to_above) & (to_left <= to_corner)
        paeth = np.where(nearest, left, np.where(to_above <= to_corner, above, corner))
        guess = [0 * row, left, above, (left + above) // 2, paeth][number]
        rows.append(bytes([number]) + ((row - guess) & 255).astype(np.uint8).tobytes())
        above = row
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.itemsize, KINDS[channels, 8 * pixels.itemsize], 0, 0, 0)
    data = zlib.compress(b"".join(rows))
    half = len(data) // 2
    parts = (b"IHDR", header), (b"tEXt", b"a\0b"), (b"IDAT", data[:half]), (b"IDAT", data[half:]), (b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunk(*part) for part in parts)


@given(
    st.sampled_from(sorted(KINDS)), st.integers(1, 7), st.lists(st.integers(0, 4), min_size=1, max_size=8), st.integers(0, 99)
)
def test_every_filter_is_undone_as_opencv_undoes_it(kind, width, filters, seed):
    cv2 = pytest.importorskip("cv2")
    channels, bits = kind
    shape = (len(filters), width, channels)
    pixels = np.random.default_rng(seed).integers(0, 2**bits, shape).astype(f"u{bits // 8}")
    content = filtered(pixels, filters)
    decoded = png.decoded(content)
    assert decoded.dtype == pixels.dtype and np.array_equal(decoded, pixels)
    if channels != 2:
        theirs = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED).reshape(shape)
        order = {1: [0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[channels]
        assert np.array_equal(decoded, theirs[..., order])


@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (5, 7, 4)])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_our_own_come_back(shape, kind):
    pixels = np.random.default_rng(1).integers(0, np.iinfo(kind).max, shape, dtype=kind, endpoint=True)
    assert np.array_equal(png.decoded(png.encoded(pixels)).reshape(shape), pixels)


def test_what_is_damaged_or_another_png_is_a_value_error():
    whole = filtered(np.arange(48, dtype=np.uint8).reshape(4, 4, 3), [0, 1, 3, 4])
    palette = png.encoded(np.zeros((4, 4), np.uint8), bytes(6))
    for content in (b"", b"no picture", palette, whole[:20], *(whole[:cut] for cut in range(8, len(whole) - 12, 7))):
        with pytest.raises(ValueError):
            png.decoded(content)
    largest = whole[:16] + b"\xff" * 8 + whole[24:]
    with pytest.raises(ValueError):
        png.decoded(largest)
    dice = random.Random(1)
    for _ in range(500):
        mutant = bytearray(whole)
        for _ in range(dice.randint(1, 4)):
            mutant[dice.randrange(len(mutant))] = dice.randrange(256)
        try:
            decoded = png.decoded(bytes(mutant))
        except ValueError:
            continue
        assert decoded.ndim == 3 and decoded.nbytes < 10**6
