"""Painted: what is drawn on a playfield and is nothing to the ball."""

from pydantic import model_validator

from sandbox.scene.part import Colour, Point, Radius
from sandbox.scene.pinball.element import Corners, Element


class Art(Element):
    """A painted area: a disc, or an outline whose corners may be rounded."""

    colour: Colour
    """`#rrggbb`"""
    position: Point | None = None
    """of a disc's centre, m"""
    radius: Radius | None = None
    """of a disc, m"""
    points: Corners | None = None
    """corners of an outline, m"""

    @model_validator(mode="after")
    def _one(self) -> "Art":
        disc = self.position is not None and self.radius is not None and self.points is None
        outline = self.points is not None and len(self.points) > 2 and self.position is None and self.radius is None
        if not (disc or outline):
            raise ValueError("has no shape; give it `position` and `radius`, or `points`, three or more")
        return self
