"""Survival of levels: phases of a bullet, early stopping, verdicts of several starts, bounds of boundaries, costs."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sandbox.measure.extremes.boundary import Boundary, run_axis
from sandbox.measure.extremes.experiment import EngineSetup
from sandbox.measure.extremes.outcome import Outcome, Sample, Task, survived_tenths
from sandbox.measure.extremes.runner import ExtremesPlan, with_costs
from sandbox.measure.extremes.scenarios import AXES
from sandbox.measure.extremes.survival import (
    MAX_COST,
    StartSampling,
    Survival,
    is_below_held,
    survival,
    survival_bounds,
)
from sandbox.measure.extremes.worker import evaluate_task
from sandbox.measure.proportion import Proportion, wilson_interval

PYMUNK = EngineSetup("pymunk", "pymunk")
PASSED = Outcome("exact", "right", error=0.0)
FAILED = Outcome("failed", "it broke", "through")


def bullet(speed: float, engine: str, **changes: str) -> Survival:
    """Return the survival of a bullet that covers `speed` contact distances per step, from 200 starts."""

    def run_start(number: int) -> Outcome:
        return evaluate_task(Task("bullet", {"speed": speed}, engine, changes, start=number, spread=0.01))

    return survival(run_start, StartSampling(200)).run(run_start, to_end=True)


@pytest.mark.fail_slow(60)  # 1,200 runs
@pytest.mark.parametrize("engine", ["pymunk", "reference"])
@pytest.mark.parametrize("speed", [1.25, 2.0, 4.0])
def test_discrete_detection_stops_a_bullet_in_the_phases_that_end_in_contact(engine: str, speed: float) -> None:
    """A step of v·h ends within r + w/2 of the wall in the fraction (r + w/2)/(v·h) of the phases."""
    survived = bullet(speed, engine).survived
    assert survived is not None
    assert survived.trials == 200
    low, high = wilson_interval(survived.hits, survived.trials, 3.29)  # outside of it by chance: one in 1,000
    assert low <= 1.0 / speed <= high


@pytest.mark.fail_slow(60)  # 600 runs
@pytest.mark.parametrize(
    ("engine", "changes"),
    [("reference", {"integrator": "velocity_verlet", "detection": "swept"}), ("exact", {}), ("box2d", {})],
)
def test_continuous_detection_stops_a_bullet_in_every_phase(engine: str, changes: dict[str, str]) -> None:
    assert bullet(4.0, engine, **changes).survived == Proportion(200, 200)


@pytest.mark.fail_slow(60)  # some hundred runs
def test_boundary_of_the_bullet_is_where_5_percent_of_the_phases_tunnel() -> None:
    axis, samples = AXES["speed"], dict[float, Sample]()

    def keep(sample: Sample) -> None:
        samples[sample.level] = sample  # type: ignore[index]  # an axis has single levels

    found = run_axis(axis, PYMUNK, axis.levels, (), evaluate_task, keep, sampling=StartSampling(60))
    assert found.bounds is not None
    low, high = found.bounds
    assert low is not None and high is not None
    assert low <= 1.0 / 0.95 <= high
    assert found.limit is not None and found.first_failure is not None
    assert low <= found.limit < found.first_failure <= high
    # The limit passes in 57 of 60 starts or more, the first failure in 56 or fewer, and both are run from all of them.
    assert found.limit_survived is not None and found.failure_survived is not None
    assert found.limit_survived.hits >= 57 > found.failure_survived.hits
    assert found.limit_survived.trials == found.failure_survived.trials == 60
    assert samples[100.0].survived == Proportion(0, 4)  # the fourth failure decides


@pytest.mark.fail_slow(60)  # some runs
def test_single_start_is_the_one_of_the_scene() -> None:
    axis, tasks = AXES["speed"], list[Task]()

    def submit(task: Task) -> Outcome:
        tasks.append(task)
        return evaluate_task(task)

    found = run_axis(axis, PYMUNK, axis.levels, (), submit, lambda _: None, sampling=StartSampling(1))
    assert {task.start for task in tasks} == {0}
    assert found.limit == pytest.approx(1.0, rel=0.01)  # the accuracy of boundaries; the scene has the worst phase
    assert found.bounds == (found.limit, found.first_failure)
    assert (found.limit_survived, found.failure_survived) == (Proportion(1, 1), Proportion(0, 1))


@pytest.mark.fail_slow(60)  # long runs
@pytest.mark.parametrize(
    "axis", ["dt", "restitution", "gravity", "speed", "size_ratio", "light_hits_heavy", "offset", "friction"]
)
def test_exact_engine_has_no_error_from_perturbed_starts(axis: str) -> None:
    """The known solutions follow from the start, not from the constants of the scene."""
    for level in AXES[axis].levels[1:3]:
        for number in range(4):
            parameters = {AXES[axis].parameter: level}
            outcome = evaluate_task(Task(AXES[axis].case.name, parameters, "exact", start=number, spread=0.01))
            assert outcome.verdict == "exact", (level, number, outcome.reason)


def test_error_of_a_spring_does_not_depend_on_its_direction() -> None:
    """Other starts of the spring are turned about its anchor."""
    errors = [
        evaluate_task(Task("swing", {}, "reference", {"integrator": "rk4"}, start=number, spread=0.01)).error
        for number in range(4)
    ]
    assert errors == pytest.approx([errors[0]] * 4, rel=1e-6)  # 1e-16 of a length of 10 m in an error of 1e-6 m


def outcomes_of(passes: Sequence[bool]) -> list[Outcome]:
    """Return the outcomes of starts: first that of the scene."""
    return [PASSED if each else FAILED for each in passes]


@given(st.lists(st.booleans(), min_size=2, max_size=60), st.booleans())
def test_early_stop_gives_the_verdict_of_all_starts(passes: list[bool], own: bool) -> None:
    outcomes = outcomes_of([own, *passes])
    numbers: list[int] = []

    def run_start(number: int) -> Outcome:
        numbers.append(number)
        return outcomes[number]

    stopped = survival(run_start, StartSampling(len(passes)))
    runs = len(numbers)
    complete = stopped.run(run_start, to_end=True)
    assert numbers == list(range(len(outcomes)))
    assert stopped.is_failed == complete.is_failed == (sum(passes) < 0.95 * len(passes) - 1e-9)  # rounding of 0.95
    assert (stopped.outcome().verdict == "failed") == complete.is_failed
    assert complete.survived == Proportion(sum(passes), len(passes))
    # A level that passes is run to the end; one that fails up to the failure that decides.
    assert runs == len(outcomes) if not stopped.is_failed else not passes[runs - 2]


def survive(own: Outcome, *others: Outcome) -> Survival:
    outcomes = [own, *others]
    return survival(lambda number: outcomes[number], StartSampling(len(others)))


def test_level_has_the_largest_error_of_its_starts() -> None:
    off = Outcome("degraded", "off by 0.2", error=0.2)
    found = survive(PASSED, PASSED, off, Outcome("degraded", "not known")).outcome()
    assert (found.verdict, found.error, found.reason) == ("degraded", 0.2, "off by 0.2")
    assert survive(PASSED, PASSED, PASSED).outcome().verdict == "exact"


def test_level_with_a_failed_start_is_degraded_or_failed() -> None:
    passing = survive(PASSED, FAILED, *[PASSED] * 19)
    assert (passing.outcome().verdict, passing.outcome().rule) == ("degraded", None)
    assert passing.outcome().reason == "right; 1 of 20 starts failed, the first: it broke"
    failing = survive(PASSED, FAILED, *[PASSED] * 5, FAILED, *[PASSED] * 13)
    assert (failing.outcome().verdict, failing.outcome().rule) == ("failed", "through")
    assert failing.survived == Proportion(5, 7)
    assert len(failing.remaining) == 13


def test_failure_of_the_start_of_the_scene_does_not_fail_a_level_unless_it_is_not_repeatable() -> None:
    passing = survive(FAILED, *[PASSED] * 20).outcome()
    assert (passing.verdict, passing.reason) == ("degraded", "right; the start of the scene failed: it broke")
    repeated = survive(Outcome("failed", "another state", "repeat"), *[PASSED] * 20)
    assert (repeated.outcome().verdict, repeated.outcome().rule) == ("failed", "repeat")


def test_refused_starts_are_no_trials() -> None:
    refused = Outcome("refused", "no")
    assert survive(refused, PASSED, PASSED).survived is None
    assert survive(PASSED, refused, FAILED, PASSED).survived == Proportion(0, 1)
    assert survive(PASSED, refused, refused).survived == Proportion(1, 1)  # that of the scene


@pytest.mark.parametrize(
    ("cost", "slow", "trials"),
    [(0.0, False, 20), (MAX_COST, False, 20), (2.0 * MAX_COST, False, 10), (4.0 * MAX_COST, False, 5),
     (4.1 * MAX_COST, False, 1), (0.0, True, 1)],
)  # fmt: skip
def test_level_whose_runs_cost_much_has_fewer_starts(cost: float, slow: bool, trials: int) -> None:
    found = survival(lambda _: replace(PASSED, cost=cost, slow=slow), StartSampling(20))
    assert found.survived == Proportion(trials, trials)


@pytest.mark.parametrize(
    ("starts", "spread", "words"), [(0, 0.01, "starts: "), (20, 0.6, "spread: "), (20, -0.1, "is -")]
)
def test_impossible_starts_of_a_plan_raise(starts: int, spread: float, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ExtremesPlan(starts=starts, spread=spread)


def test_level_with_a_survival_of_95_percent_rarely_counts_as_one_below() -> None:
    """Odds by exact enumeration of the outcomes, for every number of starts that a level may have."""
    for trials in (1, 5, 12, 20, 60, 200):
        below = [k for k in range(trials + 1) if is_below_held(Proportion(k, trials))]
        assert sum(math.comb(trials, k) * 0.95**k * 0.05 ** (trials - k) for k in below) < 0.025
    # So many failures are the fewest with odds below 2.5 %: P(X >= 4 | 20) = 1.6 %, P(X >= 3 | 20) = 7.5 %.
    assert [is_below_held(Proportion(hits, 20)) for hits in (16, 17)] == [True, False]
    assert is_below_held(Proportion(9300, 10_000))  # its terms are beyond the range of a float


ALL, MOST, FEW, TWO = Proportion(20, 20), Proportion(19, 20), Proportion(10, 20), Proportion(0, 2)


@pytest.mark.parametrize(
    ("survived", "limit", "bounds"),
    [
        ({1.0: ALL, 2.0: ALL}, 2.0, (2.0, None)),
        ({1.0: ALL, 2.0: TWO}, 1.0, (1.0, 2.0)),
        ({1.0: ALL, 2.0: MOST, 3.0: Proportion(18, 20), 4.0: FEW}, 2.0, (1.0, 4.0)),  # 18 of 20 may be 95 %
        ({1.0: MOST, 2.0: ALL, 3.0: TWO}, 2.0, (None, 3.0)),
        ({1.0: Proportion(18, 20), 2.0: ALL, 3.0: TWO}, None, (None, 3.0)),
        ({1.0: None, 2.0: ALL, 3.0: TWO}, 2.0, (2.0, 3.0)),
        ({1.0: ALL, 2.0: TWO, 3.0: ALL}, 1.0, (1.0, 2.0)),
        ({1.0: ALL, 2.0: Proportion(17, 20), 3.0: Proportion(16, 20)}, 1.0, (1.0, 3.0)),  # 17 of 20 may be 95 %
        ({1.0: Proportion(1, 1), 2.0: Proportion(0, 1)}, 1.0, (1.0, 2.0)),  # the only start decides
    ],
)
def test_bounds_are_the_levels_at_which_survival_is_certain(survived, limit, bounds):
    assert survival_bounds(survived, limit, (1.0, 4.0)) == bounds
    # the same on an axis that falls
    falling = {-level: found for level, found in reversed(survived.items())}
    mirrored = survival_bounds(falling, None if limit is None else -limit, (-1.0, -4.0))
    assert mirrored == tuple(None if level is None else -level for level in bounds)


def test_tenths_are_those_of_failed_levels_with_survivors() -> None:
    sample = Sample("speed", 1.0, "pymunk", {}, "pymunk", FAILED, FEW)
    assert survived_tenths(sample) == 5
    assert survived_tenths(replace(sample, survived=TWO)) is None
    assert survived_tenths(replace(sample, outcome=PASSED, survived=MOST)) is None
    assert survived_tenths(replace(sample, survived=None)) is None


def test_cost_is_that_of_the_easiest_level_relative_to_pymunk() -> None:
    costs = {("speed", "pymunk"): 0.5, ("speed", "exact"): 2.0, ("friction", "pymunk"): 1.0, ("friction", "exact"): 3.0}
    costs |= {("stack", "exact"): 1.0}
    cells, limits = [], []
    for (axis, setup), cost in costs.items():
        for level in AXES[axis].levels[:2]:  # the second costs more
            outcome = replace(PASSED, cost=cost if level == AXES[axis].levels[0] else 7.0 * cost)
            cells.append(Sample(axis, level, setup, {}, setup, outcome))
        limits.append(Boundary(axis, setup, {}, setup, 2.0, 3.0, ""))
    plan = ExtremesPlan(tuple(AXES[name] for name in ("speed", "friction", "stack")), pairs=())
    found = {(each.axis, each.setup): each for each in with_costs(limits, cells, plan)}
    assert [each.cost_ratio for each in found.values()] == [1.0, 4.0, 1.0, 3.0, None]
    # Levels of the speed are proportional to the step, those of friction are not.
    assert [each.limit_at_equal_cost for each in found.values()] == [2.0, 0.5, None, None, None]
