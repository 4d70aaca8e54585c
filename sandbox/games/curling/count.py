"""Count: which stones are in play, which are guards, and what an end is worth, by the places of stones alone.

Source: World Curling, The Rules of Curling, on stones in play, the free guard zone and scoring.
"""

import math
from collections.abc import Sequence

from sandbox.games.curling.sheet import BACK, HOG, RINGS, STONE, WIDTH
from sandbox.scene.description.base import Point

PROTECTED = 5
"""Deliveries of an end in which no guard of the other team may be put out of play."""


def beyond(place: Point) -> bool:
    """Tell whether a stone is out of play wherever it goes on to: it touches a side line, or is wholly past the back.

    Args:
        place: of its centre, m.
    """
    x, y = place
    return abs(y) + STONE >= 0.5 * WIDTH or x - STONE > BACK


def short(place: Point) -> bool:
    """Tell whether a stone that rests has not come wholly past the hog line."""
    return place[0] - STONE <= -HOG


def in_house(place: Point) -> bool:
    """Tell whether a stone touches the house."""
    return math.hypot(*place) - STONE <= RINGS[0]


def guards(place: Point) -> bool:
    """Tell whether a stone that rests lies in the free guard zone: before the tee line, and not in the house."""
    return not short(place) and place[0] + STONE < 0.0 and not in_house(place)


def counted(stones: Sequence[tuple[int, Point]]) -> tuple[int | None, int]:
    """Return who scores in an end, and how much: a blank end is nobody's.

    The team with the stone nearest to the tee counts each of its stones that touches the house and is nearer than the
    best of the other team. Two that are equally near, to the last bit, leave an end blank, as stones do that no
    measure can tell apart.

    Args:
        stones: team and centre, m, of each stone in play.
    """
    near = sorted((math.hypot(*place), team) for team, place in stones if in_house(place))
    if not near:
        return None, 0
    best = near[0][1]
    other = next((distance for distance, team in near if team != best), math.inf)
    points = sum(team == best and distance < other for distance, team in near)
    return (best, points) if points else (None, 0)
