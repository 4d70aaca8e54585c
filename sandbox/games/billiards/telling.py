"""Telling: what an engine saw of a shot, as the rules read it: by names."""

import math

from sandbox.games.billiards.layout import TOUCH, Layout
from sandbox.games.billiards.rules.happening import Happening
from sandbox.scene.description.base import Point
from sandbox.trajectory import Contacts

AT_ONCE = 5e-3
"""s after a ball was set in motion: a contact with what it touched at the start, seen so soon, was never left"""


def happenings_of(
    layout: Layout,
    contacts: Contacts,
    began: float = 0.0,
    against: frozenset[tuple[int, int]] = frozenset(),
    cue: str | None = None,
) -> tuple[Happening, ...]:
    """Return what happened in a shot.

    Args:
        layout: of the table.
        contacts: of any engine, since the stroke. What began before it is left out.
        began: the time of the stroke, s.
        against: what touched when the shot began, as `touching_pairs` returns it; it counts once it was left (WPA 8.4).
        cue: the ball that was struck.
    """
    names, fixed, solid = layout.names, layout.scene.fixed_names, len(layout.scene.fixed)
    frozen = any(b < 0 for _, b in against)
    moved = _set_in_motion(contacts, began, against, None if cue is None else layout.number[cue]) if frozen else {}
    found = []
    for time, (a, b) in zip(contacts.time.tolist(), contacts.pair.tolist(), strict=True):
        since = time - began
        if since < 0.0:
            continue
        if (a, b) in against and since <= AT_ONCE + (0.0 if b >= 0 else moved.get(a, math.inf)):
            continue
        if b >= 0:
            found.append(Happening(since, names[a], "ball", names[b]))
        else:
            found.append(Happening(since, names[a], "cushion" if -1 - b < solid else "pocket", fixed[-1 - b]))
    return tuple(found)


def _set_in_motion(
    contacts: Contacts, began: float, against: frozenset[tuple[int, int]], cue: int | None
) -> dict[int, float]:
    """Return when each ball was set in motion, s of the shot: itself, or another through balls that touch it."""
    group: dict[int, set[int]] = {}
    for a, b in against:
        if b >= 0:
            joined = group.get(a, {a}) | group.get(b, {b})
            group.update(dict.fromkeys(joined, joined))
    moved = {} if cue is None else dict.fromkeys(group.get(cue, {cue}), 0.0)
    for time, (a, b) in zip(contacts.time.tolist(), contacts.pair.tolist(), strict=True):
        if b >= 0 and time >= began and (a, b) not in against:
            for ball in group.get(a, {a}) | group.get(b, {b}):
                moved[ball] = min(moved.get(ball, math.inf), time - began)
    return moved


def touching_pairs(layout: Layout, position: tuple[Point, ...]) -> frozenset[tuple[int, int]]:
    """Return what touches, as pairs of numbers: of bodies the lower first; fixed things are −1 − k."""
    found = []
    ordered = sorted(range(len(position)), key=lambda k: position[k][0])
    widest = 2.0 * max(layout.radius, default=0.0) + TOUCH
    for n, i in enumerate(ordered):
        (x, y), radius = position[i], layout.radius[i]
        for k in ordered[n + 1 :]:
            if position[k][0] - x > widest:
                break
            if math.hypot(position[k][0] - x, position[k][1] - y) - radius - layout.radius[k] <= TOUCH:
                found.append((min(i, k), max(i, k)))
    found += layout.against_fixed(position)
    return frozenset(found)
