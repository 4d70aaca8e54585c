"""Billiards: tables, sets of balls and racks by name, `[billiards]`, and the primitive scenes that they stand for.

`described.py` is what a file says, `tables.py` and `balls.py` hold the figures, `cushions.py` lays out what is fixed,
`racks.py` what moves, and `expanding.py` writes it all into a scene, after which nobody needs to know of billiards.
"""
