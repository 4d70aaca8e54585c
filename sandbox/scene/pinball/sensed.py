"""What notices the ball, and may hold or lift it: rollovers, spinners, kicker holes, ramps and the drain."""

from sandbox.scene.part import Colour, Name, Point, Radius, Velocity
from sandbox.scene.pinball.element import Corners, Length, Points, Scoring, Size

LEAST_DEPTH = 0.012
"""m: at 1 kHz no ball slower than 12 m/s passes over what is that deep unnoticed"""


class Rollover(Scoring):
    """A wire in a lane that the ball rolls over."""

    position: Point
    """of its middle, m"""
    radius: Radius = 0.008
    """m: it notes a ball whose centre is nearer than this"""
    score: Points = 250


class Spinner(Scoring):
    """A plate on an axle that a ball passes under and sets turning; rules count its turns."""

    points: tuple[Point, Point]
    """the ends of its axle, m"""
    thickness: Length = LEAST_DEPTH
    """of where the ball is noticed, m"""
    score: Points = 100


class Kicker(Scoring):
    """A hole that holds a ball until rules let it go."""

    position: Point
    """of its centre, m"""
    radius: Radius = 0.0135
    """that the ball's centre must come within, 25 units, m"""
    out: Velocity
    """with which it lets a ball go, m/s"""
    score: Points = 1000


class Drain(Scoring):
    """Where a ball is lost: the line that its centre must cross."""

    points: tuple[Point, Point]
    """the two ends of the line, m"""
    thickness: Length = 0.02
    """m"""


class Ramp(Scoring):
    """A way up to a layer of its own, between two rails, and to its end, where the ball drops to the ground.

    A ball that enters the mouth is lifted to the layer; one that does not make the climb comes back out of it.
    """

    points: Corners
    """its middle line from the mouth to the end, m; as of walls, corners may be rounded"""
    width: Length = 0.040
    """between the rails, m"""
    thickness: Size = 0.003
    """of the rails, m"""
    layer: Name | None = None
    """without one, the ramp's own name"""
    climb: Length = 0.12
    """how much of it, from the mouth, leads up, m"""
    rise: Size = 0.04
    """how high that leads above the playfield, m"""
    floor: Colour | None = None
    """of the ground below it, between the rails"""
    score: Points = 2500
