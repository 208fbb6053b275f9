import functools
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

from benchmarks import memory
from benchmarks.charts import Curve
from benchmarks.scaling import growth, pixels, point, scenes, threads
from benchmarks.scaling.point import ADAPTIVE, DIRECT, FILE, FIRST_DIRECT, FIRST_GEOMETRY, GEOMETRY, PREPARING, Work, measure
from benchmarks.scaling.triangles import BYTES_A_TRIANGLE

X = np.array([1.0, 10.0, 100.0, 1000.0, 1e4])


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_the_exponent_of_a_power_is_found_to_the_last_digits(power):
    assert growth.exponent(X, 3 * X**power) == pytest.approx(power, abs=1e-12)
    assert growth.slope(X, 3 * X**-power) == pytest.approx(-power, abs=1e-12)


def test_a_fixed_part_is_left_out_of_the_fit_where_it_outweighs_what_grows():
    """Of 1 + x/500 the points at 10³ and 10⁴ have doubled: a line through them has the power log₁₀(21/3)."""
    assert growth.exponent(X, 1 + X / 500) == pytest.approx(np.log10(7), abs=1e-12)


@pytest.mark.parametrize("y", [np.ones(5), [1, 1.9, 1.2, 1.5, 1.9], [1, 1, 1, 1, 5], [9, 1, 1, 1, 1]])
def test_what_does_not_grow_has_no_exponent(y):
    assert growth.exponent(X, y) is None


def test_a_sentence_tells_the_exponents_and_what_does_not_grow():
    curves = [Curve("linear", X, X), Curve("square", X, X**2), Curve("flat", X, np.ones(5))]
    told = growth.told(curves, "the triangles")
    assert told == (
        "Fitted powers of the triangles, where it has at least doubled: linear 1.00, square 2.00. Hardly growing: flat."
    )


@pytest.mark.parametrize("count", [1_000, 12_345, 100_000])
def test_grounds_have_about_the_triangles_that_are_asked_for_in_one_mesh_and_in_many(count):
    """Squares are cut off to whole numbers: for the smallest patches of 1000 triangles by up to a 22nd on each side."""
    one, many = scenes.one_mesh(count), scenes.many_meshes(count)
    assert len(one.objects) == 1 and len(many.objects) == round((count / 1000) ** 0.5) ** 2
    assert all(abs(scenes.triangles_of(scene) / count - 1) < 0.1 for scene in (one, many))


def test_instances_count_each_time_and_their_arrays_once():
    one, many = scenes.instances(1), scenes.instances(50)
    assert scenes.triangles_of(many) == 50 * scenes.triangles_of(one)
    assert scenes.own_bytes(many) == scenes.own_bytes(one)


def test_a_triangle_of_the_scenes_own_takes_76_bytes_and_half_a_vertex():
    """12 of its vertices' numbers, 4 of its material, 36 of normals 24 of UVs; a vertex 24, and the border has more of them."""
    scene = scenes.one_mesh(100_000)
    assert scenes.own_bytes(scene) / scenes.triangles_of(scene) == pytest.approx(12 + 4 + 36 + 24 + 24 / 2, rel=0.01)


@pytest.mark.parametrize("make", [scenes.under_points, scenes.under_areas])
def test_many_lamps_give_as_much_light_together_as_one(make):
    assert sum(lamp.power[0] for lamp in make(30, 2).lamps) == pytest.approx(make(1, 2).lamps[0].power[0])


def _hold(megabytes):
    """The peak before and after so much memory was held and forgotten, and what a child of this process starts with."""
    memory.forget_peak()
    before = memory.peak()
    np.ones(megabytes * 125_000)
    during = memory.peak()
    memory.forget_peak()
    return during - before, memory.peak() - before


def test_the_peak_is_seen_and_forgotten():
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        held, forgotten = pool.submit(_hold, 200).result()
    assert held == pytest.approx(200e6, rel=0.05) and forgotten < 10e6, f"{held:,} and {forgotten:,} bytes"


def test_a_large_parent_is_not_seen_in_the_peak_of_its_child():
    """As it is in ru_maxrss: the child begins with its parent's."""
    large = np.ones(60_000_000)
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        assert pool.submit(memory.peak).result() < large.nbytes


@pytest.fixture(scope="module")
def measured():
    return measure(functools.partial(scenes.one_mesh, 100_000, (160, 90)), Work(samples=1, file=True, adaptive=True, once=True))


def test_a_point_tells_time_and_memory_of_each_stage(measured):
    assert (
        set(measured.seconds)
        == set(measured.peak)
        == {PREPARING, FIRST_GEOMETRY, GEOMETRY, FILE, FIRST_DIRECT, DIRECT, ADAPTIVE}
    )
    assert min(measured.seconds.values()) > 0
    assert measured.triangles == 2 * 224**2


def test_the_passes_of_a_picture_take_what_the_limit_says():
    tracer = point.Tracer(scenes.one_mesh(2, (40, 20)))
    pictures = {
        GEOMETRY: tracer.render(),
        DIRECT: tracer.render_light("direct", 1, 0),
        ADAPTIVE: tracer.render_light("direct", 1, 0, error=1.0),
    }
    for stage, passes in pictures.items():
        assert sum(values.nbytes for values in passes.values()) == 800 * pixels.BYTES_A_PIXEL[stage], stage


def _wasteful(triangles, size, waste):
    """A scene whose preparing takes so many bytes a triangle more."""
    make = point.Tracer

    def tracer(scene, threads):
        np.ones(waste * triangles // 8)
        return make(scene, threads)

    point.Tracer = tracer
    return scenes.one_mesh(triangles, size)


def test_waste_is_seen(measured):
    wasteful = measure(functools.partial(_wasteful, 100_000, (160, 90), 2000), Work(direct=False, once=True))
    assert wasteful.peak[PREPARING] > 2000 * 100_000 * 0.95 > 2 * measured.peak[PREPARING]


@pytest.mark.exhaustive
@pytest.mark.parametrize("make", [scenes.one_mesh, scenes.many_meshes])
def test_a_triangle_takes_less_than_300_bytes_beyond_the_scenes_own(make):
    """Beyond what a picture of as good as nothing takes; of so many that what is fixed is little.

    What a first picture of light makes for all later ones took 303 at its peak: pictures with all of it made are held to this.
    """
    counts, work = (1_000, 10_000_000), Work(samples=1, once=True)
    least, most = (measure(functools.partial(make, count, (160, 90)), work) for count in counts)
    each = {stage: (peak - least.peak[stage]) / most.triangles for stage, peak in most.peak.items() if "first" not in stage}
    assert max(each.values()) < BYTES_A_TRIANGLE, f"bytes a triangle: {each}"


def test_threads_are_charted_by_how_many_times_as_fast_they_are_as_one():
    chart = threads.chart([Curve("picture", (1, 2, 4), (8.0, 4.0, 4.0))], (320, 180), 1_000)
    drawn = {curve["name"]: (curve["x"], curve["y"]) for curve in chart.figures()["curves"]}
    assert drawn == {"work shared evenly": ([1, 2, 4], [1, 2, 4]), "picture": ([1, 2, 4], [1, 2, 2])}
    assert chart.reading.endswith("With 4: picture 2.00 (4 s).") and chart.behind() == []
