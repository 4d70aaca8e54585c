"""`[terrain]` and `[artillery]` of a scene file."""

from typing import Annotated, Literal

from pydantic import Field

from sandbox.scene.description.base import Colour, Friction, HasMaterial, Mass, Name, Part

MAX_COLUMNS = 5_000

Level = Annotated[float, Field(ge=0, le=1e6)]
"""A height above the ground's foot, m"""

Edges = Literal["open", "rubber", "wrap"]
"""What becomes of a shell at the sides of the ground: it leaves, it is thrown back, or it comes in on the far side."""


class Terrain(HasMaterial):
    """Ground from 0 to `width`, made of columns of equal width: a wall through the centres of their tops.

    Without `heights`, midpoint displacement makes random hills from the seed of the scene.
    """

    width: Annotated[float, Field(gt=0, le=1e6)]
    """m"""
    columns: Annotated[int, Field(ge=2, le=MAX_COLUMNS)] = 300
    """number of columns of the ground"""
    base: Level = 10.0
    """height of the lowest column, m"""
    height: Level = 40.0
    """height of the highest column above the lowest, m"""
    roughness: Annotated[float, Field(ge=0, le=1)] = 0.3
    """0 for smooth hills to 1 for jagged ones: each octave has 2^(roughness − 1) times the amplitude of the one
    before"""
    heights: Annotated[tuple[Level, ...], Field(min_length=2, max_length=MAX_COLUMNS)] | None = None
    """height of each column, m; replaces columns, base, height and roughness"""
    laid: Annotated[int, Field(ge=0, lt=2**63)] | None = None
    """seed from which the wall `terrain` was generated, in expanded scenes only; setting another seed generates new
    hills"""


class Player(Part):
    """A player with a tank."""

    name: Name
    """name of the player, and of the box that represents the tank"""
    position: Annotated[float, Field(ge=-1e6, le=1e6)]
    """position of the tank along the ground, m; the ground under it is levelled"""
    bot: Annotated[float, Field(ge=0, le=1)] | None = None
    """skill of a computer player, 1 for perfect aim; without it, a person plays"""
    colour: Colour | None = None
    """colour of the tank, `#rrggbb`"""


class Artillery(Part):
    """Players on a terrain who take turns to shoot at each other.

    The ground is the wall `terrain`; the tanks are boxes with the names of the players. Boxes with these names that the
    scene already has are kept.
    """

    players: Annotated[tuple[Player, ...], Field(min_length=2, max_length=10, alias="player")]
    """players in the order of their turns"""
    edges: Edges = "open"
    """behaviour of a shell at the left and right end of the ground: it flies on, reappears at the other end, or hits
    a wall"""
    wind: Annotated[float, Field(ge=0, le=100)] = 0.0
    """largest wind, m/s: each turn has a new random wind between −wind and wind; 0 keeps the wind of [world]"""
    speed: Annotated[float, Field(gt=0, le=1e4)] = 60.0
    """m/s, of a shell at full power"""
    rounds: Annotated[int, Field(ge=1, le=1000)] = 20
    """largest number of turns of each player"""
    money: Annotated[int, Field(ge=0, le=10**9)] = 1000
    """money of each player at the start"""
    tank: tuple[Annotated[float, Field(gt=0, le=1e3)], Annotated[float, Field(gt=0, le=1e3)]] = (3.0, 1.5)
    """width and height of a tank, m"""
    mass: Mass = 1000.0
    """mass of a tank, kg"""
    friction: Friction = 1.0
    """friction of a tank"""
    tracer: bool = False
    """show the predicted path of a shot"""
