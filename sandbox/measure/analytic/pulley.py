"""Atwood machine: two bodies that hang from the ends of a rope over two wheels.

The rope stays taut. With the distances s₁ and s₂ from the wheels, s₁ + ρ s₂ is constant, and the tension is
T = g (1 + ρ)/(1/m₁ + ρ²/m₂), so that s̈₁ = g − T/m₁ and s̈₂ = g − ρ T/m₂. Source: Atwood 1784, with ρ = 1.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.model import PARALLEL_SINE, BodyMotion, SceneFacts, direction, parallel
from sandbox.scene.compile.joint_arrays import JointArrays, JointKind
from sandbox.trajectory import ContactEvent


@dataclass(frozen=True, eq=False)
class HangingBody:
    """Motion of one body with constant acceleration."""

    position: FloatArray
    """(2,) m, at time 0"""
    velocity: FloatArray
    """(2,) m/s, at time 0"""
    acceleration: FloatArray
    """(2,) m/s²"""
    angle: float
    """rad, at time 0"""
    spin: float
    """rad/s"""

    @property
    def name(self) -> str:
        """Name of the motion."""
        return "Atwood machine"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return the motion at T times."""
        t = time[:, None]
        position = self.position + t * (self.velocity + 0.5 * t * self.acceleration)
        velocity = self.velocity + t * self.acceleration
        return BodyMotion(position, velocity, self.angle + self.spin * time, np.full(len(time), self.spin))

    def contacts(self, until: float, shortest: float) -> list[ContactEvent]:
        """Return no contacts."""
        del until, shortest
        return []


def atwood_machine(facts: SceneFacts, number: int) -> HangingBody | None:
    """Return the motion of a body of an Atwood machine; None if it is none.

    Both bodies hang by their centres straight below their wheels, on a taut rope that does not break. They have no
    contacts and no other joint, and there is no drag. They move along the rope, and do not reach a wheel.
    """
    pulley = _only_pulley(facts, number)
    if pulley is None or not facts.gravity.any() or not facts.has_no_air or facts.scene.attractions:
        return None
    down, strength = direction(facts.gravity), float(np.hypot(*facts.gravity))
    pair = int(pulley.a[0]), int(pulley.b[0])
    length, ratio, _ = pulley.figures[0].tolist()
    distance, speed = [], []
    for index, wheel in zip(pair, (pulley.wheels[0, :2], pulley.wheels[0, 2:]), strict=True):
        arm, velocity = facts.bodies.position[index] - wheel, facts.bodies.velocity[index]
        if not facts.moves_freely(index) or not all(parallel(each, down) for each in (arm, velocity)):
            return None
        distance.append(float(arm @ down))
        speed.append(float(velocity @ down))
    slack = abs(distance[0] + ratio * distance[1] - length)
    growth = abs(speed[0] + ratio * speed[1])
    if slack > PARALLEL_SINE * length or growth > PARALLEL_SINE * max(map(abs, speed)) or min(distance) <= 0.0:
        return None
    mass = [float(facts.bodies.mass[index]) for index in pair]
    tension = strength * (1.0 + ratio) / (1.0 / mass[0] + ratio * ratio / mass[1])
    rates = strength - tension / mass[0], strength - ratio * tension / mass[1]
    if any(_smallest(*each, facts.world.duration) <= 0.0 for each in zip(distance, speed, rates, strict=True)):
        return None
    bodies, rate = facts.bodies, rates[pair.index(number)]
    return HangingBody(
        position=bodies.position[number].copy(),
        velocity=bodies.velocity[number].copy(),
        acceleration=rate * down,
        angle=float(bodies.angle[number]),
        spin=float(bodies.angular_velocity[number]),
    )


def _only_pulley(facts: SceneFacts, number: int) -> JointArrays | None:
    """Return the unbreakable pulley that is the only joint of a body and of its partner, or None."""
    joints = facts.joints
    found = np.flatnonzero((joints.a == number) | (joints.b == number))
    if len(found) != 1:
        return None
    pulley = joints.some(found)
    pair = pulley.a[0], pulley.b[0]
    shared = np.isin(joints.a, pair) | np.isin(joints.b, pair)
    if pulley.kind[0] != JointKind.PULLEY or shared.sum() != 1 or math.isfinite(pulley.strength[0]):
        return None
    return None if pulley.anchor_a.any() or pulley.anchor_b.any() else pulley


def _smallest(start: float, speed: float, rate: float, duration: float) -> float:
    """Return the smallest value of start + speed t + rate t²/2 for t from 0 to a duration."""
    values = [start, start + duration * (speed + 0.5 * rate * duration)]
    if rate > 0.0 and 0.0 < -speed / rate < duration:
        values.append(start - 0.5 * speed * speed / rate)
    return min(values)
