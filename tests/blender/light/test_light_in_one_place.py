"""Surfaces in one place before Cycles' light: what depends on its rounding is named and taken out, and nothing else."""

import pytest

bpy = pytest.importorskip("bpy")

from dataclasses import replace

from viewcam_addon import api
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.image import Image
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import render


@pytest.fixture
def room(scene, camera, add, add_lamp, mesh_from):
    """A tilted floor, a ball on it, a wall, a sun, and a world; room(kind) puts something in the floor's place."""

    def painted(mesh, color):
        material = bpy.data.materials.new(mesh.name)
        material.use_nodes = True
        material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
        material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 1.0
        mesh.materials.append(material)
        return mesh

    def make(kind):
        tilt = (0.11, 0.07, 0.2)
        add(painted(mesh_from("plane", size=6), (0.6, 0.6, 0.6)), "Floor", rotation_euler=tilt)
        if kind == "copy":
            add(painted(mesh_from("plane", size=6), (0.2, 0.5, 0.7)), "Copy", rotation_euler=tilt)
        else:
            grid = mesh_from("grid", size=2.2, x_subdivisions=3, y_subdivisions=5)
            add(painted(grid, (0.8, 0.3, 0.1)), "Carpet", rotation_euler=tilt)
        add(painted(mesh_from("uv_sphere", radius=0.6), (0.7, 0.7, 0.2)), "Ball", (1.4, 1.4, 0.8))
        add(painted(mesh_from("plane", size=8), (0.3, 0.5, 0.4)), "Wall", (0, 4, 0), rotation_euler=(1.4, 0, 0))
        add_lamp("SUN", (0, 0, 5), (0.5, 0.2, 0), energy=3.0, angle=0.2)
        scene.render.resolution_x, scene.render.resolution_y = 96, 64

    return make


@pytest.mark.parametrize("level", ["direct", "path"])
@pytest.mark.parametrize("kind", ["carpet", "copy"])
def test_light_on_surfaces_in_one_place_is_taken_out_and_named(room, tmp_path, read_passes, kind, level):
    room(kind)
    paths = [tmp_path / f"cycles-{number}.exr" for number in range(4)]
    exported = jobs.both_sides(Job(threads=2, level=level, samples=64), paths)
    tests = [Image(passes, exported.camera) for passes in read_passes(paths)]

    def compared(scene):
        passes = render.render(scene, level, 64, threads=2)
        reference = Image(passes, scene.camera, {"samples": "64", "level": level, "albedo tables": "yes"})
        return api.compare(reference, tests, exported, 2, 16)

    found = compared(exported)
    assert found.passed, "\n".join(found.lines())
    assert found.answer.answer == "same_but", found.sentence
    assert set(found.taken_out.names) == {"Floor", kind.capitalize()}
    assert 0.02 < found.taken_out.pixels.mean() < 0.9
    assert 0.02 < found.not_modelled.share < 0.9 and set(found.not_modelled.names) == {"Floor", kind.capitalize()}
    brighter = tuple(replace(lamp, irradiance=tuple(1.03 * x for x in lamp.irradiance)) for lamp in exported.lamps)
    assert not compared(replace(exported, lamps=brighter)).passed
