"""Lying: how the balls lie for the player to shoot: what touches the cue ball, and whether it is snookered."""

import math
from collections.abc import Iterable

from sandbox.games.billiards.layout import TOUCH, Disc
from sandbox.games.billiards.rules.verdict import Lie
from sandbox.scene.description.base import Point


def touching(cue: Disc, others: dict[str, Disc]) -> tuple[str, ...]:
    """Return the balls that lie against the cue ball."""
    x, y, radius = cue
    return tuple(name for name, (bx, by, r) in others.items() if math.hypot(bx - x, by - y) - radius - r <= TOUCH)


def lie_of(cues: Iterable[Disc], others: dict[str, Disc], targets: frozenset[str], placed: bool) -> Lie:
    """Return how the balls lie.

    Args:
        cues: where the cue ball lies; of one in hand, the places that it may be put.
        others: the object balls on the table.
        targets: those that are on.
        placed: whether the ball is in hand, so that it touches none.

    Source: WPBSA 2, Snookered: a ball is on where both its edges can be hit straight; the ball in the way that is
    nearest to the cue ball snookers it.
    """
    free = {name: disc for name, disc in others.items() if name not in targets}
    against: tuple[str, ...] = ()
    by: tuple[str, ...] = ()
    looks = 0
    for cue in cues:
        looks += 1
        against = () if placed else touching(cue, others)
        found = [_hidden(cue, others[name], free) for name in others if name in targets]
        if not found or any(way is None for way in found) or not targets.isdisjoint(against):
            return Lie(against)
        names = {way for way in found if way is not None}
        by = tuple(names) if len(names) == 1 else ()
    return Lie(against, looks > 0, by if looks == 1 else ())


def _hidden(cue: Disc, target: Disc, others: dict[str, Disc]) -> str | None:
    """Return the ball that keeps one from hitting some edge of a target, the nearest of them; None where none does."""
    in_way = {}
    for edge in _edges(cue, target):
        for name, disc in others.items():
            if _beside((cue[0], cue[1]), edge, (disc[0], disc[1])) < cue[2] + disc[2]:
                in_way[name] = math.hypot(disc[0] - cue[0], disc[1] - cue[1])
    return min(in_way, key=lambda name: in_way[name]) if in_way else None


def _edges(cue: Disc, target: Disc) -> tuple[Point, Point]:
    """Return where the cue ball's centre is when it just touches each edge of a target."""
    dx, dy, reach = target[0] - cue[0], target[1] - cue[1], cue[2] + target[2]
    far = math.hypot(dx, dy)
    reach = min(reach, far)
    forth = math.sqrt(far * far - reach * reach)
    turn, heading = math.asin(reach / far) if far else 0.0, math.atan2(dy, dx)
    left, right = heading + turn, heading - turn
    return (
        (cue[0] + forth * math.cos(left), cue[1] + forth * math.sin(left)),
        (cue[0] + forth * math.cos(right), cue[1] + forth * math.sin(right)),
    )


def _beside(begin: Point, end: Point, point: Point) -> float:
    """Return how far a point is from a straight way, m."""
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    px, py = point[0] - begin[0], point[1] - begin[1]
    size = dx * dx + dy * dy
    share = min(1.0, max(0.0, (px * dx + py * dy) / size)) if size else 0.0
    return math.hypot(px - share * dx, py - share * dy)
