"""The reference tracer: what is traced (`scene/`), the compiled core that traces it (`core/`), and the pictures of it.

`native.py` alone knows the core's C interface; `render.py` makes pictures, tile by tile (`tiles.py`). The tracer knows no
Blender, and of files only those of scenes.
"""
