"""Search: which variants are worth a run. It refines near the front, and stops branches that are outdone.

It is bounded and steered by counted cost (`cost.py`), so that the same search tries the same variants in the same order
on every machine, unless a time limit ends it.

First each engine's substeps are doubled until it meets the tolerance, if it can, so that there is an answer; and the
ways together that are known to suit such a scene are tried. From its own settings on, the variants one choice away are
tried then: of those trials that nothing outdoes on the same engine, the one that matters most for what is asked. At
last the smallest number of substeps and of iterations that still meets the tolerance is closed in on.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle

from sandbox.measure.bounded_run import working
from sandbox.measure.told import Told
from sandbox.measure.tradeoff.front import outdone
from sandbox.measure.tradeoff.judge import Judge
from sandbox.measure.tradeoff.trial import Trial, tried
from sandbox.measure.tradeoff.variant import Space, Variant
from sandbox.trajectory import Trajectory

MARGIN = 0.7
"""A trial is outdone by one that has no more than this share of its counted cost and is at least as right; counted
costs say no more of the time that each takes."""
ENOUGH = 1e-6
"""Errors below this share of the tolerance are as good as none; where none is tolerated, of a single miss."""
SLOW = 0.2
"""The share of the effort that one variant's run may take, for each seed."""
FALLS = 0.8
"""Where half the step leaves more than this share of an error, it was of no use."""
FLAT = 2
"""So often it may be of none."""
FAR = 16
"""times its own substeps an engine goes at first: beyond, another way of doing things may be the cheaper one."""
WIDE = 0.8
"""The share of trials and effort after which nothing new is looked for, so that some is left to close in."""
LITTLE = 0.95
"""What leaves more than this share of the error of something cheaper is not gone on from."""

LEAST = 30.0
"""Counted cost, s, that a run with an engine's own settings may always have, however small the effort."""


