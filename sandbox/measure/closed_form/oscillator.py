"""Oscillator: a body on one spring, along its line; damped or not, pulled aside by gravity or not.

With u the way from where it would rest, ü + 2γ u̇ + ω² u = 0, so u = e^(−γt) (u₀ C + (u̇₀ + γ u₀) S), where C and S are
cos(νt) and sin(νt)/ν with ν² = ω² − γ², 1 and t where ν is 0, and cosh and sinh where ν² is negative.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.closed_form.form import Motion
from sandbox.measure.closed_form.given import Given, direction, parallel
from sandbox.scene.compile.joint_arrays import LinkKind
from sandbox.trajectory import ContactEvent


@dataclass(frozen=True, eq=False)
class Oscillator:
    """One body on a spring."""

    rest: FloatArray
    """(2,) m, where it would stay"""
    offset: FloatArray
    """(2,) m from there, at time 0"""
    velocity: FloatArray
    """(2,) m/s, at time 0"""
    squared: float
    """ω², k/m, 1/s²"""
    damping: float
    """γ, half of c/m and of the air's drag, 1/s"""
    angle: float
    """at time 0, rad"""
    spin: float
    """rad/s, which nothing changes"""
    name: str = "a spring's swing"

    def at(self, time: FloatArray) -> Motion:
        """Return its motion at T times."""
        c, s = (each[:, None] for each in damped(time, self.squared, self.damping))
        swung = self.offset * c + (self.velocity + self.damping * self.offset) * s
        velocity = self.velocity * c - (self.damping * self.velocity + self.squared * self.offset) * s
        return Motion(self.rest + swung, velocity, self.angle + self.spin * time, np.full(len(time), self.spin))

    def contacts(self, _until: float, _shortest: float) -> list[ContactEvent]:
        """Return none: it meets nothing."""
        return []


def damped(time: FloatArray, squared: float, damping: float) -> tuple[FloatArray, FloatArray]:
    """Return e^(−γt) C and e^(−γt) S, (T,) each, without overflow however strong the damping.

    Args:
        time: (T,) s, ≥ 0.
        squared: ω², > 0.
        damping: γ, ≥ 0.
    """
    omega = math.sqrt(squared)
    difference = (omega - damping) * (omega + damping)
    if difference >= 0.0:
        nu, fade = math.sqrt(difference), np.exp(-damping * time)
        return fade * np.cos(nu * time), fade * (np.sin(nu * time) / nu if nu > 0.0 else time)
    # Both exponentials shrink: the slower at ω²/(γ + ν), which is γ − ν without its cancellation.
    nu = math.sqrt(-difference)
    slow, gone = np.exp(-squared / (damping + nu) * time), np.expm1(-2.0 * nu * time)
    return slow * (1.0 + 0.5 * gone), slow * (gone / (-2.0 * nu))


def oscillator(given: Given, number: int) -> Oscillator | None:
    """Return the swing of a body that one spring at its centre ties to a place that never moves.

    It meets nothing, and nothing else draws, drives or holds it. All is along the spring's line, and the spring never
    shrinks to nothing, where its force would jump; or its length at rest is 0 and it has no damper of its own: then
    each component swings alone.
    """
    scene, bodies = given.scene, given.bodies
    if not given.untouched(number) or not given.meet.held[number] or scene.attractions:
        return None
    tie = given.tie(number)
    if tie is None or tie.kind != LinkKind.SPRING or tie.arm.any() or given.world.quadratic_drag > 0.0:
        return None
    length, stiffness, damper = tie.figures.tolist()
    mass, drag = float(bodies.mass[number]), given.world.linear_drag
    squared = stiffness / mass
    push = given.gravity + drag * np.asarray(given.world.wind)
    arm, velocity = bodies.position[number] - tie.place, bodies.velocity[number].copy()

    sideways = length > 0.0 or damper > 0.0
    unit = next((direction(each) for each in (arm, velocity, push) if each.any()), np.asarray([1.0, 0.0]))
    if sideways and not all(parallel(each, unit) for each in (velocity, push)):
        return None
    if length > 0.0 and not arm.any():
        return None
    rest = length * unit + push / squared
    offset = arm - rest
    # Energy never grows, so neither does the swing: ω²u² + u̇² bounds it.
    reach = math.sqrt(float(offset @ offset) + float(velocity @ velocity) / squared)
    if length > 0.0 and float(rest @ unit) <= reach:
        return None
    return Oscillator(
        rest=tie.place + rest,
        offset=offset,
        velocity=velocity,
        squared=squared,
        damping=0.5 * (damper / mass + drag),
        angle=float(bodies.angle[number]),
        spin=float(bodies.angular_velocity[number]),
    )
