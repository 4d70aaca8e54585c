"""Stretch cap: springs that give way only so far, as cloth does (Provot 1995, Deformation constraints)."""

import numpy as np

from sandbox.engines.reference.joints.ties import SLIDE, SPRING, Ties

CAP = 0.1
"""How far cloth gives way, as a part of a spring's rest length."""


def cap_stretch(ties: Ties, cap: float) -> Ties:
    """Return the strings that keep springs from stretching farther, to be held with whatever else is.

    Springs of no rest length get none, for that would be a pivot; rotary springs neither.

    Args:
        ties: any.
        cap: the most stretch as a part of the rest length; inf for none.
    """
    some = np.flatnonzero((ties.kind == SPRING) & (ties.figures[:, 0] > 0.0) & np.isfinite(cap))
    own = ties.some(some)
    figures = np.zeros((len(some), 3))
    figures[:, 1] = (1.0 + cap) * own.figures[:, 0]
    return own._replace(kind=np.full(len(some), SLIDE), figures=figures, most_force=np.full(len(some), np.inf))
