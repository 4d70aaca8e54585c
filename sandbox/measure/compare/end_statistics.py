"""Statistics of the end of a scene over perturbed starts: of a setting, and of the method that gives the truth.

After the time up to which the truth of positions is trusted, errors of single bodies are unknown, or as large with any
setting if motion is chaotic. A good setting still ends as the truth's method does on average: the pile as high, as many
balls pocketed. Each measure (`compare.end_measures`) is compared as a distribution over the same starts. It differs if
an exchange test says so, adjusted for the number of measures, and if the distance of the samples exceeds a tolerance.
The test rounds values to the tolerance, so that smaller differences do not count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from sandbox.arrays import FloatArray
from sandbox.formatting import format_plural, format_quantity
from sandbox.jsonable import in_json
from sandbox.measure.compare.end_measures import END_MEASURES, EndMeasure
from sandbox.measure.compare.ground_truth import Truth, run_cost
from sandbox.measure.compare.metrics import EvaluationContext
from sandbox.measure.paired_samples import PairedDifference, adjusted_p_values
from sandbox.measure.run.bounded_run import RunTimeoutError, bounded_run
from sandbox.measure.run.recorder import TooLargeError
from sandbox.measure.starts import Starts, allowed_failures
from sandbox.scene.description.world import Settings
from sandbox.schedule import schedule

MIN_END_STARTS = 10
"""Fewest starts of a comparison: with fewer, the exchange test can find no difference in one of seven measures."""
MAX_P_VALUE = 0.05
"""Probability, adjusted for the number of measures, below which distributions differ"""
EARLY_STARTS = 10
"""Starts after which a setting may be known to differ"""
EARLY_P_VALUE = 0.01
"""Adjusted probability for that: such an early look adds at most 1 % to the settings that are rejected by chance"""
MAX_COARSENING = 4
"""Largest factor by which the step of the truth's method is lengthened so that its runs cost less. With a step four
times as long, the ends of `double_pendulum`, `table_tennis`, `conveyor` and a heap of five bodies did not differ over
12 to 20 starts."""
SETTLING_TIME = 1.0
"""s; a difference of speeds does not count if it moves a body by less than the tolerance of lengths in this time"""
COST_MARGIN = 10.0
"""Factor of the expected counted cost at which a run from another start is stopped"""


@dataclass(frozen=True)
class EndStatistic:
    """One measure of the end over perturbed starts: its distribution for a setting and for the truth."""

    name: str
    unit: str
    """unit; empty for a count"""
    about: str
    """description"""
    compared: PairedDifference = field(metadata=in_json(inline=True))
    """values of the setting against those of the truth"""
    tolerance: float
    """distance of the distributions that does not count, in the unit"""
    adjusted_p_value: float
    """p-value, adjusted for the number of measures"""

    json_properties: ClassVar = ("differs",)

    @property
    def text(self) -> str:
        """Mean and standard deviation of the setting, such as `0.412 ± 0.003`; `≠` if they differ from the truth's."""
        return f"{'≠ ' if self.differs else ''}{_mean_text(self.compared.mean, self.compared.deviation)}"

    @property
    def truth_text(self) -> str:
        """Mean and standard deviation of the truth."""
        return _mean_text(self.compared.other_mean, self.compared.other_deviation)

    @property
    def differs(self) -> bool:
        """Whether the distributions differ, and by more than the tolerance."""
        return self.adjusted_p_value < MAX_P_VALUE and self.compared.distance > self.tolerance

    def __str__(self) -> str:
        """Return the difference of the means with its interval: `height +3 mm (95 % interval 1 to 5 mm)`."""
        value, low, high = (
            _signed(each, self.unit) for each in (self.compared.difference, self.compared.low, self.compared.high)
        )
        return f"{self.name.replace('_', ' ')} {value} (95 % interval {low} to {high})"


def _mean_text(mean: float, deviation: float) -> str:
    """Return a mean to the second significant digit of its standard deviation: `0.4123 ± 0.0031`."""
    digits = 2 if deviation == 0.0 else min(max(1 - math.floor(math.log10(deviation)), 0), 6)
    return f"{mean:.{digits}f} ± {deviation:.{digits}f}".replace("-", "−")


