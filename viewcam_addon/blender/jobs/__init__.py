"""A batch where Blender is: one .blend, opened once, and many shots of it.

renderer.py    opens, overrides settings, renders shot after shot, and restores everything
shot_settings.py     what of the file's settings a batch changes for its time, and why each
persistent_data.py     what Blender keeps from shot to shot, and where it must not
pictures.py    a render as files: EXR and preview, the same bytes each time
origins.py     what the pictures are made from: hashes of the .blend and all it links
checking.py    whether Cycles and the tracer see the same through a shot's camera
labelling.py   ground truth of a shot, by the tracer
scene_files.py the scene for those two, kept from shot to shot
obstacles.py   why a shot can't be rendered, known before anything is
"""
