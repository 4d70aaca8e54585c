"""Field: the attractions and thrusts of a scene, as accelerations in any state."""

import math

import numpy as np

from sandbox.engines.reference.joints.attraction import attract
from sandbox.engines.reference.joints.thrust import thrust
from sandbox.engines.reference.motion import State
from sandbox.engines.roster import Roster
from sandbox.scene.links import WORLD
from sandbox.scene.shapes import form_of
from sandbox.trajectory import FloatArray, IntArray


class Field:
    """What acts on the bodies of a running scene from afar and from within."""

    def __init__(self, roster: Roster) -> None:
        self._roster, self._began = roster, roster.scene.began
        scene, bodies = roster.scene, roster.bodies
        number = {name: k for k, name in enumerate(bodies.names)}
        toward = [a.toward for a in scene.attractions]
        self._target: IntArray = np.asarray([number[t] if isinstance(t, str) else WORLD for t in toward], np.int64)
        places = [(0.0, 0.0) if isinstance(t, str) else t for t in toward]
        self._place: FloatArray = np.asarray(places, np.float64).reshape(-1, 2)
        self._strength: FloatArray = np.asarray([a.strength for a in scene.attractions], np.float64)
        self._softening: FloatArray = np.asarray([a.softening for a in scene.attractions], np.float64)
        self._body: IntArray = np.asarray([number[t.body] for t in scene.thrusts], np.int64)
        centres = [form_of(bodies.elements[bodies.element[n]]).centre for n in self._body.tolist()]
        points = [(t.point[0] - c[0], t.point[1] - c[1]) for t, c in zip(scene.thrusts, centres, strict=True)]
        self._point: FloatArray = np.asarray(points, np.float64).reshape(-1, 2)
        self._force: FloatArray = np.asarray([t.force for t in scene.thrusts], np.float64).reshape(-1, 2)
        self._begin: FloatArray = np.asarray([t.begin for t in scene.thrusts], np.float64)
        self._end: FloatArray = np.asarray([math.inf if t.end is None else t.end for t in scene.thrusts], np.float64)

    @property
    def empty(self) -> bool:
        """Nothing acts."""
        return not (len(self._target) or len(self._body))

    def __call__(self, time: float, x: State) -> FloatArray:
        """Return the accelerations (N, D) at a time, s, in a state (2, N, D), m/s² and rad/s²."""
        roster = self._roster
        out: FloatArray = np.zeros_like(x[1])
        if len(self._target):
            there = (self._target == WORLD) | roster.present[self._target]
            some = self._target[there], self._place[there], self._strength[there], self._softening[there]
            attract(x[0], *some, roster.inverse_mass, out[: len(roster.inverse_mass)])
        self._drive(time, x, out)
        return out

    @property
    def thrusting(self) -> bool:
        """There are thrusts."""
        return len(self._body) > 0

    def thrusts(self, time: float, x: State) -> FloatArray:
        """Return the accelerations (N, D) by thrusts alone, as all of them are returned when called."""
        out: FloatArray = np.zeros_like(x[1])
        self._drive(time, x, out)
        return out

    def _drive(self, time: float, x: State, out: FloatArray) -> None:
        """Add the accelerations by thrusts."""
        if self.thrusting:
            roster, now = self._roster, self._began + time
            level = roster.throttles * ((self._begin <= now) & (now < self._end))
            inverse = roster.inverse_mass, roster.inverse_moment
            thrust(x[0], self._body, self._point, self._force, level, *inverse, out)
