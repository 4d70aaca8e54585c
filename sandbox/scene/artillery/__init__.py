"""Artillery: `[terrain]` and `[artillery]`, ground of columns and who fights on it, and the scene they stand for.

`described.py` is what a file says, `landscape.py` lays ground out, `columns.py` reads it off a wall again, and
`expanding.py` writes it into a scene as walls and boxes.
"""
