"""Drag, attraction and thrust in pymunk's velocity update.

`SpaceForceField` evaluates attraction and thrusts in the velocity update, after positions have moved. A force that
depends on position must act there: set on `body.force` before a step it would be that of the old positions, which is
explicit Euler and gains energy. In the velocity update the scheme is semi-implicit, whose energy does not drift.

Drag is the acceleration of one explicit step. With a drag rate κ, a force F adds φ·(F/m)·h to the velocity of a mass m,
φ = (1 − e^(−κh))/(κh), and not (F/m)·h. So forces that balance each other, springs, thrusts and attraction among them,
balance exactly at any h, also with drag. Spin has no drag, and torques act unchanged. Where a joint turns a force into
a torque, as on a lever held by a rotary spring, the two differ by the factor φ.
"""

import math

import numpy as np
import pymunk

from sandbox.arrays import FloatArray
from sandbox.scene.compile.setup import Setup
from sandbox.scene.description.base import Point
from sandbox.scene.description.forces import Attraction, Thrust
from sandbox.scene.description.world import World
from sandbox.scene.geometry.shapes import geometry_of
from sandbox.scene.geometry.vectors import rotate


class SpaceForceField:
    """Attraction and thrusts on the bodies of a scene."""

    def __init__(self, setup: Setup) -> None:
        scene, bodies = setup.scene, setup.bodies
        self.fractions: dict[str, float] = {}
        """fraction of the field's accelerations that acts on each body in the coming substep: below 1 with drag. The
        velocities that determine it cannot be read in the velocity update, because springs have changed them by
        then."""
        self.time = 0.0
        """s, start of the present substep"""
        self._began = setup.time
        self.level = [0.0 if thrust.key else 1.0 for thrust in scene.thrusts]
        """level of each thrust"""
        self.applied: dict[str, tuple[float, float, float, float, float]] | None = None
        """last acceleration and thrust of each body in the space: attraction, m/s², thrusts, N and N·m; recorded if it
        is a dict"""
        self._thrusts: dict[str, list[tuple[int, Thrust, Point]]] = {}
        for k, thrust in enumerate(scene.thrusts):
            if thrust.body not in bodies.number_of:  # it left the scene on an earlier engine
                continue
            x, y = geometry_of(bodies.elements[bodies.element[bodies.number_of[thrust.body]]]).centre
            arm = thrust.point[0] - x, thrust.point[1] - y
            self._thrusts.setdefault(thrust.body, []).append((k, thrust, arm))
        self._attracting_points = [a for a in scene.attractions if not isinstance(a.toward, str)]
        self._attracting_bodies = [a for a in scene.attractions if isinstance(a.toward, str)]

    @property
    def between_bodies(self) -> bool:
        """Whether a body attracts."""
        return bool(self._attracting_bodies)

    @property
    def attracts(self) -> bool:
        """Whether there is attraction."""
        return bool(self._attracting_points or self._attracting_bodies)

    @property
    def kicks(self) -> bool:
        """Whether the field acts on some body."""
        return self.attracts or bool(self._thrusts)

    def has_thrust(self, name: str) -> bool:
        """Return whether a body carries a thrust."""
        return name in self._thrusts

    def at(self, position: FloatArray) -> FloatArray:
        """Return the acceleration (N, 2), m/s², towards the attracting points, at positions (N, 2), m."""
        total = np.zeros_like(position)
        for attraction in self._attracting_points:
            offset = position - np.asarray(attraction.toward, dtype=np.float64)
            square = (offset * offset).sum(axis=1)
            denominator = (square + attraction.softening**2) * np.sqrt(square)
            with np.errstate(over="ignore"):  # next to the point; such a body leaves the bounds
                rate = np.divide(
                    attraction.strength, denominator, out=np.zeros_like(denominator), where=denominator > 0
                )
                total -= offset * rate[:, None]
        return total

    def apply_to(self, name: str, body: pymunk.Body, bodies: dict[str, pymunk.Body]) -> None:
        """Apply the field to a body from now on; `bodies`: those in the space by name, kept up to date."""
        thrusts = self._thrusts.get(name, [])

        def update_velocity(body: pymunk.Body, gravity: tuple[float, float], damping: float, dt: float) -> None:
            x, y = body.position
            ax, ay = self._attraction(name, x, y, body.mass, bodies) if self.attracts else (0.0, 0.0)
            attraction, thrust, torque = (ax, ay), (0.0, 0.0), 0.0
            if thrusts:
                cos, sin = body.rotation_vector  # math.cos would raise if the angle is not finite
                fx, fy, torque = self._thrust(thrusts)
                thrust = rotate(fx, fy, cos, sin)
                ax += thrust[0] / body.mass
                ay += thrust[1] / body.mass
                body.torque += torque
            if self.applied is not None:
                self.applied[name] = (*attraction, *thrust, torque)
            if self.fractions:
                fraction = self.fractions[name]
                ax, ay = ax * fraction, ay * fraction
            pymunk.Body.update_velocity(body, (gravity[0] + ax, gravity[1] + ay), damping, dt)

        body.velocity_func = update_velocity

    def _thrust(self, thrusts: list[tuple[int, Thrust, Point]]) -> tuple[float, float, float]:
        """Return the force and torque of thrusts in the body's frame, N and N·m."""
        x = y = torque = 0.0
        for k, thrust, arm in thrusts:
            time = self._began + self.time
            if self.level[k] and thrust.begin <= time and (thrust.end is None or time < thrust.end):
                fx, fy = thrust.force[0] * self.level[k], thrust.force[1] * self.level[k]
                x, y, torque = x + fx, y + fy, torque + arm[0] * fy - arm[1] * fx
        return x, y, torque

    def _attraction(self, name: str, x: float, y: float, mass: float, bodies: dict[str, pymunk.Body]) -> Point:
        ax, ay = 0.0, 0.0
        for attraction in self._attracting_points:
            assert not isinstance(attraction.toward, str)
            dx, dy = attraction.toward[0] - x, attraction.toward[1] - y
            rate = _rate(attraction, dx, dy)
            ax, ay = ax + rate * dx, ay + rate * dy
        for attraction in self._attracting_bodies:
            toward = str(attraction.toward)
            if toward not in bodies:
                continue
            if toward != name:
                px, py = bodies[toward].position
                rate = _rate(attraction, px - x, py - y)
                ax, ay = ax + rate * (px - x), ay + rate * (py - y)
                continue
            for other, body in bodies.items():  # reaction: the attracting body is attracted with the same force
                if other != name and body.body_type == pymunk.Body.DYNAMIC:
                    px, py = body.position
                    rate = _rate(attraction, px - x, py - y) * body.mass / mass
                    ax, ay = ax + rate * (px - x), ay + rate * (py - y)
        return ax, ay


