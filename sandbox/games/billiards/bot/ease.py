"""Ease: how likely a straight shot at a ball on goes into a pocket, by geometry alone.

With the ghost ball: where the cue ball is when it touches the object ball so that this leaves towards the pocket. An
error δ of the aim moves the touch by δ·d, d being the way to the ghost ball, and turns the object ball's way by
δ·d / (2R·cos φ), φ being the cut; the pocket takes so many rad as it is wide, less a ball, over the way to it.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.games.billiards.layout import Layout

THINNEST = 0.2
"""cos of the thinnest cut that is tried: 78°"""

GRAZE = 0.98
"""of two radii: who stands less in the way may be passed, as jaws and throw are not reckoned with"""


@dataclass(frozen=True, eq=False)
class Pots:
    """T balls times P pockets, straight shots from one place."""

    ghost: FloatArray
    """(T, P, 2) m, where the cue ball is to touch"""
    chance: FloatArray
    """(T, P) that the ball falls; 0 where something is in the way"""
    distance: FloatArray
    """(T, P) from the cue ball to the ghost ball, m"""


def mouths(layout: Layout, radius: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return what is aimed at: a point in each pocket's mouth, (P, 2) m, its way in, (P, 2), and its width, (P,) m."""
    holes = np.array(list(layout.pockets.values()), dtype=float).reshape(-1, 3)
    (x0, y0), (x1, y1) = layout.area
    inset = 0.7 * radius
    points = np.clip(holes[:, :2], (x0 + inset, y0 + inset), (x1 - inset, y1 - inset))
    inward = holes[:, :2] - points
    size = np.hypot(*inward.T)[:, None]
    return points, inward / np.maximum(size, 1e-12), holes[:, 2]


def pots(layout: Layout, radius: float, cue: FloatArray, targets: FloatArray, others: FloatArray, sigma: float) -> Pots:
    """Return how the straight shots are.

    Args:
        layout: of the table.
        radius: of the balls, m.
        cue: (2,) m, where the cue ball is.
        targets: (T, 2) m, the balls on.
        others: (B, 2) m, all object balls, those on too.
        sigma: rad, the error of the player's aim.
    """
    points, inward, width = mouths(layout, radius)
    to_mouth = points[None] - targets[:, None]
    far = np.maximum(np.hypot(to_mouth[..., 0], to_mouth[..., 1]), 1e-9)
    heading = to_mouth / far[..., None]
    ghost = targets[:, None] - 2.0 * radius * heading
    to_ghost = ghost - cue
    distance = np.maximum(np.hypot(to_ghost[..., 0], to_ghost[..., 1]), 1e-9)
    cut = np.einsum("tpc,tpc->tp", to_ghost / distance[..., None], heading)
    enters = np.einsum("tpc,pc->tp", heading, inward)
    opening = np.maximum(width * np.maximum(enters, 0.0) - radius, 0.0)
    margin = opening / far * 2.0 * radius * np.maximum(cut, 0.0) / distance
    chance = _erf(margin / (math.sqrt(2.0) * sigma))
    (x0, y0), (x1, y1) = layout.area
    inside = (ghost[..., 0] > x0 + 0.9 * radius) & (ghost[..., 0] < x1 - 0.9 * radius)
    inside &= (ghost[..., 1] > y0 + 0.9 * radius) & (ghost[..., 1] < y1 - 0.9 * radius)
    open_ = inside & (cut > THINNEST) & (opening > 0.0)
    for t, p in np.argwhere(open_):
        itself = np.hypot(*(others - targets[t]).T) < 1e-9
        rest = others[~itself]
        if _blocked(cue, ghost[t, p], rest, radius) or _blocked(targets[t], points[p], rest, radius):
            open_[t, p] = False
    return Pots(ghost, np.where(open_, chance, 0.0), distance)


def _blocked(begin: FloatArray, end: FloatArray, others: FloatArray, radius: float) -> bool:
    """Tell whether a ball stands in the straight way of another."""
    way, apart = end - begin, others - begin
    share = np.clip(apart @ way / max(float(way @ way), 1e-18), 0.0, 1.0)
    away = apart - share[:, None] * way
    near: BoolArray = np.einsum("kc,kc->k", away, away) < (2.0 * GRAZE * radius) ** 2
    return bool(near.any())


def _erf(x: FloatArray) -> FloatArray:
    """Return the error function to 5e-4 (Abramowitz & Stegun 7.1.27), which is more than a guess deserves."""
    return np.asarray(1.0 - (1.0 + 0.278393 * x + 0.230389 * x**2 + 0.000972 * x**3 + 0.078108 * x**4) ** -4)
