"""A check must be able to fail: every fault that a camera or a renderer can have makes the comparison fail."""

from dataclasses import replace

import numpy as np
import pytest

from viewcam_addon.comparison.geometry import compare

pytestmark = pytest.mark.slow

PASSES = ("Depth", "Position", "Normal", "UV", "Object Index", "Material Index")


def changed(image, **changes):
    """The picture with some passes put through a function; underscores stand for blanks in their names."""
    passes = dict(image.passes)
    for name, change in changes.items():
        passes[name.replace("_", " ")] = change(passes[name.replace("_", " ")].copy())
    return replace(image, passes=passes)


def everywhere(image, change):
    return replace(image, passes={name: change(values) for name, values in image.passes.items()})


def with_hole(image, background):
    """A disc of background amid the picture."""
    rows, columns = np.mgrid[: image.size[1], : image.size[0]]
    inside = (rows - image.size[1] / 3) ** 2 + (columns - image.size[0] / 2) ** 2 < 3**2
    passes = {name: values.copy() for name, values in image.passes.items()}
    for name, values in passes.items():
        values[inside] = background.get(name, 0.0)
    return replace(image, passes=passes)


def rolled(pinhole, angle):
    u, v, _ = pinhole.basis()
    return replace(pinhole, up=tuple(np.cos(angle) * v + np.sin(angle) * u))


def swap(a, b):
    def swapped(values):
        values[..., [a, b]] = values[..., [b, a]]
        return values

    return swapped


