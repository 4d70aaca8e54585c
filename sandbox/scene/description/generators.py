"""Generators of bodies: stacks, ropes, cloths and ragdolls.

A rope of rods or springs, and a cloth, consist of small balls, the nodes, with a joint between neighbours. A rope of
planks consists of capsules end to end, joined by pivots. `mass` is that of each node or plank.

Lengths of a ragdoll are fractions of its height, after Drillis and Contini (1966), as in Winter, Biomechanics and Motor
Control of Human Movement, figure 4.1: heights of ankle .039, knee .285, hip .530, shoulder .818, chin .870; lengths of
upper arm .186, forearm .146, hand .108, foot .152. Thicknesses, the middle of the back, the position of the ankle on
the foot and the limits of the wrist are estimates. Angles of joints are positive where they bend forward, except
for knees, which bend back, and ankles, which point the toes down.
"""

from collections.abc import Sequence
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from sandbox.scene.description.base import (
    MAX_BODIES,
    Accepts,
    BodySource,
    Collides,
    Name,
    Part,
    Point,
    PointField,
    Radius,
    VelocityField,
    default,
)
from sandbox.scene.description.bodies import Length
from sandbox.scene.description.discs import Count
from sandbox.scene.description.joints import Damping, JointStrength, Stiffness

Gap = Annotated[float, Field(ge=0, le=1e9)]


