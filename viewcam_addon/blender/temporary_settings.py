"""Settings of Blender that are overridden for a while and restored, whatever happens in between.

    with overridden() as overrides:
        overrides.set(scene.cycles, "samples", 1)
        ...

Rejected: a copy of the scene to change freely (rigid bodies, caches and drivers that name the scene would see another scene).
"""

import contextlib
from collections.abc import Callable, Collection, Hashable, Iterator
from typing import Any, TypeVar

import bpy

from . import versions

Result = TypeVar("Result")

LARGEST_INDEX = 32767
"""The largest pass_index."""


class Overrides:
    """Sets what is Blender's for a while, and remembers how to restore it.

    lasting : the overrides of a series of renders of which this is one, which end after it; by default these themselves.
    """

    def __init__(self, stack: contextlib.ExitStack, lasting: "Overrides | None" = None) -> None:
        self._stack = stack
        self._shared: dict[Hashable, Any] = {}
        self.lasting = lasting or self

    def set(self, owner: bpy.types.bpy_struct, name: str, value: Any) -> None:
        """Set a property until the overrides end, whatever animates or drives it."""
        for curve in _curves_of(owner, name):
            self.afterwards(setattr, curve, "mute", False)
            curve.mute = True
        before = getattr(owner, name)
        if isinstance(before, bpy.types.bpy_prop_array):  # which would be the new value by then
            before = tuple(before)
        if before != value:
            self.afterwards(setattr, owner, name, before)
            setattr(owner, name, value)

    def shared(self, make: Callable[..., Result], *arguments: Hashable) -> Result:
        """The result of `make(overrides, *arguments)` while the overrides last, made for the first who asks."""
        key = make, *arguments
        if key not in self._shared:
            self._shared[key] = make(self, *arguments)
        return self._shared[key]

    @property
    def is_shared(self) -> bool:
        """True if anything is shared with other renders."""
        return bool(self._shared)

    def enter(self, context: contextlib.AbstractContextManager) -> None:
        """Enter a context, and leave it when the overrides end."""
        self._stack.enter_context(context)

    def afterwards(self, undo: Callable[..., Any], *arguments: Any, **options: Any) -> None:
        """Call `undo` when the overrides end; what was set last is restored first."""
        self._stack.callback(undo, *arguments, **options)


def _curves_of(owner: bpy.types.bpy_struct, name: str) -> list[bpy.types.FCurve]:
    """The curves and drivers that set a property each time a scene is evaluated, and would set it anew."""
    block = getattr(owner, "id_data", None)
    if not isinstance(block, bpy.types.ID) or not getattr(block, "animation_data", None):
        return []
    try:
        path = owner.path_from_id(name)
    except ValueError:  # no path, and so no animation
        return []
    return [curve for curve in versions.all_curves(block) if curve.data_path == path and not curve.mute]


@contextlib.contextmanager
def overridden(lasting: Overrides | None = None) -> Iterator[Overrides]:
    """Give overrides; at the end of the block everything is as it was.

    lasting : see Overrides.
    """
    with contextlib.ExitStack() as stack:
        yield Overrides(stack, lasting)


def still_of_one_layer(
    overrides: Overrides,
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    camera_object: bpy.types.Object | None,
    keep: bool = False,
) -> None:
    """Make `bpy.ops.render.render` render this view layer through this camera, sharp, and nothing after it.

    What both sides of a comparison have in common: compositor and sequencer, motion blur, stereo and Freestyle are off, and a
    render border is cropped to. Simplify stays as the artist has it.
    camera_object : the camera; where None, the one that Blender chooses itself, as markers bind it.
    keep : true to keep what Blender and Cycles have built, for the next render.
    """
    render = scene.render
    overrides.set(render, "use_persistent_data", keep)
    for name in (
        "use_compositing",
        "use_sequencer",
        "use_multiview",
        "use_motion_blur",
        "use_freestyle",
        "use_single_layer",
        "use_stamp",
    ):
        overrides.set(render, name, False)
    overrides.set(render, "use_crop_to_border", render.use_border)
    if camera_object is None:
        overrides.afterwards(setattr, scene, "camera", scene.camera)  # a marker may change it
    else:
        cameras_unbound(overrides, scene)
        scene.camera = camera_object
    for each in scene.view_layers:
        overrides.set(each, "use", each == view_layer)


def cameras_unbound(overrides: Overrides, scene: bpy.types.Scene) -> None:
    """Let `scene.camera` be the one that renders, whatever it is set to until the overrides end.

    Markers bound to cameras would choose among them: in a render, and while they are unbound and bound again.
    """
    overrides.afterwards(setattr, scene, "camera", scene.camera)
    for marker in scene.timeline_markers:
        overrides.set(marker, "camera", None)


@contextlib.contextmanager
def numbered_indices(kinds: Collection[str] = ("objects", "materials")) -> Iterator[None]:
    """Number the file's objects from 1, and its materials, where all of them have the index 0, for the index passes.

    kinds : one of the two, or both.

    As soon as one of them carries a number its artist has a use for them, and they stay. Rejected: `foreach_set`, which passes
    over what is linked from a library.
    """
    named = [getattr(bpy.data, kind) for kind in kinds]
    blank = [blocks for blocks in named if not any(block.pass_index for block in blocks)]
    try:
        for blocks in blank:
            for number, block in enumerate(blocks):
                # Beyond the largest they start again: two of them may share a number then.
                block.pass_index = number % LARGEST_INDEX + 1
        yield
    finally:
        for blocks in blank:
            for block in blocks:
                block.pass_index = 0
