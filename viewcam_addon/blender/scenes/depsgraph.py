"""The dependency graph as a final render sees it.

`context.evaluated_depsgraph_get()` is the viewport's: viewport subdivision levels, `hide_viewport`, modifiers' `show_viewport`.
Blender makes a graph in render mode for render engines only, so that a render engine that renders nothing is what gets it: it
sees exactly what Cycles sees, in `blender -b`, in a window and in the bpy module. Rejected: copying viewport settings from the
render settings and back (drivers, GeometryNodes' "Is Viewport", particle percentages and more would still differ).
"""

from collections.abc import Callable
from typing import TypeVar

import bpy

from ...errors import InputError, operator_reason
from ..temporary_settings import overridden, still_of_one_layer

Result = TypeVar("Result")


class _Visitor(bpy.types.RenderEngine):
    """Renders nothing, and lets `work` look at the depsgraph."""

    bl_idname = "VIEWCAM_VISITOR"
    bl_label = "Virtual Pinhole (export)"

    work: Callable[[bpy.types.Depsgraph], None]

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        type(self).work(depsgraph)


def visit(scene: bpy.types.Scene, work: Callable[[bpy.types.Depsgraph], Result]) -> Result:
    """Call `work(depsgraph)` with the graph of the render that the scene is set to, and return what it returns.

    Nothing of the graph may be kept: it is gone when this returns. What `work` raises is raised here.
    """
    outcome: list[Result] = []
    failure: list[BaseException] = []

    def guarded(depsgraph: bpy.types.Depsgraph) -> None:
        try:
            outcome.append(work(depsgraph))
        except BaseException as error:  # Blender would print it and go on
            failure.append(error)

    _Visitor.work = staticmethod(guarded)
    bpy.utils.register_class(_Visitor)
    try:
        with overridden() as overrides:
            overrides.set(scene.render, "engine", _Visitor.bl_idname)
            render_still(scene)
    finally:
        bpy.utils.unregister_class(_Visitor)
    if failure:
        raise failure[0]
    if not outcome:
        raise InputError(f"Blender renders nothing of scene {scene.name!r}: check its render settings")
    return outcome[0]


def visit_still(
    scene: bpy.types.Scene,
    view_layer: bpy.types.ViewLayer,
    camera_object: bpy.types.Object,
    work: Callable[[bpy.types.Depsgraph], Result],
) -> Result:
    """`visit` with the graph of a still picture of this view layer through this camera (temporary_settings.py)."""
    with overridden() as overrides:
        still_of_one_layer(overrides, scene, view_layer, camera_object)
        return visit(scene, work)


def only_cameras_changed(depsgraph: bpy.types.Depsgraph) -> bool:
    """True if all that Blender tells of since the last render are cameras, and settings of the scene.

    Blender tells of whatever follows a camera, too (geometry nodes, constraints, drivers, children), and each time of all that
    is animated. It does not tell of pixels that were painted and of what Cycles has for properties. Measured: 4.2, 5.0 and 5.2.
    """
    return all(_is_of_camera(update.id) for update in depsgraph.updates)


def _is_of_camera(block: bpy.types.ID) -> bool:
    if isinstance(block, bpy.types.Object):
        return block.type == "CAMERA"
    return isinstance(block, bpy.types.Camera | bpy.types.Scene | bpy.types.Action)


def render_still(scene: bpy.types.Scene, to_file: bool = False) -> None:
    """Render the scene's current frame. Raises InputError with Blender's own reason, if it reports an error."""
    try:
        bpy.ops.render.render(scene=scene.name, write_still=to_file)
    except RuntimeError as error:
        reason = operator_reason(error)
        raise InputError(f"Blender can't render scene {scene.name!r} ({reason}): make it render with F12 first") from error
