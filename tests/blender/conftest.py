"""Fixtures of the tests that need Blender: an empty file with one camera in it; both sides of a comparison; the tracer."""

import dataclasses
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import viewcam_addon
from viewcam_addon.comparison import geometry, tolerances
from viewcam_addon.image import Image
from viewcam_addon.jobs.tracing import Tracing
from viewcam_addon.tracer import render
from viewcam_addon.tracer.scene import Scene


@pytest.fixture
def scene(fresh_blender):
    """The scene of an empty file."""
    return fresh_blender.context.scene


@pytest.fixture
def add_camera(fresh_blender, scene):
    """A function that adds a camera object of the given name, with data of its own, and makes it the scene's camera."""

    def add(name="Camera"):
        camera_object = fresh_blender.data.objects.new(name, fresh_blender.data.cameras.new(name))
        scene.collection.objects.link(camera_object)
        scene.camera = camera_object
        fresh_blender.context.view_layer.update()
        return camera_object

    return add


@pytest.fixture
def link_object(fresh_blender):
    """A function that links an object of another .blend, by its name, into the scene that is open."""

    def link(library, name="Camera"):
        with fresh_blender.data.libraries.load(str(library), link=True) as (_, names):
            names.objects = [name]
        (linked,) = names.objects
        fresh_blender.context.scene.collection.objects.link(linked)
        return linked

    return link


@pytest.fixture
def link_camera(fresh_blender, link_object, tmp_path):
    """A function that saves the open file as library.blend, opens an empty one, and links the camera there."""

    def link():
        fresh_blender.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
        fresh_blender.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        return link_object(tmp_path / "library.blend")

    return link


@pytest.fixture
def add_rig(fresh_blender, scene):
    """A function that adds an armature of one bone, Head, from (0, 0, 1) to (0, 1, 2)."""

    def add(roll=0.0):
        armature = fresh_blender.data.objects.new("Rig", fresh_blender.data.armatures.new("Rig"))
        scene.collection.objects.link(armature)
        fresh_blender.context.view_layer.objects.active = armature
        fresh_blender.ops.object.mode_set(mode="EDIT")
        bone = armature.data.edit_bones.new("Head")
        bone.head, bone.tail, bone.roll = (0, 0, 1), (0, 1, 2), roll
        fresh_blender.ops.object.mode_set(mode="OBJECT")
        return armature

    return add


@pytest.fixture
def camera_object(add_camera):
    """A new camera at the origin, looking down."""
    return add_camera()


@pytest.fixture
def posed_camera(camera_object, fresh_blender):
    """A camera enabled and stated: eye (7, −6, 5), look-at (0, 0, 1), up z, distance 1500, which a resize keeps."""
    group = camera_object.virtual_pinhole
    group.keeps = "PIXELS"
    group.eye, group.look_at, group.up, group.distance = (7, -6, 5), (0, 0, 1), (0, 0, 1), 1500
    group.enabled = True
    fresh_blender.context.view_layer.update()
    return camera_object


@pytest.fixture
def over_the_top():
    """A function that gives an eye ten away from the origin, degrees before (−) or behind the zenith, and beside it."""

    def eye(degrees, miss=0.0):
        along, beside = math.radians(degrees), math.radians(miss)
        return 10 * math.sin(along), -10 * math.cos(along) * math.sin(beside), 10 * math.cos(along) * math.cos(beside)

    return eye


@pytest.fixture
def turn_between():
    """A function that gives the radians of the rotation that takes one (3, 3) rotation to the other."""
    return lambda before, after: 2 * math.asin(min(1.0, np.linalg.norm(after - before) / math.sqrt(8)))


@pytest.fixture
def held_camera(posed_camera, over_the_top):
    """A camera 20° before the zenith over the origin that holds its roll, near the pole and nowhere else."""
    group = posed_camera.virtual_pinhole
    group.look_at, group.eye = (0, 0, 0), over_the_top(-20)
    group.pole = "HOLD"
    return posed_camera


