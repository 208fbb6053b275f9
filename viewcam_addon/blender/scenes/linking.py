"""Light and shadow linking: which objects a lamp or a shining surface lights, and which cast its shadows, from and to Blender.

As in Blender, what a collection says of its own objects counts before what it says of its children's, and a collection that
includes nothing means all that it does not exclude. In Cycles an instance lights what the object lights that it shows, and is
lit by what lights the object that places it, where that one is linked.

Of a light with blockers, Cycles loses what scattered rays find behind an opaque object that casts none of its shadows, unless
some collection names that object (kernel/integrator/shadow_linking.h). Where a collection excludes all such objects, it loses
nothing.
"""

from collections.abc import Collection, Iterable
from dataclasses import replace
from typing import TypeVar

import bpy

from ...tracer.scene import Object
from ...tracer.scene.lamps import Lamp
from ..temporary_settings import Overrides
from .features import Placed, hidden_from, placed_by
from .ledger import Ledger

_COLLECTIONS = ("receiver_collection", "blocker_collection")
_Names = frozenset[str] | None
_Light = TypeVar("_Light", Lamp, Object)


class Links:
    """The links between lights and objects of a depsgraph, which is looked through only where there are any."""

    def __init__(self, depsgraph: bpy.types.Depsgraph) -> None:
        self._objects: dict[str, set[bpy.types.Object]] = {}  # shown objects, and those that place them
        self._asked: dict[str, set[str]] = {}  # shown objects → those whose links count, by name
        self._shadowless: set[str] = set()  # hidden from shadow rays
        lights = [block for block in depsgraph.objects if is_linked(block)]
        if lights:
            collections = (getattr(light.light_linking, each) for light in lights for each in _COLLECTIONS)
            members = {member.name for each in collections if each for member in each.all_objects}
            members |= {light.name for light in lights}
            for placed in map(placed_by, depsgraph.object_instances):
                parent = placed.parent.original.name
                self._asked.setdefault(placed.name, set()).add(parent if parent in members else placed.name)
                self._objects.setdefault(placed.name, set()).update((placed.real.original, placed.parent.original))
                if "shadow" in hidden_from(placed, depsgraph.view_layer_eval):
                    self._shadowless.add(placed.name)

    def of(self, placed: Placed, ledger: Ledger, is_found: bool) -> tuple[_Names, _Names]:
        """The names of a light's receivers and of its blockers, whether or not they are surfaces; None is all.

        is_found : true if scattered rays run into the light.
        """
        block = placed.real.original
        if not is_linked(block):
            return None, None
        collections = [getattr(block.light_linking, each) for each in _COLLECTIONS]
        (receivers, _), (blockers, excluded) = (
            self._named(each, placed, ledger) if each else (None, True) for each in collections
        )
        if is_found and blockers is not None:
            others = set(self._objects) - blockers
            if self._shadowless & blockers if excluded else others:
                reason = "has blockers, and Cycles would lose light behind others: it is given a collection that excludes these"
                ledger.note(placed.name, "approximated", reason)
                blocks = set().union(*(self._objects[name] for name in others | self._shadowless))
                ledger.call_for_cycles(block, _exclude, sorted(blocks, key=lambda each: each.name_full))
        return receivers, blockers

    def _named(self, collection: bpy.types.Collection, light: Placed, ledger: Ledger) -> tuple[_Names, bool]:
        """(the objects that a light's collection means, true if these are all that it does not exclude)."""
        states: dict[str, str] = {}
        for child, child_link in zip(collection.children, collection.collection_children, strict=True):
            states |= dict.fromkeys((block.name for block in child.all_objects), child_link.light_linking.link_state)
        for block, link in zip(collection.objects, collection.collection_objects, strict=True):
            states[block.name] = link.light_linking.link_state
        included = {name for name, state in states.items() if state == "INCLUDE"}
        if not states:
            return None, True
        meant = {
            name: {each in included if included else each not in states for each in self._asked[name]} for name in self._asked
        }
        if mixed := [name for name, answers in meant.items() if len(answers) > 1]:
            reason = "is linked to some places of what stands in several, and to all of them here"
            ledger.note(light.name, "approximated", f"{reason}: {', '.join(sorted(mixed))}")
        return frozenset(name for name, answers in meant.items() if True in answers), not included


def is_linked(block: bpy.types.Object) -> bool:
    """True if what gives light has receivers or blockers."""
    return any(getattr(block.light_linking, each) for each in _COLLECTIONS)


def among(lights: Iterable[_Light], names: set[str]) -> tuple[_Light, ...]:
    """The lights, linked to objects of these names alone; a link to all of these is none."""

    def remaining(linked: _Names) -> _Names:
        return None if linked is None or names <= linked else linked & names

    return tuple(
        light
        if light.receivers is None and light.blockers is None
        else replace(light, receivers=remaining(light.receivers), blockers=remaining(light.blockers))
        for light in lights
    )


def _exclude(overrides: Overrides, light: bpy.types.Object, others: Collection[bpy.types.Object]) -> None:
    """Let others cast no shadow in a light until the overrides end."""
    collection = bpy.data.collections.new(light.name)
    overrides.afterwards(bpy.data.batch_remove, [collection])
    for other in others:
        collection.objects.link(other)
    for held in collection.collection_objects:
        held.light_linking.link_state = "EXCLUDE"
    overrides.set(light.light_linking, "blocker_collection", collection)
