"""Shot search: candidate strokes, their probability by geometry, and their value by simulation.

The probability of a straight pot uses the ghost ball, the position of the cue ball at which the object ball leaves
towards the pocket. An aiming error δ moves the contact by δ·d, where d is the distance to the ghost ball, and turns the
path of the object ball by δ·d / (2R·cos φ), where φ is the cut angle. The pocket accepts directions
within an angle of its width, less the diameter of a ball, divided by the distance to it.

`ShotEvaluator` simulates strokes on the exact engine and lets the rules judge them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from sandbox.arrays import BoolArray, FloatArray
from sandbox.engines.contract import Exhaustion
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.rules.base import BallEvent, ShotCall, balls_touched_by
from sandbox.games.billiards.table_geometry import TableGeometry
from sandbox.scene.description.surface import Stroke
from sandbox.scene.geometry.vectors import offset_from_segment

MIN_CUT_COSINE = 0.2
"""cosine of the thinnest candidate cut, 78°"""

BLOCKING_FRACTION = 0.98
"""fraction of two radii: a ball that is closer to a path blocks it. Less than 1, because the estimate neglects jaws and
throw and should not rule out a shot for a grazing contact"""


@dataclass(frozen=True, eq=False)
class PotOptions:
    """Straight shots from one position at T balls to P pockets."""

    ghost: FloatArray
    """(T, P, 2) m, ghost ball: centre of the cue ball at contact"""
    chance: FloatArray
    """(T, P) probability of the pot, 0 to 1; 0 if a ball blocks the path"""
    distance: FloatArray
    """(T, P) m, distance from the cue ball to the ghost ball"""


def pocket_openings(layout: TableGeometry, radius: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return aiming points in the mouths of P pockets, (P, 2) m, unit vectors into them, (P, 2), and radii, (P,) m."""
    pockets = np.array(list(layout.pockets.values()), dtype=float).reshape(-1, 3)
    (x0, y0), (x1, y1) = layout.area
    inset = 0.7 * radius
    points = np.clip(pockets[:, :2], (x0 + inset, y0 + inset), (x1 - inset, y1 - inset))
    inward = pockets[:, :2] - points
    size = np.hypot(*inward.T)[:, None]
    return points, inward / np.maximum(size, 1e-12), pockets[:, 2]


def pot_options(
    layout: TableGeometry, radius: float, cue: FloatArray, targets: FloatArray, others: FloatArray, sigma: float
) -> PotOptions:
    """Return the straight shots at each ball on to each pocket.

    Args:
        layout: geometry of the table.
        radius: radius of the balls, m.
        cue: (2,) m, position of the cue ball.
        targets: (T, 2) m, positions of the balls on.
        others: (B, 2) m, positions of all object balls, including the balls on.
        sigma: standard deviation of the player's aim, rad.
    """
    points, inward, width = pocket_openings(layout, radius)
    to_mouth = points[None] - targets[:, None]
    mouth_distance = np.maximum(np.hypot(to_mouth[..., 0], to_mouth[..., 1]), 1e-9)
    heading = to_mouth / mouth_distance[..., None]
    ghost = targets[:, None] - 2.0 * radius * heading
    to_ghost = ghost - cue
    distance = np.maximum(np.hypot(to_ghost[..., 0], to_ghost[..., 1]), 1e-9)
    cut = np.einsum("tpc,tpc->tp", to_ghost / distance[..., None], heading)
    enters = np.einsum("tpc,pc->tp", heading, inward)
    opening = np.maximum(width * np.maximum(enters, 0.0) - radius, 0.0)
    margin = opening / mouth_distance * 2.0 * radius * np.maximum(cut, 0.0) / distance
    chance = _erf(margin / (math.sqrt(2.0) * sigma))
    (x0, y0), (x1, y1) = layout.area
    inside = (ghost[..., 0] > x0 + 0.9 * radius) & (ghost[..., 0] < x1 - 0.9 * radius)
    inside &= (ghost[..., 1] > y0 + 0.9 * radius) & (ghost[..., 1] < y1 - 0.9 * radius)
    is_open = inside & (cut > MIN_CUT_COSINE) & (opening > 0.0)
    for t, p in np.argwhere(is_open):
        itself = np.hypot(*(others - targets[t]).T) < 1e-9
        rest = others[~itself]
        if _blocked(cue, ghost[t, p], rest, radius) or _blocked(targets[t], points[p], rest, radius):
            is_open[t, p] = False
    return PotOptions(ghost, np.where(is_open, chance, 0.0), distance)


def _blocked(begin: FloatArray, end: FloatArray, others: FloatArray, radius: float) -> bool:
    """Return whether a ball blocks the straight path of another, from `begin` to `end`."""
    normal_offset = offset_from_segment(others, begin, end - begin)
    is_near: BoolArray = np.einsum("kc,kc->k", normal_offset, normal_offset) < (2.0 * BLOCKING_FRACTION * radius) ** 2
    return bool(is_near.any())