@pytest.fixture
def render_positions(fresh_blender, scene, tmp_path):
    """A function that has Cycles render where in the world each pixel's center falls, in a sphere about the origin.

    Its radius is 40. The surface shines with its own position, so that Blender's plain EXR is enough.
    animation : render all frames of the scene.
    also : objects that shall shine likewise.

    Returns (height, width, 3) float32, rows from the bottom, or a dict of them by frame.
    """
    bpy = fresh_blender
    render = scene.render
    render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    if (render.resolution_x, render.resolution_y) == (1920, 1080):
        render.resolution_x = render.resolution_y = 32
    material = _shining_position(bpy)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=6, radius=40)
    bpy.context.object.data.materials.append(material)

    def read(path):
        image = bpy.data.images.load(str(path))
        image.colorspace_settings.name = "Non-Color"
        width, height = image.size
        pixels = np.empty(width * height * 4, dtype=np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(height, width, 4)[..., :3]

    def render_them(animation=False, also=()):
        for item in also:
            item.data.materials.append(material)
        if animation:
            render.filepath = str(tmp_path / "frame")
            bpy.ops.render.render(animation=True)
            frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
            return {frame: read(tmp_path / f"frame{frame:04d}.exr") for frame in frames}
        render.filepath = str(tmp_path / "picture.exr")
        bpy.ops.render.render(write_still=True)
        return read(tmp_path / "picture.exr")

    return render_them


def _shining_position(bpy):
    material = bpy.data.materials.new("Position")
    if not material.node_tree:  # new materials have one from 5.0 on
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    geometry, emission = tree.nodes.new("ShaderNodeNewGeometry"), tree.nodes.new("ShaderNodeEmission")
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(geometry.outputs["Position"], emission.inputs["Color"])
    tree.links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return material


@pytest.fixture
def picture_error():
    """A function (pinhole, positions) → (error, tolerance), for what `render_positions` renders.

    error : pixels, the largest distance between the center of a pixel and the picture of the point that was rendered there.
    tolerance : the most that float32 allows anywhere in it.
    """

    def measure(pinhole, positions):
        rows, columns = np.indices(positions.shape[:2])
        column, row, depth = pinhole.project(positions)
        error = np.hypot(column - columns - 0.5, row - rows - 0.5).max()
        largest = max(np.abs(positions).max(), np.linalg.norm(pinhole.eye))
        return error, tolerances.ROUNDINGS[-1] * tolerances.FLOAT32 * max(pinhole.distance) * largest / np.nanmin(depth)

    return measure


@dataclasses.dataclass(frozen=True)
class BothSides:
    """One state of a file as the tracer and as Cycles see it. `traced` and `cycles` : passes, rows from the bottom."""

    exported: Scene
    traced: dict
    cycles: dict
    comparison: geometry.GeometryComparison

    def hits(self, object_index):
        """The number of pixels of Cycles' picture that show the object."""
        return int((self.cycles["Object Index"] == object_index).sum())

    def check(self):
        """Fail with the comparison's own words unless both sides are the same picture of something."""
        assert self.comparison.passed, "\n" + "\n".join(self.comparison.lines())
        assert self.comparison.hits[1] > 200, f"only {self.comparison.hits} pixels see anything"


@pytest.fixture
def both_sides(fresh_blender, scene, tmp_path, read_passes):
    """A function that exports the open file (or that of the request), traces it, has Cycles render it, and compares the two."""
    scene.render.resolution_x, scene.render.resolution_y = 160, 120

    def make(**request):
        from viewcam_addon.blender.jobs import renderer as jobs
        from viewcam_addon.jobs.job import Job

        exported = jobs.both_sides(Job(threads=2, **request), [tmp_path / "cycles.exr"])
        tracer = render.Tracer(exported, 2)
        traced, (cycles,) = render.render(exported, threads=2), read_passes([tmp_path / "cycles.exr"])
        comparison = geometry.compare(Image(traced), Image(cycles), exported.camera, tracer.surfaces_at, exported.stated_camera)
        return BothSides(exported, traced, cycles, comparison)

    return make


_READER = """
import sys, numpy
from viewcam_addon import image
for line in sys.stdin:
    path = line.rstrip()
    numpy.savez(path + ".npz", **image.read(path).passes)
    print("read", flush=True)
"""


@pytest.fixture(scope="session")
def exr_reader():
    """A process without Blender, which has an OpenEXR library of its own: it reads the path of each line, for all tests."""
    search_path = os.pathsep.join([str(Path(viewcam_addon.__file__).parent.parent), *filter(None, sys.path)])
    command, environment = [sys.executable, "-c", _READER], os.environ | {"PYTHONPATH": search_path}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=environment, cwd=Path(__file__).parent, **pipes) as process:
        yield process


