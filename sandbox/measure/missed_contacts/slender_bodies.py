"""Passages through slender bodies: turning bars, paddles and limbs whose ends pass another body within a step.

The largest disc inside a slender body says nothing of its ends. Here each piece of it is followed by its axis, the
longest segment between two corners. A body whose centre passes through the axis within a step, in the frame of the
piece, has passed through the body.

A passage counts if it is certain: the two were clear of each other before, and moved uniformly meanwhile, as their
velocities before and after confirm. So neither a bounce within a step, nor a body that an action moved, nor one that is
squeezed through a contact counts.
"""

import math
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

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
UNIFORM = 0.25
"""Largest difference of a displacement from velocity × time, before and after, as a fraction of the relative path: a
body that is accelerated so in one step does not move straight."""
CHUNK = 1 << 14
"""Encounters that are examined together."""


class _Encounters(NamedTuple):
    """Intervals, slender bodies and other bodies, (K,) each."""

    when: IntArray = np.empty(0, np.int64)
    body: IntArray = np.empty(0, np.int64)
    other: IntArray = np.empty(0, np.int64)

    def some(self, which: BoolArray | slice) -> "_Encounters":
        return _Encounters(self.when[which], self.body[which], self.other[which])


def is_slender(bodies: Bodies) -> BoolArray:
    """Return which bodies are slender, (N,), of those whose contacts are audited."""
    return (bodies.radius > SLENDER * bodies.core) & (bodies.core > 0.0)


def with_slender_passages(run: Trajectory, bodies: Bodies, can_collide: CanCollide) -> Trajectory:
    """Return a run with the passages through slender bodies among its missed contacts.

    They are found between frames, so that a run that records every n-th step only is returned unchanged. Bodies on
    different layers do not count.

    Args:
        run: an audited run.
        bodies: its N bodies.
        can_collide: returns which pairs of indices (K,), (K,) can collide.
    """
    if not is_slender(bodies).any() or run.info["settings"]["record_every"] > 1 or len(run.time) < 2:
        return run
    with np.errstate(over="ignore", invalid="ignore"):  # diverging bodies
        found = _Passages(run, bodies).find(can_collide)
    step = np.searchsorted(run.time, run.missed_time, side="right") - 1
    known = set(zip(step.tolist(), *run.missed_pair.T.tolist(), strict=True))
    lower, upper = np.minimum(found.body, found.other), np.maximum(found.body, found.other)
    new = sorted(set(zip(found.when.tolist(), lower.tolist(), upper.tolist(), strict=True)) - known)
    rows = np.asarray(new, np.int64).reshape(-1, 3)
    time = np.concatenate((run.missed_time, run.time[rows[:, 0]]))
    pair = np.concatenate((run.missed_pair, rows[:, 1:]))
    order = np.lexsort((pair[:, 1], pair[:, 0], time))
    return replace(run, missed_time=time[order], missed_pair=pair[order])


