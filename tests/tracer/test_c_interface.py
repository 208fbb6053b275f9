"""The core's C interface, called below native.py with what native.py never gives: each call is refused by a sentence, or works.

What C can't know is not tried: the lengths of arrays, and pointers to what was freed. Rays may be anything at all. `make
test-sanitizers` runs this on a core that stops at whatever is read or written outside of an array.
"""

import ctypes
import os
import re
import subprocess
import sys
from ctypes import byref, c_int, c_void_p
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.image import GEOMETRY_PASSES
from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer import native
from viewcam_addon.tracer.scene import scene_file
from viewcam_addon.tracer.scene.value_nodes import IES
from viewcam_addon.tracer.scene.value_nodes import KINDS as VALUES

EXAMPLES = int(os.environ.get("VIEWCAM_FUZZ_CALLS", "60"))
HOSTILE = [0.0, -0.0, 1.0, -1.0, 0.5, 5e-324, 1e-300, 1e-30, 1e18, -1e18, 1e19, 1e300, np.inf, -np.inf, np.nan]
WHOLE = [0, 1, 2, 3, 7, -1, 2**24, 2**31 - 1, -(2**31)]
SMALL = st.floats(-3, 3)


def mostly(good, hostile):
    """A drawn value that is hostile once in a dozen."""
    return st.integers(0, 11).flatmap(lambda roll: st.sampled_from(hostile) if roll == 0 else good)


NUMBER = mostly(SMALL, HOSTILE)
LENGTH = mostly(st.floats(0, 3), HOSTILE)


class Calls:
    """The C interface of one scene. Keeps what the core reads in place, and counts what it refuses."""

    def __init__(self) -> None:
        self.core = native.core()
        self.scene = self.core.scene_create()
        self.kept, self.refused, self.counts, self.size = [], 0, [], (0, 0)

    def close(self) -> None:
        self.core.scene_free(self.scene)

    def __call__(self, name, *arguments) -> bool:
        """True if a function did what it was asked for; if not, it says why."""
        status = getattr(self.core, name)(*arguments)
        assert status in (0, 1, 2), f"{name} returns {status}"
        if status:
            self.refused += 1
            assert len(self.core.message().decode()) > 10, f"{name} does not say what is wrong"
        return status == 0

    def at(self, values, dtype):
        """The address of an array, which is kept."""
        self.kept.append(np.ascontiguousarray(values, dtype))
        return self.kept[-1].ctypes.data


def numbers(draw, count, each=NUMBER):
    """`count` numbers: a few that are drawn one by one, among even ones."""
    values = np.random.default_rng(draw(st.integers(0, 99))).uniform(-2, 2, count)
    for _ in range(min(count, 3)):
        values[draw(st.integers(0, count - 1))] = draw(each)
    return values


def add_mesh(draw, calls):
    vertices, count = draw(st.integers(0, 12)), draw(st.integers(0, 30))
    triangles = np.random.default_rng(draw(st.integers(0, 99))).integers(0, max(vertices, 1), 3 * count)
    if count and draw(st.integers(0, 5)) == 0:
        triangles[draw(st.integers(0, 3 * count - 1))] = draw(st.sampled_from(WHOLE))
    materials = np.full(count, draw(mostly(st.just(0), WHOLE)))
    with np.errstate(over="ignore"):
        floats = [numbers(draw, width * count).astype(np.float32) for width in (9, 6, 9)]
    optional = [calls.at(values, np.float32) if draw(st.booleans()) else None for values in floats]
    arrays = calls.at(numbers(draw, 3 * vertices), np.float64), calls.at(triangles, np.int32), calls.at(materials, np.int32)
    if calls("add_mesh", calls.scene, native._Mesh(vertices, count, *arrays, *optional)):
        calls.counts.append(int(materials.max(initial=0)) + 1)


