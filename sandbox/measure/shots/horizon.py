"""Horizon: until when a shot can be foretold, if how it is struck is known only so well.

A hit turns what it meets by 1/(2R cos φ) for each metre that the balls' centres are off; over a way g to the next hit
that makes 2R out of it g/(2R) times as much. So errors grow by a factor a hit, and every digit of aim buys as long as
that factor takes to make ten.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from sandbox.engines.exact.engine import overlap_of
from sandbox.engines.exact.rolling.outcome import Outcome
from sandbox.measure.shots.attempt import Attempt, attempt_of
from sandbox.measure.shots.parting import Parting
from sandbox.measure.shots.spread import Spread, sound, strayed
from sandbox.scene.model import Scene

NUDGE = 1e-9
"""rad, or m"""

TOLERANCE = 1e-3
"""m, of what is still the same place"""

LADDER = tuple(10.0**-k for k in range(2, 13))
"""rad: nudges of aim that tell how horizons go with them"""

By = Literal["aim", "place"]


@dataclass(frozen=True, slots=True)
class Parted:
    """When shots that begin a nudge apart are no longer the same."""

    nudge: float
    """rad of aim, or m of place"""
    time: float | None
    """s, when a ball first is farther from itself than the tolerance; None where none ever is"""
    ball: str | None
    """which"""
    hits: int
    """balls' hits in a row, one by another, that led to it"""
    growth_per_hit: float | None
    """by what the distance grew each time, from the first hit on; None where nothing hit"""
    growth_per_second: float | None
    """1/s, of its logarithm, likewise"""
    farthest: float
    """m, by which a ball is elsewhere at most, up to the end"""


@dataclass(frozen=True, eq=False, slots=True)
class Horizon:
    """Until when a shot can be foretold."""

    by: By
    tolerance: float
    """m"""
    radius: float
    """m, of the ball that is struck: the second tolerance"""
    duration: float
    """s, of the shot as it is meant"""
    parted: Parted
    """by more than the tolerance"""
    by_a_radius: Parted
    """by more than a radius"""
    player: Parted | None
    """by more than a radius, where one thing of the stroke is off by one of a player's standard deviations"""
    ladder: tuple[Parted, ...]
    """by more than the tolerance, from larger nudges of aim to smaller ones"""

    @property
    def digits_per_second(self) -> float | None:
        """How many more digits of aim it takes to foretell one more second.

        The slope of a line through the ladder's horizons by least squares; None where fewer than two are known.
        """
        known = [(each.time, -math.log10(each.nudge)) for each in self.ladder if each.time is not None]
        if len({time for time, _ in known}) < 2:
            return None
        times, digits = np.asarray(known).T
        times, digits = times - times.mean(), digits - digits.mean()
        # Digits are what is exact and times what scatters: so times are fitted over digits, and turned round.
        slope = float(times @ digits) / float(digits @ digits)
        return 1.0 / slope if slope > 0.0 else None

    def document(self) -> dict[str, Any]:
        """Return it as one JSON object."""
        return {
            "by": self.by,
            "tolerance": self.tolerance,
            "duration": self.duration,
            **asdict(self.parted),
            "by_a_radius": asdict(self.by_a_radius),
            "player": None if self.player is None else asdict(self.player),
            "digits_per_second": self.digits_per_second,
            "ladder": [asdict(each) for each in self.ladder],
        }


