import bpy

# The angle of 36 mm, the longer side of a full frame.
bpy.ops.viewcam.paste_camera(text="fov=54.432223114614956 axis=larger")