def add_spheres(draw, calls):
    count = draw(st.integers(0, 12))
    radii, materials = np.abs(numbers(draw, count, LENGTH)), np.full(count, draw(mostly(st.just(0), WHOLE)))
    arrays = calls.at(numbers(draw, 3 * count), np.float64), calls.at(radii, np.float64), calls.at(materials, np.int32)
    if calls("add_spheres", calls.scene, native._Spheres(count, *arrays)):
        calls.counts.append(int(materials.max(initial=0)) + 1)


def add_objects(draw, calls):
    geometry, slots, count = draw(mostly(st.integers(0, 3), [2**32 - 1])), draw(st.integers(1, 3)), draw(st.integers(0, 5))
    arrays = (
        calls.at(np.zeros(slots), np.float32),
        calls.at(np.full(slots, draw(mostly(st.just(0), [1, 2**32 - 1]))), np.uint32),
    )
    info = calls.at(numbers(draw, 5 * max(count, 1)), np.float32) if draw(st.booleans()) else None
    calls("add_objects", calls.scene, native._Object(geometry, draw(st.integers(0, 63)), slots, count, 1.0, *arrays, info=info))
    return count


def commit(draw, calls, objects):
    matrices = np.tile(np.eye(4)[:3].ravel(), objects)
    for _ in range(min(objects, 4)):
        matrices[draw(st.integers(0, 12 * objects - 1))] = draw(NUMBER)
    origin = [draw(NUMBER) for _ in range(3)]
    arrays = calls.at(matrices, np.float64), calls.at(origin, np.float64), draw(mostly(st.just(2), WHOLE))
    return calls("commit", calls.scene, *arrays)


def look(draw, calls):
    camera = native._Camera(t_min=draw(mostly(st.just(0.0), HOSTILE)), t_max=draw(mostly(st.just(np.inf), HOSTILE)))
    for name in ("eye", "right", "up", "forward", "principal_point", "distance"):
        field = getattr(camera, name)
        field[:] = [draw(NUMBER) for _ in field]
    camera.width, camera.height = draw(st.integers(0, 40)), draw(st.integers(0, 40))
    if calls("set_camera", calls.scene, camera):
        calls.size = camera.width, camera.height
        covered = np.full(camera.width * camera.height, 9, np.uint8)
        assert calls("silhouette", calls.scene, camera, covered.ctypes.data) and (covered <= 1).all()


def light_up(draw, calls):
    names = ("angle", "blend", "spread", "soft_falloff", "ellipse", "size", "radius")
    inputs = [native._Input(name.encode(), b"true", native._Color(image=-1, node=-1)) for name in names]
    for each in inputs:
        each.color.rgb[:] = [draw(LENGTH) for _ in range(3)]
        each.color.node = draw(mostly(st.just(-1), WHOLE))
    kind, count = draw(mostly(st.sampled_from([b"sun", b"point", b"spot", b"area"]), [b"", b"candle"])), draw(st.integers(6, 7))
    kind = native._Node(kind, (native._Input * len(inputs))(*inputs), count)
    lamp = native._Lamp(kind=kind, casts_shadow=True, hidden_from=draw(st.integers(0, 31)))
    for name in ("matrix", "color"):
        field = getattr(lamp, name)
        field[:] = [draw(NUMBER) for _ in field]
    calls("add_lamp", calls.scene, lamp, made_by(draw))
    film = native._Film(filter=draw(mostly(st.integers(0, 2), WHOLE)), filter_width=draw(LENGTH), exposure=draw(NUMBER))
    film.has_backdrop = draw(st.booleans())
    for world in (film.world, film.backdrop):
        world.image = draw(mostly(st.just(-1), WHOLE))
        world.radiance[:] = [draw(NUMBER) for _ in range(3)]
    calls("set_film", calls.scene, film)
    width, height = draw(st.integers(-1, 3)), draw(st.integers(-1, 3))
    pixels = calls.at(np.ones(4 * max(width * height, 1)), np.float32)
    texel = draw(mostly(st.integers(0, 4), WHOLE))
    calls("add_texture", calls.scene, width, height, draw(st.integers(2, 4)), draw(st.booleans()), texel, pixels)


