"""Marking: what is painted on the ground, `[[play.marking]]`. Nothing meets it, and no engine reads it."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import Colour, Part, Point, Radius

Width = Annotated[float, Field(ge=0, le=1e9)]


class Marking(Part):
    """A disc, a ring, a polygon or a line, drawn below everything else, in the order of the file."""

    colour: Colour
    """`#rrggbb`"""
    position: Point | None = None
    """of the centre of a disc or ring"""
    radius: Radius | None = None
    """of a disc or ring, m"""
    points: Annotated[tuple[Point, ...], Field(max_length=10_000)] = ()
    """of a line, or the corners of a polygon"""
    filled: bool = True
    """whether it is a disc or a polygon; else it is a ring, or a line"""
    width: Width = 0.0
    """of a ring or a line, m; never less than can be seen"""


def unclear(marking: Marking) -> str | None:
    """Say why a marking is no shape, if it is none."""
    of_circle = marking.position is not None or marking.radius is not None
    if bool(marking.points) == of_circle:
        return "is a circle by `position` and `radius`, or a polygon or line by `points`; state one of them"
    if of_circle:
        return None if marking.position and marking.radius else "is a circle; state `position` and `radius`"
    least, kind = (3, "a polygon") if marking.filled else (2, "a line")
    if len(marking.points) < least:
        return f"is {kind}, and has {len(marking.points)} points; {least} or more"
    return None
