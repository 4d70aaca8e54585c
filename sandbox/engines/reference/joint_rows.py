"""Velocity constraints of joints, and their sequential impulses.

VelocityConstraints: joints as constraints on velocities, for sequential impulses.

As in Munk2D (`cpPinJoint.c`, `cpPivotJoint.c`, `cpSlideJoint.c`, `cpRotaryLimitJoint.c`): a row asks for the velocity
that undoes the fraction 1 − bias^h of its error within a step. Other than there, that velocity has no bound of its own.
"""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray, IntArray
from sandbox.engines.common.kernel import bare_kernel
from sandbox.engines.reference.joint_data import (
    PIVOT,
    ROD,
    ROTARY_LIMIT,
    ROTARY_SPRING,
    JointData,
    apply_angular_impulse,
    apply_impulse,
    block,
    line,
    parting,
    reach,
    slackness,
    turning,
    yielding,
)

ALONG, BOTH, TURN = 0, 1, 2
"""What a row holds: the ends along their line, the ends in both directions, the angle."""


class VelocityConstraints(NamedTuple):
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
    """(K, 2) N·s or N·m·s, least and most sum of impulses; 0, 0 if inactive"""
    impulse: FloatArray
    """(K, 2) N·s or N·m·s, the sum so far, along the normal, or x and y, or the angular one"""


def rows_of(ties: JointData) -> VelocityConstraints:
    """Return rows for ties, with no impulse yet. Springs among them are for keeping their impulses alone."""
    count = len(ties.kind)
    holds = np.full(count, ALONG)
    holds[ties.kind == PIVOT] = BOTH
    holds[np.isin(ties.kind, (ROTARY_LIMIT, ROTARY_SPRING))] = TURN
    pairs = [np.zeros((count, 2)) for _ in range(4)]
    return VelocityConstraints(
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
    rows: VelocityConstraints,
    ties: JointData,
    pose: FloatArray,
    h: float,
    old_h: float,
    bias: float,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Update rows to the present poses; their impulses become the warm start.

    An impulse is in proportion to its time, so that a shorter step starts from a smaller one. A longer one does not
    start from more: the impulse of an impact does not grow with time, and would be too large after a very short step.

    Args:
        rows: K of them, changed.
        ties: the same K.
        pose: (N, 3) m and rad.
        h: step, s.
        old_h: the step that the impulses are of, s.
        bias: the fraction of an error that is left after a second, 0 to 1.
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
            inverse = slackness(i, j, inverse_moment)
            rows.mass[k, 0] = 1.0 / inverse if inverse > 0.0 else 0.0
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
        inverse = yielding(i, j, arms, nx, ny, inverse_mass, inverse_moment) if length > 0.0 else 0.0
        rows.mass[k, 0] = 1.0 / inverse if inverse > 0.0 else 0.0
        if ties.kind[k] == ROD:
            error = length - ties.figures[k, 0]
        else:
            error = _beyond(rows, k, length, ties.figures[k, 0], ties.figures[k, 1])
        rows.target[k, 0] = -rate * error


@bare_kernel
def _beyond(rows: VelocityConstraints, k: int, value: float, least: float, most: float) -> float:
    """Return how far a value is out of its bounds; bound row k to one sign, or clear its impulse within bounds."""
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


def impulses_of(rows: VelocityConstraints, ties: JointData, out: FloatArray) -> None:
    """Write each row's impulse on the second body into its link's row: x and y, N·s; a turn's, N·m·s, and 0.

    Args:
        rows: K of them.
        ties: the same K.
        out: (J, 2), by number of link.
    """
    along = (rows.holds == ALONG)[:, None]
    out[ties.link] = np.where(along, rows.impulse[:, :1] * rows.normal, rows.impulse)


@bare_kernel
def warm_start(
    rows: VelocityConstraints, velocity: FloatArray, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> None:
    """Apply the impulses that rows start from; arguments as in `one_pass`."""
    for k in range(len(rows.holds)):
        _give(rows, k, rows.impulse[k, 0], rows.impulse[k, 1], velocity, inverse_mass, inverse_moment)


@bare_kernel
def one_pass(
    rows: VelocityConstraints, velocity: FloatArray, inverse_mass: FloatArray, inverse_moment: FloatArray
) -> None:
    """Fulfil each row once, in order; a sum of impulses never leaves its bounds.

    Args:
        rows: K of them; their impulses are changed.
        velocity: (N, 3) m/s and rad/s, changed.
        inverse_mass: (N,) 1/kg, 0 for fixed bodies.
        inverse_moment: (N,) 1/(kg·m²).
    """
    for k in range(len(rows.holds)):
        least, most = rows.bound[k, 0], rows.bound[k, 1]
        if least == most:
            continue
        i, j = rows.first[k], rows.second[k]
        old_x, old_y = rows.impulse[k, 0], rows.impulse[k, 1]
        if rows.holds[k] == TURN:
            missing = rows.target[k, 0] - turning(i, j, velocity)
            rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, least), most)
        else:
            arms = rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3]
            vx, vy = parting(i, j, arms, velocity)
            if rows.holds[k] == BOTH:
                vx, vy = rows.target[k, 0] - vx, rows.target[k, 1] - vy
                x = old_x + rows.mass[k, 0] * vx + rows.mass[k, 1] * vy
                y = old_y + rows.mass[k, 1] * vx + rows.mass[k, 2] * vy
                if most < math.inf:
                    size = math.sqrt(x * x + y * y)
                    scale = most / size if size > most else 1.0
                    x, y = scale * x, scale * y
                rows.impulse[k, 0], rows.impulse[k, 1] = x, y
            else:
                missing = rows.target[k, 0] - (vx * rows.normal[k, 0] + vy * rows.normal[k, 1])
                rows.impulse[k, 0] = min(max(old_x + rows.mass[k, 0] * missing, least), most)
        more_x, more_y = rows.impulse[k, 0] - old_x, rows.impulse[k, 1] - old_y
        _give(rows, k, more_x, more_y, velocity, inverse_mass, inverse_moment)


@bare_kernel
def row_work(rows: VelocityConstraints, velocity: FloatArray) -> float:
    """Return the work, J, of all rows' impulses: times how fast their bodies part, where velocities are (N, 3)."""
    work = 0.0
    for k in range(len(rows.holds)):
        i, j, x, y = rows.first[k], rows.second[k], rows.impulse[k, 0], rows.impulse[k, 1]
        if rows.holds[k] == TURN:
            work += x * turning(i, j, velocity)
            continue
        if rows.holds[k] != BOTH:
            x, y = x * rows.normal[k, 0], x * rows.normal[k, 1]
        arms = rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3]
        vx, vy = parting(i, j, arms, velocity)
        work += x * vx + y * vy
    return work


@bare_kernel
def _give(
    rows: VelocityConstraints,
    k: int,
    x: float,
    y: float,
    velocity: FloatArray,
    inverse_mass: FloatArray,
    inverse_moment: FloatArray,
) -> None:
    """Apply an impulse of row k, in the row's own terms."""
    i, j = rows.first[k], rows.second[k]
    if rows.holds[k] == TURN:
        apply_angular_impulse(i, j, x, inverse_moment, velocity)
        return
    if rows.holds[k] != BOTH:
        x, y = x * rows.normal[k, 0], x * rows.normal[k, 1]
    arms = rows.arm[k, 0], rows.arm[k, 1], rows.arm[k, 2], rows.arm[k, 3]
    apply_impulse(i, j, arms, x, y, inverse_mass, inverse_moment, velocity)
