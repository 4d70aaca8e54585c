"""Tethers: the links of a scene between the bodies of a space, for as long as both are there and the link is whole."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pymunk

from sandbox.engines.native.constraints import constraint_of
from sandbox.engines.native.tension import tension, torsion
from sandbox.scene.links import WORLD, LinkKind, Links
from sandbox.trajectory import FloatArray, IntArray


class Held(NamedTuple):
    """Links by what they do."""

    springs: Links
    rotary: Links
    """rotary springs"""
    rigid: Links
    """all but springs"""
    motors: Links
    """those of them"""

    def __bool__(self) -> bool:
        """Tell whether there are any."""
        return len(self.springs) + len(self.rotary) + len(self.rigid) > 0


class Tethers:
    """The constraints in a space, by the numbers of their links."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._links: Links | None = None
        self._constraints: dict[int, pymunk.Constraint] = {}
        self._sorted: Held | None = None
        self.count = 0
        """how many constraints there are"""
        self._watch(Links.none())

    def tie(self, links: Links, body: Callable[[int], pymunk.Body], bias: float) -> None:
        """Join bodies as a scene says, once.

        Args:
            links: of the scene, whose bodies are all there.
            body: gives a body by its number.
            bias: the share of a joint's error that still remains one second later.
        """
        if self._links is not None:
            return
        self._links = links
        for k, (a, b) in enumerate(zip(links.a.tolist(), links.b.tolist(), strict=True)):
            first = self._space.static_body if a == WORLD else body(a)
            constraint = constraint_of(links, k, first, body(b), bias)
            self._space.add(constraint)
            self._constraints[k] = constraint
        self._watch(links.counted())

    def untie(self, number: int) -> None:
        """Let go of what a body that leaves was joined to."""
        if self._links is None:
            return
        those = np.flatnonzero((self._links.a == number) | (self._links.b == number))
        self._release([k for k in those.tolist() if k in self._constraints])

    @property
    def breakable(self) -> bool:
        """Whether some link that is there may break."""
        return self._strong > 0

    def torn(
        self, position: FloatArray, velocity: FloatArray, angle: FloatArray, spin: FloatArray, h: float
    ) -> IntArray:
        """Let go of what gave more than its strength in the last substep; return the numbers of those links.

        pymunk tells the impulse of one constraint at a time, 1 µs each. Of springs it is the force in the state that
        the substep ended in, but for rounding and a part of the damper's, so theirs is worked out for all at once.

        Args:
            position: (N, 2) m, of all bodies.
            velocity: (N, 2) m/s.
            angle: (N,) rad.
            spin: (N,) rad/s.
            h: the substep, s.
        """
        held, springs, rotary = self._held, self._springs, self._rotary
        given = np.asarray([self._constraints[k].impulse for k in held.number.tolist()]) / h
        gone = [held.number[given > held.strength]]
        if len(springs):
            gone.append(springs.number[tension(springs, position, velocity, angle, spin) > springs.strength])
        if len(rotary):
            gone.append(rotary.number[torsion(rotary, angle, spin) > rotary.strength])
        numbers = np.sort(np.concatenate(gone))
        if len(numbers):
            self._release(numbers.tolist())
        return numbers

    @property
    def held(self) -> "Held":
        """The links that are there."""
        if self._sorted is None:
            springs, rotary = LinkKind.SPRING, LinkKind.ROTARY_SPRING
            there = self._there
            rigid = there.some(~np.isin(there.kind, (springs, rotary)))
            self._sorted = Held(there.of(springs), there.of(rotary), rigid, rigid.of(LinkKind.MOTOR))
        return self._sorted

    def impulses(self, links: Links) -> FloatArray:
        """Return what pymunk tells of each of some links' impulses in the last substep, (K,) N·s or N·m·s.

        Of joints it is the size, of springs what along them pushes apart.
        """
        return np.asarray([self._constraints[k].impulse for k in links.number.tolist()], dtype=np.float64)

    def _release(self, numbers: list[int]) -> None:
        if not numbers:
            return
        for k in numbers:
            self._space.remove(self._constraints.pop(k))
        assert self._links is not None
        self._watch(self._links.counted().some(np.asarray(sorted(self._constraints), dtype=np.int64)))

    def _watch(self, links: Links) -> None:
        """Sort out which of the links that are there may break."""
        self.count = len(self._constraints)
        self._there: Links = links
        self._sorted = None
        some = links.some(np.isfinite(links.strength))
        kinds = LinkKind.SPRING, LinkKind.ROTARY_SPRING
        self._springs, self._rotary = some.of(kinds[0]), some.of(kinds[1])
        self._held, self._strong = some.some(~np.isin(some.kind, kinds)), len(some)
