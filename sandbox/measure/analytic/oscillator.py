"""Oscillator: a body on one spring, along its line, with or without damping and gravity.

With the displacement u from the equilibrium, ü + 2γ u̇ + ω² u = 0, so u = e^(−γt) (u₀ C + (u̇₀ + γ u₀) S), where C and
S are cos(νt) and sin(νt)/ν with ν² = ω² − γ²; 1 and t if ν is 0; cosh and sinh if ν² is negative.
"""

import math
from dataclasses import dataclass

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.measure.analytic.model import BodyMotion, SceneFacts, direction, parallel
from sandbox.scene.compile.demands import AIR, Demand, demands
from sandbox.scene.compile.joint_arrays import JointKind
from sandbox.trajectory import ContactEvent


@dataclass(frozen=True, eq=False)
class Oscillator:
    """Motion of one body on a spring."""

    rest: FloatArray
    """(2,) m, equilibrium position"""
    offset: FloatArray
    """(2,) m from the equilibrium, at time 0"""
    velocity: FloatArray
    """(2,) m/s, at time 0"""
    squared: float
    """ω², k/m, 1/s²"""
    damping: float
    """γ, half of c/m and of the drag, 1/s"""
    angle: float
    """at time 0, rad"""
    spin: float
    """rad/s, constant"""
    name: str = "oscillation on a spring"

    def at(self, time: FloatArray) -> BodyMotion:
        """Return its motion at T times."""
        c, s = (each[:, None] for each in damped(time, self.squared, self.damping))
        displacement = self.offset * c + (self.velocity + self.damping * self.offset) * s
        velocity = self.velocity * c - (self.damping * self.velocity + self.squared * self.offset) * s
        return BodyMotion(
            self.rest + displacement, velocity, self.angle + self.spin * time, np.full(len(time), self.spin)
        )

    def contacts(self, _until: float, _shortest: float) -> list[ContactEvent]:
        """Return no contacts."""
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


def oscillator(facts: SceneFacts, number: int) -> Oscillator | None:
    """Return the motion of a body on one spring to a fixed point; None if it does not apply.

    The spring is attached at the centre of the body. The body has no contacts, and no other joint, attraction or thrust
    acts on it. All motion is along the line of the spring, and the spring never shrinks to length 0, where its force
    would jump; or its rest length is 0 and it has no damper, so that both components oscillate independently.
    """
    scene, bodies = facts.scene, facts.bodies
    if not facts.moves_freely(number) or not facts.matrix.held[number] or scene.attractions:
        return None
    anchor = facts.anchor(number)
    if anchor is None or anchor.kind != JointKind.SPRING or anchor.arm.any():
        return None
    # Damping changes the spin, which is constant here, and lift couples x and y.
    if facts.world.quadratic_drag > 0.0 or demands(facts.scene) & AIR - {Demand.DRAG}:
        return None
    length, stiffness, damper = anchor.figures.tolist()
    mass, drag = float(bodies.mass[number]), facts.world.linear_drag
    squared = stiffness / mass
    push = facts.gravity + drag * np.asarray(facts.world.wind)
    arm, velocity = bodies.position[number] - anchor.place, bodies.velocity[number].copy()

    sideways = length > 0.0 or damper > 0.0
    unit = next((direction(each) for each in (arm, velocity, push) if each.any()), np.asarray([1.0, 0.0]))
    if sideways and not all(parallel(each, unit) for each in (velocity, push)):
        return None
    if length > 0.0 and not arm.any():
        return None
    rest = length * unit + push / squared
    offset = arm - rest
    # Energy does not grow, so ω²u² + u̇² bounds the amplitude.
    reach = math.sqrt(float(offset @ offset) + float(velocity @ velocity) / squared)
    if length > 0.0 and float(rest @ unit) <= reach:
        return None
    return Oscillator(
        rest=anchor.place + rest,
        offset=offset,
        velocity=velocity,
        squared=squared,
        damping=0.5 * (damper / mass + drag),
        angle=float(bodies.angle[number]),
        spin=float(bodies.angular_velocity[number]),
    )