def _signed(value: float, unit: str) -> str:
    """Return a value with its sign and unit: `−3.1 mm`."""
    text = format_quantity(float(f"{abs(value):.2g}"), unit)
    return f"{'−' if value < 0.0 else '+'}{text}" if value else text


@dataclass(frozen=True)
class EndStatistics:
    """Statistics of the end over perturbed starts, of a setting against those of the truth."""

    starts: int
    """number of starts from which the truth's method reached its end"""
    failed: int
    """those of them from which the setting did not"""
    statistics: tuple[EndStatistic, ...]
    """each measure that the scene has"""

    json_properties: ClassVar = ("is_alike",)

    @property
    def differing(self) -> tuple[EndStatistic, ...]:
        """Statistics that differ from those of the truth."""
        return tuple(each for each in self.statistics if each.differs)

    @property
    def is_alike(self) -> bool:
        """Whether no more than 5 % of the runs failed and no measure differs."""
        return self.failed <= allowed_failures(self.starts) and not self.differing

    def __str__(self) -> str:
        """Return in one clause whether the ends differ from those of the truth, and in what."""
        count = format_plural(self.starts, "start")
        if self.failed > allowed_failures(self.starts):
            return f"its run failed in {self.failed} of {count}"
        if self.is_alike:
            return f"no difference of its ends from the truth's was found over {count}"
        return f"its ends differ from the truth's over {count}: {'; '.join(map(str, self.differing))}"