class Stack(BodySource):
    """Equal boxes, numbered along each row from the lower left; `angle` tilts the whole stack about its base."""

    base: PointField
    """centre of the bottom, m"""
    size: Accepts[tuple[Length, Length], Sequence[float]]
    """width and height of each box, m"""
    columns: Count
    """number of boxes in the bottom row; 1 for a tower"""
    rows: Count
    """number of rows"""
    fewer: Annotated[int, Field(ge=0, le=MAX_BODIES)] = 0
    """decrease of the number of boxes from row to row: 0 for a wall, 1 for a pyramid"""
    gap: Gap = 0.0
    """gap between neighbours in a row, and between rows, m"""
    jitter: Gap = 0.0
    """Largest random displacement ± of each box along its row, m."""
    velocity: VelocityField = default((0.0, 0.0))
    """initial velocity, m/s"""
    fixed: bool = False
    """Its boxes never move, as if infinitely heavy: the bricks of a wall."""

    @property
    def max_rows(self) -> int:
        """Largest number of rows: the next row would have no box."""
        return MAX_BODIES if self.fewer == 0 else -(-self.columns // self.fewer)

    @property
    def count(self) -> int:
        """Number of boxes."""
        return self.columns * self.rows - self.fewer * (self.rows * (self.rows - 1) // 2)


RopeEnd = Literal["start", "end"]
ENDS: tuple[RopeEnd, RopeEnd] = ("start", "end")


NodeIndex = Annotated[int, Field(ge=0, lt=MAX_BODIES)]
PinnedNodes = Literal["top", "corners", "left"] | tuple[tuple[NodeIndex, NodeIndex], ...]


class RopeAttachment(Part):
    """Bodies that hold the ends of a rope."""

    start: Name | None = None
    """name of the body at the first end"""
    end: Name | None = None
    """name of the body at the last end"""


class SoftBody(BodySource):
    """Common fields of ropes and cloths."""

    radius: Radius = 0.02
    """radius of each node, or half the thickness of planks, m"""
    collides: Collides = "none"
    """Bodies that nodes or planks collide with; two bodies connected by a joint never collide."""
    velocity: VelocityField = default((0.0, 0.0))
    """initial velocity of all nodes that are not fixed, m/s"""
    stiffness: Stiffness | None = None
    """stiffness of each spring, N/m"""
    damping: Damping = 0.0
    """damping of each spring, N·s/m"""
    strength: JointStrength | None = None
    """strength of each joint, N: a larger force breaks it; default: unbreakable"""


class Rope(SoftBody):
    """A rope of equal links. If longer than the distance of its ends, it starts as an arc that sags along gravity."""

    kind: Literal["rods", "springs", "planks"] = "rods"
    """type of the links: rods or springs between nodes, or planks joined by pivots"""
    start: PointField
    """position of the first end, m"""
    end: PointField
    """position of the last end, m"""
    links: Count
    """number of rods, springs or planks"""
    length: Length | None = None
    """length of the whole rope at rest, m; default: the distance from start to end"""
    fix: Accepts[Annotated[tuple[RopeEnd, ...], Field(max_length=2)] | None, Sequence[RopeEnd] | None] = default(None)
    """ends that are fixed in the world; default: both, except tied ends"""
    tie: RopeAttachment = Field(default_factory=RopeAttachment)
    """bodies that the ends are tied to"""

    def tied(self, end: RopeEnd) -> str | None:
        """Return the name of the body that an end is tied to, or None."""
        return self.tie.start if end == "start" else self.tie.end

    def holds(self, end: RopeEnd) -> bool:
        """Return whether an end is fixed in the world."""
        return self.tied(end) is None if self.fix is None else end in self.fix


class Cloth(SoftBody):
    """A grid of nodes joined to their neighbours, numbered along each row from the upper left."""

    kind: Literal["springs", "rods"] = "springs"
    """type of the joints along rows and columns"""
    corner: PointField
    """position of the upper left node, m"""
    columns: Count
    """number of nodes in each row"""
    rows: Count
    """number of rows"""
    spacing: Accepts[tuple[Length, Length], Sequence[float]]
    """distance between columns and between rows, m"""
    shear: Stiffness | None = None
    """stiffness of diagonal springs, N/m; default: no diagonal springs"""
    bend: Stiffness | None = None
    """stiffness of springs from each node to the next but one, N/m; default: no such springs"""
    pins: Accepts[PinnedNodes, Literal["top", "corners", "left"] | Sequence[Sequence[int]]] = default("top")
    """fixed nodes: a row, a column, the upper corners, or a list of [column, row], counted from 0"""

    @property
    def pinned(self) -> tuple[tuple[int, int], ...]:
        """Column and row of each fixed node."""
        match self.pins:
            case "top":
                return tuple((column, 0) for column in range(self.columns))
            case "left":
                return tuple((0, row) for row in range(self.rows))
            case "corners":
                return ((0, 0), (self.columns - 1, 0))
            case _:
                return self.pins


DEFAULT_MASS = 75.0
"""kg"""


class Ragdoll(BodySource):
    """A figure that stands in mid-stride; `angle` and `angular_velocity` turn the whole figure about its position."""

    position: PointField
    """point on the ground under it, m"""
    height: Annotated[float, Field(ge=1e-3, le=1e6)] = 1.75
    """height of the figure, m"""
    mass: Annotated[float, Field(ge=1e-9, le=1e30)] | None = None
    """total mass, kg; default 75"""
    facing: Literal["right", "left"] = "right"
    """direction that it faces"""
    velocity: VelocityField = default((0.0, 0.0))
    """initial velocity, m/s"""


class BodySegment(NamedTuple):
    """Segment of the body in the anatomical position, facing right, with its soles at the origin.

    All lengths are fractions of the height.
    """

    mass_percent: float
    """percentage of the mass of the body"""
    ends: tuple[Point, ...]
    """centres of the half discs of its capsule; for the head, the centre of its disc"""
    radius: float
    parent: str = ""
    """name of the segment that a joint connects it to; empty for the pelvis"""
    joint: Point = (0.0, 0.0)
    """position of that joint"""
    bounds: tuple[float, float] = (0.0, 0.0)
    """limits of its angle to its parent, degrees, positive counter-clockwise"""


TRUNK = {
    "pelvis": BodySegment(21.75, ((0.0, 0.674), (0.0, 0.530)), 0.065),
    "chest": BodySegment(21.75, ((0.0, 0.818), (0.0, 0.674)), 0.065, "pelvis", (0.0, 0.674), (-35.0, 35.0)),
    "head": BodySegment(6.9, ((0.0, 0.935),), 0.065, "chest", (0.0, 0.870), (-50.0, 50.0)),
}
LIMBS = {
    "upper-arm": BodySegment(2.7, ((0.0, 0.818), (0.0, 0.632)), 0.027, "chest", (0.0, 0.818), (-60.0, 180.0)),
    "forearm": BodySegment(1.6, ((0.0, 0.632), (0.0, 0.486)), 0.022, "upper-arm", (0.0, 0.632), (0.0, 145.0)),
    "hand": BodySegment(0.6, ((0.0, 0.486), (0.0, 0.398)), 0.020, "forearm", (0.0, 0.486), (-70.0, 70.0)),
    "thigh": BodySegment(14.2, ((0.0, 0.530), (0.0, 0.285)), 0.045, "pelvis", (0.0, 0.530), (-20.0, 120.0)),
    "shank": BodySegment(4.3, ((0.0, 0.285), (0.0, 0.039)), 0.030, "thigh", (0.0, 0.285), (-135.0, 0.0)),
    "foot": BodySegment(1.4, ((-0.0185, 0.0195), (0.0945, 0.0195)), 0.0195, "shank", (0.0, 0.039), (-50.0, 20.0)),
}
"""Segments of one side."""

STRIDE = {
    "right": {"upper-arm": -12.0, "forearm": 15.0, "thigh": 10.0, "shank": -10.0, "foot": 0.0},
    "left": {"upper-arm": 12.0, "forearm": 10.0, "thigh": -5.0, "shank": -5.0, "foot": 10.0},
}
"""Joint angles at the start, degrees; the others are 0."""

NEAR_LIMB_COLOUR, FAR_LIMB_COLOUR = "#e69f00", "#56b4e9"
"""Default colours of the limbs in front of and behind the trunk."""


def segments(ragdoll: Ragdoll) -> dict[str, BodySegment]:
    """Return the segments by name, in the order of the bodies: those behind the trunk first."""
    near_side, far_side = ("right", "left") if ragdoll.facing == "right" else ("left", "right")
    return {**_limbs(far_side), **TRUNK, **_limbs(near_side)}


def _limbs(side: str) -> dict[str, BodySegment]:
    return {
        f"{side}-{name}": limb._replace(parent=limb.parent if limb.parent in TRUNK else f"{side}-{limb.parent}")
        for name, limb in LIMBS.items()
    }
