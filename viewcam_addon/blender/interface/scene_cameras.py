"""The cameras of a scene: which one the panel is about, the others, and a new one.

The panel shows the active object if that is a camera, else the scene's camera, and says which; choosing another one makes it
the active object, as a click in the viewport would. Rejected: a choice of the panel's own (two ideas of what is active).
"""

from typing import Any, ClassVar

import bpy

from ... import pinhole as text
from ...errors import InputError
from .. import camera as cameras
from .. import datablocks, own_picture, preferences, storage
from . import file_menu, panel_rows, viewport
from .operators import NamesCamera, ReportsErrors, possible
from .panel_rows import BelowSidebar, SubPanel

_NAME = "Virtual Pinhole"
_FROM = (7.0, -7.0, 5.0)  # a new camera's eye, from the point that it looks at
_ROWS = 3  # the list's, at least


def of_scene(scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """The cameras of a scene by name."""
    return sorted((each for each in scene.objects if each.type == "CAMERA"), key=lambda each: each.name)


def beside(camera_object: bpy.types.Object | None, scene: bpy.types.Scene, step: int) -> bpy.types.Object | None:
    """The next (step 1) or the previous (−1) camera of the scene, around; None where there is none."""
    cameras = of_scene(scene)
    if camera_object not in cameras:
        return cameras[0] if cameras else None
    return cameras[(cameras.index(camera_object) + step) % len(cameras)]


def choose(camera_object: bpy.types.Object, context: bpy.types.Context) -> None:
    """Make a camera the active object, and the only selected one where objects are selected.

    Raises InputError if the view layer does not have it.
    """
    layer = context.view_layer
    if layer.objects.get(camera_object.name) != camera_object:
        raise InputError(f"camera {camera_object.name!r} is not in view layer {layer.name!r}: include its collection")
    if context.mode == "OBJECT":
        file_menu.select([camera_object], camera_object, context)
    else:
        layer.objects.active = camera_object


class _SceneOperator(ReportsErrors):
    bl_options: ClassVar[set[str]] = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_in_object_mode = context.scene and context.mode == "OBJECT"
        return possible(cls, is_in_object_mode, "Leave the mode first: cameras are chosen in Object Mode")


class VIEWCAM_OT_add_camera(_SceneOperator, bpy.types.Operator):
    bl_idname = "viewcam.add_camera"
    bl_label = "Add Virtual Pinhole Camera"
    bl_description = "Add a camera that is set by eye, look-at, up and lens, and looks at the 3D cursor"

    from_view: bpy.props.BoolProperty(
        name="From View", description="Put it where the 3D viewport looks from", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        is_linked = context.scene and context.scene.library
        return possible(cls, not is_linked, "The scene is linked from another file") and super().poll(context)

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return "Add a camera that shows all that the 3D viewport shows" if properties.from_view else cls.bl_description

    def run(self, context: bpy.types.Context) -> None:
        area = viewport.area_in(context) if self.from_view else None
        if self.from_view and area is None:
            raise InputError("there is no 3D viewport in this window: open one")
        scene = context.scene
        added = bpy.data.objects.new(_NAME, bpy.data.cameras.new(_NAME))
        context.collection.objects.link(added)
        try:
            cursor = tuple(scene.cursor.location)
            eye = tuple(a + b for a, b in zip(cursor, _FROM, strict=True))
            like = cameras.as_it_stands(added, scene)
            wanted = text.Pinhole(
                eye, cursor, preferences.up_axis(), like.distance, like.width, like.height, like.principal_point
            )
            storage.begin(added)
            cameras.apply(added, viewport.pinhole_of(area, wanted, scene) if area else wanted, scene)
        except InputError:
            bpy.data.cameras.remove(added.data)  # and the object with it
            raise
        file_menu.select([added], added, context)
        if scene.camera is None:
            scene.camera = added


class VIEWCAM_OT_step_camera(_SceneOperator, bpy.types.Operator):
    bl_idname = "viewcam.step_camera"
    bl_label = "Next Camera"
    bl_description = "Go on to the next camera of the scene"

    step: bpy.props.IntProperty(name="Step", description="1 to the next, −1 to the previous", default=1, options={"SKIP_SAVE"})

    @classmethod
    def description(cls, _context: bpy.types.Context, properties: bpy.types.OperatorProperties) -> str:
        return "Go back to the previous camera of the scene" if properties.step < 0 else cls.bl_description

    def run(self, context: bpy.types.Context) -> None:
        neighbor = beside(datablocks.camera_in(context), context.scene, self.step)
        if neighbor is None:
            raise InputError("there is no camera: add one")
        choose(neighbor, context)


class VIEWCAM_OT_make_camera_active(NamesCamera, _SceneOperator, bpy.types.Operator):
    bl_idname = "viewcam.make_camera_active"
    bl_label = "Make Active"
    bl_description = "Let the scene render through this camera, and the viewport's camera view show it"

    def run(self, context: bpy.types.Context) -> None:
        camera_object = context.scene.objects.get(self.camera) if self.camera else datablocks.camera_in(context)
        if camera_object is None or camera_object.type != "CAMERA":
            raise InputError(f"scene {context.scene.name!r} has no camera {self.camera!r}: name another")
        context.scene.camera = camera_object
        own_picture.switch(context.scene)


class VIEWCAM_UL_cameras(bpy.types.UIList):
    """The scene's cameras: a name, an eye, and which of them the scene renders through."""

    def draw_item(
        self,
        context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.Scene,
        item: bpy.types.Object,
        _icon: int,
        _active_data: bpy.types.WindowManager,
        _active_name: str,
        _index: int = 0,
        _flag: int = 0,
    ) -> None:
        row = layout.row(align=True)
        row.prop(
            item, "name", text="", emboss=False, icon="CAMERA_DATA" if item.virtual_pinhole.enabled else "OUTLINER_DATA_CAMERA"
        )
        row.prop(item, "hide_viewport", text="", emboss=False)
        icon = "RADIOBUT_ON" if item == context.scene.camera else "RADIOBUT_OFF"
        row.operator("viewcam.make_camera_active", text="", emboss=False, icon=icon).camera = item.name

    def filter_items(self, _context: bpy.types.Context, data: bpy.types.Scene, name: str) -> tuple[list[int], list[int]]:
        objects = getattr(data, name)
        wanted = self.filter_name.lower()
        flags = [self.bitflag_filter_item if each.type == "CAMERA" and wanted in each.name.lower() else 0 for each in objects]
        return flags, bpy.types.UI_UL_list.sort_items_by_name(objects, "name")


def draw_header(layout: bpy.types.UILayout, camera_object: bpy.types.Object, context: bpy.types.Context) -> None:
    """Draw the panel's camera, the way to the others, and whether it is the scene's."""
    layout = layout.column()
    layout.use_property_split = layout.use_property_decorate = False
    is_scenes = camera_object == context.scene.camera
    if getattr(context, "camera", None) is None:  # else Blender has its name above
        row = layout.row(align=True)
        row.operator("viewcam.step_camera", text="", icon="TRIA_LEFT").step = -1
        row.prop(camera_object, "name", text="", icon="VIEW_CAMERA" if is_scenes else "CAMERA_DATA")
        row.operator("viewcam.step_camera", text="", icon="TRIA_RIGHT").step = 1
        row.operator("viewcam.add_camera", text="", icon="ADD")
        if (active := context.active_object) and active != camera_object:
            panel_rows.sentence(layout, context, f"The scene's camera; {active.name} is active", "INFO")
    if not is_scenes:
        layout.operator("viewcam.make_camera_active", icon="RADIOBUT_OFF").camera = camera_object.name


def draw_none(layout: bpy.types.UILayout) -> None:
    """Draw the panel of a scene without a camera."""
    layout.label(text="There is no camera", icon="INFO")
    column = layout.column(align=True)
    column.operator("viewcam.add_camera", icon="ADD")
    column.operator("viewcam.add_camera", text="Add from View", icon="VIEW_CAMERA").from_view = True


class _PicturePanel(SubPanel):
    bl_label = "Own Picture"

    def draw_header(self, context: bpy.types.Context) -> None:
        camera_object: Any = datablocks.camera_in(context)
        self.layout.prop(camera_object.virtual_pinhole_picture, "use", text="")

    def draw(self, context: bpy.types.Context) -> None:
        """While the camera is the scene's, what counts are the scene's numbers, here as in Output."""
        camera_object: Any = datablocks.camera_in(context)
        scene = context.scene
        own, is_active = camera_object.virtual_pinhole_picture, own_picture.owner(scene) == camera_object
        render, frames = (scene.render, scene) if is_active else (own, own)
        layout = self.layout
        panel_rows.begin(layout, context)
        layout.active = own.use
        for names, group in (
            (("resolution_x", "resolution_y", "resolution_percentage"), render),
            (("pixel_aspect_x", "pixel_aspect_y"), render),
            (("frame_start", "frame_end"), frames),
        ):
            column = layout.column(align=True)
            for name in names:
                column.prop(group, name, text=_LABELS[name])


_LABELS = {
    "resolution_x": "Resolution X",
    "resolution_y": "Y",
    "resolution_percentage": "%",
    "pixel_aspect_x": "Aspect X",
    "pixel_aspect_y": "Y",
    "frame_start": "Frame Start",
    "frame_end": "End",
}


VIEWCAM_PT_data_picture, VIEWCAM_PT_sidebar_picture = panel_rows.in_both_places("picture", _PicturePanel)


class VIEWCAM_PT_sidebar_cameras(SubPanel, BelowSidebar, bpy.types.Panel):
    bl_label = "Cameras"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        manager = context.window_manager
        layout.template_list("VIEWCAM_UL_cameras", "", context.scene, "objects", manager, "virtual_pinhole_camera", rows=_ROWS)
        row = panel_rows.buttons(layout, context)
        row.operator("viewcam.add_camera", text="Add", icon="ADD")
        row.operator("viewcam.add_camera", text="From View", icon="VIEW_CAMERA").from_view = True


def _chosen(_manager: bpy.types.WindowManager) -> int:
    camera_object = datablocks.camera_in(bpy.context)
    return bpy.context.scene.objects.find(camera_object.name) if camera_object else -1


def _choose(_manager: bpy.types.WindowManager, index: int) -> None:
    context = bpy.context
    if context.mode == "OBJECT" and 0 <= index < len(context.scene.objects):
        camera_object = context.scene.objects[index]
        if context.view_layer.objects.get(camera_object.name) == camera_object:
            choose(camera_object, context)
            bpy.ops.ed.undo_push(message="Choose Camera")


def _draw_add_menu(menu: bpy.types.Menu, _context: bpy.types.Context) -> None:
    menu.layout.operator("viewcam.add_camera", text=_NAME, icon="OUTLINER_OB_CAMERA")


OPERATORS = (VIEWCAM_OT_add_camera, VIEWCAM_OT_step_camera, VIEWCAM_OT_make_camera_active)
CLASSES = (*OPERATORS, VIEWCAM_UL_cameras, VIEWCAM_PT_sidebar_cameras, VIEWCAM_PT_data_picture, VIEWCAM_PT_sidebar_picture)


def register() -> None:
    bpy.types.WindowManager.virtual_pinhole_camera = bpy.props.IntProperty(get=_chosen, set=_choose, options={"HIDDEN"})
    bpy.types.VIEW3D_MT_camera_add.append(_draw_add_menu)


def unregister() -> None:
    bpy.types.VIEW3D_MT_camera_add.remove(_draw_add_menu)
    del bpy.types.WindowManager.virtual_pinhole_camera
