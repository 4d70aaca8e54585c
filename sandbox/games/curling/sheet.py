"""Geometry of a curling sheet, positions of stones that are not in play, and the score of an end.

The origin is the tee of the target house; x is the direction of play, y is to its left, both in m. Dimensions of the
sheet: length 45.720 m, width at most 5.000 m; from the tee line to the hog line 6.401 m and to the back line 1.829 m;
34.747 m between the tee lines, so 21.945 m between the hog lines; rings of 12, 8 and 4 feet and a button. A stone has
at most 19.96 kg and a circumference of at most 91.44 cm.

Source: World Curling, The Rules of Curling, on sheet and stones, stones in play, the free guard zone and scoring.
"""

import math
from collections.abc import Sequence

from sandbox.scene.description.base import Point

LENGTH, WIDTH = 45.720, 5.000
"""m, of the sheet"""
HOG, BACK, TEES = 6.401, 1.829, 34.747
"""m, distances: from the tee line to the hog line, and to the back line; between the two tee lines"""
RINGS = 1.829, 1.219, 0.610, 0.152
"""m, radii of the rings of the house, with diameters of 12, 8 and 4 feet, and of the button"""
STONE, WEIGHT = 0.9144 / math.tau, 19.96
"""m, radius of a stone, and kg, its mass"""
RELEASE = HOG - TEES - STONE
"""m, x of the release of a stone: the last position before the nearer hog line"""

TEAMS = "red", "yellow"
STONES = 8
"""number of stones of each team"""
_PITCH = 2.0 * STONE + 0.05


def stone_name(team: int, number: int) -> str:
    """Return the name of a stone; `team` and `number` count from 0."""
    return f"{TEAMS[team]}-{number + 1}"


def parked_position(team: int, number: int) -> Point:
    """Return the position of a stone before its delivery, beside the sheet, m: red on the left."""
    return RELEASE + (STONES - number) * _PITCH, _aside(team)


def removed_position(team: int, number: int) -> Point:
    """Return the position of a stone out of play, beside the sheet, m."""
    return BACK + 3.2 - (STONES - number) * _PITCH, _aside(team)


def _aside(team: int) -> float:
    return (1.0 if team == 0 else -1.0) * (0.5 * WIDTH + 0.45)


PROTECTED = 5
"""number of the first deliveries of an end that must not remove guards of the other team from play"""


def is_out_of_play(position: Point) -> bool:
    """Return whether a stone is out of play: it touches a side line, or is completely past the back line.

    Args:
        position: position of its centre, m.
    """
    x, y = position
    return abs(y) + STONE >= 0.5 * WIDTH or x - STONE > BACK


def is_hogged(position: Point) -> bool:
    """Return whether a stone at rest is not completely past the hog line."""
    return position[0] - STONE <= -HOG


def in_house(position: Point) -> bool:
    """Return whether a stone touches the house."""
    return math.hypot(*position) - STONE <= RINGS[0]


def in_free_guard_zone(position: Point) -> bool:
    """Return whether a stone at rest is in the free guard zone: before the tee line, and not in the house."""
    return not is_hogged(position) and position[0] + STONE < 0.0 and not in_house(position)


def end_score(stones: Sequence[tuple[int, Point]]) -> tuple[int | None, int]:
    """Return the team that scores in an end, and its points; None and 0 for a blank end.

    The team with the stone nearest to the tee counts each of its stones that touches the house and is nearer than the
    best stone of the other team. Two best stones at exactly equal distances make a blank end, as stones whose distances
    cannot be distinguished by measurement do.

    Args:
        stones: team and centre, m, of each stone in play.
    """
    distances = sorted((math.hypot(*position), team) for team, position in stones if in_house(position))
    if not distances:
        return None, 0
    best = distances[0][1]
    other = next((distance for distance, team in distances if team != best), math.inf)
    points = sum(team == best and distance < other for distance, team in distances)
    return (best, points) if points else (None, 0)
