"""Field: attraction and thrusts, evaluated where pymunk kicks velocities, after positions have moved.

A force that depends on position must act there: set on `body.force` before a step it would be that of the old
positions, which is explicit Euler and gains energy. At the kick it is the semi-implicit scheme, whose energy stays.
"""

import math

import numpy as np
import pymunk

from sandbox.scene.forces import Attraction, Thrust
from sandbox.scene.model import Scene
from sandbox.scene.near import FloatArray
from sandbox.scene.part import Point
from sandbox.scene.shapes import form_of


class Field:
    """What acts on the bodies of a scene from afar and from within."""

    def __init__(self, scene: Scene) -> None:
        self.shares: dict[str, float] = {}
        """what share of the field's accelerations acts on each body in the coming substep: in drag less than all. The
        velocities that it follows from cannot be read at the kick: springs have changed them by then."""
        self.time = 0.0
        """s, when the substep at hand began"""
        self._began = scene.began
        self.level = [0.0 if thrust.key else 1.0 for thrust in scene.thrusts]
        """how far each thrust is open"""
        self.told: dict[str, tuple[float, float, float, float, float]] | None = None
        """what each body in the space was last kicked by: the pull of others, m/s², thrusts, N and N·m; where wanted"""
        self._thrusts: dict[str, list[tuple[int, Thrust, Point]]] = {}
        bodies = scene.bodies
        for k, thrust in enumerate(scene.thrusts):
            if thrust.body not in bodies.names:  # it left before an earlier engine handed over
                continue
            x, y = form_of(bodies.elements[bodies.element[bodies.names.index(thrust.body)]]).centre
            arm = thrust.point[0] - x, thrust.point[1] - y
            self._thrusts.setdefault(thrust.body, []).append((k, thrust, arm))
        self._places = [a for a in scene.attractions if not isinstance(a.toward, str)]
        self._bodies = [a for a in scene.attractions if isinstance(a.toward, str)]

    @property
    def between_bodies(self) -> bool:
        """Some body attracts."""
        return bool(self._bodies)

    @property
    def attracts(self) -> bool:
        """Something attracts."""
        return bool(self._places or self._bodies)

    @property
    def kicks(self) -> bool:
        """Some body may be kicked."""
        return self.attracts or bool(self._thrusts)

    def thrusted(self, name: str) -> bool:
        """Tell whether a body carries a thrust."""
        return name in self._thrusts

    def at(self, position: FloatArray) -> FloatArray:
        """Return the acceleration (N, 2), m/s², towards the places that attract, at (N, 2) m."""
        total = np.zeros_like(position)
        for attraction in self._places:
            away = position - np.asarray(attraction.toward, dtype=np.float64)
            square = (away * away).sum(axis=1)
            below = (square + attraction.softening**2) * np.sqrt(square)
            with np.errstate(over="ignore"):  # next to the very place; whoever is there leaves all bounds
                rate = np.divide(attraction.strength, below, out=np.zeros_like(below), where=below > 0)
                total -= away * rate[:, None]
        return total

    def drive(self, name: str, body: pymunk.Body, members: dict[str, pymunk.Body]) -> None:
        """Have a body kicked by the field from now on, as it is among the members at each time."""
        thrusts = self._thrusts.get(name, [])

        def kick(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
            x, y = body.position
            ax, ay = self._pull(name, x, y, body.mass, members) if self.attracts else (0.0, 0.0)
            pull, push, torque = (ax, ay), (0.0, 0.0), 0.0
            if thrusts:
                cos, sin = body.rotation_vector  # math.cos raises where the angle is no longer finite
                fx, fy, torque = self._thrust(thrusts)
                push = cos * fx - sin * fy, sin * fx + cos * fy
                ax += push[0] / body.mass
                ay += push[1] / body.mass
                body.torque += torque
            if self.told is not None:
                self.told[name] = (*pull, *push, torque)
            if self.shares:
                share = self.shares[name]
                ax, ay = ax * share, ay * share
            pymunk.Body.update_velocity(body, (gravity[0] + ax, gravity[1] + ay), damping, dt)

        body.velocity_func = kick

    def _thrust(self, thrusts: list[tuple[int, Thrust, Point]]) -> tuple[float, float, float]:
        """Return force and torque in the body's own frame, N and N·m."""
        x = y = torque = 0.0
        for k, thrust, arm in thrusts:
            time = self._began + self.time
            if self.level[k] and thrust.begin <= time and (thrust.end is None or time < thrust.end):
                fx, fy = thrust.force[0] * self.level[k], thrust.force[1] * self.level[k]
                x, y, torque = x + fx, y + fy, torque + arm[0] * fy - arm[1] * fx
        return x, y, torque

    def _pull(self, name: str, x: float, y: float, mass: float, members: dict[str, pymunk.Body]) -> Point:
        ax, ay = 0.0, 0.0
        for attraction in self._places:
            assert not isinstance(attraction.toward, str)
            dx, dy = attraction.toward[0] - x, attraction.toward[1] - y
            rate = _rate(attraction, dx, dy)
            ax, ay = ax + rate * dx, ay + rate * dy
        for attraction in self._bodies:
            toward = str(attraction.toward)
            if toward not in members:
                continue
            if toward != name:
                px, py = members[toward].position
                rate = _rate(attraction, px - x, py - y)
                ax, ay = ax + rate * (px - x), ay + rate * (py - y)
                continue
            for other, body in members.items():  # as strongly as it draws, it is drawn
                if other != name and body.body_type == pymunk.Body.DYNAMIC:
                    px, py = body.position
                    rate = _rate(attraction, px - x, py - y) * body.mass / mass
                    ax, ay = ax + rate * (px - x), ay + rate * (py - y)
        return ax, ay


def _rate(attraction: Attraction, dx: float, dy: float) -> float:
    """Return the acceleration for each metre of distance, 1/s²; 0 in the very place that attracts, or all but there.

    It never raises: pymunk would only print what a callback raises, and go on.
    """
    square = dx * dx + dy * dy
    below = (square + attraction.softening**2) * math.sqrt(square)
    return attraction.strength / below if below > 0.0 else 0.0
