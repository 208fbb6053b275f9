"""Light and shadow linking: which objects a light lights, and which cast its shadows, out of Blender and into it.

As Blender has it: of what a collection includes or excludes, its own objects count rather than its children's, and one that
includes nothing means all that it does not exclude. In Cycles an instance has the link of what places it, where that has one.
"""

from collections.abc import Mapping

import bpy

from ...tracer.scene.lamps import Lamp
from ..temporary_settings import Overrides
from .features import Placed, placed_by
from .ledger import Ledger

_COLLECTIONS = ("receiver_collection", "blocker_collection")
_Names = frozenset[str] | None


class Links:
    """The links between lights and objects of a depsgraph, which is looked through only where there are any."""

    def __init__(self, depsgraph: bpy.types.Depsgraph) -> None:
        self._names: set[str] = set()
        self._instances: set[str] = set()  # and what places them
        lights = [block.light_linking for block in depsgraph.objects if block.type == "LIGHT"]
        if any(getattr(linking, name) for linking in lights for name in _COLLECTIONS):
            for placed, is_instance in ((placed_by(each), each.is_instance) for each in depsgraph.object_instances):
                self._names.add(placed.name)
                if is_instance:
                    self._instances |= {placed.name, placed.parent.original.name}

    def of(self, placed: Placed, ledger: Ledger) -> tuple[_Names, _Names]:
        """The names of a light's receivers and of its blockers, whether or not they are surfaces; None is all."""
        linking, name = placed.real.original.light_linking, placed.name
        collections = [getattr(linking, each) for each in _COLLECTIONS]
        if any(each and not self._instances.isdisjoint(block.name for block in each.all_objects) for each in collections):
            ledger.note(name, "approximated", "is linked to instances, which count as the objects that they show")
        receivers, blockers = (self._named(each) if each else None for each in collections)
        return receivers, blockers

    def _named(self, collection: bpy.types.Collection) -> _Names:
        states: dict[str, str] = {}
        for child, child_link in zip(collection.children, collection.collection_children, strict=True):
            states |= dict.fromkeys((block.name for block in child.all_objects), child_link.light_linking.link_state)
        for block, link in zip(collection.objects, collection.collection_objects, strict=True):
            states[block.name] = link.light_linking.link_state
        included = {name for name, state in states.items() if state == "INCLUDE"}
        return frozenset((included or self._names) - (set(states) - included)) if states else None


def among(lamp: Lamp, names: set[str]) -> dict[str, _Names]:
    """The receivers and blockers of a lamp without those that are no objects of these names; all of them are None again."""
    return {
        each: None if getattr(lamp, each) is None or names <= getattr(lamp, each) else getattr(lamp, each) & names
        for each in ("receivers", "blockers")
    }


def link(block: bpy.types.Object, lamp: Lamp, surfaces: Mapping[str, list[bpy.types.Object]], overrides: Overrides) -> None:
    """Let a new light have a lamp's receivers and blockers. surfaces : name → the objects of that name."""
    for each, names in zip(_COLLECTIONS, (lamp.receivers, lamp.blockers), strict=True):
        if names is None:
            continue
        collection = bpy.data.collections.new(f"{lamp.name} {each.split('_')[0]}s")
        overrides.afterwards(bpy.data.batch_remove, [collection])
        # A collection that includes nothing would mean all.
        wanted, state = (names, "INCLUDE") if names else (set(surfaces), "EXCLUDE")
        for other in (other for name in sorted(wanted) for other in surfaces[name]):
            collection.objects.link(other)
        for held in collection.collection_objects:
            held.light_linking.link_state = state
        setattr(block.light_linking, each, collection)
