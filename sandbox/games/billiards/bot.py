"""Bots that play billiards.

A bot lists candidate strokes by geometry, simulates them on the exact engine, lets the rules judge the results, and
plays the stroke with the highest mean value under its own aiming error. `shot_search` provides candidates and values,
`parse_bots` parses players such as `bot:0.5`, and `BilliardsPolicy` plays headless games.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from sandbox.echo import short_repr
from sandbox.engines.exact.tabletop.shots import Table
from sandbox.games.billiards.game import BilliardsRules
from sandbox.games.billiards.headless import FramePlan
from sandbox.games.billiards.match import Match
from sandbox.games.billiards.placement import spread
from sandbox.games.billiards.rules.base import Decision, GameError, ShotCall
from sandbox.games.billiards.shot_search import (
    ShotEvaluator,
    best_pot_chance,
    break_candidates,
    directions_all_around,
    pot_candidates,
    straight_pots,
)
from sandbox.games.contract import Rules, StepInfo
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke
from sandbox.scene.random_streams import Stream, draws

MAX_AIM_ERROR, MIN_AIM_ERROR = 0.03, 0.0003
"""rad: standard deviations of the aim at skill 0 and at skill 1; between them, the interpolation is geometric"""

MAX_SPEED_ERROR = 0.1
"""relative standard deviation of the speed at skill 0; a tenth of it at skill 1"""

FINALISTS = 10
"""number of best candidates that are simulated with errors"""

ERROR_SAMPLES = 8
"""number of simulations with errors per candidate"""

GOOD_VALUE = 0.45
"""value of a pot above which no other strokes are searched"""


@dataclass(frozen=True)
class BilliardsBot:
    """Player that searches for the stroke with the highest mean value under its own aiming error.

    The same match, skill and seed lead to the same shot.
    """

    skill: float = 0.7
    """0 to 1"""
    seed: int = 0
    _tables: dict[int, tuple[Match, Table]] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not 0.0 <= self.skill <= 1.0:
            raise GameError(f"skill {self.skill:g} is out of range; it should be 0 to 1")

    @property
    def sigma(self) -> float:
        """Standard deviation of the aim, rad."""
        return MAX_AIM_ERROR * math.pow(MIN_AIM_ERROR / MAX_AIM_ERROR, self.skill)

    @property
    def speed_error(self) -> float:
        """Relative standard deviation of the speed."""
        return MAX_SPEED_ERROR * math.pow(0.1, self.skill)

    def decide(self, match: Match) -> Decision:
        """Return the decision after which the next shot is best for this player, by `best_pot_chance`."""
        player, best, best_value = match.turn, match.choices.decisions[0], -math.inf
        for decision in match.choices.decisions:
            if decision == "claim":
                return decision
            after = match.decide(decision)
            good = 1.0 if after.over else best_pot_chance(after, self.sigma) * (1.0 if after.turn == player else -1.0)
            if decision.startswith("rerack"):
                good = 0.3 if after.turn == player else -0.3
            if good > best_value:
                best, best_value = decision, good
        return best

    def plan(self, match: Match) -> FramePlan:
        """Return the next shot, with the aiming error of the player."""
        plan = self.intend(match)
        return replace(plan, stroke=self.with_error(plan.stroke, match.shots))

    def intend(self, match: Match) -> FramePlan:
        """Return the intended shot, without error."""
        table, place = self._table(match), None
        if match.state.in_hand is not None:
            place = self._best_position(match)
            match = match.place(place)
        table = table.with_balls(dict(zip(match.layout.names, match.position, strict=True)))
        evaluator = ShotEvaluator(match, table, self.sigma)
        strokes = self._strokes(evaluator)
        ranked = self._ranked(evaluator, strokes)
        if match.layout.pockets and not match.state.opening and (not ranked or ranked[0][0] < GOOD_VALUE):
            ranked += self._ranked(evaluator, list(directions_all_around(evaluator, 60, (1.5, 3.0))))
        ranked.sort(key=lambda each: -each[0])
        best = self._most_robust(evaluator, ranked[:FINALISTS])
        return FramePlan(best[0], best[1], place)

    def with_error(self, stroke: Stroke, number: int) -> Stroke:
        """Return a stroke with the random error of the shot `number` of a frame."""
        random = draws(Stream.STROKE, self.seed, number)
        angle_error, relative_error = random.standard_normal(2).tolist()
        return _with_error(stroke, angle_error * self.sigma, relative_error * self.speed_error)

    def _strokes(self, evaluator: ShotEvaluator) -> list[Stroke]:
        match = evaluator.match
        if not match.layout.pockets:
            rail = match.rules.name == "straight-rail"
            speeds, sides = ((0.8, 1.5, 2.5), (0.0,)) if rail else ((3.0, 4.5, 6.0), (-0.35, 0.0, 0.35))
            return list(directions_all_around(evaluator, 72, speeds, sides))
        if match.state.opening:
            if match.rules.name == "snooker":
                return list(directions_all_around(evaluator, 12, (2.0, 2.8), (-0.3, 0.3)))
            return list(break_candidates(evaluator))
        return pot_candidates(evaluator)

    def _ranked(self, evaluator: ShotEvaluator, strokes: list[Stroke]) -> list[tuple[float, Stroke, ShotCall]]:
        """Return the strokes with their values without error and their calls, best first."""
        found = []
        for stroke in strokes:
            made = evaluator.outcome(stroke)
            found.append((evaluator.value_of(made), stroke, ShotCall() if made is None else made[1]))
        return sorted(found, key=lambda each: -each[0])

    def _most_robust(
        self, evaluator: ShotEvaluator, ranked: list[tuple[float, Stroke, ShotCall]]
    ) -> tuple[Stroke, ShotCall]:
        """Return the stroke and call with the highest mean value over random errors of this player."""
        random = draws(Stream.TRIAL, self.seed, evaluator.match.shots)
        errors = random.standard_normal((ERROR_SAMPLES, 2)) * (self.sigma, self.speed_error)
        best, best_value = ranked[0], -math.inf
        for good, stroke, call in ranked:
            values = [
                evaluator.value_of(evaluator.outcome(_with_error(stroke, *error), call)) for error in errors.tolist()
            ]
            mean = (good + sum(values)) / (1 + ERROR_SAMPLES)
            if mean > best_value:
                best, best_value = (good, stroke, call), mean
        return best[1], best[2]

    def _best_position(self, match: Match) -> Point:
        """Return the place of a cue ball in hand with the highest probability of a straight pot, m."""
        at = match.position[match.layout.number[match.cue]]
        place = match.state.in_hand
        if match.state.opening or place is None or not match.layout.pockets:
            return at
        radius = match.layout.radius[match.layout.number[match.cue]]
        others = [disc for name, disc in match.on_table.items() if name != match.cue]
        best, best_value = at, straight_pots(match, self.sigma).chance.max(initial=0.0)
        for point in spread(match.layout, place, radius, others)[::2]:
            chance = straight_pots(match.place(point), self.sigma).chance.max(initial=0.0)
            if chance > best_value + 1e-9:
                best, best_value = point, chance
        return best

    def _table(self, match: Match) -> Table:
        """Return the table on the exact engine, compiled once per layout."""
        key = id(match.layout)
        if key not in self._tables or self._tables[key][0].layout is not match.layout:
            self._tables.clear()
            self._tables[key] = (match, Table(match.scene))
        return self._tables[key][1]


def _with_error(stroke: Stroke, angle_error: float, relative_error: float) -> Stroke:
    """Return a stroke with an error of the aim, rad, and a relative error of the speed."""
    speed = min(max(stroke.speed * (1.0 + relative_error), 1e-3), 100.0)
    return stroke.model_copy(update={"aim": stroke.aim + angle_error, "speed": speed})


DEFAULT_SKILL = 0.7
"""skill of `bot` without a number"""


def parse_bots(text: str, seed: int = 0) -> tuple[BilliardsBot, ...]:
    """Return the players of `bot:SKILL,bot:SKILL`, one or two, each with a seed of its own.

    Raises:
        GameError: the text is invalid.
    """
    found = []
    for number, each in enumerate(text.split(",")):
        kind, colon, skill = each.strip().partition(":")
        try:
            value = float(skill) if colon else DEFAULT_SKILL
        except ValueError:
            value = -1.0
        if kind != "bot" or not 0.0 <= value <= 1.0:
            raise GameError(f"unknown player {short_repr(each.strip())}; use bot or bot:SKILL, skill 0 to 1")
        found.append(BilliardsBot(value, 2 * seed + number))
    if len(found) > 2:
        raise GameError(f"{len(found)} players cannot play; 1 or 2 can")
    return tuple(found)


class BilliardsPolicy:
    """Policy of headless games: bots of equal skill play for both players through the controls of `BilliardsRules`."""

    def __init__(self, seed: int = 0, skill: float = DEFAULT_SKILL) -> None:
        """Create a bot for each of two players.

        Args:
            seed: seed of the aiming errors.
            skill: skill of both bots, 0 to 1.
        """
        self._bots = tuple(BilliardsBot(skill, 2 * seed + number) for number in range(2))
        self._decided: tuple[int, int] | None = None  # shots and player of the last decision

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return the inputs of a decision, or of a call, a placement and a stroke; none while balls move."""
        if not isinstance(rules, BilliardsRules) or not rules.waiting:
            return ()
        match = rules.match
        bot = self._bots[match.turn]
        if match.choices.decisions and match.rules.name != "free" and self._decided != (match.shots, match.turn):
            self._decided = match.shots, match.turn
            return (rules.decision_input(bot.decide(match)),)
        plan = bot.plan(match)
        place = rules.place_inputs(plan.place) if plan.place is not None else ()
        return (*rules.call_inputs(plan.call), *place, *rules.stroke_inputs(plan.stroke))
