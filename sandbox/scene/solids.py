"""Solids: bodies that are no discs. A body's state is that of its centre of mass, wherever its outline was drawn."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import Density, Point, Radius
from sandbox.scene.surfaced import Single, Surfaced

MAX_CORNERS = 1000
"""of one outline; far more crash pymunk, and nobody sees the difference"""

MAX_PARTS = 1000
"""of one body"""

Length = Annotated[float, Field(ge=1e-9, le=1e9)]
Angle = Annotated[float, Field(ge=-1e12, le=1e12)]
Outline = Annotated[tuple[Point, ...], Field(min_length=3, max_length=MAX_CORNERS)]


class Box(Single):
    """A rectangle about its position."""

    size: tuple[Length, Length]
    """width and height before it is turned, m"""


class Capsule(Single):
    """A rectangle with half discs on its ends, along x before it is turned, about its position."""

    length: Length
    """between the centres of the half discs, m"""
    radius: Radius
    """of its round ends, m"""


class Polygon(Single):
    """A simple polygon, either way round; where it is concave, it is cut into convex pieces."""

    points: Outline
    """its corners, m, as seen from `position`"""
    position: Point = (0.0, 0.0)
    """where the points are counted from; the body's own position is its centre of mass"""


class Attached(Surfaced):
    """A part of a body. What it does not state of its surface, the body does."""

    density: Density | None = None
    """kg/m²; without, the body's, or the same for all parts"""
    position: Point = (0.0, 0.0)
    """as seen from the body's position, m"""
    angle: Angle = 0.0
    """in the frame of the body, rad"""


class BallPart(Attached):
    """A disc that is part of a body."""

    radius: Radius
    """of the disc, m"""


class BoxPart(Attached):
    """A rectangle that is part of a body."""

    size: tuple[Length, Length]
    """width and height, m"""


class CapsulePart(Attached):
    """A capsule that is part of a body."""

    length: Length
    """between the centres of its round ends, m"""
    radius: Radius
    """of its round ends, m"""


class PolygonPart(Attached):
    """A polygon that is part of a body."""

    points: Outline
    """corners of the outline, in the frame of the part, m"""


AnyPart = BallPart | BoxPart | CapsulePart | PolygonPart


class Compound(Single):
    """Several shapes that are one body, such as a hammer. Its parts may overlap: their masses add up."""

    balls: Annotated[tuple[BallPart, ...], Field(alias="ball", max_length=MAX_PARTS)] = ()
    boxes: Annotated[tuple[BoxPart, ...], Field(alias="box", max_length=MAX_PARTS)] = ()
    capsules: Annotated[tuple[CapsulePart, ...], Field(alias="capsule", max_length=MAX_PARTS)] = ()
    polygons: Annotated[tuple[PolygonPart, ...], Field(alias="polygon", max_length=MAX_PARTS)] = ()

    @property
    def parts(self) -> tuple[AnyPart, ...]:
        """Its parts, by kind, each in the order of the file."""
        return self.balls + self.boxes + self.capsules + self.polygons
