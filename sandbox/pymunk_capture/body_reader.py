"""Motion and forces of all bodies of a pymunk space, read in one call: a game is watched at every step."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import pymunk
from pymunk.batch import BodyFields, Buffer, get_space_bodies

from sandbox.pymunk_capture.space_form import MotionState

Row = tuple[float, float, float, float, float, float, float, float, float]

FIELDS = BodyFields.ALL
"""Position, angle, velocity, angular velocity, force and torque, in this order"""
WIDTH = 9


class BodyState(NamedTuple):
    """Motion of a body, and the force and the torque on it."""

    motion: MotionState
    force: tuple[float, float, float]
    """N, N, N m"""


class BodyReader:
    """Reads the bodies of one space."""

    def __init__(self, space: pymunk.Space) -> None:
        self._space, self._buffer = space, Buffer()
        self._ids: dict[pymunk.Body, int] = {}

    def read(self, bodies: Iterable[pymunk.Body]) -> dict[pymunk.Body, BodyState]:
        """Return the present states of bodies; those that are not in the space are read one by one."""
        self._buffer.clear()
        get_space_bodies(self._space, FIELDS, self._buffer)
        ids = np.frombuffer(self._buffer.int_buf(), np.uintp).tolist()
        rows: list[list[float]] = np.frombuffer(self._buffer.float_buf(), np.float64).reshape(-1, WIDTH).tolist()
        known = dict(zip(ids, rows, strict=True))
        found = {}
        ids_of = self._ids
        for body in bodies:
            identity = ids_of.get(body)
            if identity is None:
                identity = ids_of[body] = body.id
            row = known.get(identity)
            if row is None:
                found[body] = BodyState(MotionState.of(body), (*body.force, body.torque))
            else:
                x, y, angle, vx, vy, spin, fx, fy, torque = row
                found[body] = BodyState(MotionState((x, y), (vx, vy), angle, spin), (fx, fy, torque))
        if len(ids_of) > 2 * len(found):  # those of bodies that the game has removed
            self._ids = {body: ids_of[body] for body in found}
        return found