@dataclass(frozen=True, eq=False)
class EndEnsemble:
    """Runs of a scene from perturbed starts, of which only the end is kept."""

    starts: Starts
    truth: Truth
    tolerance: float
    """m, difference of lengths that does not count"""
    count: int
    """number of starts that the effort allows"""
    coarsening: int = 1
    """factor by which the step of the truth's method is lengthened"""
    _reference: dict[int, FloatArray | None] = field(default_factory=dict, init=False, repr=False)
    """measures at the end of the truth's method, by the numbers of the starts; None: it failed"""

    @property
    def engine(self) -> str:
        """Engine of the truth's method."""
        found: str = self.truth.trajectory.info["engine"]
        return found

    @cached_property
    def settings(self) -> Settings:
        """Settings of the truth's method."""
        own = Settings.model_validate(self.truth.trajectory.info["settings"])
        return own.replace(dt=own.dt * self.coarsening, record_every=1)

    @property
    def cost(self) -> float:
        """Counted cost of one run of the truth's method, s."""
        return run_cost(self.starts.scene, self.truth.trajectory) / self.coarsening

    @cached_property
    def measures(self) -> tuple[EndMeasure, ...]:
        """Measures that the scene has."""
        context = EvaluationContext(self.starts.scene, None)
        return tuple(each for each in END_MEASURES if each.applies(context))

    def compare(
        self, engine: str, settings: Settings, numbers: range, cost: float = math.inf, *, stops_early: bool = False
    ) -> EndStatistics | None:
        """Compare the ends of a setting with those of the truth's method.

        None if too few runs of the latter succeed, or the duration is no whole number of steps of the setting, since
        some engines would then end later.

        Args:
            engine: name of the engine.
            settings: the setting.
            numbers: of the starts.
            cost: expected counted cost of one run, s; one that costs far more is stopped and counts as failed.
            stops_early: stop once too many runs failed, or after `EARLY_STARTS` starts if these clearly differ.
        """
        if schedule(self.starts.scene.world.duration, settings.dt)[-1].part:
            return None
        starts = failed = 0
        both: list[tuple[FloatArray, FloatArray]] = []
        for number in numbers:
            expected = self._reference_end(number)
            if expected is None:
                continue
            own = self._end(engine, settings, number, COST_MARGIN * cost)
            both += [] if own is None else [(own, expected)]
            starts, failed = starts + 1, failed + (own is None)
            is_hopeless = failed > allowed_failures(len(numbers))
            if stops_early and (is_hopeless or (starts == EARLY_STARTS and self._differs_early(both))):
                break
        if starts < MIN_END_STARTS and not failed:
            return None
        return EndStatistics(starts, failed, self._statistics(both))

    def _differs_early(self, both: Sequence[tuple[FloatArray, FloatArray]]) -> bool:
        """Return whether the first starts show a difference that more starts would hardly take back."""
        return any(each.differs and each.adjusted_p_value <= EARLY_P_VALUE for each in self._statistics(both))

    def _statistics(self, both: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[EndStatistic, ...]:
        """Return the statistics of the measures of which enough are defined.

        Args:
            both: measures of the setting and of the truth's method from each start, (k,) each.
        """
        if len(both) < MIN_END_STARTS:
            return ()
        own, other = (np.array([pair[side] for pair in both]) for side in (0, 1))
        tolerances = {"m": self.tolerance, "m/s": self.tolerance / SETTLING_TIME, "": 0.0}
        compared: list[tuple[EndMeasure, PairedDifference]] = []
        for k, measure in enumerate(self.measures):
            defined = ~(np.isnan(own[:, k]) | np.isnan(other[:, k]))
            if defined.sum() >= MIN_END_STARTS:
                compared.append(
                    (measure, PairedDifference.of(own[defined, k], other[defined, k], tolerances[measure.unit]))
                )
        # A measure whose values are all equal cannot differ and does not count as a test (R. E. Tarone, A modified
        # Bonferroni method for discrete data, Biometrics 46 (1990) 515-522).
        tested = [each.p_value for _, each in compared if not each.is_constant]
        adjusted = iter(adjusted_p_values(tested))
        return tuple(
            EndStatistic(
                each.name, each.unit, each.about, own, tolerances[each.unit], 1.0 if own.is_constant else next(adjusted)
            )
            for each, own in compared
        )

    def _reference_end(self, number: int) -> FloatArray | None:
        if number not in self._reference:
            self._reference[number] = self._end(self.engine, self.settings, number, COST_MARGIN * self.cost)
        return self._reference[number]

    def _end(self, engine: str, settings: Settings, number: int, limit: float) -> FloatArray | None:
        """Return the measures at the end of a run, (k,); None if it failed or costs more than a limit, s."""
        scene = self.starts.start(number)
        steps = math.ceil(scene.world.duration / settings.dt)
        only_end = settings.replace(record_every=max(steps, 1))
        try:
            found, _ = bounded_run(scene, engine, only_end, limit, audit=False)
        except (RunTimeoutError, TooLargeError):
            return None
        if found.status != "ok":
            return None
        context = EvaluationContext(scene, None)
        return np.array([each.measure(found, context) for each in self.measures])


def end_ensemble(
    context: EvaluationContext, starts: Starts, base: Settings, count: int, effort: float, tolerance: float
) -> EndEnsemble | None:
    """Return the ensemble of a scene whose truth is not trusted to its end.

    None if it is, no truth is known, its starts do not differ, or the effort does not allow
    `MIN_END_STARTS`.

    Args:
        context: scene and truth.
        starts: perturbed starts of the scene.
        base: settings of the study: the truth's method keeps to a shorter step.
        count: number of starts asked for.
        effort: counted work that the runs of the truth's method may take, s.
        tolerance: m, difference of lengths that does not count.
    """
    if context.truth is None or context.until >= context.scene.world.duration or not starts.can_vary:
        return None
    if count < MIN_END_STARTS:
        return None
    run = context.truth.trajectory
    once, step = run_cost(starts.scene, run), float(run.info["settings"]["dt"])
    coarsening = 1
    is_exact = context.truth.kind == "exact"
    while coarsening < MAX_COARSENING and not is_exact and 2 * coarsening * step < base.dt:
        if once * count / coarsening <= effort:
            break
        coarsening *= 2
    affordable = math.floor(effort * coarsening / once) if once > 0.0 else count
    if affordable < MIN_END_STARTS:
        return None
    return EndEnsemble(starts, context.truth, tolerance, min(count, affordable), coarsening)