def _rate(attraction: Attraction, dx: float, dy: float) -> float:
    """Return the acceleration for each metre of distance, 1/s²; 0 at, or almost at, the attracting point.

    It never raises: pymunk would only print an exception of a callback and continue.
    """
    square = dx * dx + dy * dy
    denominator = (square + attraction.softening**2) * math.sqrt(square)
    return attraction.strength / denominator if denominator > 0.0 else 0.0


def acceleration(world: World, velocity: FloatArray, applied: FloatArray | None, h: float) -> FloatArray:
    """Return the mean acceleration (N, 2), m/s², of the next substep under gravity, drag and a constant force.

    With κ = k + c|u|, u = v − wind, held over the step, v̇ = g + a_f − κu is solved exactly:
    a = (g + a_f − κu)·(1 − e^(−κh))/(κh), the exponential Euler step (Hochbruck & Ostermann 2010, eq. 2.1). It is
    exact in velocity for linear drag, first order for quadratic; the terminal velocity is exact, and it is stable at
    any h.

    Args:
        world: gravity, wind and drag.
        velocity: (N, 2) m/s.
        applied: (N, 2) m/s², the acceleration a_f by other forces, or None.
        h: substep, s.
    """
    relative = velocity - np.asarray(world.wind)
    rate = rates(world, velocity)
    fraction = mean_fraction(rate, h)
    total = np.asarray(world.gravity) - rate[:, None] * relative
    if applied is not None:
        total += applied
    return np.asarray(total * fraction[:, None])


def has_drag(world: World) -> bool:
    """Return whether there is drag."""
    return world.linear_drag > 0 or world.quadratic_drag > 0


def rates(world: World, velocity: FloatArray) -> FloatArray:
    """Return κ, the rates of drag at velocities (N, 2) m/s, (N,) 1/s."""
    relative = velocity - np.asarray(world.wind)
    return np.asarray(world.linear_drag + world.quadratic_drag * np.hypot(relative[:, 0], relative[:, 1]))


def mean_fraction(rate: FloatArray, h: float) -> FloatArray:
    """Return (1 − e^(−κh))/(κh) for rates κ (N,), 1/s: a substep's mean acceleration as a fraction of its first."""
    z = rate * h
    # expm1 avoids cancellation near 0; where z is 0 the fraction is 1.
    return np.asarray(np.divide(-np.expm1(-z), z, out=np.ones_like(z), where=z > 0))
