"""Upkeep: what a referee does between shots: racks the balls anew, and puts single ones back."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from sandbox.games.billiards.layout import Layout
from sandbox.games.billiards.rules.rules import Rules
from sandbox.games.billiards.rules.state import State
from sandbox.games.billiards.rules.verdict import Respot
from sandbox.games.billiards.spotting import spotted
from sandbox.scene.description.base import Point

ASIDE = 1.0
"""m, from the playing area's corner: where balls wait"""


def racked(layout: Layout, rules: Rules[Any], state: State) -> tuple[Point, ...]:
    """Return where the balls lie when all begins anew, by number, m: as the scene has them.

    Where players strike balls of their own, the one to shoot has the place of the first.
    """
    position = list(layout.start)
    cue, first = rules.cue_ball(state), rules.cue_balls[0]
    if cue != first and first in layout.number:
        a, b = layout.number[cue], layout.number[first]
        position[a], position[b] = position[b], position[a]
    return tuple(position)


def respotted(
    layout: Layout, respots: Sequence[Respot], position: tuple[Point, ...], here: Iterable[int]
) -> tuple[Point, ...]:
    """Return where the balls lie once some were put back, one after the other, by number, m.

    Args:
        layout: of the table.
        respots: what is put back, in this order.
        position: where the balls are before, by number, m.
        here: the numbers of those on the table, which are in the way unless they lie in a pocket.

    Raises:
        GameError: there is no room.
    """
    places, lifted = list(position), {layout.number[each.ball] for each in respots}
    lying = {k for k in here if k not in lifted and layout.pocket_at(places[k]) is None}
    for each in respots:
        number = layout.number[each.ball]
        others = [(*places[k], layout.radius[k]) for k in sorted(lying)]
        places[number] = spotted(layout, each, layout.radius[number], others)
        lying.add(number)
    return tuple(places)


def ways(layout: Layout, now: Sequence[Point], then: Sequence[Point]) -> list[tuple[int, Point]]:
    """Return who is put where, one after the other, so that balls go from one position to another, m, by number.

    No ball is put onto another on the way: where they stand in each other's places, one waits beside the table.
    """
    at, left, found = list(now), [k for k in range(len(now)) if now[k] != then[k]], list[tuple[int, Point]]()
    (x0, y0), _ = layout.area
    while left:
        # Only who is still to be moved is in the way: where balls are to end is none of our business.
        ready = next((k for k in left if _free(layout, k, then[k], at, left)), None)
        number = left[0] if ready is None else ready
        far = 4.0 * layout.radius[number] * (number + 1) + ASIDE
        place = (x0 - far, y0 - far) if ready is None else then[number]
        at[number] = place
        found.append((number, place))
        left.remove(number)
        if ready is None:
            left.append(number)
    return found


def _free(layout: Layout, number: int, place: Point, at: Sequence[Point], others: Sequence[int]) -> bool:
    """Tell whether a ball can be put somewhere, for others; in a pocket it meets nobody."""
    if layout.pocket_at(place) is not None:
        return True
    radius = layout.radius
    return all(
        math.dist(place, at[k]) >= radius[number] + radius[k] or layout.pocket_at(at[k]) is not None
        for k in others
        if k != number
    )