def horizon(
    scene: Scene | Attempt,
    shot: str | None = None,
    *,
    nudge: float = NUDGE,
    by: By = "aim",
    tolerance: float = TOLERANCE,
    spread: Spread | None = None,
    ladder: Sequence[float] = LADDER,
) -> Horizon:
    """Find the time from which on a shot is unpredictable.

    Args:
        scene: with a `[surface]` and a `[[shot]]`.
        shot: which, by its name; by default the first.
        nudge: by how much shots differ: rad of aim to both sides, or m of the struck ball's place to four.
        by: which of these.
        tolerance: m, by which a ball may be elsewhere.
        spread: of a player, to be told of too.
        ladder: rad, further nudges of aim, which tell what digits are worth.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine lacks something.
        Exhaustion: a shot has too many events.
        ValueError: the nudge or the tolerance is not positive; or the ball has no room to be nudged.
    """
    if not (nudge > 0.0 and tolerance > 0.0):
        raise ValueError(f"a nudge of {nudge:g} and a tolerance of {tolerance:g} m; both are more than 0")
    attempt = attempt_of(scene, shot)
    meant = attempt.played(ways=True)
    others = _aside(attempt, nudge) if by == "aim" else _elsewhere(attempt, nudge)
    pairs = [Parting(meant, each) for each in others]
    rungs = []
    for rung in sorted(ladder, reverse=True):
        aside = [Parting(meant, each) for each in _aside(attempt, rung)]
        rungs.append(_parted(meant, aside, rung, tolerance))
    radius = float(attempt.table.scene.bodies.radius[attempt.number(attempt.ball)])
    player = None
    if spread is not None:
        players = [Parting(meant, each) for each in _as_a_player(attempt, spread)]
        player = _parted(meant, players, spread.aim, radius)
    return Horizon(
        by,
        tolerance,
        radius,
        meant.duration,
        _parted(meant, pairs, nudge, tolerance),
        _parted(meant, pairs, nudge, radius),
        player,
        tuple(rungs),
    )


def _aside(attempt: Attempt, nudge: float) -> list[Outcome]:
    return [attempt.played(attempt.changed("aim", side), ways=True) for side in (-nudge, nudge)]


def _elsewhere(attempt: Attempt, nudge: float) -> list[Outcome]:
    """Play from beside where the ball stands, on all four sides that have room for it."""
    table, number = attempt.table, attempt.number(attempt.ball)
    x, y = table.position[number].tolist()
    played = []
    for place in (x - nudge, y), (x + nudge, y), (x, y - nudge), (x, y + nudge):
        position = table.position
        position[number] = place
        if overlap_of(table.scene, position) is None:
            moved = table.with_balls({attempt.ball: place})
            played.append(moved.shoot(attempt.stroke, attempt.ball, ways=True))
    if not played:
        raise ValueError(f"{attempt.ball!r} has no room to stand {nudge:g} m elsewhere")
    return played


def _as_a_player(attempt: Attempt, spread: Spread) -> list[Outcome]:
    """Play what is off by one standard deviation, in one thing at a time and to either side."""
    off = np.diag([spread.aim, spread.speed, spread.side, spread.height])
    strokes, _ = sound(strayed(attempt.stroke, np.concatenate((-off, off))))
    return [attempt.played(stroke, ways=True) for stroke in strokes]


def _parted(meant: Outcome, pairs: Sequence[Parting], nudge: float, tolerance: float) -> Parted:
    """Return when the first of some pairs parts."""
    found = [(*when, pair) for pair in pairs if (when := pair.beyond(tolerance)) is not None]
    farthest = max((pair.farthest for pair in pairs), default=0.0)
    if not found:
        return Parted(nudge, None, None, 0, None, None, farthest)
    time, number, pair = min(found, key=lambda each: each[0])
    first, hits = _chain(meant, meant.names[number], time)
    per_hit = per_second = None
    if first is not None:
        began = float(pair.apart(np.array([first])).max())
        if 0.0 < began < tolerance and first < time:
            grown = math.log(tolerance / began)
            per_hit, per_second = math.exp(grown / hits), grown / (time - first)
    return Parted(nudge, time, meant.names[number], hits, per_hit, per_second, farthest)


def _chain(outcome: Outcome, ball: str, until: float) -> tuple[float | None, int]:
    """Return when the longest chain of hits that leads to a ball by a time began, s, and how many these are."""
    chains: dict[str, tuple[float | None, int]] = dict.fromkeys(outcome.names, (None, 0))
    for event in outcome.events:
        if event.time > until:
            break
        if event.kind == "ball" and event.partner is not None:
            began, hits = max(chains[event.ball], chains[event.partner], key=lambda chain: chain[1])
            chains[event.ball] = chains[event.partner] = event.time if began is None else began, hits + 1
    return chains[ball]