def made_by(draw):
    """A color of a node, which there may be."""
    return native._Color((1.0, 1.0, 1.0), image=draw(mostly(st.just(-1), WHOLE)), node=draw(mostly(st.integers(-1, 1), WHOLE)))


def make_nodes(draw, calls):
    """Nodes of all kinds, of whatever words and numbers, which name images and nodes that may not be there."""
    for _ in range(draw(st.integers(0, 3))):
        kind = draw(mostly(st.sampled_from(sorted(VALUES)), ["principled", ""]))
        inputs = []
        for name, default in (VALUES[kind].inputs if kind in VALUES else {}).items():
            words = default if isinstance(default, tuple) and isinstance(default[0], str) else ("true", "false")
            entry = native._Input(name.encode(), draw(mostly(st.sampled_from(words), ["guess"])).encode())
            entry.color.rgb[:] = [draw(NUMBER) for _ in range(3)]
            entry.color.image, entry.color.node = (draw(mostly(st.integers(-1, 1), WHOLE)) for _ in range(2))
            inputs.append(entry)
        entry = native._Node(kind.encode(), (native._Input * len(inputs))(*inputs), draw(mostly(st.just(len(inputs)), [0])))
        if calls("add_node", calls.scene, entry):
            rows, values = calls.at(numbers(draw, 6 * 5), np.float64), np.empty((5, 4))
            calls("probe_nodes", calls.scene, 5, rows, values.ctypes.data)
            calls("constant_node", calls.scene, values.ctypes.data, byref(c_int()))


def test_the_core_has_the_nodes_of_the_table_and_asks_for_every_input_of_it():
    headers = Path(native.__file__).parent.glob("core/nodes/*.h")
    named = {name for header in headers for name in re.findall(r'NAME = "(\w+)"', header.read_text(encoding="utf-8"))}
    assert named - {"constant"} == set(VALUES)
    calls = Calls()
    assert calls("add_texture", calls.scene, 1, 1, 3, False, 0, calls.at(np.ones(4), np.float32))

    def is_made(kind, names, which=0):
        words = [word_of(VALUES[kind].inputs[name], which) for name in names]
        inputs = [native._Input(name.encode(), word, native._Color(node=-1)) for name, word in zip(names, words, strict=True)]
        return calls("add_node", calls.scene, native._Node(kind.encode(), (native._Input * len(inputs))(*inputs), len(inputs)))

    def word_of(default, which):
        chosen = default[which] if isinstance(default, tuple) and isinstance(default[0], str) else "true"
        return b"2 2 0 1 0 1 1 1 1 1" if default == IES else chosen.encode()

    for kind, row in VALUES.items():
        names = tuple(row.inputs)
        assert is_made(kind, names), f"the core has no {kind} with the inputs {', '.join(names)}"
        # By the first words, or by the last, as the direction of rings alone.
        left = [each for each in names if all(is_made(kind, set(names) - {each}, which) for which in (0, -1))]
        assert not left, f"the core's {kind} does not ask for {', '.join(left)}"
    calls.close()


def test_curves_without_a_table_are_refused():
    calls = Calls()
    inputs = [native._Input(name.encode(), b"true", native._Color(image=-1, node=-1)) for name in VALUES["rgb_curves"].inputs]
    assert not calls("add_node", calls.scene, native._Node(b"rgb_curves", (native._Input * len(inputs))(*inputs), len(inputs)))
    assert "table" in calls.core.message().decode()
    calls.close()


