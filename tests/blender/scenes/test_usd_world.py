"""A USD's cameras stand where Blender's own importer puts them, which takes the stage's unit and up axis."""

import bpy
import numpy as np
import pytest

from viewcam_addon import cameras
from viewcam_addon.cameras import Options

pytest.importorskip("pxr")
pytestmark = pytest.mark.skipif(bpy.app.version < (4, 5, 0), reason="Blender's importer takes the unit since 4.5")

HEADS = ["", 'metersPerUnit = 0.01\n upAxis = "Z"', 'metersPerUnit = 1\n upAxis = "Y"', 'metersPerUnit = 0.0254\n upAxis = "Y"']
STAGE = """#usda 1.0
( {} )
def Xform "root"
{{
    double3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    def Camera "Cam"
    {{
        float focalLength = 74.98
        float horizontalAperture = 36
        float verticalAperture = 20.25
        float3 xformOp:rotateZYX = (133.97, 98.04, -134.99)
        double3 xformOp:translate = (1.5, -2.25, 0.75)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZYX"]
    }}
}}
"""


@pytest.mark.parametrize("head", HEADS)
def test_a_camera_stands_where_blenders_importer_puts_it(tmp_path, head):
    (tmp_path / "a.usda").write_text(STAGE.format(head))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=str(tmp_path / "a.usda"))
    (imported,) = (each for each in bpy.data.objects if each.type == "CAMERA")
    (camera,) = cameras.read(tmp_path / "a.usda", options=Options(size=(640, 360)))
    matrix = np.array(imported.matrix_world)
    away = np.abs(matrix[:3, 3]).max()
    assert np.abs(matrix[:3, 3] - camera.pinhole.eye).max() < 8 * 2**-24 * away  # a chain of float32 matrices
    turn = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    assert np.abs(turn.T - np.array(camera.pinhole.axes())).max() < 8 * 2**-24
