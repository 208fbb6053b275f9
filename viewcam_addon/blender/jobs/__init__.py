"""Jobs where Blender is: one .blend, opened once, and many jobs of it.

renderer.py         opens, overrides settings, renders, checks, labels and exports job after job, and restores everything
job_settings.py     what of the file's settings a job changes for its time, and why each
stage.py            a scene as one job's two sides want it: clay, level, recentered, numbered, with its ledger
persistent_data.py  what Blender keeps from job to job, and where it must not
origins.py          what the pictures are made from: hashes of the .blend and all it links
checking.py         both sides of a check, and the question to the tracer's process
labeling.py         ground truth of a shot, by the tracer
scene_files.py      the scene for these two, kept from job to job
obstacles.py        why a job can't be had, known before anything is
"""
