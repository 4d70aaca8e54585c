"""Pinball: tables described by what they are built of, `[pinball]`, and the primitive scenes that they stand for.

`described.py` is what a file says, `lines.py`, `targets.py`, `sensed.py` and `moving.py` its elements, `expanding.py`
writes them into a scene, after which nobody needs to know of pinball. Default figures are those of Visual Pinball's
physics, whose unit of length is 0.53975 mm (50 units are 1 1/16 in, a ball's diameter), in SI.
"""
