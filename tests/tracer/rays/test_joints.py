"""Which triangles share an edge, against a dictionary of edges."""

from collections import Counter, defaultdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from viewcam_addon.pinhole import Pinhole
from viewcam_addon.tracer.rays import joints as joints_module
from viewcam_addon.tracer.rays.joints import Joints, corners_of
from viewcam_addon.tracer.rays.triangles import Planes, triangles_of
from viewcam_addon.tracer.rays.view import View
from viewcam_addon.tracer.scene import Object

CAMERA = Pinhole((5, 4, 3), (0, 0, 0), (0, 0, 1), 100, 16, 16)


@pytest.fixture(scope="module")
def triangles_seen(make_scene):
    """triangles_seen(mesh or (mesh, matrix), …) → Triangles."""

    def build(*things):
        scene = make_scene(CAMERA, *things)
        return triangles_of([(placed, scene.geometries[placed.geometry]) for placed in scene.objects], View(CAMERA))

    return build


def sphere(levels: int):
    """Vertices and triangles of an octahedron, each face cut in four again and again, all vertices at distance 1."""
    vertices = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    faces = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    for _ in range(levels):
        middles, cut = {}, []

        def middle(one, other, middles=middles):
            if frozenset((one, other)) not in middles:
                middles[frozenset((one, other))] = len(vertices)
                point = np.add(vertices[one], vertices[other])
                vertices.append(tuple(point / np.linalg.norm(point)))
            return middles[frozenset((one, other))]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            cut += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = cut
    return np.array(vertices, float), np.array(faces)


def by_dictionary(vertices, triangles):
    """Pairs of triangles, how often an edge has another number of triangles than two."""
    edges = defaultdict(list)
    for number, corners in enumerate(triangles):
        places = [tuple(vertices[corner]) for corner in corners]
        for side in range(3):
            if corners[side] != corners[(side + 1) % 3]:
                edges[frozenset((places[side], places[(side + 1) % 3]))].append(number)
    pairs = sorted(tuple(sorted(users)) for users in edges.values() if len(users) == 2)
    return pairs, sum(len(users) for users in edges.values() if len(users) != 2)


@given(st.integers(0, 10**6), st.integers(1, 40), st.booleans())
@settings(max_examples=60, deadline=None)
def test_pairs_and_borders_are_those_of_the_mesh(triangles_seen, make_mesh, seed, count, doubled):
    rng = np.random.default_rng(seed)
    vertices, faces = rng.normal(size=(8, 3)), rng.integers(0, 8, (count, 3))
    if doubled:  # vertices at one place, as at the seams of a UV map
        vertices, faces = np.concatenate([vertices, vertices]), faces + 8 * rng.integers(0, 2, (count, 3))
        faces = faces[[len({corner % 8 for corner in face}) == 3 for face in faces.tolist()]]
    if not len(faces):
        return
    found = Joints(triangles_seen(make_mesh(vertices, faces)), 1e-3)
    pairs, borders = by_dictionary(vertices, faces)
    if not doubled:
        assert sorted(map(tuple, np.sort(found.pairs >> 2, axis=0).T.tolist())) == pairs
        assert len(found.borders) == borders
    else:  # an edge of three triangles of which two share the very vertices is a pair and a border
        assert set(pairs) <= set(map(tuple, np.sort(found.pairs >> 2, axis=0).T.tolist()))


def test_a_mesh_too_large_for_packed_keys_is_joined_just_so(triangles_seen, make_mesh, monkeypatch):
    triangles = triangles_seen(make_mesh(*sphere(3)))
    packed, ends = Joints(triangles, 0.01), joints_module._ends
    spread = 300_000_000  # as if the vertices were as many times more: the product of two of their numbers fills 64 bits
    monkeypatch.setattr(joints_module, "_ends", lambda *args: tuple(end.astype(np.int64) * spread for end in ends(*args)))
    corners = triangles.placed[0][1].triangles
    pairs, borders = joints_module._paired(corners, np.arange(4 * len(corners), dtype=np.int32).reshape(-1, 4)[:, :3].ravel())
    assert not len(borders)
    assert set(map(frozenset, pairs.T.tolist())) == set(map(frozenset, packed.pairs.T.tolist()))


def test_a_closed_ball_has_no_borders_and_its_silhouette_is_one_closed_line(triangles_seen, make_mesh):
    triangles = triangles_seen(make_mesh(*sphere(4)))
    joints = Joints(triangles, 1.0)
    assert not len(joints.borders)
    silhouette = joints.silhouettes(Planes(triangles, View(CAMERA)).side)
    start, end, _ = corners_of(triangles, joints.pairs[0][silhouette])
    visits = Counter(map(tuple, np.concatenate([start, end], axis=1).T.tolist()))
    assert len(silhouette) > 50
    assert set(visits.values()) == {2}, f"the line forks or ends: {visits.most_common(3)}"


def test_a_flat_ball_is_all_creases_and_a_smooth_one_has_none(triangles_seen, make_mesh):
    vertices, faces = sphere(3)
    normals = vertices[faces]
    smooth = Joints(triangles_seen(make_mesh(vertices, faces, corner_normals=normals)), 1e-6)
    assert not len(smooth.creases)
    # The angle between faces is about that between their middles: of 768, none is less than 0.005 or more than 0.3.
    for bend, expected in ((0.005, 768), (0.3, 0)):
        assert len(Joints(triangles_seen(make_mesh(vertices, faces)), bend).creases) == expected, bend
    normals = normals.copy()
    normals[7, 1] = np.linalg.qr(np.c_[normals[7, 1], np.eye(3)])[0][:, 1]  # of one corner, at right angles to what it was
    assert len(Joints(triangles_seen(make_mesh(vertices, faces, corner_normals=normals)), 0.5).creases) == 2


def test_a_change_of_material_is_a_crease_on_the_flattest_mesh(triangles_seen, make_mesh):
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)]
    for materials, expected in (([0, 0], 0), ([0, 1], 1)):
        mesh = make_mesh(*square, materials=materials)
        placed = Object("square", "square", np.eye(4), material_indices=(0, 0))
        joints = Joints(triangles_of([(placed, mesh)], View(CAMERA)), 1e-3)
        assert (joints.pairs.shape[1], len(joints.borders), len(joints.creases)) == (1, 4, expected)


def test_a_triangle_the_wrong_way_round_makes_no_silhouette(triangles_seen, make_mesh):
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    for faces in ([(0, 1, 2), (0, 2, 3)], [(0, 1, 2), (0, 3, 2)]):
        triangles = triangles_seen(make_mesh(vertices, faces))
        joints = Joints(triangles, 1e-3)
        assert not len(joints.silhouettes(Planes(triangles, View(CAMERA)).side)), faces
        assert not len(joints.creases), faces


def test_objects_that_share_a_mesh_have_joints_of_their_own(triangles_seen, make_mesh):
    mesh = make_mesh([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1)], [(0, 1, 2), (0, 2, 3)])
    squeezed = np.diag([1.0, 1.0, 1e-3, 1.0])
    joints = Joints(triangles_seen(mesh, (mesh, squeezed), mesh), 0.05)
    assert (joints.pairs >> 2).T.tolist() == [[0, 1], [2, 3], [4, 5]]
    # Squeezing flattens the crease, but might have widened it a thousand times: it counts.
    assert joints.creases.tolist() == [0, 1, 2]
