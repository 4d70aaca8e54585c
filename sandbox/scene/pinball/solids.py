"""What the ball hits that stands still: walls, rubbers, posts, gates, bumpers, slingshots and targets."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.kick import LEAST_THRESHOLD
from sandbox.scene.part import Point, Radius, Vector
from sandbox.scene.pinball.element import Element, Length, Line, Points, Scoring, Size
from sandbox.scene.surfaced import GROUND
from sandbox.scene.zone import Layers

MaterialName = Literal["wall", "rubber", "post", "target"]
Speed = Annotated[float, Field(ge=0, le=1e3)]
"""m/s"""
Threshold = Annotated[float, Field(ge=LEAST_THRESHOLD, le=1e3)]
"""m/s"""


class PinballWall(Line):
    """Wood, plastic or wire."""

    thickness: Size = 0.006
    """full thickness, m"""
    material: MaterialName = "wall"
    """name of its material"""


class Rubber(Line):
    """A rubber band around posts that stand at its corners."""

    thickness: Size = 0.008
    """of the band and what it is stretched around, m"""


class PinballPost(Element):
    """A round post with a sleeve."""

    position: Point
    """of its centre, m"""
    radius: Radius = 0.005
    """of the post, m"""
    material: MaterialName = "post"
    """name of its material"""
    layers: Layers = (GROUND,)
    """on which it is solid"""


class Gate(Scoring):
    """A wire that lets pass from the right of its direction, first to second point, and is a wall from the left."""

    points: tuple[Point, Point]
    """the two ends of the wire, m"""
    thickness: Size = 0.003
    """of the wire, m"""


class Bumper(Scoring):
    """A pop bumper: it throws whatever hits it."""

    position: Point
    """of its centre, m"""
    radius: Radius = 0.0243
    """45 units, m"""
    speed: Speed = 0.81
    """that it adds, m/s"""
    threshold: Threshold = 0.054
    """m/s, of what it notices"""
    score: Points = 100


class Slingshot(Scoring):
    """A triangle of rubber; the first of its sides kicks, most in the middle."""

    points: tuple[Point, Point, Point]
    """its three posts, m: the ends of the side that kicks, and the one behind"""
    thickness: Size = 0.008
    """of the rubber, m"""
    speed: Speed = 2.16
    """that it adds to the approach in its middle, m/s"""
    threshold: Threshold = 0.054
    """m/s"""
    score: Points = 10


class Standup(Scoring):
    """A target that stays up."""

    position: Point
    """the middle of its face, m"""
    facing: Vector
    """out of its face; any length"""
    width: Length = 0.025
    """of its face, m"""
    thickness: Size = 0.005
    """of the target, m"""
    score: Points = 500


class DropTargets(Scoring):
    """A bank of targets that fall when they are hit; rules let them fall and raise them again."""

    position: Point
    """the middle of the bank's faces, m"""
    facing: Vector
    """out of the faces; any length"""
    count: Annotated[int, Field(ge=1, le=20)] = 3
    """how many targets"""
    width: Length = 0.025
    """of each, m"""
    gap: Size = 0.003
    """between two, m"""
    thickness: Size = 0.005
    """of each, m"""
    score: Points = 500
