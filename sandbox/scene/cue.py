"""Cue: what a stroke does to a ball that stands on a floor.

Source: the impulse of a level cue with mass, friction at the tip enough to hold it (Alciatore TP A.30 and A.31;
Leckie & Greenspan 2006). The tip is at (a, b) · R from the centre, to the right of it and above, as the player sees it.
"""

import math
from typing import Annotated

from pydantic import Field

from sandbox.scene.floor import Spin
from sandbox.scene.part import Mass, Name, Part

MISCUE = 0.5
"""of the radius: farther off, the tip slips"""

END_MASS = 1.0 / 30.0
"""of the ball's mass: what of the cue's end moves aside with the ball, and sends it off its line"""

Offset = Annotated[float, Field(ge=-MISCUE, le=MISCUE)]


class Stroke(Part):
    """How a cue meets a ball; level."""

    aim: Annotated[float, Field(ge=-1e6, le=1e6)]
    """rad, of the cue's way, from +x"""
    speed: Annotated[float, Field(gt=0, le=100)]
    """of the cue, m/s"""
    side: Offset = 0.0
    """a, of the radius; to the right is positive"""
    height: Offset = 0.0
    """b, of the radius; above the centre, follow, is positive"""
    cue_mass: Mass = 0.567
    """kg"""


class Shot(Stroke):
    """A stroke with which a scene starts."""

    name: Name | None = None
    """one without a name is called by its kind and its place in the file"""
    ball: Name = "cue"
    """name of the ball that is struck"""


def miscues(stroke: Stroke) -> bool:
    """Tell whether the tip would slip."""
    return math.hypot(stroke.side, stroke.height) > MISCUE


def struck(stroke: Stroke, mass: float, radius: float) -> tuple[tuple[float, float], Spin]:
    """Return the velocity, m/s, and the spin, rad/s, of a sphere right after a stroke.

    Args:
        stroke: how.
        mass: of the ball, kg.
        radius: of the ball, m.
    """
    a, b = stroke.side, stroke.height
    speed = 2.0 * stroke.speed / (1.0 + mass / stroke.cue_mass + 2.5 * (a * a + b * b))
    level = 1.0 - a * a
    squirt = -math.atan(2.5 * a * math.sqrt(level) / (1.0 + 1.0 / END_MASS + 2.5 * level))
    heading = stroke.aim - squirt  # side to the right sends the ball to the left
    cos, sin = math.cos(heading), math.sin(heading)
    rate = speed / (0.4 * radius)
    # b turns it about the axis to the left of its way, a about z: struck on its right it turns anti-clockwise.
    return (speed * cos, speed * sin), (-rate * b * sin, rate * b * cos, rate * a)
