"""The reference tracer: what is traced (`scene/`), the compiled core that traces it (`core/`), and the pictures that become of it.

`native.py` alone knows the core's C interface; `render.py` makes pictures, tile by tile (`tiles.py`). It knows no Blender, and of
files only those of scenes.
"""
