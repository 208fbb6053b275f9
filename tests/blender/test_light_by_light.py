"""Each kind of light by itself, in ten random scenes, here and in Cycles: one sample where nothing is random, else many.

The figures are those measured between Cycles and formulas (relative error of one sample, median and 99th percentile), which the
tracer has to meet through export, tracing and rounding to float32: 2⁻²⁴ is added for that.
"""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.comparison import radiance
from viewcam_addon.image import Image
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer.render import render

pytestmark = pytest.mark.slow

FLOAT32 = 2.0**-24
SCENES = 10


@pytest.fixture
def stage(fresh_blender, scene, camera_object, make_material, add_lamp, read_passes, tmp_path):
    """A matte floor with boxes on it, and `compare(light, samples)`, which has ten scenes rendered on both sides.

    light : called with a random generator, adds what gives light. Returns pairs of passes, ours and Cycles'.
    """
    scene.render.resolution_x, scene.render.resolution_y = 40, 30
    camera_object.location, camera_object.rotation_euler = (5, -4, 4), (math.radians(58), 0, math.radians(51))
    matte = make_material("Matte", "ShaderNodeBsdfDiffuse", Color=(0.8, 0.5, 0.2, 1), Roughness=0.0)
    bpy.ops.mesh.primitive_plane_add(size=14)
    bpy.context.object.data.materials.append(matte)
    boxes = []
    for _ in range(4):
        bpy.ops.mesh.primitive_cube_add(size=1)
        bpy.context.object.data.materials.append(matte)
        boxes.append(bpy.context.object)

    def compare(light, samples=1, pictures=1, is_turned=True):
        traced, paths = [], []
        for number in range(SCENES):
            rng = np.random.default_rng(number)
            for box in boxes:
                box.location = (*rng.uniform(-2, 2, 2), rng.uniform(0, 1))
                box.rotation_euler = rng.uniform(-3, 3, 3) * is_turned
            added = light(rng)
            bpy.context.view_layer.update()
            batch = [tmp_path / f"{number}-{picture}.exr" for picture in range(pictures)]
            exported = jobs.both_sides(Job(level="direct", samples=samples, seed=number), batch)
            traced.append((exported, render(exported, "direct", samples, seed=number, threads=1)))
            paths += batch
            bpy.data.objects.remove(added)
        passes = read_passes(paths)
        return [(*own, passes[first * pictures : (first + 1) * pictures]) for first, own in enumerate(traced)]

    return compare


def turned(rng, most):
    """Euler angles of something that looks down, up to so many radians aslant."""
    return (rng.uniform(-most, most), rng.uniform(-most, most), rng.uniform(-3, 3))


def relative_errors(pairs):
    """Relative errors where both sides are lit, and how many pixels are lit on one side alone.

    Without what gets less than a tenth of the most in its picture: where light grazes, the rounding of Cycles' normals counts.
    """
    errors, alone, lit = [], 0, 0
    for _, traced, (cycles,) in pairs:
        traced, cycles = (np.asarray(passes["Combined"][..., :3], np.float64) for passes in (traced, cycles))
        both = (traced > 0) & (cycles > 0)
        alone += int(((traced > 0) != (cycles > 0)).any(axis=-1).sum())
        lit += int(both.any(axis=-1).sum())
        bright = cycles > cycles.max(axis=(0, 1)) / 10
        errors.append(np.abs(traced[both & bright] / cycles[both & bright] - 1))
    assert lit > 2000, f"only {lit} pixels of {SCENES} pictures are lit"
    return np.concatenate(errors), alone


def assert_within(pairs, median, most):
    errors, alone = relative_errors(pairs)
    p50, p99 = np.percentile(errors, (50, 99))
    assert p50 <= median + FLOAT32 and p99 <= most + FLOAT32, f"median {p50:.2g}, 99th percentile {p99:.2g}"
    # Shadows' edges: Cycles' shadow rays are float32, which is a fifty-thousandth of a pixel here.
    assert alone <= 1, f"{alone} pixels are lit on one side only"


def test_a_sun_without_an_angle(stage, add_lamp):
    pairs = stage(lambda rng: add_lamp("SUN", rotation=turned(rng, 0.9), energy=rng.uniform(0.1, 9), angle=0), is_turned=False)
    assert_within(pairs, 7e-8, 1.9e-7)


def test_a_point_without_a_radius(stage, add_lamp):
    def light(rng):
        return add_lamp("POINT", (*rng.uniform(-3, 3, 2), rng.uniform(4, 7)), energy=rng.uniform(1, 900), shadow_soft_size=0)

    assert_within(stage(light, is_turned=False), 2.4e-7, 9e-7)


def test_a_spot_without_a_radius(stage, add_lamp):
    """Scaled differently along its axes; where it fades, Cycles' float32 has errors of its own."""

    def light(rng):
        spot = add_lamp(
            "SPOT",
            (*rng.uniform(-1, 1, 2), rng.uniform(3, 5)),
            turned(rng, 0.3),
            energy=900,
            shadow_soft_size=0,
            spot_size=rng.uniform(0.9, 2.2),
            spot_blend=rng.uniform(0.2, 1),
        )
        spot.scale = rng.uniform(0.7, 1.5, 3)
        return spot

    assert_within(stage(light), 1.2e-6, 2e-4)


