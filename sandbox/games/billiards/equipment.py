"""`[billiards]`, dimensions of tables, and sets of balls.

Tables: their figures, each from a governing body's rules where these give one.

WPA: World Pool Association, Tournament Table and Equipment Specifications. BCA: Billiard Congress of America,
Equipment Specifications. WPBSA: World Professional Billiards and Snooker Association, Official Rules of Snooker,
section 1. UMB: Union Mondiale de Billard, World Rules of Carom Billiard, articles 11–13 and 23.
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from sandbox.games.names import TableGame
from sandbox.scene.description.base import Friction, Mass, Name, Part, Point, Radius, Restitution

TableName = Literal["pool-7ft", "pool-8ft", "pool-9ft", "snooker-12ft", "carom-10ft"]
RackName = Literal["8-ball", "9-ball", "snooker", "carom", "none"]


class Billiards(Part):
    """A billiard table by name, a rack of balls, and the game of the window; it is expanded to primitives.

    Other tables of the scene file take precedence: a ball, wall or pocket of the same name, a key of `[surface]`,
    `[contact_models]`, `[world]`, `[solver]` or `[play]`, a material or a pair. The origin is the corner of the table
    at the cushion noses; x runs along the width, y along the length towards the rack.
    """

    table: TableName | None = None
    """name of the table; without it, the scene's own walls, posts and pockets are the table, and its `[[play.spot]]`s
    the spots for racking"""
    game: TableGame = "free"
    """game that the window plays"""
    rack: RackName | None = None
    """rack of balls; default: the rack of the game"""
    gap: Annotated[float, Field(ge=0, le=0.1)] = 1e-4
    """largest gap between racked neighbours, m, random by the seed; 0 for touching balls"""
    place: dict[Name, Point] = Field(default_factory=dict)
    """positions of balls of the set by name, m, in place of their racked positions or in addition to the rack"""
    ball_radius: Radius | None = None
    """m; default: the radius of the set"""
    ball_mass: Mass | None = None
    """kg"""
    ball_restitution: Restitution = 0.95
    """restitution of two balls; they collide without friction unless `[contact_models]` says otherwise"""
    cushion_restitution: Restitution = 0.85
    """restitution of the cushions, 0 to 1"""
    cushion_friction: Friction = 0.2
    """Coulomb friction μ of the cushions"""
    nose: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """height of the cushion noses above the floor, m"""


INCH = 0.0254  # m

NOSE = 0.64
"""of a ball's diameter, the height of a cushion's nose: WPA, height of the cushion, asks for 62.5 to 64.5 %"""


@dataclass(frozen=True)
class Opening:
    """How cushions end at a pocket, and the hole behind; m and degrees."""

    mouth: float
    """between the lips, where the lines of nose and facing would meet if they were not rounded"""
    angle: float
    """of the rubber, between nose and facing"""
    shelf: float
    """from the middle of the mouth to the edge of the hole"""
    radius: float
    """of the hole"""
    jaw: float
    """radius of the arc, tangent to nose and facing, that rounds a lip"""


@dataclass(frozen=True)
class Table:
    """A table: playing area between the noses, openings, the balls that are played on it, and spots; m."""

    width: float
    length: float
    balls: str
    spots: dict[str, Point]
    corner: Opening | None = None
    middle: Opening | None = None


def _pool(length: float, corner: Opening, middle: Opening) -> Table:
    """Return a table twice as long as wide. WPA: head and foot strings lie a quarter of the length from the ends."""
    width = 0.5 * length
    return Table(width, length, "pool", _strings(width, length), corner, middle)


def _strings(width: float, length: float) -> dict[str, Point]:
    along = {"head": 0.25, "centre": 0.5, "foot": 0.75}
    return {name: (0.5 * width, part * length) for name, part in along.items()}


# WPA, pocket openings: corner mouth 4.5 to 4.625 in, side mouth 5 to 5.125 in, cut 142° and 104°, shelf 1 to 2.25 in
# and 0 to 0.375 in. Mouths are in the middle of that; the shelf at the corner lets a ball that is aimed at the hole's
# middle from the table's pass the jaws. The rules give neither hole nor how round a lip is: holes are as wide as the
# mouths, and the jaws, 20.95 and 7.95 mm, were measured on a Showood table (Kiefl, pooltool).
WPA_CORNER = Opening(4.5625 * INCH, 142.0, 1.125 * INCH, 2.28125 * INCH, 0.02095)
WPA_SIDE = Opening(5.0625 * INCH, 104.0, 0.1875 * INCH, 2.53125 * INCH, 0.00795)

# BCA, for home tables too, the middle of what it allows: corner mouth 4.875 to 5.125 in, side mouth 5.375 to 5.625 in,
# cut 142° and 103°, shelf 1.625 to 1.875 in and 0 to 0.375 in.
BCA_CORNER = Opening(5.0 * INCH, 142.0, 1.75 * INCH, 2.5 * INCH, 0.02095)
BCA_SIDE = Opening(5.5 * INCH, 103.0, 0.1875 * INCH, 2.75 * INCH, 0.00795)

# WPBSA: the openings "conform to the templates authorised", which are not published. Taken are facings that are
# parallel, 85 mm apart at the corners and 87 mm in the middle, about what is told of tables in play; long arcs as jaws,
# of 3.6 and 2.5 in, and falls 36 mm behind the mouth (Kiefl, pooltool's generic table), in the middle at the nose line.
SNOOKER_CORNER = Opening(0.085, 135.0, 0.036, 0.0430, 3.6 * INCH)
SNOOKER_MIDDLE = Opening(0.087, 90.0, 0.0, 0.0445, 2.5 * INCH)


def _snooker() -> Table:
    """WPBSA 1: 3,569 × 1,778 mm; baulk line at 737 mm, D of 292 mm; black 324 mm from the top cushion."""
    width, length, baulk, d = 1.778, 3.569, 0.737, 0.292
    middle = 0.5 * width
    spots = {
        "yellow": (middle + d, baulk),  # on the right as seen from baulk
        "green": (middle - d, baulk),
        "brown": (middle, baulk),
        "blue": (middle, 0.5 * length),
        "pink": (middle, 0.75 * length),  # midway between the centre spot and the face of the top cushion
        "black": (middle, length - 0.324),
    }
    return Table(width, length, "snooker", spots, SNOOKER_CORNER, SNOOKER_MIDDLE)


def _carom() -> Table:
    """UMB 11: 2.84 × 1.42 m. UMB 13: spots on the long axis, and two 182.5 mm to the sides of the head spot."""
    width, length = 1.42, 2.84
    spots = _strings(width, length)
    (x, y), aside = spots["head"], 0.1825
    return Table(width, length, "carom", {**spots, "head-left": (x - aside, y), "head-right": (x + aside, y)})


TABLES: dict[TableName, Table] = {
    "pool-7ft": _pool(78.0 * INCH, BCA_CORNER, BCA_SIDE),  # BCA: 78 × 39 in of a 7 ft table of full size
    "pool-8ft": _pool(92.0 * INCH, WPA_CORNER, WPA_SIDE),  # WPA, playing surface: 92 × 46 in
    "pool-9ft": _pool(100.0 * INCH, WPA_CORNER, WPA_SIDE),  # WPA, playing surface: 100 × 50 in
    "snooker-12ft": _snooker(),
    "carom-10ft": _carom(),
}


def spots_of(table: TableName) -> dict[str, Point]:
    """Return the spots of a table by name, m."""
    return dict(TABLES[table].spots)


WHITE = "#f4f1e6"


@dataclass(frozen=True)
class BallSet:
    """Balls that are played with each other, all alike but for name and colour."""

    radius: float
    """m"""
    mass: float
    """kg"""
    colours: dict[str, str]
    """by name; the first is struck"""
    nose: float | None = None
    """height of the cushions' noses where rules state it in itself, m"""
    sliding: float = 0.2
    rolling: float = 0.01
    spinning: float = 0.444
    """of the radius, 1/m: μ_sp = 0.444 R, so that every ball loses 10.9 rad/s of its spin about z each second"""


