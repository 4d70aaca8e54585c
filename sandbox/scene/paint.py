"""Paint: what is drawn on the ground of a scene, below everything; nothing touches it."""

from typing import Annotated

from pydantic import Field, model_validator

from sandbox.scene.part import Colour, Part, Point, Radius


class Paint(Part):
    """A coloured area: a disc (`position`, `radius`) or a polygon (`points`)."""

    colour: Colour
    position: Point | None = None
    """of a disc's centre, m"""
    radius: Radius | None = None
    points: Annotated[tuple[Point, ...], Field(min_length=3, max_length=10_000)] | None = None
    """corners of a polygon, m"""

    @model_validator(mode="after")
    def _one(self) -> "Paint":
        disc = self.position is not None and self.radius is not None and self.points is None
        if not disc and (self.points is None or self.position is not None or self.radius is not None):
            raise ValueError("has no shape; give it `position` and `radius`, or `points`")
        return self
