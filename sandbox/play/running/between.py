"""Between: the picture that lies between two states."""

from dataclasses import replace

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.trajectory import Frame

LEAP = 4.0
"""Who is farther on than so many times what its speed explains was put there."""
TINY = 1e-18
"""m²: who hardly moves is no leaper"""


def between(before: Frame, after: Frame, share: float) -> Frame:
    """Return the state that lies a share (0 to 1) of the way from one to the next, on straight lines.

    A body that is not in both is as in the later one; so is one that was put elsewhere, farther than it flies.
    """
    if share >= 1.0 or before is after:
        return after
    known = min(len(before.position), len(after.position))
    time = before.time + (after.time - before.time) * share
    dt = abs(after.time - before.time)
    with np.errstate(all="ignore"):
        moved = after.position[:known] - before.position[:known]
        fastest = np.maximum(_squared(before.velocity[:known]), _squared(after.velocity[:known]))
        flew = _squared(moved) <= (LEAP * dt) ** 2 * fastest + TINY
        flew &= before.present[:known] & after.present[:known]
        position = after.position.copy()
        position[:known] -= moved * (flew * (1.0 - share))[:, None]
        angle = after.angle
        if before.angle is not after.angle:  # which those share who cannot turn
            angle = after.angle.copy()
            angle[:known] -= (after.angle[:known] - before.angle[:known]) * (flew * (1.0 - share))
    return replace(after, time=time, position=position, angle=angle)


def _squared(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nk,nk->n", vectors, vectors))
