"""Joints of a scene as arrays, J rows, by the indices of their bodies.

Most joints are one row. A weld, a prismatic joint and a wheel consist of several: the first is at the place of the
joint, the others follow those of all joints, and `part_of` relates them.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from sandbox.arrays import BoolArray, FloatArray, IntArray
from sandbox.scene.geometry.vectors import rotate

WORLD = -1
"""Index of the static world, as the first body of a joint."""


class JointKind(IntEnum):
    """Kind of a joint, and the meaning of its `figures`."""

    ROD = 0
    """length, m"""
    PIVOT = 1
    """none"""
    SLIDE = 2
    """smallest and largest length, m"""
    GROOVE = 3
    """far end of the groove in the first body's frame, m; `anchor_a` is its near end"""
    ROTARY_LIMIT = 4
    """smallest and largest angle_b − angle_a, rad"""
    MOTOR = 5
    """target rate of angle_b − angle_a, rad/s"""
    GEAR = 6
    """phase, rad, and ratio: angle_b·ratio − angle_a = phase"""
    SPRING = 7
    """rest length, m, stiffness, N/m, damping, N·s/m"""
    ROTARY_SPRING = 8
    """rest angle of angle_b − angle_a, rad, stiffness, N·m/rad, damping, N·m·s/rad"""
    PULLEY = 9
    """length of the rope, m, and ratio: length_a + ratio·length_b is at most the length"""
    RATCHET = 10
    """last click, phase and angle between two clicks, of angle_b − angle_a, rad"""
    LINEAR_MOTOR = 11
    """far end of the axis in the first body's frame, m, `anchor_a` is its near end; speed along it, m/s"""


MOTORS = (JointKind.MOTOR, JointKind.LINEAR_MOTOR)
"""Kinds that prescribe a rate, up to a largest force or torque"""

RATE_OF = {JointKind.MOTOR: 0, JointKind.LINEAR_MOTOR: 2}
"""Column of `figures` with the rate of a motor"""

TURNING = (
    JointKind.GROOVE,
    JointKind.ROTARY_LIMIT,
    JointKind.MOTOR,
    JointKind.GEAR,
    JointKind.ROTARY_SPRING,
    JointKind.RATCHET,
    JointKind.LINEAR_MOTOR,
)
"""Kinds that can rotate bodies at any anchor; the others only at anchors off the centre of mass."""


CLICK_TOLERANCE = 0.05
"""Fraction of the angle between two clicks by which a load may have turned back a ratchet that holds"""


def last_click(angle: FloatArray | float, phase: FloatArray | float, ratchet: FloatArray | float) -> FloatArray:
    """Return the last clicks of ratchets that turned to some angles, rad, as Munk2D (`cpRatchetJoint.c`)."""
    return np.asarray(np.floor((angle - phase) / ratchet) * ratchet + phase)


