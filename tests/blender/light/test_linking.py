"""Light and shadow linking: what Blender's collections mean, and that Cycles shows the same.

Lamps without noise; surfaces that shine in mirrors and from afar without it, and near by within it.
"""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
from viewcam_addon.blender.scenes import linking
from viewcam_addon.jobs.job import Job
from viewcam_addon.tracer.render import render

ALL = {"Monkey", "Floor"}


@pytest.fixture
def lamp(stage, add_lamp):
    """A sun without a size over Suzanne and a floor."""
    stage(np.random.default_rng(0))
    return add_lamp("SUN", rotation=(0.3, 0.4, 0), angle=0.0, energy=2.0)


def linked(request="direct"):
    exported = jobs.export(Job(level=request))
    reasons = {entry.object: entry.reason for entry in exported.ledger if entry.status != "exported"}
    return exported.lamps[0].receivers, exported.lamps[0].blockers, reasons


@pytest.mark.parametrize(
    ("states", "expected"),
    [
        ({}, None),
        ({"Monkey": "INCLUDE"}, {"Monkey"}),
        ({"Monkey": "EXCLUDE"}, {"Floor"}),
        ({"Monkey": "EXCLUDE", "Floor": "INCLUDE"}, {"Floor"}),
        ({"Monkey": "EXCLUDE", "Floor": "EXCLUDE"}, set()),
        ({"Monkey": "INCLUDE", "Floor": "INCLUDE"}, None),
        ({"Inner": "INCLUDE"}, {"Monkey"}),
        ({"Inner": "EXCLUDE"}, {"Floor"}),
        ({"Inner": "INCLUDE", "Monkey": "EXCLUDE"}, {"Floor"}),
        ({"Lamp": "INCLUDE"}, set()),
        ({"Camera": "EXCLUDE"}, None),
    ],
)
def test_a_collection_means_what_it_includes_or_all_that_it_does_not_exclude(
    lamp, link, states, expected, tmp_path, read_passes
):
    bpy.data.collections.new("Inner").objects.link(bpy.data.objects["Monkey"])
    link(lamp, receiver_collection=states)
    receivers, blockers, reasons = linked()
    assert receivers == (None if expected is None else frozenset(expected)) and blockers is None and not reasons
    link(lamp, receiver_collection={}, blocker_collection=states)
    assert linked()[1] == receivers


@pytest.mark.parametrize(
    ("what", "state"),
    [("receiver_collection", "INCLUDE"), ("receiver_collection", "EXCLUDE"), ("blocker_collection", "EXCLUDE")],
)
@pytest.mark.parametrize("kind", ["SUN", "POINT"])
def test_cycles_shows_the_same_of_linked_lights(pictures, add_lamp, link, what, state, kind):
    """Light differs by 1e-6 (p50) and 2e-5 (p99), and nothing is lit on one side only but at edges of shadows."""
    size = {"angle": 0.0, "energy": 2.0} if kind == "SUN" else {"shadow_soft_size": 0.0, "energy": 900.0}
    lamp = add_lamp(kind, (0.5, 0.3, 4), (0.3, 0.4, 0), **size)

    def arrange(rng):
        link(lamp, **{what: {"Monkey": state}})

    differs = 0
    for each in pictures(arrange, scenes=3):
        traced, cycles = (passes["Combined"][..., :3].astype(np.float64) for passes in (each.traced, each.cycles[0]))
        lit = (traced > 0) & (cycles > 0)
        assert ((traced > 0) != (cycles > 0)).mean() < 1e-3
        error = np.abs(traced - cycles)[lit] / cycles[lit]
        assert np.percentile(error, 50) <= 1e-6 and np.percentile(error, 99) <= 2e-5
        (exported,) = each.exported.lamps
        plain = render(
            replace(each.exported, lamps=(replace(exported, receivers=None, blockers=None),)), "direct", 1, threads=2
        )
        differs += (np.abs(plain["Combined"][..., :3] - cycles) > 1e-3 * cycles.max()).mean() > 0.01
    assert differs >= 2  # linking is seen: without it, the difference is found


