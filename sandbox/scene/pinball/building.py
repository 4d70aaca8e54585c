"""Building: what a table's elements are written into, in the order in which they come."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from sandbox.scene.faults import Location
from sandbox.scene.marking import Marking
from sandbox.scene.model import Ball, Drive, PlayPart, Polygon, Post, Wall, Zone
from sandbox.scene.part import Point
from sandbox.scene.parts import Role
from sandbox.scene.pinball.element import Corner, Scoring
from sandbox.scene.pinball.rounding import rounded

STATED = "score", "group", "step", "light", "colour"
"""what a part has from its element"""


@dataclass
class Building:
    """The primitives that elements stand for so far, and which element each name is of."""

    axis: float
    """x of the table's axis, m"""
    tolerance: float
    """of arcs, m"""
    ball_radius: float
    ball_mass: float
    gravity: tuple[float, float]
    """on the playfield, m/s²"""
    here: Location = ()
    """the element that is being built"""
    walls: list[Wall] = field(default_factory=list)
    posts: list[Post] = field(default_factory=list)
    zones: list[Zone] = field(default_factory=list)
    balls: list[Ball] = field(default_factory=list)
    polygons: list[Polygon] = field(default_factory=list)
    drives: list[Drive] = field(default_factory=list)
    parts: list[PlayPart] = field(default_factory=list)
    markings: list[Marking] = field(default_factory=list)
    origins: dict[str, Location] = field(default_factory=dict)

    def line(self, corners: Sequence[Corner], closed: bool = False) -> tuple[Point, ...]:
        """Return a line with its round corners flattened."""
        return rounded(corners, closed, self.tolerance)

    def wall(self, name: str, points: Sequence[Point], **more: Any) -> None:
        """Add a wall."""
        self.walls.append(Wall(name=name, points=tuple(points), **more))
        self.origins[name] = self.here

    def post(self, name: str, position: Point, radius: float, **more: Any) -> None:
        """Add a post."""
        self.posts.append(Post(name=name, position=position, radius=radius, **more))
        self.origins[name] = self.here

    def zone(self, name: str, **more: Any) -> None:
        """Add a zone."""
        self.zones.append(Zone(name=name, **more))
        self.origins[name] = self.here

    def body(self, body: Ball | Polygon) -> None:
        """Add a body."""
        those: list[Any] = self.balls if isinstance(body, Ball) else self.polygons
        those.append(body)
        self.origins[str(body.name)] = self.here

    def part(self, name: str, role: Role, element: Scoring | None = None, **more: Any) -> None:
        """Say which part something plays; of an element that rules hear of, with what it states."""
        stated = {} if element is None else {key: getattr(element, key) for key in STATED}
        self.parts.append(PlayPart(name=name, role=role, **{**stated, **more}))

    def paint(self, colour: str | None, points: Sequence[Point]) -> None:
        """Paint an area, if it has a colour."""
        if colour is not None:
            self.markings.append(Marking(points=tuple(points), colour=colour))

    def dot(self, colour: str | None, position: Point, radius: float) -> None:
        """Paint a disc, if it has a colour."""
        if colour is not None:
            self.markings.append(Marking(position=position, radius=radius, colour=colour))
