"""Aims: the strokes that are worth a trial."""

import math
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from sandbox.games.billiards.bot.trial import Trial, standing, straight
from sandbox.scene.description.surface import Stroke

SPEEDS = (1.2, 2.0, 3.2)
"""m/s, of the cue, for a pot"""

HEIGHTS = (-0.3, 0.0, 0.3)
"""draw, stun, follow"""

THROWS = 7
"""aims to either side of the ghost ball that are tried, for throw and spin turn the ball's way"""

ASIDE = 0.12
"""rad, of the object ball's way, that these reach to either side"""

COMBINATIONS = 5
"""balls and pockets that are looked at closely"""


def pots_of(trial: Trial, most: int = COMBINATIONS) -> list[Stroke]:
    """Return strokes that pot a ball on: the middle of the aims that do, for each speed and height.

    The likeliest balls and pockets by geometry are tried with a fan of aims each.
    """
    match, shots = trial.match, straight(trial.match, trial.sigma)
    order = np.argsort(-shots.chance, axis=None, kind="stable")[:most]
    on = [ball for ball in match.state.table if ball in match.targets and ball != match.cue]
    holes, found = list(match.layout.pockets), []
    ways = list(product(SPEEDS, HEIGHTS))
    for t, p in zip(*np.unravel_index(order, shots.chance.shape), strict=True):
        if shots.chance[t, p] <= 0.0:
            continue
        to_ghost = shots.ghost[t, p] - trial.place
        ahead = math.atan2(to_ghost[1], to_ghost[0])
        reach = ASIDE * 2.0 * trial.radius / float(shots.distance[t, p])
        turns = (ahead + np.linspace(-reach, reach, 2 * THROWS + 1)).tolist()
        strokes = [Stroke(aim=aim, speed=speed, height=height) for speed, height in ways for aim in turns]
        fan = trial.table.fan(strokes, match.cue)
        ball, cue = match.layout.number[on[t]], match.layout.number[match.cue]
        hole = list(match.layout.pockets).index(holes[p])
        made = (fan.pocket[:, ball] == hole) & (fan.pocket[:, cue] < 0)
        for k in range(len(ways)):
            row = made[k * len(turns) : (k + 1) * len(turns)].tolist()
            middle = _middle(row)
            if middle is not None:
                found.append(strokes[k * len(turns) + middle])
    return found


def _middle(row: Sequence[bool]) -> int | None:
    """Return the middle of the longest run of trues."""
    best, begin, length = None, 0, 0
    for k, each in enumerate([*row, False]):
        if each:
            continue
        if k - begin > length:
            best, length = (begin + k - 1) // 2, k - begin
        begin = k + 1
    return best


def all_around(trial: Trial, count: int, speeds: Sequence[float], sides: Sequence[float] = (0.0,)) -> Iterator[Stroke]:
    """Yield strokes in every direction, and more of them towards the balls: kicks, banks, caroms, safeties."""
    cue, targets, others = standing(trial.match)
    aims = list(np.linspace(-math.pi, math.pi, count, endpoint=False))
    balls = targets if trial.match.layout.pockets else others
    if len(balls):
        near = balls[np.argsort(np.hypot(*(balls - cue).T), kind="stable")][:6]
        for x, y in near - cue:
            half = math.asin(min(1.0, 2.0 * trial.radius / math.hypot(x, y)))
            aims += list(math.atan2(y, x) + 0.97 * half * np.linspace(-1.0, 1.0, max(count // 6, 5)))
    for speed, side, aim in product(speeds, sides, aims):
        yield Stroke(aim=float(aim), speed=speed, side=side)


def breaks(trial: Trial) -> Iterator[Stroke]:
    """Yield opening strokes of pool: hard, full or nearly so on what stands nearest."""
    cue, targets, _ = standing(trial.match)
    x, y = targets[np.argmin(np.hypot(*(targets - cue).T))] - cue
    half = 2.0 * trial.radius / math.hypot(x, y)
    for speed, part in product((7.5, 9.0), (-0.6, -0.3, -0.1, -0.03, 0.0, 0.03, 0.1, 0.3, 0.6)):
        yield Stroke(aim=math.atan2(y, x) + part * half, speed=speed, height=0.05)
