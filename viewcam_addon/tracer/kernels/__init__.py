"""Loops that numba compiles, each in place of a function of rays/ or light/, in the module of the same name.

compiled/standing.py puts them there. They stand on packets.py, where rays are traced sixteen at a time.
"""