def _erf(x: FloatArray) -> FloatArray:
    """Return the error function for x ≥ 0, to 5e-4 (Abramowitz & Stegun 7.1.27); the estimate itself is coarser."""
    return np.asarray(1.0 - (1.0 + 0.278393 * x + 0.230389 * x**2 + 0.000972 * x**3 + 0.078108 * x**4) ** -4)


IN_HAND_CHANCE = 0.9
"""assumed probability of a pot with the ball in hand"""


@dataclass(frozen=True, eq=False)
class ShotEvaluator:
    """Evaluates strokes of the player to shoot."""

    match: Match
    table: Table
    """the table of the match on the exact engine"""
    sigma: float
    """standard deviation of the player's aim, rad"""

    @cached_property
    def radius(self) -> float:
        """Radius of the cue ball, m."""
        return self.match.layout.radius[self.match.layout.number[self.match.cue]]

    @cached_property
    def place(self) -> FloatArray:
        """(2,) m, position of the cue ball."""
        return np.array(self.match.position[self.match.layout.number[self.match.cue]])

    def outcome(self, stroke: Stroke, call: ShotCall | None = None) -> tuple[Match, ShotCall] | None:
        """Return the match after a stroke and the call for it; None if the engine cannot compute the shot.

        Args:
            stroke: stroke as played; no error is added.
            call: call before the stroke; default: the call that fits the result, from `fitting_call`.
        """
        match = self.match
        try:
            outcome = self.table.shoot(stroke, match.cue)
        except Exhaustion:
            return None
        contacts = outcome.contacts
        if call is None:
            call = fitting_call(match, match.events(contacts))
        return match.played(contacts, outcome.position, call), call

    def value_of(self, outcome: tuple[Match, ShotCall] | None) -> float:
        """Return the value of an outcome for the player: ±1.5 for a won or lost frame, −1 if it could not be computed.

        Other outcomes have a value of −0.7 to 0.8 by the chance of the next pot, plus the `POINT_VALUES` of the points.
        """
        if outcome is None:
            return -1.0
        player, after = self.match.turn, outcome[0]
        if after.over:
            return 0.0 if after.state.winner is None else (1.5 if after.state.winner == player else -1.5)
        gained = 0.0
        if after.verdict is not None and after.verdict.points:
            gained = sum(p if each == player else -p for each, p in enumerate(after.verdict.points))
        points = POINT_VALUES.get(after.rules.name, 0.0) * gained
        chance = best_pot_chance(after, self.sigma)
        return points + (0.3 + 0.5 * chance if after.turn == player else -0.1 - 0.6 * chance)


POINT_VALUES = {"snooker": 0.04, "three-cushion": 0.5, "straight-rail": 0.4, "free": 0.1}
"""value of a point, by game; points of other games are ignored"""


def best_pot_chance(match: Match, sigma: float) -> float:
    """Return the probability of the player's best straight shot, 0 to 1; in carom an estimate by distances."""
    if match.state.in_hand is not None:
        return IN_HAND_CHANCE
    cue, targets, others = ball_positions(match)
    if not len(targets):
        return 0.0
    if not match.layout.pockets:
        distances = np.hypot(*(others - cue).T)
        between = float(np.hypot(*(others[0] - others[-1])))
        return math.exp(-float(distances.min()) - between)
    return float(straight_pots(match, sigma).chance.max(initial=0.0))


def straight_pots(match: Match, sigma: float) -> PotOptions:
    """Return the straight shots of the player to shoot, at the balls on in the order of `match.state.table`."""
    cue, targets, others = ball_positions(match)
    radius = match.layout.radius[match.layout.number[match.cue]]
    return pot_options(match.layout, radius, cue, targets, others, max(sigma, 1e-3))


