"""Parting: how fast contacts are to part, which for most is a fixed share of how fast they approach.

Where restitution falls with speed, or something kicks, manifolds hold in the place of restitution which pair of
surfaces it is, and the rebound is worked out here for the contacts of one look; else nothing here is called.
"""

from typing import NamedTuple

import numpy as np

from sandbox.engines.kernel import kernel
from sandbox.engines.rebound import compiled_rebound, kick_gain, kicked, share_at, stretches
from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.roster import Roster
from sandbox.scene.kick import Kick
from sandbox.scene.model import Post, Wall
from sandbox.scene.part import Point
from sandbox.trajectory import FloatArray


class Bounce(NamedTuple):
    """What K contacts are to part with."""

    speed: FloatArray
    """(K,) m/s, negative: the wanted normal velocity is its opposite"""
    worth: FloatArray | None
    """(K,) what kicks bring for each N·s along the normal, J; none where nothing was kicked"""


class Parting:
    """The rebounds of a roster's contacts."""

    def __init__(self, roster: Roster) -> None:
        self._roster = roster
        size = len(roster.restitution)
        self.codes: FloatArray = np.arange(size * size, dtype=np.float64).reshape(size, size)
        """(S, S) what stands for each pair of surfaces in manifolds"""
        self._kicks = {k: thing for k, thing in enumerate(roster.scene.fixed) if _kick_of(thing) is not None}

    @staticmethod
    def needed(roster: Roster) -> bool:
        """Tell whether any two that can meet part otherwise than by a share of their approach."""
        return bool((roster.meet.touching & ~roster.meet.surfaces.fixed_coefficients).any())

    def bounce(self, contacts: Manifolds, approach: FloatArray) -> Bounce:
        """Return how fast contacts are to part that approach at (K,) m/s, below 0."""
        code = contacts.coefficient[:, 0].astype(np.int64)
        restitution, falloff = self._roster.restitution.ravel()[code], self._roster.falloff.ravel()[code]
        speed = np.empty(contacts.size)
        _rebounds(restitution, falloff, approach, speed)
        kick = np.zeros(contacts.size)
        for k in np.flatnonzero(contacts.second < 0).tolist():
            number = -1 - int(contacts.second[k])
            if number in self._kicks:
                x, y = contacts.point[k].tolist()
                kick[k] = self._gain(number, (x, y), restitution[k], falloff[k], -float(approach[k]))
        if not kick.any():
            return Bounce(speed, None)
        whole = kick - speed
        met = kick > 0.0
        worth = np.zeros(contacts.size)
        # From `-speed` on an impulse is the kick's: half of it finds the speed before it, half that after.
        worth[met] = (kick / (whole - approach) * 0.5 * (whole - speed))[met]
        return Bounce(speed - kick, worth)

    def _gain(self, number: int, point: Point, restitution: float, falloff: float, closing: float) -> float:
        """Return by how much a fixed thing that is hit at a point raises the speed of parting, m/s."""
        thing = self._kicks[number]
        kick = _kick_of(thing)
        assert kick is not None
        share, middle = 0.5, kick.profile == "middle"
        if middle and isinstance(thing, Wall):
            ends = (*thing.points, thing.points[0]) if thing.closed else thing.points
            each = zip(ends[:-1], ends[1:], stretches(ends), strict=True)
            share = min((_away(a, b, point), share_at(a, b, part, point)) for a, b, part in each)[1]
        speed = kicked(kick.speed, kick.threshold, middle, share, closing)
        return kick_gain(restitution, falloff, speed, kick.adds_to == "approach", closing)


def _kick_of(thing: object) -> Kick | None:
    return thing.kick if isinstance(thing, Wall | Post) else None


def _away(a: Point, b: Point, point: Point) -> float:
    """Return the square of how far a point is from a segment, m²."""
    dx, dy, x, y = b[0] - a[0], b[1] - a[1], point[0] - a[0], point[1] - a[1]
    along = min(max((x * dx + y * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return (x - along * dx) ** 2 + (y - along * dy) ** 2


@kernel
def _rebounds(restitution: FloatArray, falloff: FloatArray, approach: FloatArray, out: FloatArray) -> None:
    for k in range(len(out)):
        out[k] = -compiled_rebound(restitution[k], falloff[k], -approach[k])
