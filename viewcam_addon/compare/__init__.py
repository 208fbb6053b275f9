"""Two pictures: what differs, by how much, and is it explained.

geometry.py compares; law.py says what is allowed; statistics.py measures each pass; mismatches.py finds the pixels that see
another surface and re-traces them; cameras.py compares the cameras themselves; verdict.py puts it into sentences; report.py
draws it.
"""