@pytest.mark.parametrize(
    "shape",
    [
        pytest.param("SQUARE", marks=pytest.mark.exhaustive),
        "RECTANGLE",
        pytest.param("DISK", marks=pytest.mark.exhaustive),
        pytest.param("ELLIPSE", marks=pytest.mark.exhaustive),
    ],
)
def test_an_area_light_and_how_it_is_seen(stage, add_lamp, shape):
    def light(rng):
        lamp = add_lamp("AREA", (*rng.uniform(-2, 2, 2), rng.uniform(1.5, 3)), turned(rng, 0.5), energy=200, shape=shape)
        lamp.data.size, lamp.data.size_y = rng.uniform(0.2, 3, 2)
        lamp.scale = (rng.choice([-1, 1, 2]), 1, 1)
        return lamp

    assert_same_within_noise(stage(light, 64, 4))


@pytest.mark.parametrize(
    ("kind", "soft"),
    [
        ("POINT", False),
        pytest.param("POINT", True, marks=pytest.mark.exhaustive),
        pytest.param("SPOT", False, marks=pytest.mark.exhaustive),
        ("SPOT", True),
    ],
)
def test_a_sphere_of_light_and_how_it_is_seen(stage, add_lamp, kind, soft):
    def light(rng):
        place = (*rng.uniform(-2, 2, 2), rng.uniform(1.5, 3))
        lamp = add_lamp(kind, place, turned(rng, 0.5), energy=200, shadow_soft_size=rng.uniform(0.1, 1.2))
        lamp.data.use_soft_falloff = soft
        return lamp

    assert_same_within_noise(stage(light, 64, 4))


def nodes(lamp, output):
    """Let a lamp's color be a Texture Coordinate of its place, without signs, and its light fall off with the distance."""
    if not lamp.data.node_tree:
        lamp.data.use_nodes = True
    lamp.data.use_nodes = True
    tree = lamp.data.node_tree
    emission = next(node for node in tree.nodes if node.type == "EMISSION")
    absolute = tree.nodes.new("ShaderNodeVectorMath")
    absolute.operation = "ABSOLUTE"
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs[output], absolute.inputs[0])
    tree.links.new(absolute.outputs[0], emission.inputs["Color"])
    tree.links.new(tree.nodes.new("ShaderNodeLightFalloff").outputs["Linear"], emission.inputs["Strength"])


NODES = [
    ("AREA", "UV"),
    ("POINT", "Normal"),
    pytest.param("POINT", "UV", marks=pytest.mark.exhaustive),
    pytest.param("SPOT", "UV", marks=pytest.mark.exhaustive),
    pytest.param("SPOT", "Object", marks=pytest.mark.exhaustive),
]


@pytest.mark.parametrize(("kind", "output"), NODES)
def test_lamps_that_are_not_the_same_all_over_and_how_they_are_seen(stage, add_lamp, kind, output):
    def light(rng):
        size = {"size": rng.uniform(0.5, 2)} if kind == "AREA" else {"shadow_soft_size": rng.uniform(0.1, 0.8)}
        lamp = add_lamp(kind, (*rng.uniform(-2, 2, 2), rng.uniform(2, 3)), turned(rng, 0.5), energy=200, **size)
        nodes(lamp, output)
        return lamp

    assert_same_within_noise(stage(light, 64, 4))


def test_a_picture_on_a_lamp_that_is_a_little_aside_is_told(stage, add_lamp, monkeypatch):
    """Its UV begins at 0.02 in place of 0."""
    from viewcam_addon.tracer import native

    right = native._described_node

    def described(node, *numbers):
        if node.type == "math" and node["operation"] == "add" and isinstance(node["a"], native.Node):
            node = native.Node(node.type, (*node.inputs, ("b", node["b"][0] + 0.02)))
        return right(node, *numbers)

    def light(rng):
        lamp = add_lamp("AREA", (0, 0, 2), energy=200, size=2)
        nodes(lamp, "UV")
        return lamp

    monkeypatch.setattr(native, "_described_node", described)
    failures = sum(not same_within_noise(*pair)[0] for pair in stage(light, 64, 4))
    assert failures > SCENES / 2, f"only {failures} of {SCENES} pictures are found to be wrong"


def test_a_sun_with_an_angle(stage, add_lamp):
    def light(rng):
        return add_lamp("SUN", rotation=turned(rng, 0.9), energy=3, angle=math.pi if rng.random() < 0.2 else rng.uniform(0, 1))

    assert_same_within_noise(stage(light, 64, 4))


def same_within_noise(exported, traced, cycles):
    """True if light is the same but for noise, and the lines that say so."""
    images = [Image(passes) for passes in cycles]
    comparison = radiance.compare(Image(traced, {"samples": "64"}), images, exported.camera, test_samples=16)
    return all(row.ok for row in comparison.rows if row.name != "Diffuse Color"), "\n".join(comparison.lines())


def assert_same_within_noise(pairs):
    for pair in pairs:
        same, lines = same_within_noise(*pair)
        assert same, lines


def test_one_percent_more_light_is_told(stage, add_lamp):
    pairs = stage(lambda rng: add_lamp("AREA", (0, 0, 2), energy=200, size=2), 64, 4)
    brighter = [
        (exported, dict(traced, Combined=traced["Combined"] * np.float32(1.01)), cycles) for exported, traced, cycles in pairs
    ]
    failures = sum(not same_within_noise(*pair)[0] for pair in brighter)
    assert failures == SCENES, f"only {failures} of {SCENES} pictures are found to be wrong"


def test_a_thousandth_more_light_of_one_sample_is_told(stage, add_lamp):
    """A thousandth more light is a thousand times more than Cycles' rounding."""
    pairs = stage(lambda rng: add_lamp("SUN", rotation=turned(rng, 0.9), energy=3, angle=0), is_turned=False)
    for _, traced, _ in pairs:
        traced["Combined"] *= np.float32(1.001)
    with pytest.raises(AssertionError, match="median"):
        assert_within(pairs, 7e-8, 1.9e-7)