def ball_positions(match: Match) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the positions of the cue ball, (2,), of the balls on, (T, 2), and of all object balls, (B, 2), m."""
    number, position, on = match.layout.number, match.position, match.targets
    cue = match.cue
    balls = [ball for ball in match.state.table if ball != cue]
    targets = [position[number[ball]] for ball in balls if ball in on]
    others = [position[number[ball]] for ball in balls]
    return np.array(position[number[cue]]), np.array(targets).reshape(-1, 2), np.array(others).reshape(-1, 2)


def fitting_call(match: Match, events: tuple[BallEvent, ...]) -> ShotCall:
    """Return the call that fits the events of a shot: the ball that was hit first, or a required pocket."""
    choices = match.choices
    if not choices.balls:
        return ShotCall()
    if choices.pocket:
        if not choices.needed:
            return ShotCall()
        fell = {each.ball: each.other for each in events if each.kind == "pocket"}
        last = choices.balls[0]
        return ShotCall(ball=last, pocket=fell.get(last, next(iter(match.layout.pockets))))
    first = next((ball for each in events if (ball := balls_touched_by(match.cue, each)) is not None), None)
    if first in choices.balls:
        return ShotCall(ball=first)
    return ShotCall() if match.state.table and first in match.targets else ShotCall(ball=choices.balls[0])


SPEEDS = (1.2, 2.0, 3.2)
"""m/s, cue speeds of candidate pots"""

HEIGHTS = (-0.3, 0.0, 0.3)
"""offset of the tip above the centre, in radii, of candidate pots: draw, stun, follow"""

THROW_AIMS = 7
"""number of candidate aims on either side of the ghost ball; throw and spin turn the path of the object ball"""

THROW_RANGE = 0.12
"""rad: range of these aims on either side, as a change of the direction of the object ball"""

COMBINATIONS = 5
"""number of pairs of a ball and a pocket that are simulated"""


def pot_candidates(evaluator: ShotEvaluator, max_pairs: int = COMBINATIONS) -> list[Stroke]:
    """Return strokes that pot a ball on: for each speed and height, the middle of the aims that succeed.

    A fan of aims is simulated for each of the `max_pairs` likeliest pairs of a ball and a pocket by geometry.
    """
    match, shots = evaluator.match, straight_pots(evaluator.match, evaluator.sigma)
    order = np.argsort(-shots.chance, axis=None, kind="stable")[:max_pairs]
    on = [ball for ball in match.state.table if ball in match.targets and ball != match.cue]
    pocket_names, found = list(match.layout.pockets), []
    speeds_and_heights = list(product(SPEEDS, HEIGHTS))
    for t, p in zip(*np.unravel_index(order, shots.chance.shape), strict=True):
        if shots.chance[t, p] <= 0.0:
            continue
        to_ghost = shots.ghost[t, p] - evaluator.place
        bearing = math.atan2(to_ghost[1], to_ghost[0])
        reach = THROW_RANGE * 2.0 * evaluator.radius / float(shots.distance[t, p])
        turns = (bearing + np.linspace(-reach, reach, 2 * THROW_AIMS + 1)).tolist()
        strokes = [Stroke(aim=aim, speed=speed, height=height) for speed, height in speeds_and_heights for aim in turns]
        fan = evaluator.table.fan(strokes, match.cue)
        ball, cue = match.layout.number[on[t]], match.layout.number[match.cue]
        hole = list(match.layout.pockets).index(pocket_names[p])
        potted = (fan.pocket[:, ball] == hole) & (fan.pocket[:, cue] < 0)
        for k in range(len(speeds_and_heights)):
            successes = potted[k * len(turns) : (k + 1) * len(turns)].tolist()
            middle = _middle(successes)
            if middle is not None:
                found.append(strokes[k * len(turns) + middle])
    return found


def _middle(successes: Sequence[bool]) -> int | None:
    """Return the middle index of the longest run of true values."""
    best, begin, length = None, 0, 0
    for k, each in enumerate([*successes, False]):
        if each:
            continue
        if k - begin > length:
            best, length = (begin + k - 1) // 2, k - begin
        begin = k + 1
    return best


def directions_all_around(
    evaluator: ShotEvaluator, count: int, speeds: Sequence[float], sides: Sequence[float] = (0.0,)
) -> Iterator[Stroke]:
    """Yield strokes in all directions, most densely towards the nearest balls: kicks, banks, caroms, safeties."""
    cue, targets, others = ball_positions(evaluator.match)
    aims = list(np.linspace(-math.pi, math.pi, count, endpoint=False))
    balls = targets if evaluator.match.layout.pockets else others
    if len(balls):
        nearest = balls[np.argsort(np.hypot(*(balls - cue).T), kind="stable")][:6]
        for x, y in nearest - cue:
            half = math.asin(min(1.0, 2.0 * evaluator.radius / math.hypot(x, y)))
            aims += list(math.atan2(y, x) + 0.97 * half * np.linspace(-1.0, 1.0, max(count // 6, 5)))
    for speed, side, aim in product(speeds, sides, aims):
        yield Stroke(aim=float(aim), speed=speed, side=side)


def break_candidates(evaluator: ShotEvaluator) -> Iterator[Stroke]:
    """Yield opening strokes of pool: hard, at or near the centre of the nearest ball."""
    cue, targets, _ = ball_positions(evaluator.match)
    x, y = targets[np.argmin(np.hypot(*(targets - cue).T))] - cue
    half = 2.0 * evaluator.radius / math.hypot(x, y)
    for speed, part in product((7.5, 9.0), (-0.6, -0.3, -0.1, -0.03, 0.0, 0.03, 0.1, 0.3, 0.6)):
        yield Stroke(aim=math.atan2(y, x) + part * half, speed=speed, height=0.05)
