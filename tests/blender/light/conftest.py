"""A stage of random things under random light, and its pictures from both sides."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.comparison import radiance
from viewcam_addon.image import Image
from viewcam_addon.tracer import render
from viewcam_addon.tracer.scene import Scene

SCENES = 10


@dataclass(frozen=True)
class Sides:
    """One scene from both sides.

    traced : passes.
    cycles : passes of each picture; all rows from the bottom.
    """

    exported: Scene
    traced: dict
    cycles: list

    def compared(self, samples, traced=None):
        """The comparison of their light, each of Cycles' pictures of so many samples and the tracer's of all of them.

        traced : passes to compare with in place of these.
        """
        attributes = {"samples": str(samples * len(self.cycles)), "albedo tables": "yes"}
        reference = Image(self.traced if traced is None else traced, self.exported.camera, attributes)
        tests = [Image(passes, self.exported.camera) for passes in self.cycles]
        return radiance.compare(reference, tests, self.exported.camera, samples)


@pytest.fixture
def stage(fresh_blender, scene, camera, add, mesh_from, make_material, set_world):
    """Suzanne, flat, over a floor, both of random Lambert materials; stage(rng) moves and colors them anew."""
    scene.render.resolution_x, scene.render.resolution_y = 64, 48
    camera.data.lens = 35
    set_world((0, 0, 0), 0.0)
    monkey, floor = add(mesh_from("monkey"), "Monkey"), add(mesh_from("plane", size=14), "Floor")
    for block in (monkey, floor):
        block.data.materials.append(make_material(block.name, "ShaderNodeBsdfDiffuse", Roughness=0.0))

    def arrange(rng):
        monkey.rotation_euler = rng.uniform(-math.pi, math.pi, 3)
        monkey.scale = rng.uniform(0.7, 1.5, 3)
        monkey.location = rng.uniform(-0.5, 0.5, 3)
        floor.location, floor.rotation_euler = (0, 0, rng.uniform(-2, -1.5)), rng.uniform(-0.1, 0.1, 3)
        for block in (monkey, floor):
            color = (*rng.uniform(0.2, 1, 3), 1)
            first = next(iter(block.data.materials), None)
            shader = first and first.node_tree.nodes["Shader"]
            if shader and "Color" in shader.inputs:
                shader.inputs["Color"].default_value = color

    return arrange


@pytest.fixture
def pictures(stage, read_passes, tmp_path):
    """pictures(arrange, samples=…, count=…, …) → Sides of ten scenes: `arrange(rng)` changes what the stage has set up.

    samples : the samples of each of Cycles' pictures.
    count : the number of Cycles' pictures, the tracer having the samples of all. The rest is as in Job.
    """
    from viewcam_addon.blender.jobs import renderer as jobs
    from viewcam_addon.jobs.job import Job

    def make(arrange=lambda rng: None, samples=1, count=1, level="direct", scenes=SCENES, **request):
        exported, paths = [], []
        for number in range(scenes):
            rng = np.random.default_rng(number)
            stage(rng)
            arrange(rng)
            paths.append([tmp_path / f"{number}-{picture}.exr" for picture in range(count)])
            wanted = Job(threads=2, level=level, samples=samples * count, **request)
            exported.append(jobs.both_sides(wanted, paths[-1]))
        passes = iter(read_passes([path for each in paths for path in each]))
        return [
            Sides(each, render.render(each, level, samples * count, threads=2), [next(passes) for _ in range(count)])
            for each in exported
        ]

    return make


@pytest.fixture
def first_samples(read_passes, tmp_path):
    """first_samples(level) → passes of the tracer and of Cycles: one sample of the open scene, all of it exported as it is."""
    from viewcam_addon.blender.jobs import renderer as jobs
    from viewcam_addon.jobs.job import Job

    def make(level="direct"):
        path = tmp_path / "first.exr"
        exported = jobs.both_sides(Job(threads=2, level=level, samples=1), [path])
        assert all(entry.status == "exported" for entry in exported.ledger), exported.ledger
        (cycles_passes,) = read_passes([path])
        return render.render(exported, level, 1, threads=2), cycles_passes

    return make


@pytest.fixture
def link(scene):
    """link(light, receiver_collection={name: state}, …): names may be those of collections, which are then looked up."""

    def make(light, **collections):
        for what, states in collections.items():
            collection = bpy.data.collections.new(what)
            for name, state in states.items():
                if name in bpy.data.objects:
                    collection.objects.link(bpy.data.objects[name])
                    place = list(collection.objects).index(bpy.data.objects[name])
                    collection.collection_objects[place].light_linking.link_state = state
                else:
                    collection.children.link(bpy.data.collections[name])
                    place = list(collection.children).index(bpy.data.collections[name])
                    collection.collection_children[place].light_linking.link_state = state
            setattr(light.light_linking, what, collection)

    return make


@pytest.fixture
def painted(make_material):
    """painted(class, inputs, properties) → a material of one shader. An input that is a dict is a Tangent node's properties."""

    def make(kind, inputs, properties=None):
        material = make_material(kind, kind)
        tree = material.node_tree
        shader = tree.nodes["Shader"]
        for name, value in inputs.items():
            if isinstance(value, dict) and name in shader.inputs:
                node = tree.nodes.new("ShaderNodeTangent")
                for property, word in value.items():
                    setattr(node, property, word)
                tree.links.new(node.outputs[0], shader.inputs[name])
            elif name in shader.inputs:
                shader.inputs[name].default_value = value
        for name, value in (properties or {}).items():
            setattr(shader, name, value)
        return material

    return make


@pytest.fixture
def strewn(camera, add):
    """strewn(materials, …) → objects, one a material, numbered from 1: a floor of square patches below the camera, strewn so
    that it sees every material at all angles.

    cells : across the floor.
    width : the floor's width, one unit below the camera.
    backwards : a function: true if patch i is seen from behind. UV maps are turned, mirrored and sheared, on each patch in its
        own way.
    """

    def make(materials, cells=24, width=4.0, backwards=lambda i: False):
        camera.location, camera.rotation_euler, camera.data.lens = (0.013, 0.029, 1.0), (0, 0, 0), 36.0 / width
        side, rng, blocks = width / cells, np.random.default_rng(3), []
        for number, material in enumerate(materials):
            places = range(number, cells * cells, len(materials))
            corners = [((p % cells - cells / 2) * side, ((7 * p // cells) % cells - cells / 2) * side) for p in places]
            around = ((0, 0), (side, 0), (side, side), (0, side))
            vertices = [(x + dx, y + dy, 0.0) for x, y in corners for dx, dy in around]
            mesh = bpy.data.meshes.new(f"P{number}")
            faces = [range(4 * i, 4 * i + 4)[:: -1 if backwards(i) else 1] for i in range(len(corners))]
            mesh.from_pydata(vertices, [], faces)
            loops = np.empty(len(mesh.loops), np.int32)
            mesh.loops.foreach_get("vertex_index", loops)
            for layer in ("UVMap", "Second"):
                maps = rng.uniform(-1, 1, (len(corners), 2, 2))
                uvs = np.einsum("pij,pcj->pci", maps, np.array(vertices)[:, :2].reshape(-1, 4, 2)).reshape(-1, 2)
                mesh.uv_layers.new(name=layer).data.foreach_set("uv", uvs[loops].ravel())
            mesh.materials.append(material)
            blocks.append(add(mesh, f"P{number}", pass_index=number + 1))
        return blocks

    return make