@pytest.fixture
def places(lamp, scene):
    """Two instances of Suzanne, named First and Second, in her own place."""
    placed = bpy.data.collections.new("Placed")
    placed.objects.link(bpy.data.objects["Monkey"])
    scene.collection.objects.unlink(bpy.data.objects["Monkey"])
    for number, name in enumerate(("First", "Second")):
        empty = bpy.data.objects.new(name, None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", placed, (3 * number - 1.5, 0, 0)
        scene.collection.objects.link(empty)


@pytest.mark.parametrize("state", ["INCLUDE", "EXCLUDE"])
@pytest.mark.parametrize("who", [("First", "Second"), ("Monkey",), ("Floor",)])
def test_instances_are_lit_by_what_lights_whoever_places_them_or_their_object_as_in_cycles(
    pictures, lamp, places, link, who, state
):
    link(lamp, receiver_collection=dict.fromkeys(who, state))
    for each in pictures(scenes=2):
        error = np.abs(each.traced["Combined"] - each.cycles[0]["Combined"])[..., :3].max(axis=-1)
        assert np.percentile(error, 99) < 1e-5 and each.cycles[0]["Combined"][..., :3].max() > 0.05, error.max()
        assert all(entry.status == "exported" for entry in each.exported.ledger), each.exported.ledger


def test_a_light_that_is_linked_to_some_places_of_an_object_is_named(lamp, places, link):
    link(lamp, receiver_collection={"First": "INCLUDE"})
    receivers, _, reasons = linked()
    assert receivers == {"Monkey"} and "linked to some places" in reasons["Lamp"], (receivers, reasons)


EVERYTHING = {"Monkey", "Floor", "Panel"}
LOSES = "Cycles would lose light"


@pytest.fixture
def panel(add, mesh_from, painted):
    """panel(size, height, strength) → a square that shines, above the stage."""

    def make(size, height, strength):
        block = add(mesh_from("plane", size=size), "Panel", (0.0, 0.0, height))
        block.data.materials.append(painted("ShaderNodeEmission", {"Color": (1.0, 0.8, 0.6, 1), "Strength": strength}))
        return block

    return make


def unlinked(exported):
    return replace(exported, objects=tuple(replace(placed, receivers=None, blockers=None) for placed in exported.objects))


def links_of(exported):
    return next((placed.receivers, placed.blockers) for placed in exported.objects if placed.name == "Panel")


def reasons(exported):
    return {entry.object: entry.reason for entry in exported.ledger if entry.status != "exported"}


def off(exported, traced, cycles):
    """The part of pixels lit on one side only, and the median and the 99th percentile of the relative error of all others."""
    traced_values, cycles_values = (passes["Combined"][..., :3].astype(np.float64) for passes in (traced, cycles))
    lit = (traced_values > 0) & (cycles_values > 0)
    error = np.abs(traced_values - cycles_values)[lit] / cycles_values[lit]
    return ((traced_values > 0) != (cycles_values > 0)).mean(), *(
        np.percentile(error, [50, 99]) if lit.any() else (np.inf, np.inf)
    )


LINKS = [
    {"receiver_collection": {"Monkey": "INCLUDE"}},
    {"receiver_collection": {"Monkey": "EXCLUDE"}},
    {"blocker_collection": {"Monkey": "EXCLUDE"}},
    {"blocker_collection": {"Floor": "INCLUDE"}},
    {"receiver_collection": {"Floor": "INCLUDE"}, "blocker_collection": {"Floor": "EXCLUDE"}},
]


@pytest.mark.parametrize("links", LINKS)
@pytest.mark.parametrize("mirrors", [True, False], ids=["mirrors", "matte"])
def test_cycles_shows_the_same_of_linked_surfaces(pictures, panel, painted, link, links, mirrors):
    """In mirrors rays find all of the light, and on what is matte samples of a square so far away that it is a point."""
    block = panel(60, 6, 5.0) if mirrors else panel(0.02, 50, 1e8)
    link(block, **links)
    for name in ("Monkey", "Floor") if mirrors else ():
        bpy.data.objects[name].data.materials[0] = painted("ShaderNodeBsdfGlossy", {"Roughness": 0.0})
    # A matte surface sees another point of the square than in the tracer: an angle of 0.02/50 off, at slopes up to a thousand.
    most, p50, p99 = (1e-3, 1e-6, 2e-5) if mirrors else (1e-3, 0.02 / 50, 0.02)
    differs = 0
    for sides in pictures(scenes=3):
        assert bool(reasons(sides.exported)) == ("INCLUDE" in links.get("blocker_collection", {}).values())
        hits = off(sides.exported, sides.traced, sides.cycles[0])
        assert (np.array(hits) <= (most, p50, p99)).all(), hits
        plain = render(unlinked(sides.exported), "direct", 1, threads=2)
        differs += any(np.array(off(sides.exported, plain, sides.cycles[0])) > (10 * most, p50, p99))
    assert differs >= 2  # linking is seen: without it, the difference is found


def test_of_a_collection_that_includes_blockers_cycles_loses_light_behind_all_others(
    pictures, panel, painted, link, monkeypatch
):
    """So it is told, and given a collection that excludes all others; without that, it would be found."""
    monkeypatch.setattr(linking, "_exclude", lambda *_: None)
    link(panel(60, 6, 5.0), blocker_collection={"Floor": "INCLUDE"})
    for name in ("Monkey", "Floor"):
        bpy.data.objects[name].data.materials[0] = painted("ShaderNodeBsdfGlossy", {"Roughness": 0.0})
    (sides,) = pictures(scenes=1)
    assert LOSES in reasons(sides.exported)["Panel"]
    assert off(sides.exported, sides.traced, sides.cycles[0])[0] > 0.01


@pytest.mark.parametrize(
    ("links", "loses"),
    [({"Floor": "EXCLUDE"}, True), ({"Floor": "INCLUDE", "Monkey": "INCLUDE"}, True), ({"Monkey": "EXCLUDE"}, False)],
)
def test_what_is_hidden_from_shadow_rays_stands_in_no_light_that_has_blockers(pictures, panel, painted, link, links, loses):
    bpy.data.objects["Monkey"].visible_shadow = False
    block = panel(60, 6, 5.0)
    link(block, blocker_collection=links)
    for name in ("Monkey", "Floor"):
        bpy.data.objects[name].data.materials[0] = painted("ShaderNodeBsdfGlossy", {"Roughness": 0.0})
    (sides,) = pictures(scenes=1)
    assert bool(reasons(sides.exported)) == loses
    assert [block.light_linking.blocker_collection] == list(bpy.data.collections)  # Cycles' own collections are gone
    assert (np.array(off(sides.exported, sides.traced, sides.cycles[0])) <= (1e-3, 1e-6, 2e-5)).all()


@pytest.mark.slow
@pytest.mark.parametrize("links", LINKS[1:4])
def test_near_by_samples_of_light_and_scattered_rays_make_the_same_as_in_cycles(
    pictures, panel, painted, add, mesh_from, link, links
):
    """A square close over a rough Suzanne and a matte floor, a pane between, with bounces."""
    link(panel(3, 2.5, 5.0), **links)
    bpy.data.objects["Monkey"].data.materials[0] = painted("ShaderNodeBsdfGlossy", {"Roughness": 0.3})
    add(mesh_from("plane", size=2), "Pane", (0.3, -0.6, 1.9)).data.materials.append(
        painted("ShaderNodeBsdfTransparent", {"Color": (0.7, 0.5, 0.9, 1)})
    )
    (sides,) = pictures(samples=64, count=4, scenes=1, level="path")
    comparison = sides.compared(64)
    assert comparison.passed, comparison.sentence
    wrong = render(unlinked(sides.exported), "path", 256, threads=2)
    assert not sides.compared(64, wrong).passed, "and without links, it would differ"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["SUN", "POINT", "AREA"])
