"""Spotting: where a ball goes that is put back, once it is known which balls are in the way."""

import math
from collections.abc import Sequence

from sandbox.games.billiards.layout import HAIR, Disc, Layout
from sandbox.games.billiards.rules.happening import GameError
from sandbox.games.billiards.rules.verdict import Respot
from sandbox.scene.description.base import Point


def spotted(layout: Layout, respot: Respot, radius: float, others: Sequence[Disc]) -> Point:
    """Return where a ball goes: on the first of its spots that is free, else behind the first, as near as can be.

    Behind is along the table, towards its foot; where that is full up to the cushion, before the spot (WPA 1.4;
    WPBSA 3, Spotting Colours). Balls are put 0.01 mm from each other: they do not touch.

    Args:
        layout: of the table.
        respot: which ball, and its spots.
        radius: of the ball, m.
        others: the balls on the table.

    Raises:
        GameError: the table has none of the spots, or there is no room on the whole line.
    """
    spots = [layout.spots[name] for name in respot.spots if name in layout.spots]
    if not spots:
        raise GameError(f"the table has no spot {' or '.join(map(repr, respot.spots))} for the {respot.ball}")
    for spot in spots:
        if all(math.hypot(spot[0] - x, spot[1] - y) >= radius + r for x, y, r in others):
            return spot
    (x, y), (ux, uy) = spots[0], layout.along
    for way in (1.0, -1.0):
        far = _free(spots[0], (way * ux, way * uy), radius, others)
        place = (x + way * ux * far, y + way * uy * far)
        (x0, y0), (x1, y1) = layout.area
        if x0 + radius <= place[0] <= x1 - radius and y0 + radius <= place[1] <= y1 - radius:
            return place
    raise GameError(f"there is no room to spot the {respot.ball}")


def _free(spot: Point, way: Point, radius: float, others: Sequence[Disc]) -> float:
    """Return how far along a way from a spot a ball first finds room, m."""
    taken = []
    for x, y, r in others:
        forth = (x - spot[0]) * way[0] + (y - spot[1]) * way[1]
        aside = (x - spot[0]) * way[1] - (y - spot[1]) * way[0]
        reach = radius + r + HAIR
        if abs(aside) < reach:
            half = math.sqrt(reach * reach - aside * aside)
            taken.append((forth - half, forth + half))
    far = 0.0
    for low, high in sorted(taken):
        if low < far < high:
            far = high
    return far
