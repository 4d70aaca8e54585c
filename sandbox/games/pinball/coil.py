"""Coil: how evenly a solenoid throws a ball."""

from sandbox.scene.description.base import Vector
from sandbox.scene.random_streams import Stream, draws

WEAKEST = 0.95
"""of its whole speed: no coil throws alike each time, and a ball that flew alike each time might fly in a ring"""


class Coil:
    """Throws a little more weakly than it could, by chances of its own."""

    def __init__(self, seed: int, stream: int) -> None:
        """Wind it.

        Args:
            seed: of the scene.
            stream: sets this coil's chances apart from those of others.
        """
        self._chance = draws(Stream.COIL, seed, stream)

    def throw(self, velocity: Vector) -> Vector:
        """Return a velocity, m/s, that is at most the one that is stated."""
        share = float(self._chance.uniform(WEAKEST, 1.0))
        return velocity[0] * share, velocity[1] * share
