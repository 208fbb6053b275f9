"""The places that panels share, of which a camera's panel has two, among its data's properties and in the sidebar; and rows,
a name beside what it names, or above it where an artist has made the panel too narrow for both."""

from typing import ClassVar

import bpy

from .. import datablocks
from . import readouts


class CameraPanel:
    """A panel that is there while there is a camera that it can be about."""

    layout: bpy.types.UILayout

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return datablocks.camera_in(context) is not None


class SubPanel(CameraPanel):
    """A panel below Virtual Pinhole, which is closed at first."""

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


def in_both_places(name: str, panel: type) -> tuple[type, type]:
    """The two classes of a panel below Virtual Pinhole, among the camera data's properties and in the sidebar."""
    data, sidebar = (
        type(f"VIEWCAM_PT_{place}_{name}", (panel, below, bpy.types.Panel), {"__module__": panel.__module__})
        for place, below in (("data", BelowProperties), ("sidebar", BelowSidebar))
    )
    return data, sidebar


def redraw() -> None:
    """Draw the panels of all windows anew, and nothing else of the screen."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in ("PROPERTIES", "VIEW_3D"):
                for region in (region for region in area.regions if region.type in ("UI", "WINDOW")):
                    if area.type == "PROPERTIES" or region.type == "UI":
                        region.tag_redraw()


_NARROW = 250  # pixels
_LABEL = 0.4  # share of a row, as Blender splits it
_BESIDE_TEXT = 60  # pixels, of what stands left and right of a sentence


def is_narrow(context: bpy.types.Context) -> bool:
    """True if the panel that is drawn has no room for a name beside a field."""
    return _width(context) < _NARROW


def begin(layout: bpy.types.UILayout, context: bpy.types.Context, decorate: bool = False) -> None:
    """Say how the fields of a panel look: Blender's columns of names and values, or in a narrow one the names inside them."""
    layout.use_property_split, layout.use_property_decorate = not is_narrow(context), decorate


def field(
    column: bpy.types.UILayout,
    owner: bpy.types.bpy_struct,
    name: str,
    text: str | None = None,
    among: tuple[bpy.types.bpy_struct, str] | None = None,
) -> None:
    """A property by its name. Inside a choice, an object or a path there is no room for it, so that it stands above.

    The dots for keyframes, which Blender draws beside a column of values alone, stand beside a narrow panel's fields as well.
    among : the owner of the names to choose from, and the name of its collection of them.
    """
    described = owner.bl_rna.properties[name]
    text = described.name if text is None else text
    row = where = column
    is_dotted = column.use_property_decorate and not column.use_property_split
    if not column.use_property_split and (
        described.type in ("ENUM", "POINTER", "STRING") or getattr(described, "is_array", False)
    ):
        column.label(text=text)
        text = ""
    if is_dotted:
        row = column.row(align=True)
        where = row.column(align=True)
    if among:
        where.prop_search(owner, name, *among, text=text)
    else:
        where.prop(owner, name, text=text)
    if is_dotted:
        row.column(align=True).prop_decorator(owner, name)


def point(
    column: bpy.types.UILayout,
    owner: bpy.types.bpy_struct,
    name: str,
    is_free: bool,
    followers: list[tuple[str, str, tuple[bpy.types.bpy_struct, str] | None]],
) -> None:
    """A point's three numbers, and beside them below its name what it may follow; in a narrow panel one below the other.

    is_free : true if the numbers can be edited.
    followers : (property, name, `among` as of `field`) of each thing that it may follow.
    """
    if not column.use_property_split:
        rows = column.column()
        rows.enabled = is_free
        field(rows, owner, name)
        for follower, text, among in followers:
            field(column, owner, follower, text=text, among=among)
        return
    left, right = named(column, owner.bl_rna.properties[name].name)
    for follower, _, among in followers:
        if among:
            left.prop_search(owner, follower, *among, text="")
        else:
            left.prop(owner, follower, text="")
    right.enabled = is_free
    right.column(align=True).prop(owner, name, text="")
    right.column(align=True).prop_decorator(owner, name)


def named(column: bpy.types.UILayout, label: str | None) -> tuple[bpy.types.UILayout, bpy.types.UILayout]:
    """A column that begins with a label, and the row beside it, which begins where all of a panel's do. Neither has dots."""
    split = column.split(factor=_LABEL)
    left, right = split.column(align=True), split.row(align=True)
    if label is not None:
        heading = left.row()
        heading.alignment = "RIGHT"
        heading.label(text=label)
    for each in (left, right):
        each.use_property_split = each.use_property_decorate = False
    return left, right


def value(column: bpy.types.UILayout, owner: bpy.types.bpy_struct, name: str, choice: str | None = None) -> None:
    """A number with its dot beside its name, or in a narrow panel below it.

    choice : the property that chooses what the number is, in the place of its name.
    """
    label = owner.bl_rna.properties[name].name
    if not column.use_property_split:
        if choice:
            column.label(text=label)
            column.prop(owner, choice, text="")
        field(column, owner, name, text="" if choice else None)
        return
    left, row = named(column, None if choice else label)
    if choice:
        left.prop(owner, choice, text="")
    row.prop(owner, name, text="")
    row.prop_decorator(owner, name)


def buttons(column: bpy.types.UILayout, context: bpy.types.Context) -> bpy.types.UILayout:
    """The layout for buttons with words: beside one another, or one below the other."""
    return column.column(align=True) if is_narrow(context) else column.row(align=True)


def described(
    column: bpy.types.UILayout, context: bpy.types.Context, label: str, texts: tuple[str, ...], share: float
) -> bpy.types.UILayout:
    """A label and what it describes, never translated; the row of these, below the label where they don't fit beside it.

    share : the label's share of the width.
    """
    room = (1.0 - share) * (_width(context) - _BESIDE_TEXT) / max(len(texts), 1)
    if is_narrow(context) or (len(texts) > 1 and not all(readouts.fits(text, room) for text in texts)):
        column.label(text=label)
        row = column.row()
        where = row.column(align=True) if texts else row
    else:
        split = column.split(factor=share)
        heading = split.row()
        heading.alignment = "RIGHT"
        heading.label(text=label)
        where = row = split.row()
    for text in texts:
        where.label(text=text, translate=False)
    return row


def listed(column: bpy.types.UILayout, context: bpy.types.Context, label: str, texts: tuple[str, ...], share: float) -> None:
    """A label and texts beside one another, where a long one takes the room that a short one leaves; or one below the other."""
    line, room = "   ".join(texts), _width(context) - _BESIDE_TEXT
    if readouts.fits(line, room if is_narrow(context) else (1.0 - share) * room):
        described(column, context, label, (line,), share)
    elif is_narrow(context):
        described(column, context, label, texts, share)
    else:
        for number, text in enumerate(texts):
            described(column, context, "" if number else label, (text,), share)


def sentence(column: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str | int = "NONE") -> None:
    """A sentence in lines that fit, never translated here. icon : one of Blender's by its name, or one of proof.mark."""
    below = {} if icon == "NONE" else {"icon": "BLANK1"}
    first = {"icon_value": icon} if isinstance(icon, int) else {"icon": icon}
    for i, line in enumerate(readouts.wrapped(text, _width(context) - _BESIDE_TEXT)):
        column.label(text=line, translate=False, **(below if i else first))


def _width(context: bpy.types.Context) -> float:
    return context.region.width / context.preferences.system.ui_scale
