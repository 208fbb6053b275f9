"""A check must be able to fail, on Cycles' pictures too: each fault is made in Blender between export and render."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

import viewcam_addon
from viewcam_addon.blender import camera as cameras
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.comparison.geometry import compare
from viewcam_addon.image import Image
from viewcam_addon.jobs.job import Job
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.render import Tracer

pytestmark = pytest.mark.slow

STATED = Pinhole((6.0, -7.5, 4.5), (0.2, 0.1, 0.8), (0.0, 0.0, 1.0), 150.0, 120, 75)


def smooth():
    bpy.ops.object.shade_smooth()


@pytest.fixture
def still(fresh_blender):
    """A ground, a subdivided Suzanne, a ball and a box, numbered 1 to 4, before the stated camera."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = STATED.width, STATED.height
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=16, y_subdivisions=16, size=14)
    bpy.ops.mesh.primitive_monkey_add(size=2, location=(0, 0, 1.1), rotation=(-0.3, 0, 0.5))
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    smooth()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.7, location=(2, 0.5, 0.7))
    smooth()
    bpy.ops.mesh.primitive_cube_add(size=1, location=(-1.8, -1.2, 0.5), rotation=(0, 0, 0.4))
    for number, item in enumerate(scene.objects, start=1):
        material = bpy.data.materials.new(item.name)
        item.pass_index = material.pass_index = number
        item.data.materials.append(material)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    assert cameras.apply(camera, STATED, scene) == []
    return scene


@pytest.fixture
def compared(still, tmp_path):
    """A function that exports the scene, does something to it, has Cycles render it, and compares."""

    def make(fault=lambda scene: None, change=lambda passes: passes):
        exported = jobs.export(Job())
        tracer = Tracer(exported, 2)
        reference = Image(tracer.render(), exported.camera)
        fault(still)
        jobs.cycles(Job(threads=2), tmp_path / "cycles.exr")
        test = Image(change(read_outside(tmp_path / "cycles.exr")))
        return compare(reference, test, exported.camera, tracer.surfaces_at, exported.stated_camera)

    return make


def read_outside(path):
    """The passes of an EXR, read in a process without Blender's own copy of OpenEXR."""
    program = "import sys, numpy; from viewcam_addon import image; numpy.savez(sys.argv[2], **image.read(sys.argv[1]).passes)"
    search_path = os.pathsep.join([str(Path(viewcam_addon.__file__).parents[1]), *filter(None, sys.path)])
    arrays = path.with_suffix(".npz")
    subprocess.run([sys.executable, "-c", program, path, arrays], check=True, env=os.environ | {"PYTHONPATH": search_path})
    with np.load(arrays) as archive:
        return dict(archive)


def camera_data(**changes):
    """The camera's data, each value put through a function."""

    def fault(scene):
        for name, change in changes.items():
            setattr(scene.camera.data, name, change(getattr(scene.camera.data, name)))

    return fault


def sensor_fitted_to_the_height(scene):
    scene.camera.data.sensor_fit = "VERTICAL"


def camera_rolled(scene):
    scene.camera.rotation_euler.rotate_axis("Z", 1e-3)


def camera_mirrored(scene):
    scene.camera.scale.x = -1


def camera_moved(scene):
    scene.camera.location.x += 1e-3


def object_moved(scene):
    scene.objects["Sphere"].location.z += 1e-3


def object_turned(scene):
    scene.objects["Cube"].rotation_euler.z += 1e-3


def object_hidden(scene):
    scene.objects["Cube"].hide_render = True


def object_renumbered(scene):
    scene.objects["Cube"].pass_index = 9


def material_renumbered(scene):
    scene.objects["Cube"].active_material.pass_index = 9


def modifier_missing(scene):
    scene.objects["Suzanne"].modifiers.clear()


def shaded_flat(scene):
    for polygon in scene.objects["Sphere"].data.polygons:
        polygon.use_smooth = False
    scene.objects["Sphere"].data.update()


