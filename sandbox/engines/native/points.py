"""Points: the impulses of a substep, contact point by contact point."""

from typing import Any, NamedTuple, Self

import numpy as np
import pymunk

from sandbox.engines.native.hauls import Hauls
from sandbox.engines.native.laws import Laws, worths
from sandbox.engines.native.memory import RememberedImpulses
from sandbox.engines.native.record import ARMS, IMPULSES, WIDTH, address_of, points_of
from sandbox.trajectory import FloatArray, IntArray

APART = 2
"""cpArbiterState from which on shapes do not touch: ignored, cached, invalidated."""


class Points(NamedTuple):
    """P contact points of a substep."""

    a: IntArray
    """(P,) one body, by number; −1 for what never moves"""
    b: IntArray
    """(P,) the other"""
    arm_a: FloatArray
    """(P, 2) m, from the centre of a to the point"""
    arm_b: FloatArray
    """(P, 2) likewise of b"""
    normal: FloatArray
    """(P, 2) from a to b"""
    along: FloatArray
    """(P,) impulse on b along the normal, N·s"""
    across: FloatArray
    """(P,) impulse on b to the normal's left, N·s"""
    kick: FloatArray
    """(P,) what a kick brings for each N·s along the normal, J; 0 where nothing kicks"""

    def times(self, share: float) -> Self:
        """Return a share of the impulses."""
        return self._replace(along=self.along * share, across=self.across * share)

    @property
    def hauls(self) -> Hauls:
        """The impulses as those of links."""
        nx, ny = self.normal.T
        impulse = np.column_stack((nx * self.along - ny * self.across, ny * self.along + nx * self.across))
        return Hauls(self.a, self.b, self.arm_a, self.arm_b, impulse, np.zeros(len(self.a)))

    def work(self, velocity: FloatArray, spin: FloatArray) -> tuple[float, float, float]:
        """Return the work, J, of impulses along normals, along surfaces and by kicks, at mean velocities of `Hauls`."""
        parting = self.hauls.parting(velocity, spin)
        nx, ny = self.normal.T
        out, left = nx * parting[:, 0] + ny * parting[:, 1], nx * parting[:, 1] - ny * parting[:, 0]
        kicks = float(self.along @ self.kick)
        return float(self.along @ out) - kicks, float(self.across @ left), kicks


class PointReader:
    """Reads the contact points of one space after each substep."""

    def __init__(self, space: pymunk.Space, remembered: RememberedImpulses, laws: Laws) -> None:
        self._space, self._remembered, self._laws = space, remembered, laws
        remembered.points, laws.told = {}, {}

    def read(self, number: dict[Any, int]) -> Points:
        """Return the points of the last substep, with the impulses that were applied in it.

        Args:
            number: of each `cpBody` that moves; all others never do.
        """
        begun = self._remembered.points
        first: list[int] = []
        second: list[int] = []
        normal: list[tuple[float, float]] = []
        records: list[FloatArray] = []
        places: list[int] = []
        told = self._laws.told
        for arbiter in self._space._get_arbiters():
            if arbiter.state >= APART:
                continue
            record = points_of(arbiter)
            if begun:
                old = begun.get(address_of(arbiter))
                if old is not None:
                    record[:, IMPULSES] -= old  # applied before they parted
            records.append(record)
            if told:
                places.append(address_of(arbiter))
            a, b = number.get(arbiter.body_a, -1), number.get(arbiter.body_b, -1)
            n = arbiter.n.x, arbiter.n.y
            for _ in range(len(record)):
                first.append(a)
                second.append(b)
                normal.append(n)
        if begun:
            begun.clear()
        kick = np.zeros(len(first))
        if told:
            kick = worths(told, places, [len(record) for record in records])
            told.clear()
        table = np.concatenate(records) if records else np.empty((0, WIDTH))
        arms, impulses = table[:, ARMS], table[:, IMPULSES]
        numbers = np.asarray(first, np.int64), np.asarray(second, np.int64)
        normals = np.asarray(normal, np.float64).reshape(-1, 2)
        return Points(*numbers, arms[:, :2], arms[:, 2:], normals, impulses[:, 0], impulses[:, 1], kick)
