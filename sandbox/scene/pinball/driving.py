"""Driving: the bodies and drives of a table's balls, flippers and plunger."""

import math
from typing import Any

from sandbox.scene.discs import Ball
from sandbox.scene.drives import PlungerDrive, StrokeDrive, TorqueDrive
from sandbox.scene.pinball.bats import bat
from sandbox.scene.pinball.building import Building
from sandbox.scene.pinball.fixing import unit
from sandbox.scene.pinball.materials import BALL
from sandbox.scene.pinball.moving import Flipper, PinballBall, Plunger
from sandbox.scene.solids import Polygon

RAMP = 0.03
"""s, in which a coil's torque rises"""
RETURN = 0.058
"""of the torque, by which a spring draws a bat back"""
HOLD, WITHIN = 0.75, math.radians(6.0)
"""of the torque that is left this near the raised stop, rad"""
BOUNCE = 0.3
"""of its speed with which a bat comes back from a stop"""
DEPTH = 0.012
"""m, of a plunger's tip along its way"""


def ball(to: Building, name: str, of: PinballBall) -> None:
    """Add a ball."""
    radius = to.ball_radius if of.radius is None else of.radius
    mass = to.ball_mass if of.mass is None else of.mass
    to.body(Ball(name=name, position=of.position, radius=radius, mass=mass, material=BALL, colour=of.colour))
    to.part(name, "ball", at=of.position)


def flipper(to: Building, name: str, of: Flipper) -> None:
    """Add a bat and what turns it."""
    to.body(
        Polygon(
            name=name,
            position=of.pivot,
            points=bat(of.length, of.base, of.tip),
            angle=of.stops[0],
            mass=of.mass,
            material="flipper",
            colour=of.colour,
        )
    )
    to.drives.append(_drive(name, of))
    to.part(name, "flipper", group=of.side or ("left" if of.pivot[0] < to.axis else "right"))


def plunger(to: Building, name: str, of: Plunger) -> None:
    """Add a rod's tip and what shoots it."""
    (x, y), along = of.position, unit(of.direction)
    half = 0.5 * of.width
    tip = (0.0, half), (-DEPTH, half), (-DEPTH, -half), (0.0, -half)
    points = tuple((u * along[0] - v * along[1], u * along[1] + v * along[0]) for u, v in tip)
    to.body(Polygon(name=name, position=(x, y), points=points, material="wall", colour=of.colour))
    to.drives.append(
        PlungerDrive(kind="plunger", name=name, body=name, direction=of.direction, travel=of.travel, speed=of.speed)
    )
    served = x + along[0] * 1.001 * to.ball_radius, y + along[1] * 1.001 * to.ball_radius
    to.part(name, "plunger", of, at=served)


def _drive(name: str, of: Flipper) -> TorqueDrive | StrokeDrive:
    """Return the drive of a bat: a stroke, or a coil to which it is as heavy as a rod of its mass and length."""
    held: dict[str, Any] = {"name": name, "body": name, "pivot": of.pivot, "stops": of.stops}
    if of.drive == "stroke":
        return StrokeDrive(kind="stroke", rate=of.rate, return_rate=of.return_rate, **held)
    return TorqueDrive(
        kind="torque",
        torque=of.torque,
        ramp=RAMP,
        return_ratio=RETURN,
        hold_ratio=HOLD,
        hold_within=WITHIN,
        bounce=BOUNCE,
        moment=of.mass * of.length**2 / 3.0,
        **held,
    )