SOLIDS = {
    "1": "#f0c020",
    "2": "#1c4fa0",
    "3": "#d02424",
    "4": "#5b2a86",
    "5": "#ee7420",
    "6": "#12703c",
    "7": "#7c1e26",
}


def _striped(colour: str) -> str:
    """Return a solid's colour lightened halfway to white: a disc of one colour can have no stripe."""
    parts = [(int(colour[k : k + 2], 16) + int(WHITE[k : k + 2], 16)) // 2 for k in (1, 3, 5)]
    return "#" + "".join(f"{part:02x}" for part in parts)


POOL = BallSet(
    # WPA, balls: 2.25 in; 5.5 to 6 oz, here the 6 of which most sets are
    radius=0.028575,
    mass=0.170097,
    colours={
        "cue": WHITE,
        **SOLIDS,
        "8": "#2a2a2e",
        **{str(int(name) + 8): _striped(colour) for name, colour in SOLIDS.items()},
    },
)

SNOOKER = BallSet(
    # WPBSA 2: 52.5 mm, all of equal weight to 3 g, which it does not give; sets weigh about 140 g
    radius=0.02625,
    mass=0.140,
    colours={
        "cue": WHITE,
        **{f"red-{number}": "#b81f24" for number in range(1, 16)},
        "yellow": "#f0d020",
        "green": "#0e7a3e",
        "brown": "#7a4a22",
        "blue": "#1f5fb8",
        "pink": "#f08fb0",
        "black": "#2a2a2e",
    },
)

CAROM = BallSet(
    # UMB 12: 61 to 61.5 mm, 205 to 220 g; UMB 11: noses 37 mm high
    radius=0.03075,
    mass=0.210,
    colours={"white": WHITE, "yellow": "#f0d020", "red": "#c8201f"},
    nose=0.037,
)

BALLS = {"pool": POOL, "snooker": SNOOKER, "carom": CAROM}

RACK_SPOTS: dict[RackName, tuple[str, ...]] = {
    "8-ball": ("head", "foot"),
    "9-ball": ("head", "foot"),
    "snooker": ("yellow", "green", "brown", "blue", "pink", "black"),
    "carom": ("head", "foot"),
    "none": (),
}
"""The spots that place the balls of each rack."""

RACK_BALLS: dict[RackName, str] = {"8-ball": "pool", "9-ball": "pool", "snooker": "snooker", "carom": "carom"}
"""The set of balls of each rack."""
