import bpy

bpy.ops.viewcam.paste_camera(text="eye=(0, 0, -10) look_at=(0, 0, 0) up=(0, -1, 0)")
