"""The places of a camera's panels, two for each: among its data's properties and in the 3D viewport's sidebar."""

from typing import ClassVar

import bpy

from .. import datablocks


class CameraPanel:
    """A panel that is there while there is a camera that it can be about."""

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return datablocks.camera_in(context) is not None


class SubPanel(CameraPanel):
    """One that is closed at first, below the panel Virtual Pinhole."""

    bl_options: ClassVar[set[str]] = {"DEFAULT_CLOSED"}
    bl_order = 1  # after Proof, which is open


class InProperties:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"


class InSidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Pinhole"


class BelowProperties(InProperties):
    bl_parent_id = "VIEWCAM_PT_data"


class BelowSidebar(InSidebar):
    bl_parent_id = "VIEWCAM_PT_sidebar"
