"""Scanned and modeled meshes as users import them, checked at level `geometry`. VIEWCAM_MODELS names their folder."""

import json

import numpy as np
import pytest

from viewcam_addon.cli import main

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import camera
from viewcam_addon.pinhole import Pinhole

pytestmark = pytest.mark.exhaustive


@pytest.mark.parametrize("name", ["spot", "teapot", "stanford-bunny"])
@pytest.mark.parametrize("smooth", [True, False], ids=["smooth", "flat"])
def test_an_imported_model_is_the_same_picture(models_folder, fresh_blender, tmp_path, name, smooth):
    bpy.ops.wm.obj_import(filepath=str(models_folder / f"{name}.obj"))
    model = bpy.context.selected_objects[0]
    model.data.polygons.foreach_set("use_smooth", [smooth] * len(model.data.polygons))
    bpy.context.view_layer.update()
    corners = np.array([model.matrix_world @ corner.co for corner in model.data.vertices])
    middle, size = (corners.min(axis=0) + corners.max(axis=0)) / 2, np.ptp(corners, axis=0).max()

    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 640, 480
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.data.clip_start, scene.camera.data.clip_end = size / 100, size * 100
    scene.collection.objects.link(scene.camera)
    bpy.context.view_layer.update()
    warnings = camera.apply(
        scene.camera, Pinhole(middle + size * np.array([1.1, -1.9, 0.9]), middle, (0, 0, 1), 900, 640, 480), scene
    )
    assert warnings == []

    blend, result = tmp_path / f"{name}.blend", tmp_path / "result.json"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    status = main(["check", str(blend), "--json", str(result)])
    record = json.loads(result.read_text())
    assert status == 0, record["sentence"]
    assert record["hits"]["reference"] > 30_000, "the model must fill a good part of the picture"