def uv_map_moved(scene):
    for corner in scene.objects["Grid"].data.uv_layers[0].data:
        corner.uv.x += 1e-4


def pixel_aspect(scene):
    scene.render.pixel_aspect_x = 1.001


FAULTS = {
    "half a pixel sideways": camera_data(shift_x=lambda shift: shift + 0.5 / STATED.width),
    "half a pixel upwards": camera_data(shift_y=lambda shift: shift + 0.5 / STATED.width),
    "a hundredth of a pixel": camera_data(shift_x=lambda shift: shift + 0.01 / STATED.width),
    "d by a tenth of a per cent": camera_data(lens=lambda lens: lens * 1.001),
    "sensor fitted to the height": sensor_fitted_to_the_height,
    "pixel aspect": pixel_aspect,
    "camera rolled": camera_rolled,
    "camera mirrored": camera_mirrored,
    "camera moved": camera_moved,
    "object moved": object_moved,
    "object turned": object_turned,
    "object hidden": object_hidden,
    "object renumbered": object_renumbered,
    "material renumbered": material_renumbered,
    "modifier missing": modifier_missing,
    "shaded flat": shaded_flat,
    "UV map moved": uv_map_moved,
}
OFTEN = {"half a pixel sideways", "a hundredth of a pixel", "camera rolled", "object moved", "modifier missing"}
CHANGES = {
    "rows flipped": lambda passes: {name: values[::-1] for name, values in passes.items()},
    "columns flipped": lambda passes: {name: values[:, ::-1] for name, values in passes.items()},
    "axes swapped": lambda passes: passes | {"Position": passes["Position"][..., [0, 2, 1]]},
    "NaN": lambda passes: passes | {"Depth": np.where(np.arange(STATED.width)[None, :, None] == 60, np.nan, passes["Depth"])},
}


def test_without_a_fault_cycles_renders_the_same_picture(compared):
    comparison = compared()
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.hits[1] > 0.6 * STATED.width * STATED.height


@pytest.mark.parametrize(
    "fault", [pytest.param(fault, marks=[pytest.mark.exhaustive] * (fault not in OFTEN)) for fault in FAULTS]
)
def test_a_fault_in_blender_is_found(fault, compared):
    comparison = compared(fault=FAULTS[fault])
    assert not comparison.passed, f"{fault} went unnoticed:\n" + "\n".join(comparison.lines())


@pytest.mark.parametrize("change", CHANGES)
def test_a_fault_in_the_file_is_found(change, compared):
    comparison = compared(change=CHANGES[change])
    assert not comparison.passed, f"{change} went unnoticed:\n" + "\n".join(comparison.lines())


def test_a_conversion_that_went_wrong_is_told_from_a_wrong_renderer(compared, still):
    """A constraint holds the camera off its values: Cycles renders what stands there, and only the conversion is at fault."""
    limit = still.camera.constraints.new("LIMIT_LOCATION")
    limit.use_min_x, limit.min_x = True, still.camera.location.x + 1e-3
    comparison = compared()
    assert not comparison.passed
    assert all(row.ok for row in comparison.rows), "\n".join(comparison.lines())
    assert not comparison.conversion.ok
    assert "from the stated one" in comparison.sentence


def test_the_tolerance_holds_far_from_the_origin_where_a_fixed_tolerance_would_not(compared, still):
    """All is moved by 2 km: errors grow to several thousandths of a pixel, and stay within the same k."""
    offset = (2000.0, -1000.0, 500.0)
    for item in still.objects:
        if item.type != "CAMERA":
            item.location = [a + b for a, b in zip(item.location, offset, strict=True)]
    moved = replace(STATED, eye=tuple(np.add(STATED.eye, offset)), look_at=tuple(np.add(STATED.look_at, offset)))
    cameras.apply(still.camera, moved, still)
    comparison = compared()
    assert comparison.passed, "\n".join(comparison.lines())
    assert comparison.rows[0].values[0] > 5e-4
