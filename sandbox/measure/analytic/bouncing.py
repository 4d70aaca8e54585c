"""Bouncing of a ball, straight up and down on one plane that is perpendicular to gravity."""

import math
from typing import NamedTuple

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.model import TOUCH_TOLERANCE, BodyMotion, SceneFacts, normal_of, parallel
from sandbox.trajectory import ContactEvent

PLANE = -1
"""Index of the only static object in contacts."""


def bounces(
    time: FloatArray, height: float, velocity: float, gravity: float, restitution: float
) -> tuple[FloatArray, FloatArray]:
    """Return the height and velocity of a ball that bounces straight up and down without drag.

    The first impact, at t₁ and speed V, starts flights of 2 V eⁿ/g, n = 1, 2, …; their sum is geometric, so
    the flight that a time falls into is a logarithm. The infinitely many bounces are over at
    t₁ + 2 V e/(g (1 − e)), for a ball dropped from rest t₁ (1 + e)/(1 − e); then it rests.

    Args:
        time: (T,) s.
        height: between ball and plane at time 0, m, ≥ 0.
        velocity: away from the plane at time 0, m/s.
        gravity: towards the plane, m/s², ≥ 0; without any, the ball bounces at most once.
        restitution: 0…1.

    Returns:
        Heights above contact, (T,) m, and velocities, (T,) m/s.

    Raises:
        ValueError: height, gravity or restitution is out of range.
    """
    if not (height >= 0 and gravity >= 0 and 0 <= restitution <= 1):
        raise ValueError("bounces need height >= 0, gravity >= 0 and restitution 0…1")
    t, e = np.asarray(time, dtype=np.float64), restitution
    if gravity == 0.0:
        return _one_bounce(t, height, velocity, e)
    impact = math.sqrt(velocity * velocity + 2.0 * gravity * height)
    # The two forms of one root, each free of cancellation for its sign.
    up = velocity > 0 or impact == 0
    first = (velocity + impact) / gravity if up else 2.0 * height / (impact - velocity)
    falling = t < first
    if impact == 0.0 or e == 0.0:
        above, speed = np.zeros_like(t), np.zeros_like(t)
    else:
        tau = np.maximum(t - first, 0.0) * (gravity / (2.0 * impact))
        since, launch = _flight(tau, e)
        above = (2.0 * impact * impact / gravity) * since * (launch - since)
        speed = impact * (launch - 2.0 * since)
    fallen = np.maximum(height + velocity * t - 0.5 * gravity * t * t, 0.0)
    return np.where(falling, fallen, above), np.where(falling, velocity - gravity * t, speed)


def _one_bounce(time: FloatArray, height: float, velocity: float, restitution: float) -> tuple[FloatArray, FloatArray]:
    if velocity >= 0.0:
        return height + velocity * time, np.full_like(time, velocity)
    impact = height / -velocity
    coming, rebound = time < impact, restitution * -velocity
    above = np.where(coming, np.maximum(height + velocity * time, 0.0), rebound * (time - impact))
    return above, np.where(coming, velocity, rebound)


def _flight(tau: FloatArray, e: float) -> tuple[FloatArray, FloatArray]:
    """Return the time into the present flight and that flight's length, both 0 at rest; flight n lasts eⁿ."""
    if e == 1.0:
        return tau - np.floor(tau), np.ones_like(tau)
    end, log_e = e / (1.0 - e), math.log(e)
    flying = tau < end
    fraction = np.where(flying, tau, 0.0) / end
    done = np.floor(np.log1p(-fraction) / log_e)
    # The logarithm may round into a neighbouring flight.
    done -= tau < -end * np.expm1(done * log_e)
    done += tau >= -end * np.expm1((done + 1.0) * log_e)
    length = np.where(flying, np.exp((done + 1.0) * log_e), 0.0)
    return np.clip(tau + end * np.expm1(done * log_e), 0.0, length), length


