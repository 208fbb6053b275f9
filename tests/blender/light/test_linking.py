"""Light and shadow linking: what Blender's collections mean, and that Cycles shows the same, without noise."""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from viewcam_addon.blender.jobs import renderer as jobs
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
    assert differs >= 2  # what is linked is seen: without, it is found


def test_a_light_that_is_linked_to_instances_is_named(lamp, link, scene):
    bpy.data.collections.new("Placed").objects.link(bpy.data.objects["Monkey"])
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", bpy.data.collections["Placed"]
    scene.collection.objects.link(empty)
    assert "Lamp" not in linked()[2]
    link(lamp, receiver_collection={"Monkey": "INCLUDE"})
    assert "linked to instances" in linked()[2]["Lamp"]