@dataclass
class Search:
    """Trials so far, and what is tried next."""

    space: Space
    judges: Sequence[Judge]
    metric: str
    tolerance: float
    """in the unit of the metric: errors near it matter most"""
    budget: float | None
    """s for the whole run, where a cost is asked for"""
    effort: float
    """counted cost that all trials together may have, s; every engine's own settings are tried even so"""
    most: int
    """trials"""
    told: Told
    deadline: float = math.inf
    """by the clock of `working`, s"""
    known: Mapping[str, Trajectory] = field(default_factory=dict)
    """by engine: runs with its own settings that were made already"""
    trials: dict[Variant, Trial] = field(default_factory=dict)
    untried: set[Variant] = field(default_factory=set)
    """variants that would have cost too much"""
    interrupted: bool = False
    """by the user; what was tried till then is kept"""
    spent: float = 0.0
    """counted cost of all trials, s"""

    def run(self) -> list[Trial]:
        """Try variants until none is worth it, or the effort is at its end; return all trials in order."""
        try:
            self._look()
        except KeyboardInterrupt:
            self.interrupted = True
        return list(self.trials.values())

    def _look(self) -> None:
        expanded: set[Variant] = set()
        starts = [self._try(variant) for variant in self.space.starts()[: self.most] if working() < self.deadline]
        for start in starts:
            self._reach(start)
        by_engine = {start.variant.engine: start for start in starts if start is not None and start.status != "stopped"}
        for variant in self.space.suited():
            if variant.engine in by_engine and self._goes_on(WIDE):
                self._try(variant, by_engine[variant.engine])
        aims = (
            [self._near_tolerance, self._near_budget, self._cheap]
            if self.budget
            else [self._near_tolerance, self._cheap]
        )
        turns = {engine: cycle(aims) for engine in self.space.engines}
        while self._goes_on(WIDE):
            open_trials = [t for v, t in self.trials.items() if v not in expanded and self._promising(t)]
            if not open_trials:
                break
            # The engine that cost least so far is next: one that is slow leaves the others their share.
            engine = min({t.variant.engine for t in open_trials}, key=self._spent_on)
            best = min((t for t in open_trials if t.variant.engine == engine), key=next(turns[engine]))
            expanded.add(best.variant)
            for variant in self.space.near(best.variant):
                if self._goes_on(WIDE) and (best.status != "stopped" or variant.work < best.variant.work):
                    self._try(variant, best)
        self._close_in()

    def _reach(self, trial: Trial | None) -> None:
        """Double the substeps until the tolerance is met, or again and again leave the error what it is.

        What is missed is missed by 2 and by 4 substeps as well, and by 8 no more: the first that changes nothing does
        not end it, and where none may be missed, nothing but time.
        """
        flat = 0
        while trial is not None and trial.error(self.metric) > self.tolerance and trial.variant.engine != "exact":
            finer = replace(trial.variant, substeps=2 * trial.variant.substeps)
            if trial.status in ("refused", "stopped") or not self.space.sound(finer) or not self._goes_on():
                return
            if self.tolerance > 0.0 and finer.substeps > FAR * self.space.own(finer.engine).substeps:
                return
            found = self._try(finer, trial)
            before = trial.error(self.metric)
            if found is not None and math.isfinite(before) and found.error(self.metric) > FALLS * before:
                flat += 1
                if flat > FLAT and self.tolerance > 0.0:
                    return
            trial = found

    def _goes_on(self, share: float = 1.0) -> bool:
        return (
            len(self.trials) < share * self.most
            and self._left > (1.0 - share) * self.effort
            and working() < self.deadline
        )

    def _spent_on(self, engine: str) -> tuple[float, int]:
        """Return what an engine's trials have cost, and its place among the engines, which decides between equals."""
        spent = sum(trial.spent for variant, trial in self.trials.items() if variant.engine == engine)
        return spent, self.space.engines.index(engine)

    @property
    def _left(self) -> float:
        return self.effort - self.spent

    def _try(self, variant: Variant, parent: Trial | None = None) -> Trial | None:
        """Try a variant that was not tried, unless by its parent's counted cost it would cost too much."""
        if variant in self.trials:
            return self.trials[variant]
        limit, known = max(self.effort, LEAST), self.known.get(variant.engine)
        if parent is not None:
            limit, known = min(SLOW * self.effort, max(self._left, 0.0) / len(self.judges)), None
            if parent.cost * variant.work / parent.variant.work > limit:
                self.untried.add(variant)
                return None
        self.told(f"{len(self.trials) + 1} tried: {_called(variant)}")
        found = tried(variant, self.space, self.judges, limit, self.deadline, known)
        if found.status == "stopped" and working() >= self.deadline:
            self.untried.add(variant)
            return None
        self.trials[variant] = found
        self.spent += found.spent
        return found

    def _error(self, trial: Trial) -> float:
        """Return a trial's error, never 0: logarithms are taken of it."""
        return max(trial.error(self.metric), ENOUGH * (self.tolerance or 1.0))

    def _promising(self, trial: Trial) -> bool:
        """Tell whether to look around a trial: nothing on its engine outdoes it, or all there failed as it did."""
        if trial.status == "refused":
            return False
        same = [t for t in self.trials.values() if t.variant.engine == trial.variant.engine]
        good = [t for t in same if math.isfinite(t.error(self.metric))]
        if trial.status == "stopped":  # what takes less may get to its end, as long as nothing does
            return not good and trial.variant.work <= min(t.variant.work for t in same)
        if math.isinf(trial.error(self.metric)):  # what is finer may do better, as long as nothing does well
            if trial.status == "ok" and trial.metrics.get(self.metric) is None:
                return not good and trial is same[0]
            return not good and trial.variant.work >= max(t.variant.work for t in same)
        others = [(t.cost, LITTLE * self._error(t)) for t in good]
        return not outdone(trial.cost, self._error(trial), others, MARGIN)

    def _near_tolerance(self, trial: Trial) -> float:
        error, wanted = self._error(trial), self.tolerance or ENOUGH
        return abs(math.log(error / wanted)) if math.isfinite(error) else math.inf

    def _near_budget(self, trial: Trial) -> float:
        assert self.budget is not None
        return abs(math.log(max(trial.cost, 1e-9) / self.budget))

    def _cheap(self, trial: Trial) -> float:
        return trial.cost if math.isfinite(trial.error(self.metric)) else math.inf

    def _close_in(self) -> None:
        """Of what meets the tolerance, and is outdone by nothing, find the fewest substeps and iterations that do."""
        knobs = ("substeps", "iterations") if self.space.iterates else ("substeps",)
        for knob in knobs:
            for meeting in [t for t in self.trials.values() if self._meets(t) and t.variant.engine != "exact"]:
                if self._promising(meeting):
                    self._fewer(knob, meeting)

    def _meets(self, trial: Trial) -> bool:
        return trial.error(self.metric) <= self.tolerance

    def _fewer(self, knob: str, meeting: Trial) -> None:
        """Halve a number as long as the tolerance is met, then close the gap to what misses it."""
        while self._goes_on():
            value = getattr(meeting.variant, knob)
            less = _with(meeting.variant, knob, value // 2)
            found = self._try(less, meeting) if self.space.sound(less) else None
            if found is None:
                return
            if not self._meets(found):
                self._halve(knob, value // 2, value, meeting)
                return
            meeting = found

    def _halve(self, knob: str, low: int, high: int, meeting: Trial) -> None:
        while high - low > max(1, high // 8) and self._goes_on():
            middle = _with(meeting.variant, knob, (low + high) // 2)
            if not self.space.sound(middle):
                return
            found = self._try(middle, meeting)
            if found is None:
                return
            if self._meets(found):
                high = getattr(middle, knob)
            else:
                low = getattr(middle, knob)


def _with(variant: Variant, knob: str, value: int) -> Variant:
    return replace(variant, substeps=value) if knob == "substeps" else replace(variant, iterations=value)


def _called(variant: Variant) -> str:
    words = ", ".join(f"{key} {value}" for key, value in variant.words)
    steps = f"dt / {variant.finer}" if variant.finer != 1 else "dt"
    return f"{variant.engine}, {steps}, {variant.substeps} × {variant.iterations}{', ' if words else ''}{words}"
