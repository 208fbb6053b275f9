import bpy

bpy.ops.viewcam.paste_camera(text="eye=(0, 10, 0) look_at=(0, 0, 0) up=(1, 0, 0)")
