"""`[play]`: view, named spots, markings, and the roles of elements in a game."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from sandbox.game_names import game_names, is_game
from sandbox.scene.description.base import (
    Accepts,
    Colour,
    Coordinates,
    Items,
    Name,
    OptionalPoint,
    Part,
    Point,
    PointField,
    Radius,
    Velocity,
    default,
)
from sandbox.scene.description.game_tables import with_game_tables

MIN_PLAYBACK_SPEED, MAX_PLAYBACK_SPEED = 1e-9, 10.0
PlaybackSpeed = Annotated[float, Field(ge=MIN_PLAYBACK_SPEED, le=MAX_PLAYBACK_SPEED)]
LineWidth = Annotated[float, Field(ge=0, le=1e9)]


class Marking(Part):
    """A disc, ring, polygon or line that is drawn below all other objects, in the order of the file."""

    colour: Colour
    """`#rrggbb`"""
    position: OptionalPoint = default(None)
    """centre of a disc or ring, m"""
    radius: Radius | None = None
    """radius of a disc or ring, m"""
    points: Accepts[Annotated[tuple[Point, ...], Field(max_length=10_000)], Coordinates] = default(())
    """points of a line, or corners of a polygon, m"""
    filled: bool = True
    """true for a disc or polygon, false for a ring or line"""
    width: LineWidth = 0.0
    """width of a ring or line, m; always drawn at least one pixel wide"""


def marking_fault(marking: Marking) -> str | None:
    """Return the reason why a marking is not a valid shape, or None."""
    of_circle = marking.position is not None or marking.radius is not None
    if bool(marking.points) == of_circle:
        return "must have either `position` and `radius` (a circle) or `points` (a polygon or line)"
    if of_circle:
        return None if marking.position and marking.radius else "must have both `position` and `radius`"
    required, kind = (3, "a polygon") if marking.filled else (2, "a line")
    if len(marking.points) < required:
        return f"is {kind} and needs at least {required} points, has {len(marking.points)}"
    return None


Role = Literal[
    "ball", "bumper", "drain", "drop", "flipper", "gate", "kicker", "plunger", "ramp", "rollover", "slingshot",
    "spinner", "standup",
]  # fmt: skip


class PlayPart(Part):
    """The role of a body, wall, post, zone or drive in the rules of a game.

    Parts with the same `group` belong together: a bank of targets, the top lanes, the lock holes, entry and exit of a
    ramp. Rules may ignore the `score` of drives and of parts that only guide the ball, such as gates.
    """

    name: Name
    """name of the body, fixed object, zone or drive"""
    role: Role
    """role in the rules, such as a bumper or a drain"""
    group: Name | None = None
    """group that it belongs to: a bank, a set of lanes, a ramp; for a flipper the side, `left` or `right`"""
    step: Annotated[int, Field(ge=0, le=1000)] = 0
    """position in an ordered group: 0 for the entry of a ramp, 1 for its exit; targets and lanes count from the left"""
    score: Annotated[int, Field(ge=0, le=10**12)] = 0
    """points each time it is hit, entered or turned"""
    at: OptionalPoint = default(None)
    """position where it places a ball, such as the plunger lane or the start of a ball, m"""
    out: Accepts[Velocity | None, Sequence[float] | None] = default(None)
    """velocity of a ball that it releases, such as from a kicker, m/s"""
    light: OptionalPoint = default(None)
    """position of the lamp that shows whether it is lit, m"""
    colour: Colour | None = None
    """colour of the lamp"""


class _GameName:
    """Annotation of the name of a game, which the package `games` or another package provides."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_check_game)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return {"enum": list(game_names()), "type": "string"}


def _check_game(name: Any) -> str:
    if isinstance(name, str) and is_game(name):
        return name
    *others, last = map(repr, game_names())
    raise PydanticKnownError("literal_error", {"expected": f"{', '.join(others)} or {last}"})


class Spot(Part):
    """A named point of a table: `head`, `foot`, `centre`, and in snooker the spots of the colours."""

    name: Name
    """name used by the rules"""
    position: PointField
    """position, m"""


@with_game_tables("play")
class _Header(Part):
    """First fields of `[play]`, in the order of a file; the tables of games come next."""

    arrows: Name | None = None
    """name of a body that the arrow keys move"""
    arrow_step: Annotated[float, Field(gt=0, le=1e9)] = 0.5
    """distance that one key press moves it, m"""
    relaunch: Name | None = None
    """name of a generator whose bodies the Space key starts again with new random values"""
    speed: PlaybackSpeed | None = None
    """playback speed in the window at the start, as a multiple of real time; default: 1, or less, so that a scene
    without controls lasts at least 3 s"""
    show: Literal["overlap"] | None = None
    """Colour bodies that overlap something."""
    game: Annotated[str, _GameName()] | None = None
    """game whose rules apply, in the window and in runs; runs of a table need a player for that"""
    area: Accepts[tuple[Point, Point] | None, Coordinates | None] = default(None)
    """lower left and upper right corner of the playing area of a table, m"""
    view: Accepts[tuple[Point, Point] | None, Coordinates | None] = default(None)
    """lower left and upper right corner of the initial view, m; default: the area that the bodies may reach"""
    inset: Accepts[tuple[Point, Point] | None, Coordinates | None] = default(None)
    """lower left and upper right corner of an area that is also shown enlarged in a corner of the picture, m"""
    spots: Items[Spot] = default((), alias="spot")


class Play(_Header):
    """Settings of the window and the game. Engines ignore them; runs depend on the rules of the game only."""

    markings: Items[Marking] = default((), alias="marking")
    players: Annotated[int, Field(ge=1, le=4)] = 1
    """number of players who take turns, in games such as pinball"""
    parts: Items[PlayPart] = default((), alias="part")
    """roles of bodies, walls, posts, zones and drives in the rules of the game"""
    ground: Literal["grid", "playfield"] = "grid"
    """background: a grid, or a playfield of markings on which fixed objects cast shadows and zones with a colour are
    visible"""
