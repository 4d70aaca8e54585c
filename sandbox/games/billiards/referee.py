"""Conversion between contacts and positions of the engine, and events and spots of the rules.

`shot_events` converts the contacts of a shot to events by name. `situation_of` returns the balls that touch the cue
ball, and whether it is snookered. `respot_moves` and `rerack_moves` return the positions of respotted and reracked
balls, and `collision_free_moves` the moves to these positions.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from sandbox.games.billiards.rules.base import BallEvent, GameError, Respot, Ruleset, RulesState, Situation
from sandbox.games.billiards.table_geometry import MAX_TOUCH_GAP, PLACEMENT_GAP, PlacedDisc, TableGeometry
from sandbox.scene.description.base import Point
from sandbox.scene.geometry.vectors import nearest_on_segment
from sandbox.trajectory import Contacts


def touching_balls(cue: PlacedDisc, others: dict[str, PlacedDisc]) -> tuple[str, ...]:
    """Return the balls that touch the cue ball."""
    x, y, radius = cue
    return tuple(
        name for name, (bx, by, r) in others.items() if math.hypot(bx - x, by - y) - radius - r <= MAX_TOUCH_GAP
    )


def situation_of(
    cues: Iterable[PlacedDisc], others: dict[str, PlacedDisc], targets: frozenset[str], placed: bool
) -> Situation:
    """Return the situation of the player to shoot.

    Args:
        cues: the cue ball; for a ball in hand, the cue ball at each allowed position.
        others: the object balls on the table.
        targets: names of the balls on.
        placed: whether the cue ball is in hand, so that it touches no ball.

    Source: WPBSA 2, Snookered: the cue ball is snookered if it cannot hit both edges of any ball on in a straight line;
    of the balls in the way, the nearest to the cue ball snookers it.
    """
    free = {name: disc for name, disc in others.items() if name not in targets}
    against: tuple[str, ...] = ()
    by: tuple[str, ...] = ()
    count = 0
    for cue in cues:
        count += 1
        against = () if placed else touching_balls(cue, others)
        blockers = [_blocking_ball(cue, others[name], free) for name in others if name in targets]
        if not blockers or any(name is None for name in blockers) or not targets.isdisjoint(against):
            return Situation(against)
        names = {name for name in blockers if name is not None}
        by = tuple(names) if len(names) == 1 else ()
    return Situation(against, count > 0, by if count == 1 else ())


def _blocking_ball(cue: PlacedDisc, target: PlacedDisc, others: dict[str, PlacedDisc]) -> str | None:
    """Return the nearest ball that blocks the path to an edge of a target; None if both edges can be hit."""
    distances = {}
    for edge in _edges(cue, target):
        for name, disc in others.items():
            if nearest_on_segment((disc[0], disc[1]), (cue[0], cue[1]), edge)[1] < cue[2] + disc[2]:
                distances[name] = math.hypot(disc[0] - cue[0], disc[1] - cue[1])
    return min(distances, key=lambda name: distances[name]) if distances else None


def _edges(cue: PlacedDisc, target: PlacedDisc) -> tuple[Point, Point]:
    """Return the centres of the cue ball as it just touches each edge of a target, m."""
    dx, dy, contact_distance = target[0] - cue[0], target[1] - cue[1], cue[2] + target[2]
    distance = math.hypot(dx, dy)
    contact_distance = min(contact_distance, distance)
    forward = math.sqrt(distance * distance - contact_distance * contact_distance)
    turn, heading = math.asin(contact_distance / distance) if distance else 0.0, math.atan2(dy, dx)
    left, right = heading + turn, heading - turn
    return (
        (cue[0] + forward * math.cos(left), cue[1] + forward * math.sin(left)),
        (cue[0] + forward * math.cos(right), cue[1] + forward * math.sin(right)),
    )


def respotted_position(layout: TableGeometry, respot: Respot, radius: float, others: Sequence[PlacedDisc]) -> Point:
    """Return the position of a respotted ball, m: the first free spot, else the nearest free point behind the first.

    Behind is towards the foot of the table. If there is no room up to the cushion, the ball is placed in front of the
    spot (WPA 1.4; WPBSA 3, Spotting Colours). Respotted balls keep a gap of 0.01 mm, so that they do not touch.

    Args:
        layout: geometry of the table.
        respot: the ball and its spots.
        radius: radius of the ball, m.
        others: the balls on the table.

    Raises:
        GameError: the table has none of the spots, or there is no room on the line.
    """
    spots = [layout.spots[name] for name in respot.spots if name in layout.spots]
    if not spots:
        raise GameError(f"the table has no spot {' or '.join(map(repr, respot.spots))} for the {respot.ball}")
    for spot in spots:
        if all(math.hypot(spot[0] - x, spot[1] - y) >= radius + r for x, y, r in others):
            return spot
    (x, y), (ux, uy) = spots[0], layout.along
    for sign in (1.0, -1.0):
        distance = _distance_to_room(spots[0], (sign * ux, sign * uy), radius, others)
        position = (x + sign * ux * distance, y + sign * uy * distance)
        (x0, y0), (x1, y1) = layout.area
        if x0 + radius <= position[0] <= x1 - radius and y0 + radius <= position[1] <= y1 - radius:
            return position
    raise GameError(f"there is no room to spot the {respot.ball}")


def _distance_to_room(spot: Point, direction: Point, radius: float, others: Sequence[PlacedDisc]) -> float:
    """Return the distance from a spot to the first free point in a direction, m."""
    blocked = []
    for x, y, r in others:
        forward = (x - spot[0]) * direction[0] + (y - spot[1]) * direction[1]
        sideways = (x - spot[0]) * direction[1] - (y - spot[1]) * direction[0]
        contact_distance = radius + r + PLACEMENT_GAP
        if abs(sideways) < contact_distance:
            half = math.sqrt(contact_distance * contact_distance - sideways * sideways)
            blocked.append((forward - half, forward + half))
    distance = 0.0
    for low, high in sorted(blocked):
        if low < distance < high:
            distance = high
    return distance


SEPARATION_TIME = 5e-3
"""s: a pair that touched before the shot counts as not yet separated up to this time after it was set in motion"""


def shot_events(
    layout: TableGeometry,
    contacts: Contacts,
    began: float = 0.0,
    against: frozenset[tuple[int, int]] = frozenset(),
    cue: str | None = None,
) -> tuple[BallEvent, ...]:
    """Return the events of a shot.

    Args:
        layout: geometry of the table.
        contacts: contacts on any engine since the stroke. Contacts that began before it are ignored.
        began: time of the stroke, s.
        against: pairs that touch before the shot, from `touching_pairs`; they count only after a separation (WPA 8.4).
        cue: name of the ball that was struck.
    """
    names, fixed, static_count = layout.names, layout.scene.fixed_names, len(layout.scene.fixed)
    frozen = any(b < 0 for _, b in against)
    motion_times = (
        _set_in_motion(contacts, began, against, None if cue is None else layout.number[cue]) if frozen else {}
    )
    events = []
    for time, (a, b) in zip(contacts.time.tolist(), contacts.pair.tolist(), strict=True):
        since = time - began
        if since < 0.0:
            continue
        if (a, b) in against and since <= SEPARATION_TIME + (0.0 if b >= 0 else motion_times.get(a, math.inf)):
            continue
        if b >= 0:
            events.append(BallEvent(since, names[a], "ball", names[b]))
        elif -1 - b < static_count + len(layout.scene.pockets):  # sensors follow
            events.append(BallEvent(since, names[a], "cushion" if -1 - b < static_count else "pocket", fixed[-1 - b]))
    return tuple(events)


def _set_in_motion(
    contacts: Contacts, began: float, against: frozenset[tuple[int, int]], cue: int | None
) -> dict[int, float]:
    """Return the time at which each ball was set in motion, directly or through touching balls, s since the stroke."""
    group: dict[int, set[int]] = {}
    for a, b in against:
        if b >= 0:
            joined = group.get(a, {a}) | group.get(b, {b})
            group.update(dict.fromkeys(joined, joined))
    motion_times = {} if cue is None else dict.fromkeys(group.get(cue, {cue}), 0.0)
    for time, (a, b) in zip(contacts.time.tolist(), contacts.pair.tolist(), strict=True):
        if b >= 0 and time >= began and (a, b) not in against:
            for ball in group.get(a, {a}) | group.get(b, {b}):
                motion_times[ball] = min(motion_times.get(ball, math.inf), time - began)
    return motion_times


def touching_pairs(layout: TableGeometry, position: tuple[Point, ...]) -> frozenset[tuple[int, int]]:
    """Return the pairs that touch, as body indices, the lower first; fixed objects are −1 − k."""
    found = []
    ordered = sorted(range(len(position)), key=lambda k: position[k][0])
    widest = 2.0 * max(layout.radius, default=0.0) + MAX_TOUCH_GAP
    for n, i in enumerate(ordered):
        (x, y), radius = position[i], layout.radius[i]
        for k in ordered[n + 1 :]:
            if position[k][0] - x > widest:
                break
            if math.hypot(position[k][0] - x, position[k][1] - y) - radius - layout.radius[k] <= MAX_TOUCH_GAP:
                found.append((min(i, k), max(i, k)))
    found += layout.against_fixed(position)
    return frozenset(found)


PARK_DISTANCE = 1.0
"""m from the corner of the playing area to the first position where balls are parked during a move"""


def rerack_moves(layout: TableGeometry, rules: Ruleset[Any], state: RulesState) -> tuple[Point, ...]:
    """Return the positions after a rerack, m: those of the scene.

    In games in which each player has a cue ball, the player to shoot gets the position of the first cue ball.
    """
    position = list(layout.start)
    cue, first = rules.cue_ball(state), rules.cue_balls[0]
    if cue != first and first in layout.number:
        a, b = layout.number[cue], layout.number[first]
        position[a], position[b] = position[b], position[a]
    return tuple(position)


def respot_moves(
    layout: TableGeometry, respots: Sequence[Respot], position: tuple[Point, ...], on_table: Iterable[int]
) -> tuple[Point, ...]:
    """Return the positions after some balls are respotted, one after the other, m.

    Args:
        layout: geometry of the table.
        respots: the balls and their spots, in order.
        position: positions before, m.
        on_table: indices of the balls on the table, which block spots unless they are in a pocket.

    Raises:
        GameError: there is no room.
    """
    positions, respotted = list(position), {layout.number[each.ball] for each in respots}
    blocking = {k for k in on_table if k not in respotted and layout.pocket_at(positions[k]) is None}
    for each in respots:
        ball = layout.number[each.ball]
        others = [(*positions[k], layout.radius[k]) for k in sorted(blocking)]
        positions[ball] = respotted_position(layout, each, layout.radius[ball], others)
        blocking.add(ball)
    return tuple(positions)


def collision_free_moves(layout: TableGeometry, now: Sequence[Point], then: Sequence[Point]) -> list[tuple[int, Point]]:
    """Return the moves, as index and position in m, that take balls from the positions `now` to `then`.

    No ball is moved onto another. If balls block each other in a cycle, one of them is parked beside the table.
    """
    at, remaining, moves = list(now), [k for k in range(len(now)) if now[k] != then[k]], list[tuple[int, Point]]()
    (x0, y0), _ = layout.area
    while remaining:
        # Only balls that are still to be moved can block; the final positions are free by assumption.
        ready = next((k for k in remaining if _is_position_free(layout, k, then[k], at, remaining)), None)
        ball = remaining[0] if ready is None else ready
        offset = 4.0 * layout.radius[ball] * (ball + 1) + PARK_DISTANCE
        destination = (x0 - offset, y0 - offset) if ready is None else then[ball]
        at[ball] = destination
        moves.append((ball, destination))
        remaining.remove(ball)
        if ready is None:
            remaining.append(ball)
    return moves


def _is_position_free(
    layout: TableGeometry, ball: int, position: Point, at: Sequence[Point], others: Sequence[int]
) -> bool:
    """Return whether a ball can be moved to a position without overlap; balls in pockets do not overlap."""
    if layout.pocket_at(position) is not None:
        return True
    radius = layout.radius
    return all(
        math.dist(position, at[k]) >= radius[ball] + radius[k] or layout.pocket_at(at[k]) is not None
        for k in others
        if k != ball
    )
