"""Bodies: boxes, capsules, polygons and compounds of them."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from sandbox.scene.description.base import (
    Accepts,
    Angle,
    BodySpec,
    Coordinates,
    Density,
    HasMaterial,
    Items,
    OptionalPoint,
    Point,
    PointField,
    Radius,
    default,
)

MAX_CORNERS = 1000
"""Largest number of corners of one outline; far more crash pymunk, and have no visible effect."""

MAX_PARTS = 1000
"""Largest number of parts of one body."""

Length = Annotated[float, Field(ge=1e-9, le=1e9)]
Rounding = Annotated[float, Field(ge=0, le=1e9)]
"""Radius by which an outline is widened, which rounds its corners, m."""
Outline = Annotated[tuple[Point, ...], Field(min_length=3, max_length=MAX_CORNERS)]


class Box(BodySpec):
    """A rectangle centred at its position."""

    size: Accepts[tuple[Length, Length], Sequence[float]]
    """width and height before rotation, m"""
    radius: Rounding = 0.0
    """radius by which it is widened on all sides, with round corners, m"""


class Capsule(BodySpec):
    """A rectangle with half discs at its ends, centred at its position, along x before rotation."""

    length: Length
    """distance between the centres of the half discs, m"""
    radius: Radius
    """radius of the round ends, m"""


class Polygon(BodySpec):
    """A simple polygon, clockwise or counter-clockwise; a concave one is cut into convex pieces."""

    points: Accepts[Outline, Coordinates]
    """corners relative to `position`, m"""
    position: PointField = default((0.0, 0.0))
    """origin of the points, m; the position of the body in results is its centre of mass"""
    radius: Rounding = 0.0
    """radius by which it is widened on all sides, with round corners, m"""


class Attached(HasMaterial):
    """Part of a body. Coefficients that it does not have are those of the body."""

    density: Density | None = None
    """kg/m²; default: the density of the body, or the same for all parts"""
    position: PointField = default((0.0, 0.0))
    """position relative to the body's position, m"""
    angle: Angle = 0.0
    """angle in the frame of the body, rad"""


class BallPart(Attached):
    """A disc that is part of a body."""

    radius: Radius
    """radius of the disc, m"""


class BoxPart(Attached):
    """A rectangle that is part of a body."""

    size: Accepts[tuple[Length, Length], Sequence[float]]
    """width and height before rotation, m"""
    radius: Rounding = 0.0
    """radius by which it is widened on all sides, with round corners, m"""


class CapsulePart(Attached):
    """A capsule that is part of a body: along x in the frame of the part, or between two ends."""

    length: Length | None = None
    """distance between the centres of the round ends, m"""
    ends: Accepts[tuple[Point, Point] | None, Coordinates | None] = default(None)
    """or these centres themselves, in the frame of the part, m"""
    radius: Radius
    """radius of the round ends, m"""

    @property
    def centres(self) -> tuple[Point, Point]:
        """Centres of the round ends in the frame of the part, m."""
        if self.ends is not None:
            return self.ends
        half = 0.5 * (self.length or 0.0)
        return (-half, 0.0), (half, 0.0)


class PolygonPart(Attached):
    """A polygon that is part of a body."""

    points: Accepts[Outline, Coordinates]
    """corners of the outline in the frame of the part, m"""
    radius: Rounding = 0.0
    """radius by which it is widened on all sides, with round corners, m"""


AnyPart = BallPart | BoxPart | CapsulePart | PolygonPart


class Compound(BodySpec):
    """One rigid body made of several shapes, such as a hammer. Where parts overlap, their masses add up."""

    centre_of_mass: OptionalPoint = default(None)
    """centre of mass in the frame of the body, m; default: that of its parts"""
    balls: Items[BallPart] = default((), alias="ball", max_length=MAX_PARTS)
    boxes: Items[BoxPart] = default((), alias="box", max_length=MAX_PARTS)
    capsules: Items[CapsulePart] = default((), alias="capsule", max_length=MAX_PARTS)
    polygons: Items[PolygonPart] = default((), alias="polygon", max_length=MAX_PARTS)

    @property
    def parts(self) -> tuple[AnyPart, ...]:
        """The parts by kind, each kind in the order of the file."""
        return self.balls + self.boxes + self.capsules + self.polygons
