"""Inputs of shaders that are not modelled: the images that another Blender bakes of them, and where none can stand in."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender import another_blender
from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.rendering import cycles
from viewcam_addon.blender.scenes import baker, charts, export_geometry
from viewcam_addon.blender.temporary_settings import overridden
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer import native, render
from viewcam_addon.tracer.scene.film import Bounces

pytestmark = pytest.mark.slow

SAME = 1e-5  # calibrated: both sides look the same image up, in places that are rounded in another order


@pytest.fixture
def sheet(scene, camera, add, make_material, set_world):
    """sheet(…) → an object of a square, a triangle and a pentagon, twice by a modifier, that shines with a sky's colours.

    The sky is what it would be in the direction of each place of the surface; scale : of these places.
    """

    def make(scale=1.0, node="TexSky"):
        scene.render.resolution_x = scene.render.resolution_y = 48
        set_world((0, 0, 0), 0.0)
        camera.location, camera.rotation_euler, camera.data.lens = (0.013, 0.029, 4.0), (0, 0, 0), 40.0
        mesh = bpy.data.meshes.new("Sheet")
        points = [(0.1, -1), (1, -1), (1, 0), (0.1, 0), (1, 1), (0.1, 1), (0.5, 1.35), (0.9, 1.4)]
        mesh.from_pydata([(x, y, 0.1 * x * y) for x, y in points], [], [(0, 1, 2, 3), (3, 2, 4), (3, 4, 7, 6, 5)])
        mesh.materials.append(make_material("Material", "ShaderNodeEmission", Strength=0.3))
        tree = mesh.materials[0].node_tree
        shown = tree.nodes.new(f"ShaderNode{node}")
        if node == "TexSky":
            shown.sky_type = "PREETHAM"
            made = tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]
            for operation, *by in (("MULTIPLY", (scale,) * 3), ("SINE",), ("ADD", (0, 0, 1.2)), ("NORMALIZE",)):
                step = tree.nodes.new("ShaderNodeVectorMath")
                step.operation = operation
                tree.links.new(made, step.inputs[0])
                for value in by:
                    step.inputs[1].default_value = value
                made = step.outputs[0]
            tree.links.new(made, shown.inputs["Vector"])
        tree.links.new(shown.outputs[0], tree.nodes["Shader"].inputs["Color"])
        block = add(mesh, "Cube", pass_index=1)  # names that are taken in a new Blender
        block.modifiers.new("Other half", "MIRROR")
        return block

    return make


def told(exported, name="Cube"):
    return "; ".join(entry.reason for entry in exported.ledger if entry.object == name)


def export():
    return jobs.export(Job(level="direct"))


@pytest.fixture
def sides(scene, camera, read_passes, tmp_path):
    """sides() → what is exported; the sheet, (pixels, 3), as the tracer shows it, as Cycles does then, and as it does else."""

    def make():
        paths = [tmp_path / "baked.exr", tmp_path / "true.exr"]
        exported = jobs.both_sides(Job(threads=2, level="direct", samples=1), paths[:1])
        light = cycles.LightSettings(exported.film, Bounces(0, 0, 0, 0), 1)
        cycles.render(scene, bpy.context.view_layer, camera, paths[1], light=light)
        ours, *theirs = render.render(exported, "direct", 1, threads=2), *read_passes(paths)
        here = ours["Object Index"][..., 0] == 1
        assert here.sum() > 500
        return exported, *(each["Combined"][here][:, :3] for each in (ours, *theirs))

    return make


def state():
    """What is in the file."""
    kinds = ("objects", "meshes", "materials", "node_groups", "scenes", "libraries", "texts")
    found = {kind: sorted(block.name for block in getattr(bpy.data, kind)) for kind in kinds}
    block = bpy.data.objects["Cube"]
    tree = block.data.materials[0].node_tree
    images = sorted(image.name for image in bpy.data.images if image.type != "RENDER_RESULT")
    of_block = [[each.name for each in some] for some in (block.modifiers, block.data.uv_layers, block.data.attributes)]
    of_block += [block.modifiers.active, block.data.uv_layers.active]
    return found, images, of_block, [node.name for node in tree.nodes], len(tree.links)


def test_both_sides_show_the_baked_image_which_is_nearly_what_cycles_computes(sheet, sides, tmp_path, monkeypatch):
    sheet()
    bpy.context.scene.render.bake.use_selected_to_active = True
    before = state()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    exported, ours, shown, true = sides()
    assert "an image of" in told(exported) and "that Cycles bakes of it stands in, exact to" in told(exported)
    assert np.ptp(true, axis=0).min() > 0.01, "nothing varies"
    assert np.abs(ours - shown).max() < SAME
    assert np.percentile(np.abs(shown - true), 99) < baker.DIFFERENCE
    assert state() == before and not [*tmp_path.glob("viewcam-*")]
    (picture,) = exported.images.values()
    assert picture.pixels.dtype == np.float32


def test_inputs_of_one_shader_are_baked_each_as_a_color_or_a_number(sheet):
    block = sheet()
    tree = block.active_material.node_tree
    principled = tree.nodes.new("ShaderNodeBsdfPrincipled")
    for name in ("Base Color", "Roughness"):
        tree.links.new(next(node for node in tree.nodes if node.type == "TEX_SKY").outputs[0], principled.inputs[name])
    tree.links.new(principled.outputs[0], tree.nodes["Output"].inputs["Surface"])
    exported = export()
    assert "a plain one stands in" not in told(exported) and "bakes of it stands in" in told(exported)
    colors, numbers = (
        next(picture.pixels for name, picture in exported.images.items() if each in name) for each in ("Base", "Rough")
    )
    covered = charts.covered(np.array([4, 3, 5, 4, 3, 5]), np.ones(6, bool), len(colors) // 3)
    assert (numbers == numbers[..., :1]).all() and not (colors == colors[..., :1])[covered].all()
    # The weights of a luminance are rounded to four digits in older versions.
    assert np.abs(numbers[..., 0] - colors @ (0.2126390, 0.7151687, 0.0721923))[covered].max() < 1e-4 * colors.max()


@pytest.mark.parametrize("wrong", ["a texel further", "another attribute"])
def test_an_image_in_another_place_is_found(sheet, sides, monkeypatch, wrong):
    block = sheet()
    right, node = charts.corners, native._described_node
    if wrong == "a texel further":
        monkeypatch.setattr(charts, "corners", lambda *faces: right(*faces) + np.float32([1 / 384, 0]))
    else:
        block.data.uv_layers.new(name="UVMap")

        def described(made, *numbers):
            of_another = (*made.inputs, ("name", "uv"))
            return node(native.Node(made.type, of_another) if made.type == "attribute" else made, *numbers)

        monkeypatch.setattr(native, "_described_node", described)
    exported, ours, shown, _ = sides()
    assert "an image of 384 × 384" in told(exported)
    assert np.median(np.abs(ours - shown)) > 10 * SAME


def test_geometry_nodes_lay_faces_out_as_numpy_does_and_none_over_another(sheet):
    block = sheet()
    with overridden() as overrides:
        charts.lay_out(overrides, block, 6)
        mesh = block.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        values = export_geometry.read(mesh.attributes[charts.NAME].data, "vector", np.float32, 3)
        starts, totals = (export_geometry.read(mesh.polygons, name, np.int32) for name in ("loop_start", "loop_total"))
        assert sorted(totals) == [3, 3, 4, 4, 5, 5]
        assert np.abs(values[:, :2] - charts.corners(starts, totals)).max() < 1e-6
    cells = np.floor(charts.corners(starts, totals) * charts.columns(len(totals)))
    of_faces = [{tuple(cell) for cell in cells[start : start + total]} for start, total in zip(starts, totals, strict=True)]
    assert all(len(each) == 1 for each in of_faces) and len(set.union(*of_faces)) == 6


def test_the_texels_of_faces_are_as_many_as_they_are_large():
    totals, size = np.array([3, 4, 5, 7, 4]), 128
    for shown in (np.ones(5, bool), np.array([False, True, False, False, False])):
        area = (totals * np.sin(2 * np.pi / totals) * (charts.RADIUS * size) ** 2 / 2)[shown].sum()
        assert charts.covered(totals, shown, size).sum() == pytest.approx(area, rel=0.01)


def test_what_an_image_of_half_the_width_does_not_show_is_the_difference():
    x, y = np.meshgrid(*[(np.arange(64) + 0.5) / 64] * 2)
    whole, inner = np.ones((64, 64), bool), np.zeros((64, 64), bool)
    inner[2:-2, 2:-2] = True

    def both(made):
        fine = np.repeat(made[..., np.newaxis], 3, axis=2).astype(np.float32)
        return fine.reshape(32, 2, 32, 2, 3).mean(axis=(1, 3)), fine

    assert charts.difference(*both(0.3 * x + 0.6 * y), inner) < 1e-6, "a plane is interpolated as it is"
    assert 0.2 < charts.difference(*both((x > 0.51).astype(float)), whole) <= 0.5
    assert charts.difference(*both(100 + 10 * x * x), inner) < 1e-4 < charts.difference(*both(x * x), inner)


def test_what_no_image_shows_exactly_enough_is_named_with_the_difference(sheet, monkeypatch):
    block = sheet(scale=5000.0)
    exported = export()
    assert "differs from one of half its width by" in told(exported) and "a plain one stands in" in told(exported)
    assert not exported.images and exported.materials[block.active_material.name].surface is None


def test_what_is_occluded_is_baked_until_it_is_hardly_noisy(sheet, sides, add, mesh_from):
    """As a number, on one of two materials of an object, through a node group."""
    block = sheet(node="AmbientOcclusion")
    add(mesh_from("plane", size=6), "Wall", location=(0, 0, -0.4))
    tree = block.active_material.node_tree
    occlusion = next(node for node in tree.nodes if node.type == "AMBIENT_OCCLUSION")
    occlusion.samples, occlusion.inside = 32, False
    group = bpy.data.node_groups.new("Group", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketFloat")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketFloat")
    group.links.new(group.nodes.new("NodeGroupInput").outputs[0], group.nodes.new("NodeGroupOutput").inputs[0])
    through = tree.nodes.new("ShaderNodeGroup")
    through.node_tree = group
    tree.links.remove(tree.nodes["Shader"].inputs["Color"].links[0])
    tree.links.new(occlusion.outputs["AO"], through.inputs[0])
    tree.links.new(through.outputs[0], tree.nodes["Shader"].inputs["Strength"])
    other = block.active_material.copy()
    other.node_tree.links.remove(other.node_tree.nodes["Shader"].inputs["Strength"].links[0])
    other.node_tree.nodes["Shader"].inputs["Strength"].default_value = 0.0
    block.data.materials.append(other)
    block.data.materials.append(None)
    block.data.polygons[1].material_index = 1
    exported, ours, shown, true = sides()
    assert "bakes of it stands in" in told(exported), told(exported)
    assert np.abs(ours - shown).max() < SAME and np.ptp(shown) > 0.05
    lit = true[:, 0] > 0
    assert lit.mean() < 0.9 and abs(true[lit].mean() - shown[lit].mean()) < 0.01  # calibrated: of 32 samples a pixel there


@pytest.mark.parametrize(
    ("obstacle", "why"),
    [
        ("the way it is seen", ""),
        ("two objects", ", nor baked, since it is shown in several places"),
        ("an instance", ", nor baked, since what shows it is an instance, linked, being edited, or no mesh"),
        ("an object that is edited", ", nor baked, since what shows it is an instance, linked, being edited, or no mesh"),
        ("many faces", ", nor baked, since its mesh has more than 16,384 faces"),
        ("a driver in Python", ", nor baked, since Python drives something in the file"),
        ("no such node", ""),
    ],
)
def test_what_an_image_cannot_stand_in_for_is_named_with_the_reason(sheet, add, monkeypatch, obstacle, why):
    monkeypatch.setattr(another_blender, "call", lambda *_: pytest.fail("another Blender was asked to bake it"))
    block = sheet(node="ParticleInfo" if obstacle == "no such node" else "TexSky")
    tree = block.active_material.node_tree
    sky = next(node for node in tree.nodes if node.type in ("TEX_SKY", "PARTICLE_INFO"))
    if obstacle == "the way it is seen":
        tree.links.new(tree.nodes.new("ShaderNodeLayerWeight").outputs["Facing"], sky.inputs["Vector"])
    elif obstacle == "two objects":
        add(bpy.data.meshes["Sheet"], "Other", location=(0, 0, -1))
    elif obstacle == "an instance":
        parent = add(None, "Parent")
        collection = bpy.data.collections.new("Sheets")
        collection.objects.link(block)
        bpy.context.scene.collection.objects.unlink(block)
        parent.instance_type, parent.instance_collection = "COLLECTION", collection
    elif obstacle == "many faces":
        block.modifiers.new("Many", "SUBSURF").render_levels = block.modifiers["Many"].levels = 6
    elif obstacle == "a driver in Python":
        block.driver_add("location", 2).driver.expression = "noise.random()"
    elif obstacle == "an object that is edited":
        bpy.context.view_layer.objects.active = block
        bpy.ops.object.mode_set(mode="EDIT")
    exported = export()
    assert f"not modelled{why}, and a plain one stands in" in told(exported) and not exported.images


@pytest.mark.usefixtures("other_blender_fails")
def test_where_no_other_blender_bakes_it_the_material_is_a_plain_one(sheet):
    sheet()
    assert "not modelled, nor can another Blender bake it, and a plain one stands in" in told(export())