class _Passages:
    """Motion of N bodies between T frames, and the passages through slender ones."""

    def __init__(self, run: Trajectory, bodies: Bodies) -> None:
        self._run, self._bodies = run, bodies
        self._slender = np.flatnonzero(is_slender(bodies))
        self._axes = {body: _axes(bodies, body) for body in self._slender.tolist()}

    def find(self, can_collide: CanCollide) -> _Encounters:
        """Return the passages."""
        self._slender = np.asarray([body for body in self._slender.tolist() if self._has_other(body, can_collide)], int)
        if not len(self._slender):
            return _Encounters()
        found = [_Encounters()]
        pending, count = list[_Encounters](), 0
        for when in range(len(self._run.time) - 1):
            near = self._near(when)
            near = near.some(can_collide(np.minimum(near.body, near.other), np.maximum(near.body, near.other)))
            pending.append(near)
            count += len(near.when)
            if count > CHUNK or when == len(self._run.time) - 2:
                both = _Encounters(*map(np.concatenate, zip(*pending, strict=True)))
                found.append(both.some(self._passes(both)))
                pending, count = [], 0
        return _Encounters(*map(np.concatenate, zip(*found, strict=True)))

    def _has_other(self, body: int, can_collide: CanCollide) -> bool:
        """Return whether a slender body can collide with any other body."""
        others = np.delete(np.arange(len(self._bodies)), body)
        return bool(can_collide(np.minimum(others, body), np.maximum(others, body)).any())

    def _near(self, when: int) -> _Encounters:
        """Return the encounters of an interval in which the other body may pass the axis from a clear start."""
        run, bodies, slender = self._run, self._bodies, self._slender
        position, move = run.position[when], run.position[when + 1] - run.position[when]
        present = np.isfinite(move).all(axis=1)
        if not present.any():
            return _Encounters()
        move -= np.median(move[present], axis=0)  # bodies that fall together do not meet
        path = np.where(present, np.hypot(move[:, 0], move[:, 1]), 0.0)
        turn = np.abs(run.angle[when + 1, slender] - run.angle[when, slender])
        own = path[slender] + turn * bodies.radius[slender]
        fast = (own + path.max() >= CLEAR * (bodies.thin[slender] + bodies.core.min())) & (turn <= MAX_TURN)
        slender, own = slender[fast], own[fast]
        # Bodies in order of x, of which each slender one has those within its reach
        order = np.argsort(position[:, 0])  # nan at the end
        x = position[order, 0]
        reach = bodies.radius[slender] + path[slender] + path.max()
        first = np.searchsorted(x, position[slender, 0] - reach)
        count = np.maximum(np.searchsorted(x, position[slender, 0] + reach, side="right") - first, 0)
        row = np.repeat(np.arange(len(slender)), count)
        other = order[np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + first[row]]
        body = slender[row]
        offset = position[other] - position[body]
        near = np.hypot(offset[:, 0], offset[:, 1]) <= bodies.radius[body] + path[body] + path[other]
        near &= own[row] + path[other] >= CLEAR * (bodies.core[other] + bodies.thin[body])
        near &= body != other
        if run.layer.size:
            for frame in (when, when + 1):
                near &= run.layer[frame, body] == run.layer[frame, other]
        return _Encounters(np.full(len(row), when), body, other).some(near)

    def _passes(self, found: _Encounters) -> BoolArray:
        """Return in which encounters (K,) the other centre passes an axis, uniformly and from a clear start."""
        when, body, other = found
        run, bodies = self._run, self._bodies
        passed = np.zeros(len(when), np.bool_)
        if not len(when):
            return passed
        start, end = (run.position[k, other] - run.position[k, body] for k in (when, when + 1))
        turn = run.angle[when + 1, body] - run.angle[when, body]
        arcs = max(1, math.ceil(float(np.abs(turn).max()) / ARC))
        fraction = np.linspace(0.0, 1.0, arcs + 1)[:, None]
        offset = start + fraction[..., None] * (end - start)
        turned = run.angle[when, body] + fraction * turn
        along, across = np.stack((np.cos(turned), np.sin(turned)), -1), np.stack((-np.sin(turned), np.cos(turned)), -1)
        local = np.stack((dot(offset, along), dot(offset, across)), axis=-1)
        clear2 = (CLEAR * (bodies.core[other] + bodies.thin[body])) ** 2
        for piece in range(max(map(len, self._axes.values()))):
            has = np.flatnonzero([len(self._axes[each]) > piece for each in body.tolist()])
            if not len(has):
                continue
            ends = np.asarray([self._axes[each][piece] for each in body[has].tolist()])
            tail, axis = ends[:, 0], ends[:, 1] - ends[:, 0]
            apart = offset_from_segment(local[0, has], tail, axis)
            # Coordinates along and across the axis; a sample on the axis is on its left.
            height, place = cross(axis, local[:, has] - tail), dot(axis, local[:, has] - tail) / dot(axis, axis)
            left, rise = height >= 0.0, np.diff(height, axis=0)
            at = place[:-1] - height[:-1] / np.where(rise == 0.0, 1.0, rise) * np.diff(place, axis=0)
            crossed = (left[1:] != left[:-1]) & (at >= 0.0) & (at <= 1.0)
            passed[has] |= (dot(apart, apart) >= clear2[has]) & crossed.any(axis=0)
        return passed & self._moves_uniformly(found)

    def _moves_uniformly(self, found: _Encounters) -> BoolArray:
        """Return in which encounters (K,) both bodies moved and turned as their velocities before and after say."""
        when, body, other = found
        run, bodies = self._run, self._bodies
        dt = run.time[when + 1] - run.time[when]
        turn = run.angle[when + 1, body] - run.angle[when, body]
        moves = [run.position[when + 1, each] - run.position[when, each] for each in (body, other)]
        relative = moves[1] - moves[0]
        slack = UNIFORM * (np.hypot(relative[:, 0], relative[:, 1]) + np.abs(turn) * bodies.radius[body])
        uniform = np.ones(len(when), np.bool_)
        for frame in (when, when + 1):
            for move, each in zip(moves, (body, other), strict=True):
                off = move - run.velocity[frame, each] * dt[:, None]
                uniform &= np.hypot(off[:, 0], off[:, 1]) <= slack
            uniform &= np.abs(turn - run.angular_velocity[frame, body] * dt) * bodies.radius[body] <= slack
        return uniform


def _axes(bodies: Bodies, body: int) -> list[FloatArray]:
    """Return the ends of the axis of each piece of a body that has one, (2, 2) m each."""
    pieces = geometry_of(bodies.elements[bodies.element[body]]).pieces
    return [_axis(piece) for piece in pieces if len(piece.corners) > 1]


def _axis(piece: Piece) -> FloatArray:
    """Return the ends of the longest segment between two corners, (2, 2) m."""
    return np.asarray(max(combinations(piece.corners, 2), key=lambda ends: math.dist(*ends)))
