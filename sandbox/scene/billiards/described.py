"""Billiards: what a scene file says of a table, its balls and how they are racked."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Friction, Mass, Name, Part, Point, Radius, Restitution
from sandbox.scene.spots import TableGame

TableName = Literal["pool-7ft", "pool-8ft", "pool-9ft", "snooker-12ft", "carom-10ft"]
RackName = Literal["8-ball", "9-ball", "snooker", "carom", "none"]


class Billiards(Part):
    """A table by name, a rack on it, and the game that the window plays: it stands for a scene of primitives.

    What else the scene states outranks it: a ball, wall or pocket of the same name, a key of `[surface]`,
    `[contact_models]`, `[world]`, `[solver]` or `[play]`, a material or a pair. The table's corner is the origin, on
    the noses of the cushions; x runs along its width, y along its length, towards the rack.
    """

    table: TableName | None = None
    """without one, the scene's own walls, posts and pockets are it, and its `[[play.spot]]`s say where to rack"""
    game: TableGame = "free"
    """which the window plays"""
    rack: RackName | None = None
    """without one, the game's"""
    gap: Annotated[float, Field(ge=0, le=0.1)] = 1e-4
    """m: racked neighbours are up to this far apart, each at random from the seed; 0 is frozen"""
    place: dict[Name, Point] = Field(default_factory=dict)
    """where balls of the set lie instead, by name, m: racked ones, or more"""
    ball_radius: Radius | None = None
    """m; without one, that of the set"""
    ball_mass: Mass | None = None
    """kg"""
    ball_restitution: Restitution = 0.95
    """of two balls; without rubbing, unless `[contact_models]` says so"""
    cushion_restitution: Restitution = 0.85
    """of the cushions, 0 to 1"""
    cushion_friction: Friction = 0.2
    """Coulomb friction μ of the cushions"""
    nose: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """height of the cushions' noses above the floor, m"""