def trace(draw, calls):
    rays = calls.at(numbers(draw, 8 * 70), np.float64)
    t, objects, primitives, hidden = np.empty(70), np.empty(70, np.uint32), np.empty(70, np.uint32), np.empty(70, np.uint8)
    for packets in (0, 1):
        actual = t.ctypes.data, objects.ctypes.data, primitives.ctypes.data
        assert calls("closest", calls.scene, 70, rays, draw(st.integers(0, 63)), packets, *actual)
        assert calls("occluded", calls.scene, 70, rays, packets, hidden.ctypes.data)
    width, height = calls.size
    planes = np.empty((20, max(width * height, 1)), np.float32)
    each = (c_void_p * len(GEOMETRY_PASSES))(*(planes[2 * i :].ctypes.data for i in range(len(GEOMETRY_PASSES))))
    first, end = draw(mostly(st.just(0), WHOLE[:5])), draw(mostly(st.just(height), [*WHOLE[:5], 2**32 - 1]))
    calls("render_geometry", calls.scene, first, end, each, planes.shape[1], None)


def trace_light(draw, calls):
    bounces = [draw(mostly(st.integers(0, 4), [-1, 9])) for _ in range(5)]
    error = draw(mostly(st.sampled_from([0.0, 0.1]), HOSTILE))
    settings = native._LightSettings(seed=1, samples=draw(mostly(st.integers(1, 9), [0, 2**24 + 1, 2**32 - 1])), error=error)
    settings.bounces[:] = bounces
    light = c_void_p()
    if not calls("light_create", calls.scene, settings, byref(light)):
        return
    width, height = calls.size
    passes = np.zeros((len(native.LIGHT), 4 * max(width * height, 1)), np.float32)
    addresses = (c_void_p * len(passes))(*(values.ctypes.data if draw(st.integers(0, 30)) else None for values in passes))
    calls(
        "trace_light",
        light,
        draw(mostly(st.just(0), [1, 32, 2**32 - 1])),
        draw(mostly(st.just(0), [1, 32, 2**32 - 1])),
        draw(mostly(st.just(settings.samples), [0, 1, 3, 2**32 - 1])),
        addresses,
        None,
    )
    calls.core.light_free(light)


def story(draw, calls):
    """A scene, some of which is refused, and rays in what is left of it."""
    objects = 0
    for _ in range(draw(st.integers(1, 3))):
        draw(st.sampled_from([add_mesh, add_spheres]))(draw, calls)
    for _ in range(draw(st.integers(0, 3))):
        before = calls.refused
        count = add_objects(draw, calls)
        objects += count if calls.refused == before else 0
    if not commit(draw, calls, objects):
        return
    look(draw, calls)
    for _ in range(draw(st.integers(0, 2))):
        if not calls("add_material", calls.scene, None, 0, made_by(draw), 1):
            assert calls("add_material", calls.scene, None, 0, native._Color(image=-1, node=-1), 1)
        light_up(draw, calls)
        make_nodes(draw, calls)
    trace(draw, calls)
    trace_light(draw, calls)


@settings(max_examples=EXAMPLES, deadline=None)
@given(data=st.data())
def test_whatever_the_core_is_given_it_works_or_says_why_not(data):
    calls = Calls()
    try:
        story(data.draw, calls)
    finally:
        calls.close()


TRIANGLE = [0, 0, -1, 1, 0, -1, 0, 1, -1]


def mesh_of(calls, vertices=TRIANGLE, triangles=(0, 1, 2), materials=(0,)):
    arrays = calls.at(vertices, np.float64), calls.at(triangles, np.int32), calls.at(materials, np.int32)
    return native._Mesh(len(vertices) // 3, len(materials), *arrays, None, None, None)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"triangles": (0, 1, 3)}, "names no vertex"),
        ({"triangles": (0, 1, -1)}, "names no vertex"),
        ({"vertices": [np.nan, *TRIANGLE[1:]]}, "nowhere"),
        ({"vertices": [1e300, *TRIANGLE[1:]]}, "too far away"),
        ({"materials": (-1,)}, "material below 0"),
    ],
)
def test_a_mesh_that_reaches_outside_of_its_arrays_is_refused(wrong, words):
    calls = Calls()
    assert not calls("add_mesh", calls.scene, mesh_of(calls, **wrong)) and words in calls.core.message().decode()
    assert calls("add_mesh", calls.scene, mesh_of(calls))
    calls.close()


