"""Two pictures: what differs, by how much, and is it explained.

Geometry: geometry.py compares; tolerances.py says what is allowed; statistics.py measures each pass; mismatches.py finds the
pixels that see another surface and re-traces them; cameras.py compares the cameras themselves; verdict.py is what was found,
and says it, and what the distance from the origin costs.

Light: radiance.py compares; sides.py makes means and variances of several seeds; noise_free.py compares light without noise
within tolerances, hypothesis_tests.py noisy light by chance, with the distributions of noise.py; perception.py tells what an
eye sees; light_verdict.py is what was found, and says it. report.py draws either, with pictures.py and charts.py.
"""
