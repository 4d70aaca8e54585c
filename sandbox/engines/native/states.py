"""States: where the bodies of a pymunk run are, and how fast, for the account."""

from typing import NamedTuple

from sandbox.trajectory import FloatArray


class State(NamedTuple):
    """Where N bodies are, and how fast."""

    position: FloatArray
    """(N, 2) m"""
    angle: FloatArray
    """(N,) rad"""
    velocity: FloatArray
    """(N, 2) m/s"""
    spin: FloatArray
    """(N,) rad/s"""

    def towards(self, other: "State", share: float) -> "State":
        """Return the state that lies a share of the way to another; the other itself, to the bit, for 1."""
        if share == 1.0:
            return other
        return State(*(old + (new - old) * share for old, new in zip(self, other, strict=True)))
