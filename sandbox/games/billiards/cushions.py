"""Cushions: the walls, jaws and pockets of a table.

A pocket cuts two cushions. Each ends at a lip: its nose line and its facing, the line that leads into the pocket, are
rounded into each other by a jaw, a post tangent to both. A facing ends where it meets the hole.
"""

import math
from dataclasses import dataclass

from sandbox.games.billiards.equipment import Opening, Table
from sandbox.scene.description.base import Point, Vector
from sandbox.scene.description.fixed import Post, Wall
from sandbox.scene.description.surface import Pocket

MATERIAL = "cushion"

CUSHIONS = (
    "lower cushion",
    "lower right cushion",
    "upper right cushion",
    "upper cushion",
    "upper left cushion",
    "lower left cushion",
)
"""Anti-clockwise, each after the pocket of the same number."""

UP, DOWN, LEFT, RIGHT = (0.0, 1.0), (0.0, -1.0), (-1.0, 0.0), (1.0, 0.0)


@dataclass(frozen=True)
class Lip:
    """One end of a cushion: which way the cushion runs from there, and which way is out of the playing area."""

    along: Vector
    out: Vector


@dataclass(frozen=True)
class Hole:
    """A pocket's place: where its two nose lines meet, and its lips, anti-clockwise around the table."""

    name: str
    at: Point
    lips: tuple[Lip, Lip]
    opening: Opening


@dataclass(frozen=True)
class StaticColliders:
    """What of a table is fixed."""

    walls: tuple[Wall, ...]
    posts: tuple[Post, ...]
    pockets: tuple[Pocket, ...]


def static_colliders(table: Table, nose: float) -> StaticColliders:
    """Lay out the cushions and pockets of a table.

    Args:
        table: its figures.
        nose: height of the cushions' noses, m.
    """
    holes = _holes(table)
    if not holes:
        return StaticColliders(_rectangle(table, nose), (), ())
    walls: list[Wall] = []
    for k, name in enumerate(CUSHIONS):
        here, there = holes[k], holes[(k + 1) % len(holes)]
        walls.append(_wall(name, (_nose_end(here, here.lips[1]), _nose_end(there, there.lips[0])), nose))
    posts: list[Post] = []
    for hole in holes:
        for number, lip in enumerate(hole.lips, 1):
            jaw = f"{hole.name} jaw {number}"
            radius = hole.opening.jaw
            centre = _moved(_nose_end(hole, lip), lip.out, radius)
            posts.append(Post(name=jaw, position=centre, radius=radius, height=nose, material=MATERIAL))
            ends = _facing(hole, lip)
            if ends is not None:
                walls.append(_wall(f"{hole.name} facing {number}", ends, nose))
    pockets = tuple(Pocket(name=h.name, position=_centre(h), radius=h.opening.radius) for h in holes)
    return StaticColliders(tuple(walls), tuple(posts), pockets)


def _holes(table: Table) -> tuple[Hole, ...]:
    """Return the pockets of a table, anti-clockwise from the lower left."""
    if table.corner is None or table.middle is None:
        return ()
    w, length, corner, middle = table.width, table.length, table.corner, table.middle
    half = 0.5 * length
    return (
        Hole("lower left pocket", (0.0, 0.0), (Lip(UP, LEFT), Lip(RIGHT, DOWN)), corner),
        Hole("lower right pocket", (w, 0.0), (Lip(LEFT, DOWN), Lip(UP, RIGHT)), corner),
        Hole("right pocket", (w, half), (Lip(DOWN, RIGHT), Lip(UP, RIGHT)), middle),
        Hole("upper right pocket", (w, length), (Lip(DOWN, RIGHT), Lip(LEFT, UP)), corner),
        Hole("upper left pocket", (0.0, length), (Lip(RIGHT, UP), Lip(DOWN, LEFT)), corner),
        Hole("left pocket", (0.0, half), (Lip(UP, LEFT), Lip(DOWN, LEFT)), middle),
    )


def _rectangle(table: Table, nose: float) -> tuple[Wall, ...]:
    w, length = table.width, table.length
    corners = ((0.0, 0.0), (w, 0.0), (w, length), (0.0, length))
    names = ("lower cushion", "right cushion", "upper cushion", "left cushion")
    return tuple(_wall(name, (corners[k], corners[(k + 1) % 4]), nose) for k, name in enumerate(names))


def _wall(name: str, ends: tuple[Point, Point], nose: float) -> Wall:
    return Wall(name=name, points=ends, height=nose, material=MATERIAL)


def _lip(hole: Hole, lip: Lip) -> Point:
    """Return where the lines of nose and facing meet."""
    (ax, ay), (bx, by) = (each.along for each in hole.lips)
    half_angle = 0.5 * math.acos(ax * bx + ay * by)  # between the pocket's axis and its nose lines
    return _moved(hole.at, lip.along, 0.5 * hole.opening.mouth / math.sin(half_angle))


def _rounded(opening: Opening) -> float:
    """Return how far from a lip the jaw touches nose and facing, m."""
    return opening.jaw * math.tan(0.5 * math.radians(180.0 - opening.angle))


def _nose_end(hole: Hole, lip: Lip) -> Point:
    return _moved(_lip(hole, lip), lip.along, _rounded(hole.opening))


def _centre(hole: Hole) -> Point:
    """Return the middle of the hole: straight out from the middle of the mouth."""
    (ax, ay), (bx, by) = (_lip(hole, lip) for lip in hole.lips)
    x, y = (sum(lip.out[k] for lip in hole.lips) for k in (0, 1))
    size = math.hypot(x, y)
    return _moved((0.5 * (ax + bx), 0.5 * (ay + by)), (x / size, y / size), hole.opening.shelf + hole.opening.radius)


def _facing(hole: Hole, lip: Lip) -> tuple[Point, Point] | None:
    """Return the ends of a facing, from the jaw to the hole; None where the jaw reaches as far itself."""
    turn = math.radians(hole.opening.angle)
    (ax, ay), (ox, oy) = lip.along, lip.out
    cos, sin = math.cos(turn), math.sin(turn)
    way = (ax * cos + ox * sin, ay * cos + oy * sin)
    (x, y), (px, py) = _lip(hole, lip), _centre(hole)
    toward = (px - x) * way[0] + (py - y) * way[1]
    aside = (px - x) * way[1] - (py - y) * way[0]
    length = toward - math.sqrt(hole.opening.radius**2 - aside**2)
    begins = _rounded(hole.opening)
    return (_moved((x, y), way, begins), _moved((x, y), way, length)) if length > begins else None


def _moved(point: Point, way: Vector, distance: float) -> Point:
    return point[0] + way[0] * distance, point[1] + way[1] * distance
