"""Fixtures of the tests that need Blender: an empty file with one camera in it; both sides of a comparison; odd scenes."""

import dataclasses
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import viewcam_addon
from viewcam_addon.compare import geometry, law
from viewcam_addon.image import Image
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
def camera_object(add_camera):
    """A new camera at the origin, looking down."""
    return add_camera()


@pytest.fixture
def posed_camera(camera_object, fresh_blender):
    """A camera enabled and stated: eye (7, −6, 5), look-at (0, 0, 1), up z, distance 1500."""
    group = camera_object.virtual_pinhole
    group.eye, group.look_at, group.up, group.distance = (7, -6, 5), (0, 0, 1), (0, 0, 1), 1500
    group.enabled = True
    fresh_blender.context.view_layer.update()
    return camera_object


@pytest.fixture
def render_positions(fresh_blender, scene, tmp_path):
    """A function that has Cycles render where in the world each pixel's centre falls, in a sphere about the origin.

    Its radius is 40. The surface shines with its own position, so that Blender's plain EXR is enough.
    animation : render all frames of the scene. also : objects that shall shine likewise.
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

    error : pixels, the largest distance between the centre of a pixel and the picture of the point that was rendered there.
    tolerance : the most that the law of float32 allows anywhere in it.
    """

    def measure(pinhole, positions):
        rows, columns = np.indices(positions.shape[:2])
        column, row, depth = pinhole.project(positions)
        error = np.hypot(column - columns - 0.5, row - rows - 0.5).max()
        largest = max(np.abs(positions).max(), np.linalg.norm(pinhole.eye))
        return error, law.ROUNDINGS[-1] * law.FLOAT32 * max(pinhole.distance) * largest / np.nanmin(depth)

    return measure


@dataclasses.dataclass(frozen=True)
class BothSides:
    """One state of a file as the tracer and as Cycles see it. `traced` and `cycles` : passes, rows from the bottom."""

    exported: Scene
    traced: dict
    cycles: dict
    comparison: geometry.Comparison

    def hits(self, object_index):
        """How many pixels of Cycles' picture show the object."""
        return int((self.cycles["Object Index"] == object_index).sum())

    def check(self):
        """Fail with the comparison's own words unless both sides are the same picture of something."""
        assert self.comparison.passed, "\n" + "\n".join(self.comparison.lines())
        assert self.comparison.hits[1] > 200, f"only {self.comparison.hits} pixels see anything"


@pytest.fixture
def both_sides(fresh_blender, scene, tmp_path):
    """A function that exports the open file (or that of the request), traces it, has Cycles render it, and compares the two."""
    scene.render.resolution_x, scene.render.resolution_y = 160, 120

    def make(**request):
        from viewcam_addon.blender import job

        exported = job.export_and_render(job.Request(threads=2, **request), tmp_path / "cycles.exr")
        tracer = render.Tracer(exported, 2)
        traced, cycles = render.render(exported, 2), _passes_of(tmp_path / "cycles.exr")
        comparison = geometry.compare(Image(traced), Image(cycles), exported.camera, tracer.surface_at, exported.stated_camera)
        return BothSides(exported, traced, cycles, comparison)

    return make


def _passes_of(path):
    """The passes of an EXR, read in a process without Blender, which has an OpenEXR library of its own."""
    program = "import sys, numpy; from viewcam_addon import image; numpy.savez(sys.argv[2], **image.read(sys.argv[1]).passes)"
    search_path = os.pathsep.join([str(Path(viewcam_addon.__file__).parent.parent), *filter(None, sys.path)])
    arrays = path.with_suffix(".npz")
    subprocess.run([sys.executable, "-c", program, path, arrays], check=True, env=os.environ | {"PYTHONPATH": search_path})
    with np.load(arrays) as archive:
        return dict(archive)


@pytest.fixture
def camera(camera_object):
    """Above and before the origin, looking at it: a few metres around it are in the picture."""
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


