"""States of the bodies of a recorded game after each step, to which its replay is compared."""

from collections.abc import Mapping, Set
from typing import NamedTuple

import numpy as np
import pymunk

from sandbox.arrays import FloatArray
from sandbox.pymunk_capture.space_form import MotionState

MAX_VALUES = 20_000_000
"""Numbers that are kept, 160 MB: 1,000 bodies for 55 s at 60 Hz; of a longer game, the first steps and the last"""


class LoggedStep(NamedTuple):
    """Bodies and their states after a step."""

    step: int
    """number of the step, from 1"""
    names: tuple[str, ...]
    states: FloatArray
    """(N, 6) x, y of the centre of mass, m; its velocity, m/s; angle, rad; angular velocity, rad/s"""
    is_set: tuple[int, ...]
    """rows of bodies whose motion callbacks have set within the step"""


class StateLog:
    """States after the steps of a game."""

    def __init__(self) -> None:
        self.steps: list[LoggedStep] = []
        """states after the physics of each step, from the first on"""
        self.last: LoggedStep | None = None
        """states at the end of the last step"""
        self.eccentric: set[pymunk.Body] = set()
        """bodies whose centre of mass is not their origin"""
        self._values = 0

    def add(
        self,
        step: int,
        bodies: Mapping[pymunk.Body, str],
        states: Mapping[pymunk.Body, MotionState],
        is_set: Set[pymunk.Body],
    ) -> None:
        """Add the states of bodies after the physics of a step.

        Args:
            step: number of the step.
            bodies: the bodies of the scene, with their names.
            states: motion of each.
            is_set: bodies whose motion callbacks have set within the step.
        """
        self.last = self._logged(step, bodies, states, is_set)
        self._values += self.last.states.size
        if self._values <= MAX_VALUES:
            self.steps.append(self.last)

    def amend(self, bodies: Mapping[pymunk.Body, str], states: Mapping[pymunk.Body, MotionState]) -> None:
        """Set the last states to those after the callbacks of the step.

        Args:
            bodies: the bodies of the scene, with their names.
            states: motion of each.
        """
        assert self.last is not None
        self.last = self._logged(self.last.step, bodies, states, frozenset())

    def _logged(
        self,
        step: int,
        bodies: Mapping[pymunk.Body, str],
        states: Mapping[pymunk.Body, MotionState],
        is_set: Set[pymunk.Body],
    ) -> LoggedStep:
        motions = [states[body] for body in bodies]
        rows = np.array([(*p, *v, angle, spin) for p, v, angle, spin in motions], np.float64).reshape(-1, 6)
        for k, body in enumerate(bodies):
            if body in self.eccentric:
                rows[k, :2] = body.local_to_world(body.center_of_gravity)
        names = tuple(bodies.values())
        if self.last is not None and names == self.last.names:
            names = self.last.names  # shared, as most steps have the same bodies
        changed = tuple(k for k, body in enumerate(bodies) if body in is_set) if is_set else ()
        return LoggedStep(step, names, rows, changed)
