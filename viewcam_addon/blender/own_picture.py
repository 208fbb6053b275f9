"""A camera's own picture: resolution, pixel aspect and frame range that the scene has while the camera is its active one.

A camera says itself whether it has one. As it becomes the scene's camera, the scene's numbers are put aside in the scene, and
the camera's take their place; whatever is edited meanwhile is the camera's. As another camera becomes active, they go back to
the camera and the scene's own come back, to the bit: whole numbers and float32 both ways. What is put aside is in the file, so
that undo, saving and opening need no care. A camera that a marker activates in an animation switches nothing: one movie has one
size. Rejected: drivers on the scene's resolution (Blender evaluates none for it in a render).
"""

import bpy
from bpy.app.handlers import persistent

_RENDER = ("resolution_x", "resolution_y", "resolution_percentage", "pixel_aspect_x", "pixel_aspect_y")
_SCENE = ("frame_start", "frame_end")  # the start first: Blender moves the end along with it


def _on_use(group: "OwnPicture", context: bpy.types.Context) -> None:
    if group.use and not group.is_stated:
        _copy(_numbers(context.scene), group)
        group.is_stated = True
    switch(context.scene)


class OwnPicture(bpy.types.PropertyGroup):
    """`object.virtual_pinhole_picture` of a camera, and `scene.virtual_pinhole_picture`: the scene's numbers, put aside.

    use : true if the camera has a picture of its own.
    is_stated : true once the numbers have been set.
    camera : the camera whose numbers a scene has, None where they are its own.
    is_lent : true if they are a camera's, which may be gone.
    """

    use: bpy.props.BoolProperty(
        name="Own Picture",
        description="Give this camera a resolution, aspect and frame range of its own, which the scene has while it is active",
        update=_on_use,
        options=set(),
    )
    is_stated: bpy.props.BoolProperty(options={"HIDDEN"})
    is_lent: bpy.props.BoolProperty(options={"HIDDEN"})
    camera: bpy.props.PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    resolution_x: bpy.props.IntProperty(name="Resolution X", subtype="PIXEL", default=1920, min=4, max=65536, options=set())
    resolution_y: bpy.props.IntProperty(name="Y", subtype="PIXEL", default=1080, min=4, max=65536, options=set())
    resolution_percentage: bpy.props.IntProperty(
        name="%", subtype="PERCENTAGE", default=100, min=1, max=32767, soft_max=100, options=set()
    )
    pixel_aspect_x: bpy.props.FloatProperty(name="Aspect X", default=1.0, min=1.0, max=200.0, options=set())
    pixel_aspect_y: bpy.props.FloatProperty(name="Y", default=1.0, min=1.0, max=200.0, options=set())
    frame_start: bpy.props.IntProperty(name="Frame Start", default=1, options=set())
    frame_end: bpy.props.IntProperty(name="End", default=250, options=set())


def owner(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """The camera whose picture the scene has now, if it is not its own."""
    lent = scene.virtual_pinhole_picture
    return lent.camera if lent.is_lent else None


def of_camera(camera_object: bpy.types.Object, scene: bpy.types.Scene) -> dict[str, float]:
    """The numbers of the picture through a camera, by name, whether it is active or not."""
    lent, own = scene.virtual_pinhole_picture, camera_object.virtual_pinhole_picture
    if own.use:
        return _numbers(scene) if lent.is_lent and lent.camera == camera_object else _of_group(own)
    return _of_group(lent) if lent.is_lent else _numbers(scene)


def switch(scene: bpy.types.Scene) -> None:
    """Let the scene have the picture of its camera, or its own, if it has not."""
    lent, active = scene.virtual_pinhole_picture, scene.camera
    wanted = active if active and active.virtual_pinhole_picture.use else None
    if scene.library:
        return
    if lent.is_lent and lent.camera and lent.camera.is_editable:  # at once, as a duplicate takes what the camera has
        _copy(_numbers(scene), lent.camera.virtual_pinhole_picture)
    if lent.camera == wanted and lent.is_lent == (wanted is not None):
        return
    if lent.is_lent:
        _set(scene, _of_group(lent))
    lent.is_lent, lent.camera = wanted is not None, wanted
    if wanted:
        _copy(_numbers(scene), lent)
        _set(scene, _of_group(wanted.virtual_pinhole_picture))


def _numbers(scene: bpy.types.Scene) -> dict[str, float]:
    return {name: getattr(scene.render, name) for name in _RENDER} | {name: getattr(scene, name) for name in _SCENE}


def _of_group(group: OwnPicture) -> dict[str, float]:
    return {name: getattr(group, name) for name in (*_RENDER, *_SCENE)}


def _copy(numbers: dict[str, float], owner: bpy.types.bpy_struct) -> None:
    for name, value in numbers.items():
        if getattr(owner, name) != value:  # setting a value makes Blender evaluate again
            setattr(owner, name, value)


def _set(scene: bpy.types.Scene, numbers: dict[str, float]) -> None:
    for names, target in ((_RENDER, scene.render), (_SCENE, scene)):
        _copy({name: numbers[name] for name in names}, target)


@persistent
def _on_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    if depsgraph.mode != "RENDER":
        switch(scene)


@persistent
def _on_load(_path: str, _more: object = None) -> None:
    for scene in bpy.data.scenes:
        switch(scene)


def register() -> None:
    bpy.utils.register_class(OwnPicture)
    bpy.types.Object.virtual_pinhole_picture = bpy.props.PointerProperty(type=OwnPicture)
    bpy.types.Scene.virtual_pinhole_picture = bpy.props.PointerProperty(type=OwnPicture)
    bpy.app.handlers.depsgraph_update_post.append(_on_update)
    bpy.app.handlers.load_post.append(_on_load)


def unregister() -> None:
    bpy.app.handlers.load_post.remove(_on_load)
    bpy.app.handlers.depsgraph_update_post.remove(_on_update)
    del bpy.types.Scene.virtual_pinhole_picture
    del bpy.types.Object.virtual_pinhole_picture
    bpy.utils.unregister_class(OwnPicture)
