"""Billiard tables: the `[billiards]` table of scene files, dimensions, sets of balls, cushions, and racks.

Dimensions are those of the governing bodies where their rules state them.

WPA: World Pool Association, Tournament Table and Equipment Specifications. BCA: Billiard Congress of America,
Equipment Specifications. WPBSA: World Professional Billiards and Snooker Association, Official Rules of Snooker,
section 1. UMB: Union Mondiale de Billard, World Rules of Carom Billiard, articles 11–13 and 23.

Cushions: a pocket is a gap between two cushions. Each cushion ends at a lip: its nose line and its facing, the line
that leads into the pocket, are joined by a jaw, a round post tangent to both. A facing ends where it meets the hole.

Racks: balls are on a triangular lattice. With a gap g, the pitch of the lattice is the ball diameter plus g/2, and each
ball is at random within g/4 of its lattice point. The gaps of neighbours are 0 to g, and no balls overlap.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from sandbox.scene.description.base import Friction, Mass, Name, Part, Point, Radius, Restitution, Vector
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.surface import Pocket

if TYPE_CHECKING:
    import numpy as np

TableGame = Literal["8-ball", "9-ball", "three-cushion", "straight-rail", "snooker", "free"]
"""games that are played on a table"""
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

NOSE_HEIGHT = 0.64
"""height of a cushion nose as a fraction of the ball diameter; WPA, height of the cushion: 62.5 to 64.5 %"""


@dataclass(frozen=True)
class PocketOpening:
    """Dimensions of a pocket: ends of its cushions, and hole; m and degrees."""

    mouth: float
    """width between the lips, where the lines of nose and facing meet, without rounding"""
    angle: float
    """angle of the rubber between nose and facing"""
    shelf: float
    """distance from the middle of the mouth to the edge of the hole"""
    radius: float
    """radius of the hole"""
    jaw: float
    """radius of the arc that rounds a lip, tangent to nose and facing"""


@dataclass(frozen=True)
class TableSpec:
    """Dimensions of a table: playing area between the noses, pockets, default ball set, and spots; m."""

    width: float
    length: float
    balls: str
    spots: dict[str, Point]
    corner: PocketOpening | None = None
    middle: PocketOpening | None = None


def _pool(length: float, corner: PocketOpening, middle: PocketOpening) -> TableSpec:
    """Return a table twice as long as wide. WPA: head and foot strings are a quarter of the length from the ends."""
    width = 0.5 * length
    return TableSpec(width, length, "pool", _strings(width, length), corner, middle)


def _strings(width: float, length: float) -> dict[str, Point]:
    along = {"head": 0.25, "centre": 0.5, "foot": 0.75}
    return {name: (0.5 * width, part * length) for name, part in along.items()}


# WPA, pocket openings: corner mouth 4.5 to 4.625 in, side mouth 5 to 5.125 in, cut 142° and 104°, shelf 1 to 2.25 in
# and 0 to 0.375 in. The mouths are the middle of these ranges. The corner shelf is chosen so that a ball aimed from the
# centre of the table at the centre of the hole clears the jaws. The rules state neither the size of the holes nor the
# rounding of the lips: holes are as wide as the mouths, and the jaws, 20.95 and 7.95 mm, were measured on a Showood
# table (Kiefl, pooltool).
WPA_CORNER = PocketOpening(4.5625 * INCH, 142.0, 1.125 * INCH, 2.28125 * INCH, 0.02095)
WPA_SIDE = PocketOpening(5.0625 * INCH, 104.0, 0.1875 * INCH, 2.53125 * INCH, 0.00795)

# BCA, which covers home tables too; the middle of each range: corner mouth 4.875 to 5.125 in, side mouth 5.375 to
# 5.625 in, cut 142° and 103°, shelf 1.625 to 1.875 in and 0 to 0.375 in.
BCA_CORNER = PocketOpening(5.0 * INCH, 142.0, 1.75 * INCH, 2.5 * INCH, 0.02095)
BCA_SIDE = PocketOpening(5.5 * INCH, 103.0, 0.1875 * INCH, 2.75 * INCH, 0.00795)

# WPBSA: the openings "conform to the templates authorised", which are not published. Facings here are parallel, 85 mm
# apart at the corners and 87 mm in the middle, close to reported dimensions of tables in play. The jaws are long arcs,
# 3.6 and 2.5 in, and the corner holes begin 36 mm behind the mouth (Kiefl, pooltool's generic table), the middle holes
# at the nose line.
SNOOKER_CORNER = PocketOpening(0.085, 135.0, 0.036, 0.0430, 3.6 * INCH)
SNOOKER_MIDDLE = PocketOpening(0.087, 90.0, 0.0, 0.0445, 2.5 * INCH)


def _snooker_table() -> TableSpec:
    """WPBSA 1: 3,569 × 1,778 mm; baulk line at 737 mm, D of 292 mm; black 324 mm from the top cushion."""
    width, length, baulk, d = 1.778, 3.569, 0.737, 0.292
    middle = 0.5 * width
    spots = {
        "yellow": (middle + d, baulk),  # on the right, seen from baulk
        "green": (middle - d, baulk),
        "brown": (middle, baulk),
        "blue": (middle, 0.5 * length),
        "pink": (middle, 0.75 * length),  # midway between the centre spot and the face of the top cushion
        "black": (middle, length - 0.324),
    }
    return TableSpec(width, length, "snooker", spots, SNOOKER_CORNER, SNOOKER_MIDDLE)


def _carom() -> TableSpec:
    """UMB 11: 2.84 × 1.42 m. UMB 13: spots on the long axis, and two spots 182.5 mm to either side of the head spot."""
    width, length = 1.42, 2.84
    spots = _strings(width, length)
    (x, y), sideways = spots["head"], 0.1825
    return TableSpec(width, length, "carom", {**spots, "head-left": (x - sideways, y), "head-right": (x + sideways, y)})


TABLES: dict[TableName, TableSpec] = {
    "pool-7ft": _pool(78.0 * INCH, BCA_CORNER, BCA_SIDE),  # BCA: 78 × 39 in for a full-size 7 ft table
    "pool-8ft": _pool(92.0 * INCH, WPA_CORNER, WPA_SIDE),  # WPA, playing surface: 92 × 46 in
    "pool-9ft": _pool(100.0 * INCH, WPA_CORNER, WPA_SIDE),  # WPA, playing surface: 100 × 50 in
    "snooker-12ft": _snooker_table(),
    "carom-10ft": _carom(),
}


WHITE = "#f4f1e6"


@dataclass(frozen=True)
class BallSet:
    """Set of balls of one game, equal except for name and colour."""

    radius: float
    """m"""
    mass: float
    """kg"""
    colours: dict[str, str]
    """colours by name; the first ball is the cue ball"""
    nose: float | None = None
    """height of the cushion noses, m, if the rules state it as a length; default: `NOSE_HEIGHT` times the diameter"""
    sliding: float = 0.2
    rolling: float = 0.01
    spinning: float = 0.444
    """spinning friction per radius, 1/m: μ_sp = 0.444 R, so that a spin about z decays by 10.9 rad/s each second"""


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
    """Return a solid's colour lightened halfway to white, because a disc of one colour cannot show a stripe."""
    parts = [(int(colour[k : k + 2], 16) + int(WHITE[k : k + 2], 16)) // 2 for k in (1, 3, 5)]
    return "#" + "".join(f"{part:02x}" for part in parts)


POOL = BallSet(
    # WPA, balls: 2.25 in; 5.5 to 6 oz, here 6 oz as in most sets
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
    # WPBSA 2: 52.5 mm, weights equal to within 3 g. It states no weight; balls weigh about 140 g
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
"""Spots that each rack needs."""

RACK_BALLS: dict[RackName, str] = {"8-ball": "pool", "9-ball": "pool", "snooker": "snooker", "carom": "carom"}
"""Ball set of each rack."""


CUSHION_MATERIAL = "cushion"

CUSHIONS = (
    "lower cushion",
    "lower right cushion",
    "upper right cushion",
    "upper cushion",
    "upper left cushion",
    "lower left cushion",
)
"""Names of cushions, anticlockwise; cushion k follows pocket k."""

UP, DOWN, LEFT, RIGHT = (0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0)


@dataclass(frozen=True)
class PocketLip:
    """End of a cushion at a pocket: unit vectors along the cushion from the pocket, and out of the playing area."""

    along: Vector
    out: Vector


@dataclass(frozen=True)
class PocketHole:
    """Position of a pocket on the nose lines of its two cushions, and its lips, anticlockwise around the table."""

    name: str
    at: Point
    lips: tuple[PocketLip, PocketLip]
    opening: PocketOpening


@dataclass(frozen=True)
class TableColliders:
    """Static bodies and pockets of a table."""

    walls: tuple[Wall, ...]
    posts: tuple[Post, ...]
    pockets: tuple[Pocket, ...]


def static_colliders(table: TableSpec, nose: float) -> TableColliders:
    """Return the cushions and pockets of a table.

    Args:
        table: dimensions of the table.
        nose: height of the cushion noses, m.
    """
    holes = _holes(table)
    if not holes:
        return TableColliders(_rectangle(table, nose), (), ())
    walls: list[Wall] = []
    for k, name in enumerate(CUSHIONS):
        hole, next_hole = holes[k], holes[(k + 1) % len(holes)]
        walls.append(_wall(name, (_nose_end(hole, hole.lips[1]), _nose_end(next_hole, next_hole.lips[0])), nose))
    posts: list[Post] = []
    for hole in holes:
        for number, lip in enumerate(hole.lips, 1):
            jaw = f"{hole.name} jaw {number}"
            radius = hole.opening.jaw
            centre = _displaced(_nose_end(hole, lip), lip.out, radius)
            posts.append(Post(name=jaw, position=centre, radius=radius, height=nose, material=CUSHION_MATERIAL))
            ends = _facing(hole, lip)
            if ends is not None:
                walls.append(_wall(f"{hole.name} facing {number}", ends, nose))
    pockets = tuple(Pocket(name=h.name, position=_centre(h), radius=h.opening.radius) for h in holes)
    return TableColliders(tuple(walls), tuple(posts), pockets)


def _holes(table: TableSpec) -> tuple[PocketHole, ...]:
    """Return the pockets of a table, anticlockwise from the lower left."""
    if table.corner is None or table.middle is None:
        return ()
    w, length, corner, middle = table.width, table.length, table.corner, table.middle
    half = 0.5 * length
    return (
        PocketHole("lower left pocket", (0.0, 0.0), (PocketLip(UP, LEFT), PocketLip(RIGHT, DOWN)), corner),
        PocketHole("lower right pocket", (w, 0.0), (PocketLip(LEFT, DOWN), PocketLip(UP, RIGHT)), corner),
        PocketHole("right pocket", (w, half), (PocketLip(DOWN, RIGHT), PocketLip(UP, RIGHT)), middle),
        PocketHole("upper right pocket", (w, length), (PocketLip(DOWN, RIGHT), PocketLip(LEFT, UP)), corner),
        PocketHole("upper left pocket", (0.0, length), (PocketLip(RIGHT, UP), PocketLip(DOWN, LEFT)), corner),
        PocketHole("left pocket", (0.0, half), (PocketLip(UP, LEFT), PocketLip(DOWN, LEFT)), middle),
    )


def _rectangle(table: TableSpec, nose: float) -> tuple[Wall, ...]:
    w, length = table.width, table.length
    corners = ((0.0, 0.0), (w, 0.0), (w, length), (0.0, length))
    names = ("lower cushion", "right cushion", "upper cushion", "left cushion")
    return tuple(_wall(name, (corners[k], corners[(k + 1) % 4]), nose) for k, name in enumerate(names))


def _wall(name: str, ends: tuple[Point, Point], nose: float) -> Wall:
    return Wall(name=name, points=ends, height=nose, material=CUSHION_MATERIAL)


def _lip(hole: PocketHole, lip: PocketLip) -> Point:
    """Return the intersection of the lines of nose and facing, m."""
    (ax, ay), (bx, by) = (each.along for each in hole.lips)
    half_angle = 0.5 * math.acos(ax * bx + ay * by)  # between the pocket's axis and its nose lines
    return _displaced(hole.at, lip.along, 0.5 * hole.opening.mouth / math.sin(half_angle))


def _rounded(opening: PocketOpening) -> float:
    """Return the distance from a lip to the points where the jaw is tangent to nose and facing, m."""
    return opening.jaw * math.tan(0.5 * math.radians(180.0 - opening.angle))


def _nose_end(hole: PocketHole, lip: PocketLip) -> Point:
    return _displaced(_lip(hole, lip), lip.along, _rounded(hole.opening))


def _centre(hole: PocketHole) -> Point:
    """Return the centre of the hole, m, straight out from the middle of the mouth."""
    (ax, ay), (bx, by) = (_lip(hole, lip) for lip in hole.lips)
    x, y = (sum(lip.out[k] for lip in hole.lips) for k in (0, 1))
    size = math.hypot(x, y)
    return _displaced(
        (0.5 * (ax + bx), 0.5 * (ay + by)), (x / size, y / size), hole.opening.shelf + hole.opening.radius
    )


def _facing(hole: PocketHole, lip: PocketLip) -> tuple[Point, Point] | None:
    """Return the ends of a facing, from the jaw to the hole, m; None if the jaw itself reaches the hole."""
    turn = math.radians(hole.opening.angle)
    (ax, ay), (ox, oy) = lip.along, lip.out
    cos, sin = math.cos(turn), math.sin(turn)
    direction = (ax * cos + ox * sin, ay * cos + oy * sin)
    (x, y), (px, py) = _lip(hole, lip), _centre(hole)
    toward = (px - x) * direction[0] + (py - y) * direction[1]
    sideways = (px - x) * direction[1] - (py - y) * direction[0]
    length = toward - math.sqrt(hole.opening.radius**2 - sideways**2)
    start = _rounded(hole.opening)
    return (_displaced((x, y), direction, start), _displaced((x, y), direction, length)) if length > start else None


def _displaced(point: Point, direction: Vector, distance: float) -> Point:
    return point[0] + direction[0] * distance, point[1] + direction[1] * distance


RACK_GAP = 1e-10
"""m: gap between racked balls that touch; small enough to count as touching, larger than rounding errors"""

CUE_BALL_OFFSET = 0.1825
"""m: distance from the head spot to the cue ball at the start of a carom game (UMB 13)"""

BREAK_FRACTION = 0.5
"""position of the cue ball for the break-off, as a fraction of the line from brown to yellow"""


def rack_positions(rack: RackName, spots: dict[str, Point], radius: float, gap: float, seed: int) -> dict[str, Point]:
    """Return the positions of the balls of a rack by name, m.

    Args:
        rack: name of the rack.
        spots: spots of the table, m; at least those that the rack needs.
        radius: radius of the balls, m.
        gap: largest gap between neighbours, m.
        seed: seed of the scene.
    """
    from sandbox.scene.random_streams import Stream, draws  # imports numpy, which the models must not

    random = draws(Stream.RACK, seed)
    match rack:
        case "8-ball":
            return {"cue": spots["head"], **_pyramid(_eight_ball(random), spots, radius, gap, random)}
        case "9-ball":
            return {"cue": spots["head"], **_pyramid(_nine_ball(random), spots, radius, gap, random)}
        case "snooker":
            return _snooker_rack(spots, radius, gap, random)
        case "carom":
            (x, y), along = spots["head"], _unit_vector(spots["head"], spots["foot"])
            white = (x + along[1] * CUE_BALL_OFFSET, y - along[0] * CUE_BALL_OFFSET)
            return {"white": white, "yellow": spots["head"], "red": spots["foot"]}
        case "none":
            return {}


def _eight_ball(random: np.random.Generator) -> list[list[str]]:
    """WPA, 8-ball rack: the 8 in the middle, a ball of each group in the rear corners, the others shuffled."""
    solids, stripes = _shuffled(range(2, 8), random), _shuffled(range(9, 16), random)
    corners = _shuffled((solids.pop(), stripes.pop()), random)
    rest = _shuffled((*solids, *stripes), random)
    order = [1, *rest[:3], 8, *rest[3:8], corners[0], *rest[8:], corners[1]]
    return _rows(order, (1, 2, 3, 4, 5))


def _nine_ball(random: np.random.Generator) -> list[list[str]]:
    """WPA, 9-ball rack: a diamond, the 1 at the top on the foot spot, the 9 in the middle, the others shuffled."""
    rest = _shuffled(range(2, 9), random)
    return _rows([1, *rest[:3], 9, *rest[3:]], (1, 2, 3, 2, 1))


def _snooker_rack(spots: dict[str, Point], radius: float, gap: float, random: np.random.Generator) -> dict[str, Point]:
    """WPBSA, position of balls: colours on their spots, reds in a triangle behind the pink, near but not touching."""
    along = _unit_vector(spots["blue"], spots["pink"])
    begin = _shifted(spots["pink"], along, 2.0 * radius + max(gap, 1e-3))
    reds = _rows(range(1, 16), (1, 2, 3, 4, 5))
    positions = _lattice([[f"red-{number}" for number in row] for row in reds], begin, along, radius, gap, random)
    (bx, by), (yx, yy) = spots["brown"], spots["yellow"]
    cue = (bx + BREAK_FRACTION * (yx - bx), by + BREAK_FRACTION * (yy - by))
    return {"cue": cue, **positions, **{name: spots[name] for name in RACK_SPOTS["snooker"]}}


def _pyramid(
    rows: list[list[str]], spots: dict[str, Point], radius: float, gap: float, random: np.random.Generator
) -> dict[str, Point]:
    return _lattice(rows, spots["foot"], _unit_vector(spots["head"], spots["foot"]), radius, gap, random)


def _lattice(
    rows: list[list[str]], begin: Point, along: Vector, radius: float, gap: float, random: np.random.Generator
) -> dict[str, Point]:
    """Return the positions of rows of balls, the first row at `begin`, the others behind it along `along`, m."""
    pitch, max_shift = 2.0 * radius + max(0.5 * gap, RACK_GAP), 0.25 * gap
    positions: dict[str, Point] = {}
    for k, row in enumerate(rows):
        for n, name in enumerate(row):
            forward, sideways = k * pitch * math.sqrt(0.75), (n - 0.5 * (len(row) - 1)) * pitch
            shift, turn = max_shift * math.sqrt(random.random()), 2.0 * math.pi * random.random()
            forward, sideways = forward + shift * math.cos(turn), sideways + shift * math.sin(turn)
            positions[name] = (
                begin[0] + along[0] * forward - along[1] * sideways,
                begin[1] + along[1] * forward + along[0] * sideways,
            )
    return positions


def _rows(order: list[int] | range, sizes: tuple[int, ...]) -> list[list[str]]:
    names = [str(number) for number in order]
    return [[names.pop(0) for _ in range(size)] for size in sizes]


def _shuffled(numbers: range | tuple[int, ...], random: np.random.Generator) -> list[int]:
    """Return numbers in random order. Only uniform doubles are drawn, because numpy keeps their stream stable."""
    return [number for _, number in sorted((float(random.random()), number) for number in numbers)]


def _unit_vector(begin: Point, end: Point) -> Vector:
    size = math.dist(begin, end)
    return (end[0] - begin[0]) / size, (end[1] - begin[1]) / size


def _shifted(point: Point, direction: Vector, distance: float) -> Point:
    return point[0] + direction[0] * distance, point[1] + direction[1] * distance
