"""Values of joints of a scene, from the constraints of a pymunk space."""

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

import pymunk

KeyValues: TypeAlias = dict[str, Any]
"""Keys of a table of a scene, with their values"""

MIN_RADIUS = 1e-9
"""m, smallest radius of a capsule, and smallest length of a rod other than 0"""


def point_of(vector: Sequence[float]) -> list[float]:
    """Return a vector of pymunk as a point of a scene."""
    return [float(vector[0]), float(vector[1])]


def joint_values(constraint: pymunk.Constraint, default_bias: float) -> KeyValues | None:
    """Return the kind and the values of a joint; None if a scene has no such joint.

    Args:
        constraint: the joint.
        default_bias: of the solver, which joints without their own `bias` have.
    """
    values = _kind_values(constraint)
    return None if values is None else values | _limits(constraint, default_bias)


def motor_values(motor: pymunk.SimpleMotor) -> KeyValues:
    """Return the values of a motor; None for an unlimited torque."""
    max_torque = float(motor.max_force) if math.isfinite(motor.max_force) else None
    return {"rate": -float(motor.rate) + 0.0, "max_torque": max_torque}


def _limits(constraint: pymunk.Constraint, default_bias: float) -> KeyValues:
    """Return the limits of a joint that differ from the defaults of a scene, as far as pymunk uses them."""
    values: KeyValues = {}
    if math.isfinite(constraint.max_force):
        key = "max_torque" if isinstance(constraint, pymunk.SimpleMotor) else "max_force"
        values[key] = float(constraint.max_force)
    if isinstance(constraint, pymunk.SimpleMotor | pymunk.DampedSpring | pymunk.DampedRotarySpring):
        return values  # they have no error to correct
    if math.isfinite(constraint.max_bias):
        values["max_bias"] = float(constraint.max_bias)
    if constraint.error_bias != default_bias:
        values["bias"] = float(constraint.error_bias)
    return values


def _kind_values(constraint: pymunk.Constraint) -> KeyValues | None:
    """Return the kind of a joint and the values of its geometry; None if a scene has no such joint."""
    match constraint:
        case pymunk.PinJoint():
            length = 0.0 if constraint.distance < MIN_RADIUS else float(constraint.distance)
            return {"kind": "rod", "length": length} | _anchors(constraint)
        case pymunk.PivotJoint():
            return {"kind": "pivot"} | _anchors(constraint)
        case pymunk.SlideJoint():
            limits = {"least": float(constraint.min), "most": float(constraint.max)}
            return {"kind": "slide"} | limits | _anchors(constraint)
        case pymunk.GrooveJoint():
            groove = [point_of(constraint.groove_a), point_of(constraint.groove_b)]
            return {"kind": "groove", "groove": groove, "anchor": point_of(constraint.anchor_b)}
        case pymunk.DampedSpring():
            values = {"rest_length": float(constraint.rest_length), "damping": float(constraint.damping)}
            return {"kind": "spring", "stiffness": float(constraint.stiffness)} | values | _anchors(constraint)
        case pymunk.DampedRotarySpring():
            values = {"rest_angle": -float(constraint.rest_angle) + 0.0, "damping": float(constraint.damping)}
            return {"kind": "rotary_spring", "stiffness": float(constraint.stiffness)} | values
        case pymunk.RotaryLimitJoint():
            return {"kind": "rotary_limit", "least": float(constraint.min), "most": float(constraint.max)}
        case pymunk.GearJoint():
            return {"kind": "gear", "ratio": float(constraint.ratio), "phase": float(constraint.phase)}
        case pymunk.RatchetJoint():
            clicks = {"ratchet": float(constraint.ratchet), "phase": float(constraint.phase)}
            return {"kind": "ratchet", "angle": float(constraint.angle)} | clicks
        case pymunk.SimpleMotor():
            return {"kind": "motor", "rate": -float(constraint.rate) + 0.0}
    return None


def _anchors(constraint: Any) -> KeyValues:
    return {"anchors": [point_of(constraint.anchor_a), point_of(constraint.anchor_b)]}
