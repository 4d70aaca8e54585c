"""Predictability horizon of a shot: the time until which two almost equal strokes stay together.

A collision changes the direction of the struck ball by 1/(2R cos φ) rad per metre of offset of the balls' centres. Over
a path g to the next collision, this multiplies the offset by about g/(2R). Errors therefore grow by a factor per
collision, and each additional digit of aim extends the horizon by the time in which errors grow tenfold.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.engines.exact.common.requirements import overlap_of
from sandbox.engines.exact.tabletop.shot_result import ShotResult
from sandbox.jsonable import in_json
from sandbox.measure.shots.shot import (
    ShotSetup,
    Spread,
    perturb_stroke,
    shot_setup,
    without_miscues,
)
from sandbox.scene.compile.scene import Scene

SAMPLE_TIMES = 4000
"""Number of times at which two shots are compared; the first separation is then bisected."""

MAX_HALVINGS = 40
"""Halvings of the interval of the first separation: 2⁻⁴⁰ is below rounding."""


class ShotSeparation:
    """Distances between the balls of two shots over time."""

    def __init__(self, one: ShotResult, other: ShotResult) -> None:
        """Compare two shots.

        Args:
            one: a shot with its paths.
            other: another one of the same N balls.

        Raises:
            ValueError: a shot was simulated without its paths.
        """
        self._shots = one, other
        self.end = max(one.duration, other.duration)
        """s, time when both are at rest"""
        # Two balls that fall shortly after one another are apart by the width of the pocket, which means nothing.
        fall_one, fall_other = _fall_times(one), _fall_times(other)
        self._until = np.full(len(one.names), np.inf)
        for number, name in enumerate(one.names):
            if name in fall_one and one.pocketed[name] == other.pocketed.get(name):
                self._until[number] = np.nextafter(min(fall_one[name], fall_other[name]), 0.0)

    def distances(self, times: FloatArray) -> FloatArray:
        """Return the distance of each ball between the two shots, (T, N) m.

        That of a ball that falls into the same pocket in both stays as it is at the first fall.

        Args:
            times: (T,) s.
        """
        one, other = self._shots
        found = np.hypot(*np.moveaxis(one.at(times) - other.at(times), -1, 0))
        fallen_balls = np.flatnonzero(np.isfinite(self._until))
        if len(fallen_balls):
            last = np.hypot(
                *np.moveaxis(one.at(self._until[fallen_balls]) - other.at(self._until[fallen_balls]), -1, 0)
            )
            for k, number in enumerate(fallen_balls.tolist()):
                found[times > self._until[number], number] = last[k, number]
        return np.asarray(found)

    @property
    def largest(self) -> float:
        """Largest distance of any ball, m."""
        return float(self._samples[1].max(initial=0.0))

    def first_above(self, tolerance: float) -> tuple[float, int] | None:
        """Return the first time, s, at which a distance exceeds a tolerance, m, and the index of the ball; or None."""
        times, distances = self._samples
        above = np.flatnonzero((distances > tolerance).any(axis=1))
        if not len(above):
            return None
        k = int(above[0])
        low, high = float(times[max(k - 1, 0)]), float(times[k])
        for _ in range(MAX_HALVINGS):
            middle = 0.5 * (low + high)
            if (self.distances(np.array([middle])) > tolerance).any():
                high = middle
            else:
                low = middle
        return high, int(self.distances(np.array([high]))[0].argmax())

    @cached_property
    def _samples(self) -> tuple[FloatArray, FloatArray]:
        """Evenly spaced times, (T,) s, and the distances at these, (T, N) m."""
        times = np.linspace(0.0, self.end, SAMPLE_TIMES + 1)
        return times, self.distances(times)


def _fall_times(outcome: ShotResult) -> Mapping[str, float]:
    """Return the time at which each potted ball fell, s."""
    return {event.ball: event.time for event in outcome.events if event.kind == "pocket"}


PERTURBATION = 1e-9
"""rad of aim, or m of position: default perturbation"""

TOLERANCE = 1e-3
"""m, distance up to which two positions count as equal"""

PERTURBATION_LEVELS = tuple(10.0**-k for k in range(2, 13))
"""rad, perturbations of the aim from which the growth of the horizon is measured"""

By = Literal["aim", "place"]


@dataclass(frozen=True)
class Separation:
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
    radius: float = field(metadata=in_json(omit=True))
    """m, radius of the struck ball, which is the second tolerance"""
    duration: float
    """s, duration of the intended shot"""
    separation: Separation = field(metadata=in_json(inline=True))
    """separation beyond the tolerance"""
    by_a_radius: Separation
    """separation beyond a radius"""
    player: Separation | None
    """separation beyond a radius, with one variable of the stroke off by one standard deviation of a player; None
    without a spread"""
    ladder: tuple[Separation, ...]
    """separation beyond the tolerance, from larger perturbations of the aim to smaller ones"""

    json_head: ClassVar = ("by", "tolerance", "duration", "separation", "by_a_radius", "player", "digits_per_second")
    json_name: ClassVar = "HorizonDocument"

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
        # Digits are exact and times scatter, so that times are fitted over digits and the slope is inverted.
        slope = float(times @ digits) / float(digits @ digits)
        return 1.0 / slope if slope > 0.0 else None


def horizon(
    scene: Scene | ShotSetup,
    shot: str | None = None,
    *,
    nudge: float = PERTURBATION,
    by: By = "aim",
    tolerance: float = TOLERANCE,
    spread: Spread | None = None,
    ladder: Sequence[float] = PERTURBATION_LEVELS,
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

    Example:
        >>> found = sandbox.horizon(sandbox.load("8-ball"), nudge=1e-3)
        >>> found.separation.ball is not None  # a ball moves by more than 1 mm, the tolerance
        True
    """
    if not (nudge > 0.0 and tolerance > 0.0):
        raise ValueError(f"a nudge of {nudge:g} and a tolerance of {tolerance:g} m; both must be greater than 0")
    setup = shot_setup(scene, shot)
    nominal = setup.simulate(record_paths=True)
    others = _perturb_aim(setup, nudge) if by == "aim" else _perturb_position(setup, nudge)
    pairs = [ShotSeparation(nominal, each) for each in others]
    levels = []
    for level in sorted(ladder, reverse=True):
        aimed = [ShotSeparation(nominal, each) for each in _perturb_aim(setup, level)]
        levels.append(_first_separation(nominal, aimed, level, tolerance))
    radius = float(setup.table.scene.bodies.radius[setup.ball_index(setup.ball)])
    player = None
    if spread is not None:
        players = [ShotSeparation(nominal, each) for each in _perturb_as_player(setup, spread)]
        player = _first_separation(nominal, players, spread.aim, radius)
    return Horizon(
        by=by,
        tolerance=tolerance,
        radius=radius,
        duration=nominal.duration,
        separation=_first_separation(nominal, pairs, nudge, tolerance),
        by_a_radius=_first_separation(nominal, pairs, nudge, radius),
        player=player,
        ladder=tuple(levels),
    )


