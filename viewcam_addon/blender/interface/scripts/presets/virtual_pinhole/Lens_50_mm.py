import bpy

# The angle of 36 mm, the longer side of a full frame.
bpy.ops.viewcam.paste_camera(text="fov=39.597752709049864 axis=larger")
