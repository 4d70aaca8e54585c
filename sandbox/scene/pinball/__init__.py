"""Pinball: tables described by what they are built of, `[pinball]`, and the primitive scenes that they stand for.

`described.py` is what a file says, `solids.py`, `sensed.py`, `moving.py` and `painted.py` its elements,
`faulting.py` says what is wrong with them, and `expanding.py` writes them into a scene, after which only rules know
of pinball. Default figures are those of Visual Pinball's physics, whose unit of length is 0.53975 mm (50 units are
1 1/16 in, a ball's diameter), in SI.
"""
