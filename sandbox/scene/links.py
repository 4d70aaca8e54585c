"""Links: the joints of a scene as arrays, J of them, by the numbers of bodies; for whoever computes or draws them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Self

import numpy as np
import numpy.typing as npt

from sandbox.scene.near import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    pass

WORLD = -1
"""The number of what never moves, as the first body of a link."""


class LinkKind(IntEnum):
    """What a link does, and what its `figures` mean."""

    ROD = 0
    """length, m"""
    PIVOT = 1
    """none"""
    SLIDE = 2
    """least and most length, m"""
    GROOVE = 3
    """the groove's far end in the first body's frame, m; `anchor_a` is its near end"""
    ROTARY_LIMIT = 4
    """least and most of angle_b − angle_a, rad"""
    MOTOR = 5
    """the wanted rate of angle_b − angle_a, rad/s; `most_force` is a torque"""
    GEAR = 6
    """phase, rad, and ratio: angle_b·ratio − angle_a = phase"""
    SPRING = 7
    """rest length, m, stiffness, N/m, damping, N·s/m"""
    ROTARY_SPRING = 8
    """rest of angle_b − angle_a, rad, stiffness, N·m/rad, damping, N·m·s/rad"""


TURNING = (LinkKind.GROOVE, LinkKind.ROTARY_LIMIT, LinkKind.MOTOR, LinkKind.GEAR, LinkKind.ROTARY_SPRING)
"""Kinds that turn bodies wherever they hold them; the others only where they hold them off their centres."""


@dataclass(frozen=True, eq=False)
class Links:
    """The joints of a scene: those of the file in their order, then those of its generators."""

    kind: IntArray
    """(J,) `LinkKind`"""
    a: IntArray
    """(J,) number of the first body, or `WORLD`"""
    b: IntArray
    """(J,) number of the second body"""
    anchor_a: FloatArray
    """(J, 2) m, in the first body's own frame about its centre of mass; of the world, a place in it"""
    anchor_b: FloatArray
    """(J, 2) m, in the second body's own frame about its centre of mass"""
    figures: FloatArray
    """(J, 3) by kind, unused ones 0"""
    most_force: FloatArray
    """(J,) N or N·m, inf where there is no bound"""
    collide: BoolArray
    """(J,) the two may also meet"""
    strength: FloatArray
    """(J,) N or N·m beyond which each breaks, inf where it never does"""
    number: IntArray
    """(J,) of each among the joints of its whole scene, which are 0 to J − 1; of fewer it tells which they are"""
    names: tuple[str, ...]
    """(J,)"""

    def __len__(self) -> int:
        return len(self.kind)

    @classmethod
    def none(cls) -> Self:
        """Return no links."""
        return cls(
            kind=np.empty(0, np.int64),
            a=np.empty(0, np.int64),
            b=np.empty(0, np.int64),
            anchor_a=np.empty((0, 2)),
            anchor_b=np.empty((0, 2)),
            figures=np.empty((0, 3)),
            most_force=np.empty(0),
            collide=np.empty(0, np.bool_),
            strength=np.empty(0),
            number=np.empty(0, np.int64),
            names=(),
        )

    @classmethod
    def alike(
        cls,
        kind: LinkKind,
        a: npt.ArrayLike,
        b: npt.ArrayLike,
        anchor_a: npt.ArrayLike = (0.0, 0.0),
        anchor_b: npt.ArrayLike = (0.0, 0.0),
        figures: npt.ArrayLike = (0.0, 0.0, 0.0),
    ) -> Self:
        """Return J nameless links of one kind, unbreakable, for bodies that never meet; one figure may do for all."""
        first, second = np.asarray(a, dtype=np.int64), np.asarray(b, dtype=np.int64)
        count = len(first)
        return cls(
            kind=np.full(count, kind, np.int64),
            a=first,
            b=second,
            anchor_a=np.broadcast_to(np.asarray(anchor_a, dtype=np.float64), (count, 2)).copy(),
            anchor_b=np.broadcast_to(np.asarray(anchor_b, dtype=np.float64), (count, 2)).copy(),
            figures=np.broadcast_to(np.asarray(figures, dtype=np.float64), (count, 3)).copy(),
            most_force=np.full(count, np.inf),
            collide=np.zeros(count, np.bool_),
            strength=np.full(count, np.inf),
            number=np.arange(count),
            names=("",) * count,
        )

    def some(self, which: BoolArray | IntArray) -> Self:
        """Return some of them, by mask or by their places."""
        places = np.arange(len(self))[which]
        columns = {f.name: getattr(self, f.name)[places] for f in fields(self) if f.name != "names"}
        return replace(self, names=tuple(self.names[k] for k in places.tolist()), **columns)

    def joined(self, more: Self) -> Self:
        """Return these and more."""
        columns = {
            f.name: np.concatenate((getattr(self, f.name), getattr(more, f.name)))
            for f in fields(self)
            if f.name != "names"
        }
        return replace(self, names=(*self.names, *more.names), **columns)

    def counted(self) -> Self:
        """Return them numbered as those of a whole scene."""
        return replace(self, number=np.arange(len(self)))

    def without(self, broken: Collection[int]) -> Self:
        """Return those whose numbers in the whole scene are not among some."""
        return self.some(~np.isin(self.number, list(broken))) if broken else self

    def of(self, *kinds: LinkKind) -> Self:
        """Return those of some kinds."""
        return self.some(np.isin(self.kind, kinds))

    @property
    def turns(self) -> BoolArray:
        """(J, 2) whether each may turn its first and its second body."""
        always = np.isin(self.kind, TURNING)[:, None]
        off = np.column_stack((self.anchor_a.any(axis=1), self.anchor_b.any(axis=1)))
        bodies = np.column_stack((self.a >= 0, np.ones(len(self), np.bool_)))
        return np.asarray((always | off) & bodies)

    def held(self, count: int) -> BoolArray:
        """Return which of `count` bodies some link holds."""
        found = np.zeros(count, np.bool_)
        found[self.a[self.a >= 0]] = True
        found[self.b] = True
        return found

    def turned(self, count: int) -> BoolArray:
        """Return which of `count` bodies some link may turn."""
        found, turns = np.zeros(count, np.bool_), self.turns
        found[self.a[turns[:, 0]]] = True
        found[self.b[turns[:, 1]]] = True
        return found

    def apart(self) -> IntArray:
        """Return the pairs of bodies (K, 2) that links keep from meeting, each once, the lower number first."""
        pair = np.column_stack((self.a, self.b))[~self.collide & (self.a >= 0)]
        return np.unique(np.sort(pair, axis=1), axis=0)

    def ends(self, position: FloatArray, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return where each holds its first and its second body, (J, 2) m each, as bodies (N,) now lie."""
        return _placed(self.a, self.anchor_a, position, angle), _placed(self.b, self.anchor_b, position, angle)

    def among(self, names: Sequence[str], old: Sequence[str]) -> Self:
        """Return those whose bodies, by their `old` names, are among new ones, numbered as those are."""
        number = {name: k for k, name in enumerate(names)}
        new = np.asarray([number.get(name, -2) for name in old] + [WORLD], dtype=np.int64)  # a = −1 finds the last
        kept = (new[self.a] != -2) & (new[self.b] != -2) if len(self) else np.empty(0, np.bool_)
        some = self.some(kept)
        return replace(some, a=new[some.a], b=new[some.b])


def _placed(number: IntArray, anchor: FloatArray, position: FloatArray, angle: FloatArray) -> FloatArray:
    cos, sin = np.cos(angle[number]), np.sin(angle[number])
    x, y = anchor.T
    turned = position[number] + np.column_stack((cos * x - sin * y, sin * x + cos * y))
    return np.where((number >= 0)[:, None], turned, anchor)
