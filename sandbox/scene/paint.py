"""Paint: what is drawn on the ground of a scene, below everything; nothing touches it."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import Colour, Part, Point, Radius


class Paint(Part):
    """A coloured area: a disc (`position`, `radius`) or a polygon (`points`)."""

    colour: Colour
    position: Point | None = None
    """of a disc's centre, m"""
    radius: Radius | None = None
    points: Annotated[tuple[Point, ...], Field(min_length=3, max_length=10_000)] | None = None
    """corners of a polygon, m"""