def one_nan(values):
    values[values.shape[0] // 3, values.shape[1] // 2, 0] = np.nan
    return values


def renumbered(values):
    values[values == 2] = 7
    return values


def moved_sphere(scene, step):
    (x, y, z, radius), *others = scene.spheres
    return replace(scene, spheres=((x + step[0], y + step[1], z + step[2], radius), *others))


# name → what a renderer with this fault writes. The cameras' faults render the scene anew; the files' faults change the arrays.
CAMERA_FAULTS = {
    "half a pixel to the right": lambda s: s.picture(1.0, 0.5),
    "half a pixel down": lambda s: s.picture(0.5, 0.0),
    "a hundredth of a pixel": lambda s: s.picture(0.51, 0.5),
    "d by a tenth of a per cent": lambda s: s.seen_by(replace(s.pinhole, distance=s.pinhole.distance[0] * 1.001)).picture(),
    "sensor fitted to the other side": lambda s: s.seen_by(replace(s.pinhole, distance=300 * 320 / 200)).picture(),
    "pixel aspect ignored": lambda s: s.seen_by(replace(s.pinhole, distance=(300, 300 / 1.001))).picture(),
    "rolled by a milliradian": lambda s: s.seen_by(rolled(s.pinhole, 1e-3)).picture(),
    "eye moved by a millimeter": lambda s: s.seen_by(replace(s.pinhole, eye=(5.001, -7.0, 4.0))).picture(),
    "shift of the principal point": lambda s: s.seen_by(replace(s.pinhole, principal_point=(160.02, 100))).picture(),
    "mirrored by the camera": lambda s: s.seen_by(replace(s.pinhole, mirrored=True)).picture(),
    "one object moved across the view": lambda s: moved_sphere(s, (0.002, 0.001, 0.0)).rendered(),
    "one object moved along the view": lambda s: moved_sphere(s, (-0.0005, 0.0007, -0.0004)).rendered(),
    "one object missing": lambda s: replace(s, spheres=s.spheres[:2]).rendered(),
    "one object too many": lambda s: replace(s, spheres=(*s.spheres, (1.2, -1.8, 0.2, 0.2))).rendered(),
    "ten times the rounding": lambda s: s.rendered(roundings=3.5),
}
FILE_FAULTS = {
    "Position with X and Y swapped": lambda i: changed(i, Position=swap(0, 1)),
    "Position with Y and Z swapped": lambda i: changed(i, Position=swap(1, 2)),
    "Normal with Y and Z swapped": lambda i: changed(i, Normal=swap(1, 2)),
    "UV swapped": lambda i: changed(i, UV=swap(0, 1)),
    "rows flipped": lambda i: everywhere(i, lambda values: values[::-1]),
    "columns flipped": lambda i: everywhere(i, lambda values: values[:, ::-1]),
    "one row repeated": lambda i: everywhere(i, lambda values: np.concatenate([values[:60], values[59:60], values[61:]])),
    "picture moved by one pixel": lambda i: everywhere(i, lambda values: np.roll(values, 1, axis=1)),
    "Depth along the ray": lambda i: changed(i, Depth=lambda d: d * np.linspace(1, 1.2, d.size).reshape(d.shape).astype("f4")),
    "Depth in other units": lambda i: changed(i, Depth=lambda d: np.where(d < 1e10, d * np.float32(1.0001), d)),
    "Position twice as far from the origin": lambda i: changed(i, Position=lambda p: 2 * p),
    "Normal reversed": lambda i: changed(i, Normal=lambda n: -n),
    "Normal not of unit length": lambda i: changed(i, Normal=lambda n: 1.01 * n),
    "Normal empty": lambda i: changed(i, Normal=lambda n: 0 * n),
    "UV upside down": lambda i: changed(i, UV=lambda uv: uv * np.float32([1, -1, 1])),
    "Object Index renumbered": lambda i: changed(i, Object_Index=renumbered),
    "Material Index shifted by one": lambda i: changed(i, Material_Index=lambda index: index + (index > 0)),
    "a hole": lambda i: with_hole(i, {"Depth": 1e10}),
    "a hole in Depth only": lambda i: changed(
        i, Depth=lambda d: with_hole(replace(i, passes={"Depth": d}), {"Depth": 1e10})["Depth"]
    ),
    **{f"one NaN in {name}": lambda i, name=name: changed(i, **{name.replace(" ", "_"): one_nan}) for name in PASSES},
}


@pytest.fixture(scope="module")
def reference(paper_scene):
    return paper_scene.picture()


@pytest.fixture(scope="module")
def honest(paper_scene):
    return paper_scene.rendered()


def test_the_picture_without_a_fault_passes(paper_scene, reference, honest):
    comparison = compare(reference, honest, paper_scene.pinhole, paper_scene.surfaces_at)
    assert comparison.passed, "\n".join(comparison.lines())


@pytest.mark.parametrize("fault", CAMERA_FAULTS)
def test_a_fault_of_the_camera_or_the_scene_is_found(fault, paper_scene, reference):
    comparison = compare(reference, CAMERA_FAULTS[fault](paper_scene), paper_scene.pinhole, paper_scene.surfaces_at)
    assert not comparison.passed, f"{fault} went unnoticed:\n" + "\n".join(comparison.lines())
    assert comparison.sentence.startswith("Not the same picture: ")


@pytest.mark.parametrize("fault", FILE_FAULTS)
def test_a_fault_of_the_file_is_found(fault, paper_scene, reference, honest):
    comparison = compare(reference, FILE_FAULTS[fault](honest), paper_scene.pinhole, paper_scene.surfaces_at)
    assert not comparison.passed, f"{fault} went unnoticed:\n" + "\n".join(comparison.lines())
    assert comparison.sentence.startswith("Not the same picture: ")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("half a pixel to the right", "shifted by (+0.5, "),
        ("half a pixel down", ", -0.5) px"),
        ("d by a tenth of a per cent", "magnified by 0.999001 × 0.999001"),
        ("sensor fitted to the other side", "magnified by 0.625 × 0.625"),
        ("rolled by a milliradian", "rolled by "),
        ("mirrored by the camera", "mirrored left to right"),
    ],
)
def test_the_verdict_names_the_fault_of_the_camera(fault, words, paper_scene, reference):
    sentence = compare(reference, CAMERA_FAULTS[fault](paper_scene), paper_scene.pinhole, paper_scene.surfaces_at).sentence
    assert words in sentence, sentence


def test_two_empty_pictures_prove_nothing(paper_scene):
    away = paper_scene.seen_by(replace(paper_scene.pinhole, look_at=(5.0, -7.0, 9.0), up=(0.0, 1.0, 0.0)))
    comparison = compare(away.picture(), away.picture(), away.pinhole, away.surfaces_at)
    assert not comparison.passed
    assert comparison.sentence.startswith("Nothing to compare")
    assert comparison.to_json()["passed"] is False
