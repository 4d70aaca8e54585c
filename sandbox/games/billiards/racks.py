"""Racks: where the balls of a game begin.

Balls of a rack lie on a triangular lattice. With a gap g the lattice is g/2 wider than the balls and each ball lies
anywhere within g/4 of its place: neighbours are 0 to g apart, and never overlap.
"""

from __future__ import annotations  # `np.random` in an annotation would import it wherever scenes are read

import math

import numpy as np

from sandbox.games.billiards.equipment import RACK_SPOTS, RackName
from sandbox.scene.description.base import Point, Vector
from sandbox.scene.random_streams import Stream, draws

HAIR = 1e-10
"""m, between balls that are frozen: less than touching allows, more than rounding takes away"""

ASIDE = 0.1825
"""m, from the head spot to the ball with which a game of carom begins: UMB 13"""

BREAK = 0.5
"""of the way from brown to yellow, where the cue ball lies for a break-off"""


def racked(rack: RackName, spots: dict[str, Point], radius: float, gap: float, seed: int) -> dict[str, Point]:
    """Return where the balls of a rack lie, by name, m.

    Args:
        rack: which.
        spots: of the table, m; those that the rack needs.
        radius: of the balls, m.
        gap: the most that neighbours are apart, m.
        seed: the scene's.
    """
    random = draws(Stream.RACK, seed)
    match rack:
        case "8-ball":
            return {"cue": spots["head"], **_pyramid(_eight_ball(random), spots, radius, gap, random)}
        case "9-ball":
            return {"cue": spots["head"], **_pyramid(_nine_ball(random), spots, radius, gap, random)}
        case "snooker":
            return _snooker(spots, radius, gap, random)
        case "carom":
            (x, y), along = spots["head"], _way(spots["head"], spots["foot"])
            white = (x + along[1] * ASIDE, y - along[0] * ASIDE)
            return {"white": white, "yellow": spots["head"], "red": spots["foot"]}
        case "none":
            return {}


def _eight_ball(random: np.random.Generator) -> list[list[str]]:
    """WPA, 8-ball rack: the 8 in the middle, a ball of each group in the rear corners, the others at random."""
    solids, stripes = _shuffled(range(2, 8), random), _shuffled(range(9, 16), random)
    corners = _shuffled((solids.pop(), stripes.pop()), random)
    rest = _shuffled((*solids, *stripes), random)
    order = [1, *rest[:3], 8, *rest[3:8], corners[0], *rest[8:], corners[1]]
    return _rows(order, (1, 2, 3, 4, 5))


def _nine_ball(random: np.random.Generator) -> list[list[str]]:
    """WPA, 9-ball rack: a diamond, the 1 at the top on the foot spot, the 9 in the middle, the others at random."""
    rest = _shuffled(range(2, 9), random)
    return _rows([1, *rest[:3], 9, *rest[3:]], (1, 2, 3, 2, 1))


def _snooker(spots: dict[str, Point], radius: float, gap: float, random: np.random.Generator) -> dict[str, Point]:
    """WPBSA, position of balls: colours on their spots, reds in a triangle behind the pink, near but not touching."""
    along = _way(spots["blue"], spots["pink"])
    begin = _moved(spots["pink"], along, 2.0 * radius + max(gap, 1e-3))
    reds = _rows(range(1, 16), (1, 2, 3, 4, 5))
    places = _lattice([[f"red-{number}" for number in row] for row in reds], begin, along, radius, gap, random)
    (bx, by), (yx, yy) = spots["brown"], spots["yellow"]
    cue = (bx + BREAK * (yx - bx), by + BREAK * (yy - by))
    return {"cue": cue, **places, **{name: spots[name] for name in RACK_SPOTS["snooker"]}}


def _pyramid(
    rows: list[list[str]], spots: dict[str, Point], radius: float, gap: float, random: np.random.Generator
) -> dict[str, Point]:
    return _lattice(rows, spots["foot"], _way(spots["head"], spots["foot"]), radius, gap, random)


def _lattice(
    rows: list[list[str]], begin: Point, along: Vector, radius: float, gap: float, random: np.random.Generator
) -> dict[str, Point]:
    """Lay rows of balls, the first at a point, the others behind it."""
    pitch, loose = 2.0 * radius + max(0.5 * gap, HAIR), 0.25 * gap
    places: dict[str, Point] = {}
    for k, row in enumerate(rows):
        for n, name in enumerate(row):
            forth, aside = k * pitch * math.sqrt(0.75), (n - 0.5 * (len(row) - 1)) * pitch
            far, turn = loose * math.sqrt(random.random()), 2.0 * math.pi * random.random()
            forth, aside = forth + far * math.cos(turn), aside + far * math.sin(turn)
            places[name] = (
                begin[0] + along[0] * forth - along[1] * aside,
                begin[1] + along[1] * forth + along[0] * aside,
            )
    return places


def _rows(order: list[int] | range, sizes: tuple[int, ...]) -> list[list[str]]:
    names = [str(number) for number in order]
    return [[names.pop(0) for _ in range(size)] for size in sizes]


def _shuffled(numbers: range | tuple[int, ...], random: np.random.Generator) -> list[int]:
    """Return numbers in an order of chance, by uniform doubles alone: their stream is stable in numpy."""
    return [number for _, number in sorted((float(random.random()), number) for number in numbers)]


def _way(begin: Point, end: Point) -> Vector:
    size = math.dist(begin, end)
    return (end[0] - begin[0]) / size, (end[1] - begin[1]) / size


def _moved(point: Point, way: Vector, distance: float) -> Point:
    return point[0] + way[0] * distance, point[1] + way[1] * distance
