"""Horizon: time up to which a shot is predictable, given the accuracy of the stroke.

A collision changes the direction of the struck ball by 1/(2R cos φ) rad per metre of offset of the balls' centres. Over
a path g to the next collision, this multiplies the offset by about g/(2R). Errors therefore grow by a factor per
collision, and each additional digit of aim extends the horizon by the time in which errors grow tenfold.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from sandbox.engines.exact.engine import overlap_of
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.measure.shots.attempt import Attempt, attempt_of
from sandbox.measure.shots.parting import Parting
from sandbox.measure.shots.spread import Spread, sound, strayed
from sandbox.scene.scene import Scene

NUDGE = 1e-9
"""rad, or m"""

TOLERANCE = 1e-3
"""m, distance up to which two positions count as equal"""

LADDER = tuple(10.0**-k for k in range(2, 13))
"""rad, perturbations of the aim from which the growth of the horizon is measured"""

By = Literal["aim", "place"]


@dataclass(frozen=True, slots=True)
class Parted:
    """Separation of shots that start with a small perturbation."""

    nudge: float
    """size of the perturbation: rad of aim, or m of position"""
    time: float | None
    """s, first time at which a ball is farther than the tolerance from its unperturbed position; None if there is none
    """
    ball: str | None
    """name of that ball"""
    hits: int
    """length of the longest chain of ball-ball collisions that leads to that ball"""
    growth_per_hit: float | None
    """factor by which the distance grew at each collision, from the first on; None without collisions"""
    growth_per_second: float | None
    """1/s, growth rate of the logarithm of the distance; None without collisions"""
    farthest: float
    """m, largest distance of a ball from its unperturbed position, up to the end"""


@dataclass(frozen=True, eq=False, slots=True)
class Horizon:
    """Predictability horizon of a shot."""

    by: By
    """perturbed quantity: `aim`, or `place` for the position of the struck ball"""
    tolerance: float
    """m, tolerance of the final positions"""
    radius: float
    """m, radius of the struck ball, which is the second tolerance"""
    duration: float
    """s, duration of the intended shot"""
    parted: Parted
    """separation beyond the tolerance"""
    by_a_radius: Parted
    """separation beyond a radius"""
    player: Parted | None
    """separation beyond a radius, with one variable of the stroke off by one standard deviation of a player; None
    without a spread"""
    ladder: tuple[Parted, ...]
    """separation beyond the tolerance, from larger perturbations of the aim to smaller ones"""

    @property
    def digits_per_second(self) -> float | None:
        """Additional digits of aim needed to predict one more second.

        Slope of a least-squares line through the horizons of the ladder; None if fewer than two are known.
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
        """Return the horizon as one JSON object."""
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
    """Find the time after which a shot is unpredictable.

    Args:
        scene: scene with a `[surface]` and a `[[shot]]`.
        shot: name of the shot; default: the first.
        nudge: size of the perturbation: rad of aim on both sides, or m of the struck ball's position in four
            directions.
        by: perturbed quantity, `aim` or `place` (position).
        tolerance: distance beyond which a ball is elsewhere, m.
        spread: standard deviations of a player, for `Horizon.player`.
        ladder: further perturbations of the aim, rad, for `Horizon.digits_per_second`.

    Raises:
        NoSuchShotError: the scene has no such shot.
        Refusal: the exact engine does not support the scene.
        Exhaustion: a shot has too many events.
        ValueError: the perturbation or the tolerance is not positive, or the ball has no room to be moved.
    """
    if not (nudge > 0.0 and tolerance > 0.0):
        raise ValueError(f"a nudge of {nudge:g} and a tolerance of {tolerance:g} m; both must be greater than 0")
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


def _aside(attempt: Attempt, nudge: float) -> list[ShotResult]:
    return [attempt.played(attempt.changed("aim", side), ways=True) for side in (-nudge, nudge)]


def _elsewhere(attempt: Attempt, nudge: float) -> list[ShotResult]:
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
        raise ValueError(f"{attempt.ball!r} has no room to be moved by {nudge:g} m")
    return played


def _as_a_player(attempt: Attempt, spread: Spread) -> list[ShotResult]:
    """Play what is off by one standard deviation, in one thing at a time and to either side."""
    off = np.diag([spread.aim, spread.speed, spread.side, spread.height])
    strokes, _ = sound(strayed(attempt.stroke, np.concatenate((-off, off))))
    return [attempt.played(stroke, ways=True) for stroke in strokes]


def _parted(meant: ShotResult, pairs: Sequence[Parting], nudge: float, tolerance: float) -> Parted:
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


def _chain(outcome: ShotResult, ball: str, until: float) -> tuple[float | None, int]:
    """Return when the longest chain of hits that leads to a ball by a time began, s, and how many these are."""
    chains: dict[str, tuple[float | None, int]] = dict.fromkeys(outcome.names, (None, 0))
    for event in outcome.events:
        if event.time > until:
            break
        if event.kind == "ball" and event.partner is not None:
            began, hits = max(chains[event.ball], chains[event.partner], key=lambda chain: chain[1])
            chains[event.ball] = chains[event.partner] = event.time if began is None else began, hits + 1
    return chains[ball]