def _perturb_aim(setup: ShotSetup, amount: float) -> list[ShotResult]:
    """Return the shots with the aim changed to both sides by an amount, rad."""
    return [setup.simulate(setup.changed("aim", change), record_paths=True) for change in (-amount, amount)]


def _perturb_position(setup: ShotSetup, amount: float) -> list[ShotResult]:
    """Return the shots with the struck ball moved by an amount, m, in the four directions in which it has room."""
    table, number = setup.table, setup.ball_index(setup.ball)
    x, y = table.position[number].tolist()
    found = []
    for moved in (x - amount, y), (x + amount, y), (x, y - amount), (x, y + amount):
        position = table.position
        position[number] = moved
        if overlap_of(table.scene, position) is None:
            found.append(table.with_balls({setup.ball: moved}).shoot(setup.stroke, setup.ball, record_paths=True))
    if not found:
        raise ValueError(f"{setup.ball!r} has no room to be moved by {amount:g} m")
    return found


def _perturb_as_player(setup: ShotSetup, spread: Spread) -> list[ShotResult]:
    """Return the shots with one variable of the stroke off by one standard deviation, to both sides."""
    deviations = np.diag([spread.aim, spread.speed, spread.side, spread.height])
    strokes, _ = without_miscues(perturb_stroke(setup.stroke, np.concatenate((-deviations, deviations))))
    return [setup.simulate(stroke, record_paths=True) for stroke in strokes]


def _first_separation(
    nominal: ShotResult, pairs: Sequence[ShotSeparation], perturbation: float, tolerance: float
) -> Separation:
    """Return the first separation beyond a tolerance, m, of any of some pairs of shots."""
    found = [(*first, pair) for pair in pairs if (first := pair.first_above(tolerance)) is not None]
    largest = max((pair.largest for pair in pairs), default=0.0)
    if not found:
        return Separation(perturbation, None, None, 0, None, None, largest)
    time, number, pair = min(found, key=lambda each: each[0])
    first_hit, hits = _longest_chain(nominal, nominal.names[number], time)
    per_hit = per_second = None
    if first_hit is not None:
        initial = float(pair.distances(np.array([first_hit])).max())
        if 0.0 < initial < tolerance and first_hit < time:
            growth = math.log(tolerance / initial)
            per_hit, per_second = math.exp(growth / hits), growth / (time - first_hit)
    return Separation(perturbation, time, nominal.names[number], hits, per_hit, per_second, largest)


def _longest_chain(outcome: ShotResult, ball: str, until: float) -> tuple[float | None, int]:
    """Return the start, s, and the length of the longest chain of collisions that leads to a ball up to a time, s."""
    chains: dict[str, tuple[float | None, int]] = dict.fromkeys(outcome.names, (None, 0))
    for event in outcome.events:
        if event.time > until:
            break
        if event.kind == "ball" and event.partner is not None:
            began, hits = max(chains[event.ball], chains[event.partner], key=lambda chain: chain[1])
            chains[event.ball] = chains[event.partner] = event.time if began is None else began, hits + 1
    return chains[ball]
