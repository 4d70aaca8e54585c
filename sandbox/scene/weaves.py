"""Weaves: ropes, chains, bridges and cloth, as a scene file says them.

A rope of rods or springs, and a cloth, are small balls, the nodes, with a joint between neighbours. A rope of planks
is capsules end to end, which turn as a chain's links do. `mass` is that of each node or plank.
"""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.discs import Count
from sandbox.scene.joints import Damping, Force, Stiffness
from sandbox.scene.part import MAX_BODIES, Name, Part, Point, Radius, Velocity
from sandbox.scene.solids import Length
from sandbox.scene.surfaced import Collides, Mover

End = Literal["start", "end"]
ENDS: tuple[End, End] = ("start", "end")


Place = Annotated[int, Field(ge=0, lt=MAX_BODIES)]


class Ties(Part):
    """The bodies that hold the ends of a rope."""

    start: Name | None = None
    """name of the body that holds the first end"""
    end: Name | None = None
    """name of the body that holds the last end"""


class Woven(Mover):
    """What ropes and cloth have in common."""

    radius: Radius = 0.02
    """of each node; of planks half their thickness, m"""
    collides: Collides = "none"
    """What nodes or planks can meet; two that a joint joins never do."""
    velocity: Velocity = (0.0, 0.0)
    """of all that is not fixed, m/s"""
    stiffness: Stiffness | None = None
    """of each spring, N/m"""
    damping: Damping = 0.0
    """of each spring, N·s/m"""
    strength: Force | None = None
    """of each joint, N: it breaks once it has given more; without, it never does"""


class Rope(Woven):
    """A rope of equal links. One longer than from start to end hangs in an arc towards gravity, of exact lengths."""

    kind: Literal["rods", "springs", "planks"] = "rods"
    """what joins its nodes; or planks, joined by pivots"""
    start: Point
    """its first end, m"""
    end: Point
    """m"""
    links: Count
    """how many rods, springs or planks"""
    length: Length | None = None
    """of the whole rope at rest, m; without, from start to end"""
    fix: Annotated[tuple[End, ...], Field(max_length=2)] | None = None
    """the ends that the world holds; without, both but those that are tied"""
    tie: Ties = Field(default_factory=Ties)
    """the bodies that ends are tied to, where they start"""

    def tied(self, end: End) -> str | None:
        """Return the body that an end is tied to."""
        return self.tie.start if end == "start" else self.tie.end

    def holds(self, end: End) -> bool:
        """Tell whether the world holds an end."""
        return self.tied(end) is None if self.fix is None else end in self.fix


class Cloth(Woven):
    """Nodes in columns and rows, counted along each row from the upper left, joined to their neighbours."""

    kind: Literal["springs", "rods"] = "springs"
    """what joins neighbours along rows and columns"""
    corner: Point
    """the upper left node, m"""
    columns: Count
    """nodes in each row"""
    rows: Count
    """rows of nodes"""
    spacing: tuple[Length, Length]
    """between columns and between rows, m"""
    shear: Stiffness | None = None
    """of springs along the diagonals, N/m; without, there are none"""
    bend: Stiffness | None = None
    """of springs from each node to the next but one, N/m; without, there are none"""
    pins: Literal["top", "corners", "left"] | tuple[tuple[Place, Place], ...] = "top"
    """the nodes that never move: a row, a column, the upper corners, or [column, row] of each from 0"""

    @property
    def pinned(self) -> tuple[tuple[int, int], ...]:
        """The column and row of each node that never moves."""
        match self.pins:
            case "top":
                return tuple((column, 0) for column in range(self.columns))
            case "left":
                return tuple((0, row) for row in range(self.rows))
            case "corners":
                return ((0, 0), (self.columns - 1, 0))
            case _:
                return self.pins
