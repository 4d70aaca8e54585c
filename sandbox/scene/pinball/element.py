"""Element: what everything that a pinball table is built of has in common."""

from typing import Annotated

from pydantic import Field

from sandbox.scene.part import Colour, Coordinate, Name, Part, Point
from sandbox.scene.surfaced import GROUND
from sandbox.scene.zone import Layers

Length = Annotated[float, Field(gt=0, le=1e3)]
"""m"""
Size = Annotated[float, Field(ge=0, le=1e3)]
"""m"""
Points = Annotated[int, Field(ge=0, le=10**12)]
"""of a score"""
Corner = Annotated[tuple[Coordinate, ...], Field(min_length=2, max_length=3)]
"""x and y, m; and, of a corner that is round, the radius of the arc that rounds it, m"""
Corners = Annotated[tuple[Corner, ...], Field(min_length=2, max_length=1000)]


class Element(Part):
    """Anything that a table is built of."""

    name: Name | None = None
    """one without a name is called by its kind and its place in the file"""
    mirrored: bool = False
    """Build it a second time beyond the table's axis; the names of the two begin with `left` and `right`."""
    colour: Colour | None = None
    """in the window, `#rrggbb`"""


class Scoring(Element):
    """An element that rules hear of."""

    score: Points = 0
    """each time it is hit or entered"""
    group: Name | None = None
    """whom it belongs to, such as a bank or a set of lanes"""
    step: Annotated[int, Field(ge=0, le=1000)] = 0
    """its place in the group"""
    light: Point | None = None
    """where a lamp tells whether it is lit, m"""


class Line(Element):
    """A line of straight pieces and arcs, such as `[[0.0, 0.1], [0.0, 1.0, 0.2], [0.5, 1.0]]`, one corner rounded."""

    points: Corners
    """its corners, m; a third number rounds a corner by an arc of that radius, m"""
    thickness: Size
    """full thickness, m"""
    closed: bool = False
    """Join the last point to the first."""
    layers: Layers = (GROUND,)
    """on which it is solid"""
    fill: Colour | None = None
    """of what a closed line encloses"""
