"""Whole pictures beside Cycles', as a user compares them: `viewcam check` at level geometry, and at 1024 samples of light.

Pictures of light are small, for 1024 samples of each pixel on both sides take their time; a bias of a hundredth of a tile's
light is found all the same (tests/comparison shows which is). Each check of light runs in a process of its own.

VIEWCAM_MODELS names the folder of scanned and modeled meshes, as users import them.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

sys.path.insert(0, str(Path(__file__).parent.parent / "sample_scenes"))
import materials

from viewcam_addon.blender import camera
from viewcam_addon.cli import main
from viewcam_addon.pinhole import Pinhole

ROOT = Path(__file__).resolve().parent.parent
SCENES = ROOT / "sample_scenes"
SAMPLES = 1024
MODELS = ("spot", "teapot", "stanford-bunny")

# The scenes that artists work on every day: materials, worlds and instances that the tracer does not model, under one matte
# material.
EVERYDAY = {"portrait": "32x72", "straight_down": "48x48", "wide": "84x28", "flight": "64x36", "spheres": "64x48"}


def check(blend, folder, *options):
    """Run `viewcam check` and return its JSON; it must say "same within noise"."""
    result = folder / "result.json"
    words = ["check", blend, "--samples", SAMPLES, "--json", result, *options]
    command = [sys.executable, "-m", "viewcam_addon", *map(str, words)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "same within noise" in run.stdout.lower(), run.stdout
    return json.loads(result.read_text(encoding="utf-8"))


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", MODELS)
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


@pytest.mark.light
@pytest.mark.parametrize(("name", "size"), [("cornell", "48x48"), ("studio", "64x36")])
@pytest.mark.parametrize("level", ["direct", "path"])
def test_sample_scene_is_the_same_within_noise(name, size, level, tmp_path):
    check(SCENES / f"{name}.blend", tmp_path, "--level", level, "--size", size)


@pytest.mark.light
@pytest.mark.parametrize("name", EVERYDAY)
def test_everyday_scene_of_clay_is_the_same_within_noise(name, tmp_path):
    check(SCENES / f"{name}.blend", tmp_path, "--level", "path", "--clay", "--size", EVERYDAY[name])


@pytest.mark.light
@pytest.mark.parametrize("name", materials.BUILDERS)
def test_scene_of_artists_materials_is_exported_whole_and_the_same_within_noise(name, fresh_blender, tmp_path):
    materials.BUILDERS[name]()
    blend = tmp_path / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    result = check(blend, tmp_path, "--level", "path", "--size", "48x27")
    assert not [entry for entry in result["ledger"] if entry["status"] != "exported"], result["ledger"]


@pytest.mark.light
@pytest.mark.parametrize("name", MODELS)
def test_model_between_a_mirror_and_a_glass_ball_is_the_same_within_noise(name, models_folder, fresh_blender, tmp_path):
    fresh_blender.ops.wm.obj_import(filepath=str(models_folder / f"{name}.obj"))
    stage(bpy.context.selected_objects[0], bpy.context.scene)
    blend = tmp_path / f"{name}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    check(blend, tmp_path, "--level", "path")


def stage(model, scene):
    """Put a model of any size on a floor, between a mirror ball and a glass ball, under a sun, an area lamp and a sky."""
    bpy.context.view_layer.update()
    size = max(model.dimensions)
    model.scale = [factor * 1.6 / size for factor in model.scale]
    bpy.context.view_layer.update()
    corners = np.array([model.matrix_world @ corner.co for corner in model.data.vertices])
    model.location = np.array(model.location) - [*(corners.min(axis=0) + corners.max(axis=0))[:2] / 2, corners[:, 2].min()]
    model.data.materials.clear()
    model.data.materials.append(material("Clay", "ShaderNodeBsdfDiffuse", (0.7, 0.45, 0.3)))
    bpy.ops.mesh.primitive_plane_add(size=12)
    bpy.context.object.data.materials.append(material("Floor", "ShaderNodeBsdfDiffuse", (0.6, 0.6, 0.6)))
    for x, name, shader in ((-1.4, "Mirror", "ShaderNodeBsdfAnisotropic"), (1.4, "Glass", "ShaderNodeBsdfGlass")):
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5, radius=0.45, location=(x, -0.7, 0.45))
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material(name, shader, (0.9, 0.9, 0.9)))
    lamp("SUN", 2.5, rotation=(0.7, 0.2, 0.4)).angle = 0.05
    area = lamp("AREA", 120, location=(-2.5, -1.5, 3.0), rotation=(0.5, -0.7, 0))
    area.shape, area.size, area.size_y = "RECTANGLE", 1.5, 0.8
    scene.world = bpy.data.worlds.new("Sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.3, 0.4, 0.6, 1)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 80, 48
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    bpy.context.view_layer.update()
    assert camera.apply(scene.camera, Pinhole((0.6, -5.5, 2.2), (0, 0, 0.6), (0, 0, 1), 95, 80, 48), scene) == []


def material(name, shader, color):
    """A material of one shader, perfectly smooth if it can be."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    node, output = nodes.new(shader), nodes.new("ShaderNodeOutputMaterial")
    node.inputs["Color"].default_value = (*color, 1)
    node.inputs["Roughness"].default_value = 0
    links.new(node.outputs[0], output.inputs["Surface"])
    return material


def lamp(kind, energy, location=(0, 0, 0), rotation=(0, 0, 0)):
    """Add a lamp and return its data."""
    bpy.ops.object.light_add(type=kind, location=location, rotation=rotation)
    bpy.context.object.data.energy = energy
    return bpy.context.object.data
