"""Each fifth of a flight's 250 frames in a real Blender: live, by F12, and baked without the add-on, all the same picture.

Eye, look-at, up and d are keyed, a target moves, and both cameras pass straight down: one with canonical axes, one with its
roll held (flight_in_blender.py).
"""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from viewcam_addon import image
from viewcam_addon.comparison import tolerances
from viewcam_addon.comparison.cameras import conversion_error
from viewcam_addon.pinhole import Pinhole

SCRIPT = Path(__file__).with_name("flight_in_blender.py")
FRAMES = range(3, 251, 5)
RENDERED = ("-s", "3", "-e", "250", "-j", "5", "-a")
STRAIGHT_DOWN = (63, 188)
WITHOUT_ADDON = (
    "import bpy; assert not hasattr(bpy.types.Object, 'virtual_pinhole'); assert not bpy.app.handlers.frame_change_post"
)


def run(blender, *arguments):
    """Run the script, or Blender itself, and fail with what it says."""
    outcome = blender.run("-b", "--factory-startup", "--python-exit-code", "9", *arguments)
    output = outcome.stdout + outcome.stderr
    assert outcome.returncode == 0 and "Traceback" not in output, output
    return output


@pytest.fixture(scope="module")
def flight(real_blender, tmp_path_factory):
    """{way: {frame: Image}} of the ways to render, {frame: (stated, live)} Pinholes of those and of all frames, and what the
    report of the bake says.
    """
    folder = tmp_path_factory.mktemp("flight")
    file, baked = folder / "flight.blend", folder / "baked.blend"
    for way in ("live", "f12", "baked"):
        (folder / way).mkdir()
    run(real_blender, "--python", SCRIPT, "--", "make", file, folder / "pinholes.json")
    addon = ("--addons", "bl_ext.user_default.virtual_pinhole")
    run(real_blender, *addon, file, "-o", folder / "live" / "####", *RENDERED)
    run(real_blender, "--python", SCRIPT, "--", "render", file, folder / "f12")
    report = run(real_blender, "--python", SCRIPT, "--", "bake", file, baked)
    run(real_blender, baked, "--python-expr", WITHOUT_ADDON, "-o", folder / "baked" / "####", *RENDERED)
    pictures = {
        way: {frame: image.read(folder / way / f"{frame:04d}.exr") for frame in FRAMES} for way in ("live", "f12", "baked")
    }
    known = json.loads((folder / "pinholes.json").read_text())
    pinholes = {int(frame): [Pinhole(**each) for each in both] for frame, both in known.items()}
    return pictures, {frame: pinholes[frame] for frame in FRAMES}, pinholes, report


def places(pinhole, picture):
    """(n, 2) where each pixel's position lies in the picture of a pinhole, and (n,) how far one rounding moves it."""
    seen = {name: picture.passes[name].reshape(-1, picture.passes[name].shape[-1]) for name in ("Position", "Depth", "Normal")}
    assert tolerances.is_hit(seen).all()
    column, row, _ = pinhole.project(seen["Position"].astype(np.float64))
    actual = np.nan_to_num(np.column_stack([column, row]), nan=-pinhole.width)  # behind the eye: outside of the picture
    return actual, tolerances.position_shift(pinhole, seen)


def roundings(pinhole, picture):
    """(n,) of how many roundings of float32 each pixel's position is off."""
    actual, one_rounding = places(pinhole, picture)
    rows, columns = np.divmod(np.arange(len(actual)), pinhole.width)
    return np.linalg.norm(actual - np.column_stack([columns, rows]) - 0.5, axis=1) / one_rounding


def beyond_the_tolerance(pictures, pinholes):
    """The shares that are not within tolerance over all frames, in words; empty where all are."""
    counts = np.concatenate([roundings(pinholes[frame], pictures[frame]) for frame in pinholes])
    values = np.percentile(counts, tolerances.PERCENTILES)
    return [
        f"{count:.2f} roundings at the {percentile}th percentile, {most} are allowed"
        for percentile, count, most in zip(tolerances.PERCENTILES, values, tolerances.ROUNDINGS, strict=True)
        if count > most
    ]


@pytest.mark.parametrize("way", ["live", "f12", "baked"])
def test_each_way_to_render_the_flight_is_within_the_tolerance(flight, way):
    pictures, pinholes, _, _ = flight
    assert len(pictures[way]) == len(pinholes) == 50
    live = {frame: live for frame, (_, live) in pinholes.items()}
    assert beyond_the_tolerance(pictures[way], live) == []


def test_the_baked_file_and_f12_render_what_is_rendered_live(flight):
    """Each may be off by its tolerance, in opposite directions. In fact all pixels had the same position in all bits."""
    pictures, pinholes, _, _ = flight
    for way in ("f12", "baked"):
        same = 0
        for frame in FRAMES:
            live, other = pictures["live"][frame], pictures[way][frame]
            same += int((live.passes["Position"] == other.passes["Position"]).all(axis=-1).sum())
            (first, one_rounding), (two, _) = (places(pinholes[frame][1], each) for each in (live, other))
            apart = (np.linalg.norm(first - two, axis=1) / one_rounding).max()
            assert apart <= 2 * tolerances.ROUNDINGS[-1], f"{way}, frame {frame}: {apart:.2g} roundings apart"
        print(f"{way}: {same} of {len(FRAMES) * len(first)} pixels have the same position in all bits")


def test_the_live_camera_is_the_one_that_is_stated(flight):
    _, _, pinholes, _ = flight
    for frame, (stated, live) in pinholes.items():
        error = conversion_error(stated, live, np.array([np.linalg.norm(np.subtract(stated.eye, stated.look_at))]))
        assert error.ok, f"frame {frame}: {error.largest:.1e} px, and {error.tolerance:.1e} are rounding"
    straight_down = [frame for frame, (stated, _) in pinholes.items() if stated.eye[:2] == stated.look_at[:2]]
    assert straight_down == [*STRAIGHT_DOWN]


def test_a_flight_that_is_a_frame_late_is_beyond_the_tolerance(flight):
    pictures, _, pinholes, _ = flight
    late = {frame: pinholes[frame - 1][1] for frame in FRAMES}
    assert beyond_the_tolerance(pictures["baked"], late)


def test_a_thousandth_of_the_distance_is_beyond_the_tolerance(flight):
    pictures, pinholes, _, _ = flight
    zoomed = {
        frame: dataclasses.replace(live, distance=tuple(1.001 * each for each in live.distance))
        for frame, (_, live) in pinholes.items()
    }
    assert beyond_the_tolerance(pictures["baked"], zoomed)


def test_a_single_frame_of_the_flight_that_is_turned_is_beyond_the_tolerance(flight):
    """Straight down with the roll held: canonical axes there would be another picture."""
    pictures, pinholes, _, _ = flight
    frame = STRAIGHT_DOWN[1]
    live = {each: live for each, (_, live) in pinholes.items()}
    stated, held = pinholes[frame][0], live[frame]
    canonical = dataclasses.replace(held, look_at=(*held.eye[:2], 0.0), up=(0.0, 0.0, 1.0))
    assert stated.basis()[1] @ canonical.basis()[1] < 0.9, "the roll that is held happens to be the canonical one"
    assert beyond_the_tolerance(pictures["baked"], live | {frame: canonical})


def test_the_report_says_how_close_the_keyframes_are(flight):
    *_, report = flight
    lines = [line for line in report.splitlines() if "off the live camera at the keyframes" in line]
    print("\n".join(lines))
    assert len(lines) == 2 and all(line.startswith("Info: Baked ") for line in lines), report
