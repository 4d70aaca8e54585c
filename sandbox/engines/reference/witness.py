"""Witness: who is told of every piece of a substep."""

from typing import Protocol

from sandbox.engines.reference.manifolds import Manifolds
from sandbox.engines.reference.motion import State
from sandbox.trajectory import FloatArray


class Witness(Protocol):
    """Who is told of every piece of a substep that is done."""

    def __call__(
        self, start: float, end: float, before: State, after: State, contacts: Manifolds, impulse: FloatArray
    ) -> None:
        """See the times, s, the states, and the contacts with their impulses (K, 2), normal and tangential, N·s."""