@pytest.mark.parametrize("matrix", [np.zeros((3, 4)), np.ones((3, 4)), np.diag([1, 1, 0, 0])[:3], np.eye(4)[:3] * 5e-324])
def test_an_object_that_its_matrix_flattens_does_no_harm(matrix):
    calls = Calls()
    calls("add_mesh", calls.scene, mesh_of(calls))
    indices, materials = calls.at([0], np.float32), calls.at([0], np.uint32)
    calls("add_objects", calls.scene, native._Object(0, 31, 1, 2, 1.0, indices, materials))
    assert calls("commit", calls.scene, calls.at([matrix, matrix], np.float64), calls.at(np.zeros(3), np.float64), 2)
    rays = calls.at(np.random.default_rng(1).normal(size=(64, 8)), np.float64)
    actual = np.empty(64), np.empty(64, np.uint32), np.empty(64, np.uint32)
    assert calls("closest", calls.scene, 64, rays, 1, 1, *(values.ctypes.data for values in actual))
    calls.close()


def test_arrays_of_another_shape_do_not_cross():
    for values, shape in (([1, 2, 3], (None, 3)), (np.zeros((2, 4)), (None, 3)), (np.zeros((2, 3)), (3, 3)), ([], (None, 3))):
        with pytest.raises(ValueError, match="in place of"):
            native.array(values, np.float64, shape)
    strided = np.arange(24.0).reshape(4, 6)[::2, ::2]
    assert native.array(strided, np.float64, (None, 3)).flags.c_contiguous


def test_the_table_of_functions_is_as_large_in_python_as_in_c():
    assert native.core().size == ctypes.sizeof(native._Core)


# --- Where the core is not installed, one sentence says what to do, and what does not trace works as ever


WITHOUT_CORE = """
import importlib.util, sys
find_spec = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "viewcam_core" else find_spec(name, *rest)
"""


@pytest.fixture
def run_without_core(tmp_path):
    """run_without_core(program) → what a process did in which no core is installed."""

    def run(program: str) -> subprocess.CompletedProcess:
        command = [sys.executable, "-c", WITHOUT_CORE + program]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)

    return run


def test_a_picture_asks_for_the_core_in_one_sentence_and_writes_nothing(run_without_core, make_scene, ball, tmp_path):
    scene_file.write(make_scene(Pinhole((0, -4, 0), (0, 0, 0), (0, 0, 1), 20, 8, 8), ball(6)), tmp_path / "scene.json")
    program = "sys.argv = ['viewcam', 'render', 'scene.json', 'picture.exr']\nfrom viewcam_addon.__main__ import main_and_exit"
    outcome = run_without_core(f"{program}\nmain_and_exit()")
    assert outcome.returncode != 0 and not (tmp_path / "picture.exr").exists()
    assert "the tracer's core is missing" in outcome.stderr and "pip install" in outcome.stderr, outcome.stderr
    assert "Traceback" not in outcome.stderr and len(outcome.stderr.strip().splitlines()) == 1, outcome.stderr


def test_the_panel_and_the_camera_work_without_it(run_without_core):
    pytest.importorskip("bpy")
    program = """
import bpy, viewcam_addon
viewcam_addon.register()
scene = bpy.context.scene
camera = scene.camera
camera.virtual_pinhole.enabled = True
camera.virtual_pinhole.eye = (1, -5, 2)
from viewcam_addon.blender import camera as read_camera
print("EYE", *(round(x, 4) for x in read_camera.read(camera, scene).eye))
from viewcam_addon.tracer import render
viewcam_addon.unregister()
"""
    outcome = run_without_core(program)
    assert outcome.returncode == 0, outcome.stderr
    assert "EYE 1.0 -5.0 2.0" in outcome.stdout, outcome.stdout