def test_scattered_rays_find_a_lamp_past_what_is_no_blocker_as_in_cycles(pictures, painted, add_lamp, link, kind):
    size = {"SUN": {"angle": 0.5}, "AREA": {"size": 1.0}}.get(kind, {"shadow_soft_size": 0.5})
    lamp = add_lamp(kind, (0, 3, 3), (-0.8, 0, 0), energy=3.0 if kind == "SUN" else 500.0, **size)
    for name, roughness in (("Monkey", 0.3), ("Floor", 0.0)):
        bpy.data.objects[name].data.materials[0] = painted("ShaderNodeBsdfGlossy", {"Roughness": roughness})
    link(lamp, blocker_collection={"Monkey": "EXCLUDE"})
    (sides,) = pictures(samples=64, count=4, scenes=1, level="path")
    comparison = sides.compared(64)
    assert comparison.passed and not reasons(sides.exported), comparison.sentence
    other = replace(sides.exported, lamps=tuple(replace(each, blockers=None) for each in sides.exported.lamps))
    assert not sides.compared(64, render(other, "path", 256, threads=2)).passed


def test_only_surfaces_that_shine_are_linked(stage, panel, link):
    stage(np.random.default_rng(0))
    link(panel(3, 3, 5.0), receiver_collection={"Monkey": "INCLUDE"}, blocker_collection={"Floor": "EXCLUDE"})
    link(bpy.data.objects["Floor"], receiver_collection={"Monkey": "EXCLUDE"})
    exported = jobs.export(Job(level="direct"))
    assert links_of(exported) == ({"Monkey"}, {"Monkey", "Panel"}) and not reasons(exported)
    assert unlinked(exported).objects[1:] != exported.objects[1:]
    assert [placed.receivers for placed in exported.objects if placed.name != "Panel"] == [None, None]
    geometry = jobs.export(Job(level="geometry"))
    assert links_of(geometry) == (None, None) and not reasons(geometry)


def test_an_instance_shines_for_what_its_object_shines(pictures, panel, painted, scene, link):
    """And not for what its Empty is linked to."""
    block = panel(60, 6, 5.0)
    bpy.data.collections.new("Placed").objects.link(block)
    scene.collection.objects.unlink(block)
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["Placed"]
    scene.collection.objects.link(empty)
    link(block, receiver_collection={"Monkey": "EXCLUDE"})
    link(empty, receiver_collection={"Floor": "EXCLUDE"})
    for name in ("Monkey", "Floor"):
        bpy.data.objects[name].data.materials[0] = painted("ShaderNodeBsdfGlossy", {"Roughness": 0.0})
    (sides,) = pictures(scenes=1)
    assert links_of(sides.exported) == ({"Floor", "Panel"}, None)
    assert (np.array(off(sides.exported, sides.traced, sides.cycles[0])) <= (1e-3, 1e-6, 2e-5)).all()


def test_a_recentered_scene_has_no_links_and_they_are_told(stage, panel, link):
    stage(np.random.default_rng(0))
    link(panel(3, 3, 5.0), receiver_collection={"Monkey": "INCLUDE"})
    exported = jobs.export(Job(level="direct", recenter=True))
    assert links_of(exported) == (None, None) and reasons(exported)["Panel"] == "light linking is off on both sides"
