"""`[surface]`, contact models, pockets, and strokes of a cue, for scenes seen from above.

Balls on a surface are spheres that slide, roll and spin: ω has three components, right-handed, z up. Or they are pucks:
flat discs, which slide and rotate about z only.

Source of the stroke: impulse of a level cue with mass, with enough friction at the tip to prevent slip (Alciatore TP
A.30 and A.31; Leckie & Greenspan 2006). The tip is at (a, b) · R from the centre, to the right and above, as seen by
the player.
"""

import math
from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.description.base import (
    AngularVelocity,
    Colour,
    Friction,
    Mass,
    Name,
    Part,
    PointField,
    Radius,
)

Spin = tuple[AngularVelocity, AngularVelocity, AngularVelocity]
"""rad/s, right-handed, z up: natural roll is (−v_y, v_x, 0) / R"""

BallBall = Literal["elastic", "frictional"]
Cushion = Literal["simple", "han2005", "mathavan2010"]
TabletopBody = Literal["spheres", "pucks"]


class Floor(Part):
    """The floor under a top-down scene and its friction. Coefficients that are left out are 0."""

    gravity: Annotated[float, Field(gt=0, le=1e9)] = 9.81
    """gravity into the floor, m/s²"""
    sliding_friction: Friction = 0.0
    """μ_s: deceleration a = −μ_s·g·û while the point of contact slides with velocity u; for pucks a = −μ_s·g·v̂"""
    rolling_friction: Friction = 0.0
    """μ_r: deceleration of a rolling ball, a = −μ_r·g·v̂"""
    spinning_friction: Friction = 0.0
    """μ_sp: torque μ_sp·m·g·R against ω_z, which decreases by 5·μ_sp·g / (2R) rad/s² for spheres and by 2·μ_sp·g / R
    for pucks"""
    bodies: TabletopBody = "spheres"
    """type of the balls: `spheres`, or `pucks`, which are flat discs that slide and do not roll"""
    curl: Annotated[float, Field(ge=-10, le=10)] = 0.0
    """κ: sideways acceleration κ·μ_s·g of a sliding puck, to the left if it rotates counter-clockwise, to the right if
    clockwise. An empirical law of curling stones, not derived from first principles"""

    @property
    def has_friction(self) -> bool:
        """Whether the surface has any friction."""
        return bool(self.sliding_friction or self.rolling_friction or self.spinning_friction)


class ContactModels(Part):
    """Collision models of balls on a floor: with each other and with cushions."""

    ball_ball: BallBall = "elastic"
    """`elastic`: restitution only, spins do not change; `frictional`: with friction μ = 0.009951 + 0.108·exp(−1.088
    |u|)"""
    cushion: Cushion = "simple"
    """`simple`: restitution along the normal only; `han2005`: a nose at a height, with friction; `mathavan2010`: with
    friction at the nose and at the floor during compression"""

    @property
    def depends_on_spin(self) -> bool:
        """Whether a model depends on spin."""
        return self.ball_ball == "frictional" or self.cushion != "simple"


class Pocket(Part):
    """A hole that captures a ball whose centre enters its circle. The ball then stays at the centre of the hole."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file"""
    position: PointField
    """position of the centre, m"""
    radius: Radius
    """capture radius for the centre of a ball, m"""
    colour: Colour | None = None
    """colour in the window, `#rrggbb`"""


MISCUE = 0.5
"""fraction of the radius: the tip slips at a larger offset"""

END_MASS = 1.0 / 30.0
"""fraction of the ball's mass: effective mass of the cue's end, which moves aside with the ball and causes squirt"""

Offset = Annotated[float, Field(ge=-MISCUE, le=MISCUE)]


class Stroke(Part):
    """Stroke of a level cue at a ball."""

    aim: Annotated[float, Field(ge=-1e6, le=1e6)]
    """direction of the cue, rad from +x"""
    speed: Annotated[float, Field(gt=0, le=100)]
    """speed of the cue, m/s"""
    side: Offset = 0.0
    """side offset of the tip as a fraction of the radius; positive to the right"""
    height: Offset = 0.0
    """height offset of the tip as a fraction of the radius; positive above the centre (follow)"""
    cue_mass: Mass = 0.567
    """mass of the cue, kg"""


class Shot(Stroke):
    """A cue stroke at the start of the scene."""

    name: Name | None = None
    """without a name, it is called by its kind and its number in the file"""
    ball: Name = "cue"
    """name of the struck ball"""


def miscues(stroke: Stroke) -> bool:
    """Return whether the tip would slip."""
    return math.hypot(stroke.side, stroke.height) > MISCUE


def squirt_angle(side: float, end_mass: float = END_MASS) -> float:
    """Return the angle between cue and path of a ball that is struck off its centre, rad, clockwise.

    Source: Alciatore TP A.31.

    Args:
        side: side offset of the tip as a fraction of the radius, positive to the right.
        end_mass: effective mass of the cue's end as a fraction of the ball's.
    """
    level = 1.0 - side * side
    return -math.atan(2.5 * side * math.sqrt(level) / (1.0 + 1.0 / end_mass + 2.5 * level))


def struck(stroke: Stroke, mass: float, radius: float) -> tuple[tuple[float, float], Spin]:
    """Return the velocity, m/s, and the spin, rad/s, of a sphere directly after a stroke.

    Args:
        stroke: the stroke.
        mass: mass of the ball, kg.
        radius: radius of the ball, m.
    """
    a, b = stroke.side, stroke.height
    speed = 2.0 * stroke.speed / (1.0 + mass / stroke.cue_mass + 2.5 * (a * a + b * b))
    heading = stroke.aim - squirt_angle(a)  # sidespin to the right deflects the ball to the left
    cos, sin = math.cos(heading), math.sin(heading)
    rate = speed / (0.4 * radius)
    # b gives spin about the axis to the left of its path, a about z: struck on the right it spins counter-clockwise.
    return (speed * cos, speed * sin), (-rate * b * sin, rate * b * cos, rate * a)