@pytest.fixture
def read_passes(exr_reader):
    """A function that reads EXRs: paths → a dict of passes each."""

    def read(paths):
        result = []
        for path in paths:
            exr_reader.stdin.write(f"{path}\n")
            exr_reader.stdin.flush()
            assert exr_reader.stdout.readline() == "read\n", f"{path} can't be read"
            with np.load(f"{path}.npz") as archive:
                result.append(dict(archive))
        return result

    return read


@pytest.fixture
def make_material(fresh_blender):
    """make_material(name, shader's class, {input: value}) → a material of this one shader, without anything else."""

    def make(name, kind, **inputs):
        material = fresh_blender.data.materials.new(name)
        if not material.node_tree:  # new materials have one from 5.0 on
            material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        shader = tree.nodes.new(kind)
        shader.name = "Shader"
        output = tree.nodes.new("ShaderNodeOutputMaterial")
        output.name = "Output"
        tree.links.new(shader.outputs[0], output.inputs["Surface"])
        for key, value in inputs.items():
            shader.inputs[key.replace("_", " ")].default_value = value
        return material

    return make


@pytest.fixture
def add_lamp(fresh_blender, scene):
    """add_lamp(type, location, rotation, property=value, …) → the object of a light that all rays see."""

    def make(kind, location=(0, 0, 5), rotation=(0, 0, 0), name="Lamp", **properties):
        data = fresh_blender.data.lights.new(name, kind)
        for key, value in properties.items():
            setattr(data, key, value)
        block = fresh_blender.data.objects.new(name, data)
        scene.collection.objects.link(block)
        block.location, block.rotation_euler = location, rotation
        block.visible_camera = True
        return block

    return make


@pytest.fixture
def set_world(fresh_blender, scene):
    """set_world(color, strength) → a new world of a Background node, which is the scene's."""

    def make(color=(1, 1, 1), strength=1.0):
        world = fresh_blender.data.worlds.new("World")
        if not world.node_tree:
            world.use_nodes = True
        scene.world = world
        background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value = (*color, 1)
        background.inputs["Strength"].default_value = strength
        return world

    return make


@pytest.fixture
def camera(camera_object):
    """Above and before the origin, looking at it: a few meters around it are in the picture."""
    camera_object.location = (0.3, -7, 4)
    camera_object.rotation_euler = (math.atan2(7, 4), 0.02, 0.04)
    return camera_object


@pytest.fixture
def monkey(fresh_blender, camera):
    """Suzanne, smooth, with a UV map."""
    fresh_blender.ops.mesh.primitive_monkey_add(rotation=(-0.4, 0.1, 0.3))
    fresh_blender.ops.object.shade_smooth()
    return fresh_blender.context.object


@pytest.fixture
def add(fresh_blender, scene, camera):
    """A function that adds an object with the given data, optionally to a collection, and returns it."""

    def add_object(data, name=None, location=(0, 0, 0), collection=None, **properties):
        block = fresh_blender.data.objects.new(name or (data.name if data else "Empty"), data)
        (collection or scene.collection).objects.link(block)
        block.location = location
        for key, value in properties.items():
            setattr(block, key, value)
        return block

    return add_object


@pytest.fixture
def mesh_from(fresh_blender):
    """A function that makes a mesh datablock of one of Blender's primitives, without an object."""

    def make(primitive, **options):
        getattr(fresh_blender.ops.mesh, f"primitive_{primitive}_add")(**options)
        block = fresh_blender.context.object
        data = block.data
        fresh_blender.data.objects.remove(block)
        return data

    return make


@pytest.fixture
def node_group(fresh_blender):
    """A function that makes a geometry node tree with a geometry input and output: (tree, input node, output node)."""

    def make(name="Nodes"):
        tree = fresh_blender.data.node_groups.new(name, "GeometryNodeTree")
        for direction in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
        return tree, tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")

    return make


@pytest.fixture
def empty(scene):
    """A function that adds an empty."""
    import bpy

    def add(name, location=(0, 0, 0), **properties):
        block = bpy.data.objects.new(name, None)
        scene.collection.objects.link(block)
        block.location = location
        for key, value in properties.items():
            setattr(block, key, value)
        bpy.context.view_layer.update()
        return block

    return add


@pytest.fixture(scope="module")
def tracing():
    with Tracing() as tracing:
        yield tracing


@pytest.fixture
def one_process(tracing, monkeypatch):
    """Renderers ask the module's process, and never start one of their own."""
    from viewcam_addon.blender.jobs import renderer

    class Kept(Tracing):
        ask = staticmethod(tracing.ask)

    monkeypatch.setattr(renderer, "Tracing", Kept)
