"""The reference tracer, from the ground: what is traced (`scene/`), what rays meet (`rays/`), what light does (`light/`).

`render.py` makes pictures of them, tile by tile (`tiles.py`); `arrays.py` has the few operations on vectors that all share. It
knows no Blender, and of files only those of scenes.
"""
