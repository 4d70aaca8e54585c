"""Sheet: the lines and rings of a curling sheet, and where stones lie that are not in play.

The origin is the tee that is played to, x the way of the stones. Measures are those of World Curling, The Rules of
Curling, of sheet and stones: length 45.720 m, width at most 5.000 m; from the tee line to the hog line 6.401 m and to
the back line 1.829 m, tee lines 34.747 m apart, so that hog lines are 21.945 m apart; rings of 12, 8 and 4 feet and a
button; stones of at most 19.96 kg and a circumference of at most 91.44 cm.
"""

import math

from sandbox.scene.description.base import Point

LENGTH, WIDTH = 45.720, 5.000
HOG, BACK, TEES = 6.401, 1.829, 34.747
"""m: from the tee line to its hog line and its back line; between the two tee lines"""
RINGS = 1.829, 1.219, 0.610, 0.152
"""m, radii of the house: 12, 8 and 4 feet across, and the button"""
STONE, WEIGHT = 0.9144 / math.tau, 19.96
"""m, radius of a stone, and kg"""
RELEASE = HOG - TEES - STONE
"""m, where a stone is let go at the latest: before the nearer hog line"""

TEAMS = "red", "yellow"
STONES = 8
"""of each team"""
_PITCH = 2.0 * STONE + 0.05


def stone(team: int, number: int) -> str:
    """Return the name of a team's stone, counted from 0."""
    return f"{TEAMS[team]}-{number + 1}"


def waiting(team: int, number: int) -> Point:
    """Return where a stone lies until it is thrown, beside the sheet, m: red to the left of the way."""
    return RELEASE + (STONES - number) * _PITCH, _aside(team)


def gone(team: int, number: int) -> Point:
    """Return where a stone lies that is out of play, m."""
    return BACK + 3.2 - (STONES - number) * _PITCH, _aside(team)


def _aside(team: int) -> float:
    return (1.0 if team == 0 else -1.0) * (0.5 * WIDTH + 0.45)
