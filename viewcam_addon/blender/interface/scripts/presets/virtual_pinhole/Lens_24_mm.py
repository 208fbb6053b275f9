import bpy

# The angle of 36 mm, the longer side of a full frame.
bpy.ops.viewcam.paste_camera(text="fov=73.73979529168804 axis=larger")
