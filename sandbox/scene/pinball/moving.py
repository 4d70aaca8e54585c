"""What moves on a table: balls, flippers and the plunger."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Mass, Point, Radius, Vector
from sandbox.scene.pinball.element import Element, Length, Scoring

Angle = Annotated[float, Field(ge=-10, le=10)]
"""rad"""


class PinballBall(Element):
    """A steel ball."""

    position: Point
    """of its centre as the game starts, m"""
    radius: Radius | None = None
    """m; without one, `ball_radius` of the table"""
    mass: Mass | None = None
    """kg; without one, `ball_mass` of the table"""


class Flipper(Element):
    """A bat that turns about a pivot between two stops.

    It is driven by a coil: of Visual Pinball's default, 0.513 N·m after 30 ms, on a moment of inertia of m L²/3. Or
    it keeps to a stroke whatever it meets: up at `rate`, down at `return_rate`.
    """

    pivot: Point
    """where it turns, m"""
    stops: tuple[Angle, Angle] = (-0.541, 0.349)
    """directions of the bat at rest and raised, rad: −31° and 20°, as of the left one of a pair"""
    length: Length = 0.0702
    """from the pivot to the middle of its tip, m: 130 units"""
    base: Radius = 0.0116
    """radius about the pivot, m"""
    tip: Radius = 0.007
    """radius of its tip, m"""
    mass: Mass = 0.08
    """kg"""
    side: Literal["left", "right"] | None = None
    """whose button it obeys; without one, that on whose side of the table its pivot is"""
    drive: Literal["torque", "stroke"] = "torque"
    """`torque`: turned by its coil; `stroke`: at its rates, whatever it meets"""
    torque: Annotated[float, Field(gt=0, le=1e6)] = 0.513
    """N·m"""
    rate: Annotated[float, Field(gt=0, le=1e4)] = 40.0
    """of a stroke up, rad/s"""
    return_rate: Annotated[float, Field(gt=0, le=1e4)] = 10.0
    """of a stroke down, rad/s"""


class Plunger(Scoring):
    """A rod with a spring behind that shoots the ball up its lane."""

    position: Point
    """the middle of its tip, where the ball rests on it, m"""
    direction: Vector = (0.0, 1.0)
    """of the shot; any length"""
    width: Length = 0.02
    """of the tip, m"""
    travel: Length = 0.043
    """of a full pull, m: 80 units"""
    speed: Annotated[float, Field(gt=0, le=1e3)] = 1.03
    """that a full pull gives the ball, m/s"""
