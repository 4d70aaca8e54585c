"""Tethers: the links of a scene between the bodies of a space, for as long as both are there."""

from collections.abc import Callable

import pymunk

from sandbox.engines.native.constraints import constraint_of
from sandbox.scene.links import WORLD, Links


class Tethers:
    """The constraints in a space, by the numbers of the bodies that they hold."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space = space
        self._tied = False
        self._constraints: list[tuple[pymunk.Constraint, int, int]] = []

    def tie(self, links: Links, body: Callable[[int], pymunk.Body], bias: float) -> None:
        """Join bodies as a scene says, once.

        Args:
            links: of the scene, whose bodies are all there.
            body: gives a body by its number.
            bias: the share of a joint's error that still remains one second later.
        """
        if self._tied:
            return
        self._tied = True
        for k, (a, b) in enumerate(zip(links.a.tolist(), links.b.tolist(), strict=True)):
            first = self._space.static_body if a == WORLD else body(a)
            constraint = constraint_of(links, k, first, body(b), bias)
            self._space.add(constraint)
            self._constraints.append((constraint, a, b))

    def untie(self, number: int) -> None:
        """Let go of what a body that leaves was joined to."""
        if not any(number in each[1:] for each in self._constraints):
            return
        for constraint, a, b in self._constraints:
            if number in (a, b):
                self._space.remove(constraint)
        self._constraints = [each for each in self._constraints if number not in each[1:]]
