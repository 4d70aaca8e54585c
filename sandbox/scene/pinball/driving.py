"""Driving: the bodies and drives of a table's balls, flippers and plunger."""

from sandbox.scene.discs import Ball
from sandbox.scene.pinball.bats import bat
from sandbox.scene.pinball.building import Building
from sandbox.scene.pinball.fixing import unit
from sandbox.scene.pinball.materials import BALL
from sandbox.scene.pinball.moving import Flipper, PinballBall, Plunger
from sandbox.scene.solids import Polygon

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
    outline = bat(of.length, of.base, of.tip)
    side = of.side or ("left" if of.pivot[0] < to.axis else "right")
    to.body(
        Polygon(
            name=name,
            position=of.pivot,
            points=outline,
            angle=of.stops[0],
            mass=of.mass,
            fixed=True,
            material="flipper",
            colour=of.colour,
        )
    )
    to.part(name, "flipper", group=side)


def plunger(to: Building, name: str, of: Plunger) -> None:
    """Add a rod's tip and what shoots it."""
    (x, y), along = of.position, unit(of.direction)
    half = 0.5 * of.width
    tip = (0.0, half), (-DEPTH, half), (-DEPTH, -half), (0.0, -half)
    points = tuple((u * along[0] - v * along[1], u * along[1] + v * along[0]) for u, v in tip)
    to.body(Polygon(name=name, position=(x, y), points=points, fixed=True, material="wall", colour=of.colour))
    served = x + along[0] * 1.001 * to.ball_radius, y + along[1] * 1.001 * to.ball_radius
    to.part(name, "plunger", of, at=served)