@dataclass(frozen=True, eq=False)
class JointArrays:
    """The joints of a scene: those of the file in their order, then those of its generators."""

    kind: IntArray
    """(J,) `JointKind`"""
    a: IntArray
    """(J,) index of the first body, or `WORLD`"""
    b: IntArray
    """(J,) index of the second body"""
    anchor_a: FloatArray
    """(J, 2) m, in the first body's frame about its centre of mass; for the world, a position"""
    anchor_b: FloatArray
    """(J, 2) m, in the second body's frame about its centre of mass"""
    figures: FloatArray
    """(J, 3) parameters by kind, unused ones 0"""
    wheels: FloatArray
    """(J, 4) m, positions of both wheels of a pulley in the world: ax, ay, bx, by; else 0"""
    max_force: FloatArray
    """(J,) largest force or torque, N or N·m; inf without a limit"""
    max_bias: FloatArray
    """(J,) largest speed of error correction, m/s or rad/s; inf without a limit"""
    bias: FloatArray
    """(J,) fraction of the error that remains after one second; nan: that of the solver"""
    pulls_only: BoolArray
    """(J,) whether a spring acts only while it is longer than its rest length, and never pushes"""
    collide: BoolArray
    """(J,) whether the two bodies also collide"""
    strength: FloatArray
    """(J,) force or torque at which each breaks, N or N·m; inf if it cannot"""
    number: IntArray
    """(J,) index of each among the joints of the whole scene; 0 to J − 1 unless this is a selection"""
    part_of: IntArray
    """(J,) `number` of the first row of the joint that each row belongs to"""
    names: tuple[str, ...]
    """(J,)"""

    def __deepcopy__(self, _: dict[int, Any]) -> Self:
        """Return itself: it never changes, so that copies of a simulation can share it."""
        return self

    def __len__(self) -> int:
        return len(self.kind)

    @cached_property
    def motor_rows(self) -> dict[str, int]:
        """Row of the motor of each joint that has one, by the name of the joint."""
        motors = np.flatnonzero(np.isin(self.kind, MOTORS)).tolist()
        first = dict(zip(self.number.tolist(), self.names, strict=True))
        return {first[int(self.part_of[row])]: row for row in motors}

    def actuated(self, levels: Mapping[int, float]) -> Self:
        """Return the joints with motors at levels, −1 to 1, by their rows: their rates and largest forces."""
        figures, max_force = self.figures.copy(), self.max_force.copy()
        for row, level in levels.items():
            figures[row, RATE_OF[JointKind(int(self.kind[row]))]] *= math.copysign(1.0, level)
            max_force[row] = max_force[row] * abs(level) if level else 0.0  # an unlimited one is off too
        return replace(self, figures=figures, max_force=max_force)

    @classmethod
    def none(cls) -> Self:
        """Return an empty set of joints."""
        return cls(
            kind=np.empty(0, np.int64),
            a=np.empty(0, np.int64),
            b=np.empty(0, np.int64),
            anchor_a=np.empty((0, 2)),
            anchor_b=np.empty((0, 2)),
            figures=np.empty((0, 3)),
            wheels=np.empty((0, 4)),
            max_force=np.empty(0),
            max_bias=np.empty(0),
            bias=np.empty(0),
            pulls_only=np.empty(0, np.bool_),
            collide=np.empty(0, np.bool_),
            strength=np.empty(0),
            number=np.empty(0, np.int64),
            part_of=np.empty(0, np.int64),
            names=(),
        )

    @classmethod
    def alike(
        cls,
        kind: JointKind,
        a: npt.ArrayLike,
        b: npt.ArrayLike,
        anchor_a: npt.ArrayLike = (0.0, 0.0),
        anchor_b: npt.ArrayLike = (0.0, 0.0),
        figures: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> Self:
        """Return J nameless unbreakable joints of one kind between bodies that do not collide.

        `figures` may be a single row for all of them.
        """
        first, second = np.asarray(a, dtype=np.int64), np.asarray(b, dtype=np.int64)
        count = len(first)
        return cls(
            kind=np.full(count, kind, np.int64),
            a=first,
            b=second,
            anchor_a=np.broadcast_to(np.asarray(anchor_a, dtype=np.float64), (count, 2)).copy(),
            anchor_b=np.broadcast_to(np.asarray(anchor_b, dtype=np.float64), (count, 2)).copy(),
            figures=np.broadcast_to(np.asarray(figures, dtype=np.float64), (count, 3)).copy(),
            wheels=np.zeros((count, 4)),
            max_force=np.full(count, np.inf),
            max_bias=np.full(count, np.inf),
            bias=np.full(count, np.nan),
            pulls_only=np.zeros(count, np.bool_),
            collide=np.zeros(count, np.bool_),
            strength=np.full(count, np.inf),
            number=np.arange(count),
            part_of=np.arange(count),
            names=("",) * count,
        )

    def some(self, which: BoolArray | IntArray) -> Self:
        """Return a selection, by mask or by indices."""
        if not len(self):
            return self
        indices = np.arange(len(self))[which]
        columns = {f.name: getattr(self, f.name)[indices] for f in fields(self) if f.name != "names"}
        return replace(self, names=tuple(self.names[k] for k in indices.tolist()), **columns)

    def joined(self, more: Self) -> Self:
        """Return these and more joints."""
        columns = {
            f.name: np.concatenate((getattr(self, f.name), getattr(more, f.name)))
            for f in fields(self)
            if f.name != "names"
        }
        return replace(self, names=(*self.names, *more.names), **columns)

    def counted(self) -> Self:
        """Return these joints numbered as those of a whole scene, in the order of their numbers so far."""
        return replace(self, number=np.arange(len(self)), part_of=np.searchsorted(self.number, self.part_of))

    @property
    def is_compound(self) -> BoolArray:
        """(J,) whether each row belongs to a joint of several rows."""
        is_part = self.part_of != self.number
        return np.asarray(np.isin(self.part_of, self.part_of[is_part])) if is_part.any() else is_part

    def whole(self, rows: IntArray) -> IntArray:
        """Return the rows of the joints that some rows belong to, in ascending order: a joint breaks as a whole."""
        return np.flatnonzero(np.isin(self.part_of, self.part_of[rows]))

    def count_among(self, rows: Collection[int] | IntArray) -> int:
        """Return the number of joints that some rows belong to."""
        return len(np.unique(self.part_of[list(rows)])) if len(rows) else 0

    def without(self, broken: Collection[int]) -> Self:
        """Return the joints without those of some indices in the whole scene; a compound one is left out as a whole."""
        if not broken:
            return self
        return self.some(~np.isin(self.part_of, self.part_of[np.isin(self.number, list(broken))]))

    def of(self, *kinds: JointKind) -> Self:
        """Return the joints of some kinds."""
        return self if not len(self) else self.some(np.isin(self.kind, kinds))

    @property
    def is_limited(self) -> BoolArray:
        """(J,) whether each may give way: its force, or the speed of its error correction, has a limit."""
        return np.asarray(np.isfinite(self.max_force) | np.isfinite(self.max_bias))

    def clicked(self, angle: FloatArray) -> Self:
        """Return the joints with ratchets at the last clicks of bodies that turned to angles, (N,) rad."""
        if not (self.kind == JointKind.RATCHET).any():
            return self
        rows, figures = self.kind == JointKind.RATCHET, self.figures.copy()
        _, phase, ratchet = figures[rows].T
        a, b = self.a[rows], self.b[rows]
        turned = angle[b] - np.where(a >= 0, angle[a], 0.0)
        figures[rows, 0] = last_click(turned + CLICK_TOLERANCE * ratchet, phase, ratchet)
        return replace(self, figures=figures)

    @property
    def turns(self) -> BoolArray:
        """(J, 2) whether each can rotate its first and its second body."""
        always = np.isin(self.kind, TURNING)[:, None]
        off = np.column_stack((self.anchor_a.any(axis=1), self.anchor_b.any(axis=1)))
        bodies = np.column_stack((self.a >= 0, np.ones(len(self), np.bool_)))
        return np.asarray((always | off) & bodies)

    def held(self, count: int) -> BoolArray:
        """Return which of `count` bodies have a joint."""
        found = np.zeros(count, np.bool_)
        found[self.a[self.a >= 0]] = True
        found[self.b] = True
        return found

    def turned(self, count: int) -> BoolArray:
        """Return which of `count` bodies a joint can rotate."""
        found = np.zeros(count, np.bool_)
        if not len(self):
            return found
        turns = self.turns
        found[self.a[turns[:, 0]]] = True
        found[self.b[turns[:, 1]]] = True
        return found

    def apart(self) -> IntArray:
        """Return the distinct pairs of bodies (K, 2) that joints exclude from collision, the lower index first."""
        pair = np.column_stack((self.a, self.b))[~self.collide & (self.a >= 0)]
        return pair if not len(pair) else np.unique(np.sort(pair, axis=1), axis=0)

    def ends(self, position: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the first and second anchor of each joint in the world, (J, 2) or (T, J, 2) m each.

        Args:
            position: (N, 2) m, centres of mass, or (T, N, 2) in T frames.
            angle: (N,) or (T, N) rad.
        """
        first = _anchors(self.a, self.anchor_a, position, angle)
        return first, _anchors(self.b, self.anchor_b, position, angle)

    def among(self, names: Sequence[str], old: Sequence[str]) -> Self:
        """Return the joints whose bodies, by their `old` names, are among new ones, with the new indices."""
        index_of = {name: k for k, name in enumerate(names)}
        new = np.asarray(
            [index_of.get(name, -2) for name in old] + [WORLD], dtype=np.int64
        )  # a = −1 selects the last row
        kept = (new[self.a] != -2) & (new[self.b] != -2) if len(self) else np.empty(0, np.bool_)
        selected = self.some(kept)
        return replace(selected, a=new[selected.a], b=new[selected.b])


def _anchors(body: IntArray, anchor: FloatArray, position: FloatArray, angle: FloatArray) -> FloatArray:
    """Return the positions in the world of anchors on bodies; an anchor on the world is a position already."""
    x, y = anchor.T
    offset = rotate(x, y, np.cos(angle[..., body]), np.sin(angle[..., body]))
    return np.where((body >= 0)[:, None], position[..., body, :] + np.stack(offset, axis=-1), anchor)
