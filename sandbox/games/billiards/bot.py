"""Bot: a player of some skill, who plans on the exact engine and errs as people do.

Players by name, as a command line tells them: `bot:0.5`.

The bot: it looks for shots by geometry, tries them on the exact engine, and has the rules judge them.

`ease.py` tells how easy a shot is, `aims.py` which strokes to try, `trial.py` what they lead to, `bot.py` chooses.
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
    break_candidates,
    directions_all_around,
    ease,
    pot_candidates,
    straight,
)
from sandbox.games.contract import Rules, StepInfo
from sandbox.scene.description.base import Point
from sandbox.scene.description.surface import Stroke
from sandbox.scene.random_streams import Stream, draws

WORST, BEST = 0.03, 0.0003
"""rad: the error of the aim, one standard deviation, at skill 0 and 1; in between by its logarithm"""

OFF = 0.1
"""of the speed, likewise, at skill 0; 0.01 at skill 1"""

FINALISTS = 10
"""strokes that are tried with errors"""

ERRORS = 8
"""times each"""

GOOD = 0.45
"""worth above which no more than straight pots are looked at"""


@dataclass(frozen=True)
class BilliardsBot:
    """A player who aims by geometry, tries strokes on the exact engine, and plays what is best on average.

    The same match, skill and seed lead to the same shot. It knows its own error, and chooses by it.
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
        """The error of the aim, rad, one standard deviation."""
        return WORST * math.pow(BEST / WORST, self.skill)

    @property
    def off(self) -> float:
        """The error of the speed, as a share of it."""
        return OFF * math.pow(0.1, self.skill)

    def decide(self, match: Match) -> Decision:
        """Return the decision after which the table is best for this player, by how easy the next shot is."""
        me, best, top = match.turn, match.choices.decisions[0], -math.inf
        for decision in match.choices.decisions:
            if decision == "claim":
                return decision
            after = match.decide(decision)
            good = 1.0 if after.over else ease(after, self.sigma) * (1.0 if after.turn == me else -1.0)
            if decision.startswith("rerack"):
                good = 0.3 if after.turn == me else -0.3
            if good > top:
                best, top = decision, good
        return best

    def plan(self, match: Match) -> FramePlan:
        """Return the shot that it plays, its error in it."""
        plan = self.intend(match)
        return replace(plan, stroke=self.erred(plan.stroke, match.shots))

    def intend(self, match: Match) -> FramePlan:
        """Return the shot that it means to play."""
        table, place = self._table(match), None
        if match.state.in_hand is not None:
            place = self._best_place(match)
            match = match.place(place)
        table = table.with_balls(dict(zip(match.layout.names, match.position, strict=True)))
        trial = ShotEvaluator(match, table, self.sigma)
        strokes = self._strokes(trial)
        ranked = self._ranked(trial, strokes)
        if match.layout.pockets and not match.state.opening and (not ranked or ranked[0][0] < GOOD):
            ranked += self._ranked(trial, list(directions_all_around(trial, 60, (1.5, 3.0))))
        ranked.sort(key=lambda each: -each[0])
        best = self._steadiest(trial, ranked[:FINALISTS])
        return FramePlan(best[0], best[1], place)

    def erred(self, stroke: Stroke, number: int) -> Stroke:
        """Return a stroke as it is really played, the number-th of a frame."""
        random = draws(Stream.STROKE, self.seed, number)
        aside, faster = random.standard_normal(2).tolist()
        return _off(stroke, aside * self.sigma, faster * self.off)

    def _strokes(self, trial: ShotEvaluator) -> list[Stroke]:
        match = trial.match
        if not match.layout.pockets:
            rail = match.rules.name == "straight-rail"
            speeds, sides = ((0.8, 1.5, 2.5), (0.0,)) if rail else ((3.0, 4.5, 6.0), (-0.35, 0.0, 0.35))
            return list(directions_all_around(trial, 72, speeds, sides))
        if match.state.opening:
            if match.rules.name == "snooker":
                return list(directions_all_around(trial, 12, (2.0, 2.8), (-0.3, 0.3)))
            return list(break_candidates(trial))
        return pot_candidates(trial)

    def _ranked(self, trial: ShotEvaluator, strokes: list[Stroke]) -> list[tuple[float, Stroke, ShotCall]]:
        """Return strokes with what they are worth without an error, the best first."""
        found = []
        for stroke in strokes:
            made = trial.outcome(stroke)
            found.append((trial.worth(made), stroke, ShotCall() if made is None else made[1]))
        return sorted(found, key=lambda each: -each[0])

    def _steadiest(self, trial: ShotEvaluator, ranked: list[tuple[float, Stroke, ShotCall]]) -> tuple[Stroke, ShotCall]:
        """Return the stroke that is worth most on average, with errors as this player makes them."""
        random = draws(Stream.TRIAL, self.seed, trial.match.shots)
        errors = random.standard_normal((ERRORS, 2)) * (self.sigma, self.off)
        best, top = ranked[0], -math.inf
        for good, stroke, call in ranked:
            tried = [trial.worth(trial.outcome(_off(stroke, *error), call)) for error in errors.tolist()]
            mean = (good + sum(tried)) / (1 + ERRORS)
            if mean > top:
                best, top = (good, stroke, call), mean
        return best[1], best[2]

    def _best_place(self, match: Match) -> Point:
        """Return where to put a cue ball in hand: from where the best straight shot is easiest."""
        at = match.position[match.layout.number[match.cue]]
        place = match.state.in_hand
        if match.state.opening or place is None or not match.layout.pockets:
            return at
        radius = match.layout.radius[match.layout.number[match.cue]]
        others = [disc for name, disc in match.on_table.items() if name != match.cue]
        best, top = at, straight(match, self.sigma).chance.max(initial=0.0)
        for point in spread(match.layout, place, radius, others)[::2]:
            chance = straight(match.place(point), self.sigma).chance.max(initial=0.0)
            if chance > top + 1e-9:
                best, top = point, chance
        return best

    def _table(self, match: Match) -> Table:
        """Return the match's table on the exact engine, made ready once."""
        key = id(match.layout)
        if key not in self._tables or self._tables[key][0].layout is not match.layout:
            self._tables.clear()
            self._tables[key] = (match, Table(match.scene))
        return self._tables[key][1]


def _off(stroke: Stroke, aside: float, faster: float) -> Stroke:
    """Return a stroke with an error of aim, rad, and of speed, as a share."""
    speed = min(max(stroke.speed * (1.0 + faster), 1e-3), 100.0)
    return stroke.model_copy(update={"aim": stroke.aim + aside, "speed": speed})


DEFAULT_SKILL = 0.7
"""skill of a bot of which none is told"""


def parse_bots(text: str, seed: int = 0) -> tuple[BilliardsBot, ...]:
    """Return the players of `bot:SKILL,bot:SKILL`, one or two, each with chances of its own.

    Raises:
        GameError: it names something else.
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
    """Policy of headless games: bots of one skill play for every player, by the controls of `BilliardsRules`."""

    def __init__(self, seed: int = 0, skill: float = DEFAULT_SKILL) -> None:
        """Create a bot for each of two players.

        Args:
            seed: seed of their errors.
            skill: 0 to 1.
        """
        self._bots = tuple(BilliardsBot(skill, 2 * seed + number) for number in range(2))
        self._decided: tuple[int, int] | None = None  # shots and player of the last decision

    def decide(self, info: StepInfo, rules: Rules) -> Sequence[tuple[str, float]]:  # noqa: ARG002
        """Return the inputs of a decision, or of a call, a placement and a stroke, as soon as every ball is at rest."""
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
