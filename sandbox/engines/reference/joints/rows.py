"""Rows: what holds two bodies as demands on their velocities, for sequential impulses to fulfil.

As in Munk2D (`cpPinJoint.c`, `cpPivotJoint.c`, `cpSlideJoint.c`, `cpRotaryLimitJoint.c`): a row asks for the velocity
that undoes the share 1 − bias^h of its error within a step. Other than there, that velocity has no bound of its own.
"""

from typing import NamedTuple

import numpy as np

from sandbox.engines.kernel import bare_kernel
from sandbox.engines.reference.joints.ties import (
    PIVOT,
    ROD,
    ROTARY_LIMIT,
    ROTARY_SPRING,
    Ties,
    block,
    line,
    reach,
    slackness,
    turning,
    yielding,
)
from sandbox.trajectory import FloatArray, IntArray

ALONG, BOTH, TURN = 0, 1, 2
"""What a row holds: the ends along their line, the ends in both directions, the angle."""


class Rows(NamedTuple):
    """K rows, one a tie. Impulses are those on the second body."""

    holds: IntArray
    """(K,) `ALONG`, `BOTH` or `TURN`"""
    first: IntArray
    """(K,) body number, or −1 for the world"""
    second: IntArray
    """(K,)"""
    arm: FloatArray
    """(K, 4) m, from the centres to the ends: ax, ay, bx, by"""
    normal: FloatArray
    """(K, 2) from the first end to the second, where it holds along"""
    mass: FloatArray
    """(K, 3) kg or kg·m², first only; where it holds both, the matrix's xx, xy, yy. 0 where nothing can move"""
    target: FloatArray
    """(K, 2) m/s or rad/s, the wanted velocity of the second end as seen from the first"""
    bound: FloatArray
    """(K, 2) N·s or N·m·s, least and most sum of impulses; 0, 0 for what holds nothing now"""
    impulse: FloatArray
    """(K, 2) N·s or N·m·s, the sum so far, along the normal, or x and y, or the angular one"""


def rows_of(ties: Ties) -> Rows:
    """Return rows for ties, with no impulse yet. Springs among them are for keeping their impulses alone."""
    count = len(ties.kind)
    holds = np.full(count, ALONG)
    holds[ties.kind == PIVOT] = BOTH
    holds[np.isin(ties.kind, (ROTARY_LIMIT, ROTARY_SPRING))] = TURN
    pairs = [np.zeros((count, 2)) for _ in range(4)]
    return Rows(
        holds,
        ties.first,
        ties.second,
        np.zeros((count, 4)),
        pairs[0],
        np.zeros((count, 3)),
        pairs[1],
        pairs[2],
        pairs[3],
    )


@bare_kernel
def prepare(
    rows: Rows,
    ties: Ties,
    pose: FloatArray,
    h: float,
    old_h: float,
    bias: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Bring rows up to date with where the bodies are; their impulses become what to start from.

    An impulse is in proportion to its time, so that a shorter step starts from a smaller one. A longer one does not
    start from more: what was a blow does not grow with time, and after a very short step it would be a large one.

    Args:
        rows: K of them, changed.
        ties: the same K.
        pose: (N, 3) m and rad.
        h: step, s.
        old_h: the step that the impulses are of, s.
        bias: the share of an error that is left after a second, 0 to 1.
        inverse_mass: (N,) 1/kg.
        inverse_moment: (N,) 1/(kg·m²).
    """
    rate = (1.0 - bias**h) / h
    kept = min(h / old_h, 1.0)
    for k in range(len(rows.holds)):
        i, j = ties.first[k], ties.second[k]
        most = ties.most_force[k] * h
        rows.bound[k, 0], rows.bound[k, 1] = -most, most
        rows.impulse[k, 0] *= kept
        rows.impulse[k, 1] *= kept
        if rows.holds[k] == TURN:
            turned = turning(i, j, pose)
            error = _beyond(rows, k, turned, ties.figures[k, 0], ties.figures[k, 1])
            share = slackness(i, j, inverse_moment)
            rows.mass[k, 0] = 1.0 / share if share > 0.0 else 0.0
            rows.target[k, 0] = -rate * error
            continue
        arms, dx, dy = reach(ties, k, pose)
        rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3] = arms
        if rows.holds[k] == BOTH:
            xx, xy, yy = block(i, j, arms, inverse_mass, inverse_moment)
            rows.mass[k, 0], rows.mass[k, 1], rows.mass[k, 2] = xx, xy, yy
            rows.target[k, 0], rows.target[k, 1] = -rate * dx, -rate * dy
            continue
        length, nx, ny = line(dx, dy)
        rows.normal[k, 0], rows.normal[k, 1] = nx, ny
        share = yielding(i, j, arms, nx, ny, inverse_mass, inverse_moment) if length > 0.0 else 0.0
        rows.mass[k, 0] = 1.0 / share if share > 0.0 else 0.0
        if ties.kind[k] == ROD:
            error = length - ties.figures[k, 0]
        else:
            error = _beyond(rows, k, length, ties.figures[k, 0], ties.figures[k, 1])
        rows.target[k, 0] = -rate * error


@bare_kernel
def _beyond(rows: Rows, k: int, value: float, least: float, most: float) -> float:
    """Return how far a value is out of its bounds, and let row k push back only; within, it forgets its impulse."""
    if value > most:
        rows.bound[k, 1] = 0.0
        rows.impulse[k, 0] = min(rows.impulse[k, 0], 0.0)
        return value - most
    if value < least:
        rows.bound[k, 0] = 0.0
        rows.impulse[k, 0] = max(rows.impulse[k, 0], 0.0)
        return value - least
    rows.bound[k, 0] = rows.bound[k, 1] = 0.0
    rows.impulse[k, 0] = 0.0
    return 0.0


def impulses_of(rows: Rows, ties: Ties, out: FloatArray) -> None:
    """Write each row's impulse on the second body into its link's row: x and y, N·s; a turn's, N·m·s, and 0.

    Args:
        rows: K of them.
        ties: the same K.
        out: (J, 2), by number of link.
    """
    along = (rows.holds == ALONG)[:, None]
    out[ties.link] = np.where(along, rows.impulse[:, :1] * rows.normal, rows.impulse)
