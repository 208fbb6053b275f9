"""Tables filled in pieces: each entry once, the same however the work is cut, and made by one thread."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import tables
from viewcam_addon.tracer.rays.balls import balls_of
from viewcam_addon.tracer.rays.offset import triangle_offsets
from viewcam_addon.tracer.rays.tables import AT_A_TIME, by_material, each, joined, made_once, parts, pieces, spread
from viewcam_addon.tracer.rays.triangles import Planes, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Mesh, Object

VIEW = View(Pinhole((3, -7, 4), (0, 0, 0), (0, 0, 1), 100.0, 100, 100))
LAZY = ("object_index", "material_index", "corner_normals", "corner_uvs", "mapped")


@given(counts=st.lists(st.one_of(st.integers(0, 40), st.integers(AT_A_TIME - 2, 3 * AT_A_TIME + 2)), max_size=12))
def test_pieces_hold_every_entry_once_and_in_order(counts):
    numbers = [np.arange(count) + 100_000 * number for number, count in enumerate(counts)]
    found, end = [np.empty(0, int)], 0
    for where, some in pieces(counts):
        assert where.start == end and 0 < where.stop - where.start <= AT_A_TIME
        assert len(joined(numbers, some)) == where.stop - where.start
        owners = np.broadcast_to(spread(np.arange(len(counts)), some), where.stop - where.start)
        assert np.array_equal(joined(numbers, some) // 100_000, owners)
        found.append(joined(numbers, some))
        end = where.stop
    assert np.array_equal(np.concatenate(found), np.concatenate([np.empty(0, int), *numbers]))
    assert sum(part.stop - part.start for part in parts(end)) == end


def many_objects(rng, make_mesh, random_matrix):
    """Objects of all sizes with every combination of normals, UV maps, materials and sharing."""
    meshes = []
    for number, count in enumerate((1, 40, 2, 5000, 3, 1, 17)):
        vertices = rng.normal(size=(count + 2, 3))
        triangles = np.stack([np.arange(count), np.arange(count) + 1, np.arange(count) + 2], axis=1)
        more = {"corner_normals": rng.normal(size=(count, 3, 3))} if number % 2 else {}
        more |= {"corner_uvs": rng.uniform(size=(count, 3, 2))} if number % 3 else {}
        meshes.append(make_mesh(vertices, triangles, rng.integers(0, 3, count), **more))
    chosen = [meshes[number] for number in rng.integers(0, len(meshes), 60)]
    return [
        (Object(f"{n}", "", random_matrix(rng), n, tuple(rng.integers(0, 99, 3).tolist())), mesh)
        for n, mesh in enumerate(chosen)
    ]


def all_tables(pairs, threads):
    triangles = triangles_of(pairs, VIEW, threads)
    planes = Planes(triangles, VIEW)
    found = {name: getattr(triangles, name) for name in ("vertices", "corners", *LAZY)}
    found |= {name: getattr(planes, name) for name in ("forms", "span", "side", "wide", "distance", "normals", "magnitude")}
    return found | {"offset": triangle_offsets(triangles)}


@pytest.mark.parametrize("at_a_time", [61, 100_000])
@pytest.mark.parametrize("threads", [1, 3])
def test_tables_are_the_same_bit_for_bit_however_they_are_cut(at_a_time, threads, make_mesh, random_matrix, monkeypatch):
    pairs = many_objects(np.random.default_rng(4), make_mesh, random_matrix)
    expected = all_tables(pairs, 1)
    monkeypatch.setattr(tables, "AT_A_TIME", at_a_time)
    for name, table in all_tables(pairs, threads).items():
        differing = np.count_nonzero(table != expected[name])
        assert table.tobytes() == expected[name].tobytes(), f"{differing} of {table.size} entries of {name} differ"


def test_objects_together_have_the_tables_of_each_alone(make_mesh, random_matrix):
    """But for the normals of meshes with several users, which are normalised only where there is one."""
    pairs = [(placed, replace(mesh)) for placed, mesh in many_objects(np.random.default_rng(5), make_mesh, random_matrix)]
    together, end = all_tables(pairs, 1), 0
    for pair in pairs:
        begin, end = end, end + len(pair[1].triangles)
        alone = all_tables([pair], 1)
        for name in ("object_index", "material_index", "forms", "span", "side", "distance", "magnitude", "offset"):
            assert together[name][..., begin:end].tobytes() == alone[name].tobytes(), f"{name} of {pair[0].name}"
        for name in ("corner_normals", "corner_uvs"):
            lone = 0 if alone[name] is None else alone[name]
            assert np.array_equal(together[name][:, begin:end], np.broadcast_to(lone, together[name][:, begin:end].shape))
        assert (together["mapped"][begin:end] == (pair[1].corner_uvs is not None)).all()


def test_spheres_together_are_those_of_each_object_alone(make_spheres, random_matrix):
    rng = np.random.default_rng(6)
    pairs = [
        (Object(f"{n}", "", random_matrix(rng)), make_spheres(rng.normal(size=(n, 3)), rng.uniform(0, 1, n))) for n in range(6)
    ]
    pairs[3][0].matrix[:3, 1] = 0  # flat
    together = balls_of(pairs, VIEW)
    apart = [balls_of([pair], VIEW) for pair in pairs]
    for name in ("centres", "radii", "axes", "reach"):
        alone = np.concatenate([getattr(balls, name) for balls in apart], axis=-1)
        np.testing.assert_allclose(getattr(together, name), alone, rtol=0, atol=0, err_msg=name)
    assert together.count == 15 - 3 and (np.bincount(together.owner, minlength=6) == [0, 1, 2, 0, 4, 5]).all()


def test_what_materials_have_is_found_by_object_and_slot():
    def mesh(materials):
        count = len(materials)
        return Mesh(np.zeros((3, 3)), np.zeros((count, 3), np.int32), np.array(materials, np.int32))

    things = [
        (Object("a", "", np.eye(4)), mesh([1, 0, 1])),
        (Object("b", "", np.eye(4)), mesh([])),
        (Object("c", "", np.eye(4)), mesh([0])),
    ]
    found = by_material(things, [(10, 20), (30,), (40, 50)], np.float32)
    assert found.tolist() == [20, 10, 20, 40] and found.dtype == np.float32
    assert by_material([], [], np.int32).shape == (0,)


def test_a_table_is_made_once_while_other_threads_wait():
    class Thing:
        made = 0

        @made_once
        def table(self):
            """What it is."""
            Thing.made += 1
            time.sleep(0.05)
            return threading.get_ident()

    thing = Thing()
    with ThreadPoolExecutor(4) as pool:
        found = set(pool.map(lambda _: thing.table, range(8)))
    assert Thing.made == 1 and len(found) == 1
    assert Thing().table and Thing.made == 2, "another object has its own"
    assert Thing.table.__doc__ == "What it is."


def test_a_table_whose_making_failed_is_made_the_next_time():
    class Thing:
        memory = 0

        @made_once
        def table(self):
            if not self.memory:
                raise MemoryError
            return 5

    thing = Thing()
    with pytest.raises(MemoryError):
        _ = thing.table
    thing.memory = 1
    assert thing.table == 5


@pytest.mark.parametrize("threads", [1, 2])
def test_what_a_thread_raises_is_raised(threads):
    with pytest.raises(ZeroDivisionError):
        each(lambda item: 1 // item, [2, 1, 0], threads)
    assert each(lambda item: 2 * item, [2, 1, 0], threads) == [4, 2, 0]