@dataclasses.dataclass(frozen=True)
class OddRow:
    """A row of docs/odd-blender.md, and the scene that holds it to its word.

    sticks : whether the pose sticks right after `apply`, later, in the render; None where nothing is said of it.
    sentences : what the panel says in the end. folder : for files.
    """

    sticks: tuple[bool | None, bool | None, bool | None]
    sentences: list[str]
    folder: Path

    def check(self, camera_object, then=None, scene=None, reopened=True):
        """Apply the four values; let `then` happen, four frames pass; render; save and open again. Another file is open then.

        Fails unless at each stage the pose sticks or not as the row has it, and the panel says what the row says.
        reopened : whether that holds of the saved file too.
        """
        import bpy

        scene = scene or bpy.context.scene
        self.apply(camera_object, scene)
        if then:
            then()
        self.later(camera_object, scene, "after an update")
        scene.frame_set(scene.frame_current + 4)
        self.later(camera_object, scene, "at another frame")
        self.render(camera_object, scene)
        if reopened:
            self.later(*self.reopen(camera_object, scene), "saved and opened again")

    def apply(self, camera_object, scene):
        """Apply the four values."""
        from viewcam_addon.blender import camera as cameras
        from viewcam_addon.blender import datablocks
        from viewcam_addon.errors import InputError

        try:
            said = cameras.apply(camera_object, cameras.stated(camera_object, scene), scene)
        except InputError as error:
            said = [datablocks.sentence(error)]
        self._compare(0, _off_by(camera_object, scene, datablocks.depsgraph_of(scene)), "right after apply")
        if self.sticks[0] == self.sticks[1]:
            assert set(said) <= set(self.sentences), f"apply says {said}"

    def later(self, camera_object, scene, moment):
        """Look at the camera and at its panel."""
        import bpy

        from viewcam_addon.blender import datablocks, panel

        for _ in range(2):  # what a handler changes in one update shows in the next
            bpy.context.view_layer.update()
        self._compare(1, _off_by(camera_object, scene, datablocks.depsgraph_of(scene)), moment)
        said = panel.contents(camera_object, scene)[1]
        assert said == self.sentences, f"{moment} the panel says\n" + "\n".join(said)

    def render(self, camera_object, scene):
        """Look at the camera as a render engine gets it."""
        from viewcam_addon.blender import depsgraph

        off = depsgraph.visit(scene, lambda graph: _off_by(camera_object, scene, graph))
        self._compare(2, off, "in the render")

    def reopen(self, camera_object, scene):
        """Save and open again: the camera and the scene in the new file."""
        import bpy

        names, path = (camera_object.name, scene.name), str(self.folder / "odd.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.open_mainfile(filepath=path)
        scene = bpy.data.scenes[names[1]]
        return scene.objects.get(names[0]) or bpy.data.objects[names[0]], scene

    def _compare(self, stage, off, moment):
        if self.sticks[stage] is not None:
            # Blender's own projection runs in float32: 20 roundings of numbers up to 2 · 1920 px.
            assert (off < 20 * 2.0**-24 * 3840) == self.sticks[stage], f"{moment} the picture is off by {off:.3g} px"


def _off_by(camera_object, scene, graph):
    """Pixels between where Blender's own function sees points about the look-at point and where the four values see them."""
    from bpy_extras.object_utils import world_to_camera_view
    from mathutils import Vector

    from viewcam_addon.blender import camera as cameras
    from viewcam_addon.blender import datablocks
    from viewcam_addon.errors import InputError

    evaluated = camera_object.evaluated_get(graph)
    try:
        stated = cameras.stated(camera_object, scene)
    except InputError:
        return math.inf
    if not evaluated.is_evaluated or not evaluated.matrix_world.determinant():
        return math.inf
    frame = datablocks.frame_of(scene)
    points = np.add(stated.look_at, [(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0, 0, 0.5)])
    seen = np.array([world_to_camera_view(scene, evaluated, Vector(point)) for point in points])[:, :2]
    stated_at = np.column_stack(stated.project(points)[:2]) + frame.window[:2]
    return float(np.linalg.norm(seen * frame.size - stated_at, axis=1).max())


@pytest.fixture
def odd_rows(tmp_path):
    """The rows of docs/odd-blender.md by the name of their test."""
    rows = {}
    page = Path(__file__).resolve().parent.parent.parent / "docs" / "odd-blender.md"
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split(" | ")]
        if cells[-1].strip("`").startswith("test_"):
            _, *sticks, said, test = cells
            assert test not in rows and len(sticks) == 3, f"one row, three cells of yes or no for {test}"
            sticks = tuple({"yes": True, "no": False, "—": None}[cell] for cell in sticks)
            rows[test.strip("`")] = OddRow(sticks, [] if said == "nothing" else said.split("<br>"), tmp_path)
    return rows


@pytest.fixture
def odd(request, odd_rows):
    """The row of docs/odd-blender.md that names the test."""
    return odd_rows[request.node.originalname]


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
