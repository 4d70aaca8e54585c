"""Terrain and Artillery: what a scene file says of ground made of columns, and of the players who dig it up."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.part import Colour, Friction, Mass, Name, Part
from sandbox.scene.surfaced import Surfaced

MAX_COLUMNS = 5_000

Level = Annotated[float, Field(ge=0, le=1e6)]
"""A height above the ground's foot, m"""

Edges = Literal["open", "rubber", "wrap"]
"""What becomes of a shell at the sides of the ground: it leaves, it is thrown back, or it comes in on the far side."""


class Terrain(Surfaced):
    """Ground from 0 to `width`, of columns that are equally wide: a wall through the middles of their tops.

    Without `heights` it is hills by midpoint displacement, from the scene's seed.
    """

    width: Annotated[float, Field(gt=0, le=1e6)]
    """m"""
    columns: Annotated[int, Field(ge=2, le=MAX_COLUMNS)] = 300
    """how many columns the ground is made of"""
    base: Level = 10.0
    """m, of the lowest column"""
    height: Level = 40.0
    """m, of the highest above the lowest"""
    roughness: Annotated[float, Field(ge=0, le=1)] = 0.3
    """0 for rolling hills, 1 for a saw: each halving of the distance leaves this power of 2 less to differ by"""
    heights: Annotated[tuple[Level, ...], Field(min_length=2, max_length=MAX_COLUMNS)] | None = None
    """m, of each column, instead of all that"""
    laid: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    """the seed that the wall `terrain` beside it was laid out from, as a scene says that was written out; whoever then
    sets another seed has the hills laid out anew"""


class Player(Part):
    """Someone with a tank."""

    name: Name
    """of the player, and of the box that the tank is"""
    position: Annotated[float, Field(ge=-1e6, le=1e6)]
    """of the tank along the ground, m; it stands on the ground there, which is levelled under it"""
    bot: Annotated[float, Field(ge=0, le=1)] | None = None
    """the skill of who aims by itself: 1 never errs; without one, a person plays"""
    colour: Colour | None = None
    """of the tank, `#rrggbb`"""


class Artillery(Part):
    """Players on a ground who take turns to shoot at each other.

    The ground is the wall `terrain`, the players' tanks are boxes of their names; a scene that has such boxes keeps
    them as they are.
    """

    players: Annotated[tuple[Player, ...], Field(min_length=2, max_length=10, alias="player")]
    """in the order of their turns"""
    edges: Edges = "open"
    """what a shell meets at the left and right end of the ground: nothing, the other end, or a wall"""
    wind: Annotated[float, Field(ge=0, le=100)] = 0.0
    """m/s; the wind of each turn is drawn anew, up to this to either side; 0 leaves the world's as it is"""
    speed: Annotated[float, Field(gt=0, le=1e4)] = 60.0
    """m/s, of a shell at full power"""
    rounds: Annotated[int, Field(ge=1, le=1000)] = 20
    """turns that each has at most"""
    money: Annotated[int, Field(ge=0, le=10**9)] = 1000
    """that each begins with"""
    tank: tuple[Annotated[float, Field(gt=0, le=1e3)], Annotated[float, Field(gt=0, le=1e3)]] = (3.0, 1.5)
    """width and height, m"""
    mass: Mass = 1000.0
    """kg, of a tank"""
    friction: Friction = 1.0
    """of a tank"""
    tracer: bool = False
    """show where a shot would go, which a gunner cannot see"""