class Bouncing(NamedTuple):
    """Ball that bounces straight on the only plane of a scene."""

    number: int
    """index of the ball"""
    start: FloatArray
    """(2,) m"""
    along: FloatArray
    """(2,) m/s along the plane, constant"""
    normal: FloatArray
    """(2,) of the plane, of length 1"""
    height: float
    """above contact at time 0, m"""
    speed: float
    """away from the plane at time 0, m/s"""
    gravity: float
    """towards the plane, m/s²"""
    restitution: float
    radius: float
    """m"""
    mass: float
    """kg"""
    angle: float
    """at time 0, rad"""
    spin: float
    """rad/s, constant"""
    name: str = "bouncing"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return its motion at T times."""
        above, rising = bounces(time, self.height, self.speed, self.gravity, self.restitution)
        position = self.start + (above - self.height)[:, None] * self.normal + time[:, None] * self.along
        velocity = rising[:, None] * self.normal + self.along
        return BodyMotion(position, velocity, self.angle + self.spin * time, np.full(len(time), self.spin))

    def contacts(self, until: float, shortest: float) -> list[ContactEvent]:
        """Return the impacts up to a time, s; flights shorter than `shortest`, s, are one last row."""
        foot = self.start - (self.height + self.radius) * self.normal
        rows = []
        for time, size in self._impacts(shortest, until):
            point, facts = foot + time * self.along, -size * self.normal
            normal = -self.normal
            rows.append(
                ContactEvent(
                    time,
                    (self.number, PLANE),
                    (float(point[0]), float(point[1])),
                    (float(normal[0]), float(normal[1])),
                    (float(facts[0]), float(facts[1])),
                )
            )
        return rows

    def _impacts(self, shortest: float, until: float) -> list[tuple[float, float]]:
        """Return time, s, and impulse, N·s, of each contact row up to a time, s."""
        g, e, mass = self.gravity, self.restitution, self.mass
        if g == 0.0:
            time = self.height / -self.speed if self.speed < 0 else math.inf
            return [(time, -mass * (1 + e) * self.speed)] if time <= until else []
        impact = math.sqrt(self.speed**2 + 2.0 * g * self.height)
        # The two forms of one root, each free of cancellation for its sign.
        up = self.speed > 0 or impact == 0
        time = (self.speed + impact) / g if up else 2.0 * self.height / (impact - self.speed)
        rows = []
        while time <= until:
            flight = 2.0 * e * impact / g
            if flight < shortest:
                velocity = self.at(np.asarray([until])).velocity
                gained = float(velocity[0] @ self.normal) + impact
                rows.append((time, mass * (gained + g * (until - time))))
                break
            rows.append((time, mass * (1 + e) * impact))
            time, impact = time + flight, e * impact
        return rows


def bouncing(facts: SceneFacts, number: int) -> Bouncing | None:
    """Return the bouncing of a ball as long as it collides only with the plane; None if the formula does not apply.

    No joint, attraction, thrust or drive acts on it. The scene has one plane, gravity is perpendicular to it or 0, and
    there are no drag and no friction: its coefficient is 0, or the ball neither spins nor moves along the plane, which
    does not move either. Restitution does not depend on speed.
    """
    bodies, planes = facts.bodies, facts.scene.planes
    collides = bodies.elements[bodies.element[number]].collides
    if not bodies.round[number] or facts.scene.attractions or facts.matrix.held[number] or facts.thrust[number]:
        return None
    if len(planes) != 1 or not facts.has_no_air or collides == "none" or facts.matrix.moving_surfaces:
        return None
    normal, pull = normal_of(planes[0]), facts.gravity
    start, velocity = bodies.position[number], bodies.velocity[number]
    down = -float(pull @ normal)
    if down < 0.0 or not parallel(pull, normal):
        return None

    # Planes come first among the static objects: the only plane has index 0, which is −1 in contacts.
    surfaces = facts.matrix.surfaces
    sides = surfaces.of_body[number], surfaces.of_fixed[0]
    if not surfaces.fixed_coefficients[sides]:
        return None
    slides = bodies.angular_velocity[number] != 0 or not parallel(velocity, normal)
    if slides and surfaces.friction[sides] > 0:
        return None

    radius = float(bodies.radius[number])
    gap = float((start - np.asarray(planes[0].point)) @ normal - radius)
    if gap < -TOUCH_TOLERANCE:
        return None
    speed = float(velocity @ normal)
    return Bouncing(
        number=number,
        start=start,
        along=velocity - speed * normal,
        normal=normal,
        height=max(gap, 0.0),
        speed=speed,
        gravity=down,
        restitution=float(surfaces.restitution[sides]),
        radius=radius,
        mass=float(bodies.mass[number]),
        angle=float(bodies.angle[number]),
        spin=float(bodies.angular_velocity[number]),
    )


def bouncing_on_only_plane(facts: SceneFacts, number: int) -> Bouncing | None:
    """Return the bouncing of a ball if the plane is the only thing that it can collide with."""
    return None if facts.only_plane() is None else bouncing(facts, number)
