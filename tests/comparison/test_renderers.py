"""Pictures made elsewhere: less than all passes is judged as far as it goes, and what an engine encodes is read back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon import image
from viewcam_addon.comparison import renderers
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.errors import InputError
from viewcam_addon.image import BACKGROUND_DEPTH, Image


def only(picture, *names):
    """The picture with these passes alone; Distance is made of its Position."""
    passes = dict(picture.passes)
    away = np.linalg.norm(picture["Position"].astype(float) - picture.camera.eye, axis=-1, keepdims=True)
    passes["Distance"] = np.where(picture["Depth"] < BACKGROUND_DEPTH, away, 0.0).astype(np.float32)
    return replace(picture, passes={name: passes[name] for name in names})


def judged(scene, test, **options):
    return compare(scene.picture(), test, scene.pinhole, scene.surfaces_at, partial=True, **options)


ENOUGH = [("Depth",), ("Distance",), ("Position",), ("Position", "Depth", "Object Index"), ("Distance", "Normal")]


@pytest.mark.parametrize("names", ENOUGH)
def test_each_of_depth_distance_and_position_is_enough_and_only_what_is_there_is_judged(names, paper_scene):
    comparison = judged(paper_scene, only(paper_scene.rendered(), *names))
    assert comparison.passed, "\n".join(comparison.lines())
    present = {"Depth" if name == "Distance" else name for name in names}
    assert {row.name for row in comparison.rows} - {"Position depth"} == present - {"Object Index"}
    assert present | set(comparison.lacking) == {"Depth", "Position", "Normal", "UV", "Object Index", "Material Index"}


@pytest.mark.parametrize("names", ENOUGH)
@pytest.mark.parametrize("off", [(0.02, 0.0), (0.0, -0.02)])
def test_a_fiftieth_of_a_pixel_is_found_by_each_of_them(names, off, paper_scene):
    moved = paper_scene.picture(0.5 + off[0], 0.5 + off[1])
    comparison = compare(paper_scene.picture(), only(moved, *names), paper_scene.pinhole, partial=True)
    assert not all(row.ok for row in comparison.rows) or len(comparison.mismatches.kinds) > 1000, comparison.sentence


@pytest.mark.parametrize(("name", "taken_for"), [("Distance", "Depth"), ("Depth", "Distance")])
@pytest.mark.parametrize("others", [(), ("Position",)])
def test_a_distance_that_is_taken_for_the_depth_is_told_and_so_is_the_other_way_round(name, taken_for, others, paper_scene):
    test = only(paper_scene.rendered(), name, *others)
    mistaken = {taken_for: test[name], **{other: test[other] for other in others}}
    comparison = judged(paper_scene, replace(test, passes=mistaken))
    assert not comparison.passed
    assert f": {taken_for} is the " in comparison.sentence and f"give it as {name.lower()}" in comparison.sentence


def test_a_depth_that_is_off_otherwise_is_no_distance(paper_scene):
    test = only(paper_scene.rendered(), "Depth")
    comparison = judged(paper_scene, replace(test, passes={"Depth": test["Depth"] * np.float32(1.01)}))
    assert not comparison.passed and "give it as" not in comparison.sentence, comparison.sentence


@pytest.mark.parametrize("name", ["Depth", "Distance"])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda depth: -depth, "below 0, as counted against the view"),
        (lambda depth: depth * 1000, "is 1,000 times the reference's, as in another unit"),
        (lambda depth: depth * 0.3048, "is 0.3048 times the reference's"),
        (lambda depth: np.where(depth == 0, 200, depth), "is 200 where nothing is: write 0"),
        (lambda depth: np.where(depth == 0, 1, depth), "is 1 where nothing is: write 0"),
        (lambda depth: np.where(depth == 0, 0, 0.2 + 2 * depth), "is in another scale"),
        (lambda depth: depth[::-1], "the picture looks upside down"),
        (lambda depth: depth[:, ::-1], "the picture looks mirrored left to right"),
        (lambda depth: depth[::-1, ::-1], "the picture looks turned by half a turn"),
    ],
)
def test_a_depth_that_is_written_otherwise_is_told_how(change, words, name, paper_scene):
    test = only(paper_scene.rendered(), name)
    depth = np.where(test[name] >= BACKGROUND_DEPTH, 0, test[name])
    comparison = judged(paper_scene, replace(test, passes={name: change(depth).astype(np.float32)}))
    assert not comparison.passed and words in comparison.sentence, comparison.sentence


@pytest.mark.parametrize("scale", [lambda inverse: 110 * inverse, lambda inverse: 1 - 0.1 * inverse])
def test_disparities_and_the_depths_of_a_depth_buffer_are_told(scale, paper_scene):
    depth = paper_scene.rendered()["Depth"].astype(float)
    scaled = np.where(depth < BACKGROUND_DEPTH, scale(1 / depth), 0).astype(np.float32)
    assert "Depth is in a scale of 1/depth" in judged(paper_scene, Image({"Depth": scaled})).sentence


OF_CAMERA = "in the camera's axes: give it in world space"


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("Position", lambda position, _: 100 * position, "Position is 100 times (x, y, z) of the reference's"),
        ("Position", lambda position, _: position[..., (0, 2, 1)] * (1, 1, -1), "Position is (x, z, -y) of the reference's"),
        ("Position", lambda position, _: 0.01 * position[..., ::-1], "Position is 0.01 times (z, y, x) of the reference's"),
        ("Position", lambda position, camera: (position - camera.eye) @ np.array(camera.basis()).T, OF_CAMERA),
        ("Normal", lambda normal, camera: normal @ (np.array(camera.basis()) * [[1], [-1], [-1]]).T, OF_CAMERA),
        ("Normal", lambda normal, _: normal[..., (0, 2, 1)] * (1, 1, -1), "Normal is (x, z, -y) of the reference's"),
        ("Normal", lambda normal, _: 0.5 + 0.5 * normal, "Normal runs from 0 to 1"),
        ("Normal", lambda normal, _: -normal, "turn it towards the eye"),
        ("Object Index", lambda index, _: index + 1, "Object Index has other numbers for the same, as 2 for 1"),
    ],
)
def test_a_pass_in_another_space_unit_or_numbering_is_told_which(name, change, words, paper_scene):
    """Positions with y up were said to look upside down, and those in centimeters to be magnified."""
    test = only(paper_scene.rendered(), "Position", "Normal", "Object Index")
    hit = paper_scene.picture()["Depth"] < BACKGROUND_DEPTH
    changed = np.where(hit, change(test[name].astype(float), test.camera), 0).astype(np.float32)
    comparison = judged(paper_scene, replace(test, passes=test.passes | {name: changed}))
    assert not comparison.passed and words in comparison.sentence, comparison.sentence


def test_objects_that_are_taken_for_one_another_here_and_there_have_the_scenes_numbers(paper_scene):
    test = only(paper_scene.rendered(), "Position", "Object Index")
    index = test["Object Index"].copy()
    index[:20] = 0
    assert "other numbers" not in judged(paper_scene, replace(test, passes=test.passes | {"Object Index": index})).sentence


def test_positions_turned_by_half_a_turn_are_told(paper_scene):
    test = only(paper_scene.rendered(), "Position")
    comparison = judged(paper_scene, replace(test, passes={"Position": test["Position"][::-1, ::-1]}))
    assert "turned by half a turn" in comparison.sentence, comparison.sentence


@pytest.mark.parametrize("name", ["Depth", "Position"])
def test_a_pass_in_half_floats_is_told(name, paper_scene, tmp_path):
    """A depth of 11 bits was said to see another surface."""
    openexr = pytest.importorskip("OpenEXR")
    test = only(paper_scene.rendered(), name)
    channels = {f"{name}.{i}": np.ascontiguousarray(test[name][::-1, :, i]) for i in range(test[name].shape[2])}
    halves = {key: np.minimum(values, 65504).astype(np.float16) for key, values in channels.items()}
    openexr.File({}, halves).write(str(tmp_path / "half.exr"))
    comparison = judged(paper_scene, image.read_channels(tmp_path / "half.exr", {name: list(channels)}))
    assert f"{name} is in half floats, of 11 bits: write 32 bits" in comparison.sentence, comparison.sentence


def test_a_note_of_another_program_that_looks_like_ours_is_told(tmp_path):
    picture = Image({"Depth": np.ones((2, 2, 1), np.float32)}, attributes={renderers.NOTE: f"{renderers.MARK} WORKBENCH near"})
    image.write(tmp_path / "a.exr", picture)
    with pytest.raises(InputError, match="its depths begin at 'near', which is no number"):
        renderers.read(tmp_path / "a.exr")


def test_a_compression_that_changes_positions_is_told(paper_scene, tmp_path):
    """A picture in DWAA was said to be magnified."""
    openexr = pytest.importorskip("OpenEXR")
    test = only(paper_scene.rendered(), "Position")
    channels = {f"Position.{letter}": np.ascontiguousarray(test["Position"][::-1, :, i]) for i, letter in enumerate("XYZ")}
    openexr.File({"compression": openexr.DWAA_COMPRESSION}, channels).write(str(tmp_path / "a.exr"))
    comparison = judged(paper_scene, image.read_channels(tmp_path / "a.exr", {"Position": list(channels)}))
    assert "the test picture is compressed with loss (DWAA): write it with ZIP" in comparison.sentence, comparison.sentence


def test_with_a_position_alone_a_moved_ball_is_found(paper_scene):
    other = replace(paper_scene, spheres=((0.001, 0.0, 1.0, 1.0), *paper_scene.spheres[1:]))
    assert not judged(paper_scene, only(other.picture(), "Position")).passed


def test_all_passes_are_asked_of_cycles(paper_scene):
    with pytest.raises(InputError, match="has no pass 'Normal'"):
        compare(paper_scene.picture(), only(paper_scene.rendered(), "Depth", "Position"), paper_scene.pinhole)


@pytest.mark.parametrize("nothing", [0.0, np.inf, 1e10, 3e38, -1.0, 65504.0, -np.inf, np.nan])
def test_nothing_is_nothing_however_a_renderer_writes_it(nothing, paper_scene):
    reference = paper_scene.picture()
    missed = reference["Depth"] >= BACKGROUND_DEPTH
    assert missed.any()
    depth = np.where(missed, np.float32(nothing), reference["Depth"])
    actual = renderers.completed(Image({"Depth": depth}), paper_scene.pinhole)
    assert (actual["Depth"] == reference["Depth"]).all() and (actual["Position"][missed[..., 0]] == 0).all()


@pytest.mark.parametrize("nothing", [0.0, np.inf, 1e10, np.nan])
@pytest.mark.parametrize("names", [("Depth",), ("Distance",), ("Position",), ("Depth", "Distance", "Position", "Normal")])
def test_pictures_are_the_same_whatever_their_passes_hold_where_nothing_is(names, nothing, paper_scene):
    """Depth and Position together were taken as they are, and a distance of 1e10 for a surface at that depth."""
    picture = only(paper_scene.rendered(), *names)
    missed = paper_scene.picture()["Depth"] >= BACKGROUND_DEPTH
    passes = {name: np.where(missed, np.float32(nothing), values) for name, values in picture.passes.items()}
    comparison = judged(paper_scene, replace(picture, passes=passes))
    assert comparison.passed, comparison.sentence
    passes = {
        name: np.where(missed & (np.arange(missed.shape[1]) == 7)[:, None], 5.0, values) for name, values in passes.items()
    }
    wrong = judged(paper_scene, replace(picture, passes={name: values.astype(np.float32) for name, values in passes.items()}))
    assert not wrong.passed and "of coverage" in wrong.sentence, "a column of it is said to be a surface"


def test_what_is_no_number_beside_what_is_nothing_is_not_the_same(paper_scene):
    test = only(paper_scene.rendered(), "Depth")
    sky = np.argwhere(test["Depth"][..., 0] >= BACKGROUND_DEPTH)[0]
    test["Depth"][*sky] = np.nan
    assert "not a number" in judged(paper_scene, test).sentence


def test_the_scene_is_not_asked_for_where_it_is_given(paper_scene):
    """No ray explains a pixel without a number, and the sentence said: give the scene too."""
    test = paper_scene.rendered()
    test["Position"][50, 50:60] = np.nan
    sentence = compare(paper_scene.picture(), test, paper_scene.pinhole, paper_scene.surfaces_at).sentence
    assert "give the scene" not in sentence and "holds no number" in sentence


@given(values=st.lists(st.floats(-60000, 60000, width=32), min_size=3, max_size=3), index=st.integers(0, 32767))
def test_halves_add_up_to_what_was_written(values, index):
    """The shader parts them so: the nearest whole steps first, each part kept as half a float."""
    written = {"Position": np.array(values), "Normal": np.array(values) / 60000, "Object Index": np.full(3, float(index))}
    passes = {"Combined": np.ones((1, 1, 4), np.float32)}
    for name, rest in written.items():
        rest = rest.astype(np.float32)
        for part, step in zip(renderers.part_names(name), (*renderers.PARTS[name], None), strict=True):
            kept = rest if step is None else np.floor((rest + np.float32(step / 2)) / np.float32(step)) * np.float32(step)
            rest = rest - kept
            passes[part] = kept.astype(np.float16).astype(np.float32).reshape(1, 1, 3)
    actual = renderers._decoded(Image(passes), "EEVEE")
    assert actual["Object Index"] == index
    step = 2.0**-24  # half floats have no finer one
    assert np.abs(actual["Position"] - written["Position"]).max() <= step + 2.0**-24 * np.abs(written["Position"]).max()
    assert np.abs(actual["Normal"] - written["Normal"]).max() <= 2.0**-21


@given(index=st.integers(0, 32767))
def test_a_color_holds_an_index_and_half_a_float_of_it_does(index):
    digits = [index // renderers.DIGITS**place % renderers.DIGITS / renderers.DIGITS for place in range(3)]
    # Workbench's pictures are halves, now and then the next lower one.
    color = np.nextafter(np.array([*digits, 1.0], np.float16), np.float16(0)).astype(np.float32).reshape(1, 1, 4)
    picture = Image({"Combined": color, "Depth": np.full((1, 1, 1), 5.0, np.float32)})
    assert renderers._decoded(picture, "WORKBENCH")["Object Index"] == index


def test_an_edge_that_a_rasterizer_moves_is_explained_and_no_farther_one(paper_scene):
    edges = renderers.RENDERERS["EEVEE"].edges

    def shifted(off):
        """Its edges alone: where another object is seen than through the center, what is seen beside it."""
        exact, beside = paper_scene.picture(), paper_scene.picture(0.5 + off, 0.5)
        other = exact["Object Index"] != beside["Object Index"]
        passes = {name: np.where(other, beside[name], exact[name]) for name in ("Position", "Normal", "Object Index")}
        return judged(paper_scene, replace(exact, passes=passes), renderer=renderers.RENDERERS["EEVEE"])

    near, far = shifted(0.7 * edges), shifted(0.2)
    assert near.passed and len(near.mismatches.kinds) >= 1, near.sentence
    assert far.mismatches.unexplained_count > 5


def test_channels_are_found_by_their_whole_name_or_its_end_and_others_are_named(tmp_path):
    import OpenEXR

    numbers = np.arange(12, dtype=np.float32).reshape(3, 4)
    channels = {name: numbers + i for i, name in enumerate(("aov.P.X", "aov.P.Y", "aov.P.Z", "Z", "left.Z"))}
    path = tmp_path / "a.exr"
    OpenEXR.File({}, channels).write(str(path))
    read = image.read_channels(path, {"Position": ["P.X", "P.Y", "P.Z"], "Depth": ["Z"]})
    assert (read["Position"][0, 0] == numbers[-1, 0] + np.arange(3)).all() and (
        read["Depth"][..., 0] == numbers[::-1] + 3
    ).all()
    with pytest.raises(InputError, match=r"no channel 'P.W': name some of .*aov\.P\.X"):
        image.read_channels(path, {"Depth": ["P.W"]})
    with pytest.raises(InputError, match=r"several channels 'Q': name one of a\.Q, b\.Q"):
        OpenEXR.File({}, {"a.Q": numbers, "b.Q": numbers}).write(str(path))
        image.read_channels(path, {"Depth": ["Q"]})
