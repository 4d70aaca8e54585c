"""Passages through slender bodies: turning bars, paddles and limbs whose ends pass another body within a step.

The largest disc inside a slender body says nothing of its ends. Here each piece of it is followed by its axis, the
longest segment between two corners. A body whose centre passes through the axis within a step, in the frame of the
piece, has passed through the body, whatever contacts the engine found in the meantime.
"""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.measure.missed_contacts.swept_geometry import CLEAR, cross, dot
from sandbox.measure.missed_contacts.verlet_list import CanCollide
from sandbox.scene.compile.bodies import Bodies
from sandbox.scene.geometry.shapes import Piece, geometry_of
from sandbox.scene.geometry.vectors import offset_from_segment
from sandbox.trajectory import Trajectory

SLENDER = 4.0
"""A body is slender if its bounding radius is more than this many times that of its largest inscribed disc."""
ARC = 0.1
"""rad: largest turn of a piece along which a path is taken to be straight: a chord is off its arc by 0.1 % of the
radius."""
MAX_TURN = math.pi
"""rad: frames between which a body turns farther do not say where its ends were."""


def is_slender(bodies: Bodies) -> BoolArray:
    """Return which bodies are slender, (N,), of those whose contacts are audited."""
    return (bodies.radius > SLENDER * bodies.core) & (bodies.core > 0.0)


def with_slender_passages(run: Trajectory, bodies: Bodies, can_collide: CanCollide) -> Trajectory:
    """Return a run with the passages through slender bodies among its missed contacts.

    They are found between frames, so that a run that records every n-th step only is returned unchanged, and motion
    within a step is taken to be uniform. Bodies that an action moved, or that change their layer, do not count then.

    Args:
        run: an audited run.
        bodies: its N bodies.
        can_collide: returns which pairs of indices (K,), (K,) can collide.
    """
    slender = np.flatnonzero(is_slender(bodies))
    if not len(slender) or run.info["settings"]["record_every"] > 1:
        return run
    motion = _Motion(run, bodies)
    found: set[tuple[int, int, int]] = set()
    with np.errstate(over="ignore", invalid="ignore"):  # diverging bodies
        for body in slender.tolist():
            when, other = motion.encounters(body)
            able = can_collide(np.minimum(other, body), np.maximum(other, body))
            when, other = when[able], other[able]
            passed = motion.passes(body, when, other)
            found.update(
                (k, min(body, n), max(body, n))
                for k, n in zip(when[passed].tolist(), other[passed].tolist(), strict=True)
            )
    step = np.searchsorted(run.time, run.missed_time, side="right") - 1
    found -= set(zip(step.tolist(), *run.missed_pair.T.tolist(), strict=True))
    rows = np.asarray(sorted(found), np.int64).reshape(-1, 3)
    time = np.concatenate((run.missed_time, run.time[rows[:, 0]]))
    pair = np.concatenate((run.missed_pair, rows[:, 1:]))
    order = np.lexsort((pair[:, 1], pair[:, 0], time))
    return replace(run, missed_time=time[order], missed_pair=pair[order])


class _Motion:
    """Motion of N bodies between T frames."""

    def __init__(self, run: Trajectory, bodies: Bodies) -> None:
        self._bodies = bodies
        self._position, self._angle, self._layer = run.position.copy(), run.angle, run.layer
        for action in run.info["actions"]:
            if action["kind"] == "move" and (frame := int(np.searchsorted(run.time, action["time"]))) < len(run.time):
                self._position[frame, bodies.number_of[action["body"]]] = np.nan
        with np.errstate(over="ignore", invalid="ignore"):
            move, self._turn = np.diff(self._position, axis=0), np.abs(np.diff(self._angle, axis=0))
            self._path = np.hypot(move[..., 0], move[..., 1])
            self._excess = self._path - CLEAR * bodies.core
            """(T − 1, N) m, path beyond the distance at which each is clear of the axis of another"""
            self._most = np.fmax.reduce(self._excess, axis=1)

    def encounters(self, body: int) -> tuple[IntArray, IntArray]:
        """Return intervals and other bodies, (K,) each, in which these may reach the axis of one from a clear start."""
        radius, turn = float(self._bodies.radius[body]), self._turn[:, body]
        reach = self._path[:, body] + turn * radius
        fast = np.flatnonzero((reach + self._most >= 0.0) & (turn <= MAX_TURN))
        able = reach[fast, None] + self._excess[fast] >= 0.0
        offset = self._position[fast] - self._position[fast, body : body + 1]
        able &= np.hypot(offset[..., 0], offset[..., 1]) <= radius + self._path[fast] + self._path[fast, body][:, None]
        able[:, body] = False
        if self._layer.size:
            for frame in (fast, fast + 1):
                able &= self._layer[frame] == self._layer[frame, body][:, None]
        row, other = np.nonzero(able)
        return fast[row], other

    def passes(self, body: int, when: IntArray, other: IntArray) -> BoolArray:
        """Return in which encounters (K,) the centre of the other body passes an axis from a clear start."""
        passed = np.zeros(len(when), np.bool_)
        if not len(when):
            return passed
        arcs = max(1, math.ceil(float(self._turn[when, body].max()) / ARC))
        fraction = np.linspace(0.0, 1.0, arcs + 1)[:, None]
        start, end = (self._position[k, other] - self._position[k, body] for k in (when, when + 1))
        offset = start + fraction[..., None] * (end - start)
        turned = self._angle[when, body] + fraction * (self._angle[when + 1, body] - self._angle[when, body])
        along, across = np.stack((np.cos(turned), np.sin(turned)), -1), np.stack((-np.sin(turned), np.cos(turned)), -1)
        local = np.stack((dot(offset, along), dot(offset, across)), axis=-1)
        for piece in geometry_of(self._bodies.elements[self._bodies.element[body]]).pieces:
            if len(piece.corners) > 1:
                tail, axis = _axis(piece)
                apart = offset_from_segment(local[0], tail, axis)
                is_clear = dot(apart, apart) >= (CLEAR * self._bodies.core[other]) ** 2
                # Coordinates along and across the axis; a sample on the axis is on its left.
                height, place = cross(axis, local - tail), dot(axis, local - tail) / dot(axis, axis)
                left = height >= 0.0
                rise = np.diff(height, axis=0)
                weight = -height[:-1] / np.where(rise == 0.0, 1.0, rise)
                at = place[:-1] + weight * np.diff(place, axis=0)
                crossed = (left[1:] != left[:-1]) & (at >= 0.0) & (at <= 1.0)
                passed |= is_clear & crossed.any(axis=0)
        return passed


def _axis(piece: Piece) -> tuple[FloatArray, FloatArray]:
    """Return the tail of the longest segment between two corners, and the vector to its head, (2,) m each."""
    tail, head = max(combinations(piece.corners, 2), key=lambda ends: math.dist(*ends))
    return np.asarray(tail), np.asarray(head) - np.asarray(tail)
