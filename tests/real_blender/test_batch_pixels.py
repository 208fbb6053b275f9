"""A batch's pictures are those of `blender -b FILE -f N`, to the bit in every channel: what a pipeline rendered before it."""

import numpy as np
import OpenEXR
import pytest

SCENES = "sample_scenes"
# Small, few samples, 32 bits; everything else as the artist has it.
SMALL = """
import bpy
scene = bpy.context.scene
render, file = scene.render, scene.render.image_settings
render.resolution_x, render.resolution_y, render.resolution_percentage = 96, 54, 100
render.engine, scene.cycles.samples, scene.virtual_pinhole_reference.samples = {engine!r}, 2, 2
scene.view_layers[0].use_pass_z = scene.view_layers[0].use_pass_normal = True
file.media_type, file.file_format, file.color_depth = "MULTI_LAYER_IMAGE", "OPEN_EXR_MULTILAYER", "32"
bpy.ops.wm.save_as_mainfile(filepath={blend!r})
"""


def channels(path):
    parts = OpenEXR.File(str(path), separate_channels=True).parts
    return {name: channel.pixels for part in parts for name, channel in part.channels.items()}


@pytest.mark.parametrize("engine", ["CYCLES", "VIEWCAM"])
@pytest.mark.parametrize("name", ["flight", "studio"])
def test_frames_of_a_batch_are_those_of_f(real_blender, tmp_path, name, engine):
    """Of a camera that moves by its keyed values (flight), and of one that stands (studio)."""
    blend, frames = tmp_path / "small.blend", (3, 40)
    script = SMALL.format(engine=engine, blend=str(blend))
    check(real_blender.run("-b", f"{SCENES}/{name}.blend", "--python-exit-code", "9", "--python-expr", script))
    check(real_blender.run("-b", blend, "-o", tmp_path / "f_###", "-f", "{},{}".format(*frames)))
    shots = tmp_path / "shots.csv"
    camera = "import bpy; print('CAMERA', bpy.context.scene.camera.name)"
    said = real_blender.run("-b", blend, "--python-expr", camera).stdout
    (camera,) = [line.removeprefix("CAMERA ") for line in said.splitlines() if line.startswith("CAMERA ")]
    # Backwards and once more: what is kept from one frame is in the way of another, if it is.
    rows = [f"{place}_{frame:03},{camera},{frame}" for place, frame in enumerate((*frames, frames[0]))]
    shots.write_text("\n".join(["name,camera,frame", *rows]))
    check(real_blender.run("-b", blend, "--command", "viewcam", "batch", shots, "--out", tmp_path / "batch"))
    for place, frame in enumerate((*frames, frames[0])):
        one, other = channels(tmp_path / f"f_{frame:03}.exr"), channels(tmp_path / "batch" / f"{place}_{frame:03}.exr")
        assert one.keys() == other.keys() and len(one) >= 8
        others = {key: int((one[key] != other[key]).sum()) for key in one if not np.array_equal(one[key], other[key])}
        assert not others, f"frame {frame}: pixels that differ, by channel: {others}"
    first, second = (channels(tmp_path / f"f_{frame:03}.exr") for frame in frames)
    if name == "flight":
        assert any(not np.array_equal(first[key], second[key]) for key in first), "two frames are one picture"


def check(outcome):
    assert outcome.returncode == 0, outcome.stdout + outcome.stderr
