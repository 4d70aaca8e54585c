"""Floor: what lies under a top-down scene, `[surface]`; how balls on it meet, and the pockets that they fall into.

Balls on a floor are spheres that slide, roll and spin: ω has three components, right-handed, z up. Or they are pucks:
flat discs, which slide and turn about z alone.
"""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import AngularVelocity, Colour, Friction, Name, Part, Point, Radius

Spin = tuple[AngularVelocity, AngularVelocity, AngularVelocity]
"""rad/s, right-handed, z up: natural roll is (−v_y, v_x, 0) / R"""

BallBall = Literal["elastic", "frictional"]
Cushion = Literal["simple", "han2005", "mathavan2010"]
Kind = Literal["spheres", "pucks"]


class Floor(Part):
    """The floor under a top-down scene, and how it rubs. What is left out is not there."""

    gravity: Annotated[float, Field(gt=0, le=1e9)] = 9.81
    """m/s², into the floor"""
    sliding_friction: Friction = 0.0
    """μ_s: while the point of contact slides, at u, a = −μ_s·g·û; of pucks a = −μ_s·g·v̂"""
    rolling_friction: Friction = 0.0
    """μ_r: what rolls has a = −μ_r·g·v̂"""
    spinning_friction: Friction = 0.0
    """μ_sp: the torque μ_sp·m·g·R is against ω_z, which of spheres falls by 5·μ_sp·g / (2R) rad/s², of pucks by
    2·μ_sp·g / R"""
    bodies: Kind = "spheres"
    """what its balls are: `spheres`, or `pucks`, flat discs that never roll"""
    curl: Annotated[float, Field(ge=-10, le=10)] = 0.0
    """κ: what slides and turns anti-clockwise is pushed to the left of its way by κ·μ_s·g, clockwise to the right; of
    pucks alone. An empirical law of curling stones, not derived from anything"""

    @property
    def rubs(self) -> bool:
        """Whether it does anything at all."""
        return bool(self.sliding_friction or self.rolling_friction or self.spinning_friction)


class ContactModels(Part):
    """What happens when balls on a floor hit each other, and what is fixed."""

    ball_ball: BallBall = "elastic"
    """`elastic`: restitution alone, spins are kept; `frictional`: balls rub, μ = 0.009951 + 0.108·exp(−1.088 |u|)"""
    cushion: Cushion = "simple"
    """`simple`: restitution along the normal alone; `han2005`: a nose of some height, which rubs; `mathavan2010`: one
    that rubs while it is pressed, as the floor does"""

    @property
    def spins(self) -> bool:
        """Whether one of them asks for spin."""
        return self.ball_ball == "frictional" or self.cushion != "simple"


class Pocket(Part):
    """A hole: it captures a ball whose centre comes within its circle. The ball then lies at its centre."""

    name: Name | None = None
    """one without a name is called by its kind and its place in the file"""
    position: Point
    """of its centre, m"""
    radius: Radius
    """m: it captures a ball whose centre is nearer than this"""
    colour: Colour | None = None
    """in the window, `#rrggbb`"""
